#!/usr/bin/python3
"""docs/messages.md lists every message of the sources: test_messages.py SOURCE [--write]

A message is what stands in a call of `new_error` or `line_error`, on one line or on several: its texts, `...` in the place of what
is put in when it is given. With --write the page is written, else it is compared. Exit status 0: it is as the sources are.
"""
import re
import sys
from pathlib import Path

SOURCE = Path(sys.argv[1]).resolve()
PAGE = SOURCE / "docs" / "messages.md"
FOLDERS = ("app", "capi", "examples/scenes", "src", "with", "without")
KINDS = {
    "error_usage": ("Wrong usage: what was asked for does not fit", 1),
    "error_input": ("Bad input: a file or a matrix", 2),
    "error_file": ("Files", 4),
    "error_memory": ("Memory", 4),
    "error_singular": ("Singular matrices", 4),
    "error_library": ("Another library failed", 4),
    "error_convergence": ("An iteration did not end well", 4),
}
TEXT = re.compile(r'"((?:[^"]|"")*)"')
HEAD = """# Messages

Every error of the library and the program, by kind, and the exit status of `kschur`; `...` stands for what is put in: names, numbers, a
file. A message is one sentence that names what is wrong and where, and, where that is not plain from it, what to do. In Fortran it is
`error%message`, in C that of the handle, in Python the text of the exception. What is worth knowing but no error are notes of the
result ([files.md](files.md)). `tests/python/test_messages.py` makes this page of the sources, and a test compares them.
"""


def statements(text):
    """Statements of free-form Fortran, continued lines joined, comments of whole lines left out."""
    lines = [line.strip() for line in text.splitlines() if not line.lstrip().startswith("!")]
    return re.sub(r"&\s*\n\s*&?", "", "\n".join(lines)).splitlines()


def arguments(text, start):
    """The arguments of a call whose opening bracket is before `start`."""
    depth, quote, parts, part = 1, False, [], ""
    for c in text[start:]:
        quote ^= c == '"'
        if not quote:
            depth += (c in "([") - (c in ")]")
            if depth == 0:
                break
            if c == "," and depth == 1:
                parts.append(part)
                part = ""
                continue
        part += c
    return [*parts, part]


def outside(text):
    """The pieces of a concatenation: texts as they are, anything else as `...`."""
    pieces, depth, quote, piece = [], 0, False, ""
    for c in text + "/":
        quote ^= c == '"'
        if not quote:
            depth += (c in "([") - (c in ")]")
        piece += c
        if not quote and depth == 0 and piece.endswith("//"):
            pieces.append(piece[:-2])
            piece = ""
    pieces.append(piece[:-1])
    words = [TEXT.fullmatch(piece.strip()) for piece in pieces]
    joined = "".join(word[1].replace('""', '"') if word else "..." for word in words)
    return re.sub(r"(\.\.\.)+", "...", joined).strip()


def messages():
    """For each kind the messages, once each."""
    found = {kind: set() for kind in KINDS}
    for folder in FOLDERS:
        for path in sorted((SOURCE / folder).rglob("*")):
            if path.suffix not in (".f90", ".F90", ".inc"):
                continue
            for statement in statements(path.read_text()):
                for call in re.finditer(r"\bcall (new|line)_error\(", statement):
                    parts = [part.strip() for part in arguments(statement, call.end())]
                    message = outside(parts[-1])
                    if call[1] == "line":
                        found["error_input"].add(f"line ...: {message}")
                    elif message.strip(". ,:;()'"):
                        # A kind that is not known from the call is that of another library's code.
                        found[parts[1] if parts[1] in KINDS else "error_library"].add(message)
    return found


def page(found):
    lines = [HEAD]
    for kind, (title, status) in KINDS.items():
        lines += [f"## {title} (exit status {status})", ""]
        lines += [f"- {message}" for message in sorted(found[kind], key=lambda m: m.lstrip(".' ").lower())] + [""]
    return "\n".join(lines)


def main():
    text = page(messages())
    if "--write" in sys.argv:
        PAGE.write_text(text)
    elif PAGE.read_text() != text:
        old = set(PAGE.read_text().splitlines())
        print("docs/messages.md is not what the sources say: test_messages.py SOURCE --write")
        print("\n".join(f"+ {line}" for line in text.splitlines() if line not in old))
        print("\n".join(f"- {line}" for line in old if line not in text.splitlines()))
        sys.exit(1)


main()
