"""Which of the wanted modes a run found, what it lists besides, and how far off its eigenvalues are."""

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment

REACH = 1e-6  # relative: what is farther off than this, and than the tolerance, is another eigenvalue


@dataclass
class Verdict:
    found: int = 0
    missing: list = field(default_factory=list)
    undetermined: list = field(default_factory=list)  # missing, but rounding of M, R, K may take them anywhere
    spurious: list = field(default_factory=list)
    zeros: list = field(default_factory=list)  # found, but not as 0
    error: float = 0.0  # relative, of the mode that is farthest outside its tolerance or nearest to it
    tolerance: float = 0.0  # the same mode's
    condition: float = 0.0

    @property
    def accurate(self):
        return self.error <= self.tolerance

    @property
    def right(self):
        return self.accurate and not self.missing and not self.spurious


def with_conjugates(values):
    """Each of them with its conjugate, if it has one, and the index of the mode that both belong to."""
    pairs = [(v, i) for i, v in enumerate(values)] + [(np.conj(v), i) for i, v in enumerate(values) if v.imag != 0]
    return np.array([v for v, _ in pairs], dtype=complex), np.array([i for _, i in pairs], dtype=int)


def judge(reported, reference, target, asked):
    """`reported` complex numbers with Im >= 0, `reference` the eigenvalues around the target, more than asked."""
    modes = [e for e in reference if e.value.imag >= 0]
    distance = np.array([abs(e.value - target) if target.imag >= 0 else abs(np.conj(e.value) - target) for e in modes])
    order = np.argsort(distance, kind="stable")
    modes, distance = [modes[i] for i in order], distance[order]
    verdict = Verdict()
    theirs, mode_of = with_conjugates([e.value for e in modes])
    ours, report_of = with_conjugates(reported)
    partner = {}
    if len(ours) and len(theirs):
        tolerance = np.array([modes[i].tolerance for i in mode_of])
        tolerance = np.where(theirs != 0, np.minimum(tolerance, abs(theirs) / 10), tolerance)
        gap = abs(ours[:, None] - theirs[None, :])
        cost = np.minimum(gap / np.maximum(tolerance, REACH * abs(theirs))[None, :].clip(1e-300), 10.0)
        for i, j in zip(*linear_sum_assignment(np.where(cost <= 1, cost, 1e3))):
            if cost[i, j] <= 1:
                partner[i] = j
    found = {mode_of[j] for j in partner.values()}
    verdict.found = len(found)
    verdict.spurious = [v for k, v in enumerate(reported) if not any(report_of[i] == k for i in partner)]
    worst = -1.0
    for i, j in partner.items():
        e = modes[mode_of[j]]
        if e.value == 0 and ours[i] != 0:
            verdict.zeros.append(ours[i])
        size = abs(e.value) or 1.0
        error, tolerance = abs(ours[i] - theirs[j]) / size, max(e.tolerance / size, 1e-12)
        if error / tolerance > worst:
            worst = error / tolerance
            verdict.error, verdict.tolerance, verdict.condition = error, tolerance, e.condition
    count = min(asked, len(modes))
    if count:
        edge = distance[count - 1]
        slack = np.array([e.tolerance for e in modes]) + modes[count - 1].tolerance + 1e-9 * edge
        wanted = [i for i in range(count) if distance[i] < edge - slack[i]]
        tied = [i for i in range(len(modes)) if i not in wanted and distance[i] <= edge + slack[i]]
        lost = [i for i in wanted if i not in found]
        short = count - len(wanted) - sum(i in found for i in tied)
        lost += [i for i in tied if i not in found][: max(short, 0)]
        verdict.missing = [modes[i].value for i in lost if modes[i].is_determined]
        verdict.undetermined = [modes[i].value for i in lost if not modes[i].is_determined]
    return verdict
