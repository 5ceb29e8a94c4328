"""A result as a table, for terminals and notebooks."""
from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import Any, Protocol


class Modes(Protocol):
    """What of a result stands in its table."""
    eigenvalues: Any
    frequency_hz: Any
    damped_frequency_hz: Any
    damping_ratio: Any
    loss_factor: Any
    has_losses: bool
    backward_error: Any
    error: Any
    kind: list[str]
    notes: list[str]

    @property
    def message(self) -> str: ...

    def __len__(self) -> int: ...


class Branches(Protocol):
    """What of a sweep stands in its table."""
    parameter: str
    unit: str
    values: Any
    eigenvalues: Any

    @property
    def events(self) -> Sequence[Any]: ...

    @property
    def onsets(self) -> Sequence[Any]: ...


HEADINGS = ("mode", "Re (1/s)", "Im (1/s)", "frequency (Hz)", "damped (Hz)", "damping (%)", "kind", "backward error",
            "error (1/s)")
MOST_ROWS = 60


def as_text(result: Modes) -> str:
    """Lines of columns, after a line that says how the solve ended."""
    return "\n".join([result.message, *_lines(_rows(result)), *_remarks(result)])


def as_html(result: Modes) -> str:
    """The same for a notebook."""
    return _html(result.message, _rows(result), _remarks(result))


def sweep_as_text(sweep: Branches) -> str:
    """Damped frequencies (Hz), a line for each point, and what happens."""
    return "\n".join([_sweep_message(sweep), *_lines(_sweep_rows(sweep)), *_sweep_remarks(sweep)])


def sweep_as_html(sweep: Branches) -> str:
    """The same for a notebook."""
    return _html(_sweep_message(sweep), _sweep_rows(sweep), _sweep_remarks(sweep))


def caption(result: Modes, mode: int) -> str:
    """A mode in a few words."""
    ratio = result.damping_ratio[mode]
    damping = f", damping {100 * ratio:.3g} %" if ratio != 0 and math.isfinite(ratio) else ""
    return f"{result.frequency_hz[mode]:.5g} Hz{damping}"


def _lines(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows)]
    return ["  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows]


def _html(message: str, rows: list[tuple[str, ...]], remarks: list[str]) -> str:
    head = "".join(f"<th>{html.escape(heading)}</th>" for heading in rows[0])
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows[1:])
    below = "".join(f"<p>{html.escape(remark)}</p>" for remark in remarks)
    return (f"<div><p>{html.escape(message)}</p>"
            f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{below}</div>")


def name_of(sweep: Branches) -> str:
    """Its parameter with the unit."""
    return (sweep.parameter or "value") + (f" ({sweep.unit})" if sweep.unit else "")


def _sweep_message(sweep: Branches) -> str:
    points, branches = sweep.eigenvalues.shape
    return f"{branches} branches over {points} points, damped frequencies (Hz)"


def _sweep_rows(sweep: Branches) -> list[tuple[str, ...]]:
    hertz = abs(sweep.eigenvalues.imag) / (2 * math.pi)
    return [(name_of(sweep), *(f"branch {b}" for b in range(hertz.shape[1]))),
            *((_number(value), *map(_number, row)) for value, row in zip(sweep.values[:MOST_ROWS], hertz))]


def _sweep_remarks(sweep: Branches) -> list[str]:
    beyond = len(sweep.values) - MOST_ROWS
    unit = f" {sweep.unit}" if sweep.unit else ""
    return [*([f"and {beyond} more"] if beyond > 0 else []),
            *("unsure which mode is which from " + _number(e.value) + unit + " on" if e.kind == "unsure" else
              f"{e.kind} of branches {e.first} and {e.second} near {_number(e.value)}{unit}" for e in sweep.events),
            *(f"branch {o.branch} {'unstable' if o.unstable else 'stable'} from {_number(o.value, '.5g')}{unit}" for o in sweep.onsets)]


def _rows(result: Modes) -> list[tuple[str, ...]]:
    rows = [HEADINGS, *((str(k), _number(result.eigenvalues[k].real), _number(result.eigenvalues[k].imag),
                         _number(result.frequency_hz[k]), _number(result.damped_frequency_hz[k]),
                         _number(100 * result.damping_ratio[k]), result.kind[k], _number(result.backward_error[k], ".1e"),
                         _number(result.error[k], ".1e")) for k in range(min(len(result), MOST_ROWS)))]
    if not result.has_losses:
        return rows
    losses = ("loss factor (%)", *(_number(100 * factor) for factor in result.loss_factor))
    return [(*row[:6], loss, *row[6:]) for row, loss in zip(rows, losses)]


def _remarks(result: Modes) -> list[str]:
    beyond = len(result) - MOST_ROWS
    return ([f"and {beyond} more"] if beyond > 0 else []) + result.notes


def _number(value: float, notation: str = ".6g") -> str:
    # No negative zero.
    return "-" if math.isnan(value) else format(value + 0.0, notation)
