"""The rooms of src stand in one order: a module uses only modules of its own room and of rooms before it."""
import re
import sys
from pathlib import Path

ROOMS = ["base", "terms", "linear", "parallel", "krylov", "arpack", "problem", "pairs", "known", "proof", "operators", "modes", "solve",
         "study", "files"]


def main(src):
    modules = {path.stem: path for path in src.rglob("*.[fF]90")}
    wrong = []
    for name, path in sorted(modules.items()):
        source = path.read_text()
        room = path.parent.name
        if not re.search(rf"^\s*module {name}\s*$", source, re.MULTILINE):
            wrong.append(f"{path.relative_to(src)} does not hold the module {name}")
        if path.parent == src:
            continue
        if room not in ROOMS:
            wrong.append(f"{path.relative_to(src)} is in no room")
            continue
        for used in re.findall(r"^\s*use\s+(kschur\w*)", source, re.MULTILINE | re.IGNORECASE):
            other = modules[used].parent.name
            if other not in ROOMS or ROOMS.index(other) > ROOMS.index(room):
                wrong.append(f"{room}/{name} uses {other}/{used}, of a later room")
    print("\n".join(wrong) or f"{len(modules)} modules in {len(ROOMS)} rooms, no arrow runs back up")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
