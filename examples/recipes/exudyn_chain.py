"""A chain that hangs by revolute joints, with springs and dampers in them, by Exudyn (from PyPI).

Exudyn knows it in two ways: bodies and joints, that is redundant coordinates with constraints, where its own K lacks the reactions of
the joints; and a kinematic tree, in joint coordinates, where nothing is missing. Of the former kschur gets what Exudyn says of
the latter."""
import exudyn as exu
import numpy as np
from comparison import lines_of, report, timed
from exudyn.utilities import InertiaCuboid, NodeGenericODE2, ObjectKinematicTree

import kschur

LINKS, LENGTH, GRAVITY, STIFFNESS, DAMPING = 20, 0.5, 9.81, 20.0, 0.05
INERTIA = InertiaCuboid(density=7800.0, sideLengths=[0.02, 0.02, LENGTH])


def bodies_and_joints():
    system = exu.SystemContainer().AddSystem()
    last = system.CreateGround()
    for link in range(LINKS):
        top = [0, 0, -link*LENGTH]
        body = system.CreateRigidBody(inertia=INERTIA, referencePosition=[0, 0, top[2] - LENGTH/2], gravity=[0, 0, -GRAVITY])
        system.CreateRevoluteJoint(itemNumbers=[last, body], position=top, axis=[0, 1, 0], useGlobalFrame=True)
        system.CreateTorsionalSpringDamper(itemNumbers=[last, body], position=top, axis=[0, 1, 0], useGlobalFrame=True,
                                           stiffness=STIFFNESS, damping=DAMPING)
        last = body
    system.Assemble()
    return system


def tree():
    system = exu.SystemContainer().AddSystem()
    node = system.AddNode(NodeGenericODE2(referenceCoordinates=[0]*LINKS, initialCoordinates=[0]*LINKS, initialCoordinates_t=[0]*LINKS,
                                          numberOfODE2Coordinates=LINKS))
    offsets = exu.Vector3DList([[0, 0, -LENGTH if link else 0] for link in range(LINKS)])
    system.AddObject(ObjectKinematicTree(
        nodeNumber=node, jointTypes=[exu.JointType.RevoluteY]*LINKS, linkParents=list(range(-1, LINKS - 1)),
        jointTransformations=exu.Matrix3DList([np.eye(3)]*LINKS), jointOffsets=offsets,
        linkInertiasCOM=exu.Matrix3DList([INERTIA.InertiaCOM()]*LINKS), linkCOMs=exu.Vector3DList([[0, 0, -LENGTH/2]]*LINKS),
        linkMasses=[INERTIA.Mass()]*LINKS, gravity=[0, 0, -GRAVITY], jointPositionOffsetVector=[0]*LINKS, jointVelocityOffsetVector=[0]*LINKS,
        jointPControlVector=[STIFFNESS]*LINKS, jointDControlVector=[DAMPING]*LINKS))
    system.Assemble()
    return system


def glue(system):
    problem = kschur.from_exudyn(system)
    return problem.mass, problem.stiffness, problem.damping, problem.constraints


def upper(eigenvalues):
    """Of each conjugate pair one, the lowest first."""
    return np.array(sorted(eigenvalues[eigenvalues.imag > 0], key=abs))


chain = bodies_and_joints()
matrices, taken = timed(lambda: glue(chain))
result, solved = timed(lambda: kschur.solve(*matrices, modes=10))
print(result)
without = chain.ComputeODE2Eigenvalues(convert2Frequencies=True)[0]
print(f"lowest frequency {result.frequency_hz[0]:.6f} Hz; by Exudyn without the reactions of the joints {without[0]:.6f} Hz")
joint_coordinates = tree()
(own, _), seconds = timed(lambda: joint_coordinates.ComputeODE2Eigenvalues(computeComplexEigenvalues=True, useAbsoluteValues=False))
report("exudyn", f"hanging chain of {LINKS} links", result.unknowns, lines_of(glue), result.eigenvalues, upper(own)[:10], taken, solved, seconds)
