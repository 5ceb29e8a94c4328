"""Models of other codes, where these are installed; docs/recipes.md has more of them."""
import numpy as np
import pytest

import kschur
from kschur.errors import InputError


def portal(ops, diaphragm):
    """Four columns from a floor at z = 0 along `diaphragm`'s normal, their heads tied to a node off their middle."""
    axis = diaphragm - 1
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.geomTransf("Linear", 1, *np.eye(3)[axis - 2])
    for corner, (a, b) in enumerate([(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)]):
        foot = np.insert([a, b], axis, 0.0)
        ops.node(1 + corner, *foot)
        ops.node(11 + corner, *(foot + 3.0*np.eye(3)[axis]))
        ops.fix(1 + corner, *[1]*6)
        ops.element("elasticBeamColumn", 1 + corner, 1 + corner, 11 + corner, 0.09, 3e10, 1.2e10, 1e-3, 6e-4, 7e-4, 1, "-mass", 225.0)
    ops.node(20, *np.insert([3.5, 1.8], axis, 3.0))
    out_of_plane = [int(k != axis) for k in range(3)]
    ops.fix(20, *[1 - free for free in out_of_plane], *out_of_plane)
    ops.mass(20, *[1e4*free for free in out_of_plane], *[1e5*(1 - free) for free in out_of_plane])
    ops.rigidDiaphragm(diaphragm, 20, 11, 12, 13, 14)


@pytest.mark.parametrize("diaphragm", [1, 2, 3])
def test_opensees_diaphragms_in_every_plane(diaphragm):
    ops = pytest.importorskip("openseespy.opensees")
    portal(ops, diaphragm)
    own = np.sqrt(ops.eigen("-fullGenLapack", 3))/(2*np.pi)
    problem, geometry = kschur.from_opensees(ops)
    assert problem.constraints.shape == (12, 27) and problem.labels[0] == "11.1"
    result = kschur.solve(problem.mass, problem.stiffness, Cq=problem.constraints, modes=3, geometry=geometry)
    assert result.frequency_hz == pytest.approx(own, rel=1e-10)
    # All heads move as one body in the plane: what a pair of them is apart stays.
    moved = result.geometry.displacements(result.shapes[:, 0].real)
    rest = geometry.coordinates
    heads = [k for k, tag in enumerate(ops.getNodeTags()) if 11 <= tag <= 14]
    across = rest[heads[2]] - rest[heads[0]]
    assert np.abs(moved[heads]).max() > 1e-3
    assert abs(across @ (moved[heads[2]] - moved[heads[0]])) < 1e-12


def hanging(exudyn, angle):
    from exudyn.utilities import InertiaCuboid
    system = exudyn.SystemContainer().AddSystem()
    ground = system.CreateGround()
    body = system.CreateRigidBody(inertia=InertiaCuboid(density=7800.0, sideLengths=[0.02, 0.02, 1.0]),
                                  referencePosition=[0.5*np.sin(angle), 0.0, -0.5*np.cos(angle)], gravity=[0.0, 0.0, -9.81],
                                  referenceRotationMatrix=np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]))
    system.CreateRevoluteJoint(itemNumbers=[ground, body], position=[0.0, 0.0, 0.0], axis=[0.0, 1.0, 0.0], useGlobalFrame=True)
    system.Assemble()
    return system


def test_exudyn_pendulum_with_the_reaction_of_its_joint():
    exudyn = pytest.importorskip("exudyn")
    problem = kschur.from_exudyn(hanging(exudyn, 0.0))
    result = kschur.solve(problem.mass, problem.stiffness, Cq=problem.constraints, modes=1)
    inertia = 1.0/3 + 0.02**2/12
    assert result.frequency_hz[0] == pytest.approx(np.sqrt(9.81*0.5/inertia)/(2*np.pi), rel=1e-7)


def test_exudyn_not_at_rest():
    exudyn = pytest.importorskip("exudyn")
    with pytest.raises(InputError, match="not at rest"):
        kschur.from_exudyn(hanging(exudyn, 0.4))
