"""Starts in the middle of the play: poses by hand, by NumPy's least squares, and gaps of every model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.case.analysis_table import centered_pose
from gapbeam.solver.supports.support_tables import play_of
from tests.shared.case_texts import assert_says

LENGTH, THICKNESS = 0.4, 0.02


def tables(support: Any, model: str = "rigid", **more: Any) -> dict[str, Any]:
    """Return a steel bar with weight, started in the middle of its supports."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": THICKNESS},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": support,
        "mesh": {"size": 0.05, "cells_through_thickness": 2},
        "model": model,
        "probe": [{"name": "tip", "point": LENGTH}],
        "load": [{"type": "gravity"}],
        "analysis": {"type": "transient", "start": "centered"},
        "time": {"end": 1.0e-3, "step": 1.0e-5},
        **more,
    }


def round_bar(**support: Any) -> dict[str, Any]:
    """Return a round bar in one region around its axis."""
    beam = {"length": LENGTH, "thickness": THICKNESS, "width": THICKNESS, "section": "round"}
    return tables([{"name": "front", "from": 0.05, "to": 0.1} | support], beam=beam, mesh={"dimension": 3})


def slots(*places: tuple[float, float, float]) -> list[dict[str, Any]]:
    """Return slots of 20 mm, each with its middle along the beam, its offset and its clearance."""
    return [
        {"name": f"s{number}", "from": x - 0.01, "to": x + 0.01, "offset": offset, "clearance": clearance}
        for number, (x, offset, clearance) in enumerate(places)
    ]


@pytest.mark.parametrize("model", ["beam", "reduced", "rigid", "full"])
def test_between_base_and_gland(model: str) -> None:
    """Half of the clearance is below, half above, all along; then the weight acts: z = -g t^2 / 2 from there."""
    case = gapbeam.read_case(tables({"length": 0.2, "clearance": 1.0e-3}, model))
    simulation = gapbeam.model(case)
    start = simulation.start(simulation.seat_or_failure())
    np.testing.assert_allclose(start.depth, -0.5e-3, rtol=1e-9)
    assert not np.any(start.v)
    *_, last = simulation.march(start, steps=100)
    tip = simulation.model.probes["tip"].evaluate(last.new.u[0], simulation.model.system.operators)
    assert tip[-1] - 0.5e-3 == pytest.approx(-0.5 * 9.81 * last.new.time**2, rel=1e-3)


def test_aligned_supports_are_met_in_their_middle() -> None:
    """Middles on a line: the beam lies on the line, and every support has half of its clearance on both sides."""
    case = gapbeam.read_case(tables(slots((0.05, 1.0e-5, 1e-4), (0.2, 4.0e-5, 2e-4), (0.35, 7.0e-5, 4e-4))))
    moved = centered_pose(case.support)
    assert moved.section(0.2)["vertical"] == pytest.approx(4.0e-5, rel=1e-12)
    assert moved.section(0.2)["rotation"] == pytest.approx(2.0e-4, rel=1e-12)


def test_least_squares_where_middles_are_not_on_a_line() -> None:
    """The line is that of `numpy.polyfit` through the middles of the play of all supports."""
    places = ((0.05, 3.0e-5, 4e-4), (0.2, -2.0e-5, 4e-4), (0.35, 7.0e-5, 4e-4))
    moved = centered_pose(gapbeam.read_case(tables(slots(*places))).support)
    points = [(x, offset) for x, offset, _ in places]
    slope, height = np.polyfit(*np.transpose(points), 1)
    assert moved.section(0.0)["vertical"] == pytest.approx(height, rel=1e-9)
    assert moved.section(0.0)["rotation"] == pytest.approx(slope, rel=1e-9)


def test_a_tilted_support_tilts_the_beam() -> None:
    """The middle of a support that rises along the beam rises with it."""
    support = slots((0.2, 2.0e-5, 2e-4))
    support[0]["tilt"] = 1.0e-3
    simulation = gapbeam.model(gapbeam.read_case(tables(support)))
    np.testing.assert_allclose(simulation.start(simulation.seat_or_failure()).depth, -1.0e-4, rtol=1e-9)


def test_polygons_and_profiles_have_their_centroid() -> None:
    """A rectangle of walls: halfway between them. An ellipse's worth of wear: where symmetry puts the middle."""
    walls = {"type": "polygon", "walls": [0.0, 90.0, 180.0, 270.0], "recesses": [0.0, 1e-5, 2e-5, 4e-5]}
    (one,) = gapbeam.read_case(round_bar(clearance=1.0e-5, region=walls, offset=3e-6, lateral=-2e-6)).support
    play = play_of(one)
    assert play is not None
    assert play.lateral == pytest.approx(-2e-6 + 0.5 * (2e-5 - 5e-5), rel=1e-9)
    assert play.height == pytest.approx(3e-6 + 0.5 * (3e-5 - 1e-5), rel=1e-9)
    assert play.half == pytest.approx(2.0e-5, rel=1e-9)
    angles = [float(angle) for angle in range(-180, 180, 5)]
    worn = [1.0e-5 * abs(np.sin(np.radians(angle))) for angle in angles]
    profile = {"type": "profile", "angles": angles, "recesses": worn}
    (other,) = gapbeam.read_case(round_bar(clearance=1.0e-4, region=profile)).support
    play = play_of(other)
    assert play is not None
    np.testing.assert_allclose([play.lateral, play.height], 0.0, atol=1e-12)
    assert play.half == pytest.approx(1.0e-4, rel=1e-3)


ABOVE = {"type": "stop", "side": "above"}
BAD: dict[str, tuple[dict[str, Any], list[str]]] = {
    "interference": (tables({"length": 0.1, "clearance": -1e-6}), ["has no play", 'start = "seat"']),
    "a stop alone": (
        tables([{"name": "stop", "from": 0.1, "to": 0.2, "clearance": 1e-4, "region": "stop"}]),
        ["no support that bounds the beam on both sides"],
    ),
    "an open polygon": (
        round_bar(clearance=1e-5, region={"type": "polygon", "walls": [-45.0, 45.0]}),
        ["no support that bounds the beam on both sides"],
    ),
    "supports that contradict each other": (
        tables(slots((0.05, 0.0, 1e-5), (0.2, 8.0e-5, 1e-5), (0.35, 0.0, 1e-5))),
        ["the supports contradict each other", "within the support s1"],
    ),
    "a stop in the way": (
        tables(
            [
                *slots((0.05, 1e-4, 1e-4)),
                {"name": "stop", "from": 0.2, "to": 0.21, "clearance": 1e-5, "region": ABOVE},
            ]
        ),
        ["within the support stop"],
    ),
    "a joint that would move": (
        tables({"length": 0.1, "clearance": 1e-4}, joint=[{"name": "pin", "type": "pinned", "point": 0.0}]),
        ["moves the section at x = 0 m", "pin holds"],
    ),
}


@pytest.mark.parametrize(("case", "words"), BAD.values(), ids=list(BAD))
def test_beams_without_a_middle(case: dict[str, Any], words: list[str]) -> None:
    """They are refused when the case is read."""
    with pytest.raises(gapbeam.CaseError) as caught:
        gapbeam.read_case(case)
    assert_says(str(caught.value), words)


def test_a_pinned_beam_in_a_support_around_its_axis_is_centered() -> None:
    """The pin and the middle agree: nothing moves."""
    case = gapbeam.read_case(
        tables(slots((0.35, 0.0, 1e-4)), "beam", joint=[{"name": "pin", "type": "pinned", "point": 0.0}])
    )
    simulation = gapbeam.model(case)
    start = simulation.start(simulation.seat_or_failure())
    assert not np.any(start.u)


@given(
    st.integers(3, 8),
    st.floats(-180.0, 180.0),
    st.floats(-5.0, -3.0).map(lambda exponent: 10.0**exponent),
    st.sampled_from(["clamped", "pinned", "guided"]),
    st.booleans(),
)
@settings(deadline=None, max_examples=25)
def test_symmetric_walls_leave_a_held_beam_where_it_is(
    walls: int, first: float, clearance: float, joint: str, with_hole: bool
) -> None:
    """The centroid of a regular polygon is its center, whatever the angle of its first wall: no pose at all."""
    angles = [first + 360.0 * number / walls for number in range(walls)]
    polygon = {"type": "polygon", "walls": angles}
    regions = [polygon, "hole" if with_hole else polygon]
    supports = [
        {"name": f"s{number}", "from": x, "to": x + 0.02, "clearance": clearance, "region": region}
        for number, (x, region) in enumerate(zip((0.2, 0.35), regions, strict=True))
    ]
    case = gapbeam.read_case(
        round_bar() | {"model": "beam", "support": supports, "joint": [{"name": "root", "type": joint, "point": 0.0}]}
    )
    pose = centered_pose(case.support)
    assert not any((*pose.translation, *pose.rotation))
