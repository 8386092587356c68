"""The little Markdown of reports as HTML: everything that is not in it is shown as written, never obeyed."""

from __future__ import annotations

from functools import cache

from markdown_it import MarkdownIt
from markupsafe import Markup

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
