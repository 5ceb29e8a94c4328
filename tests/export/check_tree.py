"""Looks at what is installed: check_tree.py PREFIX SOURCE NM [FOLDER...]

LICENSE is there, links of the documents lead to files that are there, symbols of static libraries begin with the library's
name, those that the Fortran library exports are of its modules, and nothing names SOURCE, where it was built, unless it names a FOLDER that was given to CMake; these are looked at too.
"""
import re
import subprocess
import sys
from pathlib import Path

prefix, source, nm, *given = sys.argv[1:]
problems = []
files = [path for folder in {prefix, *given} for path in Path(folder).rglob("*") if path.is_file()]
documents = Path(prefix)/"share/doc/kschur"

for path in files:
    content = path.read_bytes()
    for folder in given:
        content = content.replace(folder.encode(), b"").replace(folder.replace(" ", "\\ ").encode(), b"")
    if source.encode() in content:
        problems.append(f"{path} names {source}")
    if path.name == "libkschur.so":
        listed = subprocess.run([nm, "--dynamic", "--defined-only", "--format=posix", path], capture_output=True, text=True,
                                check=True).stdout
        names = set(re.findall(r"^(\S+) [A-Za-z] ", listed, re.M))
        foreign = sorted(name for name in names if not name.startswith("__kschur"))
        if foreign or not names:
            problems.append(f"{path} exports {len(names)} symbols, among them {foreign[:5]}")
    if path.suffix == ".a":
        listed = subprocess.run([nm, "--extern-only", "--defined-only", "--format=posix", path], capture_output=True, text=True,
                                check=True).stdout
        names = set(re.findall(r"^(\S+) [A-Za-z] ", listed, re.M))
        foreign = sorted(name for name in names if not re.match(r"_*kschur", name))
        if foreign or not names:
            problems.append(f"{path} has {len(names)} symbols, among them {foreign[:5]}")

pages = list(documents.rglob("*.md"))
if not (documents/"LICENSE").is_file() or len(pages) < 20:
    problems.append(f"{documents} has no LICENSE, or not the documents: {len(pages)} pages")
for page in pages:
    for target in re.findall(r"\]\(([^)\s#]+)[^)\s]*\)", page.read_text()):
        if not re.match(r"\w+:", target) and not (page.parent/target).exists():
            problems.append(f"{page}: there is no {target}")

print("\n".join(problems) or f"{len(files)} files, {len(pages)} pages")
sys.exit(bool(problems))
