"""What the program says of itself, and of words that it does not know: test_usage.py PATH_OF_KSCHUR."""
import os
import re
import subprocess
import sys
from pathlib import Path

from checks import check, run_tests
from program import KSCHUR, check_refused, kschur

SOURCE = Path(__file__).resolve().parents[2]
APP = SOURCE / "app"
COMMANDS = re.findall(r"^  kschur (?!help)(\w+)", kschur("help").stdout, re.M)
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")


def test_suggestions(folder):
    problem = folder / "chain.h5"
    kschur("scene", "spring-chain", "-o", problem)
    for words, hint in (
            (["slove", problem], "unknown command 'slove'; did you mean solve?"),
            (["sens", problem], "unknown command 'sens'; did you mean sensitivity?"),
            (["help", "solv"], "did you mean solve?"),
            (["solve", problem, "--mods", 3], "unknown option --mods; did you mean --modes?"),
            (["solve", problem, "-modes=3"], "unknown option -modes=3; did you mean --modes?"),
            (["solve", problem, "--max_restarts", 3], "did you mean --max-restarts?"),
            (["solve", problem, "--freq", 3], "did you mean --frequency?"),
            (["solve", problem, "--formulation", "Quadratc"], "not 'Quadratc'; did you mean quadratic?"),
            (["solve", problem, "--format", "jsn"], "did you mean json?"),
            (["--versoin"], "did you mean --version?"),
            (["scene", "turbin", "-o", problem], "did you mean turbine?"),
            (["scene", "grid", "--cell", "2x2", "-o", problem], "did you mean --cells?"),
            (["scene", "grid", "--mass", "lump", "-o", problem], "did you mean lumped?"),
            (["sweep", "turbin", "--vary", "speed=1:2:2"], "did you mean turbine?"),
            (["help", "scene", "pendelum"], "did you mean pendulum?")):
        name = " ".join(str(word) for word in words if word != problem)
        check_refused(name, 1, kschur(*words), hint)
    for words in (["dance"], ["solve", problem, "--colour"], ["solve", problem, "--formulation", "best"], ["solve", problem, "-x"],
                  ["solve", problem, "--" + 100000 * "x"]):
        run = kschur(*words)
        check(f"{words[-1][:20]}: nothing is suggested", run.returncode == 1 and "did you mean" not in run.stderr, run.stderr)


def test_short_options(folder):
    problem, result = folder / "short.h5", folder / "short_result.h5"
    run = kschur("scene", "spring-chain", "--masses", 6, "-o", problem)
    check("scene -o", run.returncode == 0 and problem.exists(), run)
    long = kschur("solve", problem, "--modes", 2, "--format", "csv", "--threads", 1)
    for words in (["-m", 2, "-f", "csv", "-t", 1, "-o", result, "-q"], ["-m=2", f"-o={result}", "-f=csv", "-t=1"]):
        result.unlink(missing_ok=True)
        run = kschur("solve", problem, *words)
        check(f"solve {' '.join(map(str, words[:6]))}: as the long ones", run.stdout == long.stdout and result.exists(), run)
    check("solve -b", kschur("solve", problem, "-b", "0,1", "-f", "csv").stdout == kschur("solve", problem, "--band=0,1", "--format=csv").stdout)
    check("info -v", "block" in kschur("info", result, "-v").stdout)
    check("-h", kschur("-h").stdout == kschur("--help").stdout and kschur("solve", "-h").stdout == kschur("help", "solve").stdout)
    check("-V", kschur("-V").stdout == kschur("--version").stdout)
    check_refused("solve -m 2 --modes 3", 1, kschur("solve", problem, "-m", 2, "--modes", 3), "--modes is given twice")
    check_refused("solve -m", 1, kschur("solve", problem, "-m", "-q"), "--modes wants a whole number")
    check_refused("mac -v", 1, kschur("mac", problem, problem, "-v"), "unknown option -v")


def test_help_names_every_option(folder):
    """That the program takes, by its own word on an option that it does not know, and no other."""
    def listed(text):
        return set(OPTION.findall(" ".join(line.split("   ")[0] for line in text.splitlines() if line.startswith("  -"))))

    taken = set(re.findall(r'take_\w+\("(--[a-z-]+)"', "".join(path.read_text() for path in APP.glob("*.f90"))))
    check("options in the sources: many", len(taken) > 40, taken)
    named = set().union(*(listed(kschur("help", command).stdout) for command in COMMANDS))
    check("help: every option of the sources", taken - named <= {"--help", "--version"}, taken - named)
    for command in COMMANDS:
        if command in ("convert", "scene"):
            continue
        options = listed(kschur("help", command).stdout)
        for option in sorted(options):
            run = kschur(command, option, "1", "--no-such-option")
            check(f"{command} {option}: is known", run.returncode == 1 and f"unknown option {option}" not in run.stderr, run.stderr)
        for option in sorted(taken - options - {"--help", "--version"}):
            run = kschur(command, f"{option}=1")
            check(f"{command} {option}: unknown, as in its help", f"unknown option {option}" in run.stderr, run.stderr)
    text = (APP / "cli_arguments.f90").read_text()
    short, long = (re.findall(r'"(-{1,2}[\w-]+)"', re.search(rf"{name}\(\*\) = \[(.*?)\]", text, re.S)[1]) for name in ("short_names", "long_names"))
    pairs = set(re.findall(r"(?<!-)(-\w), (--[a-z]+)", "".join(kschur("help", command).stdout for command in COMMANDS)))
    check("help: the short options", pairs | {("-h", "--help"), ("-V", "--version")} == set(zip(short, long)), pairs ^ set(zip(short, long)))


def test_texts_fit(folder):
    """Fortran cuts a text that is longer than those of its list, and says nothing."""
    lists = [(path.name, int(length), re.findall(r'"((?:[^"]|"")*)"', body)) for part in ("app", "capi/src", "examples/scenes", "src")
             for path in sorted((SOURCE / part).rglob("*.[fF]90"))
             for length, body in re.findall(r'\[character\(len=(\d+)\) ::((?:[^]"]|"(?:[^"]|"")*")*)\]', path.read_text())]
    check("lists of texts: many", len(lists) > 30, len(lists))
    cut = [(name, text) for name, length, texts in lists for text in texts if len(text.replace('""', '"')) > length]
    check("lists of texts: none is cut", not cut, cut)


def test_help_of_scripts(folder):
    """With what Python has alone: a reader of help may have installed no more."""
    (folder / "numpy.py").write_text("raise ImportError('NumPy is not here')")
    bare = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    scripts = [path for path in Path(KSCHUR).parent.glob("kschur-*") if path.read_bytes()[:2] == b"#!"]
    check("scripts beside the program", {"kschur-campbell", "kschur-convert", "kschur-picture"} <= {path.name for path in scripts}, scripts)
    others = ("docs/offline.py", "docs/scenes/pictures.py", "packaging/wheel/make_wheel.py", "benchmarks/losses.py", "benchmarks/paper.py",
              "benchmarks/solids.py", "bootstrap")
    for path in [*scripts, *(SOURCE / other for other in others)]:
        start = [sys.executable] if path.suffix == ".py" else []
        for word in ("--help", "-h"):
            run = subprocess.run([*start, path, word], capture_output=True, text=True, env=bare)
            check(f"{path.name} {word}: explains", run.returncode == 0 and path.name in run.stdout and not run.stderr, run)
    for path in scripts:
        if path.name in ("kschur-campbell", "kschur-picture"):
            run = subprocess.run([path], capture_output=True, text=True)
            check(f"{path.name} without words: says what it wants", run.returncode == 1 and path.name in run.stderr
                  and "Traceback" not in run.stderr, run)


def test_paper_with_an_installation(folder):
    """Which has no examples: figure 4b does without, and what cannot says so."""
    programs = folder / "bin"
    programs.mkdir()
    (programs / "kschur").symlink_to(KSCHUR)
    words = [sys.executable, SOURCE / "benchmarks/paper.py", "--programs", programs, "--output", folder / "paper"]
    run = subprocess.run([*words, "4b"], capture_output=True, text=True)
    rows = run.stdout.splitlines()
    check("paper.py 4b: three speeds, none unstable", run.returncode == 0 and len(rows) == 4 and all(row.endswith(" 0") for row in rows[1:]), run)
    check("paper.py 4b: a picture", (folder / "paper/figure-4b.png").exists())
    run = subprocess.run([*words, "4a"], capture_output=True, text=True)
    check("paper.py 4a: what it lacks", run.returncode == 1 and "example_turbine_scaling" in run.stderr and "Traceback" not in run.stderr, run)


run_tests(test_suggestions, test_short_options, test_help_names_every_option, test_texts_fit, test_help_of_scripts, test_paper_with_an_installation)
