"""Quadratic problems of the NLEVP collection whose real matrices come with it, as .mat files.

Each function takes `data`, which returns the variables of a named file, and returns M, R, K.
"""

import numpy as np
import scipy.sparse as sp


def plain(file, mass, damping, stiffness):
    def read(data):
        d = data(file)
        one = sp.identity(d[stiffness].shape[0])
        return (one if mass is None else d[mass]), d[damping], d[stiffness]

    return read


def deformed_consensus(data):
    graph = data("deformed_consensus")["A"].astype(float)
    return np.diag(graph.sum(axis=1) - 1), -graph, np.eye(len(graph))


def disk_brake100(data, omega=2 * np.pi):
    d = data("disk_brake100")
    return d["M"], d["D1"] + d["DR"] / omega + omega * d["DG"], d["K1"] + d["KR"]


def hysteretic(file, mass, damping, stiffness):
    """In the collection a function of the frequency; real in lambda = i omega without the hysteretic part of the stiffness."""

    def read(data):
        d = data(file)
        real = d[stiffness].real
        return d[mass], abs(d[damping].imag), real * np.sign(real.diagonal().sum())

    return read


def schrodinger(data):
    stiffness, damping, mass = ((a + a.T) / 2 for a in data("schrodinger")["C"].ravel())
    return mass, damping, stiffness


WITH_DATA = {
    "cd_player": plain("cd_player", None, "D", "K"),
    "circular_piston": plain("piston", "M", "E", "K"),
    "concrete": hysteretic("concrete", "M_c1", "C_c1", "K_c1"),
    "deformed_consensus": deformed_consensus,
    "disk_brake100": disk_brake100,
    "foundation": hysteretic("foundation", "M", "D", "K"),
    "hospital": plain("hospital_KD", None, "D", "K"),
    "omnicam1": plain("omnicam1", "D1", "D2", "D3"),
    "omnicam2": plain("omnicam2", "D1", "D2", "D3"),
    "schrodinger": schrodinger,
    "shaft": plain("shaft", "M", "C", "K"),
    "speaker_box": plain("speaker_box", "A", "B", "C"),
}
