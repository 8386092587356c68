"""The blocks of reports refuse what contradicts itself, and compute deviations."""

from __future__ import annotations

import math

import pytest

from gapbeam.postprocess.report.blocks import Report, ReportSection, TableBlock, Words, sections_of
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.sections.tradeoff_section import _comparison
from gapbeam.postprocess.results_errors import BlockError


@pytest.mark.parametrize(
    ("measured", "computed", "deviation"),
    [
        (2.0, 3.0, "+50 %"),
        (-2.0, -3.0, "−50 %"),
        (0.0, 1.0, "–"),
        (1.0, None, "–"),
        (1.0, math.inf, "–"),
    ],
)
def test_deviation_is_relative_to_the_size_of_the_measured_value(
    measured: float, computed: float | None, deviation: str
) -> None:
    """Its sign says whether ours is above, whatever the sign of the measured one."""
    row = {
        "figure": "peak", "unit": "Hz", "meaning": "", "set": {}, "measured": measured, "computed": computed,
        "scatter": None, "use": "fit", "response": "", "other_responses": [], "left_out": None,
    }  # fmt: skip
    ((*_, found, _),) = _comparison({"measurements": [row]}, "peak", "").rows
    assert found == deviation


def test_blocks_that_contradict_themselves() -> None:
    """Each is reported when it is made, where the mistake is."""
    with pytest.raises(BlockError, match="row 2 has 1 cells"):
        TableBlock("frequencies", ("mode", "f (Hz)"), ((1, 47.4), (2,)))
    with pytest.raises(BlockError, match=r"x has shape \(2,\) and y \(3,\)"):
        ChartCurve("a", (0.0, 1.0), (0.0, 1.0, 2.0))
    with pytest.raises(BlockError, match="1 texts for 2 points"):
        ChartCurve("a", (0.0, 1.0), (0.0, 1.0), texts=("one",))
    with pytest.raises(BlockError, match="lower-case"):
        ReportSection("Results", "The results", ())


def test_choices_are_those_of_the_curves() -> None:
    """A button without a curve would show an empty chart; a curve without a button would never be seen."""
    curve = ChartCurve("a", (0.0,), (0.0,), choice="0.1")
    always = ChartCurve("b", (0.0,), (0.0,))
    Chart("fine", "x", "y", (curve, always), choices=("0.1",))
    for choices in (("0.1", "0.2"), (), ("0.1", "0.1")):
        with pytest.raises(BlockError, match="choices"):
            Chart("wrong", "x", "y", (curve, always), choices=choices)


def test_anchors_are_unique_also_in_sections_of_sections() -> None:
    """Two sections of one address could not both be reached."""
    inner = ReportSection("Inner", "same", (Words("text"),))
    outer = ReportSection("Outer", "outer", (inner,))
    assert [section.anchor for section in sections_of((outer,))] == ["outer", "same"]
    with pytest.raises(BlockError, match="same"):
        Report("r", "", (outer, ReportSection("Again", "same", ())))
