"""Pages for man, made of the help texts: make_manual.py PATH_OF_KSCHUR FOLDER [SCRIPT ...]

Writes kschur.1 and kschur-COMMAND.1 of each command, and of each script beside it what its --help says. A script that cannot be
run, as Python lacks what it takes, is left out.
"""
import re
import subprocess
import sys
from pathlib import Path

from help_texts import LISTED, MEANING, OPTION, SCENE, read_help, run


def escaped(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text[:1] in ".'" else text


def literal(lines):
    return [".PP", ".nf", *(escaped(line) for line in lines), ".fi"] if lines else []


def option_item(short, name, value):
    spellings = [f"\\fB{escaped(word)}\\fR" for word in (short, name) if word]
    return ".TP\n" + ", ".join(spellings) + (f" \\fI{escaped(value)}\\fR" if value else "")


def body(lines):
    """Paragraphs, options with their meanings, and lines that are kept as they are because they are indented."""
    text, kept, inside = [], [], False
    for line in [*lines, ""]:
        option = OPTION.match(line)
        if option and option[4] and not LISTED.match(line):
            text += literal(kept) + [option_item(*option.groups("")[:3]), escaped(option[4])]
            kept, inside = [], True
        elif inside and line and line[:MEANING].isspace():
            text.append(escaped(line.strip()))
        elif line.startswith("  "):
            kept.append(line)
            inside = False
        else:
            text += literal(kept)
            kept, inside = [], False
            scene = SCENE.match(line)
            if scene:
                text += [f".SS {escaped(scene[0].strip(': '))}", escaped(line[scene.end():])]
            else:
                text.append(escaped(line) if line else ".PP")
    return re.sub(r"^(\.PP\n)+|(\.PP\n)+(?=\.(PP|TP|SS)|\Z)", "", "\n".join(text) + "\n")


def page(name, summary, synopsis, text, others, version):
    usage = "\n.br\n".join(escaped(line) for line in synopsis)
    also = ", ".join(f"\\fB{escaped(other)}\\fR(1)" for other in others if other != name)
    return (f'.TH {escaped(name).upper()} 1 "" "{version}" "User Commands"\n.SH NAME\n{escaped(name)} \\- {escaped(summary)}\n'
            + (f".SH SYNOPSIS\n{usage}\n" if usage else "") + f".SH DESCRIPTION\n{text}.SH SEE ALSO\n{also}\n")


def help_of_script(path):
    """Its name, what it is in a few words, and the lines of its help; none where it cannot be run."""
    try:
        lines = run(path, "--help")
    except (OSError, subprocess.CalledProcessError):
        print(f"without a page for {path.name}, which takes more of Python")
        return None
    text = "\n".join(lines).split("\n\n", 1)[1] if lines[0].startswith("usage:") else lines[0]
    return path.name, re.split(r": |, |\.\s", text.replace("\n", " "))[0], lines


def main(program, folder, *scripts):
    every, _ = read_help(program)
    version = run(program, "--version")[0]
    found = [found for found in (help_of_script(Path(script)) for script in scripts) if found]
    pages = [(f"kschur-{command.name}".strip("-"), command) for command in every if command.name != "help"]
    names = [name for name, _ in pages] + [name for name, _, _ in found]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, command in pages:
        first = next(i for i, line in enumerate(command.lines) if not line.startswith("kschur ")) if command.name else 0
        synopsis = command.lines[:first] or ["kschur COMMAND [words and options]"]
        text = page(name, command.summary, synopsis, body(command.lines[first:]), names, version)
        (folder / f"{name}.1").write_text(text)
    for name, summary, lines in found:
        (folder / f"{name}.1").write_text(page(name, summary, [], "\n".join(literal(lines)[1:]) + "\n", names, version))


main(*sys.argv[1:])
