"""Section 2 of the paper recomputed: its plateaus against textbook roots, its errata, the page it makes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gapbeam.postprocess.report.blocks import ComparisonBlock, Report, ReportSection, TableBlock, Verdict, Words
from gapbeam.postprocess.report.charts import Chart, Surface
from gapbeam.postprocess.report.html_page import write_html
from gapbeam.studies.paper.plateaus import printed_plateaus
from gapbeam.studies.paper.section_two import paper_beams, section_two

TEXTBOOK = {  # roots of Blevins' tables, rigid motions counted
    "clamped": (1.87510407, 4.69409113, 7.85475744),
    "sliding": (0.0, 2.36502037, 5.49780392),
    "pinned": (0.0, 3.92660231, 7.06858275),
}


@pytest.fixture(scope="module")
def section(tmp_path_factory: pytest.TempPathFactory) -> tuple[ReportSection, Path]:
    folder = tmp_path_factory.mktemp("section-two")
    return section_two(folder), folder


def only(section: ReportSection, kind: type, caption: str = "") -> object:
    """Return the only block of a kind whose caption begins with some words."""
    found = [block for block in section.blocks if isinstance(block, kind) and caption in getattr(block, "caption", "")]
    assert len(found) == 1, caption
    return found[0]


def test_plateaus_are_those_of_textbooks() -> None:
    """Printed values are limits of their root; but for pinned ends the paper prints those of sliding ones."""
    whole, overhang = paper_beams()
    for plateau in printed_plateaus():
        expected = TEXTBOOK[plateau.name][plateau.mode - 1]
        assert plateau.value(whole) == pytest.approx(expected, rel=1e-8)
        if plateau.name == "pinned":
            assert plateau.printed == pytest.approx(TEXTBOOK["sliding"][plateau.mode - 1], abs=1e-3)
        else:
            assert plateau.printed == pytest.approx(expected, abs=1e-3)
        for beam in (whole, overhang):
            draught, torsion = plateau.reached(beam, 0.01)
            first, second = plateau.limits
            for springs in ((draught, second), (first, torsion)):
                assert abs(float(beam.roots(plateau.mode, *springs)) / expected - 1.0) == pytest.approx(0.01, rel=1e-4)
        nearer = [abs(plateau.at_threshold(beam) / expected - 1.0) for beam in (whole, overhang)]
        assert nearer[0] < nearer[1]


@pytest.mark.slow(minutes=0.3)
def test_printed_numbers_stand_beside_ours(section: tuple[ReportSection, Path]) -> None:
    made, _ = section
    roots, plateaus = only(made, ComparisonBlock, "Roots"), only(made, ComparisonBlock, "Plateaus")
    assert isinstance(roots, ComparisonBlock)
    assert isinstance(plateaus, ComparisonBlock)
    assert all(row.deviation is None or abs(row.deviation) < 1e-4 for row in roots.rows)
    assert [row.note.startswith("not as printed") for row in plateaus.rows] == [False, False, False, True, True]
    errata = only(made, Verdict)
    assert isinstance(errata, Verdict)
    assert all(text in errata.text for text in ("3.9266", "7.0686", "5.498", "4.73"))


@pytest.mark.slow(minutes=0.4)
def test_surfaces_run_between_the_limits(section: tuple[ReportSection, Path]) -> None:
    """Monotone in both springs, and at the corners of Figs. 4 to 6 the four limits; Eq. 9 agrees with every root."""
    made, _ = section
    surfaces = [block for block in made.blocks if isinstance(block, Surface)]
    assert len(surfaces) == 3
    for mode, surface in enumerate(surfaces, start=1):
        assert np.all(np.diff(surface.heights, axis=0) > -1e-12)
        assert np.all(np.diff(surface.heights, axis=1) > -1e-12)
        assert surface.heights[-1, -1] == pytest.approx(TEXTBOOK["clamped"][mode - 1], rel=1e-3)
        assert surface.heights[-1, 0] == pytest.approx(TEXTBOOK["sliding"][mode - 1], rel=1e-3, abs=0.2)
        assert surface.heights[0, -1] == pytest.approx(TEXTBOOK["pinned"][mode - 1], rel=2e-3, abs=0.2)
    text = next(block.text for block in made.blocks if isinstance(block, Words) and "changes its sign" in block.text)
    words = text.split()
    assert words[words.index("of") + 1] == words[words.index("the") + 1]


@pytest.mark.slow(minutes=0.1)
def test_the_seated_beam_stands_beside_them(section: tuple[ReportSection, Path]) -> None:
    """Frequencies of the clamped overhang in closed form; springs of the seat are those of its span, 3 E I / a."""
    made, folder = section
    table = only(made, TableBlock, "Bending frequencies")
    assert isinstance(table, TableBlock)
    first = [float(cell) for cell in table.rows[0][1:]]
    assert first[0] == pytest.approx(47.18, abs=5e-3)
    assert first[1] == pytest.approx(44.08, abs=5e-3)
    assert first[2] == pytest.approx(first[3], rel=5e-4)
    assert first[4] == pytest.approx(first[5], rel=5e-4)
    springs = json.loads((folder / "modes-play.json").read_text(encoding="utf-8"))["springs"][0]
    assert springs["k2"]["value"] == pytest.approx(3.0 * 604.8 / 0.05, rel=0.1)
    assert springs["k1"]["verdict"] == "at least"
    assert isinstance(only(made, Chart, "Mode shapes"), Chart)


@pytest.mark.slow(minutes=0.1)
def test_the_section_makes_a_page(section: tuple[ReportSection, Path]) -> None:
    made, folder = section
    page = write_html(Report("Section 2", "", (made,)), folder / "page.html").read_text(encoding="utf-8")
    assert "Fig. 4" in page
    assert "3.9266" in page
