#!/usr/bin/env python3
"""losses.py PROGRAM: kschur and SLEPc on a grid of beams every other of which has another loss factor, in turns, each run a process
of its own.

H is the stiffness of each beam times its loss factor; beams are what K connects, and constraints hold them together. SLEPc is run in complex arithmetic (peers/slepc_losses.py), at the shift that kschur chose, for as many eigenvalues as are needed
there to have all modes that kschur found, which is found out beforehand. One line a program: medians of seconds, from the matrices
in memory to the modes in memory; of seconds of the processor, of kschur with reading and writing files; the worst backward error, by one piece of code in extended precision. Last how far the
eigenvalues are apart."""
import argparse
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--cells", default="60x42")
    parser.add_argument("--modes", type=int, default=28)
    parser.add_argument("--factors", type=float, nargs=2, default=(0.02, 0.3), metavar="G")
    parser.add_argument("--tolerance", type=float, default=1e-12)
    parser.add_argument("--repeat", type=int, default=3)
    return parser.parse_args()


# Before the imports: help takes Python alone.
ARGUMENTS = parse() if __name__ == "__main__" else None

import h5py  # noqa: E402
import numpy as np  # noqa: E402
import scipy.sparse as sp  # noqa: E402
from scipy.sparse.csgraph import connected_components  # noqa: E402

from kschur_report import slepc  # noqa: E402
from kschur_report.problem import infinity_norm, read_matrix, read_problem  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent


def add_losses(path, factors):
    """Writes /loss into a problem without one."""
    stiffness = read_problem(path).stiffness
    _, beam = connected_components(stiffness, directed=False)
    loss = sp.csr_matrix(sp.diags(np.where(beam % 2 == 0, *factors)) @ stiffness)
    with h5py.File(path, "a") as file:
        group = file.create_group("loss")
        for name, value in (("data", loss.data), ("indices", loss.indices), ("indptr", loss.indptr)):
            group[name] = value
        group.attrs["shape"] = file["stiffness"].attrs["shape"]
        for name, value in file["stiffness"].attrs.items():
            group.attrs[name] = value


def backward_error(problem, loss, value, shape, multipliers):
    """||P(lambda) phi + Cq^T xi||/((|lambda|^2 ||M|| + |lambda| ||R|| + ||K|| + ||H||) ||phi||) in extended precision."""
    value, x, xi = np.clongdouble(value), shape.astype(np.clongdouble), multipliers.astype(np.clongdouble)
    mass, damping, stiffness, losses, constraints = (
        matrix.astype(np.longdouble) for matrix in (problem.mass, problem.damping, problem.stiffness, loss, problem.constraints))
    rest = value**2 * (mass @ x) + value * (damping @ x) + stiffness @ x + np.clongdouble(1j) * (losses @ x)
    if len(xi):
        rest = rest + constraints.T @ xi
    sizes = [infinity_norm(matrix) for matrix in (problem.mass, problem.damping, problem.stiffness)]
    size = np.polyval(sizes, abs(complex(value))) + infinity_norm(loss)
    return float(np.sqrt(np.sum(abs(rest) ** 2)) / (size * np.linalg.norm(shape)))


def run_ours(arguments, path, output):
    words = [arguments.program, "solve", str(path), "--modes", str(arguments.modes), "--threads", "1", "--format", "json", "--quiet",
             "--tolerance", str(arguments.tolerance), "--output", str(output)]
    before = processor_seconds()
    told = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    return (told["seconds"]["total"], processor_seconds() - before), told


def processor_seconds():
    """Of all processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run_slepc(arguments, path, output, count, shift):
    environment = {**os.environ, **slepc.environment("complex"), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    words = [sys.executable, str(HERE / "peers" / "slepc_losses.py"), str(path), "--eigenvalues", str(count),
             "--shift", *map(repr, shift), "--tolerance", str(arguments.tolerance), "--output", str(output)]
    subprocess.run(words, check=True, env=environment)
    with h5py.File(output) as file:
        return float(file.attrs["seconds"]), float(file.attrs["processor_seconds"])


def read_modes(path):
    with h5py.File(path) as file:
        return [file[name][:] for name in ("eigenvalues", "eigenvectors", "multipliers")]


def matched(expected, found):
    """The places of those found that are nearest to each that is expected but zeros, which a double zero blurs; how far they are
    apart at most, relative to the eigenvalue."""
    expected = expected[np.abs(expected) > 0]
    if len(found) == 0:
        return [], np.inf
    places = [int(np.abs(found - value).argmin()) for value in expected]
    return places, max(np.abs(found[places] - expected) / np.abs(expected))


def main(arguments):
    if slepc.environment("complex") is None:
        sys.exit("SLEPc for complex numbers is not installed: python3-slepc4py-complex of Debian")
    with tempfile.TemporaryDirectory() as folder:
        path, ours, theirs = (pathlib.Path(folder, name) for name in ("problem.h5", "ours.h5", "theirs.h5"))
        subprocess.run([arguments.program, "scene", "grid", "--cells", arguments.cells, "--output", str(path)], check=True,
                       stdout=subprocess.DEVNULL)
        add_losses(path, arguments.factors)
        _, told = run_ours(arguments, path, ours)
        expected = read_modes(ours)[0]
        # What SLEPc need not do is not asked of it: the fewest eigenvalues at the shift with which all of ours are there, to the
        # digits that it has of small decays beside zeros.
        count = arguments.modes
        while True:
            run_slepc(arguments, path, theirs, count, told["shift"])
            if matched(expected, read_modes(theirs)[0])[1] < 1e-4 or count > 8 * arguments.modes:
                break
            count = int(1.25 * count) + 1
        seconds = [(run_ours(arguments, path, ours)[0], run_slepc(arguments, path, theirs, count, told["shift"]))
                   for _ in range(arguments.repeat)]
        problem = read_problem(path)
        with h5py.File(path) as file:
            loss = read_matrix(file, "loss")
        medians = [[statistics.median(column) for column in zip(*runs)] for runs in zip(*seconds)]
        print(f"grid {arguments.cells}, {problem.unknowns} unknowns, {problem.constraints.shape[0]} constraints, {arguments.modes} modes, "
              f"loss factors {arguments.factors[0]} and {arguments.factors[1]}")
        print(f"{'program':8} {'eigenvalues':>11} {'seconds':>9} {'processor':>10} {'backward error':>15}")
        for name, file, times, asked in (("kschur", ours, medians[0], arguments.modes), ("SLEPc", theirs, medians[1], count)):
            values, shapes, multipliers = read_modes(file)
            errors = [backward_error(problem, loss, values[k], shapes[k], multipliers[k]) for k in matched(expected, values)[0]]
            print(f"{name:8} {asked:11d} {times[0]:9.3f} {times[1]:10.3f} {max(errors):15.1e}")
        ratios = [theirs / ours for ours, theirs in zip(*medians)]
        print(f"SLEPc / kschur {ratios[0]:.2f}, of the processor {ratios[1]:.2f}, eigenvalues but zeros apart by "
              f"{matched(expected, read_modes(theirs)[0])[1]:.1e} at most; kschur: {told['formulation']}, {told['reason']}")


if __name__ == "__main__":
    main(ARGUMENTS)
