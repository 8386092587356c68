"""Page of a report as HTML; its little Markdown shows what it does not know as written, and never obeys it."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from gapbeam.postprocess.report.blocks import Block, Report, ReportSection, TableBlock, cell, percent
from gapbeam.postprocess.report.chart_figures import chart_figure, surface_figure
from gapbeam.postprocess.report.charts import Chart, Surface
from gapbeam.postprocess.report.moving_scene import ContactMap, MovingScene, scene_values
from gapbeam.postprocess.report.surface_picture import surface_picture
from gapbeam.postprocess.results.bounded_files import read_plain
from gapbeam.postprocess.results_errors import ResultsError

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

    def figure(block: Chart | Surface) -> int:
        """Keep the figure of a block for the script of the page, and return its place."""
        drawn = chart_figure(block) if isinstance(block, Chart) else surface_figure(block)
        figures.append(str(drawn.to_json()))
        return len(figures) - 1

    page = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, extensions=["jinja2.ext.do"])
    page.globals["narrow"] = NARROW
    page.filters |= {
        "figure": figure,
        "inline": inline,
        "paragraphs": paragraphs,
        "cell": cell,
        "percent": percent,
        "kind": lambda block: type(block).__name__,
        "unknown": _unknown,
        "numeric": _is_numeric,
        "wordy": _is_wordy,
        "flows": _flows,
        "text_alternative": _text_alternative,
        "map_alternative": _map_alternative,
        "twin": lambda block: _data("image/png", surface_picture(block)),
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
    if not isinstance(table, TableBlock) or len(table.columns) <= NARROW:
        return False
    words = [column for column in range(len(table.columns)) if not _is_numeric(table, column)]
    return len(words) > 1 or any(isinstance(row[0], str) and len(row[0]) > NAME for row in table.rows)


def _json(values: Mapping[str, object]) -> Markup:
    """Return data of a scene or a live model as the text of a script element."""
    return Markup(json.dumps(values, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"))


def _text_alternative(block: Chart | Surface | MovingScene) -> str:
    """Return the text alternative of a figure, for those who cannot see it."""
    if isinstance(block, MovingScene) and not block.moves:
        return f"Scene. {block.caption} Arrow keys turn it."
    if isinstance(block, MovingScene):
        return f"Moving scene. {block.caption} Arrow keys turn it, the space bar plays it, comma and period step it."
    if isinstance(block, Surface):
        return f"Surface: {block.z} over {block.x} and {block.y}. {block.caption}"
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
