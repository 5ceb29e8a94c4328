"""Time and memory against unknowns, with the fitted line."""

import numpy as np

from ..fit import fit_line, growth_exponent
from ..plan import SCALING
from .picture import Picture, in_order, legend_below, panels, style_of, tidy_logarithms

MEASURES = (("median_seconds", "time", "time (s)", 1.0, "s"), ("median_memory", "memory", "memory (MB)", 1e-6, "MB"))


def curves(campaign, attribute, factor=1.0):
    """For each method its unknowns and values, from the smallest problem on."""
    runs = campaign.study(SCALING)
    found = {}
    for method in in_order(run.method for run in runs):
        points = sorted((run.unknowns, factor * getattr(run, attribute)) for run in runs if run.method == method)
        found[method] = tuple(np.array(points).T)
    return found


def draw(campaign):
    """Two pictures, each on logarithmic and on linear axes."""
    return [draw_measure(campaign, *measure) for measure in MEASURES] if campaign.study(SCALING) else []


def draw_measure(campaign, attribute, name, label, factor, unit):
    figure, (logarithmic, linear) = panels(2, height=5.2)
    rows, words = [], []
    for method, (unknowns, values) in curves(campaign, attribute, factor).items():
        style = style_of(method)
        line = fit_line(unknowns, values)
        logarithmic.loglog(unknowns, values, **style)
        linear.plot(unknowns / 1e3, values, **style, linestyle="" if line else "-")
        if line:
            ends = np.array([0, unknowns.max()])
            linear.plot(ends / 1e3, line.intercept + line.slope * ends, color=style["color"], linewidth=1.0)
            words.append(
                f"{style['label']}: {1e3 * line.slope:.3g} {unit} a thousand unknowns, R² = {line.r_squared:.4f}, "
                f"grows as n^{growth_exponent(unknowns, values):.2f}"
            )
        rows += [
            [method, int(n), value, *([line.slope, line.intercept, line.r_squared] if line else ["", "", ""])]
            for n, value in zip(unknowns, values)
        ]
    logarithmic.set_xlabel("unknowns n (-)")
    logarithmic.set_ylabel(label)
    logarithmic.set_title("Logarithmic axes")
    tidy_logarithms(logarithmic)
    linear.set_xlabel("unknowns n (thousands)")
    linear.set_ylabel(label)
    linear.set_title("Linear axes, with fitted lines")
    linear.set_ylim(bottom=0)
    legend_below(figure, (logarithmic, linear))
    caption = (
        "Grids of beams of growing size, the same number of modes. "
        + (
            "The paper's Figure 5 reports R² = 0.9996. "
            if name == "time"
            else "Peak of the process, without what it holds before it reads the problem. "
        )
        + "; ".join(words)
        + "."
    )
    return Picture(
        f"{name}_against_unknowns",
        f"{name.capitalize()} against unknowns",
        caption,
        figure,
        ["method", "unknowns", f"{name}_{unit}", "slope", "intercept", "r_squared"],
        rows,
    )
