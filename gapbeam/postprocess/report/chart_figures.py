"""Figures of charts, as plotly draws them in the colors of the other figures."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, GREEN, PURPLE, SKY, VERMILION
from gapbeam.postprocess.report.charts import Chart, ChartCurve, FloatArray, Surface

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
