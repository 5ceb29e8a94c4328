#!/usr/bin/python3
"""A solve that was killed goes on to the same digits: test_checkpoint.py KSCHUR. Exit status 0: all is well.

Runs are killed once their checkpoint is there, and go on from it: what they write is compared bit by bit with what a run wrote
that nobody killed, but for seconds and memory.
"""
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

from checks import check, finish

KSCHUR = os.path.abspath(sys.argv[1])


def command(*words):
    return [KSCHUR, *map(str, words), "--threads", "1"]


def run(*words):
    done = subprocess.run(command(*words), capture_output=True, text=True)
    return done.returncode, done.stderr


def contents(path):
    """What a result holds, without what it took."""
    held = {}
    with h5py.File(path) as file:
        for name, value in file.attrs.items():
            if not name.startswith("seconds") and name != "peak_memory_bytes":
                held["attribute " + name] = bytes(value.tobytes() if hasattr(value, "tobytes") else str(value).encode())
        file.visititems(lambda name, item: held.update({name: item[()].tobytes()}) if isinstance(item, h5py.Dataset) else None)
    return held


def kill_at_checkpoint(checkpoint, delay, *words):
    """Whether it was killed, and not done before; a checkpoint is there then."""
    child = subprocess.Popen(command(*words, "--checkpoint", checkpoint), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    while not checkpoint.exists() and child.poll() is None:
        time.sleep(0.001)
    time.sleep(delay)
    child.send_signal(signal.SIGKILL)
    child.communicate()
    return child.returncode == -signal.SIGKILL


def test_resumed(folder, name, problem, *options):
    words = ("solve", problem, "--quiet", *options)
    whole, output, checkpoint = folder/"whole.h5", folder/"resumed.h5", folder/f"{name}.checkpoint"
    began = time.monotonic()
    status, errors = run(*words, "--output", whole)
    seconds = time.monotonic() - began
    check(f"{name}: solved", status == 0, errors)
    expected = contents(whole)
    killed = 0
    for part in (0, 0.3):
        checkpoint.unlink(missing_ok=True)
        killed += kill_at_checkpoint(checkpoint, part*seconds, *words)
        check(f"{name}: there is a checkpoint", checkpoint.exists())
        status, errors = run(*words, "--resume", checkpoint, "--output", output)
        check(f"{name}: resumed", status == 0, errors)
        found = contents(output)
        check(f"{name}: the same bits", found == expected,
              [key for key in expected.keys() | found.keys() if expected.get(key) != found.get(key)])
    check(f"{name}: was killed", killed > 0)
    return checkpoint


def with_checksum(data):
    """The same words with the checksum that belongs to them."""
    words = np.frombuffer(data, "u8")[:-1]
    total, prime, mask = 14695981039346656037, 1099511628211, 2**64 - 1
    for word in [*words.tolist(), words.nbytes]:
        total = (total ^ word)*prime & mask
        total ^= total >> 32
    return words.tobytes() + total.to_bytes(8, "little")


def test_refused(folder, checkpoint, problem, other, *options):
    """What is not the checkpoint of this solve ends in one line and exit status 2."""
    def refused(what, path, problem=problem, options=options, says=""):
        status, errors = run("solve", problem, "--quiet", *options, "--resume", path)
        check(f"refused: {what}", status == 2 and errors.count("\n") == 1 and str(path) in errors and says in errors,
              f"{status} {errors}")

    data = checkpoint.read_bytes()
    damaged = folder/"damaged"
    for place in (0, 50, 200, len(data)//3, len(data)//2, len(data) - 1):
        damaged.write_bytes(data[:place] + bytes([data[place] ^ 16]) + data[place + 1:])
        refused(f"byte {place} changed", damaged)
    for length in (0, 7, 8, 400, len(data)//2, len(data) - 8, len(data) - 1):
        damaged.write_bytes(data[:length])
        refused(f"cut to {length} bytes", damaged)
    check("checkpoint: the checksum of kschur_archive.c", with_checksum(data) == data)
    version = re.search(rb"(?:\d\0{7})(?:\.\0{7}\d\0{7}){2}", data)
    damaged.write_bytes(with_checksum(data[:version.start()] + b"9" + data[version.start() + 1:]))
    refused("of another version", damaged, says="not a checkpoint of this version")
    damaged.write_bytes(data + b"12345678")
    refused("something behind it", damaged)
    # The checksum of what ends with its own checksum was zero once.
    for length in (1, 8, 16, 65536, 65536 - len(data)%65536 + 8):
        damaged.write_bytes(data + bytes(length))
        refused(f"{length} zeros behind it", damaged)
    refused("a problem in its place", problem)
    refused("no file", folder/"none")
    refused("a folder", folder)
    refused("a pipe", "/dev/stdin")
    refused("another problem", checkpoint, problem=other, says="another problem")
    refused("other options", checkpoint, options=(*options[:-1], "13"), says="other options")
    for words in (("--formulation", "dense"), ("--method", "arpack")):
        status, errors = run("solve", other, "--quiet", "--checkpoint", folder/"none", *words)
        check(f"refused: {words[1]}", status == 1 and errors.count("\n") == 1 and "checkpoint" in errors, f"{status} {errors}")
    status, errors = run("solve", problem, "--quiet", "--checkpoint", problem)
    check("refused: the problem would be replaced", status == 1 and "would replace the problem" in errors, f"{status} {errors}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        grid, damped, turbine, band = (folder/f"{name}.h5" for name in ("grid", "damped", "turbine", "band"))
        for words in (("grid", "--cells", "30x20", "--output", grid), ("grid", "--cells", "12x8", "--output", damped),
                      ("turbine", "--output", turbine), ("grid", "--cells", "24x16", "--output", band)):
            if subprocess.run([KSCHUR, "scene", *map(str, words)], capture_output=True).returncode != 0:
                sys.exit(f"no scene {words}")
        lanczos = test_resumed(folder, "Lanczos", grid, "--subspace", "60", "--modes", "40")
        test_refused(folder, lanczos, grid, damped, "--subspace", "60", "--modes", "40")
        test_resumed(folder, "Lanczos in blocks", grid, "--subspace", "80", "--block", "4", "--modes", "40")
        test_resumed(folder, "Lanczos without restarts", grid, "--modes", "60")
        test_resumed(folder, "quadratic, real", turbine, "--subspace", "50", "--modes", "20", "--left")
        test_resumed(folder, "quadratic, complex", turbine, "--subspace", "50", "--shift", "0,5", "--target", "0,5", "--modes", "16")
        test_resumed(folder, "pencil, complex", damped, "--formulation", "damped-constrained", "--subspace", "40", "--modes", "12")
        test_resumed(folder, "low rank", band, "--formulation", "low-rank", "--modes", "40")
        test_resumed(folder, "band", band, "--band", "0,3")
    finish()


main()
