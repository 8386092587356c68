"""Energy ledger of a run.

    (T + V + Psi)(t) - (T + V + Psi)(0) = W - D_structural - D_contact - D_friction - D_algorithmic + residual

Every term on the right but the residual is accumulated from what a step did; the left side is measured on the state.
The residual is therefore an independent check: of the linear solver, of the contact solve and of the bookkeeping. The
algorithmic dissipation is what the scheme itself took (positive) or created (negative).

Loops measure each step and call functions of plain numbers here: the step-by-step march calls them as they stand, and
kernels compile them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from gapbeam.solver.compilation.jit import shared
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.contact_solve import RELATIVE_TOLERANCE
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, Stage, State, Step

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
    """Energies and work of a step as a loop measures them, J.

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
    """Return the energy below the resolution of the balance: round-off, and the tolerance of the contact solve.

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
    """Return the residual of the energy balance, for the work of all loads."""
    gained = load_work - energies.structural - energies.contact_loss - energies.algorithmic
    return (total_energy(energies) - energies.start) - (gained - energies.friction_loss)


@shared
def created_energy(energies: Energies, load_work: float) -> float:
    """Return created energy: growth by the scheme, residual, and energy given by contact damping and friction."""
    return energy_residual(energies, load_work) - energies.algorithmic + energies.contact_gain


@shared
def exchanged_energy(energies: Energies) -> float:
    """Return the energy that created energy is compared with."""
    return energies.absolute_work + energies.largest_kinetic


@shared
def relative_growth(created: float, energy: float, round_off: float) -> float:
    """Return created energy relative to an energy; 0 where round-off, which is an estimate, may hide it."""
    if abs(created) <= ESTIMATE * round_off:
        return 0.0
    share: float = created / energy if energy > 0.0 else np.copysign(np.inf, created)
    return share


ENERGIES_IN = attrgetter(*Energies._fields)  # a ledger


@dataclass(frozen=True)
class Ledger:
    """Energies at one time, and works and losses since t = 0, all in J.

    Attributes:
        kinetic: T = v M v / 2, relative to the support.
        strain: V = u K u / 2, with the energy of the restraint and of springs attached to the body.
        contact: Psi, the potential of the contact stiffness.
        start: T + V + Psi at t = 0.
        load_work: Work of each load.
        structural: Loss in Rayleigh damping and in dashpots.
        contact_loss: Loss in contact damping.
        friction_loss: Loss in friction.
        algorithmic: Loss by the scheme; negative: created.
        exchanged: Energy that created energy is compared with: the sum of |work of the loads that are not static|
            over all steps, plus the largest kinetic energy so far.
        contact_gain: Energy gained from contact damping and friction, which only lose energy: created.
        round_off: Energy that the balance cannot resolve: round-off in u K u and the contact solve, and its tolerance.
    """

    kinetic: float
    strain: float
    contact: float
    start: float
    load_work: Array
    structural: float = 0.0
    contact_loss: float = 0.0
    algorithmic: float = 0.0
    exchanged: float = 0.0
    largest_kinetic: float = 0.0
    absolute_work: float = 0.0
    round_off: float = 0.0
    contact_gain: float = 0.0
    friction_loss: float = 0.0

    @property
    def energies(self) -> Energies:
        """The ledger without the work of each load."""
        return Energies._make(ENERGIES_IN(self))

    def with_energies(self, energies: Energies, load_work: Array) -> Ledger:
        """Return the ledger with other energies, and the work of each load with them."""
        return replace(self, load_work=load_work, exchanged=exchanged_energy(energies), **energies._asdict())

    def in_coordinates(self, kinetic: float, strain: float, contact: float) -> Ledger:
        """Return the ledger of the same state in other coordinates, whose round-off is not created energy.

        Args:
            kinetic: T there, J.
            strain: V there, J.
            contact: Psi there, J.
        """
        start = self.start + (kinetic - self.kinetic) + (strain - self.strain) + (contact - self.contact)
        return replace(self, kinetic=kinetic, strain=strain, contact=contact, start=start)

    @property
    def total(self) -> float:
        """T + V + Psi."""
        return total_energy(self.energies)

    @property
    def lost(self) -> float:
        """Energy lost to structural damping, contact and friction."""
        return self.structural + self.contact_loss + self.friction_loss

    @property
    def residual(self) -> float:
        """Residual of the energy balance."""
        return energy_residual(self.energies, float(self.load_work.sum()))

    @property
    def at_rest(self) -> bool:
        """True where all motion is round-off: loads do less work than the balance can resolve."""
        return self.absolute_work <= self.largest_kinetic <= ESTIMATE * self.round_off

    def fed(self, from_rest: bool) -> bool:
        """Return whether loads feed the motion: their work can be resolved, and explains the kinetic energy.

        Args:
            from_rest: Whether all kinetic energy that loads have not brought was there at the start, or comes from
                falling; False: loads may have brought it before the run.
        """
        hidden = ESTIMATE * self.round_off
        return self.largest_kinetic > hidden and self.absolute_work > (self.largest_kinetic if from_rest else hidden)

    @property
    def created(self) -> float:
        """Created energy: growth by the scheme, residual, and energy given by contact damping and friction."""
        return created_energy(self.energies, float(self.load_work.sum()))


def balance_words(ledger: Ledger) -> str:
    """Return the quality of the energy balance, in words."""
    if abs(ledger.residual) <= ledger.round_off or ledger.exchanged == 0.0:
        return "energy accounted for to round-off"
    return f"energy residual {abs(ledger.residual) / ledger.exchanged:.1e} of the energy exchanged"


def open_ledger(system: SemiDiscreteSystem, law: ContactLaw, state: State) -> Ledger:
    """Return the ledger at the start of a run. Collective."""
    return replace(_measured(system, law, state), round_off=round_off(system, law, state))


def restate(system: SemiDiscreteSystem, law: ContactLaw, ledger: Ledger, state: State) -> Ledger:
    """Return the ledger with its energies measured anew on a state. Collective."""
    energies = after_measuring(
        ledger.energies,
        *_kinetic_and_strain(system, state),
        _contact_energy(system, law, state),
        round_off(system, law, state),
    )
    return ledger.with_energies(energies, ledger.load_work)


def enter_step(system: SemiDiscreteSystem, law: ContactLaw, ledger: Ledger, step: Step) -> Ledger:
    """Return the ledger after a step. Collective."""
    old, new, stage = step.old, step.new, step.stage
    moved = new.u[VALUE] - old.u[VALUE]
    pairs = [
        (new.v[VALUE], new.v[MASS]),
        (new.u[VALUE], new.u[STIFFNESS]),
        (moved, system.damping_force(stage.velocity)),
        (moved, stage.inertia_and_elastic),
        *((moved, load.pattern) for load in system.loads),
    ]
    if stage.traction is not None:
        pairs.append(_slip_and_friction(system, moved, stage))
    kinetic, strain, structural, inner, *load_work = system.dots(pairs)
    friction_loss = -float(load_work.pop()) if stage.traction is not None else 0.0
    weights, deeper = system.contact.weights, system.contact.closing(old, new, system.operators)
    works = stage.load_factors * np.array(load_work)
    if system.contact.walls.motions:
        walls = system.contact.turned(stage.opening).walls
        works = works + walls.works(weights * stage.pressure, old.time, new.time, len(works))
    measured = StepEnergies(
        kinetic=0.5 * float(kinetic),
        strain=0.5 * float(strain),
        contact=_contact_energy(system, law, new),
        structural=float(structural),
        inner=float(inner),
        elastic_work=float(weights @ (stage.elastic_pressure * deeper)),
        contact_loss=float(weights @ ((stage.pressure - stage.elastic_pressure) * deeper)),
        friction_loss=friction_loss,
        driven_work=float(works[system.driven].sum()) if len(works) else 0.0,
        unresolved=stage.unresolved,
    )
    return ledger.with_energies(after_step(ledger.energies, measured), ledger.load_work + works)


def created_in_step(system: SemiDiscreteSystem, law: ContactLaw, step: Step) -> tuple[float, float]:
    """Return the energy that a step alone creates, negative where it takes some, and T + V + Psi at its start, J.

    Collective.
    """
    ledger = _measured(system, law, step.old)
    return enter_step(system, law, ledger, step).created, ledger.start


def restraint_energy(system: SemiDiscreteSystem, state: State) -> float:
    """Return the energy in the weak restraint, J. Collective."""
    u = state.u[VALUE]
    return 0.5 * float(system.dots([(u, system.operators.apply_restraint(u))])[0])


def _slip_and_friction(system: SemiDiscreteSystem, moved: Array, stage: Stage) -> tuple[Array, Array]:
    """Return a motion and the friction forces of a balance on the interface DOFs that this rank owns."""
    contact, interface = system.contact.turned(stage.opening), system.contact.interface
    assert stage.traction is not None
    forces = contact.resultant(np.zeros(contact.size), contact.weights[:, None] * stage.traction)
    return moved[interface.owned], forces[interface.slots]


def _measured(system: SemiDiscreteSystem, law: ContactLaw, state: State) -> Ledger:
    kinetic, strain = _kinetic_and_strain(system, state)
    contact = _contact_energy(system, law, state)
    return Ledger(kinetic, strain, contact, kinetic + strain + contact, np.zeros(len(system.loads)))


def _kinetic_and_strain(system: SemiDiscreteSystem, state: State) -> tuple[float, float]:
    doubled = system.dots([(state.v[VALUE], state.v[MASS]), (state.u[VALUE], state.u[STIFFNESS])])
    return 0.5 * float(doubled[0]), 0.5 * float(doubled[1])


def round_off(system: SemiDiscreteSystem, law: ContactLaw, state: State) -> float:
    """Return the energy that the balance cannot resolve: round-off in u K u, and the contact solve, J. Collective."""
    terms = state.u[VALUE] * system.operators.stiffness_round_off(state.u[VALUE])
    squares, strain = system.dots([(terms, terms), (state.u[VALUE], state.u[STIFFNESS])])
    contact, interface = system.contact, system.contact.interface
    added_up = contact.added_up(interface.trace(np.abs(state.u[VALUE]), system.operators))
    hidden = np.finfo(float).eps * contact.weights * state.pressure * added_up
    return unresolved_energy(
        float(squares) + float(hidden @ hidden), 0.5 * float(strain), _contact_energy(system, law, state)
    )


def _contact_energy(system: SemiDiscreteSystem, law: ContactLaw, state: State) -> float:
    return float(system.contact.weights @ law.yielded_by(state.plastic_set).potential(state.depth))
