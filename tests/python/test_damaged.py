#!/usr/bin/python3
"""Damaged HDF5 files, by hand and at random: test_damaged.py KSCHUR [--files N] [--seed S] [--megabytes M] [--seconds T] [--keep FOLDER]

Whatever is in a file, `kschur info`, `kschur solve` and, of a sweep, `kschur view --point` end with exit status 2 and one line, or,
where the damage does no harm, with 0 (info, view) or 0, 3 or 4 (solve); soon, with little memory, and without a word of HDF5's. N
files of each kind are damaged at random (default 40); those that fail are kept in FOLDER. Exit status 0: all is well.
"""
import argparse
import os
import random
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

SECONDS = 15
failures = []


def run(*words, seconds=SECONDS):
    """Exit status (of a signal below zero, None: it had to be stopped), standard error, most memory in bytes, processor time."""
    with tempfile.TemporaryFile() as errors:
        child = subprocess.Popen([arguments.kschur, *map(str, words)], stdout=subprocess.DEVNULL, stderr=errors,
                                 env=dict(os.environ, OPENBLAS_NUM_THREADS="1"))
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
            if pid:
                errors.seek(0)
                return (os.waitstatus_to_exitcode(status), errors.read().decode(errors="replace"), 1024*usage.ru_maxrss,
                        usage.ru_utime + usage.ru_stime)
            time.sleep(0.002)
        child.kill()
        os.wait4(child.pid, 0)
        return None, "", 0, seconds


def check(what, passed, detail=""):
    if not passed:
        failures.append(what)
        print(f"FAILS {what}  [{detail}]", flush=True)
    return passed


def ends_well(what, statuses, *words):
    status, errors, memory, seconds = run(*words)
    return check(what, status in statuses and errors.count("\n") == (status != 0) and memory < 1e6*arguments.megabytes
                 and (status != 2 or seconds < arguments.seconds), (status, errors[-300:], memory, seconds))


def refused(what, path, *parts, result=False):
    for command in ("info", "solve"):
        status, errors, memory, seconds = run(command, path)
        shown = command == "info" or not result
        check(f"{command}: {what}", status == 2 and errors.count("\n") == 1 and memory < 1e6*arguments.megabytes
              and seconds < arguments.seconds and len(errors) < 300
              and path.name in errors and (not shown or all(part in errors for part in parts)),
              (status, errors[-300:], memory, seconds))


def write_problem(path, change=None, **options):
    """Masses on springs as h5py writes them; `change` is done to the file."""
    with h5py.File(path, "w", **options) as file:
        for name in ("mass", "stiffness"):
            group = file.create_group(name)
            group.attrs["encoding-type"] = "csr_matrix"
            group.attrs["shape"] = [6, 6]
            group["indptr"], group["indices"], group["data"] = np.arange(7), np.arange(6), 1.0 + np.arange(6)
        if change is not None:
            change(file)
    return path


def replaced(name, make):
    def change(file):
        del file[name]
        make(file, name)
    return change


def by_hand(folder):
    path = folder/"hand.h5"
    huge = replaced("mass/indices", lambda file, name: file.create_dataset(name, (2**31 - 1,), "i4", chunks=(1024,)))
    refused("7 kB that declare 2^31-1 indices", write_problem(path, huge), "/mass/indices", "more values")
    for extent in (2**31, 2**32 + 6):
        huge = replaced("mass/indices", lambda file, name: file.create_dataset(name, (extent,), "i4", chunks=(1024,)))
        refused(f"{extent} indices", write_problem(path, huge), "/mass/indices", "too long")
    outside = replaced("mass/data", lambda file, name: file.create_dataset(
        name, (6,), "f8", external=[(str(folder/"elsewhere"), 0, 48)]))
    (folder/"elsewhere").write_bytes(np.ones(6).tobytes())
    refused("external storage", write_problem(path, outside), "/mass/data", "another file")

    def virtual(source):
        def make(file, name):
            layout = h5py.VirtualLayout((6,), "f8")
            layout[:] = h5py.VirtualSource(source, name, (6,))
            file.create_virtual_dataset(name, layout)
        return make
    for source in (".", str(folder/"sound.h5")):
        refused(f"a virtual dataset of {Path(source).name}", write_problem(path, replaced("mass/data", virtual(source))),
                "/mass/data", "virtual")
    write_problem(folder/"sound.h5")
    for name in ("mass", "mass/data"):
        def link(file, name):
            file[name] = h5py.ExternalLink(str(folder/"sound.h5"), name)

        def two_links(file, name):
            file["behind"] = h5py.ExternalLink(str(folder/"sound.h5"), name)
            file[name] = h5py.SoftLink("/behind")
        for make in (link, two_links):
            refused(f"/{name} by {make.__name__}", write_problem(path, replaced(name, make)), f"/{name}", "another file")
    def ring(file, name):
        file[name], file["behind"] = h5py.SoftLink("/behind"), h5py.SoftLink(f"/{name}")
    refused("links in a ring", write_problem(path, replaced("mass", ring)), "/mass")
    def own_root(file, name):
        file[name] = file["/"]
    refused("/mass that is the root again", write_problem(path, replaced("mass", own_root)), "/mass")
    def inside(file, name):
        file["behind"] = 1.0 + np.arange(6)
        file[name] = h5py.SoftLink("/behind")
    status = run("info", write_problem(path, replaced("mass/data", inside)))[0]
    check("a link inside the file is followed", status == 0, status)
    sizes(folder)
    os.mkfifo(folder/"pipe.h5")
    refused("a pipe", folder/"pipe.h5", "a pipe or a device")
    refused("a folder's file that is a device", Path("/dev/zero"), "/dev/zero")


def sizes(folder):
    """Numbers that would be others in four bytes, or in eight with a sign."""
    path = folder/"sizes.h5"
    for wrong in (-2**63, -2**31, 2**31 - 1, 2**31, 2**32 + 6, 2**63 - 1, np.uint64(2**63), np.uint64(2**64 - 1)):
        for name, type in (("mass/indptr", "i8"), ("mass/indices", "u8" if wrong > 0 else "i8")):
            def make(file, name):
                values = np.arange(7 if name.endswith("r") else 6).astype(type)
                values[-1] = wrong if type == "u8" else np.int64(np.uint64(wrong)) if wrong > 0 else wrong
                file[name] = values
            refused(f"{wrong} in {name}", write_problem(path, replaced(name, make)), f"/{name}", "not between")
        for place in range(2):
            def reshape(file):
                shape = np.full(2, 6, "u8" if wrong > 0 else "i8")
                shape[place] = wrong
                file["mass"].attrs["shape"] = shape
            # Below 2^31 it is a size like others, to which the rest does not fit.
            refused(f"{wrong} in shape", write_problem(path, reshape), *(["attribute shape of /mass"] if abs(int(wrong)) >= 2**31 - 1 else []))
    write_problem(path, lambda file: file["mass"].attrs.__setitem__("shape", [2**31 - 2, 2**31 - 2]))
    refused("a shape of 2^31-2", path, "/mass/indptr", "2147483647")


def heaps(folder, problem, result):
    """The strings of variable length: each number of their heaps wrong in several ways."""
    for source, is_result in ((problem, False), (result, True)):
        whole = source.read_bytes()
        heap = whole.index(b"GCOL")
        for place in (*range(heap + 4, heap + 40), heap + 48, heap + 56, heap + 57):
            for value in (0, 1, 0x7f, 0x80, 0xff):
                damaged = bytearray(whole)
                damaged[place] = value
                path = folder/"heap.h5"
                path.write_bytes(damaged)
                ends_well(f"{source.name}, byte {place} is {value}", (0, 2), "info", path)
        size = heap + 24
        path.write_bytes(whole[:size] + b"\xff\xff\xff\xff\xff\xff\xff\xff" + whole[size + 8:])
        words = ["a damaged result"] if is_result else []
        refused(f"{source.name}, a string without end", path, *words, result=is_result)
        # What is free after the strings; HDF5 goes round in a circle where it does not reach to the end of the heap.
        free = heap + 16
        while struct.unpack_from("<H", whole, free)[0] != 0:
            free += 16 + (struct.unpack_from("<Q", whole, free + 8)[0] + 7)//8*8
        for size in (0, struct.unpack_from("<Q", whole, free + 8)[0] - 50):
            path.write_bytes(whole[:free + 8] + struct.pack("<Q", size) + whole[free + 16:])
            refused(f"{source.name}, {size} bytes free after the strings", path, *words, result=is_result)


def parts_of_numbers(folder, result):
    """Complex numbers whose parts have other names."""
    for names in (("\x01", "i"), ("r", "x"), ("x", "i"), ("x", "y")):
        path = folder/"parts.h5"
        path.write_bytes(result.read_bytes())
        with h5py.File(path, "r+") as file:
            eigenvectors = file["eigenvectors"][:]
            del file["eigenvectors"]
            file["eigenvectors"] = eigenvectors.view([(name, "<f8") for name in names]).reshape(eigenvectors.shape)
        refused(f"parts {names}", path, "/eigenvectors does not hold complex numbers", result=True)


def at_random(folder, source, number):
    draw = random.Random(f"{source.name} {arguments.seed} {number}")
    damaged = bytearray(source.read_bytes())
    for _ in range(draw.choice((1, 1, 1, 2, 4, 16))):
        place = draw.randrange(len(damaged))
        damaged[place] = draw.choice((0, 1, 0x7f, 0x80, 0xff, damaged[place] ^ 1 << draw.randrange(8), draw.randrange(256)))
    if draw.random() < 0.1:
        del damaged[draw.randrange(len(damaged)):]
    path = folder/f"{source.stem}-{arguments.seed}-{number}.h5"
    path.write_bytes(damaged)
    well = ends_well(path.name, (0, 2), "info", path)
    if number % 4 == 0:
        well &= ends_well("solve " + path.name, (0, 2, 3, 4), "solve", path, "--modes", 2)
    if not well and arguments.keep:
        os.makedirs(arguments.keep, exist_ok=True)
        (Path(arguments.keep)/path.name).write_bytes(damaged)
    path.unlink()


def points_at_random(folder, source):
    """A sweep with shapes, of which a point is looked at."""
    for number in range(-1, arguments.files):
        draw = random.Random(f"{source.name} {arguments.seed} {number}")
        damaged = bytearray(source.read_bytes())
        for _ in range(draw.choice((1, 1, 2, 4, 16)) if number >= 0 else 0):
            damaged[draw.randrange(len(damaged))] = draw.choice((0, 1, 0x7f, 0x80, 0xff, draw.randrange(256)))
        path, shapes = folder/f"{source.stem}-{arguments.seed}-{number}.h5", folder/f"shapes{number}"
        path.write_bytes(damaged)
        words = "view", path, "--point", 1 + number % 2, "--output", shapes, "--frames", 0
        if not ends_well(f"view {path.name}", (0, 2) if number >= 0 else (0,), *words) and arguments.keep:
            os.makedirs(arguments.keep, exist_ok=True)
            (Path(arguments.keep)/path.name).write_bytes(damaged)


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        problem, result = folder/"problem.h5", folder/"result.h5"
        run("scene", "beam-body", "--output", problem, seconds=60)
        run("solve", problem, "--left", "--output", result, seconds=60)
        plain = write_problem(folder/"plain.h5")
        newest = write_problem(folder/"newest.h5", libver="latest")
        with h5py.File(problem) as file, h5py.File(folder/"zipped.h5", "w") as zipped:
            def zip_one(name, item):
                if isinstance(item, h5py.Group):
                    zipped.create_group(name).attrs.update(item.attrs)
                else:
                    zipped.create_dataset(name, data=item[:], compression="gzip", shuffle=True)
            file.visititems(zip_one)
        by_hand(folder)
        heaps(folder, plain, result)
        parts_of_numbers(folder, result)
        for source in (problem, result, plain, newest, folder/"zipped.h5"):
            check(f"{source.name} itself is read", run("info", source)[0] == 0)
            for number in range(arguments.files):
                at_random(folder, source, number)
        run("sweep", problem, problem, "--modes", 2, "--shapes", "--output", folder/"sweep.h5", seconds=60)
        points_at_random(folder, folder/"sweep.h5")
    print(f"{len(failures)} failed")
    sys.exit(bool(failures))


parser = argparse.ArgumentParser()
parser.add_argument("kschur", type=os.path.abspath)
parser.add_argument("--files", type=int, default=40)
parser.add_argument("--seed", type=int, default=0)
parser.add_argument("--megabytes", type=float, default=200, help="that a run may take; sanitizers take more")
parser.add_argument("--seconds", type=float, default=1, help="of the processor that a refusal may take; sanitizers take more")
parser.add_argument("--keep", type=os.path.abspath)
arguments = parser.parse_args()
main()
