#!/usr/bin/python3
"""README and docs do what they say.

    test_docs.py FOLDER_OF_PROGRAMS SOURCE [--without-library] [PAGE ...]

- Blocks marked `console` are run, a page in a folder of its own, beside which are benchmarks, examples and python: `$ `
  begins a command, `> ` goes on with it, the rest is what it prints. A line `...` stands for any lines. Numbers may differ
  by 1e-4 of themselves; errors, which have two digits, by a factor of 100 or as anything below 1e-6; what is below 1e-9 as
  anything below that; lines of effort and seconds in all. A command must succeed unless the next one is `echo $?`.
  `console minutes` is not run: the mark says that it takes minutes. `console library` is what needs the C library in Python, which
  does not load one with sanitizers: with --without-library it is not run.
- A `python` or `fortran` block whose first line is a comment with a name, `# write.py`, is that file.
- A `fortran` or `c` block below a line that links to a program of examples is a part of it, `...` apart.
- Options of `kschur` in other blocks and in the text must be in its help.
- Links lead to files; names `kschur_...` are names in the sources.

Exit status 0: all is well. FOLDER_OF_PROGRAMS/kschur must be there.
"""
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAMS, SOURCE = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
LIBRARY = PROGRAMS.parent / "capi" / "libkschur_capi.so"
WITHOUT_LIBRARY = "--without-library" in sys.argv
PAGES = [Path(page).resolve() for page in sys.argv[3:] if page != "--without-library"] or sorted([*SOURCE.glob("*.md"), *SOURCE.glob("docs/**/*.md")])
FENCE = re.compile(r"^```(.*)$")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.]*\d)")
SMALL = re.compile(r"^\d\.\d[eE][-+]\d\d$|^0$")
END = "end of the output of a command, status "
failures = []


def check(what, passed, more=""):
    if not passed:
        failures.append(what)
        print(f"FAILS {what}\n{more}".rstrip())


def blocks_of(text):
    """(language, line, lines) of each block; what stands between fences and indented lines has the language ''."""
    blocks, language, lines, first = [], None, [], 0
    for number, line in enumerate(text.splitlines(), 1):
        fence = FENCE.match(line)
        if fence and language is None:
            language, lines, first = fence.group(1).strip(), [], number + 1
        elif fence:
            blocks.append((language, first, lines))
            language = None
        elif language is not None:
            lines.append(line)
        else:
            blocks.append(("", number, [line]))
    return blocks


def commands_of(lines):
    """Commands and what each is to print."""
    commands = []
    for line in lines:
        if line.startswith("$ "):
            commands.append((line[2:], []))
        elif line.startswith("> ") and commands and not commands[-1][1]:
            commands[-1] = (commands[-1][0] + "\n" + line[2:], [])
        else:
            commands[-1][1].append(line.rstrip())
    return commands


def run(commands, folder):
    """The output of each command and its status."""
    script = "".join(f"{command}\nkschur_status=$?\nprintf '\\n{END}%s\\n' $kschur_status\n(exit $kschur_status)\n"
                     for command, _ in commands)
    environment = dict(os.environ, PATH=f"{PROGRAMS}:{os.environ['PATH']}", PYTHONDONTWRITEBYTECODE="1")
    # Else the package is installed.
    if LIBRARY.exists():
        environment.update(PYTHONPATH=str(SOURCE / "python"), KSCHUR_LIBRARY=str(LIBRARY))
    python = f'python3() {{ "{sys.executable}" "$@"; }}\n'
    done = subprocess.run(["sh", "-c", python + script], cwd=folder, env=environment, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True)
    results, lines = [], []
    for line in done.stdout.splitlines():
        if line.startswith(END):
            # The line feed that came before the mark.
            results.append((lines[:-1] if lines and not lines[-1] else lines, int(line[len(END):])))
            lines = []
        else:
            lines.append(line.rstrip())
    return results


def same_number(expected, actual):
    if expected == actual:
        return True
    a, b = float(expected), float(actual)
    if SMALL.match(expected) and SMALL.match(actual):
        return b < max(1e-6, 100*a)
    if not set(expected + actual) & set(".eE"):
        return False
    if abs(a) < 1e-9:
        return abs(b) < 1e-9
    return abs(a - b) <= 1e-4*max(abs(a), abs(b))


def same_line(expected, actual):
    for word in ("effort ", "seconds "):
        if expected.startswith(word):
            return actual.startswith(word)
    numbers = NUMBER.findall(expected), NUMBER.findall(actual)
    texts = [" ".join(NUMBER.sub(" # ", line).split()) for line in (expected, actual)]
    return texts[0] == texts[1] and len(numbers[0]) == len(numbers[1]) and all(map(same_number, *numbers))


def same_lines(expected, actual):
    if not expected:
        return not actual
    if expected[0] == "...":
        return any(same_lines(expected[1:], actual[skipped:]) for skipped in range(len(actual) + 1))
    return bool(actual) and same_line(expected[0], actual[0]) and same_lines(expected[1:], actual[1:])


def run_page(page, name, blocks):
    """How many commands were run."""
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        for part in ("benchmarks", "examples", "python"):
            (Path(folder) / part).symlink_to(SOURCE / part)
        for language, line, lines in blocks:
            named = re.match(r"^[#!] ([\w.-]+\.(?:py|f90))$", lines[0]) if lines else None
            if named and language in ("python", "fortran"):
                (Path(folder) / named.group(1)).write_text("\n".join(lines) + "\n")
            if language != "console" and (language != "console library" or WITHOUT_LIBRARY):
                continue
            commands = commands_of(lines)
            results = run(commands, folder)
            count += len(commands)
            check(f"{name}:{line}: the block runs to its end", len(results) == len(commands))
            for k, ((command, expected), (printed, status)) in enumerate(zip(commands, results)):
                told = k + 1 < len(commands) and commands[k + 1][0] == "echo $?"
                check(f"{name}:{line}: {command}", same_lines(expected, printed) and (status == 0 or told),
                      "\n".join([f"status {status}, it prints", *printed]))
    return count


def options_of(command):
    done = subprocess.run([PROGRAMS / "kschur", "help", command], capture_output=True, text=True)
    return set(re.findall(r"--[a-z][a-z0-9-]*", done.stdout)) | {"--help"}


def check_options(name, blocks, known):
    for language, line, lines in blocks:
        for text in lines:
            for command in re.findall(r"\bkschur ((?:solve|compare|scene|info)\b[^;|`&#()]*)", text):
                for option in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", command):
                    check(f"{name}:{line}: kschur {command.split()[0]} knows {option}", option in known[command.split()[0]])


def check_links(page, name, text):
    for target in re.findall(r"\]\(([^)\s#]+)[^)\s]*\)", text):
        if not re.match(r"\w+:", target):
            check(f"{name}: there is {target}", (page.parent / target).exists())


def check_parts(name, text):
    """Parts of programs are in the programs."""
    link = r"^.*\]\(([^)\s]*examples/[^)\s]+\.(?:f90|c))\)[^\n]*\n\n```(?:fortran|c)\n(.*?)^```"
    for path, part in re.findall(link, text, re.M | re.S):
        program = ((SOURCE / name).parent / path).read_text()
        for line in part.splitlines():
            check(f"{name}: {path} has `{line.strip()}`", line.strip() in program or line == "...")


def names_in_sources():
    names = set()
    for folder in ("src", "capi", "app", "python", "with", "without", "cmake", "benchmarks", "examples", "tests"):
        for path in (SOURCE / folder).rglob("*"):
            if path.is_file() and path.suffix in (".f90", ".F90", ".inc", ".h", ".c", ".py", ".pf", ".txt", ".cmake", ".in"):
                names.update(re.findall(r"\bkschur_\w+", path.read_text(errors="replace")))
                names.add(path.stem)
    return names


def main():
    known = {command: options_of(command) for command in ("solve", "compare", "scene", "info")}
    names = names_in_sources()
    for page in PAGES:
        name, text = str(page.relative_to(SOURCE)), page.read_text()
        blocks = blocks_of(text)
        check_options(name, blocks, known)
        check_links(page, name, text)
        check_parts(name, text)
        for word in set(re.findall(r"`(kschur_\w+)`", text)):
            check(f"{name}: the sources have {word}", word in names)
        count = run_page(page, name, blocks)
        print(f"{name}: {count} commands run")
    print(f"{len(failures)} failures")
    sys.exit(bool(failures))


main()
