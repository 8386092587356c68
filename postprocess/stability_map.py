"""The map of a stability study: where a scheme can be trusted with a stiffness and a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import SymLogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from postprocess.figures.style import journal_style

RESOLVED, MOST = 1e-6, 1e1  # of the energy exchanged
LABELS = {"contact.stiffness": "contact stiffness (Pa/m)", "time.step": "step (s)"}
MARKS = {"energy created": "x", "not converged": "s", "not finite": "*", "failed": "d", "refused": "_"}


def draw_stability_map(
    records: Sequence[Mapping[str, Any]],
    path: Path,
    along: str = "contact.stiffness",
    up: str = "time.step",
    panels: str = "time.scheme",
) -> Path:
    """Draw the energy created (red) or lost (blue) by the scheme over two keys, one panel a value of a third.

    A mark says how a run ended that did not pass. Where other keys vary too, the worst of their points is drawn.

    Args:
        records: One a point of the grid, with the keys and the figures of a trial.
        path: File to write; its suffix gives the format.
        along: Key on the horizontal axis, numbers.
        up: Key on the vertical axis, numbers.
        panels: Key of the panels.
    """
    names = list(dict.fromkeys(str(record[panels]) for record in records))
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    x, y = (sorted({float(record[key]) for record in records}) for key in (along, up))
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
            values = np.array([[worst[a, b]["created"] if (a, b) in worst else np.nan for a in x] for b in y])
            norm = SymLogNorm(RESOLVED, vmin=-MOST, vmax=MOST, base=10)
            mesh = panel.pcolormesh(_edges(x), _edges(y), np.clip(values, -MOST, MOST), norm=norm, cmap="RdBu_r")
            used |= _mark(panel, worst)
            panel.set(xscale="log", yscale="log", title=names[place])
        for panel in axes[-1]:
            panel.set_xlabel(LABELS.get(along, along))
        for panel in axes[:, 0]:
            panel.set_ylabel(LABELS.get(up, up))
        if mesh is not None:
            bar = figure.colorbar(mesh, ax=axes, shrink=0.85, label="energy created / exchanged")
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


def _worst(records: Sequence[Mapping[str, Any]], along: str, up: str) -> dict[tuple[float, float], Mapping[str, Any]]:
    """Return the record that created most energy, or did not pass, at each point."""
    found: dict[tuple[float, float], Mapping[str, Any]] = {}
    for record in records:
        place = float(record[along]), float(record[up])
        if place not in found or _badness(record) > _badness(found[place]):
            found[place] = record
    return found


def _badness(record: Mapping[str, Any]) -> tuple[bool, float]:
    return record["verdict"] != "passed", float(record["created"])


def _mark(panel: Axes, records: Mapping[tuple[float, float], Mapping[str, Any]]) -> set[str]:
    ended: dict[str, list[tuple[float, float]]] = {}
    for place, record in records.items():
        if record["verdict"] in MARKS:
            ended.setdefault(record["verdict"], []).append(place)
    for verdict, places in ended.items():
        panel.plot(*zip(*places, strict=True), MARKS[verdict], color="black", markersize=3.5)
    return set(ended)


def _edges(centers: Sequence[float]) -> NDArray[np.float64]:
    """Return the edges of cells around centers that are spaced in the logarithm."""
    logs = np.log10(centers)
    if len(logs) == 1:
        return np.asarray(10.0 ** (logs[0] + np.array([-0.5, 0.5])))
    middles = 0.5 * (logs[1:] + logs[:-1])
    ends = [2.0 * logs[0] - middles[0]], [2.0 * logs[-1] - middles[-1]]
    return np.asarray(10.0 ** np.concatenate([ends[0], middles, ends[1]]))
