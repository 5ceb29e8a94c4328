"""What the help texts of kschur say, for pages and completion that are made of them: `read_help(program)`.

An option is a line "  -m, --modes N          what it means", continued on lines that are indented further; several without a
meaning of their own, "  --modes N, --inner NAME, ...   as for kschur solve", are as there. The values of an option whose own is
called NAME, or has a bar in it, are the names that its meaning begins with, up to the default in brackets.
"""
import re
import subprocess
import sys
from dataclasses import dataclass, field

OPTION = re.compile(r"  (?:(-\w), )?(--[\w-]+)(?: (\S*[^\s,]))?(?: +(\S.*))?$")
LISTED = re.compile(r"  --[\w-]+(?: \S+)?,(?: --|$)|  --.* as for kschur solve$")
SCENE = re.compile(r"(?!kschur:)[a-z-]+: ")
MEANING = 25


@dataclass
class Option:
    name: str
    short: str = ""
    value: str = ""
    text: str = ""

    @property
    def choices(self):
        if "|" in self.value:
            return self.value.split("|")
        names = re.match(r"[\w-]+(, [\w-]+)+(?= \(|$)", self.text)
        if self.value == "NAME" and names:
            return names[0].split(", ")
        # Of a scene: "mass of the beams: consistent or lumped [consistent]".
        names = re.search(r": ([\w-]+(?:, [\w-]+)* or [\w-]+) \[", self.text)
        return re.split(r", | or ", names[1]) if names else []

    @property
    def is_file(self):
        return bool(re.search(r"\.\w", self.value)) or self.value in ("FILE", "FOLDER", "PROBLEM", "FORCE")


@dataclass
class Command:
    name: str
    summary: str
    lines: list
    options: list = field(default_factory=list)


def run(program, *words):
    return subprocess.run([program, *words], stdout=subprocess.PIPE, check=True, text=True).stdout.splitlines()


def read_options(lines, known=()):
    """Those of a help text; what it lists only is taken from the `known` ones."""
    options, known = {}, {option.name: option for option in known}
    current = None
    for line in lines:
        found = OPTION.match(line)
        if LISTED.match(line):
            current = None
            for name in re.findall(r"--[\w-]+", line):
                options.setdefault(name, known.get(name) or Option(name))
        elif found and found[4]:
            short, name, value, text = found.groups("")
            current = Option(name, short, value, text)
            options.setdefault(name, current)
        elif current and line[:MEANING].isspace():
            current.text += " " + line.strip()
        else:
            current = None
    return list(options.values())


def read_help(program):
    """The commands, and the options of each scene by its name; the end, and no failure, where the program cannot be run here."""
    try:
        overview = run(program, "help")
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"no pages for man and completion: {error}")
        sys.exit(0)
    commands = [Command("", "vibration modes of constrained, damped structures", overview)]
    for name, summary in re.findall(r"^  kschur (\w+) .*?  +(\S.*)$", "\n".join(overview), re.M):
        if any(command.name == name for command in commands):
            continue
        lines = overview if name == "help" else run(program, "help", name)
        known = commands[1].options if len(commands) > 1 else ()
        before_scenes = lines[:next((i for i, line in enumerate(lines) if SCENE.match(line)), len(lines))]
        commands.append(Command(name, summary, lines, read_options(before_scenes, known) if name != "help" else []))
    scenes = [line.split(":")[0] for line in run(program, "help", "scene") if SCENE.match(line)]
    return commands, {name: read_options(run(program, "help", "scene", name)) for name in scenes}
