"""The compiled loop against the generic march: the same numbers to round-off, step by step, with every figure."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solver.accounts import Accounts
from solver.analyses.transient import EffectiveOperators, March, begun, march
from solver.compiled.loop import Block, CompiledLoop
from solver.contact.dampers import HuntCrossleyDamper, SmoothStepDamper
from solver.contact.law import ContactLaw, kelvin_voigt
from solver.contact.springs import Spring
from solver.errors import NotConverged
from solver.integrators.generalized_alpha import GeneralizedAlpha
from solver.integrators.midpoint import Midpoint
from tests.dense_beams import dense_beam, thrown_start

SCHEMES = {
    "discrete-gradient": Midpoint(),
    "implicit-midpoint": Midpoint(implicit=True),
    "newmark": GeneralizedAlpha.newmark(),
    "hht": GeneralizedAlpha.hht(0.2),
    "generalized-alpha 0.5": GeneralizedAlpha.from_spectral_radius(0.5),
}
HERTZ = Spring(2.0e6, 1.5)
LAWS = {
    "elastic": ContactLaw(Spring(1.0e5)),
    "hertz": ContactLaw(HERTZ),
    "kelvin-voigt": kelvin_voigt(1.0e5, 30.0, touch_depth=1.0e-5),
    "kelvin-voigt adhesive": kelvin_voigt(1.0e5, 30.0, adhesive=True, touch_depth=1.0e-5),
    "hunt-crossley": ContactLaw(HERTZ, HuntCrossleyDamper(HERTZ, 0.4)),
    "hunt-crossley by restitution": ContactLaw(HERTZ, HuntCrossleyDamper(HERTZ, 0.0), touch_product=0.6),
    "smooth step": ContactLaw(Spring(1.0e5, 1.2), SmoothStepDamper(60.0, 2.0e-3)),
    "unlike points": ContactLaw(Spring(np.geomspace(1.0e4, 1.0e6, 12)), SmoothStepDamper(np.full(12, 9.0), 2.0e-3)),
}
STEPS = 200
TOUCHY = {
    "hunt-crossley by restitution": 1.0e-6,  # chi follows from touch speeds: slow touches magnify round-off
    "elastic": 1.0e-8,  # nothing damps it
}
DT = 1.0e-3


def close(found: np.ndarray | float, expected: np.ndarray | float, relative: float = 1.0e-9) -> bool:
    """Whether two arrays agree relative to the largest entry."""
    scale = float(np.max(np.abs(expected), initial=1.0e-12))
    return bool(np.max(np.abs(np.asarray(found) - np.asarray(expected)), initial=0.0) <= relative * scale)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_loop_agrees_with_the_march(scheme: str, law: str) -> None:
    system, steps, relative = dense_beam(seed=len(law)), STEPS, TOUCHY.get(law, 1.0e-9)
    plan = March(system, LAWS[law], SCHEMES[scheme], EffectiveOperators(system, SCHEMES[scheme]), DT, steps)
    start = thrown_start(system)
    expected = Accounts.opened(system, LAWS[law], begun(plan, start), DT)
    places, forces = [], []
    for step in march(plan, start):
        expected.take(step)
        state = step.refreshed or step.new
        assert step.completes
        places.append(state.u[0])
        forces.append(system.contact.weights * state.pressure)
    passed = Accounts.opened(system, LAWS[law], begun(plan, start), DT)
    blocks = list(CompiledLoop(plan).blocks(start, accounts=passed, stops=70))
    assert {70, steps} <= set(np.cumsum([block.steps for block in blocks]))
    assert close(np.concatenate([block.u for block in blocks]), np.array(places), relative)
    sides = np.array([np.bincount(system.contact.faces, force, 2) for force in forces])
    assert np.count_nonzero(sides.max(axis=1)) > steps // 10, "nothing touched"
    assert close(np.concatenate([block.records.force for block in blocks]), sides, relative)
    end = blocks[-1].end
    assert close(end.u[0], state.u[0], relative)
    assert close(end.v[0], state.v[0], relative)
    assert close(end.pressure, state.pressure, relative)
    assert_same_accounts(passed, expected, relative)


def assert_same_accounts(found: Accounts, expected: Accounts, relative: float) -> None:
    """Every figure that is kept of a march is the same."""
    scale = expected.ledger.exchanged
    for name, value in vars(expected.ledger).items():
        if name == "round_off":
            continue  # an estimate, made in the coordinates that are computed with
        assert np.max(np.abs(getattr(found.ledger, name) - value)) <= relative * scale, name
    assert close(found.peaks.impulse, expected.peaks.impulse, relative)
    assert close(found.peaks.force, expected.peaks.force, relative)
    assert close(found.peaks.deepest, expected.peaks.deepest, relative)
    assert found.peaks.iterations <= expected.peaks.iterations
    assert found.gates.impacts == expected.gates.impacts
    assert found.gates.violations == expected.gates.violations
    assert found.gates.largest_growth == pytest.approx(expected.gates.largest_growth, rel=1e-6, abs=relative)
    assert found.gates.largest_loss == pytest.approx(expected.gates.largest_loss, rel=1e-6, abs=relative)
    assert found.episodes.figures() == pytest.approx(expected.episodes.figures(), rel=relative)
    assert found.tally.steps == expected.tally.steps
    assert found.tally.iterations == pytest.approx(expected.tally.iterations, rel=0.02, abs=3)


@pytest.mark.parametrize(("scheme", "most"), [("discrete-gradient", 4), ("generalized-alpha 0.5", 3)])
def test_steps_that_do_not_converge_are_halved_as_in_the_march(scheme: str, most: int) -> None:
    """Few iterations are not enough for some steps: these are softened or halved, and the others go on compiled."""
    system, law = dense_beam(seed=5), LAWS["hertz"]
    plan = March(
        system, law, SCHEMES[scheme], EffectiveOperators(system, SCHEMES[scheme]), 4.0e-3, 60, 12, max_iterations=most
    )
    start = thrown_start(system)
    expected = Accounts.opened(system, law, begun(plan, start), plan.dt)
    for step in march(plan, start):
        expected.take(step)
    assert expected.tally.failures > 0
    assert expected.tally.halved < expected.tally.steps - 3
    passage = CompiledLoop(plan).follow(start, plan.steps)
    assert close(passage.end.u[0], step.new.u[0], 1.0e-8)
    assert passage.accounts.tally.failures == expected.tally.failures
    assert passage.accounts.tally.halved == expected.tally.halved
    assert_same_accounts(passage.accounts, expected, 1.0e-8)


def test_what_fails_altogether_is_told_after_what_came_before() -> None:
    system, law = dense_beam(seed=5), LAWS["hertz"]
    plan = March(system, law, SCHEMES["newmark"], EffectiveOperators(system, SCHEMES["newmark"]), 4.0e-3, 60, 0, 1)
    blocks: list[Block] = []

    def keep() -> None:
        for block in CompiledLoop(plan).blocks(thrown_start(system)):
            blocks.append(block)

    with pytest.raises(NotConverged, match=r"at t = .* s with a step of 0\.004 s .*time\.step") as caught:
        keep()
    assert f"at t = {blocks[-1].end_time:.6g} s" in str(caught.value)
    assert sum(block.steps for block in blocks) == len(np.concatenate([block.times for block in blocks]))


def test_without_a_folder_for_machine_code_functions_are_compiled_anew(tmp_path: Path) -> None:
    """The cache at a place that is a file, as good as one that may not be written."""
    taken = tmp_path / "file"
    taken.write_text("not a folder")
    program = (
        "from solver.compiled.jit import cache_folder\n"
        "from solver.compiled.loops import fill\n"
        "import numpy as np\n"
        "x = np.zeros(3)\n"
        "fill(x, 2.0)\n"
        "print(cache_folder(), x.sum())\n"
    )
    surroundings = {**os.environ, "NUMBA_CACHE_DIR": str(taken)}
    done = subprocess.run(
        [sys.executable, "-c", program], env=surroundings, capture_output=True, text=True, check=False
    )
    assert done.stdout.split() == ["None", "6.0"], done.stderr
