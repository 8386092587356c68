"""Charts of reports: curves over axes, with choices.

Long records are drawn by the smallest and largest value of every interval, so that no peak is lost. Numbers are stored
as bytes in base64, much shorter than digits.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from gapbeam.postprocess.results_errors import BlockError

Mode = Literal["lines", "markers", "lines+markers"]


@dataclass(frozen=True)
class ChartCurve:
    """One line, or one cloud of points, of a chart.

    Attributes:
        name: Name in the legend; curves of one name in several choices look the same.
        x: (n,); not-a-number breaks a line.
        y: (n,).
        mode: "lines", "markers" or "lines+markers".
        choice: The choice with which it is shown; None: always.
        dashed: Whether the line is dashed, as for unstable branches and references.
        texts: Text of each point, shown when it is pointed at, (n,); empty: its coordinates only.
        times: Times of its points, (n,), s, increasing: a dot on the curve follows the time of the page; empty: none
            does.
        bars: Half heights of error bars, (n,); empty: none.
        like: Name of the curve whose color it shares, such as that whose points it marks; empty: a color of its own.

    Raises:
        BlockError: Shapes that differ.
    """

    name: str
    x: np.ndarray | Sequence[float]
    y: np.ndarray | Sequence[float]
    mode: Mode = "lines"
    choice: str | None = None
    dashed: bool = False
    texts: Sequence[str] = ()
    like: str = ""
    times: np.ndarray | Sequence[float] = ()
    bars: np.ndarray | Sequence[float] = ()

    def __post_init__(self) -> None:
        shapes = np.shape(self.x), np.shape(self.y)
        if shapes[0] != shapes[1] or len(shapes[0]) != 1:
            raise BlockError(f"{self.name}: x has shape {shapes[0]} and y {shapes[1]}; expected (n,) twice")
        if self.texts and len(self.texts) != len(self.x):
            raise BlockError(f"{self.name}: {len(self.texts)} texts for {len(self.x)} points")
        if len(self.bars) not in (0, len(self.x)):
            raise BlockError(f"{self.name}: {len(self.bars)} error bars for {len(self.x)} points")
        if len(self.times) not in (0, len(self.x)):
            raise BlockError(f"{self.name}: {len(self.times)} times for {len(self.x)} points")


@dataclass(frozen=True)
class Chart:
    """Curves over one pair of axes.

    Attributes:
        caption: Description.
        x: Name of the horizontal axis with its unit in parentheses.
        y: Name of the vertical axis with its unit in parentheses.
        curves: Curves, drawn in this order.
        command: Command that makes the chart.
        log_x: Whether the horizontal axis is logarithmic.
        log_y: Whether the vertical axis is logarithmic.
        choices: Names of buttons in their order, such as clearances: pressed, one shows its curves and those without
            a choice; the first is pressed at the start. On paper there is one panel a choice.
        choice: Chosen quantity with its unit: "clearance (mm)".
        y_range: Ends of the vertical axis; None: of the curves.
        equal: Whether a unit is as long on both axes.

    Raises:
        BlockError: A curve of a choice that does not exist, a choice named twice or without a curve.
    """

    caption: str
    x: str
    y: str
    curves: Sequence[ChartCurve]
    command: str = ""
    log_x: bool = False
    log_y: bool = False
    choices: Sequence[str] = ()
    choice: str = ""
    y_range: tuple[float, float] | None = None
    equal: bool = False

    def __post_init__(self) -> None:
        used = {curve.choice for curve in self.curves} - {None}
        if len(set(self.choices)) != len(self.choices) or used != set(self.choices):
            raise BlockError(
                f"{self.caption}: the choices are {list(self.choices)}, those of the curves {sorted(map(str, used))}"
            )


MOST = 1600  # points of a curve: twice as many as a figure has pixels


def envelope(x: np.ndarray, y: np.ndarray, most: int = MOST) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the largest value of each of `most`/2 intervals of a record, in their order.

    A record that is short enough is returned as it is. Every peak is drawn at its height; motion between
    the two extremes of an interval is lost.

    Args:
        x: (n,), increasing.
        y: (n,).
        most: Points to return at most, at least 2.

    Returns:
        Both, with at most `most` entries.
    """
    if x.size <= most:
        return x, y
    edges = np.linspace(0, x.size, most // 2 + 1).astype(int)
    kept = []
    for start, stop in pairwise(edges):
        part = y[start:stop]
        kept += sorted({start + int(np.argmin(part)), start + int(np.argmax(part))})
    return x[kept], y[kept]


def thinning_words(size: int, most: int = MOST) -> str:
    """Return the remark of a caption on a thinned record; empty where all of it is drawn."""
    if size <= most:
        return ""
    return f" Of every {round(2 * size / most)} values the smallest and the largest are drawn."


SHORTEST = 32767  # largest number of 16 bits


def packed(values: np.ndarray) -> dict[str, str]:
    """Return numbers as 32 bits each, row by row, as plotly packs them too: `dtype` and `bdata`."""
    return {"dtype": "f4", "bdata": _text(np.asarray(values, dtype="<f4"))}


def packed_shorts(values: np.ndarray) -> dict[str, str | float]:
    """Return numbers as 16 bits each, to 1/32767 of the largest, which times `unit` are the numbers."""
    largest = float(np.abs(values).max(initial=0.0)) or 1.0
    steps = np.round(np.asarray(values, dtype=float) / largest * SHORTEST)
    return {"dtype": "i2", "bdata": _text(steps.astype("<i2")), "unit": largest / SHORTEST}


def _text(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
