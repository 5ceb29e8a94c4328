#!/usr/bin/python3
"""Signals end a run soon, and what it writes is whole: test_interrupts.py KSCHUR [--all | --model FILE --points N ...].

A signal is sent at even parts of a run. Exit status 0: all is well. --all takes models and formulations that take minutes,
at 5, 10, ..., 95 per cent, and prints how long each run went on: the seconds it computed after the signal, the part of all its
seconds that this is, and in which step it was.
"""
import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py

parser = argparse.ArgumentParser()
parser.add_argument("kschur")
parser.add_argument("--all", action="store_true")
parser.add_argument("--model", help="a problem file in place of the models of this test")
parser.add_argument("--options", default="", help="of the solve of --model")
parser.add_argument("--points", type=int)
arguments = parser.parse_args()
KSCHUR = os.path.abspath(arguments.kschur)
TICKS = os.sysconf("SC_CLK_TCK")
# What a shell starts in the background does not hear it, nor do its children.
signal.signal(signal.SIGINT, signal.default_int_handler)
failures = []


def check(what, passed, detail=""):
    if not passed:
        print(f"FAILS {what}  [{detail}]", flush=True)
        failures.append(what)


def start(words):
    return subprocess.Popen([KSCHUR, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                            env=dict(os.environ, OPENBLAS_NUM_THREADS="1"))


def seconds_so_far(pid):
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12]))/TICKS


def finish(child):
    """Its output and errors, and the seconds that it computed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out, errors = child.communicate()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return out, errors, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def eigenvalues(result):
    return [complex(*mode["eigenvalue"]) for mode in result["modes"]]


def interrupt(words, at, number):
    """Sends a signal when so many seconds were computed: the child, its output, its errors, seconds before and after."""
    child = start(words)
    before = 0
    while child.poll() is None and before < at:
        time.sleep(0.002)
        try:
            before = seconds_so_far(child.pid)
        except (FileNotFoundError, ProcessLookupError):
            break
    began = time.monotonic()
    child.send_signal(number)
    out, errors, total = finish(child)
    return child, out, errors, total - before, time.monotonic() - began


def interrupts(words, seconds, points, prepare=lambda: None):
    """Signals at even parts of a run that took so many seconds: each part, and what `interrupt` says. Where others use the
    machine the first run may have computed longer than this one: what came to its end says how long it takes, and is done again."""
    for i in range(1, points + 1):
        for _ in range(4):
            prepare()
            child, out, errors, after, wall = interrupt(words, seconds*i/(points + 1), (signal.SIGINT, signal.SIGTERM)[i % 2])
            if child.returncode != 0:
                break
            seconds *= 0.8
        yield i/(points + 1), child, out, errors, after, wall


def test_solve(label, words, points, folder):
    """Signals during a solve: the modes that had converged are those of the whole run."""
    output = folder/"modes.h5"
    words = ["solve", *words, "--threads", "1", "--format", "json", "--output", str(output)]
    child = start(words)
    out, errors, seconds = finish(child)
    check(f"{label}: the whole run", child.returncode in (0, 3), errors)
    known = eigenvalues(json.loads(out))
    worst, ended, most = (0, 0, 0), 0, 0
    for share, child, out, errors, after, wall in interrupts(words, seconds, points, lambda: output.unlink(missing_ok=True)):
        what = f"{label}: at {share:.0%}"
        if child.returncode < 0:
            # While it read there was nothing to keep.
            check(f"{what}, nothing is written while it reads", not output.exists() and not out)
            continue
        if child.returncode not in (0, 3):
            check(f"{what}, an end like this", False, (child.returncode, errors))
            continue
        result = json.loads(out)
        check(f"{what}, the exit status", child.returncode == (3 if result["reason"] == "interrupted" else 0), errors)
        if child.returncode == 0:
            continue
        ended += 1
        found = eigenvalues(result)
        most = max(most, len(found))
        if arguments.model:
            print(f"{what}: {after:.2f} s, {len(found)} modes", flush=True)
        worst = max(worst, (after, share, wall))
        check(f"{what}, one line of errors", errors.count("\n") == 1 and "interrupted" in errors, errors)
        check(f"{what}, {len(found)} modes are modes", all(min(abs(value - other) for other in known)
                                                          <= 1e-6*max(map(abs, known)) for value in found))
        written = subprocess.run([KSCHUR, "info", str(output), "--format", "json"], capture_output=True, text=True)
        check(f"{what}, it is written", written.returncode == 0 and json.loads(written.stdout)["reason"] == "interrupted",
              written.stderr)
    check(f"{label}: some runs were interrupted", ended > 0)
    print(f"{label}: {seconds:.2f} s; {ended} of {points} interrupted, with up to {most} modes; the longest went on for "
          f"{worst[0]:.2f} s ({worst[2]:.2f} s by the clock), after {worst[1]:.0%}", flush=True)
    check(f"{label}: no other files", sorted(path.name for path in folder.iterdir() if "partial" in path.name) == [])


def test_sweep(folder):
    """A signal ends a sweep with the points before."""
    words = ("sweep", "turbine", "--vary", "speed=0.5:12:41", "--modes", "4", "--threads", "1", "--format", "csv")
    whole, errors, seconds = finish(start(words))
    whole = whole.splitlines()
    ended = 0
    for share, child, out, errors, after, wall in interrupts((*words, "--output", str(folder/"sweep.h5")), seconds, 3):
        if child.returncode == 0:
            continue
        ended += 1
        points = [line.split(",")[1] for line in out.splitlines()[1:]]
        check(f"sweep interrupted at {share:.0%}: {len(points)} points", child.returncode == 3
              and errors.count("\n") == 1 and "interrupted" in errors and 0 < len(points) <= 41 and (folder/"sweep.h5").exists()
              and points == [line.split(",")[1] for line in whole[1:len(points) + 1]], errors)
    check("sweep: some runs were interrupted", ended > 0)


def test_compare(problem):
    """A signal ends a comparison with the methods before."""
    words = ("compare", problem, "--modes", "10", "--threads", "1")
    whole, errors, seconds = finish(start(words))
    ended = longest = 0
    for share, child, out, errors, after, wall in interrupts(words, seconds, 3):
        if child.returncode == 0:
            continue
        ended += 1
        longest = max(longest, after)
        check(f"compare: at {share:.0%}", child.returncode == 3 and errors.count("\n") == 1
              and "interrupted" in errors and "method" in out, (child.returncode, errors, out))
    check("compare: some runs were interrupted", ended > 0)
    print(f"compare: {seconds:.2f} s; {ended} of 3 interrupted, the longest went on for {longest:.2f} s", flush=True)


def test_response(folder, problem):
    """A signal ends a response with the frequencies before, which are those of the whole run."""
    output = folder/"response.h5"
    words = ("response", problem, "--frequencies", "0.1:2:20", "--input", "7", "--format", "csv", "--output", str(output))
    whole, errors, seconds = finish(start(words))
    whole = whole.splitlines()
    check("response: the whole run", len(whole) == 21 and not errors, errors)
    ended = longest = 0
    for share, child, out, errors, after, wall in interrupts(words, seconds, 4, lambda: output.unlink(missing_ok=True)):
        lines = out.splitlines()
        if child.returncode == 0:
            check("response: whole, or not", lines == whole)
            continue
        ended += 1
        longest = max(longest, after)
        with h5py.File(output) as file:
            check(f"response: at {share:.0%}, {len(lines) - 1} frequencies", child.returncode == 3
                  and errors.count("\n") == 1 and f"interrupted after {len(lines) - 1} of 20" in errors
                  and lines == whole[:len(lines)] and file["response"].shape[0] == len(file["frequency_hz"]) == len(lines) - 1,
                  (child.returncode, errors, out))
    check("response: some runs were interrupted", ended > 0)
    print(f"response: {seconds:.2f} s; {ended} of 4 interrupted, the longest went on for {longest:.2f} s", flush=True)


def test_sensitivity(label, problem, changed, modes):
    """A signal ends it with the rates of the modes that have converged."""
    words = ("sensitivity", problem, changed, "--modes", str(modes), "--threads", "1", "--format", "json")
    whole, errors, seconds = finish(start(words))
    known = [complex(mode["eigenvalue_re"], mode["eigenvalue_im"]) for mode in json.loads(whole)]
    check(f"{label}: the whole run", len(known) == modes and not errors, errors)
    ended = longest = 0
    for share, child, out, errors, after, wall in interrupts(words, seconds, 9):
        what = f"{label}: at {share:.0%}"
        if child.returncode < 0:
            check(f"{what}, nothing is said while it reads", not out)
            continue
        if child.returncode == 0:
            continue
        ended += 1
        longest = max(longest, after)
        whole = out.startswith("[") and out.endswith("]\n")
        check(what, whole and child.returncode == 3 and errors.count("\n") == 1 and "interrupted" in errors,
              (child.returncode, errors, out))
        for mode in json.loads(out if whole else "[]"):
            value = complex(mode["eigenvalue_re"], mode["eigenvalue_im"])
            check(f"{what}, a mode is one", min(abs(value - other) for other in known) <= 1e-6*max(map(abs, known)), value)
    check(f"{label}: some runs were interrupted", ended > 0)
    print(f"{label}: {seconds:.2f} s; {ended} of 9 interrupted, the longest went on for {longest:.2f} s", flush=True)


def test_two_signals(problem):
    """A SIGINT and a SIGTERM are two signals, also where both come before one is heard: the second ends the program."""
    words = ("solve", problem, "--modes", "10", "--threads", "1")
    _, _, seconds = finish(start(words))
    for numbers in ((signal.SIGINT, signal.SIGTERM), (signal.SIGTERM, signal.SIGINT)):
        ended = []
        for part in (0.3, 0.4, 0.5, 0.6):
            child = start(words)
            while child.poll() is None and Path(f"/proc/{child.pid}").exists() and seconds_so_far(child.pid) < part*seconds:
                time.sleep(0.002)
            # Both wait until it goes on.
            for number in (signal.SIGSTOP, *numbers, signal.SIGCONT):
                child.send_signal(number)
            finish(child)
            ended.append(child.returncode)
        check(f"two signals: {' and '.join(number.name for number in numbers)}", min(ended) < 0 and 3 not in ended, ended)


def scene(folder, name, *options):
    path = folder/f"{name}.h5"
    subprocess.run([KSCHUR, "scene", name, *options, "--output", str(path)], check=True, stdout=subprocess.DEVNULL)
    return str(path)


# Of each model, and how many modes: the crank has no more that oscillate, but thousands that are overdamped alike.
FORMULATIONS = {"grid": (40, ["proportional", "quadratic", "damped-constrained"]),
                "crank": (20, ["quadratic", "damped-constrained"])}

with tempfile.TemporaryDirectory() as name:
    place = Path(name)
    if arguments.model:
        test_solve(f"{Path(arguments.model).name} {arguments.options}", [arguments.model, *arguments.options.split()],
                   arguments.points or 19, place)
    elif arguments.all:
        models = {"grid": scene(place, "grid", "--cells", "60x42"), "crank": scene(place, "crank", "--density", "5")}
        for model, path in models.items():
            modes, formulations = FORMULATIONS[model]
            for formulation in formulations:
                test_solve(f"{model}, {formulation}", [path, "--modes", str(modes), "--formulation", formulation], 19, place)
        test_solve("grid, a band", [models["grid"], "--band", "0.2,2"], 19, place)
        test_solve("grid, certified, left vectors", [models["grid"], "--formulation", "quadratic", "--certify", "--left",
                                                     "--modes", "20"], 19, place)
    else:
        test_sweep(place)
        grid = scene(place, "grid", "--cells", "20x14")
        test_compare(grid)
        test_response(place, grid)
        (place/"changed").mkdir()
        test_sensitivity("sensitivity of a grid", grid, scene(place/"changed", "grid", "--cells", "20x14", "--mass", "lumped"), 20)
        rotor = ("rotor", "--elements", "600")
        test_two_signals(scene(place, *rotor))
        test_sensitivity("sensitivity of a rotor", scene(place, *rotor), scene(place/"changed", *rotor, "--speed", "3100"), 10)
        for options in ([], ["--formulation", "quadratic", "--certify"], ["--formulation", "damped-constrained"],
                        ["--band", "0.2,1"]):
            test_solve(" ".join(["grid", *options]), [grid, *(options if "--band" in options else [*options, "--modes", "20"])],
                       4, place)
print(f"{len(failures)} failed")
sys.exit(bool(failures))
