"""Cases for read_cases: written into one file, read in one process, answered a line each."""
import os
import struct
import subprocess

# Of a batch; the reader itself ends where one case takes more than a minute of the processor.
SECONDS = 3600
ENVIRONMENT = dict(os.environ, OPENBLAS_NUM_THREADS="1",
                   ASAN_OPTIONS="allocator_may_return_null=1:max_allocation_size_mb=4000:detect_leaks=1",
                   UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1")
CRASHED = b"crashed"
# Over a case, not at the end.
BROKE_DOWN = CRASHED + b": "
# HDF5 forgets what it had of a damaged object that it could not open.
SUPPRESSIONS = "leak:libhdf5\n"


def answers(reader, cases, folder):
    """A line for each case (how, bytes); `crashed` and why where the reader broke down over it, or took too long."""
    lines, crashes = [], 0
    (folder/"suppressions").write_text(SUPPRESSIONS)
    environment = dict(ENVIRONMENT, LSAN_OPTIONS=f"suppressions={folder/'suppressions'}:print_suppressions=0")
    while len(lines) < len(cases) and crashes < 20:
        with open(folder/"cases", "wb") as file:
            for how, content in cases[len(lines):]:
                file.write(struct.pack("=8sq", how.encode().ljust(8), len(content)) + content)
        try:
            run = subprocess.run([reader, folder/"cases", folder/"case"], stdin=subprocess.DEVNULL, capture_output=True,
                                 env=environment, timeout=SECONDS)
            found, why = run.stdout, b"status %d: %s" % (run.returncode, run.stderr[-2000:]) if run.returncode else b""
        except subprocess.TimeoutExpired as timeout:
            found, why = timeout.stdout or b"", b"no end"
        # What follows the last line end is part of an answer.
        whole = found.split(b"\n")[:-1]
        lines += whole
        if len(lines) < len(cases):
            crashes += 1
            lines.append(BROKE_DOWN + why)
        elif why:
            # Leaks, which are told in the end.
            lines[-1] = CRASHED + b" at the end: " + why
    return lines + [b"not tried"]*(len(cases) - len(lines))
