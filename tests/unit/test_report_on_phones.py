"""What keeps reports readable where there is little room: alike warnings as one, supports that lie apart by button."""

from __future__ import annotations

import numpy as np

from gapbeam.postprocess.report.blocks import Report, ReportSection, TableBlock
from gapbeam.postprocess.report.html_page import html_of
from gapbeam.postprocess.report.sections.support_section import chart_along, groups
from gapbeam.postprocess.report.sections.sweep_section import alike


def test_warnings_that_differ_by_signal_and_numbers_are_one() -> None:
    """Names in front, spans of numbers in the words, the order of the first ones; others stay as they are."""
    folded = "lines of {} % of the largest near half the sampling rate ({} Hz): sample more often"
    texts = [
        "no settled cycle",
        f"tip: velocity: {folded.format(2.2, 5000)}",
        "displacement: the last 6 forcing periods begin before 0.15 s",
        f"tip: smoothed acceleration: {folded.format(14, 1000)}",
        "velocity: the last 6 forcing periods begin before 0.15 s",
        "not smoothed: 3 records",
    ]
    assert alike(texts) == [
        "no settled cycle",
        f"tip velocity, tip smoothed acceleration: {folded.format('2.2 to 14', '1000 to 5000')}",
        "displacement, velocity: the last 6 forcing periods begin before 0.15 s",
        "not smoothed: 3 records",
    ]
    assert alike([]) == []


def test_supports_that_lie_apart_have_a_button_each() -> None:
    """Planes of one support and neighbors stay together; a support at the other end has a choice of its own."""
    spans = {"left": (0.1, 0.12), "low": (0.8, 0.82), "high": (0.8, 0.82), "next": (0.83, 0.85)}
    assert groups(spans) == [["left"], ["low", "high", "next"]]
    lines = {name: (np.linspace(*span, 3), np.ones(3)) for name, span in spans.items()}
    chart = chart_along("c", "y", lines)
    assert chart.choices == ["left", "low and high and next"]
    assert [curve.choice for curve in chart.curves] == ["left", *3 * ["low and high and next"]]
    assert np.allclose(chart.curves[0].x, [100.0, 110.0, 120.0])
    assert chart_along("c", "y", {name: lines[name] for name in ("low", "high")}).choices == ()


def test_tables_with_words_flow() -> None:
    """Many columns and long names, or words in two columns; matrices of numbers keep their columns."""
    heads = ("figure", "a", "b", "c", "d")
    tables = [
        TableBlock("long names", heads, [("face.first_hole.contact_share", 1.0, 2.0, 3.0, 4.0)]),
        TableBlock("two words", heads, [("face", "speed", 2.0, 3.0, 4.0)]),
        TableBlock("numbers", heads, [("1/2", 1.0, 2.0, 3.0, 4.0)]),
        TableBlock("few", ("face", "figure", "x"), [("left_hole", "speed", 1.0)]),
    ]
    text = html_of(Report("t", "", [ReportSection("s", "s", tables)])).split("<body")[1]
    assert text.count('<div class="tabled flows"') == 2
    assert text.count('data-head="b"') == 2
