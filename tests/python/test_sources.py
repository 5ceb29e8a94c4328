"""Lines of Fortran sources, and names that they import: test_sources.py SOURCE

Fortran 2008 has 132 characters in a line, and no compiler tells of a name that a `use` imports and nothing takes.
"""
import re
import sys
from pathlib import Path

from checks import check, finish

SOURCE = Path(sys.argv[1])
FOLDERS = ("app", "benchmarks", "capi", "examples", "src", "tests", "with")
LONGEST = 132
# They give to others what they import.
FACADES = {"kschur.f90", "funit.f90"}


def code_of(text):
    """Statements alone: strings are empty, comments gone but for OpenMP's directives, continued lines one."""
    bare = re.sub(r""" "[^"\n]*" | '[^'\n]*' | !(?!\$omp)[^\n]* """, lambda found: "" if found[0][0] == "!" else '""', text, flags=re.X)
    return re.sub(r"&[ \t]*\n\s*&?", " ", bare)


def with_parts(path, known):
    """The source with those that it includes, beside it or elsewhere."""
    text = path.read_text()
    names = re.findall(r'^#?\s*include\s+"(?:.*/)?([\w.]+\.inc)"', text, re.M)
    beside = [path.with_name(name) for name in names]
    return text + "".join((place if place.exists() else known[place.name]).read_text() for place in beside
                          if place.exists() or place.name in known)


def unused(path, known):
    """Names that a source imports and does not take; a kind may follow a number, 1.0_wp."""
    code = code_of(with_parts(path, known))
    uses = r"^\s*use\b[^\n]*?only\s*:(.*)$"
    imported = [name.split("=>")[0].strip() for names in re.findall(uses, code, re.M | re.I) for name in names.split(",")]
    rest = re.sub(uses, "", code, flags=re.M | re.I)
    return [name for name in imported if re.fullmatch(r"\w+", name) and not re.search(rf"(?:\b|\d_){name}\b", rest, re.I)]


def main():
    parts = {path.name: path for folder in FOLDERS for path in (SOURCE/folder).rglob("*.inc")}
    sources = [path for folder in FOLDERS for path in sorted((SOURCE/folder).rglob("*")) if path.suffix in (".f90", ".F90", ".pf")]
    check("sources: many", len(sources) > 300, len(sources))
    long = [f"{path.name}:{k}" for path in [*sources, *parts.values()] if path.suffix != ".pf"
            for k, line in enumerate(path.read_text().splitlines(), 1) if len(line) > LONGEST]
    check(f"no line above {LONGEST} characters", not long, long)
    idle = [f"{path.name}: {name}" for path in sources if path.name not in FACADES for name in unused(path, parts)]
    check("no import that nothing takes", not idle, idle)
    finish()


main()
