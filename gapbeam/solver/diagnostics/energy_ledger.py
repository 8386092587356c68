"""The energy ledger of a run.

    (T + V + Psi)(t) - (T + V + Psi)(0) = W - D_structural - D_contact - D_friction - D_algorithmic + residual

Every term on the right but the residual is accumulated from what a step did (`ledger_update`, for every loop); the
left side is measured on the state. The residual is therefore an independent check: of the linear solver, of the contact
solve and of the bookkeeping. The algorithmic dissipation is what the scheme itself took (positive) or created
(negative).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.diagnostics.ledger_update import (
    ESTIMATE,
    Energies,
    StepEnergies,
    after_measuring,
    after_step,
    created_energy,
    energy_residual,
    exchanged_energy,
    total_energy,
    unresolved_energy,
)
from gapbeam.solver.system.accepted_step import Stage, Step
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import MASS, STIFFNESS, VALUE, SemiDiscreteSystem, State

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
        exchanged: What created energy is measured against: the sum of |work of the loads that are not static|
            over all steps, plus the largest kinetic energy so far.
        contact_gain: What steps took out of contact damping and friction, which only lose energy: created.
        round_off: What the balance cannot resolve: round-off in u K u and in the contact solve, and its tolerance.
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
        """What structural damping, contact and friction took."""
        return self.structural + self.contact_loss + self.friction_loss

    @property
    def residual(self) -> float:
        """What is left of the balance."""
        return energy_residual(self.energies, float(self.load_work.sum()))

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves but by round-off: loads bring less than that, and the balance cannot resolve it."""
        return self.absolute_work <= self.largest_kinetic <= ESTIMATE * self.round_off

    def fed(self, from_rest: bool) -> bool:
        """Return whether loads feed the motion: their work can be resolved, and explains the kinetic energy.

        Args:
            from_rest: Whether all kinetic energy that loads have not brought was there at the start, or is that of
                falling; False: loads may have brought it before the run.
        """
        hidden = ESTIMATE * self.round_off
        return self.largest_kinetic > hidden and self.absolute_work > (self.largest_kinetic if from_rest else hidden)

    @property
    def created(self) -> float:
        """Energy that came from nowhere: algorithmic growth, residual, and what contact damping and friction gave."""
        return created_energy(self.energies, float(self.load_work.sum()))


def balance_words(ledger: Ledger) -> str:
    """Return how well the energy balance closes."""
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
    """Return what the balance of a state cannot resolve: round-off in u K u, and the contact solve, J. Collective."""
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
