"""Stops that yield and stops that stiffen: a mass thrown at them, by energy in closed form."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import gapbeam
from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.contact.laws.contact_law import ContactLaw, make_law
from gapbeam.solver.contact.laws.law_tables import ElasticPlastic, PiecewiseLinear
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march
from tests.shared.interrupted import differing, run_in_parts
from tests.shared.passages import followed
from tests.shared.toys import SCHEMES, ledger_of, start, steps_of, stopped_oscillator
from tests.verification.test_own_contact import AREA, LENGTH, MASS, stops, tables

SPEED, STIFFNESS, YIELD = 0.7, 1.0e5, 60.0  # m/s, N/m, N: an elastic stop would be pressed with 221 N
ELASTIC = YIELD / STIFFNESS  # m
ENERGY = 0.5 * SPEED**2  # J, of 1 kg
MIDPOINT = ["discrete-gradient", "implicit-midpoint"]


def yielding(hardening: float = 0.0) -> ContactLaw:
    """Return the stop that yields."""
    chosen = ElasticPlastic(type="elastic-plastic", yield_pressure=YIELD, hardening=hardening)
    return make_law(chosen, STIFFNESS, 1.0e-8)


def deepest(hardening: float) -> float:
    """Return where F_y d_e / 2 + F_y (d - d_e) + h k (d - d_e)^2 / 2 is the energy of the mass, m."""

    def missing(depth: float) -> float:
        beyond = depth - ELASTIC
        return YIELD * (0.5 * ELASTIC + beyond) + 0.5 * hardening * STIFFNESS * beyond**2 - ENERGY

    return float(brentq(missing, ELASTIC, 1.0, xtol=1e-15))


@pytest.mark.parametrize("hardening", [0.0, 0.2])
@pytest.mark.parametrize("name", MIDPOINT)
def test_a_mass_thrown_at_a_stop_that_yields(name: str, hardening: float) -> None:
    """Depth, set and speed of return; without hardening m v0^2 / 2 = F_y s + F_y^2 / (2 k), v1 = F_y / sqrt(k m)."""
    system, law, first = stopped_oscillator(), yielding(hardening), start(stopped_oscillator(), v=SPEED)
    steps = steps_of(system, law, SCHEMES[name], first, 2.0e-5, 1250)
    depth = deepest(hardening)
    left = (1.0 - hardening) * (depth - ELASTIC)
    error = 1e-4 if name == "discrete-gradient" else 5e-3
    assert max(step.new.depth[0] for step in steps) == pytest.approx(depth, rel=error)
    assert steps[-1].new.plastic_set == pytest.approx(left, rel=error)
    assert -steps[-1].new.v[0, 0] == pytest.approx((depth - left) * sqrt(STIFFNESS), rel=5 * error)
    assert max(step.new.pressure[0] for step in steps) == pytest.approx((depth - left) * STIFFNESS, rel=5 * error)
    if hardening == 0.0:
        assert left == pytest.approx((ENERGY - 0.5 * YIELD * ELASTIC) / YIELD, rel=1e-12)
        assert (depth - left) * sqrt(STIFFNESS) == pytest.approx(YIELD / sqrt(STIFFNESS), rel=1e-12)


@pytest.mark.parametrize("count", [5, 40, 1000])
def test_the_ledger_enters_plastic_work(count: int) -> None:
    """At any step the energy that the mass has lost is the plastic work, and none is created."""
    system, law, first = stopped_oscillator(), yielding(), start(stopped_oscillator(), u=-1.0e-3, v=SPEED)
    steps = steps_of(system, law, SCHEMES["discrete-gradient"], first, 0.03 / count, count)
    ledger = ledger_of(system, law, first, steps)
    assert ledger.contact_loss == pytest.approx(ENERGY - 0.5 * steps[-1].new.v[0, 0] ** 2, rel=1e-9)
    assert ledger.contact_loss > 0.5 * ENERGY
    assert abs(ledger.algorithmic) + abs(ledger.residual) + ledger.contact_gain < 1e-9 * ENERGY


def test_the_implicit_rule_only_loses_energy() -> None:
    """Plastic work is F_y s of the set that is left; the scheme takes what else is lost."""
    system, law, first = stopped_oscillator(), yielding(), start(stopped_oscillator(), v=SPEED)
    steps = steps_of(system, law, SCHEMES["implicit-midpoint"], first, 2.0e-4, 150)
    ledger = ledger_of(system, law, first, steps)
    assert steps[-1].new.plastic_set is not None
    assert ledger.contact_loss == pytest.approx(YIELD * steps[-1].new.plastic_set[0], rel=1e-9)
    assert ledger.algorithmic > 0.0
    assert abs(ledger.residual) < 1e-9 * ENERGY


def test_the_gap_has_grown() -> None:
    """A second throw at the speed of return meets an elastic stop, by the set farther away: F_y, and no more set."""
    system, law = stopped_oscillator(), yielding()
    steps = steps_of(system, law, SCHEMES["discrete-gradient"], start(system, v=SPEED), 1.0e-4, 200)
    left = steps[-1].new.plastic_set
    assert left is not None
    again = start(system, v=YIELD / sqrt(STIFFNESS) * 0.999)
    again = again.__class__(**{**vars(again), "plastic_set": left})
    second = steps_of(system, law, SCHEMES["discrete-gradient"], again, 1.0e-4, 600)
    np.testing.assert_array_equal(second[-1].new.plastic_set, left)
    assert max(step.new.depth[0] for step in second) == pytest.approx(left[0] + 0.999 * ELASTIC, rel=1e-3)
    assert second[-1].new.v[0, 0] == pytest.approx(-again.v[0, 0], rel=1e-9)


@pytest.mark.parametrize("name", list(SCHEMES))
def test_a_mass_thrown_at_a_stop_that_stiffens(name: str) -> None:
    """Deepest by energy: k d1^2 / 2 + k d1 (d - d1) + f k (d - d1)^2 / 2 = m v^2 / 2, and the speed returns."""
    first, factor = 1.0e-3, 8.0
    chosen = PiecewiseLinear(type="piecewise-linear", depths=(first,), factors=(factor,))
    law = make_law(chosen, STIFFNESS, 1.0e-8)
    system = stopped_oscillator()
    steps = steps_of(system, law, SCHEMES[name], start(system, v=SPEED), 1.0e-5, 800)
    left = ENERGY / STIFFNESS - 0.5 * first**2
    expected = first + (-first + sqrt(first**2 + 2.0 * factor * left)) / factor
    error = 1e-3 if SCHEMES[name].conserves_energy else 1e-2
    assert max(step.new.depth[0] for step in steps) == pytest.approx(expected, rel=error)
    assert -steps[-1].new.v[0, 0] == pytest.approx(SPEED, rel=5 * error)
    if SCHEMES[name].conserves_energy:
        assert -steps[-1].new.v[0, 0] == pytest.approx(SPEED, rel=1e-10)


@pytest.mark.parametrize("hardening", [0.0, 0.2, None], ids=["yields", "hardens", "stiffens"])
@pytest.mark.parametrize("name", MIDPOINT)
def test_the_compiled_loop_takes_the_same_steps(name: str, hardening: float | None) -> None:
    """Thrown at a stop twice, a mass on a spring has the motion, the set and the loss of the march step by step."""
    system = stopped_oscillator(spring=1.0e3)
    law, first = yielding(hardening or 0.0), start(stopped_oscillator(), v=SPEED)
    if hardening is None:
        chosen = PiecewiseLinear(type="piecewise-linear", depths=(1.0e-3, 1.5e-3), factors=(8.0, 2.0))
        law = make_law(chosen, STIFFNESS, 1.0e-8, damping=20.0)
    plan = March(system, law, SCHEMES[name], EffectiveOperators(system, SCHEMES[name]), 2.0e-4, 1500)
    steps, loop = list(march(plan, first)), followed(CompiledLoop(plan), first, 1500)
    assert sum(one.new.depth[0] > 0.0 >= one.old.depth[0] for one in steps) > 1
    places = [float(step.new.u[0, 0]) for step in steps]
    assert float(loop.end.u[0, 0]) == pytest.approx(places[-1], abs=1e-9 * np.ptp(places))
    ledger = ledger_of(system, law, first, steps)
    assert loop.accounts.ledger.contact_loss == pytest.approx(ledger.contact_loss, rel=1e-9)
    assert abs(loop.accounts.ledger.residual) < 1e-9 * ENERGY
    assert (loop.end.plastic_set is None) == (hardening is None)
    if hardening is not None:
        np.testing.assert_allclose(loop.end.plastic_set, steps[-1].new.plastic_set, rtol=1e-10)


BAR = 0.5  # m/s
FORCE = 400.0  # N, at which the stop under the bar yields


def thrown_bar(**more: Any) -> dict[str, Any]:
    """Return a rigid bar thrown at a stop under its middle that yields, and another stop far away."""
    support = stops(stiffness=[1.0e6 / AREA, 1.0e5 / AREA])
    support[0] |= {"from": 0.5 * (LENGTH - 1e-3), "to": 0.5 * (LENGTH + 1e-3), "clearance": 1.0e-4}
    support[0] |= {"law": {"type": "elastic-plastic", "yield_pressure": FORCE / AREA}}
    support[1] |= {"clearance": 0.01}
    analysis = {"type": "transient", "start": "undeformed", "motion": {"velocity": -BAR}}
    time = {"end": 4.0e-3, "step": 1.0e-5}
    return tables(support, load=[], analysis=analysis, time=time, output={"fields_interval": 4.0e-3}) | more


def test_a_bar_on_a_support_that_yields(tmp_path: Path) -> None:
    """The whole way from a case file: speed of return, plastic work, set in the summary, and resume to the last bit."""
    done = gapbeam.run(thrown_bar(), ["output.errors=none"], output=tmp_path / "run")
    assert done.exit_status == 0, done.message
    assert done.summary["loop"] == "compiled"
    history = gapbeam.open_results(tmp_path / "run").history
    velocity = history["velocity"].sel(probe="tip", component="y")
    assert float(velocity[-1]) == pytest.approx(FORCE / sqrt(1.0e6 * MASS), rel=2e-3)
    left = (0.5 * MASS * BAR**2 - 0.5 * FORCE**2 / 1.0e6) / FORCE
    assert done.summary["plastic_set"] == {"left_below": pytest.approx(left, rel=2e-3), "right_below": 0.0}
    assert done.summary["energy"]["contact_dissipation"] == pytest.approx(FORCE * left, rel=2e-3)


def test_a_run_that_is_resumed_has_the_same_bits(tmp_path: Path) -> None:
    """Stopped in the middle of the impact and resumed: the history of the run that was not stopped."""
    path = tmp_path / "case.toml"
    path.write_text(case_to_toml(gapbeam.read_case(thrown_bar())))
    keys = ["output.errors=none", "output.fields_interval=1e-3"]
    whole = gapbeam.run(path, keys, tmp_path / "whole")
    assert whole.exit_status == 0, whole.message
    parts = run_in_parts(path, keys, tmp_path / "parts", (1,))
    assert parts.exit_status == 0, parts.message
    assert whole.summary["loop"] == "compiled"
    assert differing(tmp_path / "whole", tmp_path / "parts") == []
    assert parts.summary["plastic_set"] == whole.summary["plastic_set"]


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "a scheme whose plastic work is not known": (
        {"time": {"end": 1e-3, "step": 1e-5, "scheme": "newmark"}},
        "the plastic work of their steps is known",
    ),
    "a periodic response": (
        {
            "analysis": {"type": "periodic"},
            "load": [{"type": "base_motion", "name": "shaker", "amplitude": 30.0, "frequency": 30.0}],
        },
        "what yields is not the same after a period",
    ),
    "factors that are missing": (
        {"contact": {"law": {"type": "piecewise-linear", "depths": [1e-4, 2e-4], "factors": [2.0]}}},
        "1 factor for 2 depths",
    ),
    "depths out of order": (
        {"contact": {"law": {"type": "piecewise-linear", "depths": [2e-4, 1e-4], "factors": [2.0, 3.0]}}},
        "depths that ascend, each once",
    ),
    "a negative factor": (
        {"contact": {"law": {"type": "piecewise-linear", "depths": [2e-4], "factors": [-2.0]}}},
        "factors",
    ),
    "a yield pressure of nothing": ({"contact": {"law": {"type": "elastic-plastic", "yield_pressure": 0.0}}}, "yield"),
}


@pytest.mark.parametrize(("changes", "words"), BAD.values(), ids=BAD)
def test_bad_laws(changes: dict[str, Any], words: str) -> None:
    """What such laws do not go with is refused."""
    with pytest.raises(gapbeam.CaseError) as error:
        gapbeam.read_case(thrown_bar(**changes))
    assert words in str(error.value)
