"""Starts that a case cannot have: refused where it is read, with what was found, what was expected, what to try."""

from __future__ import annotations

from typing import Any

import pytest

import gapbeam
from gapbeam.solver.case.beam_motions import bends_in_two_planes, is_symmetric
from gapbeam.solver.models.body import body_key
from tests.shared.case_texts import assert_says

SOLID = {"dimension": 3}
PIN = [{"name": "pin", "type": "pinned", "point": 0.0}]
SLIDER = [{"name": "guide", "type": "guided", "point": 0.0}]


def tables(analysis: dict[str, Any], model: str = "rigid", **more: Any) -> dict[str, Any]:
    """Return a bar between base and gland."""
    return {
        "beam": {"length": 0.4, "thickness": 0.02, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": {"length": 0.1, "clearance": 1.0e-3},
        "model": model,
        "probe": [{"name": "tip", "point": 0.4}],
        "load": [{"type": "gravity"}],
        "analysis": {"type": "transient"} | analysis,
        "time": {"end": 1.0e-3, "step": 1.0e-5},
        **more,
    }


def motion(**keys: Any) -> dict[str, Any]:
    """Return an analysis with a motion at the start."""
    return {"motion": keys}


BAD: dict[str, tuple[dict[str, Any], list[str]]] = {
    "three components of a slice": (tables(motion(velocity=[0.0, 0.1, 0.0])), ["3 components with dimension = 2"]),
    "two components of a solid": (
        tables(motion(displacement=[0.0, 1e-4]), mesh=SOLID),
        ["displacement", "2 components with dimension = 3", "[x, y, z]"],
    ),
    "a rotation vector of a slice": (
        tables(motion(spin=[0.0, 0.0, 0.1])),
        ["a vector with dimension = 2", "a slice rotates in its plane alone"],
    ),
    "lift twice": (
        tables(motion(lift=1e-4, displacement=[0.0, 1e-4])),
        ["displacement together with lift = 0.0001", "one of both"],
    ),
    "a pin along x": (
        tables(motion(velocity=[0.1, 0.0]), "reduced", joint=PIN),
        ["moves the section at x = 0 m", "pin holds"],
    ),
    "a guide about z": (
        tables(motion(spin=[0.0, 0.0, 0.2]), "reduced", joint=SLIDER, mesh=SOLID),
        ["rotates the section at x = 0 m", "guide holds"],
    ),
    "a mode without its probe": (
        tables({"mode": {"number": 3, "amplitude": 1e-5, "probe": "end"}}, "beam"),
        ['"end", and no probe of that name', "one of tip", 'probe = "tip"'],
    ),
    "a mode of a rigid body": (
        tables({"mode": {"number": 3, "amplitude": 1e-5, "probe": "tip"}}),
        ["a vibration mode of the model rigid", 'type = "beam" in [model]'],
    ),
    "mode 0": (
        tables({"mode": {"number": 0, "amplitude": 1e-5, "probe": "tip"}}, "beam"),
        ["[analysis.mode] number", "found:    0"],
    ),
    "a mode of a periodic search": (
        tables({"type": "periodic", "mode": {"number": 1, "amplitude": 1e-5, "probe": "tip"}}, "beam"),
        ["mode"],
    ),
}


@pytest.mark.parametrize(("case", "words"), BAD.values(), ids=list(BAD))
def test_starts_that_the_model_cannot_have(case: dict[str, Any], words: list[str]) -> None:
    """Each message says where, what was found, what was expected."""
    with pytest.raises(gapbeam.CaseError) as caught:
        gapbeam.read_case(case)
    assert_says(str(caught.value), words)


def test_starts_aside_have_bodies_of_their_own() -> None:
    """A start out of the plane takes a body that is not reduced to it; its values are cheap to change."""
    plane, aside, other = (
        gapbeam.read_case(tables(motion(velocity=velocity), "beam", mesh=SOLID))
        for velocity in ([0.0, 0.0, 0.1], [0.0, 0.1, 0.0], [0.0, 0.3, 0.2])
    )
    assert body_key(aside) == body_key(other) != body_key(plane)
    assert body_key(plane) == body_key(gapbeam.read_case(tables({}, "beam", mesh=SOLID)))
    assert is_symmetric(plane)
    assert not bends_in_two_planes(plane)
    assert not is_symmetric(aside)
    assert bends_in_two_planes(aside)
