"""Public entities of src have a `!>` comment: modules, and what they make public of types, procedures, parameters and
interfaces; of what the facade `kschur` gives to others also components, bindings and arguments. What speaks for itself needs
none: what is of a documented type, an error, a path, the object itself, what is bound anew in an extension, what follows a
documented declaration without a gap, and an argument that the comment of its procedure names.

    test_comments.py SRC
"""
import re
import sys
from pathlib import Path

PROCEDURE = re.compile(r"^\s*(?:(?:pure|elemental|impure|recursive|module|integer|logical|real|complex|character|type|class)"
                       r"(?:\([^)]*(?:\([^)]*\))?[^)]*\))?\s+)*(?:subroutine|function)\s+(\w+)", re.IGNORECASE)
TYPE = re.compile(r"^\s*type(?:,[^:]*)?\s*(?:::)?\s+(\w+)\s*$|^\s*type(?:,[^:]*)?\s*::\s*(\w+)\s*$", re.IGNORECASE)
INTERFACE = re.compile(r"^\s*interface\s+(\w+)\s*$", re.IGNORECASE)
END = re.compile(r"^\s*end\s*(subroutine|function|type|interface)\b", re.IGNORECASE)
DECLARATION = re.compile(r"^\s*(?!use\b)([\w(][^!:]*?)\s*::\s*(.*)$", re.IGNORECASE)
# Arguments that speak for themselves.
OBVIOUS = {"self", "error", "path", "folder", "mass_path", "stiffness_path", "damping_path", "constraints_path"}


class Line:
    """A statement and the words of the comment right above it."""

    def __init__(self, text, comment):
        self.text, self.comment, self.documented = text, re.findall(r"\w+", comment.lower()), bool(comment)


def statements(path):
    """Statements with their continuations, those of an included file behind the others."""
    source = path.read_text()
    for name in re.findall(r'include\s+"([\w.]+\.inc)"', source):
        source += (path.parent / name).read_text()
    lines, above, comment, pending = [], "", "", ""
    for raw in source.splitlines():
        stripped = raw.strip()
        if stripped.startswith("!>") or (stripped.startswith("!") and above):
            above += stripped[2:]
            continue
        code = stripped if "'" in raw or '"' in raw else re.sub(r"\s*!.*$", "", stripped)
        if not code or code.startswith("#"):
            above = ""
            continue
        if not pending:
            comment = above
        above = ""
        pending += code.rstrip("&") + " "
        if not code.endswith("&"):
            lines.append(Line(pending.strip(), comment))
            pending = ""
    return lines


def names_of(text):
    """The names that a declaration declares."""
    depth, names, word = 0, [], ""
    for letter in text + ",":
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            names.append(re.match(r"\s*(\w+)", word).group(1).lower() if re.match(r"\s*\w+", word) else "")
            word = ""
        else:
            word += letter
    return [name for name in names if name]


def public_names(lines):
    found = set()
    for line in lines:
        match = re.match(r"^\s*public\s*(?:::)?\s*(.+)$", line.text, re.IGNORECASE)
        if match:
            found.update(names_of(match.group(1)))
        declared = DECLARATION.match(line.text)
        if declared and re.search(r",\s*public\b", declared.group(1), re.IGNORECASE):
            found.update(names_of(declared.group(2)))
    return found


def undocumented(path, deep):
    """What lacks a comment; `deep`: the names whose parts are looked at, too."""
    lines, missing = statements(path), []
    public = public_names(lines)
    if not lines or not (re.match(r"module\s", lines[0].text, re.IGNORECASE) and lines[0].documented):
        missing.append("the module")
    kind, entity, said, visible, extension, previous = "", "", [], True, False, False
    for line in lines[1:]:
        text = line.text
        if END.match(text):
            kind, previous = "", False
            continue
        match = TYPE.match(text) or INTERFACE.match(text) or PROCEDURE.match(text)
        if match and not kind and not re.match(r"^\s*(abstract\s+interface|procedure)", text):
            entity = next(group for group in match.groups() if group).lower()
            kind = "type" if TYPE.match(text) else "interface" if INTERFACE.match(text) else "procedure"
            said = line.comment
            visible, previous, extension = True, False, bool(re.search(r"extends\(", text, re.IGNORECASE))
            if entity in public and not line.documented:
                missing.append(f"{kind} {entity}")
            continue
        declared = DECLARATION.match(text)
        if not declared:
            if text.lower() == "contains" and kind == "procedure":
                entity = ""
            if text.lower() == "private" and kind == "type":
                visible = False
            previous = False
            continue
        names, attributes = names_of(declared.group(2)), declared.group(1).lower()
        here = line.documented or previous
        if not kind:
            for name in names:
                if name in public and "parameter" in attributes and not here:
                    missing.append(f"parameter {name}")
            previous = here and "parameter" in attributes
            continue
        if entity in deep and entity in public:
            speaks = bool(re.match(r"(type|class)\(", attributes))
            if kind == "procedure" and "intent" in attributes:
                missing += [f"{entity}: argument {name}" for name in names
                            if not (speaks or here or name in OBVIOUS or name in said)]
            elif kind == "type" and visible and "private" not in attributes:
                bound = extension and attributes.startswith("procedure")
                missing += [f"{entity}: {name}" for name in names if not (speaks or here or bound)]
        previous = here
    return [f"{path.name}: {what}" for what in missing]


def main(src):
    facade = (src / "kschur.f90").read_text().replace("&\n", "")
    exported = {}
    for module, names in re.findall(r"use (kschur_\w+), only: ([^\n]+)", facade):
        exported[module] = {name.strip().split("=>")[-1].strip().lower() for name in names.split(",")}
    files = sorted(src.rglob("*.[fF]90"))
    missing = [what for path in files for what in undocumented(path, exported.get(path.stem, set()))]
    print("\n".join(missing))
    print(f"{len(files)} modules, {len(missing)} public entities without a comment")
    return bool(missing)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
