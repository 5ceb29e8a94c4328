"""The judge of benchmarks/nlevp and the problems with published eigenvalues. Prints each check; fails where one does."""

import pathlib
import sys

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "benchmarks" / "nlevp"))

from judge import judge  # noqa: E402
from problems import FORMULAS  # noqa: E402
from checks import check, finish


class Known:
    """An eigenvalue as the judge sees it."""

    def __init__(self, value, tolerance=1e-10, is_determined=True):
        self.value, self.tolerance, self.is_determined, self.condition = complex(value), tolerance, is_determined, 1.0


def eigenvalues(name, **parameters):
    m, r, k = (a.toarray() if sp.issparse(a) else np.array(a, float) for a in FORMULAS[name](**parameters))
    n = len(m)
    a, b = np.block([[np.zeros((n, n)), np.eye(n)], [-k, -r]]), la.block_diag(np.eye(n), m)
    values = la.eigvals(a, b)
    return values[np.isfinite(values)]


def check_published(name, published, relative, **parameters):
    values = eigenvalues(name, **parameters)
    off = max(min(abs(values - p)) / abs(p) for p in published)
    check(f"{name}: published eigenvalues", off < relative, off)


check_published("spring", [-49.392273185], 1e-10, n=30)  # lambda^2 + 10 t lambda + 5 t = 0, t = 3 - 2 cos(30 pi/31)
check_published("damped_beam", [-7.42298 + 72.23065j, 290.35425j], 1e-6)
check_published("bicycle", [-14.0783896927980, -0.775341882195845 + 4.46486771378823j], 1e-12)  # Meijaard et al. 2007, 5 m/s
check_published("qep1", [1 / 3, 1 / 2, 1, 1j], 1e-12)
check_published("qep3", [1, 2, 3], 1e-12)
check("relative_pose_6pt: lambda = 1/f^2 = 0.01", min(abs(eigenvalues("relative_pose_6pt") - 0.01)) < 1e-10)
check("gen_tpal2: on the unit circle", max(abs(abs(eigenvalues("gen_tpal2")) - 1)) < 1e-10)
check("gen_tantipal2: on the unit circle", max(abs(abs(eigenvalues("gen_tantipal2")) - 1)) < 1e-10)
check("gen_hyper2: real", max(abs(eigenvalues("gen_hyper2").imag)) < 1e-8)

there = [Known(v) for v in (0, 0, -1, -2 + 3j, -2 - 3j, -5, -5)]
modes = [0, 0, -1, -2 + 3j, -5]
modes = [complex(v) for v in modes]
check("all found, one of two at the edge", judge(modes, there, 0j, 5).right)
for i in range(5):
    verdict = judge(modes[:i] + modes[i + 1 :], there, 0j, 5)
    check(f"without {modes[i]}: missing", verdict.missing == [modes[i]] and not verdict.spurious, verdict)
check("a copy too many", len(judge([*modes, -1 + 0j], there, 0j, 6).spurious) == 1)
check("an infinite one", judge([*modes[:4], 1e7 + 0j], there, 0j, 5).spurious == [1e7])
check("inaccurate", not judge([v * (1 + 1e-8) for v in modes], there, 0j, 5).accurate)
loose = [*there[:3], Known(1e3, 1e6, is_determined=False)]
check("undetermined: not missed", judge(modes[:3], loose, 0j, 4).right)
finish()
