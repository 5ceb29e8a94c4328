#!/usr/bin/python3
"""The tables and figures of Mangoni, Tasora and Peng, Machines 2023, 11, 218, made again.

    paper.py [table1|1|2|3|4a|4b|5|6 ...] [--programs FOLDER] [--output FOLDER]

prints numbers, as docs/paper.md has them beside the published ones, and draws FOLDER/figure-N.png (build/paper). Without a
name all of them, which takes some minutes. FOLDER of the programs has kschur and the examples: that of the kschur on the PATH, or
build/release/bin. Needs NumPy, SciPy, h5py and Matplotlib.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

NAMES = ("table1", "1", "2", "3", "4a", "4b", "5", "6")


def parse():
    parser = argparse.ArgumentParser(prog="paper.py", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    beside = pathlib.Path(shutil.which("kschur") or "build/release/bin/kschur").parent
    parser.add_argument("--programs", default=beside, metavar="FOLDER", help="of kschur and the examples")
    parser.add_argument("--output", default="build/paper", metavar="FOLDER", help="where pictures are drawn")
    return parser.parse_args()


# Before the imports: help takes Python alone.
OPTIONS = parse() if __name__ == "__main__" else None

import h5py  # noqa: E402
import matplotlib  # noqa: E402
import numpy as np  # noqa: E402
import scipy.linalg  # noqa: E402
import scipy.sparse as sparse  # noqa: E402
import scipy.sparse.linalg  # noqa: E402

from kschur_report.fit import fit_line, growth_exponent  # noqa: E402
from kschur_report.problem import read_problem  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402

plt.rcParams.update({"figure.dpi": 80, "font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
PAPERS_SHIFT = 1e-3


class Bench:
    """The programs, a folder for files, and one for pictures."""

    def __init__(self, programs, output, folder):
        self.programs, self.output, self.folder = pathlib.Path(programs).resolve(), pathlib.Path(output), folder
        self.output.mkdir(parents=True, exist_ok=True)

    def run(self, program, *words):
        if not (self.programs / program).exists():
            sys.exit(f"paper.py: there is no {program} in {self.programs}: a build has the examples, an installation has not; "
                     "take --programs build/release/bin")
        return subprocess.run([self.programs / program, *map(str, words)], check=True, capture_output=True, text=True).stdout

    def scene(self, *words):
        path = f"{self.folder}/scene.h5"
        self.run("kschur", "scene", *words, "--output", path)
        return path

    def solve(self, path, *words):
        """What `kschur solve` says, as JSON has it, and its eigenvalues, shapes and multipliers, a row a mode."""
        result = f"{self.folder}/result.h5"
        told = json.loads(self.run("kschur", "solve", path, "--format", "json", "--output", result, *words))
        with h5py.File(result) as file:
            return told, file["eigenvalues"][:], file["eigenvectors"][:], file["multipliers"][:]

    def example(self, name, *words):
        """The numbers that an example prints; its other lines start with #."""
        return np.loadtxt(self.run(f"example_{name}", *words).splitlines(), ndmin=2)

    def save(self, figure, name):
        figure.tight_layout()
        figure.savefig(self.output / f"figure-{name}.png")
        plt.close(figure)


def pencil(problem, factor=1.0):
    """A and B of (33), the constraints times a factor."""
    n, m = problem.unknowns, problem.constraints.shape[0]
    cq, one = factor*problem.constraints, sparse.identity(n)
    a = sparse.bmat([[None, one, None], [-problem.stiffness, -problem.damping, -cq.T], [-cq, None, sparse.csr_matrix((m, m))]])
    return a.tocsc(), sparse.block_diag([one, problem.mass, sparse.csr_matrix((m, m))]).tocsc()


def table1(_):
    """Zero and infinite eigenvalues of the pencils with constraints: definite M and K, n = 12, m = 3."""
    random, n, rows = np.random.default_rng(1), 12, 3
    m, k, r = (x @ x.T + n*np.eye(n) for x in random.standard_normal((3, n, n)))
    c, one = random.standard_normal((rows, n)), np.eye(n)
    o, z, nr = np.zeros((n, n)), np.zeros((rows, rows)), np.zeros((n, rows))
    pencils = {
        "(20)": (-np.block([[k, c.T], [c, z]]), scipy.linalg.block_diag(m, z)),
        "(22)": (-scipy.linalg.block_diag(k, z), np.block([[m, c.T], [c, z]])),
        "(33)": (np.block([[o, one, nr], [-k, -r, -c.T], [-c, nr.T, z]]), scipy.linalg.block_diag(one, m, z)),
        "(34)": (np.block([[o, one, nr], [-k, -r, nr], [nr.T, nr.T, z]]), np.block([[one, o, nr], [o, m, c.T], [c, nr.T, z]])),
        "(34), [0 Cq 0]": (np.block([[o, one, nr], [-k, -r, nr], [nr.T, nr.T, z]]),
                           np.block([[one, o, nr], [o, m, c.T], [nr.T, c, z]])),
    }
    print(f"# pencil: order, rank of B, eigenvalues zero, infinite, others; n = {n}, m = {rows}")
    for name, (a, b) in pencils.items():
        counts = [multiplicity(scipy.linalg.solve(a - b, t)) for t in (a, b)]
        print(f"{name:16s} {len(a):4d} {np.linalg.matrix_rank(b):4d} {counts[0]:4d} {counts[1]:4d} {len(a) - sum(counts):4d}")


def multiplicity(matrix):
    """Of the eigenvalue zero: the dimension of the null space of a power, as Jordan blocks are of size 3 at most."""
    return len(matrix) - np.linalg.matrix_rank(np.linalg.matrix_power(matrix/np.linalg.norm(matrix, 2), 3), tol=1e-13)


def figure1(bench):
    """Eigenvalues of the cantilever under ever heavier bodies."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2))
    print("# mass of the tip (kg)  first frequency (Hz)  the same on a massless beam  worst backward error of 20")
    table = []
    for mass in (4e3, 1e5, 1e7, 1e9):
        told, values, _, _ = bench.solve(bench.scene("cantilever", "--tip-mass", f"{mass:g}"), "--modes", 20)
        worst = max(mode["backward_error"] for mode in told["modes"])
        table.append((mass, min(abs(values))/(2*np.pi), massless(mass)/(2*np.pi), worst))
        print("{:9.1e} {:14.6e} {:14.6e} {:9.1e}".format(*table[-1]))
        axes[0].loglog(-values.real, values.imag, "o", markersize=4, label=f"{mass:g} kg")
    axes[0].set(xlabel="-Re (1/s)", ylabel="Im (1/s)", title="eigenvalues")
    axes[0].legend()
    masses, first, without, _ = np.array(table).T
    axes[1].loglog(masses, first, "o", label="10 elements")
    axes[1].loglog(masses, without, label="massless beam")
    axes[1].set(xlabel="mass of the body (kg)", ylabel="first frequency (Hz)")
    axes[1].legend()
    bench.save(figure, 1)


def massless(mass, length=6.0, arm=0.5, bending=100e6*0.3*0.05**3/12):
    """omega of a body on a massless beam: det(K - omega^2 M) = 0 with the body's centre an arm beyond the tip."""
    k = bending/length**3*np.array([[12, -6*length], [-6*length, 4*length**2]])
    m = mass*np.array([[1, arm], [arm, 5/12 + arm**2]])
    return np.sqrt(scipy.linalg.eigvalsh(k, m)[0])


def figure2(bench):
    """The crank whose second and sixth oscillation are at 52 and 200 Hz."""
    fitted = ("--material", "table-2", "--angle", "113", "--scale", "1.151")
    frequencies = {}
    for name, words in (("steel, 60 degrees", ()), ("table-2, 60 degrees", fitted[:2]), ("fitted", fitted)):
        _, values, shapes, _ = bench.solve(bench.scene("crank", "--damping", "none", *words), "--modes", 7)
        frequencies[name] = np.sort(abs(values))[1:]/(2*np.pi)
    print("# crank: the first six oscillations (Hz)")
    for name, found in frequencies.items():
        print(f"{name:20s}", *(f"{f:8.1f}" for f in found))
    with h5py.File(f"{bench.folder}/result.h5") as file:
        points, surface = file["coordinates"][:], surface_of(file["cells/connectivity"][:].reshape(-1, 4))
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.2))
    for axis, mode in zip(axes, (2, 6)):
        # The first shape is the motion of the mechanism.
        shape = shapes[mode].real.reshape(-1, 3)
        moved = points + 0.04*shape/abs(shape).max()
        axis.tripcolor(moved[:, 0], moved[:, 1], surface, np.linalg.norm(shape, axis=1), shading="gouraud")
        axis.set(aspect="equal", title=f"oscillation {mode}, {frequencies['fitted'][mode - 1]:.0f} Hz")
        axis.set_axis_off()
    bench.save(figure, 2)


def surface_of(tetrahedra):
    """The triangles that belong to one tetrahedron only."""
    faces = np.sort(tetrahedra[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    faces, count = np.unique(faces, axis=0, return_counts=True)
    return faces[count == 1]


def figure3(bench):
    """Residuals of the free bodies, by row of (33)."""
    draw_residuals(bench, 3, ("free-free",), 60, ("--modes", 40))


def figure6(bench):
    """Residuals of the 20x14 grid, by row of (33)."""
    draw_residuals(bench, 6, ("grid", "--cells", "20x14"), 100, ("--modes", 56))


def draw_residuals(bench, name, scene, count, words):
    path = bench.scene(*scene)
    problem = read_problem(path)
    a, b = pencil(problem)
    n = problem.unknowns
    states = {"ARPACK on (33), shift 1e-3": by_arpack(a, b, count)}
    for label, more in (("kschur on (33), shift 1e-3", ("--formulation", "damped-constrained", "--shift", PAPERS_SHIFT)),
                        ("kschur", ())):
        _, values, shapes, multipliers = bench.solve(path, *words, *more)
        states[label] = values, np.hstack([shapes, values[:, None]*shapes, multipliers]).T
    figure, axes = plt.subplots(1, len(states), figsize=(11, 3.2), sharey=True)
    print("# the largest residual |A x - lambda B x| with ||phi|| = 1: position, velocity and constraint rows")
    for axis, (label, (values, x)) in zip(axes, states.items()):
        x = x/np.linalg.norm(x[:n], axis=0)
        rows = abs(a @ x - (b @ x)*values).max(axis=1)
        parts = [rows[:n].max(), rows[n:2*n].max(), rows[2*n:].max()]
        print(f"{label:28s}", *(f"{part:9.1e}" for part in parts))
        axis.semilogy(np.maximum(rows, 1e-20), ".", markersize=2)
        for edge in (n, 2*n):
            axis.axvline(edge, color="gray", linewidth=0.8)
        axis.set(xlabel="row: position, velocity, constraint", title=label)
    axes[0].set_ylabel("largest residual of a row")
    bench.save(figure, name)


def by_arpack(a, b, count):
    """The eigenpairs nearest to the paper's shift: ARPACK on the whole pencil, multipliers in its vectors."""
    factors = scipy.sparse.linalg.splu((a - PAPERS_SHIFT*b).tocsc())
    operator = scipy.sparse.linalg.LinearOperator(a.shape, matvec=lambda x: factors.solve(b @ x))
    start = np.random.default_rng(1).standard_normal(a.shape[0])
    mu, x = scipy.sparse.linalg.eigs(operator, k=count, ncv=2*count, v0=start, tol=1e-12)
    return PAPERS_SHIFT + 1/mu, x


def figure4a(bench):
    """Scaling of the constraints of the turbine."""
    table = bench.example("turbine_scaling", 3)
    print("# turbine, 40 eigenvalues at the shift 1e-3, multipliers in the vectors as in the paper")
    print("# speed (rpm)  residual and violation, constraints as given; scaled by one factor; kschur: backward error")
    for row in table:
        print(f"{row[0]:8.2f}", *(f"{value:9.1e}" for value in row[1:]))
    path = bench.scene("turbine", "--speed", "12.1")
    _, _, shapes, multipliers = bench.solve(path, "--modes", 20)
    ratios = np.linalg.norm(multipliers, axis=1)/np.linalg.norm(shapes, axis=1)
    print(f"# multipliers of 20 modes at 12.1 rpm: {ratios.min():.0e} to {ratios.max():.0e} times the motions")
    a, _ = pencil(read_problem(path))
    factors, _, _ = scipy.linalg.lapack.dgetrf(a.toarray())
    print(f"# reciprocal condition number of A at 12.1 rpm: {scipy.linalg.lapack.dgecon(factors, abs(a).sum(0).max())[0]:.1e}")
    figure, axis = plt.subplots(figsize=(6, 3.2))
    for column, label, mark in ((1, "as given: residual", "rX-"), (2, "as given: violation", "rs--"), (3, "scaled: residual", "bo-"),
                                (4, "scaled: violation", "b^--"), (5, "kschur: backward error", "k.-")):
        axis.semilogy(table[:, 0], table[:, column], mark, label=label)
    axis.set(xlabel="speed (rpm)", ylabel="worst of 40 eigenvalues")
    axis.legend(fontsize=7)
    bench.save(figure, "4a")


def figure4b(bench):
    """Damping ratios of the turbine over its speed."""
    speeds = np.linspace(0, 12.1, 25)
    modes = [bench.solve(bench.scene("turbine", "--speed", speed), "--modes", 11)[0]["modes"] for speed in speeds]
    frequencies, ratios = (np.array([[mode[name] for mode in some] for some in modes]) for name in ("damped_frequency_hz", "damping_ratio"))
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4))
    axes[0].plot(speeds, frequencies, ".", color="tab:blue", markersize=4)
    axes[0].set(xlabel="speed (rpm)", ylabel="damped frequency (Hz)")
    axes[1].plot(speeds, 100*ratios, ".", color="tab:blue", markersize=4)
    axes[1].set(xlabel="speed (rpm)", ylabel="damping ratio (%)", ylim=(0, None))
    bench.save(figure, "4b")
    print("# speed (rpm)  smallest and largest damping ratio of 11 modes (%)  unstable ones")
    for k in range(0, len(speeds), 12):
        unstable = sum(mode["kind"] == "unstable" for mode in modes[k])
        print(f"{speeds[k]:8.2f} {100*ratios[k].min():8.3f} {100*ratios[k].max():8.3f} {unstable:4d}")


def figure5(bench):
    """Time of the 100 lowest eigenvalues of grids, one thread."""
    figure, axis = plt.subplots(figsize=(6, 3.4))
    print("# grids of beams, 56 modes or 100 eigenvalues, one thread: unknowns and seconds")
    for label, words, cells in (
        ("kschur", (), ("10x7", "20x14", "30x21", "40x28", "50x35", "60x42")),
        ("kschur, pencil (33)", ("--formulation", "damped-constrained"), ("10x7", "20x14", "30x21", "40x28")),
    ):
        points = []
        for size in cells:
            path = bench.scene("grid", "--cells", size)
            runs = [bench.solve(path, "--modes", 56, "--threads", 1, *words)[0] for _ in range(1 if words else 3)]
            points.append((runs[0]["problem"]["n"], min(run["seconds"]["total"] for run in runs)))
        unknowns, seconds = np.array(points).T
        line = fit_line(unknowns, seconds)
        print(f"{label}:", ", ".join(f"{n:.0f} {s:.3g}" for n, s in points))
        print(f"  R^2 = {line.r_squared:.4f}, grows as n^{growth_exponent(unknowns, seconds):.2f}")
        axis.plot(unknowns/1e3, seconds, "o", label=f"{label}: R² = {line.r_squared:.4f}")
        axis.plot(unknowns/1e3, line.intercept + line.slope*unknowns, color=axis.lines[-1].get_color(), linewidth=1)
    axis.set(xlabel="unknowns n (thousands)", ylabel="time (s)")
    axis.legend()
    bench.save(figure, 5)


FIGURES = dict(zip(NAMES, (table1, figure1, figure2, figure3, figure4a, figure4b, figure5, figure6)))


def main(options):
    for name in options.names or FIGURES:
        if name not in FIGURES:
            sys.exit(f"paper.py: there is no '{name}', only {', '.join(FIGURES)}")
        with tempfile.TemporaryDirectory() as folder:
            FIGURES[name](Bench(options.programs, options.output, folder))


if __name__ == "__main__":
    main(OPTIONS)
