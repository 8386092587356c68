"""Charts of reports: curves over axes, with choices, and surfaces, as plotly draws them in the colors of figures.

Long records are drawn by the smallest and largest value of every interval, so that no peak is lost. Numbers are stored
as bytes in base64, much shorter than digits.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import plotly.graph_objects as go

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, GREEN, PURPLE, SKY, VERMILION
from gapbeam.postprocess.results_errors import BlockError

FloatArray = np.ndarray
Mode = Literal["lines", "markers", "lines+markers", "stems", "bars"]


@dataclass(frozen=True)
class ChartCurve:
    """One line, or one cloud of points, of a chart.

    Attributes:
        name: In the legend; curves of one name in several choices look the same.
        x: (n,); not-a-number breaks a line.
        y: (n,).
        mode: "lines", "markers", "lines+markers", "stems" (spectral lines from the foot of the chart) or "bars".
        choice: The choice with which it is shown; None: always.
        dashed: Whether the line is dashed, as for unstable branches and references.
        texts: Text of each point, shown when it is pointed at, (n,); empty: its coordinates only.
        times: Of its points, (n,), s, increasing: a dot on the curve follows the time of the page; empty: none does.
        bars: Half heights of error bars, (n,); empty: none.
        like: Name of the curve whose color it shares, such as that whose points it marks; empty: a color of its own.

    Raises:
        BlockError: Shapes that differ.
    """

    name: str
    x: FloatArray | Sequence[float]
    y: FloatArray | Sequence[float]
    mode: Mode = "lines"
    choice: str | None = None
    dashed: bool = False
    texts: Sequence[str] = ()
    like: str = ""
    times: FloatArray | Sequence[float] = ()
    bars: FloatArray | Sequence[float] = ()

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
        curves: Drawn in this order.
        command: That makes it.
        log_x: Whether the horizontal axis is logarithmic.
        log_y: Whether the vertical axis is logarithmic.
        choices: Names of buttons in their order, such as clearances: pressed, one shows its curves and those without
            a choice; the first is pressed at the start. On paper there is one panel a choice.
        choice: Chosen quantity with its unit: "clearance (mm)".
        x_range: Ends of the horizontal axis; None: of the curves.
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
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    equal: bool = False

    def __post_init__(self) -> None:
        used = {curve.choice for curve in self.curves} - {None}
        if len(set(self.choices)) != len(self.choices) or used != set(self.choices):
            raise BlockError(
                f"{self.caption}: the choices are {list(self.choices)}, those of the curves {sorted(map(str, used))}"
            )


@dataclass(frozen=True)
class Surface:
    """Heights over a grid: turned with a finger where the browser has WebGL, a picture elsewhere and on paper.

    Attributes:
        caption: Description.
        x: Name of the first axis with its unit in parentheses.
        y: Name of the second axis.
        z: Name of the heights.
        along: (n,), values on the first axis.
        across: (m,), values on the second axis.
        heights: (m, n); not-a-number leaves a hole.
        command: That makes it.
        log_x: Whether the first axis is logarithmic.
        log_y: Whether the second axis is logarithmic.

    Raises:
        BlockError: Shapes that differ.
    """

    caption: str
    x: str
    y: str
    z: str
    along: FloatArray | Sequence[float]
    across: FloatArray | Sequence[float]
    heights: FloatArray
    command: str = ""
    log_x: bool = False
    log_y: bool = False

    def __post_init__(self) -> None:
        expected = (len(self.across), len(self.along))
        if np.shape(self.heights) != expected:
            raise BlockError(f"{self.caption}: heights of shape {np.shape(self.heights)}; expected {expected}")


MOST = 1600  # points of a curve: twice as many as a figure has pixels


def envelope(x: FloatArray, y: FloatArray, most: int = MOST) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and the largest value of each of `most`/2 intervals of a record, in their order.

    A record that is short enough is returned as it is. Every peak is drawn at its height; what is lost is what happens
    between them within an interval.

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


COLORS = (BLUE, VERMILION, GREEN, BLACK, PURPLE, SKY, GRAY)
DASHES = ("solid", "solid", "solid", "solid", "solid", "solid", "solid", "dash", "dashdot", "dot")
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x")

TIME_AXES = {"time (s)": 1.0, "time (ms)": 1e-3}  # s; a cursor follows the time of the page on them

FEW_DECADES = 2.0  # of a logarithmic axis, which then has more labels than one a decade


def chart_figure(chart: Chart) -> go.Figure:
    """Return a chart; the curves of choices other than the first are there, but not visible.

    Every trace has its choice, or nothing, in `meta`.
    """
    names = list(dict.fromkeys(curve.like or curve.name for curve in chart.curves))
    figure = go.Figure(layout=_layout(chart))
    for curve in chart.curves:
        place = names.index(curve.like or curve.name)
        visible = curve.choice is None or curve.choice == chart.choices[0]
        for trace in _traces(curve, place, chart):
            figure.add_trace(trace.update(visible=visible, meta=curve.choice))
    return figure


def surface_figure(surface: Surface) -> go.Figure:
    """Return a surface that can be turned."""
    figure = go.Figure(
        go.Surface(
            x=_single(surface.along), y=_single(surface.across), z=_single(surface.heights), colorscale="Viridis",
            showscale=False, hovertemplate=f"{surface.x}: %{{x:.4g}}<br>{surface.y}: %{{y:.4g}}<br>%{{z:.5g}}",
            name="", contours={"z": {"show": True, "color": "rgba(255,255,255,0.35)", "width": 1}},
        )
    )  # fmt: skip
    axes = {
        f"{name}axis": {
            "title": {"text": html.escape(title, quote=False)},
            "type": "log" if logarithmic else "linear",
            "exponentformat": "power",
        }
        for name, title, logarithmic in zip(
            "xyz", (surface.x, surface.y, surface.z), (surface.log_x, surface.log_y, False), strict=True
        )
    }
    camera = {"eye": {"x": -1.65, "y": -1.65, "z": 0.95}, "center": {"x": 0, "y": 0, "z": -0.12}}
    return figure.update_layout(template={}, scene={**axes, "camera": camera}, margin={"l": 0, "r": 0, "t": 0, "b": 0})


def _traces(curve: ChartCurve, place: int, chart: Chart) -> list[go.Scatter | go.Bar]:
    color, x, y = COLORS[place % len(COLORS)], _single(curve.x), _single(curve.y)
    name = html.escape(curve.name, quote=False)
    shared: dict[str, Any] = {"name": name, "legendgroup": f"{name} {curve.dashed}"}
    if curve.texts:
        texts = [html.escape(text, quote=False).replace("\n", "<br>") for text in curve.texts]
        shared |= {"text": texts, "hovertemplate": f"%{{text}}<extra>{name}</extra>"}
    if len(curve.times):
        shared["customdata"] = _single(curve.times)
    if len(curve.bars):
        shared["error_y"] = {"array": _single(curve.bars), "thickness": 1.0, "width": 3}
    if curve.mode == "bars":
        return [go.Bar(x=x, y=y, marker={"color": color}, **shared)]
    mark: dict[str, Any] = {"color": color, "symbol": SYMBOLS[place % len(SYMBOLS)], "size": 7}
    if curve.mode == "stems":
        stem_x, stem_y = _stems(x, y, _foot(chart))
        line = {"color": color, "width": 1.4}
        stems = {key: value for key, value in shared.items() if key not in ("text", "hovertemplate")}
        return [
            go.Scatter(x=stem_x, y=stem_y, mode="lines", line=line, hoverinfo="skip", showlegend=False, **stems),
            go.Scatter(x=x, y=y, mode="markers", marker=mark | {"size": 6}, **shared),
        ]
    dash = "dash" if curve.dashed else DASHES[place % len(DASHES)]
    if curve.dashed:
        mark["symbol"] += "-open"
    return [go.Scatter(x=x, y=y, mode=curve.mode, line={"color": color, "width": 1.6, "dash": dash}, marker=mark,
                       **shared)]  # fmt: skip


def _stems(x: FloatArray, y: FloatArray, foot: float) -> tuple[FloatArray, FloatArray]:
    """Return one broken line from the foot of the chart to every point."""
    gap = np.full(x.size, np.nan, dtype=x.dtype)
    return np.column_stack([x, x, gap]).ravel(), np.column_stack([np.full_like(y, foot), y, gap]).ravel()


def _foot(chart: Chart) -> float:
    """Return the height on which stems stand."""
    if not chart.log_y:
        return 0.0
    if chart.y_range is not None:
        return chart.y_range[0]
    heights = np.concatenate([np.asarray(curve.y, dtype=float) for curve in chart.curves])
    positive = heights[np.isfinite(heights) & (heights > 0.0)]
    return float(10.0 ** np.floor(np.log10(positive.min()))) if positive.size else 1.0


def _layout(chart: Chart) -> dict[str, Any]:
    names = {curve.name for curve in chart.curves}
    along = _axis(chart.x, chart.log_x, chart.x_range, [curve.x for curve in chart.curves])
    upward = _axis(chart.y, chart.log_y, chart.y_range, [curve.y for curve in chart.curves])
    return {
        "template": {},
        "meta": {"seconds": TIME_AXES.get(chart.x)},
        "xaxis": along | ({"constrain": "domain"} if chart.equal else {}),
        "yaxis": upward | ({"scaleanchor": "x", "constrain": "domain"} if chart.equal else {}),
        "barmode": "group",
        "showlegend": len(names) > 1 or not all(name.lower() in chart.y.lower() for name in names),
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
        "margin": {"l": 62, "r": 12, "t": 12, "b": 48},
    }


def _axis(
    title: str, logarithmic: bool, limits: tuple[float, float] | None, values: Sequence[FloatArray | Sequence[float]]
) -> dict[str, Any]:
    axis: dict[str, Any] = {
        "title": {"text": html.escape(title, quote=False), "standoff": 8},
        "type": "log" if logarithmic else "linear",
        "exponentformat": "power",
        "hoverformat": ".5~g",
        "automargin": True,
        "zeroline": False,
        "ticks": "outside",
        "showline": True,
    }
    if logarithmic and _decades(limits, values) > FEW_DECADES:
        axis["dtick"] = 1
    if limits is not None:
        axis["range"] = [float(np.log10(end)) if logarithmic else float(end) for end in limits]
    return axis


def _decades(limits: tuple[float, float] | None, values: Sequence[FloatArray | Sequence[float]]) -> float:
    ends = np.concatenate([np.asarray(part, dtype=float) for part in values] if limits is None else [limits])
    positive = ends[np.isfinite(ends) & (ends > 0.0)]
    return float(np.log10(positive.max() / positive.min())) if positive.size else 0.0


def _single(values: FloatArray | Sequence[float]) -> FloatArray:
    """Return values as a page shows them: seven digits, half the size."""
    return np.asarray(values, dtype=np.float32)
