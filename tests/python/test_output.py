#!/usr/bin/python3
"""What is written is whole or not there: test_output.py KSCHUR LOG_CALLS. Exit status 0: all is well.

Runs are killed while they write, two write the same output, names are planted in their way, the disk is full. What they ask
of the system is told by the library LOG_CALLS (tests/support/log_calls.c).
"""
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from checks import check, finish

KSCHUR, LOG_CALLS = map(os.path.abspath, sys.argv[1:])


def start(*words, **options):
    environment = dict(os.environ, OPENBLAS_NUM_THREADS="1", **options.pop("more", {}))
    return subprocess.Popen([KSCHUR, *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                            env=environment, **options)


def run(*words, **options):
    child = start(*words, **options)
    errors = child.communicate()[1]
    return child.returncode, errors


def strays(folder):
    return [path.name for path in folder.iterdir() if "partial" in path.name]


def scene(output, cells="20x14"):
    return "scene", "grid", "--cells", cells, "--output", output


def test_killed(folder):
    """Killed at any moment there is nothing, or the whole; what is left goes when the same is written again."""
    draw = random.Random(1)
    for output in (folder/"grid.h5", folder/"grid"):
        left = whole = 0
        for _ in range(25):
            child = start(*scene(output))
            deadline = time.monotonic() + 10
            while not strays(folder) and child.poll() is None and time.monotonic() < deadline:
                pass
            time.sleep(draw.random()*0.03)
            child.send_signal(signal.SIGKILL)
            child.communicate()
            left += bool(strays(folder))
            if output.exists():
                whole += 1
                names = sorted(os.listdir(output)) if output.is_dir() else []
                check(f"killed: {output.name} is whole", run("info", output)[0] == 0
                      and (not names or names == ["Cq.mtx", "K.mtx", "M.mtx", "R.mtx"]), names)
                subprocess.run(["rm", "-r", str(output)], check=True)
        check(f"killed: {output.name}, {left} runs of 25 left something, {whole} were done", left > 0)
        check(f"killed: {output.name}, written again", run(*scene(output))[0] == 0 and not strays(folder), strays(folder))


def test_two_writers(folder):
    """Neither fails; the last one has it."""
    for name in ("both.h5", "both"):
        output = folder/name
        for _ in range(10):
            writers = [start(*scene(output, cells)) for cells in ("6x4", "8x6", "6x4", "8x6")]
            ends = [(writer.communicate()[1], writer.returncode) for writer in writers]
            check(f"four writers of {name}: none fails", ends == [("", 0)]*4, ends)
        if output.suffix:
            check(f"four writers of {name}: it is whole", run("info", output)[0] == 0)
        check(f"four writers of {name}: nothing else is left", not strays(folder), strays(folder))


def test_planted(folder):
    """Links that lie where temporary names could be are not followed."""
    victim = folder/"victim"
    victim.write_text("stays")
    output = folder/"planted.h5"
    (folder/"planted.h5.partial-abcdef").symlink_to(victim)
    inner = folder/"planted.h5.partial-ghijkl"
    inner.mkdir()
    (inner/"link").symlink_to(folder)
    check("links planted: written", run(*scene(output, "2x1"))[0] == 0 and run("info", output)[0] == 0)
    check("links planted: what they lead to stays", victim.read_text() == "stays" and not inner.exists())
    check("the file has the permissions of any other", output.stat().st_mode & 0o777 == victim.stat().st_mode & 0o777)
    matrices, plain = folder/"planted", folder/"plain"
    plain.mkdir()
    check("a new folder has the permissions of any other", run(*scene(matrices, "2x1"))[0] == 0
          and matrices.stat().st_mode == plain.stat().st_mode)
    output.unlink()
    os.mkfifo(output)
    status, errors = run(*scene(output, "2x1"))
    check("an output that is a pipe is refused", status == 4 and errors.count("\n") == 1 and "a pipe or a device" in errors
          and output.is_fifo(), (status, errors))
    output.unlink()
    output.symlink_to(victim)
    check("an output that is a link is replaced", run(*scene(output, "2x1"))[0] == 0 and not output.is_symlink()
          and victim.read_text() == "stays")


def test_order(folder):
    """Under a random name, and on the disk, before it gets its own; then the folder that has the name."""
    for output, names in ((folder/"grid.h5", [""]), (folder/"grid", ["", *(f"/{name}.mtx" for name in ("M", "K", "R", "Cq"))])):
        log, stagings = folder/f"{output.name}.calls", []
        for _ in range(2):
            log.unlink(missing_ok=True)
            status, errors = run(*scene(output, "2x1"), more={"LD_PRELOAD": LOG_CALLS, "LOG_CALLS": str(log),
                                                              "ASAN_OPTIONS": "verify_asan_link_order=0"})
            check(f"order: {output.name} is written", status == 0, errors)
            calls = [line.split("\t") for line in log.read_text().splitlines()]
            stagings.append(calls[0][1])
            whole = f"{stagings[-1]}/whole"
            check(f"order: {output.name}, a random name beside it", calls[0][0] == "mkdtemp"
                  and os.path.dirname(whole[:-6]) == str(folder) and not os.path.exists(stagings[-1]), calls)
            renamed = calls.index(["rename", whole, str(output)])
            check(f"order: {output.name}, all of it on the disk before", {call[1] for call in calls[1:renamed]}
                  == {whole + name for name in names} and all(call[0] == "fsync" for call in calls[1:renamed]), calls)
            check(f"order: {output.name}, the folder on the disk after", calls[renamed + 1:] == [["fsync", str(folder), ""]], calls)
            subprocess.run(["rm", "-r", str(output)], check=True)
        check(f"order: {output.name}, another name each time", stagings[0] != stagings[1], stagings)


def test_folders(folder):
    """An empty folder is filled, others keep what else is in them; `.` is a folder."""
    place = folder/"place"
    place.mkdir()
    for name in (place, "."):
        check(f"scene into {name}", run(*scene(name, "2x1"), cwd=place)[0] == 0 and not strays(folder) and not strays(place))
        (place/"notes.txt").write_text("stays")
    check("scene into a folder: undamped, R.mtx is gone", run(*scene(place, "2x1"), "--damping", "none")[0] == 0
          and sorted(os.listdir(place)) == ["Cq.mtx", "K.mtx", "M.mtx", "notes.txt"], os.listdir(place))


def test_full_disk(folder):
    """A limit on the size of files stands for it. libgfortran leaks a unit that it cannot flush: that is not looked at."""
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000))
    for name in ("full.h5", "full"):
        status, errors = run(*scene(folder/name), preexec_fn=limit, more={"ASAN_OPTIONS": "detect_leaks=0"})
        check(f"a full disk: {name}", status == 4 and errors.count("\n") == 1 and name in errors, (status, errors))
        check(f"a full disk: no {name}", not (folder/name).exists() and not strays(folder), os.listdir(folder))


for test in (test_killed, test_two_writers, test_planted, test_order, test_folders, test_full_disk):
    with tempfile.TemporaryDirectory() as name:
        test(Path(name))
finish()
