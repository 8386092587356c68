"""Other ways to compute a case: changes of it that leave its answer as it is, exactly or within its stated error.

Cases that start from the last state of an earlier run take that state from a march in memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil, log
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from mpi4py import MPI

import gapbeam
from gapbeam.solver.case.analysis_table import Periodic, Transient
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.periodic_checks import factor_needed
from gapbeam.solver.case.solution_tables import FullModel, ReducedModel
from gapbeam.solver.integrators.scheme_choice import scheme_names
from gapbeam.solver.loads.attachments import ElasticJoint, Fluid
from gapbeam.solver.loads.places import LineForce, PointForce
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.resume import left_state
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged
from gapbeam.studies.error_estimate.companions import FINEST_MODES, FINEST_SHAPES
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials.refined_mesh import mesh_keys
from gapbeam.studies.trials.response import TrialResponse, respond
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
    simulation = Simulation(model)
    if earlier_folder(simulation.case) is None:
        found: State = seated(model).state
        return found
    seat = simulation.seat_or_failure()
    if not in_memory:
        return simulation.start(seat, left_state(simulation.case, model, Path(), MPI.COMM_SELF))
    first = gapbeam.model(before(simulation.case)).model
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


FINER = 0.25  # of the step
ALL_MODES = 1000
IN_MEMORY = "in memory"
OF_FORCE = ("amplitude", "scale", "offset", "mass", "stiffness", "damping", "preload")
"""Keys of loads at a point that are forces, or forces over what the load moves with."""
ROUND_OFF, ITERATIONS = 1.0e-6, 1.0e-4  # of the size of the motion, in its first part


@dataclass(frozen=True)
class Way:
    """Another way to compute a case.

    Attributes:
        name: Name of the way.
        changes: Keys that it replaces.
        exact: Largest difference of the motion relative to its size, before chaos has multiplied it; None: the
            figures differ by no more than their stated errors.
        step_by_step: Whether the march in Python replaces the compiled one.
        forces: Contact forces of this way over those of the case.
        in_memory: Whether an earlier run, whose last state the case starts from, is marched without its files.
    """

    name: str
    changes: Mapping[str, Any]
    exact: float | None = None
    step_by_step: bool = False
    forces: float = 1.0
    in_memory: bool = False


def ways_of(case: Case) -> list[Way]:
    """Return the other ways to compute a case."""
    if isinstance(case.analysis, Periodic):
        return list(_of_periodic(case))
    if earlier_folder(case) is not None:  # its DOFs are those of the earlier run
        return [Way(IN_MEMORY, {}, ROUND_OFF, in_memory=True), *step_by_step(case), *other_columns(case)]
    return [way for found in WAYS for way in found(case)]


def _of_periodic(case: Case) -> Iterator[Way]:
    """A stable response is where a long march ends."""
    yield Way("long march", {"analysis": {"type": "transient"}, **_plain(case)})


def _plain(case: Case) -> dict[str, Any]:
    """Return keys that every reference has: no limits, records as those of the run."""
    return {"gates.accept_energy_growth": True, "gates.accept_energy_loss": True, "title": case.title}


def step_by_step(case: Case) -> Iterator[Way]:
    """Compiled loop against the march in Python."""
    contact = case.contact
    slow = case.friction is not None or not contact.formulation.follows_the_law or case.time.adaptive
    if not isinstance(case.model, FullModel) and not slow:
        yield Way("step by step", {}, ROUND_OFF, step_by_step=True)


def double_width(case: Case) -> Iterator[Way]:
    """A slice twice as wide under twice the forces moves as before."""
    if case.mesh.dimension == 3 or case.mesh.file is not None:
        return
    restraint = {"axial": case.restraint.axial, "lateral": case.restraint.lateral}
    changes: dict[str, Any] = {f"restraint.{key}": 2.0 * value for key, value in restraint.items() if value != "auto"}
    changes["beam.width"] = 2.0 * case.beam.width
    for load in case.load:
        if not isinstance(load.place, PointForce | LineForce):
            continue
        if (spectrum := getattr(load, "spectrum", None)) is not None:  # twice the force is four times its square
            changes[f"load.{load.name}.spectrum.scale"] = 4.0 * spectrum.scale
        keys = [key for key in OF_FORCE if key in type(load).model_fields]
        changes |= {f"load.{load.name}.{key}": 2.0 * getattr(load, key) for key in keys}
    for mass in case.mass:
        changes |= {f"mass.{mass.name}.{key}": 2.0 * getattr(mass, key) for key in ("mass", "rotary_inertia")}
    fluids: tuple[Fluid, ...] = case.fluid
    for fluid in fluids:
        figures = ("added_mass", "displaced_mass", "damping")
        changes |= {f"fluid.{fluid.name}.{key}": 2.0 * getattr(fluid, key) for key in figures}
    for joint in case.joint:
        if isinstance(joint, ElasticJoint):
            for table in ("stiffness", "damping"):
                values = getattr(joint, table).model_dump().items()
                changes |= {f"joint.{joint.name}.{table}.{key}": 2.0 * value for key, value in values}
    for one in case.layout.supports:
        if one.body is not None:
            forces = ("mass", "stiffness", "damping")
            changes |= {f"support.{one.name}.body.{key}": 2.0 * getattr(one.body, key) for key in forces}
    if case.contact.points is not None:
        if isinstance(case.contact.stiffness, float):
            changes["contact.stiffness"] = 2.0 * case.contact.stiffness
        changes["contact.damping"] = 2.0 * case.contact.damping
        law = case.contact.law.model_dump()
        if "damping" in law:
            changes["contact.law"] = law | {"damping": 2.0 * law["damping"]}
    yield Way("double width", changes, ROUND_OFF, forces=2.0)


def other_columns(case: Case) -> Iterator[Way]:
    """Responses to contact forces that are kept, against those that are solved for in every step."""
    if isinstance(case.model, FullModel) and case.solver.effective != "iterative":
        other = "drop" if case.solver.columns != "drop" else "keep"
        yield Way(f"columns: {other}", {"solver.columns": other}, ROUND_OFF)


def iterations(case: Case) -> Iterator[Way]:
    """Conjugate gradients against a factor."""
    needed = factor_needed(case.model, case.support, case.contact, case.time, case.analysis)
    if isinstance(case.model, FullModel) and needed is None:
        other = "factor" if case.solver.effective == "iterative" else "iterative"
        yield Way(f"solver: {other}", {"solver.effective": other, "solver.tolerance": 1.0e-12}, ITERATIONS)


def all_modes(case: Case) -> Iterator[Way]:
    """A basis of all modes and all interface DOFs against the mesh."""
    contact, plane = case.contact, case.mesh.dimension == 2
    other = contact.formulation.stress_terms is not None or contact.mass != "consistent" or case.time.scheme.explicit
    if isinstance(case.model, FullModel) and plane and not other and case.solver.effective != "iterative":
        basis = {"type": "reduced", "modes": ALL_MODES, "contact": "all"}
        yield Way("all modes", {"model": basis}, ITERATIONS)


def finer(case: Case) -> Iterator[Way]:
    """A quarter of the step, half the cells, the richest basis."""
    yield Way("finer", _finer(case))


def other_scheme(case: Case) -> Iterator[Way]:
    """A quarter of the step, and a scheme of another family."""
    conserving = [name for name in scheme_names("conserves_energy") if name in scheme_names("has_period_map")]
    midpoint = [name for name in scheme_names("has_period_map") if name not in conserving]
    others = midpoint if case.contact.formulation.without_potential else [*conserving, *midpoint]
    others = [name for name in others if name != case.time.scheme.type]
    if not others:
        return
    changes = _finer(case) | {"time.scheme": others[0]}
    yield Way(f"scheme: {others[0]}", changes)


def whole_mesh(case: Case) -> Iterator[Way]:
    """The mesh instead of a basis, of beam elements or of a rigid body."""
    give_way = any(one.body is not None for one in case.layout.supports)  # a mesh knows supports that stand still
    if not isinstance(case.model, FullModel) and case.mesh.dimension == 2 and not give_way:
        yield Way("whole mesh", {"model": "full"})


def other_formulation(case: Case) -> Iterator[Way]:
    """Another exact formulation of contact."""
    formulation = case.contact.formulation
    if formulation.follows_the_law or case.time.scheme.impulses or case.time.scheme.explicit:
        return
    exact = {"type": "augmented-lagrangian", "penetration": 1.0e-5}
    other: Any = "unilateral" if formulation.type == exact["type"] else exact
    changes = {"contact.formulation": other, "contact.stiffness": "auto", "contact.mass": "consistent"}
    yield Way(f"formulation: {'unilateral' if other == 'unilateral' else exact['type']}", changes)


def _finer(case: Case) -> dict[str, Any]:
    """Return the keys of a finer step, mesh and basis; `time.step` is added once the run's step is known."""
    changes = _plain(case)
    reducible = case.contact.formulation.follows_the_law and case.friction is None
    if case.contact.mass == "redistributed" and reducible:
        changes["contact.mass"] = "consistent"
    if case.mesh.dimension == 2 and case.mesh.file is None:
        changes |= mesh_keys(case, 0.5, even=case.mesh.degree == 1)
    if reducible and case.mesh.dimension == 2:
        modes = max(FINEST_MODES, case.model.modes) if isinstance(case.model, ReducedModel) else FINEST_MODES
        changes["model"] = {"type": "reduced", "modes": modes, "shapes": FINEST_SHAPES}
        changes["solver.effective"] = "auto"
        if case.time.scheme.explicit:
            changes["time.scheme"] = "discrete-gradient"
    return changes


WAYS: tuple[Callable[[Case], Iterator[Way]], ...] = (
    step_by_step,
    double_width,
    other_columns,
    iterations,
    all_modes,
    finer,
    finer,
    other_scheme,
    whole_mesh,
    other_formulation,
)


PERIODS, MOST_PERIODS = 60, 3000  # of the forcing: a march that has settled, or does not settle; of a mesh the fewer
SETTLES = 1.0e-6  # share of a disturbance that is left
SLOWER = 0.5  # of the step, for meshes
FIRST_PART, FEWEST = 0.25, 20  # of a motion that is the same but for round-off, before chaos multiplies that; records


class NoReferenceError(Exception):
    """The other way has no answer, and why."""


def motion_by(way: Way, case: Case, run: MotionRecord, step: float, computed: dict[str, float]) -> MotionRecord:
    """Return the motion of a case by another way, on the times of its run.

    Args:
        way: The other way.
        case: The case.
        run: The motion of the run.
        step: Step of the run, s.
        computed: Values that the run computed, by key; the contact stiffness stays as it was.

    Raises:
        NoReferenceError: The march of the other way does not pass.
    """
    share = 1.0
    if way.exact is None and not way.name.startswith(("whole mesh", "formulation")):
        share = FINER if way.changes.get("model", case.model.type) != "full" else SLOWER
    changes: dict[str, Any] = {**way.changes, "gates.accept_energy_growth": True}
    changes |= {
        "time.step": step * share,
        "output.history_interval": run.interval,
        "output.fields_interval": None,
        "output.stress": False,
    }
    takes = case.contact.formulation.takes_stiffness
    if takes and "contact.stiffness" in computed and "contact.stiffness" not in changes:
        changes["contact.stiffness"] = computed["contact.stiffness"]
        if way.name == "double width" and case.contact.points is not None:
            changes["contact.stiffness"] *= 2.0
    model = gapbeam.model(case, changes).model
    end = run.end if way.exact is None else min(run.end, max(FIRST_PART * run.end, FEWEST * run.interval))
    with _step_by_step(way.step_by_step):
        response = respond(model, begun(model, way.in_memory), round(end / model.step), run.interval)
    return MotionRecord.of_records(_passed(response).history, response.labels, bends_in_two_planes(case))


def long_march(
    way: Way,
    case: Case,
    step: float,
    computed: dict[str, float],
    multiplier: float,
    varied: dict[str, float] | None = None,
) -> tuple[MotionRecord, float]:
    """March a case for many forcing periods; return the last period, and how far the motion is from repeating.

    That is the largest change of a displacement over the period, relative to its range.

    Args:
        way: The other way.
        case: The case.
        step: Step of the run, s; here the nearest to it that divides the forcing period.
        computed: Values that the run computed, by key; the contact stiffness stays as it was.
        multiplier: The largest one of the response, from which follows how long a march takes to settle.
        varied: Keys of the case with other values, such as those of a point of a curve.

    Raises:
        NoReferenceError: The march does not pass.
    """
    varied = varied or {}
    frequency = next(load.forcing_frequency for load in case.load if load.forcing_frequency is not None)
    frequency = next((value for key, value in varied.items() if key.endswith(".frequency")), frequency)
    periods = getattr(case.analysis, "periods", 1)
    whole = ceil(1.0 / (frequency * step) - 1.0e-6)
    step = 1.0 / (frequency * whole)
    changes = dict(way.changes) | {
        "time.step": step,
        "output.history_interval": None,
        "output.fields_interval": None,
        "output.stress": False,
    }
    changes |= varied
    if case.contact.formulation.takes_stiffness and "contact.stiffness" in computed.keys() - varied.keys():
        changes["contact.stiffness"] = computed["contact.stiffness"]
    model = gapbeam.model(case, changes).model
    rises = ceil(frequency * max((load.rise_time for load in case.load), default=0.0))
    needed = ceil(log(SETTLES) / log(multiplier)) * periods if 0.0 < multiplier < 1.0 else PERIODS
    most = PERIODS if isinstance(case.model, FullModel) else MOST_PERIODS
    response = respond(model, seated(model).state, (min(max(PERIODS, needed), most) + rises) * whole, step)
    motion = MotionRecord.of_records(_passed(response).history, response.labels, bends_in_two_planes(case))
    length = periods / frequency
    last = motion.between(motion.end - length, motion.end)
    before = motion.between(motion.end - 2.0 * length, motion.end - length)
    ranges = np.ptp(last.displacement, axis=0)
    change = np.abs(last.displacement - before.displacement).max(axis=0) / np.maximum(ranges, 1.0e-30)
    return last, float(change.max(initial=0.0))


def _passed(response: TrialResponse) -> TrialResponse:
    if response.verdict != "passed":
        raise NoReferenceError(f"{response.verdict}: {response.message}")
    return response


@contextmanager
def _step_by_step(wanted: bool) -> Iterator[None]:
    """March in Python where the compiled loop would."""
    if not wanted:
        yield
        return
    with patch("gapbeam.solver.march.simulation.why_not_compiled", return_value="another way"):
        yield
