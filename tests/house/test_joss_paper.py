"""The paper in docs/joss: its metadata are those of the citation, and its references resolve."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pypdf
import pytest
import yaml

PROJECT = Path(__file__).parents[2]
FOLDER = PROJECT / "docs" / "joss"
_, HEAD, BODY = (FOLDER / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
META = yaml.safe_load(HEAD)
BIBLIOGRAPHY = (FOLDER / META["bibliography"]).read_text(encoding="utf-8")
ENTRIES = {
    key: dict(re.findall(r"^\s+(\w+) = \{(.*)\},?$", text, re.MULTILINE))
    for key, text in re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", BIBLIOGRAPHY, re.MULTILINE | re.DOTALL)
}
SECTIONS = ["Summary", "Statement of need", "State of the field", "What gapbeam does", "Verification"]


def test_metadata_are_those_of_the_citation() -> None:
    """Title and authors are written twice, for two readers; each author has an affiliation that is there."""
    citation = yaml.safe_load((PROJECT / "CITATION.cff").read_text(encoding="utf-8"))
    assert META["title"] == citation["title"]
    assert [author["name"] for author in META["authors"]] == [author["name"] for author in citation["authors"]]
    assert set(citation["keywords"]) <= set(META["tags"])
    assert {author["affiliation"] for author in META["authors"]} == {place["index"] for place in META["affiliations"]}
    assert re.fullmatch(r"\d{1,2} [A-Z][a-z]+ 20\d\d", META["date"])


def test_references_resolve() -> None:
    """What is cited is in the bibliography, and the other way round; each entry has an address to check."""
    cited = set(re.findall(r"@([a-z]+\d{4})", BODY))
    assert cited == set(ENTRIES)
    assert all({"author", "title", "year"} <= set(entry) for entry in ENTRIES.values())
    for entry in ENTRIES.values():
        address = entry.get("url") or f"https://doi.org/{entry['doi']}"
        assert re.match(r"https://(doi\.org/10\.\d{4,5}/\S+$|www\.)", address)


def test_sections_and_length_are_those_of_the_journal() -> None:
    """The journal asks for these sections and for 250 to 1000 words, tables and references aside."""
    assert [title for title in re.findall(r"^# (.*)$", BODY, re.MULTILINE) if title in SECTIONS] == SECTIONS
    prose = "\n".join(line for line in BODY.splitlines() if not line.startswith(("|", "#", "!")))
    assert 250 <= len(prose.split()) <= 1000


@pytest.mark.parametrize(
    ("figure", "page"),
    [
        ("1.3e-10", "reference/verification.md"),
        ("2e-8", "reference/verification.md"),
        ("0.005 to 0.05", "reference/verification.md"),
        ("29 403", "benchmarks/speed.md"),
        ("25 ms", "benchmarks/speed.md"),
        ("4.3 s", "benchmarks/speed.md"),
        ("2.5e-6", "benchmarks/speed.md"),
        ("73 figures", "benchmarks/statistics.md"),
        ("12 to 28", "benchmarks/speed.md"),
        ("7 us", "benchmarks/speed.md"),
        ("97.0 %", "benchmarks/accuracy.md"),
        ("92.5 to 99 %", "benchmarks/statistics.md"),
    ],
)
def test_figures_stand_where_they_were_measured(figure: str, page: str) -> None:
    """A figure of the paper that a new measurement changes has to be changed in the paper, too."""
    assert figure in BODY
    assert figure.replace(" to ", "-") in (text := (PROJECT / "docs" / page).read_text("utf-8")) or figure in text


@pytest.mark.slow(minutes=0.5)
def test_the_paper_has_two_pages(tmp_path: Path) -> None:
    """Built from nothing with the tools of its list: two pages, and the references behind the text."""
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True, timeout=300)
    python = tmp_path / "venv" / "bin" / "python"
    needs = ["-m", "pip", "install", "--quiet", "-r", FOLDER / "requirements-joss.txt"]
    subprocess.run([python, *needs], check=True, timeout=600)
    subprocess.run([python, "-m", "docs.joss", tmp_path / "paper.pdf"], cwd=PROJECT, check=True, timeout=300)
    pages = pypdf.PdfReader(tmp_path / "paper.pdf").pages
    assert len(pages) == 2
    text = "".join(page.extract_text() for page in pages)
    assert "References" in text
    assert all(entry["year"] in text.split("References")[-1] for entry in ENTRIES.values())
