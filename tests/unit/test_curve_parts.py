"""Parts of a response curve: every segment once, of the stability of its points, branches apart."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as some

from gapbeam.postprocess.report.sections.curve_section import curve_section
from gapbeam.postprocess.results.bounded_files import branch_parts, stable_parts

POINTS = some.lists(
    some.tuples(some.sampled_from([True, False, None]), some.sampled_from(["", "", "fold"])), max_size=12
)


@given(POINTS)
def test_every_segment_is_drawn_once(drawn: list[tuple[bool | None, str]]) -> None:
    """The parts join without a gap; a segment has the stability of an end that is not an event."""
    points = [{"stable": stable, "event": event} for stable, event in drawn]
    segments = [(place, stable) for stable, part in stable_parts(points) for place in range(part.start, part.stop - 1)]
    assert [place for place, _ in segments] == list(range(max(len(points) - 1, 0)))
    for place, stable in segments:
        assert stable in [points[place + end]["stable"] for end in (0, 1)]
        if not points[place]["event"]:
            assert stable is points[place]["stable"]


def test_an_unstable_segment_is_drawn_dashed_alone() -> None:
    """A single unstable segment between stable ones is dashed, and no solid line passes over it."""
    row = {"kind": "", "largest_multiplier": 0.5, "tip.peak_to_peak": 1.0e-3}
    table = [(1.0, True, ""), (2.0, False, "fold"), (3.0, False, ""), (4.0, True, "fold"), (5.0, True, "")]
    points = [row | {"value": value, "stable": stable, "event": event} for value, stable, event in table]
    section = curve_section({"key": "k", "unit": "Hz", "points": points}, "command")
    curves = next(block for block in section.blocks if hasattr(block, "curves")).curves
    for dashed, spans in ((True, [(2.0, 3.0), (3.0, 4.0)]), (False, [(1.0, 2.0), (4.0, 5.0)])):
        line = next(curve for curve in curves if curve.dashed == dashed and len(curve.x) > 1)
        x = np.asarray(line.x)
        assert [(a, b) for a, b in pairwise(x) if not np.isnan(a + b)] == spans


def test_branches_are_apart() -> None:
    """Each branch is a slice of its own."""
    points = [{"branch": number} for number in (1, 1, 2, 3, 3)]
    assert list(branch_parts(points)) == [(1, slice(0, 2)), (2, slice(2, 3)), (3, slice(3, 5))]
