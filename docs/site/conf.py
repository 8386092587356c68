"""Settings of Sphinx; `python -m docs.site` calls it."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx

PROJECT = Path(__file__).parents[2]
sys.path.insert(0, str(PROJECT))

from docs.site.code_blocks import pieces  # noqa: E402

project = "gapbeam"
author = copyright = "The gapbeam developers"  # noqa: A001 - its name for Sphinx
release = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]

extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx_copybutton"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_dmath_allow_space = False
myst_heading_anchors = 4
highlight_language = "none"
smartquotes = False  # they make one dash of the two before an option
suppress_warnings = ["myst.header", "misc.highlighting_failure"]  # looks, not links
copybutton_exclude = ".linenos, .gp, .c1"

html_theme = "furo"
html_title = f"gapbeam {release}"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1f5f8b", "color-brand-content": "#1f5f8b"},
    "dark_css_variables": {"color-brand-primary": "#7fb8de", "color-brand-content": "#7fb8de"},
}
html_static_path = [str(PROJECT / "docs" / "site" / "looks")]
html_css_files = ["site.css"]
html_copy_source = False


def color_code(_: Sphinx, tree: nodes.document) -> None:
    """Color indented blocks, for which Markdown has no place to name the language."""
    for block in tree.findall(nodes.literal_block):
        if block.get("language", "none") in ("none", "default"):
            kinds = {kind for kind, *_ in pieces(block.astext())}
            block["language"] = kinds.pop() if len(kinds) == 1 else "none"


def mark_stacked_tables(_: Sphinx, tree: nodes.document) -> None:
    """Mark tables that begin with names, whose rows become paragraphs on a phone."""
    for table in tree.findall(nodes.table):
        if next(table.findall(nodes.entry)).astext() in ("command", "file", "function", "key", "option", "tests"):
            table["classes"].append("stacked")


def setup(app: Sphinx) -> None:
    """Sphinx calls this."""
    app.connect("doctree-read", color_code)
    app.connect("doctree-read", mark_stacked_tables)
