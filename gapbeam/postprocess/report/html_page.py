"""Page of a report as HTML, from a small part of Markdown; all other markup is shown as text."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from jinja2 import Environment, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from gapbeam.postprocess.display_units import POWERS, PREFIXES
from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, GREEN, PURPLE, SKY, VERMILION
from gapbeam.postprocess.report.blocks import Block, Report, ReportSection, TableBlock, cell
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.moving_scene import ContactMap, MovingScene, scene_values
from gapbeam.postprocess.results.bounded_files import read_plain
from gapbeam.postprocess.results_errors import ResultsError

COLORS = (BLUE, VERMILION, GREEN, BLACK, PURPLE, SKY, GRAY)
DASHES = ("solid", "solid", "solid", "solid", "solid", "solid", "solid", "dash", "dashdot", "dot")
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x")

# s; a cursor follows the time of the page on these
TIME_AXES = {f"time ({prefix}s)": 1.0 / POWERS[prefix] for prefix, _ in PREFIXES["s"]}

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
        figure.add_trace(_trace(curve, place).update(visible=visible, meta=curve.choice))
    return figure


def _trace(curve: ChartCurve, place: int) -> go.Scatter:
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
    mark: dict[str, Any] = {"color": color, "symbol": SYMBOLS[place % len(SYMBOLS)], "size": 7}
    dash = "dash" if curve.dashed else DASHES[place % len(DASHES)]
    if curve.dashed:
        mark["symbol"] += "-open"
    line = {"color": color, "width": 1.6, "dash": dash}
    return go.Scatter(x=x, y=y, mode=curve.mode, line=line, marker=mark, **shared)


def _layout(chart: Chart) -> dict[str, Any]:
    names = {curve.name for curve in chart.curves}
    along = _axis(chart.x, chart.log_x, None, [curve.x for curve in chart.curves])
    upward = _axis(chart.y, chart.log_y, chart.y_range, [curve.y for curve in chart.curves])
    return {
        "template": {},
        "meta": {"seconds": TIME_AXES.get(chart.x)},
        "xaxis": along | ({"constrain": "domain"} if chart.equal else {}),
        "yaxis": upward | ({"scaleanchor": "x", "constrain": "domain"} if chart.equal else {}),
        "showlegend": len(names) > 1 or not all(name.lower() in chart.y.lower() for name in names),
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
        "margin": {"l": 62, "r": 12, "t": 12, "b": 48},
    }


def _axis(
    title: str, logarithmic: bool, limits: tuple[float, float] | None, values: Sequence[np.ndarray | Sequence[float]]
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


def _decades(limits: tuple[float, float] | None, values: Sequence[np.ndarray | Sequence[float]]) -> float:
    ends = np.concatenate([np.asarray(part, dtype=float) for part in values] if limits is None else [limits])
    positive = ends[np.isfinite(ends) & (ends > 0.0)]
    return float(np.log10(positive.max() / positive.min())) if positive.size else 0.0


def _single(values: np.ndarray | Sequence[float]) -> np.ndarray:
    """Return values as a page shows them: seven digits, half the size."""
    return np.asarray(values, dtype=np.float32)


_RULES = ("backticks", "emphasis", "escape", "link", "list", "newline")


@cache
def _reader() -> MarkdownIt:
    # No raw HTML and no images: a page must neither be broken by a text nor fetch anything.
    return MarkdownIt("zero", {"html": False, "typographer": False}).enable(list(_RULES))


def paragraphs(text: str) -> Markup:
    """Return a text as paragraphs and lists."""
    return Markup(_reader().render(text))


def sentence(text: str) -> str:
    """Return a text with a capital letter at its beginning."""
    return text[:1].upper() + text[1:]


def inline(text: str) -> Markup:
    """Return a text of one paragraph, without the element around it."""
    return Markup(_reader().renderInline(text))


SCRIPTS = (
    "numbers.js",
    "clock.js",
    "scene_model.js",
    "scene_painters.js",
    "contact_maps.js",
    "scene.js",
    "page.js",
    "live.js",
)
"""Scripts of a page, in this order."""
UNIT, NO_BREAK = re.compile(r"\([^()]{1,9}\)"), "\N{NO-BREAK SPACE}"
SENTENCE = 40  # letters
NARROW = 4  # columns that fit a phone
NAME = 18  # letters of a first column that leaves room for others
LARGEST_PICTURE = 32 * 2**20  # bytes
IMAGES = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".svg": "image/svg+xml",
    ".gif": "image/gif",
}


def html_of(report: Report) -> str:
    """Return a report as the text of a page.

    Numbers are text; figures are drawn by plotly, whose script is in the page once; pictures are in it too. A policy in
    the page forbids the browser every request to a network.

    Args:
        report: The report.

    Raises:
        ResultsError: A picture that is not there, or of a format that browsers do not show.
    """
    figures: list[str] = []

    def figure(block: Chart) -> int:
        """Keep the figure of a block for the script of the page, and return its place."""
        figures.append(str(chart_figure(block).to_json()))
        return len(figures) - 1

    page = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, extensions=["jinja2.ext.do"])
    page.globals["narrow"] = NARROW
    page.filters |= {
        "figure": figure,
        "inline": inline,
        "paragraphs": paragraphs,
        "cell": cell,
        "unbroken": lambda head: UNIT.sub(lambda unit: unit[0].replace(" ", NO_BREAK), head),
        "kind": lambda block: type(block).__name__,
        "unknown": _unknown,
        "numeric": _is_numeric,
        "wordy": _is_wordy,
        "flows": _flows,
        "text_alternative": _text_alternative,
        "map_alternative": _map_alternative,
        "inlined": _inlined,
        "scene_json": lambda block: _json(scene_values(block)),
        "live_json": lambda block: _json(block.data),
        "sections": _sections,
        "css_text": _css_text,
    }
    return page.from_string(_part("page.html")).render(
        report=report,
        style=Markup(_part("style.css") + _part("scene.css")),
        scripts=[Markup(_part(name)) for name in SCRIPTS],
        plotly=Markup(_plotly()),
        figures=lambda: Markup(f"[{','.join(figures)}]".replace("<", "\\u003c")),
    )


def write_html(report: Report, path: Path) -> Path:
    """Write a report as a page; a file that is there is replaced only by a whole one.

    Args:
        report: The report.
        path: File to write; its folder is made.

    Returns:
        The path.

    Raises:
        ResultsError: A picture that is not there, or of a format that browsers do not show.
        OSError: The file cannot be written.
    """
    text = html_of(report)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)
    return path


@cache
def _part(name: str) -> str:
    return files("gapbeam.postprocess.report").joinpath("page", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    return files("plotly").joinpath("package_data", "plotly.min.js").read_text(encoding="utf-8")


def _inlined(path: Path | bytes) -> str:
    """Return a picture as an address that holds it."""
    if isinstance(path, bytes):
        return _data("image/png", path)
    kind = IMAGES.get(path.suffix.lower())
    if kind is None or not path.is_file():
        raise ResultsError(
            path,
            found="no such file" if kind else f"a picture of the kind {path.suffix}",
            expected=f"a file that ends in {', '.join(IMAGES)}",
            remedy="draw it again, for example with gapbeam plot or gapbeam render",
        )
    return _data(kind, read_plain(path, "a picture", "draw it again", LARGEST_PICTURE))


def _unknown(block: object) -> str:
    """Refuse a block that the page has no words for.

    Raises:
        TypeError: Always.
    """
    raise TypeError(f"the page does not know blocks of the kind {type(block).__name__}")


def _data(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _is_numeric(table: TableBlock, column: int) -> bool:
    """Return whether a column holds numbers and nothing else."""
    there = [row[column] for row in table.rows if row[column] is not None]
    return bool(there) and not any(isinstance(value, str) for value in there)


def _is_wordy(table: TableBlock, column: int) -> bool:
    """Return whether a column holds sentences, which would become towers on a phone."""
    return any(isinstance(row[column], str) and len(str(row[column])) > SENTENCE for row in table.rows)


def _flows(table: Block) -> bool:
    """Return whether rows become paragraphs on a phone, for lack of room: many columns, and words in more than one."""
    if not isinstance(table, TableBlock) or len(table.columns) < NARROW:
        return False
    words = [column for column in range(len(table.columns)) if not _is_numeric(table, column)]
    return len(words) > 1 or any(isinstance(row[0], str) and len(row[0]) > NAME for row in table.rows)


def _json(values: Mapping[str, object]) -> Markup:
    """Return data of a scene or a live model as the text of a script element."""
    return Markup(json.dumps(values, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"))


def _text_alternative(block: Chart | MovingScene) -> str:
    """Return the text alternative of a figure, for those who cannot see it."""
    if isinstance(block, MovingScene) and not block.moves:
        return f"Scene. {block.caption} Arrow keys turn it."
    if isinstance(block, MovingScene):
        return f"Moving scene. {block.caption} Arrow keys turn it, the space bar plays it, comma and period step it."
    names = ", ".join(dict.fromkeys(curve.name for curve in block.curves))
    return f"Chart: {block.y} over {block.x}, with {names}. {block.caption}"


def _map_alternative(one: ContactMap) -> str:
    """Return the text alternative of a map of contact pressure."""
    over = "x, in mm, and the angle around the beam, in degrees" if one.around else "x, in mm"
    faces = " and ".join(face.face for face in one.faces)
    return (
        f"Contact pressure of support {one.support} on {faces} over {over}, at the time of the scene; "
        f"largest of all times {cell(1e-6 * one.largest, 3)} MPa."
    )


def _sections(blocks: Sequence[Block]) -> list[ReportSection]:
    return [block for block in blocks if isinstance(block, ReportSection)]


def _css_text(text: str) -> Markup:
    """Return a text as a string of a style sheet."""
    safe = "".join(letter if letter.isalnum() or letter in " .,:;()-+=%/" else f"\\{ord(letter):x} " for letter in text)
    return Markup(json.dumps(safe, ensure_ascii=False).replace("\\\\", "\\"))
