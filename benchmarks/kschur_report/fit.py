"""A straight line through points, and how straight they are."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Line:
    """y = slope x + intercept; `r_squared` is 1 where all points lie on it."""

    slope: float
    intercept: float
    r_squared: float


def fit_line(x, y):
    """Least squares, unweighted, as in the paper's Figure 5; None for fewer than three points."""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if len(x) < 3:
        return None
    slope, intercept = np.polyfit(x, y, 1)
    scatter = np.sum((y - y.mean()) ** 2)
    return Line(float(slope), float(intercept), float(1 - np.sum((y - slope * x - intercept) ** 2) / scatter))


def growth_exponent(x, y):
    """p of y = c x^p by least squares of the logarithms; None for fewer than three points."""
    line = fit_line(np.log(x), np.log(y))
    return line and line.slope
