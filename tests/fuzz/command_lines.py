"""Command lines at random: options of each command with wild values, repeated, cut, huge, with bytes that are no text.

A command ends with a documented exit status; below 3 in one line on standard error that moves no cursor; soon; and leaves
its outputs whole or not there.
"""
import json
import os
import random
import re
import resource
import shutil
import subprocess

import h5py

import hdf5_files
from cases import ENVIRONMENT

SECONDS = 120
LONGEST = 240
# MAX_ARG_STRLEN of Linux, without the zero at its end: no program is begun with a longer one.
LONGEST_WORD = 2**17 - 1
MOVES_CURSOR = re.compile(rb"[\x00-\x1f\x7f]|\xc2[\x80-\x9f]|(?<![\x80-\xff])[\x80-\xbf]")
NUMBERS = (b"0", b"1", b"2", b"3", b"6", b"-1", b"+1", b"1.5", b"1e3", b"-1e-3", b"1e308", b"1e309", b"-1e308", b"1e-320", b"nan", b"inf",
           b"2147483647", b"2147483648", b"-2147483648", b"4294967297", b"9223372036854775807", b"9223372036854775808",
           b"-9223372036854775808", b"99999999999999999999999", b"0x10", b"1d2", b"1,5", b"1_000", b".", b"-", b"+", b"1e", b"")
PAIRS = (b"0,1", b"1,0", b"0,0", b"0.05,0.5", b"-1,1", b",", b"1,", b",1", b"1,2,3", b"nan,1", b"0,inf", b"1e308,-1e308", b"0+1i", b"0,1e-320",
         b"1:2:3", b"speed=1:12:3", b"=", b"x=1:1:1", b"mass=1:2:2147483648")
WORDS = (b"auto", b"symmetric", b"proportional", b"quadratic", b"dense", b"damped", b"undamped-constrained-zero", b"low-rank", b"krylov-schur",
         b"arpack", b"fair", b"plain", b"mumps", b"ldl", b"iterative", b"none", b"scalar", b"row", b"mass", b"displacement", b"length",
         b"lower", b"upper", b"no",
         b"json", b"csv", b"table", b"best", b"Auto", b"aut", b"x"*300, b"x"*5000, b"\xc3\xa9", b"\x1b[2J", b"\x7f", b"\xc2\x9b2J", b"\xff\xfe",
         b"a\nb", b"a\rb", b"\xe2\x80\xae", b"$HOME", b"*", b"--", b"-h", b"--output", b"%s%n", b"' or 1", b"/", b"/dev/null", b"/dev/full", b".",
         b"..", b"no/such/folder")
PLACES = (b"problem.h5", b"result.h5", b"matrices", b"matrices/M.mtx", b"matrices/K.mtx", b"matrices/Cq.mtx", b"nothing.h5", b"empty", b"-")
OUTPUTS = (b"out.h5", b"out.json", b"out", b"out.mtx", b"problem.h5", b"result.h5", b"matrices", b"no/out.h5", b"/dev/null", b"/dev/full", b"", b"\xff.h5",
           b"x"*300, b"a\nb.h5", b"-")
COMMANDS = (b"solve", b"solve", b"solve", b"info", b"compare", b"scene", b"mac", b"sensitivity", b"sweep", b"view", b"help", b"", b"slove", b"SOLVE")
SCENES = (b"grid", b"spring-chain", b"beam-body", b"pendulum", b"rotor", b"crank", b"nothing", b"")


def options_of(kschur):
    """Every option that a help text names."""
    texts = [subprocess.run([kschur, "help", *topic], capture_output=True, env=ENVIRONMENT).stdout for topic in
             ([], *([name.decode()] for name in sorted(set(COMMANDS)) if name.islower() and name not in (b"help", b"slove")))]
    return sorted(set(re.findall(rb"--[a-z][a-z-]*", b" ".join(texts))))


def make(seed, number, options):
    draw = random.Random(f"commands {seed} {number}")
    command = draw.choice(COMMANDS)
    words = [command]
    if command in (b"scene", b"sweep"):
        words.append(draw.choice(SCENES))
    elif command in (b"mac", b"view"):
        words += [b"result.h5"]*draw.choice((1, 2))
    else:
        words.append(draw.choice((b"problem.h5", b"problem.h5", b"matrices") + PLACES))
    for _ in range(draw.choice((0, 1, 1, 2, 3, 6))):
        option = draw.choice(options)
        words.append(option)
        if option == b"--output":
            words.append(draw.choice(OUTPUTS))
        elif option in (b"--mass", b"--stiffness", b"--damping", b"--constraints"):
            words.append(draw.choice(PLACES))
        elif draw.random() < 0.85:
            words.append(draw.choice(draw.choice((NUMBERS, NUMBERS, PAIRS, WORDS))))
    for _ in range(draw.choice((0, 0, 0, 1, 2))):
        change_words(draw, words, options)
    return [word.replace(b"\0", b"")[:LONGEST_WORD] for word in words]


def change_words(draw, words, options):
    at = draw.randrange(len(words))
    change = draw.randrange(6)
    if change == 0:
        words.insert(at, words[draw.randrange(len(words))])
    elif change == 1:
        words[at] = words[at][:draw.randrange(len(words[at]) + 1)]
    elif change == 2:
        words.insert(at, bytes(draw.randrange(1, 256) for _ in range(draw.randrange(1, 8))))
    elif change == 3:
        del words[at]
        words.append(draw.choice(options))
    elif change == 4:
        words[at] = words[at]*draw.choice((2, 100))
    else:
        words[at] += b"=" + draw.choice(NUMBERS)


def prepare(template, arguments):
    template.mkdir()
    (template/"result.h5").write_bytes(hdf5_files.write_result(arguments.kschur, template))
    (template/"sound.h5").rename(template/"problem.h5")
    (template/"empty").write_bytes(b"")
    (template/"matrices").mkdir()
    banner = "%%MatrixMarket matrix coordinate real general\n"
    for name, text in (("M", "2 2 2\n1 1 1\n2 2 1\n"), ("K", "2 2 3\n1 1 2\n2 2 2\n1 2 -1\n"), ("Cq", "1 2 1\n1 1 1\n")):
        (template/"matrices"/f"{name}.mtx").write_text(banner + text)


def limit():
    # A size that is asked for fills no disk; the sanitizers want addresses without limit.
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**28, 2**28))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))


def judge(kschur, words, place, limits=limit):
    """What is wrong with what the program does; empty where nothing is."""
    try:
        run = subprocess.run([os.fsencode(kschur), *words], cwd=place, capture_output=True, stdin=subprocess.DEVNULL, timeout=10*SECONDS,
                             env=ENVIRONMENT, preexec_fn=limits)
    except subprocess.TimeoutExpired:
        return "no end"
    lines = run.stderr.split(b"\n")[:-1]
    if run.returncode not in (0, 1, 2, 3, 4):
        return f"exit status {run.returncode}: {run.stderr[-1500:]}"
    if run.returncode in (1, 2, 4) and (len(lines) != 1 or not lines[0].startswith(b"kschur: ")):
        return f"exit status {run.returncode} with {len(lines)} lines: {run.stderr[-1500:]}"
    if any(len(line) > LONGEST or MOVES_CURSOR.search(line) for line in lines if line.startswith(b"kschur: ")):
        return f"a line that is too long or moves the cursor: {run.stderr}"
    return broken_output(place)


def broken_output(place):
    """Files that are half written, or should not be there."""
    for path in place.rglob("*"):
        if b".partial-" in os.fsencode(path.name):
            return f"{path.name} is left"
        if path.is_file() and path.name.endswith(".h5"):
            try:
                h5py.File(path).close()
            except OSError:
                return f"{path.name} is no HDF5 file"
        if path.is_file() and path.name.endswith(".json"):
            try:
                json.loads(path.read_bytes())
            except ValueError:
                if not path.read_bytes().startswith(b"\x89HDF"):
                    return f"{path.name} is broken"
    return ""


def run(arguments, folder):
    """Yields (name, the words, what is wrong) for what fails."""
    options = options_of(arguments.kschur)
    prepare(folder/"template", arguments)
    for number in range(arguments.number):
        place = folder/"place"
        shutil.copytree(folder/"template", place)
        words = make(arguments.seed, number, options)
        wrong = judge(arguments.kschur, words, place)
        shutil.rmtree(place)
        if wrong:
            yield f"{arguments.seed}-{number}.words", b"\0".join(words), f"{words}: {wrong}"
