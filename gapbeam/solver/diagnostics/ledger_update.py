"""The energy balance of a march after each step, for every loop: loops measure, these functions enter.

    (T + V + Psi)(t) - (T + V + Psi)(0) = W - D_structural - D_contact - D_friction - D_algorithmic + residual

The functions take and return plain numbers, so that the step-by-step march calls them as they stand and kernels compile
them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gapbeam.solver.contact.solve.contact_solve import RELATIVE_TOLERANCE
from gapbeam.solver.jit import shared

ROUND_OFF_SAFETY = 8.0
ESTIMATE = 10.0  # times the estimate of round-off: no energy below it is called created


class Energies(NamedTuple):
    """The ledger without the work of each load, J; see `gapbeam.solver.diagnostics.energy_ledger.Ledger`."""

    kinetic: float
    strain: float
    contact: float
    start: float
    structural: float
    contact_loss: float
    algorithmic: float
    largest_kinetic: float
    absolute_work: float
    round_off: float
    contact_gain: float
    friction_loss: float


class StepEnergies(NamedTuple):
    """What a loop measures of a step, J.

    Attributes:
        kinetic: T at its end.
        strain: V at its end.
        contact: Psi at its end.
        structural: Work against Rayleigh damping and dashpots.
        inner: Work of the inertia and elastic forces in the balance of the step.
        elastic_work: Work of the elastic part of the contact pressure in that balance.
        contact_loss: Work against contact damping.
        friction_loss: Work against friction.
        driven_work: Work of the loads that are not static.
        unresolved: Work of the contact forces that round-off in the contact solve hides.
    """

    kinetic: float
    strain: float
    contact: float
    structural: float
    inner: float
    elastic_work: float
    contact_loss: float
    friction_loss: float
    driven_work: float
    unresolved: float


@shared
def after_step(before: Energies, step: StepEnergies) -> Energies:
    """Return the ledger after a step."""
    taken = (step.inner - (step.kinetic - before.kinetic) - (step.strain - before.strain)) + step.elastic_work
    return Energies(
        step.kinetic,
        step.strain,
        step.contact,
        before.start,
        before.structural + step.structural,
        before.contact_loss + step.contact_loss,
        before.algorithmic + (taken - (step.contact - before.contact)),
        max(before.largest_kinetic, step.kinetic),
        before.absolute_work + abs(step.driven_work),
        before.round_off + step.unresolved,
        before.contact_gain + max(-step.contact_loss, 0.0) + max(-step.friction_loss, 0.0),
        before.friction_loss + step.friction_loss,
    )


@shared
def after_measuring(before: Energies, kinetic: float, strain: float, contact: float, round_off: float) -> Energies:
    """Return the ledger with T, V and Psi measured anew on a state, whose balance cannot resolve `round_off`."""
    return Energies(
        kinetic,
        strain,
        contact,
        before.start,
        before.structural,
        before.contact_loss,
        before.algorithmic,
        before.largest_kinetic,
        before.absolute_work,
        max(before.round_off, round_off),
        before.contact_gain,
        before.friction_loss,
    )


@shared
def unresolved_energy(squares: float, strain: float, contact: float) -> float:
    """Return what the balance of a state cannot resolve: round-off, and the tolerance of the contact solve.

    Args:
        squares: Sum of the squared round-off of the terms of u K u, and of contact forces times penetrations, J^2.
        strain: V, J.
        contact: Psi, J.
    """
    found: float = ROUND_OFF_SAFETY * np.sqrt(squares) + RELATIVE_TOLERANCE * (abs(strain) + contact)
    return found


@shared
def total_energy(energies: Energies) -> float:
    """Return T + V + Psi."""
    return energies.kinetic + energies.strain + energies.contact


@shared
def energy_residual(energies: Energies, load_work: float) -> float:
    """Return what is left of the balance, for the work of all loads."""
    gained = load_work - energies.structural - energies.contact_loss - energies.algorithmic
    return (total_energy(energies) - energies.start) - (gained - energies.friction_loss)


@shared
def created_energy(energies: Energies, load_work: float) -> float:
    """Return energy that came from nowhere: algorithmic growth, residual, what contact damping and friction gave."""
    return energy_residual(energies, load_work) - energies.algorithmic + energies.contact_gain


@shared
def exchanged_energy(energies: Energies) -> float:
    """Return what created energy is measured against."""
    return energies.absolute_work + energies.largest_kinetic


@shared
def relative_growth(created: float, energy: float, round_off: float) -> float:
    """Return created energy relative to an energy; 0 where round-off, which is an estimate, may hide it."""
    if abs(created) <= ESTIMATE * round_off:
        return 0.0
    share: float = created / energy if energy > 0.0 else np.copysign(np.inf, created)
    return share
