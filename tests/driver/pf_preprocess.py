#!/usr/bin/env python3
"""Turns a pFUnit test module (.pf) into Fortran with a main program which runs it.

    pf_preprocess.py test_x.pf OUT/test_x.F90            for the driver next to this file
    pf_preprocess.py --pfunit test_x.pf OUT/test_x.pf    for pFUnit's own preprocessor:
                     continued directives, which it does not know, are put on one line

Either way a file which only one of the two would take is refused.
"""
import argparse
import re
import sys
from pathlib import Path

ASSERTIONS = {
    "fail", "true", "false", "any", "all", "none", "notall", "isnan", "isfinite", "equal",
    "relativelyequal", "lessthan", "lessthanorequal", "greaterthan", "greaterthanorequal"}
MODULE = re.compile(r"\s*module\s+(\w+)\s*$", re.I)
SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(\([\w\s,]*\))?\s*(!.*)?$", re.I)
TYPE = re.compile(r"\s*type\b.*::\s*(\w+)\s*$", re.I)

# Of each directive that declares something: the statement it precedes and its options.
DECLARATIONS = {
    "test": (SUBROUTINE, {"ifdef": r"\w+", "ifndef": r"\w+", "cases": r"\[[\d,\s]+\]",
                          "testparameters": r"\{.*\}"}),
    "before": (SUBROUTINE, {}),
    "after": (SUBROUTINE, {}),
    "testcase": (TYPE, {"constructor": r"\w+", "testparameters": r"\{.*\}"}),
    "testparameter": (TYPE, {"constructor": r"\w+"}),
}


class Refused(Exception):
    """What is wrong with the .pf file, and in which line."""


class PfFile:
    """The lines of a .pf file with the directives expanded, and what these declare."""

    def __init__(self, path):
        self.path = path
        self.module = None
        self.tests = []      # dictionaries: name, line and the options of @test
        self.declared = {}   # by the other directives: a name and options
        self.pending = None  # the directive, with its options, that awaits its statement
        self.fortran = []    # lines for the driver
        self.joined = []     # lines for pFUnit, with the line numbers kept

        lines = path.read_text(encoding="utf-8").splitlines()
        start = 0
        while start < len(lines):
            self.line = start + 1
            end = start + 1
            if lines[start].lstrip().startswith("@"):
                while lines[end - 1].rstrip().endswith("&") and end < len(lines):
                    end += 1
                self.read_directive(lines[start:end])
            else:
                self.read_statement(lines[start])
            start = end
        self.check()

    def refuse(self, why):
        raise Refused(f"{self.path}:{self.line}: {why}")

    def read_directive(self, lines):
        if self.pending:
            self.refuse(f"the statement which @{self.pending[0]} announces is missing")
        indent = re.match(r"\s*", lines[0]).group()
        text = " ".join(line.strip().strip("&").strip() for line in lines)
        self.joined += [indent + text] + [""] * (len(lines) - 1)

        match = re.match(r"@(\w+)\s*(?:\((.*)\))?$", text)
        name, arguments = (match.group(1).lower(), match.group(2)) if match else ("", "")
        if name in DECLARATIONS:
            self.pending = name, self.options(name, arguments or "")
            self.fortran += ["! " + line for line in lines]
        elif name.startswith("assert") and name[len("assert"):] in ASSERTIONS and arguments:
            call = "\n".join(lines).strip()[len("@"):-len(")")]
            self.fortran += [f"{indent}call {call}, &",
                             f"location=SourceLocation('{self.path.name}', {self.line}))",
                             f"{indent}if (anyExceptions()) return",
                             self.line_marker(self.line + len(lines))]
        else:
            self.refuse(f"not a directive both pFUnit and this driver know: {text}")

    def options(self, directive, arguments):
        found = {}
        while arguments.strip():
            for key, value in DECLARATIONS[directive][1].items():
                match = re.match(rf"\s*{key}\s*=\s*({value})\s*(,|$)", arguments, re.I)
                if match:
                    found[key] = match.group(1)
                    arguments = arguments[match.end():]
                    break
            else:
                self.refuse(f"@{directive} does not take: {arguments}")
        return found

    def read_statement(self, line):
        self.fortran.append(line)
        self.joined.append(line)
        if not line.strip() or line.lstrip().startswith("!"):
            return
        if not self.module and MODULE.match(line):
            self.module = MODULE.match(line).group(1)
        if self.pending:
            directive, options = self.pending
            self.pending = None
            match = DECLARATIONS[directive][0].match(line)
            if not match:
                self.refuse(f"@{directive} cannot apply to: {line.strip()}")
            declared = {"name": match.group(1), "line": self.line, **options}
            if directive == "test":
                self.tests.append(declared)
            elif directive in self.declared:
                self.refuse(f"a second @{directive}")
            else:
                self.declared[directive] = declared

    def check(self):
        """Refuses what pFUnit could not compile or would silently leave out."""
        if (self.module or "").lower() != self.path.stem.lower():
            self.refuse(f"the module must be named {self.path.stem}, as the file")
        if self.pending or not self.tests:
            self.refuse("there is no @test, or a directive at the end")
        case, parameter = self.declared.get("testcase"), self.declared.get("testparameter")
        if case and ("before" in self.declared or "after" in self.declared):
            self.refuse("@before and @after do not serve a @testCase: override setUp, tearDown")
        if parameter and "constructor" not in (case or {}):
            self.refuse("@testParameter needs a @testCase(constructor=...)")
        for test in self.tests:
            self.line = test["line"]
            given = ("cases" in test) + ("testparameters" in {**test, **(case or {})})
            if given != bool(parameter):
                self.refuse("with @testParameter, and only so, a test has cases or testParameters")
            if "cases" in test and "constructor" not in parameter:
                self.refuse("cases need a @testParameter(constructor=...)")

    def line_marker(self, line):
        return f'#line {line} "{self.path.as_posix()}"'

    def driver_source(self):
        return [self.line_marker(1), *self.fortran, '#line 1 "main program"', *self.program()]

    def program(self):
        case, parameter = self.declared.get("testcase"), self.declared.get("testparameter")
        yield f"program {self.module}_program"
        yield "   use funit, only: pf_anyExceptions => anyExceptions"
        yield "   use funit_runner, only: pf_begin => begin_test, pf_end => end_test, &"
        yield "      pf_run => run_test, pf_report_and_stop => report_and_stop"
        yield f"   use {self.module}"
        yield "   implicit none"
        if parameter:
            yield f"   type({parameter['name']}), allocatable :: pf_parameters(:)"
            yield "   integer :: pf_i"
        for test in self.tests:
            guards = [f"#{key} {test[key]}" for key in ("ifdef", "ifndef") if key in test]
            yield from guards
            yield from self.calls(test)
            yield from ["#endif" for _ in guards]
        yield "   call pf_report_and_stop()"
        if case:
            yield from self.case_runner()
        yield f"end program {self.module}_program"

    def calls(self, test):
        name, case = test["name"], self.declared.get("testcase")
        if "testparameter" in self.declared:
            if "cases" in test:
                constructor = self.declared["testparameter"]["constructor"]
                values = [f"{constructor}({value.strip()})"
                          for value in test["cases"].strip("[]").split(",")]
                parameters = "[" + ", &\n      ".join(values) + "]"
            else:
                parameters = {**case, **test}["testparameters"][1:-1].strip()
            yield f"   pf_parameters = {parameters}"
            yield "   do pf_i = 1, size(pf_parameters)"
            yield f"      call pf_run_case('{name}', {name}, pf_parameters(pf_i))"
            yield "   end do"
            yield "   deallocate (pf_parameters)"
        elif case:
            yield f"   call pf_run_case('{name}', {name})"
        else:
            around = [f", {key}={self.declared[key]['name']}"
                      for key in ("before", "after") if key in self.declared]
            yield f"   call pf_run('{name}', {name}{''.join(around)})"

    def case_runner(self):
        case, parameter = self.declared["testcase"], self.declared.get("testparameter")
        yield "contains"
        yield f"   subroutine pf_run_case(name, method{', parameter' if parameter else ''})"
        yield "      character(*), intent(in) :: name"
        yield "      interface"
        yield "         subroutine method(this)"
        yield f"            import :: {case['name']}"
        yield f"            class({case['name']}), intent(inout) :: this"
        yield "         end subroutine method"
        yield "      end interface"
        if parameter:
            yield f"      type({parameter['name']}), intent(in) :: parameter"
        yield f"      type({case['name']}) :: test"
        if "constructor" in case:
            yield f"      test = {case['constructor']}({'parameter' if parameter else ''})"
        if parameter:
            yield "      call test%setTestParameter(parameter)"
            yield "      call pf_begin(name // '[' // trim(parameter%toString()) // ']')"
        else:
            yield "      call pf_begin(name)"
        yield "      call test%setUp()"
        yield "      if (.not. pf_anyExceptions()) then"
        yield "         call method(test)"
        yield "         call test%tearDown()"
        yield "      end if"
        yield "      call pf_end()"
        yield "   end subroutine pf_run_case"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pfunit", action="store_true", help="write .pf for pFUnit")
    parser.add_argument("source", type=Path)
    parser.add_argument("output", type=Path)
    arguments = parser.parse_args()
    try:
        pf_file = PfFile(arguments.source)
    except Refused as error:
        sys.exit(f"{error}")
    lines = pf_file.joined if arguments.pfunit else pf_file.driver_source()
    arguments.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
