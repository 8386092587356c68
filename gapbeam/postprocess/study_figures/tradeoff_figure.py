"""The picture of a trade-off: what a fidelity level costs against how far off it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.lines import Line2D

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, GREEN, PURPLE, VERMILION, journal_style, panels

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
        name: Of the fidelity level; its first words are its kind.
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


def draw_pareto(places: Sequence[Place], uncertainty: float, tolerance: float, path: Path) -> Path:
    """Draw error over wall time with the front, the tolerance, and the uncertainty of the reference in gray.

    Args:
        places: The fidelity levels.
        uncertainty: Of the reference, relative: errors below it say nothing.
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
    return path
