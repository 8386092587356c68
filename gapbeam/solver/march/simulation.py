"""Simulation of a case, from the model to its motion: model, scheme, plan of the march, seat, start, steps.

    case -> model -> scheme -> plan -> seat -> start -> steps

Runs, studies, predictions, benchmarks and Python sessions all go this way; they differ in what they do with the steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gapbeam.solver.errors import NotConverged
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.python.march import EffectiveOperators, March, Resolution, march
from gapbeam.solver.models.reduction.line_points import refuse_other_faces
from gapbeam.solver.seat.escape import RigidMotions
from gapbeam.solver.seat.static_seat import Seat, find_seat
from gapbeam.solver.start.start_state import start_of_case
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.semi_discrete import VALUE, State

if TYPE_CHECKING:
    from mpi4py import MPI

    from gapbeam.solver.case.case import Case
    from gapbeam.solver.models.model import Model


def march_of_model(model: Model, scheme: TimeScheme) -> March:
    """Return the march of a model: system, law, scheme, steps and their limits."""
    settings, gates = model.case.time, model.case.gates
    limits = () if scheme.conserves_energy else (gates.impact_growth, gates.impact_loss)
    resolution = Resolution(model.contact_duration, *limits)
    return March(
        model.system,
        model.law,
        scheme,
        EffectiveOperators(model.system, scheme),
        model.step,
        round(settings.end / model.step),
        settings.max_halvings,
        settings.max_iterations,
        resolution if settings.adaptive else None,
    )


class Simulation:
    """A model with its time scheme: what is seated and marched.

    Args:
        model: The model.
        scheme: Its time scheme; None: the scheme of the case.

    Attributes:
        model: The model.
        scheme: The time scheme.
        plan: Everything that a march needs but its start; operators are factored when they are first asked for.
    """

    def __init__(self, model: Model, scheme: TimeScheme | None = None) -> None:
        self.model = model
        self.scheme = model.case.time.scheme if scheme is None else scheme
        self.plan: March = march_of_model(model, self.scheme)

    @classmethod
    def of_case(cls, case: Case, comm: MPI.Comm) -> Simulation:
        """Mesh, assemble and reduce a case; errors as in `gapbeam.solver.models.model.build_model`. Collective."""
        from gapbeam.solver.models.model import build_model

        return cls(build_model(case, comm))

    @property
    def case(self) -> Case:
        """The case, its time step a number."""
        return self.model.case

    @property
    def steps(self) -> int:
        """Whole steps up to the end of the case."""
        return self.plan.steps

    def factor(self) -> dict[str, float]:
        """Factor the operator of a whole step; return the wall time of each part, s. Collective."""
        return self.plan.operators.at(self.plan.dt).seconds

    def seat(self) -> Seat:
        """Find the contact equilibrium under the static loads.

        Raises:
            NotConverged: Nothing holds the beam against the static loads.
            UserError: The faces of a model with fewer contact points are not where those of its mesh are.

        Collective.
        """
        model = self.model
        contact = model.system.contact
        refuse_other_faces(model.case, contact, np.zeros(contact.interface.size), "undeformed")
        seat = find_seat(
            model.system,
            model.law,
            model.seat_springs,
            self.scheme.carries_acceleration,
            lambda: RigidMotions.of_model(model),
        )
        values = contact.interface.trace(seat.state.u[VALUE], model.system.operators)
        refuse_other_faces(model.case, contact, values, "at the seat")
        return seat

    def seat_or_failure(self) -> Seat | NotConverged:
        """Return the seat, or why there is none where the case needs none; errors as in `seat` else. Collective."""
        try:
            return self.seat()
        except NotConverged as failure:
            if self.case.analysis.needs_seat:
                raise
            return failure

    def start(self, seat: Seat | NotConverged, left: State | None = None) -> State:
        """Return the state at t = 0 that the case asks for; arguments, errors as in `start_of_case`. Collective."""
        return start_of_case(self.model, seat.state if isinstance(seat, Seat) else None, left)

    def march(self, start: State | Seat | None = None, steps: int | None = None) -> Iterator[Step]:
        """Yield the accepted steps one by one; the loop may be left at any of them.

        The energy gates of the case are not judged: that is what a run does with the steps.

        Args:
            start: Where to start; None: as the case asks for, from a seat found now.
            steps: Number of whole steps; None: up to the end of the case.

        Raises:
            NotConverged: Nothing holds the beam, or a step did not converge at the smallest size.

        Collective.
        """
        if start is None or isinstance(start, Seat):
            start = self.start(self.seat_or_failure() if start is None else start)
        plan = self.plan if steps is None else replace(self.plan, steps=steps)
        return march(plan, start)

    def __repr__(self) -> str:
        model, contact = self.model, self.model.system.contact
        return (
            f"<Simulation: {self.case.title}: {model.dofs} DOFs ({self.case.model.type}), {contact.size} contact "
            f"points, {self.case.time.scheme.type}, {self.steps} steps of {self.plan.dt:.4g} s>"
        )
