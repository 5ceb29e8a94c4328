#!/usr/bin/python3
"""docs/messages.md lists every message of the sources: test_messages.py SOURCE [--write]

A message is what stands in a call of `new_error` or `line_error`, on one line or on several: its texts, `...` in the place of what
is put in when it is given. The page has its beginning, which says what is wrong. With --write the page is written, else it is
compared. Exit status 0: it is as the sources are.
"""
import re
import sys
from pathlib import Path

SOURCE = Path(sys.argv[1]).resolve()
PAGE = SOURCE / "docs" / "messages.md"
FOLDERS = ("app", "capi", "examples/scenes", "src", "with", "without")
# Of each kind its heading, and what to do beyond what the messages say.
KINDS = {
    "error_usage": ("Wrong usage (exit status 1)", "`kschur help COMMAND` lists the options of a command."),
    "error_input": ("Bad input: a file or a matrix (exit status 2)", "Formats: [files.md](files.md). What stands before `:` is the file."),
    "error_file": ("Files (exit status 2 of an input, 4 of an output)", "An output is never half written: what was there before stays."),
    "error_memory": ("Memory (exit status 4)", "Ask for fewer modes, take one thread, or see *Large* in [choosing.md](choosing.md)."),
    "error_singular": (
        "Singular matrices (exit status 4)",
        "Some motion has neither mass nor stiffness, or the shift is an eigenvalue: see `kschur info PROBLEM`, or take another `--shift`.",
    ),
    "error_library": ("Another library failed (exit status 4)", "Where a linear solver failed, take another: `--inner mumps` or `--inner ldl`."),
    "error_convergence": ("An iteration failed (exit status 4)", "Take other units, or `--inner auto`."),
    "status": ("Calls of the C interface (the status of the function)", "[c_api.md](c_api.md) and the header say what each takes."),
}
TEXT = re.compile(r'"((?:[^"]|"")*)"')
# Where the beginning of a message ends: why, what to do, what another library said, what stood there instead follow.
ENDS = re.compile(r"[:;] |, (?:as|and|but|only|which|one) |, not '?\.\.\.'?$")
HEAD = """# Messages

Every error of the library and the program, by kind, and the exit status of `kschur`. Listed is how each begins; most go
on with details and with what to do. `...` stands for names, numbers or a file. In Fortran they are `error%message`, in
C that of the handle, in Python the text of the exception. Notes of a result are no errors ([files.md](files.md)).
`tests/python/test_messages.py . --write` writes this page.
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
                        if message != "...":
                            found["error_input"].add(f"line ...: {message}")
                    elif message.strip(". ,:;()'"):
                        found[kind_of(parts[1])].add(message)
    return found


def kind_of(code):
    """A code that is not known from the call is that of another library."""
    if code.startswith("status_"):
        return "error_memory" if code == "status_memory" else "status"
    return code if code in KINDS else "error_library"


def brief(message):
    """How it begins, with the file or the line that stands before; the whole message where that is short."""
    head = re.match(r"((\.\.\.|line \.\.\.): )?", message)[0]
    wrong = ENDS.split(message[len(head):])[0]
    return head + wrong if len(wrong.replace("...", "").split()) > 3 else message


def page(found):
    lines = [HEAD]
    for kind, (title, advice) in KINDS.items():
        lines += [f"## {title}", "", advice, "", "```text"]
        lines += sorted({brief(message) for message in found[kind]}, key=lambda m: (m.lstrip(".' ").lower(), m)) + ["```", ""]
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
