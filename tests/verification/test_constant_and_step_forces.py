"""Forces that are constant or switched on: the sag of a cantilever, and the step response of an oscillator."""

from __future__ import annotations

import re
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.loads.step_force import StepForce
from gapbeam.solver.messages.errors import CaseError
from tests.shared.toys import SCHEMES, start, steps_of, stopped_oscillator

LENGTH, THICKNESS, WIDTH, MODULUS = 1.0, 0.01, 0.02, 2.1e11
BENDING = MODULUS * WIDTH * THICKNESS**3 / 12.0


def cantilever(load: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """Return a slender beam that is clamped at x = 0, beside a stop that it does not reach."""
    return {
        "beam": {"length": LENGTH, "thickness": THICKNESS, "width": WIDTH},
        "material": {"young_modulus": MODULUS, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [{"name": "far", "from": 0.9, "to": 0.92, "clearance": 0.05, "region": "stop"}],
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "model": {"type": "beam", "elements": 40},
        "load": load,
        "probe": [{"name": "tip", "point": LENGTH}],
        "time": {"end": 0.02, "step": 1.0e-4},
        "output": {"errors": "none"},
        **more,
    }


def tip(tables: dict[str, Any], output: Path) -> np.ndarray:
    """Return the displacement of the tip along the bending axis, m."""
    done = gapbeam.run(tables, output=output)
    assert done.summary is not None, done.message
    return np.array(gapbeam.open_results(output).history["displacement"].sel(probe="tip", component="y"))


@pytest.mark.parametrize(("point", "direction", "sense"), [(LENGTH, None, 1.0), (0.6, [0.0, -2.0], -1.0)])
def test_a_constant_force_is_part_of_the_seat(
    point: float, direction: list[float] | None, sense: float, tmp_path: Path
) -> None:
    """The tip stands at F a^2 (3 L - a) / (6 E I) from the first record on: F L^3 / (3 E I) for a force there."""
    load = {"type": "constant_force", "point": point, "amplitude": 3.0}
    found = tip(cantilever([load | ({} if direction is None else {"direction": direction})]), tmp_path / "run")
    expected = sense * 3.0 * point**2 * (3.0 * LENGTH - point) / (6.0 * BENDING)
    assert found[0] == pytest.approx(expected, rel=1e-3)
    assert np.abs(found - found[0]).max() < 1e-6 * abs(expected)


def test_a_step_starts_from_the_seat_without_it(tmp_path: Path) -> None:
    """Until its start nothing moves; then the tip goes beyond the static sag, and below twice that of all modes."""
    load = {"type": "step_force", "point": LENGTH, "amplitude": 3.0, "start": 0.005}
    found = tip(cantilever([load], time={"end": 0.12, "step": 2.0e-4}), tmp_path / "run")
    static = 3.0 * LENGTH**3 / (3.0 * BENDING)
    assert np.abs(found[:25]).max() < 1e-9 * static
    assert 1.9 * static < found.max() < 2.1 * static


def test_a_jump_within_a_step_keeps_the_order(tmp_path: Path) -> None:
    """A quarter of the step has a sixteenth of the worst error, wherever in a step the force begins.

    By its value in the middle of a step the force comes up to half a step late or early: a quarter of the error.
    """
    springs = [
        {"name": name, "type": "elastic", "point": point, "stiffness": {"vertical": 400.0}}
        for name, point in (("left", 0.0), ("right", LENGTH))
    ]
    worst = dict[int, float]()
    for k, late in enumerate((0.0, 7.0, 13.0, 21.0, 26.0)):
        load = [{"type": "step_force", "point": LENGTH, "amplitude": 3.0, "start": 0.04 + late * 6.25e-5}]

        def moved(times: int, load: list[dict[str, Any]] = load, k: int = k) -> np.ndarray:
            changes = {"model": {"type": "rigid"}, "joint": springs, "time": {"end": 0.4, "step": 2e-3 / times}}
            return tip(cantilever(load, **changes), tmp_path / f"{k}-{times}")[::times]

        exact = moved(32)
        for times in (1, 4):
            worst[times] = max(worst.get(times, 0.0), float(np.abs(moved(times) - exact).max()))
    assert worst[1] / worst[4] == pytest.approx(16.0, rel=0.1)


FREQUENCY, FORCE = 10.0, 2.0
OMEGA = 2.0 * pi * FREQUENCY


@pytest.mark.parametrize(
    ("keys", "largest", "last"),
    [
        ({}, 2.0, None),
        ({"start": 0.0437}, 2.0, None),
        ({"end": 1.0 / FREQUENCY}, 2.0, 0.0),
        ({"end": 0.5 / FREQUENCY}, 2.0, 2.0),
        ({"ramp": 4.0 / FREQUENCY}, 1.0, None),
    ],
)
def test_an_oscillator_goes_twice_as_far(keys: dict[str, float], largest: float, last: float | None) -> None:
    """F/k (1 - cos w t) is twice the static displacement; after a period or half of one, 0 or 2 F/k stay behind."""
    load = StepForce.model_validate({"type": "step_force", "point": 0.1, "amplitude": FORCE, **keys})
    system = stopped_oscillator(1.0, OMEGA**2, 1.0, 0.0, load.time_function().value)
    steps = steps_of(system, kelvin_voigt(1.0), SCHEMES["discrete-gradient"], start(system), 5.0e-4, 1200)
    moved = np.array([step.new.u[0, 0] for step in steps]) * OMEGA**2 / FORCE
    assert moved.max() == pytest.approx(largest, rel=1e-2)
    if last is not None:
        rest = moved[-400:]
        assert 0.5 * np.ptp(rest) == pytest.approx(last, abs=2e-2)


def test_means_over_intervals() -> None:
    """A jump within an interval counts by its share, and a smooth rise has a mean of a half."""
    jump = StepForce.model_validate({"type": "step_force", "point": 0.1, "amplitude": FORCE, "start": 0.3, "end": 0.8})
    found = jump.time_function().mean(np.array([0.0, 0.2, 0.7, 0.8]), np.array([0.3, 0.6, 0.9, 1.0]))
    assert found == pytest.approx([0.0, 0.75 * FORCE, 0.5 * FORCE, 0.0], abs=1e-12)
    rise = StepForce.model_validate({"type": "step_force", "point": 0.1, "amplitude": FORCE, "start": 0.3, "ramp": 0.4})
    assert rise.time_function().mean(np.array([0.3]), np.array([0.7])) == pytest.approx([0.5 * FORCE], rel=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e2])
@pytest.mark.parametrize(
    ("start", "ramp", "end"), [(0.5, 0.0, 0.2), (0.5, 0.0, 0.5), (0.5, 0.1, 0.3), (0.5, 0.1, 0.55)]
)
def test_advice_on_ends_gives_a_force_that_acts(start: float, ramp: float, end: float, size: float) -> None:
    """Ends at or before the start, or within the rise: the value that the message names is taken, and acts."""
    times = {"start": start * size, "ramp": ramp * size, "end": end * size}
    load = {"type": "step_force", "point": LENGTH, "amplitude": 3.0} | times
    with pytest.raises(CaseError) as refused:
        gapbeam.read_case(cantilever([load]))
    advised = float(re.search(r"try: +end = ([^,\s]+)", str(refused.value)).group(1))  # type: ignore[union-attr]
    force = StepForce.model_validate(load | {"end": advised})
    gapbeam.read_case(cantilever([load | {"end": advised}]))
    assert force.time_function().mean(np.array([0.0]), np.array([2.0 * advised])) > 0.0


def test_faults_and_doubts() -> None:
    """An end before the rise is refused; a force that never acts is said."""
    load = {"type": "step_force", "point": LENGTH, "amplitude": 3.0, "start": 0.01, "ramp": 0.01, "end": 0.015}
    with pytest.raises(CaseError, match=r"end[\s\S]*the force rises from 0.01 to 0.02 s"):
        gapbeam.read_case(cantilever([load]))
    late = StepForce.model_validate({"type": "step_force", "point": 0.1, "amplitude": 1.0, "start": 3.0})
    assert any("not within the run" in words for words in late.unusual_in_run(1.0))
