"""Parts of a response curve: every segment once, of the stability of its points, branches apart."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as some

from gapbeam.postprocess.report.sections.atlas_section import beside_curve
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


def test_atlases_name_what_lies_beside_a_curve() -> None:
    """Of a fold, both responses at one value are on it; another peak, order or chaos is not; other keys say nothing."""
    table = [(1.0, 1.0e-3), (3.0, 2.0e-3), (1.5, 4.0e-3), (3.0, 5.0e-3)]
    points = [{"value": value, "branch": 1, "tip.peak": peak} for value, peak in table]
    curve = {"key": "k", "unit": "Hz", "periods": 2, "points": points}

    def response(order: int, peak: float) -> dict[str, Any]:
        return {
            "order": order, "share": 0.2, "interval": [0.1, 0.3], "largest_multiplier": 0.5, "peak": {"tip": peak},
            "impacts": {}, "peak_force": {},
        }  # fmt: skip

    def named(value: float, *responses: dict[str, Any], chaotic: float = 0.0, key: str = "k") -> list[Any] | None:
        one = {"values": {key: value}, "responses": responses, "chaotic": chaotic, "unsettled": 0.0, "failed": 0.0}
        found = beside_curve(curve, [one])
        return found and [row[1:3] for block in found.blocks if hasattr(block, "rows") for row in block.rows]

    assert named(2.0, response(1, 1.5e-3), response(2, 1.52e-3), response(2, 4.3333e-3)) == []
    assert named(2.0, response(1, 3.0e-3), response(3, 1.5e-3)) == [("order 1", 0.2), ("order 3", 0.2)]
    assert named(2.0, response(1, 1.5e-3), chaotic=0.4) == [("chaotic", 0.4)]
    assert named(1.2, response(1, 4.0e-3)) == [("order 1", 0.2)]
    assert named(5.0, response(1, 1.5e-3)) is None
    assert named(2.0, response(1, 1.5e-3), key="other") is None


def test_branches_are_apart() -> None:
    """Each branch is a slice of its own."""
    points = [{"branch": number} for number in (1, 1, 2, 3, 3)]
    assert list(branch_parts(points)) == [(1, slice(0, 2)), (2, slice(2, 3)), (3, slice(3, 5))]
