"""Pictures of schemes and levels: region of trust of a scheme, cost over error of fidelity levels."""

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

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, GREEN, PURPLE, VERMILION, journal_style, panels

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
STIFFNESS, STEP, SCHEME = "contact.stiffness", "time.step", "time.scheme"
LABELS = {STIFFNESS: "contact stiffness (Pa/m)", STEP: "step (s)"}
MOST_TICKS = 8
MARKS = {"energy created": "x", "not converged": "s", "not finite": "*", "failed": "d", "refused": "_"}


def draw_stability_map(
    records: Sequence[Mapping[str, Any]], path: Path, shown: MapQuantity = QUANTITIES["energy"]
) -> Path:
    """Draw a quantity, by default the energy created (red) or lost (blue), over stiffness and step, a panel a scheme.

    A mark says how a run ended that did not pass. Where other keys vary too, the worst of their points is drawn.

    Args:
        records: One a point of the grid, with the keys and the figures of a trial.
        path: File to write; its suffix gives the format.
        shown: The quantity.
    """
    names = list(dict.fromkeys(str(record[SCHEME]) for record in records))
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    x, y = (_ordered({str(record[key]) for record in records}) for key in (STIFFNESS, STEP))
    with journal_style():
        figure = Figure(figsize=(2.2 * columns + 0.9, 1.8 * rows + 0.7), layout="constrained")
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        used: set[str] = set()
        mesh = None
        for place, panel in enumerate(axes.flat):
            if place >= len(names):
                panel.set_axis_off()
                continue
            mine = [record for record in records if str(record[SCHEME]) == names[place]]
            worst = _worst(mine)
            values = np.array([[_value(worst.get((a, b)), shown) for a in x] for b in y])
            mesh = panel.pcolormesh(values, norm=shown.norm, cmap=shown.colors)
            used |= _mark(panel, {(x.index(a), y.index(b)): record for (a, b), record in worst.items()})
            panel.set_title(names[place])
            panel.set_xticks(*_ticks(x))
            panel.set_yticks(*_ticks(y))
        for panel in axes[-1]:
            panel.set_xlabel(LABELS[STIFFNESS])
        for panel in axes[:, 0]:
            panel.set_ylabel(LABELS[STEP])
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


def _worst(records: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], Mapping[str, Any]]:
    """Return the record that created most energy, or did not pass, at each point."""
    found: dict[tuple[str, str], Mapping[str, Any]] = {}
    for record in records:
        place = str(record[STIFFNESS]), str(record[STEP])
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


FLOOR = 1e-5  # errors below it are drawn there
KINDS = {
    "rigid": (GRAY, "X"),
    "beam": (BLACK, "D"),
    "reduced 2D": (BLUE, "s"),
    "reduced 3D": (GREEN, "o"),
    "full 2D": (PURPLE, "^"),
}
OTHERS = {"full 3D": (VERMILION, "v")}


@dataclass(frozen=True)
class Place:
    """One fidelity level in the picture.

    Attributes:
        name: Name of the fidelity level; its first words are its kind.
        seconds: Wall time of the case, s.
        error: Relative.
        on_front: Whether no other fidelity level is both cheaper and nearer.
        chosen: Whether it is the one to take.
    """

    name: str
    seconds: float
    error: float
    on_front: bool
    chosen: bool


def draw_pareto(places: Sequence[Place], uncertainty: float, tolerance: float, path: Path) -> None:
    """Draw error over wall time with the front, the tolerance, and the uncertainty of the reference in gray.

    Args:
        places: The fidelity levels.
        uncertainty: Uncertainty of the reference, relative: errors below it say nothing.
        tolerance: The requested tolerance.
        path: File to write; its suffix gives the format.
    """
    used: dict[str, Line2D] = {}
    with journal_style():
        figure, axes = panels(1, 1, width=5.2, height=3.6)
        panel = axes[0, 0]
        panel.set_xscale("log")
        panel.set_yscale("log")
        front = sorted((place for place in places if place.on_front), key=lambda place: place.seconds)
        panel.plot([p.seconds for p in front], [max(p.error, FLOOR) for p in front], color=GRAY, lw=0.8, zorder=1)
        for place in places:
            kind = next((kind for kind in KINDS | OTHERS if place.name.startswith(kind)), "beam")
            color, mark = (KINDS | OTHERS)[kind]
            panel.plot(place.seconds, max(place.error, FLOOR), mark, color=color, ms=4.5, zorder=3)
            if place.chosen:
                panel.plot(place.seconds, max(place.error, FLOOR), "o", mfc="none", color=BLACK, ms=10.0, zorder=2)
            used[kind] = Line2D([], [], color=color, marker=mark, linestyle="", markersize=4.5, label=kind)
            if place.on_front:
                words = place.name.removeprefix(kind).lstrip(", ") or kind
                panel.annotate(words, (place.seconds, max(place.error, FLOOR)), (4.0, 4.0), fontsize=6.0,
                               textcoords="offset points")  # fmt: skip
        panel.margins(0.12)
        low, high = panel.get_ylim()
        low = min(low, 0.5 * max(uncertainty, FLOOR))
        panel.axhspan(low, max(uncertainty, low), color=GRAY, alpha=0.25, lw=0)
        panel.axhline(tolerance, color=VERMILION, lw=0.8, ls="--")
        panel.set_ylim(low, max(high, 2.0 * tolerance))
        panel.set_xlabel("wall time of the case (s)")
        panel.set_ylabel("largest error of a figure, relative")
        figure.legend(handles=list(used.values()), loc="outside upper center", ncols=5)
        figure.savefig(path)
