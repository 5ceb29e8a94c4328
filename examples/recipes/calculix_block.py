"""A clamped block of steel by CalculiX (Debian's package calculix-ccx), of quadratic bricks."""
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from comparison import lines_of, report, timed

import kschur

MODES = 10
CELLS = 16, 5, 2
STEP = """*STEP
*FREQUENCY{option}
{modes}
{wanted}*END STEP
"""


def deck():
    """Nodes, elements (C3D20), material and the clamped end."""
    nodes, elements, number = [], [], {}

    def node(place):
        """The number of a node at twice its place, in cells."""
        if place not in number:
            number[place] = len(number) + 1
            nodes.append(f"{number[place]}, " + ", ".join(f"{0.03*coordinate:.6f}" for coordinate in place))
        return str(number[place])
    base = [(0, 0), (2, 0), (2, 2), (0, 2)]
    middle = [(1, 0), (2, 1), (1, 2), (0, 1)]
    brick = [(x, y, z) for flat, z in ((base, 0), (base, 2), (middle, 0), (middle, 2), (base, 1)) for x, y in flat]
    for cell in np.ndindex(*CELLS):
        corners = [node(tuple(2*at + step for at, step in zip(cell, place))) for place in brick]
        elements.append(f"{len(elements) + 1}, " + ", ".join(corners[:10]) + ",\n" + ", ".join(corners[10:]))
    clamped = [str(k) for place, k in number.items() if place[0] == 0]
    return "\n".join(["*NODE, NSET=ALL", *nodes, "*ELEMENT, TYPE=C3D20, ELSET=BLOCK", *elements, "*NSET, NSET=CLAMPED", *(k + "," for k in clamped),
                      "*BOUNDARY\nCLAMPED, 1, 3", "*MATERIAL, NAME=STEEL\n*ELASTIC\n210e9, 0.3\n*DENSITY\n7850.0",
                      "*SOLID SECTION, ELSET=BLOCK, MATERIAL=STEEL\n"])


def run(folder, job, **words):
    (folder / f"{job}.inp").write_text(deck() + STEP.format(modes=MODES, **words))
    subprocess.run([shutil.which("ccx"), job], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def own(folder):
    run(folder, "own", option="", wanted="*NODE PRINT, NSET=CLAMPED, FREQUENCY=0\nU\n")
    text = (folder / "own.dat").read_text().split("P A R T I C I P A T I O N")[0]
    return np.array([float(row[3]) for row in re.findall(r"^\s+(\d+)\s+(\S+)\s+(\S+)\s+(\S+)\s+\S+\s*$", text, re.M)])


def glue(folder):
    run(folder, "matrices", option=", SOLVER=MATRIXSTORAGE", wanted="")
    return kschur.read(folder / "matrices.sti", folder / "matrices.mas")


with tempfile.TemporaryDirectory() as work:
    theirs, seconds = timed(lambda: own(Path(work)))
    problem, taken = timed(lambda: glue(Path(work)))
result, solved = timed(lambda: kschur.solve(problem.mass, problem.stiffness, modes=MODES))
print(result)
report("calculix", "clamped block of quadratic bricks", result.unknowns, lines_of(glue), result.frequency_hz, theirs, taken, solved, seconds)
