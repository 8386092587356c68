"""The compiled loop against the generic march: the same numbers to round-off, step by step, with every figure."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw, kelvin_voigt
from gapbeam.solver.contact.laws.damper import CoulombFriction, DampedPoint, Damper
from gapbeam.solver.contact.laws.law_choice import FORMULAS, damping
from gapbeam.solver.contact.laws.mixed_law import LawGroup, mixed_law
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.point_contact import friction_by_face
from gapbeam.solver.integrators.scheme_choice import scheme_names, scheme_of
from gapbeam.solver.integrators.time_scheme import kernel_of
from gapbeam.solver.march.compiled.compiled_march import CompiledBlock, CompiledLoop
from gapbeam.solver.march.compiled.ledger_kernel import measure_in_modes
from gapbeam.solver.march.compiled.plan_arrays import arrays_of_state
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, Paused, begun, march
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem
from tests.shared.dense_beams import dense_beam, dense_shaft, thrown_start
from tests.shared.passages import followed

VALUES = {"hht-alpha": {"alpha": 0.2}}  # less creates energy, which magnifies round-off
EVERY = {name: scheme_of(name, **VALUES.get(name, {})) for name in scheme_names()}
SCHEMES = {name: scheme for name, scheme in EVERY.items() if kernel_of(scheme) is not None}
HERTZ = Spring(2.0e6, 1.5)


def side_by_side(points: int) -> ContactLaw:
    """Return three laws, each at every third point: dampers given, by the touch speed, and rising with the depth."""
    laws = (
        kelvin_voigt(1.0e5, 30.0, touch_depth=1.0e-5),
        ContactLaw(HERTZ, Damper("hunt-crossley", 0.0), touch_product=0.6, slowest_touch=1e-4),
        ContactLaw(Spring(1.0e5, 1.2), Damper("adams-impact", 60.0, (2.0e-3,))),
    )
    return mixed_law([LawGroup(np.arange(first, points, 3), law) for first, law in enumerate(laws)])


LAWS = {
    "elastic": ContactLaw(Spring(1.0e5)),
    "hertz": ContactLaw(HERTZ),
    "kelvin-voigt": kelvin_voigt(1.0e5, 30.0, touch_depth=1.0e-5),
    "kelvin-voigt adhesive": kelvin_voigt(1.0e5, 30.0, adhesive=True, touch_depth=1.0e-5),
    "hunt-crossley": ContactLaw(HERTZ, Damper("hunt-crossley", 0.4)),
    "hunt-crossley by restitution": ContactLaw(
        HERTZ, Damper("hunt-crossley", 0.0), touch_product=0.6, slowest_touch=1e-4
    ),
    "smooth step": ContactLaw(Spring(1.0e5, 1.2), Damper("adams-impact", 60.0, (2.0e-3,))),
    "unlike points": ContactLaw(
        Spring(np.geomspace(1.0e4, 1.0e6, 12)), Damper("adams-impact", np.full(12, 9.0), (2.0e-3,))
    ),
    "side by side": side_by_side(12),
    "side by side around": side_by_side(72),
    "rubs": ContactLaw(HERTZ, Damper("hunt-crossley", 0.4), friction=CoulombFriction(0.3, 1.0e-3)),
    "rubs and sticks": ContactLaw(
        Spring(1.0e5), friction=CoulombFriction(np.linspace(0.1, 0.3, 12), 1.0e-3, static_coefficient=0.5)
    ),
    "sticks around": ContactLaw(
        Spring(1.0e5), friction=CoulombFriction(np.linspace(0.1, 0.3, 72), 1.0e-3, static_coefficient=0.5)
    ),
}


def rubbing_beam(seed: int) -> SemiDiscreteSystem:
    """The beam with two directions along which its points rub."""
    system, motions = dense_beam(seed=seed), np.random.default_rng(seed + 1).standard_normal((24, 8))
    return replace(system, contact=replace(system.contact, tangents=csr_matrix(motions)))


def tight_shaft(seed: int) -> SemiDiscreteSystem:
    """A shaft of which half of all points touch, many more than its sections have motions."""
    return dense_shaft(seed=seed, clearance=(0.0, 1.0e-3))


def rubbing_shaft(seed: int) -> SemiDiscreteSystem:
    """The same with friction."""
    return dense_shaft(seed=seed, clearance=(0.0, 1.0e-3), rubs=True)


BODIES = {
    "beam": dense_beam,
    "shaft": dense_shaft,
    "tight shaft": tight_shaft,
    "rubbing beam": rubbing_beam,
    "rubbing shaft": rubbing_shaft,
}
ROUND = ("hertz", "kelvin-voigt adhesive", "hunt-crossley by restitution", "side by side around")
RUBS = ("rubs", "rubs and sticks")
PAIRS = [
    *(("beam", law) for law in LAWS if "around" not in law and law not in RUBS),
    *(("shaft", law) for law in ROUND),
    *(("tight shaft", law) for law in ROUND),
    *(("rubbing beam", law) for law in RUBS),
    *(("rubbing shaft", law) for law in ("rubs", "sticks around")),
]
LATER = (("newmark", "shaft"), *((scheme, body) for scheme in SCHEMES for body in ("rubbing beam", "rubbing shaft")))
"""Schemes and bodies whose loops take half a minute to compile."""

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


@pytest.mark.parametrize(
    ("scheme", "body", "law"),
    [
        pytest.param(scheme, *pair, marks=pytest.mark.slow(minutes=0.4) if (scheme, pair[0]) in LATER else ())
        for scheme in SCHEMES
        for pair in PAIRS
    ],
)
def test_the_loop_agrees_with_the_march(scheme: str, body: str, law: str) -> None:
    """The shaft has sections whose points share their motions: of these, only those that may touch are looked at."""
    system, steps, relative = BODIES[body](seed=len(law)), STEPS, TOUCHY.get(law, 1.0e-9)
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
    if state.traction is not None:
        assert end.traction is not None
        rubbed = friction_by_face(system.contact, state.traction)
        assert close(blocks[-1].records.friction[-1], rubbed, relative)
        assert close(end.traction, state.traction, relative)
        assert expected.ledger.friction_loss > 0.0
    assert_same_accounts(passed, expected, relative, 1.0 if body == "rubbing shaft" else 0.04)


def assert_same_accounts(found: Accounts, expected: Accounts, relative: float, spent: float = 0.04) -> None:
    """Every figure that is kept of a march is the same; the iterations may differ by a share."""
    scale = expected.ledger.exchanged
    for name, value in vars(expected.ledger).items():
        if name == "round_off":
            continue  # an estimate, made in the coordinates that are computed with
        assert np.max(np.abs(getattr(found.ledger, name) - value)) <= relative * scale, name
    assert close(found.peaks.impulse, expected.peaks.impulse, relative)
    assert close(found.peaks.square, expected.peaks.square, relative)
    assert close(found.times.time, expected.times.time, 1.0e-12)
    assert np.array_equal(found.times.closings, expected.times.closings)
    assert close(found.peaks.force, expected.peaks.force, relative)
    assert close(found.peaks.friction, expected.peaks.friction, relative)
    assert close(found.peaks.deepest, expected.peaks.deepest, relative)
    assert found.peaks.iterations <= expected.peaks.iterations
    assert found.gates.impacts == expected.gates.impacts
    assert found.gates.violations == expected.gates.violations
    assert found.gates.largest_growth == pytest.approx(expected.gates.largest_growth, rel=1e-6, abs=relative)
    assert found.gates.largest_loss == pytest.approx(expected.gates.largest_loss, rel=1e-6, abs=relative)
    assert found.episodes.figures() == pytest.approx(expected.episodes.figures(), rel=relative)
    assert found.tally.steps == expected.tally.steps
    assert found.tally.iterations == pytest.approx(expected.tally.iterations, rel=spent, abs=3)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("law", ["hertz", "hunt-crossley by restitution"])
def test_a_march_that_was_left_goes_on_with_the_same_bits(body: str, law: str) -> None:
    """What a block leaves is all that a loop carries: points that could not touch are no part of it."""
    system, scheme = BODIES[body](seed=3), SCHEMES["discrete-gradient"]
    plan = March(system, LAWS[law], scheme, EffectiveOperators(system, scheme), DT, 150)
    start = begun(plan, thrown_start(system))
    whole = list(CompiledLoop(plan).blocks(start, stops=70))
    left = next(block for block in whole if block.first + block.steps == 70)
    again = list(CompiledLoop(plan).blocks(Paused(left.end, 70, modal=left.carried)))
    assert np.array_equal(whole[-1].end.u[0], again[-1].end.u[0])
    assert np.array_equal(whole[-1].end.pressure, again[-1].end.pressure)
    depths, depths_again = (np.concatenate([one.records.penetration for one in blocks]) for blocks in (whole, again))
    assert np.array_equal(depths[70:], depths_again)


def test_round_off_of_other_coordinates_is_not_created_energy() -> None:
    """The ledger takes over the energies of a state in modal coordinates; what they differ by is no loss of a step."""
    system = dense_beam()
    modal = modal_system(system)
    assert modal is not None
    accounts = Accounts.opened(system, LAWS["elastic"], thrown_start(system), DT)
    motion = arrays_of_state(modal, thrown_start(system))
    motion.q[:] = 1.0e-3  # far more than round-off
    created, residual = accounts.ledger.created, accounts.ledger.residual
    measure_in_modes(accounts, modal.squares, motion, None)
    assert accounts.ledger.strain == pytest.approx(0.5e-6 * modal.squares.sum(), rel=1e-12)
    assert accounts.ledger.kinetic == pytest.approx(0.5 * float(motion.v @ motion.v), rel=1e-12)
    scale = accounts.ledger.strain + accounts.ledger.kinetic
    assert (accounts.ledger.created, accounts.ledger.residual) == pytest.approx((created, residual), abs=1e-14 * scale)


@pytest.mark.parametrize(("scheme", "most"), [("discrete-gradient", 4), ("generalized-alpha", 3)])
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
    passage = followed(CompiledLoop(plan), start, plan.steps)
    assert close(passage.end.u[0], step.new.u[0], 1.0e-8)
    assert passage.accounts.tally.failures == expected.tally.failures
    assert passage.accounts.tally.halved == expected.tally.halved
    assert_same_accounts(passage.accounts, expected, 1.0e-8)


def test_what_fails_altogether_is_reported_after_what_came_before() -> None:
    system, law = dense_beam(seed=5), LAWS["hertz"]
    plan = March(system, law, SCHEMES["newmark"], EffectiveOperators(system, SCHEMES["newmark"]), 4.0e-3, 60, 0, 1)
    blocks: list[CompiledBlock] = []

    def keep() -> None:
        for block in CompiledLoop(plan).blocks(thrown_start(system)):
            blocks.append(block)

    with pytest.raises(NotConverged, match=r"at t = .* s with a step of 0\.004 s .*time\.step") as caught:
        keep()
    assert f"at t = {blocks[-1].end_time:.6g} s" in str(caught.value)
    assert sum(block.steps for block in blocks) == len(np.concatenate([block.times for block in blocks]))


def test_dampers_without_a_formula_are_refused() -> None:
    """No march leaves out what it does not know: there is no such law."""
    with pytest.raises(ValueError, match="no damping formula of a law 'cubic'; there are kelvin-voigt, hunt-crossley"):
        ContactLaw(HERTZ, Damper("cubic", 1.0e4))


def test_formulas_that_are_not_known_give_no_number() -> None:
    """Compiled code that is handed an unknown formula returns no figure that one could take for one."""
    point = DampedPoint(1.0e5, 1.0, 30.0, (0.0, 0.0, 0.0, 0.0))
    assert np.isnan(damping(1 + max(FORMULAS.values()), point, 1.0e-6)).all()
    for name, formula in FORMULAS.items():
        assert np.isfinite(damping(formula, point._replace(parameters=(1.0e-6,) * 4), 1.0e-6)).all(), name


def test_without_a_folder_for_machine_code_functions_are_compiled_anew(tmp_path: Path) -> None:
    """The cache at a place that is a file, as good as one that may not be written."""
    taken = tmp_path / "file"
    taken.write_text("not a folder")
    process_environment = {**os.environ, "NUMBA_CACHE_DIR": str(taken)}
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.machine_code_cache"],
        env=process_environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == ["None", "6.0"], done.stderr


@pytest.mark.parametrize("most", [0, 200, None])
def test_machine_code_that_cannot_be_kept_or_read_is_compiled_anew(most: int | None, tmp_path: Path) -> None:
    """A disk that takes no file larger than so many bytes, and one whose index is cut: right numbers, one warning.

    Args:
        most: Largest size of a file, bytes; None: what was kept is cut.
        tmp_path: A folder.
    """

    def called() -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "tests.programs.machine_code_cache"],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=None if most is None else lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)),
        )

    done = called()
    if most is None:
        for index in tmp_path.rglob("*.nbi"):
            index.write_bytes(index.read_bytes()[:20])
        done = called()
    assert done.stdout.split()[-1] == "6.0", done.stderr
    assert done.stderr.count("machine code cannot be kept") == 1
    assert "Traceback" not in done.stderr
