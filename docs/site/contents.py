"""The tables of contents of the site, from the links of docs/index.md: no page is listed twice."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

PAGE = re.compile(r"(?<!!)\[([^\]]+)\]\(([\w./-]+\.md)\)")
Contents = dict[str, dict[str, str]]


def contents(index: str) -> Contents:
    """Return the pages that each section of the index links to: title of the section, page, words of the link.

    A page that several sections link to is in the first of them.
    """
    found: Contents = {}
    seen: set[str] = set()
    for section in re.split(r"^## ", index, flags=re.MULTILINE)[1:]:
        heading, _, text = section.partition("\n")
        pages = {page: words for words, page in reversed(PAGE.findall(text)) if page not in seen}
        seen |= set(pages)
        found[heading.partition(":")[0].strip()] = dict(reversed(pages.items()))
    return found


def with_contents(index: str, made: Mapping[str, Sequence[str]]) -> str:
    """Return the index with a hidden table of contents for each of its sections.

    Args:
        index: Text of docs/index.md.
        made: Pages that are made by the build, by section; they follow the others under their own titles.
    """
    parts = [index.rstrip()]
    for heading, pages in contents(index).items():
        lines = [f"{words[0].upper()}{words[1:]} <{page.removesuffix('.md')}>" for page, words in pages.items()]
        lines += [page.removesuffix(".md") for page in made.get(heading, ())]
        if lines:
            parts.append("\n".join(["```{toctree}", ":hidden:", f":caption: {heading}", "", *lines, "```"]))
    return "\n\n".join(parts) + "\n"
