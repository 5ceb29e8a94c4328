#!/usr/bin/python3
"""What callers enter asks for memory: test_allocations.py SOURCE_TREE. Exit status 0: it does.

gfortran ends the process where an `allocate` without `stat=` gets no memory. So each procedure of the facade kschur that can
fail, and that reaches such an `allocate`, also reaches a `require_memory`, which asks for what its step takes
(docs/architecture.md). What a procedure reaches is seen by names, of what is bound to types in all modules that its own uses.
"""
import re
import sys
from collections import defaultdict
from pathlib import Path

SOURCES = Path(sys.argv[1])/"src"
HEAD = re.compile(r"^(?:(?:pure|impure|elemental|recursive|module|logical|integer|real|complex|type|character)\b(?:\([^)]*\))? *)*"
                  r"(?:subroutine|function) +(\w+)")
# A few bytes, whatever comes in: of a name, a sentence, an object.
SMALL = re.compile(r"allocate *\([\w%]+(\([0, ]*\))?(, *[\w%]+(\([0, ]*\))?)*\)$|allocate *\(character\(|allocate *\([\w%]+, source=\w+_type\(")


def statements(path):
    """Lines of a source file with what it includes, comments taken out and continuations joined."""
    whole = ""
    for line in path.read_text().split("\n"):
        included = re.match(r'#include "(.+)"', line)
        if included and (path.parent/included[1]).exists():
            yield from statements(path.parent/included[1])
        if line.startswith("#"):
            continue
        whole += re.sub(r"^&", "", re.sub(r"!.*", "", line).strip())
        if whole.endswith("&"):
            whole = whole[:-1]
            continue
        if whole:
            yield whole
        whole = ""


def closure(start, following):
    """What is reached from one by steps to what follows, itself too."""
    seen, waiting = set(), [start]
    while waiting:
        one = waiting.pop()
        if one not in seen:
            seen.add(one)
            waiting += following(one)
    return seen


class Procedures:
    """Who calls whom, who allocates, who asks, as `module:name`; what is contained in a procedure is part of it."""

    def __init__(self):
        self.calls, self.bare, self.asks = defaultdict(set), defaultdict(list), set()
        self.all, self.can_fail = set(), set()
        # What a module calls by a name: its own, what it uses; what is bound by a name, to whatever type.
        self.names, self.bound = defaultdict(lambda: defaultdict(set)), defaultdict(set)
        for path in sorted(SOURCES.rglob("*.[fF]90")):
            self.read(path)

    def read(self, path):
        module, depth, name, generic = path.stem, 0, None, None
        for line in statements(path):
            head, bound = HEAD.match(line), re.match(r"procedure(?:, *\w+)* *:: *(\w+)(?: *=> *(\w+))?", line)
            used = re.match(r"use (?:, *\w+ *:: *)?(kschur_\w+), *only: *(.*)", line)
            if re.match(r"(abstract )?interface\b", line):
                generic = line.split()[-1]
            elif re.match(r"end interface", line):
                generic = None
            elif generic:
                for one in re.findall(r"\w+", line.removeprefix("module procedure ")) if line.startswith("module procedure") else ():
                    self.names[module][generic].add((module, one))
            elif used:
                for word in used[2].split(","):
                    here, _, there = word.strip().partition("=>")
                    self.names[module][here.strip()].add((used[1], there.strip() or here.strip()))
            elif bound:
                self.bound[bound[1]].add((module, bound[2] or bound[1]))
            elif head:
                depth += 1
                if depth == 1:
                    name = f"{module}:{head[1]}"
                    self.all.add(name)
                    if re.search(r"[(,] *error *[,)]", line):
                        self.can_fail.add(name)
            elif re.match(r"end (subroutine|function)", line):
                depth -= 1
            elif depth:
                self.look_at(name, line)

    def look_at(self, name, line):
        self.calls[name] |= set(re.findall(r"(%?\b\w+) *\(", line)) | set(re.findall(r"call (?:\w+(?:\([^%]*\))?(?=%))*(%?\w+)", line))
        if "call require_memory" in line:
            self.asks.add(name)
        elif re.search(r"\ballocate *\(", line) and "deallocate" not in line and "stat=" not in line and not SMALL.search(line):
            self.bare[name].append(line)

    def resolve(self, module, called):
        """The procedures that a name in a module may mean."""
        if called.startswith("%"):
            return {one for at, name in self.bound[called[1:]] for one in self.resolve(at, name)}
        if f"{module}:{called}" in self.all:
            return {f"{module}:{called}"}
        return {one for at, name in self.names[module][called] if (at, name) != (module, called)
                for one in self.resolve(at, name)}

    def within(self, module):
        """The modules that one uses, itself too: what else is bound by the same names is not in its hands."""
        return closure(module, lambda one: {at for meanings in self.names[one].values() for at, _ in meanings})

    def reached(self, entry):
        modules = self.within(entry.partition(":")[0])
        return closure(entry, lambda name: {one for called in self.calls[name] for one in self.resolve(name.partition(":")[0], called)
                                            if one.partition(":")[0] in modules})

    def entries(self):
        """What the facade exports and can fail."""
        exported = {one for name in list(self.names["kschur"]) for one in self.resolve("kschur", name)}
        return exported & self.can_fail


def main():
    procedures = Procedures()
    wrong = 0
    for entry in sorted(procedures.entries()):
        seen = procedures.reached(entry)
        bare = sorted(one for one in seen if procedures.bare[one])
        if bare and not seen & procedures.asks:
            wrong += 1
            print(f"{entry} asks for no memory, and reaches {', '.join(bare)}")
    if len(procedures.asks) < 15 or len(procedures.all) < 500:
        sys.exit("the sources are not understood")
    sys.exit(bool(wrong))


main()
