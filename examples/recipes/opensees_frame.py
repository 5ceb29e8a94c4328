"""A frame of eight storeys with rigid diaphragms by OpenSees (openseespy from PyPI)."""
import numpy as np
import openseespy.opensees as ops
from comparison import lines_of, report, timed

import kschur

STOREYS, BAYS, HEIGHT, BAY = 8, 3, 3.0, 5.0
SIDE = range(BAYS + 1)


def build():
    """Columns and beams of concrete; the slabs are rigid in their planes, each with a node at its centre of mass."""
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.geomTransf("Linear", 1, 1.0, 0.0, 0.0)
    ops.geomTransf("Linear", 2, 0.0, 0.0, 1.0)
    for level in range(STOREYS + 1):
        for i in SIDE:
            for j in SIDE:
                ops.node(1000*level + 10*i + j, i*BAY, j*BAY, level*HEIGHT)
    for i in SIDE:
        for j in SIDE:
            ops.fix(10*i + j, *[1]*6)
    section = 0.16, 3e10, 1.25e10, 3.6e-3, 2.1e-3, 2.1e-3
    number = 0
    for level in range(1, STOREYS + 1):
        for i in SIDE:
            for j in SIDE:
                here = 1000*level + 10*i + j
                for other, transformation in [(here - 1000, 1)] + [(here - 10, 2)]*(i > 0) + [(here - 1, 2)]*(j > 0):
                    number += 1
                    ops.element("elasticBeamColumn", number, other, here, *section, transformation, "-mass", 400.0)
        centre = 1000*level + 999
        ops.node(centre, 0.55*BAYS*BAY, 0.48*BAYS*BAY, level*HEIGHT)
        ops.fix(centre, 0, 0, 1, 1, 1, 0)
        ops.mass(centre, 9e4, 9e4, 0.0, 0.0, 0.0, 3.4e6)
        ops.rigidDiaphragm(3, centre, *[1000*level + 10*i + j for i in SIDE for j in SIDE])


def own():
    ops.wipeAnalysis()
    ops.constraints("Transformation")
    return np.sqrt(ops.eigen(12)) / (2*np.pi)


def glue():
    problem, geometry = kschur.from_opensees(ops)
    return dict(M=problem.mass, K=problem.stiffness, R=problem.damping, Cq=problem.constraints, geometry=geometry)


build()
theirs, seconds = timed(own)
matrices, taken = timed(glue)
result, solved = timed(lambda: kschur.solve(**matrices, modes=12))
print(result)
report("opensees", f"frame of {STOREYS} storeys with rigid diaphragms", result.unknowns, lines_of(glue), result.frequency_hz, theirs,
       taken, solved, seconds)
