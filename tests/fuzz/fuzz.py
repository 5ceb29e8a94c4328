#!/usr/bin/python3
"""Damaged input at random: fuzz.py {texts,hdf5,commands,integers,cases} --reader READ_CASES --kschur KSCHUR [--number N] [--seed S] [--keep FOLDER]

N texts, HDF5 files or command lines are made of SEED, and what the library and the program make of them is judged; `cases`
are those that once failed. What fails is kept in FOLDER. Exit status 0: all is well.
"""
import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
import command_lines
import hdf5_files
import kept
import texts
import wild_integers

KINDS = {"texts": texts, "hdf5": hdf5_files, "commands": command_lines, "integers": wild_integers, "cases": kept}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--reader", type=os.path.abspath)
    parser.add_argument("--kschur", type=os.path.abspath)
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--guarded", action="store_true", help="where the reader breaks down over an HDF5 file, have it read first in a child process, and judge that")
    parser.add_argument("--keep", type=Path)
    parser.set_defaults(broke_down=0)
    arguments = parser.parse_args()
    failures, start = 0, time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for name, content, wrong in KINDS[arguments.kind].run(arguments, Path(folder)):
            failures += 1
            print(f"FAILS {name}: {wrong}", flush=True)
            if arguments.keep:
                arguments.keep.mkdir(parents=True, exist_ok=True)
                (arguments.keep/name).write_bytes(content)
    guarded = f", {arguments.broke_down} read in a child process only" if arguments.guarded else ""
    print(f"{arguments.number} {arguments.kind}, {failures} failed{guarded}, {time.monotonic() - start:.0f} s")
    sys.exit(failures > 0)


main()
