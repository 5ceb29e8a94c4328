"""Modes of a sandwich beam with a lossy core, of finite elements, against the equation of sixth order of D. J. Mead and S. Markus,
The forced vibration of a three-layer, damped sandwich beam with arbitrary boundary conditions, J. Sound Vib. 10 (1969).

Two elastic faces, bent with the deflection w and stretched by u and -u, shear the core between them. For a width of one,

    D w'''' - (G d/c) (d w' + 2 u)' = m omega^2 w,    A u'' = (2 G/c) (d w' + 2 u),

D = E h^3/6, A = 2 E h, d = h + c, and G times 1 + i eta. With exponentials exp(s x) these are a cubic equation in s^2; the determinant
of six conditions at the ends, each of its rows scaled, is zero at omega^2. The roots below are those of mpmath 1.3 with 50 digits."""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

from checks import check, finish

PROGRAM = sys.argv[1]
LENGTH, FACE, CORE = 0.1778, 1.524e-3, 1.27e-4
MODULUS, SHEAR, FACE_DENSITY, CORE_DENSITY = 6.9e10, 6.9e5, 2766.0, 968.0
ELEMENTS = 80
# Error of the elements, of fourth order in their length: 1.3e-6 of omega^2 of the highest mode, of 2.9e-6 if the beam is clamped.
DISCRETISATION = 4e-6
# Unknowns w, w', u, u' that an end holds.
HELD = {"clamped": [0, 1, 2], "hinged": [0], "free": []}

# Real and imaginary parts of omega^2 (1/s^2), by ends and loss factor of the core.
KNOWN = {
    ("clamped", "free", 0.1): [
        (162356.25159208914, 4570.2421283207597), (3474600.7305060318, 84221.48245442153),
        (21872282.124722099, 337068.47346107848), (76840074.367980015, 683179.39213575113),
        (202179780.43117572, 1157534.9735419117)],
    ("clamped", "free", 1.0): [
        (179674.79791051718, 36330.965016600684), (3625557.4812383546, 789219.89190255751),
        (22162534.313509991, 3329831.0530813727), (77132274.823381852, 6795816.829012903),
        (202499930.18297616, 11546258.844227707)],
    ("clamped", "clamped", 0.6): [
        (3018911.7478944907, 340435.52680465568), (20518690.873087325, 1334057.8742759267),
        (74921836.056317325, 3069927.6056003624), (199487299.10569077, 5437368.2214083236),
        (438794632.70708099, 8475532.559299898)],
    ("hinged", "hinged", 1.5): [
        (1019828.3703190389, 401782.91873412687), (9731393.3026056995, 2730549.9178425006),
        (42623696.054397966, 6769519.1368965412), (127595244.70918314, 12440760.167375231),
        (303625414.81131178, 19736127.750534522)],
    ("clamped", "hinged", 1.0): [
        (1705060.3629649334, 419306.31035747176), (14208010.399415255, 2048760.284768952),
        (56882874.074637767, 4822555.4529460147), (160352058.44626409, 8692853.5646338529),
        (366365269.83638047, 13649825.927515335)]}


def element(size):
    """Mass, stiffness of the faces and of the core of an element, all of Hermite's cubics."""
    bending, distance, mass = MODULUS * FACE**3 / 6, FACE + CORE, 2 * FACE_DENSITY * FACE + CORE_DENSITY * CORE
    points, weights = np.polynomial.legendre.leggauss(5)
    found = np.zeros((3, 8, 8))
    for x, weight in zip((points + 1) / 2, weights * size / 2):
        value = [1 - 3 * x**2 + 2 * x**3, size * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, size * (x**3 - x**2)]
        slope = np.array([6 * x**2 - 6 * x, size * (1 - 4 * x + 3 * x**2), 6 * x - 6 * x**2, size * (3 * x**2 - 2 * x)]) / size
        curvature = np.array([12 * x - 6, size * (6 * x - 4), 6 - 12 * x, size * (6 * x - 2)]) / size**2
        rows = np.zeros((4, 8))
        rows[0, [0, 1, 4, 5]] = value
        rows[1, [0, 1, 4, 5]] = curvature
        rows[2, [2, 3, 6, 7]] = slope
        rows[3, [0, 1, 4, 5]], rows[3, [2, 3, 6, 7]] = distance * slope, 2 * np.array(value)
        deflection, bent, stretched, sheared = (np.outer(row, row) for row in rows)
        found += weight * np.array([mass * deflection, bending * bent + 2 * MODULUS * FACE * stretched, SHEAR / CORE * sheared])
    return found


def beam(left, right, loss_factor):
    """M, K and H."""
    size = 4 * (ELEMENTS + 1)
    whole = np.zeros((3, size, size))
    for first in range(0, 4 * ELEMENTS, 4):
        whole[:, first:first + 8, first:first + 8] += element(LENGTH / ELEMENTS)
    held = HELD[left] + [4 * ELEMENTS + i for i in HELD[right]]
    free = [i for i in range(size) if i not in held]
    mass, faces, core = whole[:, free][:, :, free]
    return {"M": mass, "K": faces + core, "L": loss_factor * core}


def write(folder, matrices):
    for name, matrix in matrices.items():
        entries = [f"{i + 1} {j + 1} {matrix[i, j]:.17g}\n" for i, j in np.argwhere(np.tril(matrix))]
        (folder / f"{name}.mtx").write_text("%%MatrixMarket matrix coordinate real symmetric\n"
                                            f"{len(matrix)} {len(matrix)} {len(entries)}\n" + "".join(entries))


def solve(folder, *options):
    words = [PROGRAM, "solve", str(folder), "--modes", "5", "--format", "json", "--quiet", *options]
    return json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)["modes"]


for (left, right, loss_factor), known in KNOWN.items():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write(folder, beam(left, right, loss_factor))
        for options in ([], ["--formulation", "quadratic"]):
            modes = solve(folder, *options)
            squares = np.array([-complex(*mode["eigenvalue"])**2 for mode in modes])
            exact = np.array([complex(*parts) for parts in known])
            errors = abs(squares - exact) / abs(exact)
            check(f"omega^2 {left}-{right} {' '.join(options)}: {errors.max():.1e}", errors.max() < DISCRETISATION)
            factors = np.array([mode["loss_factor"] for mode in modes])
            errors = abs(factors / (exact.imag / exact.real) - 1)
            check(f"loss factors {left}-{right} {' '.join(options)}: {errors.max():.1e}", errors.max() < DISCRETISATION)
finish()
