"""Completion in the shells that are installed: test_completion.py PATH_OF_KSCHUR FOLDER, which has the scripts.

Bash is asked by its own variables, and each shell by a terminal, where keys are pressed.
"""
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from checks import check, run_tests
from program import KSCHUR, kschur

SCRIPTS = Path(sys.argv[2]).resolve()
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
COMMANDS = re.findall(r"^  kschur (\w+) ", kschur("help").stdout, re.M)
COMMANDS = list(dict.fromkeys(COMMANDS))
ASK = f"""source "{SCRIPTS / 'kschur.bash'}"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _kschur; printf '%s\\n' "${{COMPREPLY[@]}}" """


def bash(*words):
    """What bash offers for the last of these words."""
    run = subprocess.run(["bash", "--norc", "-c", ASK, "bash", "kschur", *words], capture_output=True, text=True)
    check(f"bash {' '.join(words)}: no complaint", run.returncode == 0 and not run.stderr, run.stderr)
    return [word for word in run.stdout.splitlines() if word]


def possible(*words):
    """What the program says that it wants in the place of a wrong name."""
    found = re.search(r"wants (?:one of )?(.*), not 'x'", kschur(*words).stderr)
    return re.split(", | or ", found[1]) if found else []


def test_bash(_):
    check("bash: commands", bash("") == COMMANDS and bash("--") == ["--help", "--version"], bash(""))
    check("bash: a command by its beginning", bash("se") == ["sensitivity"], bash("se"))
    check("bash: help", bash("help", "s") == [name for name in COMMANDS if name[0] == "s"])
    scenes = re.findall("^([a-z-]+): ", kschur("help", "scene").stdout, re.M)
    check("bash: scenes", bash("scene", "") == bash("help", "scene", "") == bash("sweep", "") == scenes)
    check("bash: files are left to bash", bash("solve", "") == bash("solve", "a.h5", "--output", "") == [])
    check("bash: short options", {"-m", "-o", "-q"} <= set(bash("solve", "a.h5", "-")))
    for command in COMMANDS:
        if command == "help":
            continue
        text = kschur("help", command).stdout.split("\nbeam-body: ")[0]
        named = {name for line in text.splitlines() if line.startswith("  -") for name in OPTION.findall(line.split("   ")[0])}
        check(f"bash {command}: its options", set(bash(command, "--")) == named | {"--help"}, set(bash(command, "--")) ^ (named | {"--help"}))
    names = 0
    for command in ("solve", "compare", "info", "response", "sweep", "mac", "sensitivity"):
        for option in bash(command, "--"):
            wanted = possible(command, option, "x")
            if len(wanted) < 2 or not all(re.fullmatch("[a-z][a-z-]*", name) for name in wanted):
                continue
            names += 1
            for words in ([option, ""], [option, "="], [option, "=", wanted[-1][:1]]):
                first = words[-1].strip("=")
                expected = [name for name in wanted if name.startswith(first)]
                check(f"bash {command} {''.join(words)}: as the program says", sorted(bash(command, *words)) == sorted(expected),
                      (bash(command, *words), expected))
    check("bash: many names were compared", names > 25, names)
    for scene in scenes:
        listed = set(re.findall(r"^  (--[\w-]+)", kschur("help", "scene", scene).stdout, re.M))
        check(f"bash scene {scene}: its options", listed <= set(bash("scene", scene, "--")) and "--output" in bash("scene", scene, "--"))
        for option in listed:
            offered = bash("scene", scene, option, "")
            if offered:
                check(f"bash scene {scene} {option}: as the program says",
                      sorted(offered) == sorted(possible("scene", scene, option, "x", "--output", "/nonexistent/x") or
                                                possible("scene", scene, option, "x", "--output", "x.h5")), offered)


def in_terminal(command, setup, keys, wanted, environment, seconds=20):
    """Whether a shell that is told `setup` shows a text after the keys."""
    child, terminal = pty.fork()
    if child == 0:
        os.execvpe(command[0], command, {**os.environ, "TERM": "xterm", **environment})
    shown = b""
    try:
        for text, until in ((setup + "\n", b"ready-7"), (keys, wanted.encode())):
            os.write(terminal, text.encode())
            shown, end = b"", time.monotonic() + seconds
            while until not in shown.replace(b"\x1b[0m", b"") and time.monotonic() < end:
                if select.select([terminal], [], [], 0.2)[0]:
                    shown += os.read(terminal, 65536)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(terminal)
    return wanted.encode() in shown, shown[-600:]


SHELLS = {
    "bash": (["bash", "--norc", "-i"], f"source '{SCRIPTS / 'kschur.bash'}'; echo ready-$((3 + 4))"),
    "zsh": (["zsh", "-f", "-i"], f"fpath=('{SCRIPTS}' $fpath); autoload -U compinit; compinit -u -D; echo ready-$((3 + 4))"),
    "fish": (["fish", "--no-config", "-i"], f"source '{SCRIPTS / 'kschur.fish'}'; echo ready-(math 3 + 4)"),
}
SCRIPT = {"bash": "kschur.bash", "zsh": "_kschur", "fish": "kschur.fish"}


def test_terminals(folder):
    here = {"HOME": str(folder), "PATH": f"{Path(KSCHUR).parent}:{os.environ['PATH']}"}
    for shell, (command, setup) in SHELLS.items():
        text = (SCRIPTS / SCRIPT[shell]).read_text()
        check(f"{shell}: the script has all commands", all(name in text for name in COMMANDS))
        check(f"{shell}: the script has an option and its names", "krylov-schur" in text and "max-restarts" in text)
        if not shutil.which(command[0]):
            print(f"        {shell} is not installed: no keys are pressed in it")
            continue
        checked = subprocess.run([command[0], "-n", SCRIPTS / SCRIPT[shell]], capture_output=True, text=True)
        check(f"{shell}: its grammar", checked.returncode == 0, checked.stderr)
        for keys, wanted in (("kschur sen\t", "sensitivity"), ("kschur solve a.h5 --max-r\t", "max-restarts"),
                             ("kschur solve a.h5 --method kry\t", "krylov-schur"), ("kschur solve a.h5 --normalise=disp\t", "displacement"),
                             ("kschur scene tur\t", "turbine"), ("kschur scene grid --mass lu\t", "lumped"),
                             ("kschur-mpi compare a.h5 --pre\t", "presolve")):
            found, shown = in_terminal(command, setup, keys, wanted, here)
            check(f"{shell}: {keys[:-1]}", found, shown)


run_tests(test_bash, test_terminals)
