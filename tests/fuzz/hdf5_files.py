"""Damaged HDF5 files, problems and results: bytes at random, and wrong things in a sound file.

Each is read by the library, every second one first in a child process; or, guarded, all without one, and what the reader breaks
down over once more with one, as the program does. What is accepted must be what h5py reads from the same file.
"""
import io
import os
import random
import signal
import struct
import subprocess

import h5py
import numpy as np

import matrix_market
from cases import BROKE_DOWN, CRASHED, ENVIRONMENT, answers

# Bad input; a file that is none, or is cut; no memory.
ALLOWED = (2, 3, 4)
BATCH = 2000
ARRAYS = ("eigenvalues", "eigenvectors", "multipliers", "frequency_hz", "damped_frequency_hz", "damping_ratio", "backward_error", "error")
MATRICES = ("mass", "stiffness", "damping", "constraints")


def write_problem(**options):
    """A problem with all that may be in one, as h5py writes it."""
    image = io.BytesIO()
    with h5py.File(image, "w", **options) as file:
        for name, matrix in (("mass", np.diag(1.0 + np.arange(6))), ("stiffness", 2.0*np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)),
                             ("damping", 0.125*np.eye(6)), ("constraints", np.array([[1.0, 0, 0, 0, 0, -1]]))):
            group = file.create_group(name)
            group.attrs["encoding-type"] = "csr_matrix"
            group.attrs["encoding-version"] = "0.1.0"
            group.attrs["shape"] = matrix.shape
            rows, columns = np.nonzero(matrix)
            group["indptr"] = np.searchsorted(rows, np.arange(len(matrix) + 1))
            group["indices"] = columns.astype("i4")
            group.create_dataset("data", data=matrix[rows, columns], **({"compression": "gzip"} if name == "damping" else {}))
        file["coordinates"] = np.arange(6.0).reshape(2, 3)
        file["unknown_node"], file["unknown_component"] = np.arange(6)//3, np.arange(6) % 3
        file["cells/offsets"], file["cells/connectivity"], file["cells/types"] = [0, 2], [0, 1], [3]
    return image.getvalue()


def write_result(kschur, folder):
    problem, result = folder/"sound.h5", folder/"result.h5"
    problem.write_bytes(write_problem())
    subprocess.run([kschur, "solve", problem, "--modes", "3", "--left", "--properties", "--output", result], check=True,
                   stdout=subprocess.DEVNULL, env=ENVIRONMENT)
    return result.read_bytes()


def change_bytes(draw, image):
    damaged = bytearray(image)
    for _ in range(draw.choice((1, 1, 1, 2, 4, 16))):
        at = draw.randrange(len(damaged))
        damaged[at] = draw.choice((0, 1, 0x7f, 0x80, 0xff, damaged[at] ^ 1 << draw.randrange(8), draw.randrange(256)))
    if draw.random() < 0.1:
        del damaged[draw.randrange(len(damaged)):]
    return bytes(damaged)


WRONG = (-2**63, -2**31, -1, 0, 1, 5, 7, 2**31 - 2, 2**31 - 1, 2**31, 2**32 + 6, 2**63 - 1)


def change_things(draw, image):
    """Datasets and attributes of another type or extent, with other values, or none."""
    with io.BytesIO(image) as store:
        with h5py.File(store, "r+") as file:
            names = []
            file.visit(names.append)
            for _ in range(draw.choice((1, 1, 2, 4))):
                change_one(draw, file, draw.choice(names))
        return store.getvalue()


def change_one(draw, file, name):
    item = file.get(name)
    if item is None:
        return
    attributes = list(item.attrs) or list(file.attrs)
    holder = item if list(item.attrs) else file
    if attributes and (isinstance(item, h5py.Group) or draw.random() < 0.3):
        attribute = draw.choice(attributes)
        if draw.random() < 0.2:
            del holder.attrs[attribute]
        else:
            holder.attrs[attribute] = draw.choice((draw.choice(WRONG), np.array([draw.choice(WRONG), 6]), 1.5, np.nan, "", "csc_matrix",
                                                   "x"*5000, np.bytes_(b"csr_matrix"), np.arange(3), np.float32(2), [], 1 + 2j))
    elif isinstance(item, h5py.Dataset) and item.shape:
        values = item[()]
        del file[name]
        made = draw.randrange(6)
        if made == 0:
            file[name] = values.astype(draw.choice(("f4", "f8", ">f8", "i1", "u8", ">i4", "S5"))) if values.dtype.kind in "fiu" else np.arange(3)
        elif made == 1:
            file[name] = np.resize(values, max(0, values.size + draw.choice((-2, -1, 1, 2, 1000))))
        elif made == 2 and values.size and values.dtype.kind in "iu":
            values = values.astype("i8")
            values.flat[draw.randrange(values.size)] = draw.choice(WRONG)
            file[name] = values
        elif made == 3 and values.size and values.dtype.kind in "fc":
            values.flat[draw.randrange(values.size)] = draw.choice((np.nan, np.inf, -1.0, 0.0, 1e308, 1e-308))
            file[name] = values
        elif made == 4:
            file[name] = draw.choice((values[np.newaxis], "text", np.bytes_(b"text"), h5py.SoftLink("/nowhere"), h5py.SoftLink("/mass"),
                                      h5py.Empty("f8"), np.array(["a", "b"], dtype="S3")))
    else:
        del file[name]


class Judge:
    """What h5py reads from a file, in a process that the file may end."""

    def __init__(self, folder):
        self.place, self.words = folder/"judged", folder/"words"

    def read(self, kind, image):
        self.place.write_bytes(image)
        child = os.fork()
        if child == 0:
            try:
                signal.alarm(20)
                self.words.write_text(" ".join(map(str, what_h5py_reads(kind, self.place))))
                os._exit(0)
            finally:
                os._exit(1)
        return self.words.read_bytes() if os.waitpid(child, 0)[1] == 0 else None


def what_h5py_reads(kind, path):
    """The words that read_cases answers with, but for the order of entries."""
    bits = lambda values: [struct.pack(">d", value).hex().upper() for value in np.asarray(values).ravel()]
    with h5py.File(path) as file:
        if kind == "result":
            vectors = file["eigenvectors"]
            words = [vectors.shape[1], file["multipliers"].shape[1], vectors.shape[0]]
            for name in ARRAYS:
                # Files of the first days do not have the last.
                values = np.ascontiguousarray(file[name][()]) if name in file else np.full(vectors.shape[0], np.nan)
                words += bits(values.view("f8") if values.dtype.kind == "c" else values.astype("f8"))
            return words
        words = []
        for name in MATRICES:
            n = file["mass"].attrs["shape"][0]
            if name not in file:
                words += [0 if name == "constraints" else n, n, 0]
                continue
            group = file[name]
            starts, columns, data = (group[part][()] for part in ("indptr", "indices", "data"))
            words += [*group.attrs["shape"], len(data)]
            for row in range(len(starts) - 1):
                for k in range(starts[row], starts[row + 1]):
                    words += [row + 1, int(columns[k]) + 1, *bits(np.float64(data[k]))]
        return words


def make(seed, number, images):
    draw = random.Random(f"hdf5 {seed} {number}")
    kind, image = draw.choice(images)
    return kind, draw.choice((change_bytes, change_bytes, change_things))(draw, image)


def judge(kind, image, answer, sound, judged):
    if answer.startswith(CRASHED):
        return answer.decode(errors="replace")
    words = answer.split()
    if words[0] == b"error":
        return "" if int(words[1]) in ALLOWED and answer.split(b" ", 2)[2] else answer.decode(errors="replace")
    if answer in sound:
        return ""
    expected = judged.read(kind, image)
    if expected is None:
        return "accepted, but h5py does not read it"
    same = matrices(words[1:]) == matrices(expected.split()) if kind == "problem" else words[1:] == expected.split()
    return "" if same else f"not what h5py reads: {answer.decode()}, {expected.decode()}"


def matrices(words):
    """Each as a dictionary of entries, repeated ones summed, by their words."""
    found = []
    while words:
        rows, columns, count = map(int, words[:3])
        entries = {}
        for k in range(3, 3 + 3*count, 3):
            entries.setdefault((words[k], words[k + 1]), 0.0)
            entries[words[k], words[k + 1]] += matrix_market.from_bits(words[k + 2])
        found.append((rows, columns, entries))
        words = words[3 + 3*count:]
    return found


def run(arguments, folder):
    """Yields (name, bytes, what is wrong) for what fails."""
    images = [("problem", write_problem()), ("problem", write_problem(libver="latest")), ("result", write_result(arguments.kschur, folder))]
    sound = set(answers(arguments.reader, images, folder))
    assert all(answer.startswith(b"ok") for answer in sound), sound
    judged = Judge(folder)
    for first in range(0, arguments.number, BATCH):
        batch = [make(arguments.seed, number, images) for number in range(first, min(first + BATCH, arguments.number))]
        given = [(kind + (number % 2 or arguments.guarded)*"!", image) for number, (kind, image) in enumerate(batch)]
        for number, ((kind, image), answer) in enumerate(zip(batch, answers(arguments.reader, given, folder))):
            if arguments.guarded and answer.startswith(BROKE_DOWN):
                arguments.broke_down += 1
                answer, = answers(arguments.reader, [(kind, image)], folder)
            wrong = judge(kind, image, answer, sound, judged)
            if wrong:
                yield f"{arguments.seed}-{first + number}.{kind}", image, wrong
