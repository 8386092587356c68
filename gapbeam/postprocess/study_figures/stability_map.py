"""The map of a stability study: where a scheme can be trusted with a stiffness and a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize, SymLogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gapbeam.postprocess.figures.figure_style import journal_style

RESOLVED, MOST = 1e-6, 1e1  # of the energy exchanged


@dataclass(frozen=True)
class MapQuantity:
    """Quantity of a map.

    Attributes:
        key: Name of the figure in a record.
        label: Label of the color bar.
        norm: Range and scale of the colors.
        colors: Color map.
    """

    key: str
    label: str
    norm: Normalize
    colors: str = "viridis"


QUANTITIES = {
    "energy": MapQuantity(
        "created", "energy created / exchanged", SymLogNorm(RESOLVED, vmin=-MOST, vmax=MOST, base=10), "RdBu_r"
    ),
    "residual": MapQuantity("residual", "residual of the balance / exchanged", LogNorm(1e-16, 1e-4)),
    "penetration": MapQuantity("relative_penetration", "largest penetration / clearance", LogNorm(1e-6, 1e1)),
    "iterations": MapQuantity("iterations", "contact iterations of a step, mean", LogNorm(1.0, 64.0)),
}
LABELS = {"contact.stiffness": "contact stiffness (Pa/m)", "time.step": "step (s)"}
MOST_TICKS = 8
MARKS = {"energy created": "x", "not converged": "s", "not finite": "*", "failed": "d", "refused": "_"}


def draw_stability_map(
    records: Sequence[Mapping[str, Any]],
    path: Path,
    along: str = "contact.stiffness",
    up: str = "time.step",
    panels: str = "time.scheme",
    shown: MapQuantity = QUANTITIES["energy"],
) -> Path:
    """Draw a quantity, by default the energy created (red) or lost (blue), over two keys, a panel a value of a third.

    A mark says how a run ended that did not pass. Where other keys vary too, the worst of their points is drawn.

    Args:
        records: One a point of the grid, with the keys and the figures of a trial.
        path: File to write; its suffix gives the format.
        along: Key on the horizontal axis.
        up: Key on the vertical axis.
        panels: Key of the panels.
        shown: The quantity.
    """
    names = list(dict.fromkeys(str(record[panels]) for record in records))
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    x, y = (_ordered({str(record[key]) for record in records}) for key in (along, up))
    with journal_style():
        figure = Figure(figsize=(2.2 * columns + 0.9, 1.8 * rows + 0.7), layout="constrained")
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        used: set[str] = set()
        mesh = None
        for place, panel in enumerate(axes.flat):
            if place >= len(names):
                panel.set_axis_off()
                continue
            mine = [record for record in records if str(record[panels]) == names[place]]
            worst = _worst(mine, along, up)
            values = np.array([[_value(worst.get((a, b)), shown) for a in x] for b in y])
            mesh = panel.pcolormesh(values, norm=shown.norm, cmap=shown.colors)
            used |= _mark(panel, {(x.index(a), y.index(b)): record for (a, b), record in worst.items()})
            panel.set_title(names[place])
            panel.set_xticks(*_ticks(x))
            panel.set_yticks(*_ticks(y))
        for panel in axes[-1]:
            panel.set_xlabel(LABELS.get(along, along))
        for panel in axes[:, 0]:
            panel.set_ylabel(LABELS.get(up, up))
        if mesh is not None:
            bar = figure.colorbar(mesh, ax=axes, shrink=0.85, label=shown.label)
            if isinstance(shown.norm, SymLogNorm):
                bar.set_ticks([-1e1, -1e-1, -1e-3, -1e-5, 0.0, 1e-5, 1e-3, 1e-1, 1e1])
        keys = [
            Line2D([], [], marker=mark, color="black", linestyle="", markersize=4, label=verdict)
            for verdict, mark in MARKS.items()
            if verdict in used
        ]
        if keys:
            figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), frameon=False)
        figure.savefig(path)
    return path


def _value(record: Mapping[str, Any] | None, shown: MapQuantity) -> float:
    """Return the drawn value: within the range of the colors, not a number where nothing was run."""
    if record is None or record["verdict"] == "refused" or record.get(shown.key) is None:
        return float("nan")
    value = float(record[shown.key])
    least, most = shown.norm.vmin, shown.norm.vmax
    assert least is not None
    assert most is not None
    return min(max(abs(value) if isinstance(shown.norm, LogNorm) else value, least), most)


def _worst(records: Sequence[Mapping[str, Any]], along: str, up: str) -> dict[tuple[str, str], Mapping[str, Any]]:
    """Return the record that created most energy, or did not pass, at each point."""
    found: dict[tuple[str, str], Mapping[str, Any]] = {}
    for record in records:
        place = str(record[along]), str(record[up])
        if place not in found or _badness(record) > _badness(found[place]):
            found[place] = record
    return found


def _badness(record: Mapping[str, Any]) -> tuple[bool, float]:
    return record["verdict"] != "passed", float(record["created"])


def _mark(panel: Axes, records: Mapping[tuple[int, int], Mapping[str, Any]]) -> set[str]:
    ended: dict[str, list[tuple[float, float]]] = {}
    for (column, row), record in records.items():
        if record["verdict"] in MARKS:
            ended.setdefault(record["verdict"], []).append((column + 0.5, row + 0.5))
    for verdict, places in ended.items():
        panel.plot(*zip(*places, strict=True), MARKS[verdict], color="black", markersize=3.5)
    return set(ended)


def _ordered(values: set[str]) -> list[str]:
    """Return values in the order of their numbers; words come first."""
    return sorted(values, key=lambda value: -np.inf if (number := _number(value)) is None else number)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _ticks(values: Sequence[str]) -> tuple[list[float], list[str]]:
    """Return places and labels of at most `MOST_TICKS` cells; powers of ten as such."""
    shown = range(0, len(values), -(-len(values) // MOST_TICKS))
    return [place + 0.5 for place in shown], [_label(values[place]) for place in shown]


def _label(text: str) -> str:
    number = _number(text)
    if number is None:
        return text
    power = np.log10(number) if number > 0.0 else 0.5
    return f"$10^{{{round(power)}}}$" if abs(power - round(power)) < 1e-9 else f"{number:.3g}"
