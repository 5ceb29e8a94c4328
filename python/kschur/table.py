"""A result as a table, for terminals and notebooks."""
from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .result import Result

HEADINGS = ("mode", "Re (1/s)", "Im (1/s)", "frequency (Hz)", "damped (Hz)", "damping (%)", "kind", "backward error",
            "error (1/s)")
MOST_ROWS = 60


def as_text(result: Result) -> str:
    """Lines of columns, after a line that says how the solve ended."""
    rows = [HEADINGS, *_rows(result)]
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows]
    return "\n".join([result.message, *lines, *_remarks(result)])


def as_html(result: Result) -> str:
    """The same for a notebook."""
    head = "".join(f"<th>{heading}</th>" for heading in HEADINGS)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in _rows(result))
    remarks = "".join(f"<p>{html.escape(remark)}</p>" for remark in _remarks(result))
    return (f"<div><p>{html.escape(result.message)}</p>"
            f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{remarks}</div>")


def caption(result: Result, mode: int) -> str:
    """A mode in a few words."""
    ratio = result.damping_ratio[mode]
    damping = f", damping {100 * ratio:.3g} %" if ratio != 0 and math.isfinite(ratio) else ""
    return f"{result.frequency_hz[mode]:.5g} Hz{damping}"


def _rows(result: Result) -> list[tuple[str, ...]]:
    return [(str(k), _number(result.eigenvalues[k].real), _number(result.eigenvalues[k].imag),
             _number(result.frequency_hz[k]), _number(result.damped_frequency_hz[k]), _number(100 * result.damping_ratio[k]),
             result.kind[k], _number(result.backward_error[k], ".1e"), _number(result.error[k], ".1e"))
            for k in range(min(len(result), MOST_ROWS))]


def _remarks(result: Result) -> list[str]:
    beyond = len(result) - MOST_ROWS
    return ([f"and {beyond} more"] if beyond > 0 else []) + result.notes


def _number(value: float, notation: str = ".6g") -> str:
    # No negative zero.
    return "-" if math.isnan(value) else format(value + 0.0, notation)
