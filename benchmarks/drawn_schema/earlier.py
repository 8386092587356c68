"""Cases that start from the last state of an earlier run: that run, and its last state from a march in memory."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI

import gapbeam
from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.resume import left_state
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated


def earlier_folder(case: Case) -> str | None:
    """Return the results folder of the run that a case starts from; None: it starts at a pose."""
    return case.analysis.state if isinstance(case.analysis, Transient) else None


def before(case: Case) -> Case:
    """Return the case of the earlier run: the same beam under the same loads, from its seat."""
    return gapbeam.read_case(case, {"analysis": {"type": "transient"}, "output.keep_checkpoint": True})


def begun(model: Model, in_memory: bool) -> State:
    """Return the state at t = 0 of a model: its pose, or the last state of the earlier run.

    Args:
        model: The model.
        in_memory: March the earlier run here, without its files.
    """
    if earlier_folder(model.case) is None:
        return seated(model).state
    simulation = Simulation(model)
    seat = simulation.seat_or_failure()
    if not in_memory:
        return simulation.start(seat, left_state(model, Path(), MPI.COMM_SELF))
    first = gapbeam.model(before(model.case)).model
    end = respond(first, seated(first).state, Simulation(first).steps).end
    assert end is not None
    contact, operators = model.system.contact, model.system.operators
    return simulation.start(
        seat,
        State(
            0.0,
            imaged(operators, end.u[VALUE].copy()),
            imaged(operators, end.v[VALUE].copy()),
            contact.depth(contact.interface.trace(end.u[VALUE], operators), 0.0),
            end.pressure,
            touch_speed=end.touch_speed,
            lagged=end.lagged,
            traction=end.traction,
            plastic_set=end.plastic_set,
        ),
    )
