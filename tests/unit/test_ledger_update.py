"""What happens to a measured step: by hand, and the same where kernels compile it."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.compilation.jit import compiled
from gapbeam.solver.diagnostics.contact_episodes import (
    CLOSED,
    OPEN,
    RESOLVING_STEPS,
    UNKNOWN,
    Peak,
    Watched,
    after_contact,
    after_forces,
    after_look,
    breaks_gates,
)
from gapbeam.solver.diagnostics.energy_ledger import (
    Energies,
    StepEnergies,
    after_measuring,
    after_step,
    created_energy,
    energy_residual,
    exchanged_energy,
    relative_growth,
)

NOTHING = Energies(*(0.0 for _ in Energies._fields))
# A step with 7 J from loads, of which 4 J from driven ones, that balances but for 0.25 J.
STEP = StepEnergies(
    kinetic=3.0,
    strain=2.0,
    contact=0.5,
    structural=0.4,
    inner=4.9,
    elastic_work=0.7,
    contact_loss=-0.2,
    friction_loss=0.3,
    driven_work=-4.0,
    unresolved=1.0e-9,
)
WORK = 7.0


def test_a_step_is_entered_as_by_hand() -> None:
    """The scheme took what inertia, elastic forces and contact worked beyond the change of T + V + Psi."""
    found = after_step(NOTHING, STEP)
    assert found.algorithmic == pytest.approx(4.9 - 3.0 - 2.0 + 0.7 - 0.5)
    assert (found.kinetic, found.strain, found.contact, found.largest_kinetic) == (3.0, 2.0, 0.5, 3.0)
    assert (found.structural, found.contact_loss, found.friction_loss) == (0.4, -0.2, 0.3)
    assert (found.contact_gain, found.round_off) == (0.2, 1.0e-9)
    assert exchanged_energy(found) == 4.0 + 3.0
    residual = 5.5 - (WORK - 0.4 + 0.2 - 0.3 - found.algorithmic)
    assert energy_residual(found, WORK) == pytest.approx(residual)
    assert created_energy(found, WORK) == pytest.approx(residual - found.algorithmic + 0.2)
    twice = after_step(found, STEP._replace(kinetic=1.0))
    assert (twice.largest_kinetic, twice.absolute_work, twice.structural) == (3.0, 8.0, 0.8)
    anew = after_measuring(twice, 1.5, 2.5, 0.6, 1.0e-3)
    assert (anew.kinetic, anew.strain, anew.contact, anew.round_off) == (1.5, 2.5, 0.6, 1.0e-3)
    assert anew._replace(kinetic=1.0, strain=2.0, contact=0.5, round_off=twice.round_off) == twice


def test_an_impact_is_judged_from_closing_to_opening() -> None:
    """One that was under way at the start is not known, and not judged."""
    face, ended, _ = after_look(Watched(UNKNOWN, np.nan, np.nan), True, 0.1, 2.0, 0.0)
    assert (face.face, ended) == (CLOSED, False)
    face, ended, _ = after_look(face, False, 0.3, 2.0, 0.0)
    assert (face.face, ended) == (OPEN, False)
    face, ended, _ = after_look(face, True, 0.3, 2.0, 0.0)
    assert (face, ended) == (Watched(CLOSED, 0.3, 2.0), False)
    face, ended, _ = after_look(face, True, 0.9, 5.0, 0.0)
    assert (face, ended) == (Watched(CLOSED, 0.3, 2.0), False)
    face, ended, growth = after_look(face, False, 0.5, 4.0, 0.0)
    assert (face.face, ended, growth) == (OPEN, True, pytest.approx(0.1))
    assert np.isnan(face.created)
    assert [breaks_gates(growth, *limits) for limits in ((0.2, 0.0), (0.05, 1.0))] == [False, True]
    assert [breaks_gates(-growth, *limits) for limits in ((0.0, 0.2), (1.0, 0.05))] == [False, True]


def test_growth_hides_in_round_off() -> None:
    """What the balance cannot resolve is none, and growth from nothing is infinite."""
    assert relative_growth(1.0e-9, 1.0, 1.0e-8) == 0.0
    assert relative_growth(-0.5, 2.0, 0.0) == -0.25
    assert relative_growth(-0.5, 0.0, 0.0) == -np.inf


def test_episodes_and_peaks_of_a_face() -> None:
    """An episode counts when it ends, and is short below ten steps."""
    for length in (RESOLVING_STEPS - 1, RESOLVING_STEPS):
        steps, impulse = 0, 0.0
        for _ in range(length):
            steps, impulse, ended, short = after_contact(steps, impulse, True, 0.5)
            assert not ended
            assert not short
        assert (steps, impulse) == (length, 0.5 * length)
        assert after_contact(steps, impulse, False, 0.0) == (0, 0.0, True, length < RESOLVING_STEPS)
    assert after_contact(0, 0.0, False, 0.0) == (0, 0.0, False, False)
    peak = after_forces(Peak(1.0, 7.0, 5.0, 2.0, -1.0e-6), 0.1, 4.0, 3.0, 1.0e-6)
    assert peak == Peak(1.4, 8.6, 5.0, 3.0, 1.0e-6)


@compiled
def booked(
    energies: Energies, step: StepEnergies, work: float, face: Watched
) -> tuple[Energies, float, Watched, float]:
    """Enter a step and look at a face, as kernels do."""
    found = after_step(energies, step)
    created = created_energy(found, work)
    seen, _, growth = after_look(face, False, created, found.kinetic, found.round_off)
    return found, created, seen, growth


def test_kernels_enter_the_same() -> None:
    """Compiled, the functions give the numbers that Python gets, to round-off."""
    random = np.random.default_rng(3)
    energies = Energies(*random.uniform(0.1, 2.0, len(Energies._fields)).tolist())._replace(round_off=1.0e-4)
    measured = StepEnergies(*random.uniform(-1.0, 1.0, len(StepEnergies._fields)).tolist())._replace(unresolved=1.0e-5)
    face = Watched(CLOSED, 0.1, 2.0)
    expected, found = booked.py_func(energies, measured, WORK, face), booked(energies, measured, WORK, face)  # type: ignore[attr-defined]
    assert found[0] == pytest.approx(expected[0], rel=1.0e-13)
    assert [found[1], found[3]] == pytest.approx([expected[1], expected[3]], rel=1.0e-13)
    assert expected[3] != 0.0
    assert found[2].face == expected[2].face == OPEN
