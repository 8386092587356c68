"""Numbers of pages that something else decides: counts of the code, and figures of a measurement on its own page."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.gallery.gallery_scenes import scenes
from gapbeam.solver.contact.laws.law_choice import LAWS
from gapbeam.solver.integrators.scheme_choice import scheme_names

PROJECT = Path(__file__).parents[2]
WORDS = [
    "no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve",
    "thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen", "twenty",
]  # fmt: skip
SCENES = len(scenes())
COUNTED = [
    ("README.md", "{} time schemes", len(scheme_names())),
    ("docs/joss/paper.md", "the {} time schemes", len(scheme_names())),
    ("docs/joss/paper.md", "{} contact laws", len(LAWS)),
    ("CHANGELOG.md", "[gallery](docs/gallery.md) of {} cases", SCENES),
]
QUOTED = [
    ("README.md", "29 403 DOFs takes 25 ms", "speed.md", ("29 403 DOFs", "25 ms")),
    ("README.md", "about 170 times less than a textbook", "speed.md", ("About 170 times",)),
    ("README.md", "7 us", "speed.md", ("takes 7 us per step",)),
    ("docs/how-to/install.md", "The image takes 1.92 GB", "speed.md", ("1.92 GB",)),
]


def text_of(page: str) -> str:
    """Return a page in one line."""
    return " ".join((PROJECT / page).read_text(encoding="utf-8").split())


@pytest.mark.parametrize(("page", "words", "count"), COUNTED)
def test_counts_are_those_of_the_code(page: str, words: str, count: int) -> None:
    """What is added to the code is counted on the page, too."""
    text = text_of(page)
    word = WORDS[count] if count < len(WORDS) else str(count)
    assert any(words.format(number) in text for number in (word, word.capitalize(), str(count)))


@pytest.mark.parametrize(("page", "words", "measured", "figures"), QUOTED)
def test_figures_stand_where_they_were_measured(page: str, words: str, measured: str, figures: tuple[str, ...]) -> None:
    """A figure that a new measurement changes has to be changed on the pages that quote it."""
    assert words in text_of(page)
    source = text_of(f"docs/benchmarks/{measured}")
    assert [figure for figure in figures if figure not in source] == []
