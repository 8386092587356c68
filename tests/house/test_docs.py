"""The pages of the documentation: links lead somewhere, titles ask, tables fit a page, named files exist."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from docs.tables.narrow_tables import MOST, ROWS, columns_of
from gapbeam.solver.loads.time_function import ramps_at

PROJECT = Path(__file__).parents[2]
DOCS = PROJECT / "docs"
KINDS = ("tutorials", "how-to", "reference", "explanation", "benchmarks")
ROOT_PAGES = [PROJECT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
PAPER = DOCS / "joss" / "paper.md"  # no page of the site: tests/house/test_joss_paper.py
PAGES = sorted(set(DOCS.rglob("*.md")) - {PAPER})
TESTS = {path.name for path in (PROJECT / "tests").rglob("test_*.py")}
SOURCES = [
    path
    for room in ("solver", "studies", "meshes", "postprocess")
    for path in sorted((PROJECT / "gapbeam" / room).rglob("*.py"))
]
KIND_PAGES = [page for page in PAGES if page.parent != DOCS]

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```|^(?: {4}[^\n]*\n)+|`[^`\n]*`", re.MULTILINE | re.DOTALL)
NAMED = re.compile(
    r"(?<![\w./-])(?:solver|gapbeam|meshes|postprocess|studies|tests|benchmarks|docs|cases|environment)/[\w./-]*[\w/]"
)
MEASURED = re.compile(r"20\d\d-\d\d-\d\d")


def name(page: Path) -> str:
    """Return the path of a page, for messages and test names."""
    return str(page.relative_to(PROJECT))


def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_stay_on_the_site(page: Path) -> None:
    """A page of the site links to no page above docs/, which the site does not have: its build would end."""
    targets = [target.partition("#")[0] for target in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8")))]
    files = {path: (page.parent / path).resolve() for path in targets if path and not re.match(r"[a-z]+:", path)}
    assert [path for path, file in files.items() if file.suffix == ".md" and not file.is_relative_to(DOCS)] == []


@pytest.mark.parametrize("page", [*ROOT_PAGES, *PAGES], ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    """Every relative link names a file of the project, and its anchor a heading of that file."""
    broken = []
    for target in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8"))):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        there = file.is_relative_to(PROJECT) and file.exists()
        if not there or (anchor and anchor not in anchors(file)):
            broken.append(target)
    assert broken == []


@pytest.mark.parametrize("page", [*ROOT_PAGES[:2], *PAGES], ids=name)
def test_named_files_exist(page: Path) -> None:
    """A path of the project that a page names, also in a command, is there."""
    named = set(NAMED.findall(LINK.sub("", page.read_text(encoding="utf-8"))))
    assert sorted(path for path in named if not (PROJECT / path).exists()) == []


@pytest.mark.parametrize("page", [*ROOT_PAGES[:2], *PAGES], ids=name)
def test_named_tests_exist(page: Path) -> None:
    """A test file that a page names without its folder is there."""
    named = set(re.findall(r"(?<![\w/])test_\w+\.py", page.read_text(encoding="utf-8")))
    assert sorted(named - TESTS) == []


def test_files_named_in_docstrings_exist() -> None:
    """A page or program that a docstring or a comment names is there."""
    missing = []
    for source in SOURCES:
        for path in re.findall(
            r"(?<![\w./-])(?:docs|tests|cases|benchmarks|environment)/[\w./-]+\.(?:md|py|toml)",
            source.read_text("utf-8"),
        ):
            if not (PROJECT / path).exists():
                missing.append(f"{name(source)}: {path}")
    assert missing == []


def test_every_page_is_in_the_index() -> None:
    """The index links to every page, and every page but the index and the gallery is of one of the five kinds."""
    index = DOCS / "index.md"
    linked = {(DOCS / target.partition("#")[0]).resolve() for target in LINK.findall(index.read_text(encoding="utf-8"))}
    assert [name(page) for page in PAGES if page not in linked | {index}] == []
    assert {page for page in PAGES if page.parent == DOCS} <= {index, DOCS / "gallery.md"}
    assert {page.parent.name for page in KIND_PAGES} == set(KINDS)
    assert all(page.parent.parent == DOCS for page in KIND_PAGES)


@pytest.mark.parametrize("page", KIND_PAGES, ids=name)
def test_pages_answer_one_question(page: Path) -> None:
    """The title of a page asks, a tutorial's says what is made; an answer follows before the next heading."""
    text = page.read_text(encoding="utf-8")
    lines = text.splitlines()
    assert lines[0].startswith("# ")
    assert lines[0].endswith("?") != (page.parent.name == "tutorials")
    assert len(re.findall(r"^# ", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL), re.MULTILINE)) == 1
    opening = text.split("\n## ")[0]
    assert len(CODE.sub("", opening).split()) > 15, "no answer under the title"


@pytest.mark.parametrize("page", [*ROOT_PAGES, *PAGES], ids=name)
def test_tables_fit_a_page(page: Path) -> None:
    """A table has at most seven columns, and all its rows as many cells as its head."""
    for table in ROWS.findall(page.read_text(encoding="utf-8")):
        widths = {len(columns_of(row)) for row in table.splitlines()}
        assert len(widths) == 1, table.splitlines()[0]
        assert max(widths) <= MOST, table.splitlines()[0]


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent.name == "benchmarks"], ids=name)
def test_measurements_have_a_command_and_a_date(page: Path) -> None:
    """A page of measurements says when they were made, and by which command or by hand."""
    text = page.read_text(encoding="utf-8")
    assert MEASURED.search(text)
    assert re.search(r"environment/run \w+|made by hand", text)


def test_ramp_is_the_documented_one() -> None:
    """The polynomial on the page is the one of the loads, and the page's words on slope and impulse are true of it."""
    text = (DOCS / "reference" / "case-files.md").read_text(encoding="utf-8")
    [terms] = re.findall(r"r\(s\) = (.*?) {2,}for", text)
    powers = {int(power): float(c.replace(" ", "")) for c, power in re.findall(r"([-+]? ?\d+) s\^(\d)", terms)}
    r = np.polynomial.Polynomial([powers.get(k, 0.0) for k in range(6)])
    ramp, s = 0.3, np.linspace(0.0, 1.0, 11)
    found = ramps_at(ramp * s, ramp * (1.0 + 1e-15))
    for order, values in enumerate(found):
        np.testing.assert_allclose(values * ramp**order, r.deriv(order)(s) if order else r(s), atol=1e-9)
        assert abs(values[0]) < 1e-12
        assert abs(values[-1] - (order == 0)) < 1e-9
    assert np.argmax(found[1]) == 5
    assert found[1][5] == pytest.approx(15.0 / (8.0 * ramp))
    assert r.integ()(1.0) == pytest.approx(0.5)
