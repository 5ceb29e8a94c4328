"""Checks the C library against its headers: check_interface.py NM kschur.h libkschur_capi.so libkschur.so fpm.toml...

What the library exports is what kschur.h and its parts declare, and below it libkschur.so only what is of Fortran modules and
the lock that C takes too; every declaration has a comment; the versions are the same; and no procedure keeps a variable in static memory, where two threads would meet. gfortran does that with large local
arrays, and with the length of a function's result where that is deferred.
"""
import re
import subprocess
import sys
from pathlib import Path

nm, header, interface_library, library, *manifests = sys.argv[1:]
problems = []


def lines(*arguments):
    return subprocess.run([nm, *arguments], capture_output=True, text=True, check=True).stdout.splitlines()


def symbols(*arguments):
    """Pairs of a letter for the kind and a name."""
    return {tuple(line.split()[-2:]) for line in lines(*arguments)}


text = open(header).read()
text += "".join((Path(header).parent/part).read_text() for part in re.findall(r'^#include "(.*)"', text, re.M))
declared = set(re.findall(r"^int (kschur_\w+)\(", text, re.M))
exported = {name for kind, name in symbols("-D", "--defined-only", interface_library)}
if len(declared) < 50:
    problems.append(f"only {len(declared)} functions were found in {header}")
problems += [f"{name} is declared but not exported" for name in sorted(declared - exported)]
problems += [f"{name} is exported but not declared" for name in sorted(exported - declared)]

below = {name for kind, name in symbols("-D", "--defined-only", library)}
if not any(re.match("__kschur_solver_MOD_", name) for name in below):
    problems.append(f"{library} does not export its modules")
problems += [f"{library} exports {name}" for name in sorted(below) if not re.match("__kschur", name)]

for name in sorted(declared):
    before = text[: re.search(rf"^int {name}\(", text, re.M).start()].rstrip()
    if not before.endswith("*/"):
        problems.append(f"{name} has no comment")

version = ".".join(re.search(rf"define KSCHUR_VERSION_{part} (\d+)", text)[1] for part in ("MAJOR", "MINOR", "PATCH"))
for manifest in manifests:
    other = re.search(r'^version = "(.*)"', open(manifest).read(), re.M)[1]
    if other != version:
        problems.append(f"the header has version {version}, {manifest} has {other}")

for path in (interface_library, library):
    # The compiler numbers static variables of procedures. In .data.rel.ro are constants that hold addresses; completed.0 is
    # of the C library's start.
    rows = [line.split("|") for line in lines("--format=sysv", path)]
    kept = {row[0].strip() for row in rows if len(row) == 7 and row[2].strip() in "bd" and row[6].strip() != ".data.rel.ro"}
    problems += [f"{path} keeps {name}" for name in sorted(kept) if re.fullmatch(r"(?!completed)\w+\.\d+(\.\d+)?", name)]

print("\n".join(problems))
sys.exit(bool(problems))
