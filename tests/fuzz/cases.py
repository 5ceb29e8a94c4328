"""Cases for read_cases: written into one file, read in one process, answered a line each."""
import os
import struct
import subprocess

SECONDS = 300
ENVIRONMENT = dict(os.environ, OPENBLAS_NUM_THREADS="1",
                   ASAN_OPTIONS="allocator_may_return_null=1:max_allocation_size_mb=4000:detect_leaks=1",
                   UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1")
CRASHED = b"crashed"
# What HDF5 says at the end of a process, where it could not open a damaged object and forgot to close it.
LEFT_OPEN = b"HDF5: infinite loop closing library"


def answers(reader, cases, folder):
    """A line for each case (how, bytes); `crashed` and why where the reader broke down over it, or took too long."""
    lines, crashes = [], 0
    while len(lines) < len(cases) and crashes < 20:
        with open(folder/"cases", "wb") as file:
            for how, content in cases[len(lines):]:
                file.write(struct.pack("=8sq", how.encode().ljust(8), len(content)) + content)
        try:
            run = subprocess.run([reader, folder/"cases", folder/"case"], stdin=subprocess.DEVNULL, capture_output=True,
                                 env=ENVIRONMENT, timeout=SECONDS)
            found, errors = run.stdout, run.stderr
        except subprocess.TimeoutExpired as timeout:
            found, errors = timeout.stdout or b"", b"no end"
        # What follows the last line end is part of an answer.
        whole = found.split(b"\n")[:-1]
        lines += whole
        if len(lines) < len(cases):
            crashes += 1
            lines.append(CRASHED + b": " + errors[-2000:])
        elif errors and not errors.startswith(LEFT_OPEN):
            # Leaks, which are told in the end.
            lines[-1] = CRASHED + b" at the end: " + errors[-2000:]
    return lines + [b"not tried"]*(len(cases) - len(lines))
