"""The figures of a finished or ended march, and whether they can be trusted."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np

from solver.accounts import Accounts
from solver.analyses.resolution import RESOLVING_SHARE
from solver.energy import Ledger
from solver.episodes import RESOLVING_STEPS
from solver.errors import EnergyCreated
from solver.gates import EnergyGates
from solver.model import Model
from solver.output.rows import Recorder
from solver.output.summary import describe_energy, describe_gates
from solver.peaks import Peaks
from solver.petsc_operators import PetscOperators
from solver.reduction.report import basis_remarks
from solver.tally import Tally
from solver.time_step import frequency_of_interest

LOG = logging.getLogger("gapbeam")
NOTABLE_SHARE = 0.01  # of the energy; a restraint that holds more is not weak
NOTABLE_UNRESOLVED = 0.05  # of the impulse
NOTABLE_PENETRATION = 0.1  # of the clearance


def figures(model: Model, recorder: Recorder, accounts: Accounts) -> dict[str, Any]:
    """Return what the summary tells about energy, gates, contact and restraint."""
    faces, peaks = model.system.contact.face_names, accounts.peaks
    deepest = float(np.max(peaks.deepest))
    clearance = abs(model.case.support.clearance)
    found = {
        "energy": describe_energy(accounts.ledger, accounts.gates),
        "gates": describe_gates(accounts.gates),
        "penetration": {
            "largest": deepest,
            "relative_to_clearance": deepest / clearance if clearance > 0.0 else None,
        },
        "peak_contact_force": dict(zip(faces, (float(x) for x in peaks.force), strict=True)),
        "restraint": {
            "largest_energy": recorder.largest_restraint_energy,
            "share_of_energy": recorder.restraint_share,
        },
    }
    if model.law.friction is not None:
        largest = dict(zip(faces, (float(x) for x in peaks.friction), strict=True))
        found["friction"] = vars(model.law.friction) | {"peak_force": largest}
    return found


def friction_words(accounts: Accounts) -> str:
    """Return what friction did in one line."""
    faces, ledger = accounts.system.contact.face_names, accounts.ledger
    forces = ", ".join(f"{name} {force:.4g} N" for name, force in zip(faces, accounts.peaks.friction, strict=True))
    share = f", {ledger.friction_loss / ledger.exchanged:.2%} of the energy exchanged" if ledger.exchanged > 0.0 else ""
    return f"largest friction force: {forces}; friction took {ledger.friction_loss:.3g} J{share}"


def contact_words(model: Model, peaks: Peaks) -> str:
    """Return the peaks of contact in one line."""
    faces = model.system.contact.face_names
    forces = ", ".join(f"{name} {force:.4g} N" for name, force in zip(faces, peaks.force, strict=True))
    deepest, clearance = float(np.max(peaks.deepest)), model.case.support.clearance
    size = "interference" if clearance < 0.0 else "clearance"
    share = f", {deepest / abs(clearance):.2%} of the {size}" if clearance != 0.0 else ""
    return f"largest contact force: {forces}; largest penetration {max(deepest, 0.0):.3g} m{share}"


def balance_words(ledger: Ledger) -> str:
    """Return how well the energy balance closes."""
    if abs(ledger.residual) <= ledger.round_off or ledger.exchanged == 0.0:
        return "energy balance closed to round-off"
    return f"energy residual {abs(ledger.residual) / ledger.exchanged:.1e} of the energy exchanged"


def remarks(model: Model, recorder: Recorder, accounts: Accounts) -> list[str]:
    """Return what a user has to know before using the figures, one sentence each."""
    found = []
    ledger, gates, episodes = accounts.ledger, accounts.gates, accounts.episodes
    clearance, deepest = abs(model.case.support.clearance), float(np.max(accounts.peaks.deepest))
    if clearance > 0.0 and deepest > NOTABLE_PENETRATION * clearance:
        found.append(
            f"the largest penetration, {deepest:.3g} m, is {deepest / clearance:.0%} of the clearance: "
            "try a stiffer contact.stiffness"
        )
    if episodes.unresolved_share > NOTABLE_UNRESOLVED:
        found.append(
            f"{episodes.unresolved_share:.0%} of the impulse passes in {episodes.short} contacts shorter than "
            f"{RESOLVING_STEPS} steps: their peak forces and accelerations are not resolved; try a smaller time.step"
        )
    if recorder.restraint_share > NOTABLE_SHARE:
        found.append(
            f"the restraint holds {recorder.restraint_share:.1%} of the energy: it is not weak; "
            "soften [restraint], or look for a load along it"
        )
    if gates.violations:
        found.append(
            f"{gates.violations} of {gates.impacts} impacts changed the energy by more than the gates allow "
            f"(largest growth {gates.largest_growth:.2%}, largest loss {gates.largest_loss:.2%}): "
            "try a smaller time.step"
        )
    driven = ledger.absolute_work > 0.0
    if driven and ledger.round_off > gates.limits.impact_growth * ledger.exchanged:
        found.append(
            f"round-off hides {ledger.round_off:.2g} J from the energy balance, "
            f"{ledger.round_off / ledger.exchanged:.1%} of the energy exchanged: less could be created unseen; "
            "try a smaller time.step"
        )
    if gates.failed(ledger) and model.case.gates.accept_energy_growth:
        found.append(f"energy growth of {gates.growth(ledger):.2%} accepted by gates.accept_energy_growth")
    return found


def remarks_on_model(model: Model) -> list[str]:
    """Return what a user has to know of a basis, or of steps by iterations, before using it, one sentence each."""
    found = list(basis_remarks(model.body.basis, frequency_of_interest(model.case)[0]))
    operators = model.body.operators
    if isinstance(operators, PetscOperators) and operators.solver.iterative:
        found.append(
            f"{model.dofs} DOFs are marched by conjugate gradients ({operators.solver.reason}), several solves of "
            'dozens of products in every step: type = "reduced" in [model] needs them only once, for its basis'
        )
    return found


def resolution_remarks(model: Model, tally: Tally) -> list[str]:
    """Return what adaptive steps could not resolve, one sentence or none."""
    if tally.unresolved == 0:
        return []
    return [
        f"{tally.unresolved} steps of {tally.shortest:.2g} s do not resolve how faces open and close, which takes "
        f"{RESOLVING_SHARE * model.contact_duration:.2g} s: peak forces and accelerations follow the step; try more "
        "time.max_halvings, a smaller time.step or a softer contact.stiffness"
    ]


def judge(model: Model, ledger: Ledger, gates: EnergyGates) -> None:
    """Pass a march that reached its end, or raise.

    Raises:
        EnergyCreated: More energy was created over the run than the gate of an impact allows.
    """
    if gates.failed(ledger) and not model.case.gates.accept_energy_growth:
        raise EnergyCreated(
            f"the scheme {model.case.time.scheme.type} created {ledger.created:.3g} J, "
            f"{gates.growth(ledger):.2%} of the energy exchanged (allowed: {gates.limits.impact_growth:.2%}): "
            "the results are not to be trusted. Use the scheme discrete-gradient, a smaller time.step or a "
            "softer contact.stiffness; gates.accept_energy_growth = true accepts it"
        )
