"""Fidelity levels of a case, and cost and figures of each level, measured in a process of its own.

Levels are models, meshes, degrees, bases, steps and schemes of one and the same beam.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, prod, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.signals.signal import Signal, SignalError
from gapbeam.postprocess.signals.spectra import CYCLE
from gapbeam.postprocess.signals.steady_figures import RAW, WindowFigure, figures_over, motions_of, steady
from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.solution_tables import BeamModel
from gapbeam.solver.messages.errors import CaseError, RunError, UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.schema.record_table import SMOOTHING_WINDOW
from gapbeam.solver.system.semi_discrete import State
from gapbeam.studies.trials.refined_mesh import mesh_keys
from gapbeam.studies.trials.response import VERDICTS, TrialResponse, respond
from gapbeam.studies.trials.starts import KeptBody, kicked, seated

WARM_UP = 20  # steps that are not timed: code is loaded and memory touched
KEPT = ("displacement", "velocity", "acceleration_absolute", "contact_force", "impulse")
_SAME = 1e-6


class LevelJob(NamedTuple):
    """Job that measures a level.

    Attributes:
        case: Path of the case file.
        changes: Keys to replace.
        periods: Forcing periods from the start that are followed.
        cycles: Forcing periods of the long marches after which figures are taken; 0: no long march.
        transient: Forcing periods that a long march passes before.
        starts: Long marches: from the seat, and from kicks.
        seed: Seed of the kicks.
        span: Time from the start over which figures are taken in windows, s; 0: only those of the periods.
    """

    case: Path
    changes: Mapping[str, Any]
    periods: int
    cycles: int = 0
    transient: int = 0
    starts: int = 1
    seed: int = 0
    span: float = 0.0


@dataclass
class MeasuredLevel:
    """Cost and answers of a fidelity level.

    Attributes:
        verdict: "passed", or what went wrong.
        message: The error, where there was one.
        dofs: DOFs that are marched.
        mesh_dofs: DOFs of the mesh.
        step: s.
        set_up: Wall time before the march, s.
        per_second: Wall time of a simulated second, s.
        memory: Largest resident memory of the process up to then, bytes.
        residual: Residual of the energy balance relative to the energy exchanged.
        frequency: Frequency of the forcing, Hz.
        records: Records of the motion from the seat over the periods followed, as in `response.TrialResponse`.
        labels: Names along their labeled dimensions.
        span: Time from the seat that `windows` cover, s; 0 without them.
        windows: Figures from the seat on, window by window as in `windows_over`, by name.
        smoothing: Window of the smoothed acceleration, s.
        words: Kind of response of every long march.
        long: Figures of the windows of all long marches together, by name.
    """

    verdict: str = "passed"
    message: str = ""
    dofs: int = 0
    mesh_dofs: int = 0
    step: float = 0.0
    set_up: float = 0.0
    per_second: float = 0.0
    memory: int = 0
    residual: float = 0.0
    frequency: float = 0.0
    records: dict[str, np.ndarray] = field(default_factory=dict)
    labels: dict[str, tuple[str, ...]] = field(default_factory=dict)
    span: float = 0.0
    smoothing: float = 0.0
    windows: dict[str, np.ndarray] = field(default_factory=dict)
    words: list[str] = field(default_factory=list)
    long: dict[str, WindowFigure] = field(default_factory=dict)

    def figures(self, periods: int) -> dict[str, float]:
        """The figures of the first forcing periods, by name as in `steady_figures.steady`."""
        quantities, _, _ = figures_over(self._history(periods), self.frequency, periods)
        return {name: one.mean for name, one in quantities.items()}

    def waves(self, periods: int) -> dict[str, Signal]:
        """Displacement and smoothed acceleration of the probes over the first forcing periods."""
        history = self._history(periods)
        motions = {probe: motions_of(history, probe, self.frequency, []) for probe in self.labels["probe"]}
        return {
            f"{probe} {name}": wave for probe, waves in motions.items() for name, wave in waves.items() if name != RAW
        }

    def _history(self, periods: int) -> xr.Dataset:
        records = _up_to(self.records, periods / self.frequency, self.frequency)
        return as_history(records, self.labels).assign_attrs({SMOOTHING_WINDOW: self.smoothing})


def windows_over(history: xr.Dataset, frequency: float, span: float) -> dict[str, np.ndarray]:
    """Return the figures of a record, window by window, by name as in `steady_figures.steady`.

    The first window begins where the record does, the others follow each other up to its end. A window holds 12 forcing
    periods, or all those of a shorter record; the first two overlap where the record is not a whole number of windows.

    Args:
        history: The records, up to the last one within the span.
        frequency: Frequency of the forcing, Hz.
        span: s, at least one forcing period. It decides how many windows there are: the same for all steps.
    """
    times = np.asarray(history["time"].values)
    periods = max(1, int(span * frequency + _SAME))
    width = min(CYCLE, periods)
    begin = np.flatnonzero(times <= times[0] + (width + _SAME) / frequency)
    first, _, _ = figures_over(history.isel(time=begin), frequency, width)
    later, _, _ = figures_over(history, frequency, width, periods // width)
    return {name: np.concatenate([first[name].values, one.values]) for name, one in later.items()}


def measure(jobs: Sequence[LevelJob]) -> list[MeasuredLevel]:
    """Measure fidelity levels in turn; those of one body set it up once, and its time counts for each of them."""
    kept = KeptBody()
    return [_measure(job, kept) for job in jobs]


def _measure(job: LevelJob, kept: KeptBody) -> MeasuredLevel:
    """Measure a fidelity level; a failure becomes its result."""
    found = MeasuredLevel()
    try:
        case = read_case(job.case, job.changes)
        model, (found.smoothing, _) = kept.model(case), smoothing_window(case)
        clock = time.perf_counter()
        seat = seated(model).state
        found.set_up = kept.seconds + time.perf_counter() - clock
        respond(model, seat, WARM_UP)
        found.dofs, found.mesh_dofs, found.step = model.dofs, model.mesh_dofs, model.step
        _follow(job, model, case, seat, found)
        if job.cycles and found.verdict == "passed":
            _settle(job, model, case, seat, found)
    except (CaseError, RunError, SignalError) as error:
        found.verdict, found.message = VERDICTS.get(type(error), "failed"), str(error)
    found.memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return found


def _up_to(records: Mapping[str, np.ndarray], end: float, frequency: float) -> dict[str, np.ndarray]:
    """Return records up to a time, s, within a millionth of a forcing period."""
    inside = records["time"] <= end + _SAME / frequency
    return {name: values[inside] for name, values in records.items()}


def _march(model: Model, case: Case, start: State, seconds: float, found: MeasuredLevel) -> TrialResponse:
    interval = max(case.output.history_interval or model.step, model.step)
    steps = ceil(seconds / model.step - _SAME)
    response = respond(model, start, steps, interval)
    if response.verdict != "passed":
        found.verdict, found.message = response.verdict, response.message
    return response


def _follow(job: LevelJob, model: Model, case: Case, seat: State, found: MeasuredLevel) -> None:
    """Follow the motion from the seat, over the forcing periods and over the span."""
    (frequency,) = model.forcing
    followed = job.periods / frequency
    response = _march(model, case, seat, max(followed, job.span), found)
    found.per_second = response.seconds / (response.steps * model.step)
    found.residual = response.residual
    if found.verdict != "passed":
        return
    found.frequency, found.labels = frequency, response.labels
    records = {name: response.history[name] for name in ("time", *KEPT)}
    found.records = _up_to(records, followed, frequency)
    if job.span > 0.0:
        found.span = job.span
        history = as_history(_up_to(records, job.span, frequency), found.labels)
        history = history.assign_attrs({SMOOTHING_WINDOW: found.smoothing})
        found.windows = windows_over(history, frequency, job.span)


def _settle(job: LevelJob, model: Model, case: Case, seat: State, found: MeasuredLevel) -> None:
    """March for long from every start, and take figures over windows after the transient."""
    (frequency,) = model.forcing
    pooled: dict[str, list[np.ndarray]] = {}
    units: dict[str, str] = {}
    for number in range(job.starts):
        start = seat if number == 0 else kicked(model, case.load, number, job.seed).state
        response = _march(model, case, start, (job.transient + job.cycles) / frequency, found)
        if response.verdict != "passed":
            return
        history = as_history(response.history, response.labels).assign_attrs({SMOOTHING_WINDOW: found.smoothing})
        settled = steady(history, frequency, start.time + job.transient / frequency)
        found.words.append(settled.word)
        for name, one in settled.quantities.items():
            pooled.setdefault(name, []).append(one.values)
            units[name] = one.unit
    found.long = {name: WindowFigure(units[name], np.concatenate(values)) for name, values in pooled.items()}


REFINEMENT = sqrt(2.0)  # between the meshes of the reference
FINEST = 0.75  # cell size of the reference over the case's
RICH = {"type": "reduced", "modes": 40, "shapes": 19}
LEAN = {"type": "reduced", "modes": 10, "shapes": 5}
USUAL = {"type": "reduced"}
FULL = {"type": "full"}


@dataclass(frozen=True)
class Level:
    """One way to compute a case.

    Attributes:
        name: Name in words.
        changes: Keys of the case that it replaces; None removes one.
        size: DOFs of its mesh, roughly.
        full: Whether it marches all DOFs of a mesh, which costs most.
        dimension: Dimension of its mesh, 2 or 3.
    """

    name: str
    changes: Mapping[str, Any]
    size: float = 0.0
    full: bool = False
    dimension: int = 3

    @property
    def body(self) -> str:
        """The same for fidelity levels that share a mesh and a model."""
        return repr([value for key, value in self.changes.items() if key.startswith(("mesh.", "model"))])


@dataclass(frozen=True)
class LevelPlan:
    """Levels of a trade-off for a case.

    Attributes:
        fixed: Keys that are the same on all fidelity levels: the contact stiffness, which must not follow the mesh.
        reference: The finest that is affordable.
        meshes: The same on two coarser meshes, the finer one first.
        steps: The same with twice and four times the step.
        basis: The same with the usual basis.
        levels: The others, from cheap to dear.
        notes: Notes before the study.
    """

    fixed: Mapping[str, Any]
    reference: Level
    meshes: tuple[Level, Level]
    steps: tuple[Level, Level]
    basis: Level
    levels: tuple[Level, ...]
    notes: tuple[str, ...]

    @property
    def family(self) -> tuple[Level, ...]:
        """The reference and the parts of its uncertainty."""
        return (self.reference, *self.meshes, *self.steps, self.basis)


def plan_levels(case: Case, coarser: float = 1.0) -> LevelPlan:
    """Return the fidelity levels of a case.

    Args:
        case: The case; the finest fidelity levels have its dimension.
        coarser: Factor by which the meshes of the reference are coarser than they could be.

    Raises:
        UserError: A mesh file, which cannot be refined, or a formulation that reduced models cannot do.
        CaseError: Step and contact do not go together.
    """
    if case.mesh.file is not None:
        raise UserError(
            f"mesh.file = {case.mesh.file} cannot be refined; expected a mesh that gapbeam builds, for a trade-off"
        )
    if isinstance(case.analysis, Periodic):
        raise UserError('analysis.type = "periodic": a trade-off marches; expected "transient"')
    if not case.contact.formulation.follows_the_law:
        raise UserError(
            f"contact.formulation = {case.contact.formulation.type}: the trade-off marches reduced models, which take "
            "contact stiffness; expected penalty"
        )
    bodies = [one.name for one in case.layout.supports if one.body is not None]
    if bodies:
        raise UserError(
            f"support.{bodies[0]}.body: the trade-off compares with a full model, whose supports stand still; expected "
            "supports without body"
        )
    beam = KeptBody().model(case.model_copy(update={"model": BeamModel(type="beam")}))
    fixed, notes = _fixed(case, beam)
    step, dimension = beam.step, case.mesh.dimension
    finest = FINEST * coarser

    def level(
        name: str, model: Mapping[str, Any], refinement: float = 1.0, in_plane: bool = False, **more: Any
    ) -> Level:
        even = more.get("mesh__degree", case.mesh.degree) == 1
        changes: dict[str, Any] = {"model": dict(model), **mesh_keys(case, refinement, in_plane, even)}
        changes |= {key.replace("__", "."): value for key, value in more.items()}
        if changes.get("time.step", step) > step:
            changes["output.history_interval"] = None  # records are then as far apart as steps
        return Level(name, changes, _dofs(case, changes), model["type"] == "full", 2 if in_plane else dimension)

    solid = f"{dimension}D"
    reference = level(f"reduced {solid}, rich basis, cells x {finest:.2f}, step / 4", RICH, finest, time__step=step / 4)
    coarse = [
        level(f"reduced {solid}, rich basis, cells x {c:.2f}, step / 4", RICH, c, time__step=step / 4)
        for c in (finest * REFINEMENT, finest * REFINEMENT**2)
    ]
    steps = [
        level(f"reduced {solid}, rich basis, cells x {finest:.2f}, {word}", RICH, finest, time__step=step / part)
        for word, part in (("step / 2", 2.0), ("the step", 1.0))
    ]
    basis = level(f"reduced {solid}, cells x {finest:.2f}, step / 4", USUAL, finest, time__step=step / 4)
    levels = [] if case.output.stress else [level("rigid body", {"type": "rigid"})]
    levels += [
        level("beam, 24 elements", {"type": "beam", "elements": 24}),
        level("beam, 102 elements", {"type": "beam", "elements": 102}),
    ]
    if case.profile.sliceable(case.beam.width):
        levels += [
            level("reduced 2D, coarse, lean basis", LEAN, 2.0, in_plane=True),
            level("reduced 2D", USUAL, in_plane=True),
            level("reduced 2D, degree 1", USUAL, in_plane=True, mesh__degree=1),
        ]
    if dimension == 3:
        levels += [
            level("reduced 3D, coarse, lean basis", LEAN, 2.0),
            level("reduced 3D, coarse", USUAL, 2.0),
            level("reduced 3D", USUAL),
        ]
    own = f"reduced {solid}"
    levels += [
        level(f"{own}, step x 2", USUAL, time__step=2.0 * step),
        level(f"{own}, step / 2", USUAL, time__step=step / 2.0),
        level(f"{own}, implicit-midpoint", USUAL, time__scheme={"type": "implicit-midpoint"}),
        level(f"{own}, generalized-alpha", USUAL, time__scheme={"type": "generalized-alpha", "rho_inf": 0.5}),
    ]
    if case.profile.sliceable(case.beam.width):
        levels += [
            level("full 2D, coarse", FULL, 2.0, in_plane=True),
            level("full 2D", FULL, in_plane=True),
            level("full 2D, degree 1", FULL, in_plane=True, mesh__degree=1),
        ]
    if dimension == 3:
        if not any(one.beam.section.round for one in case.profile.pieces):  # curved cells are quadratic
            levels.append(level("full 3D, degree 1", FULL, mesh__degree=1))
        levels += [
            level("full 3D, coarse", FULL, 2.0),
            level("full 3D", FULL),
        ]
    return LevelPlan(fixed, reference, (coarse[0], coarse[1]), (steps[0], steps[1]), basis, tuple(levels), tuple(notes))


def _fixed(case: Case, beam: Model) -> tuple[dict[str, Any], list[str]]:
    """Return the keys that all fidelity levels share, and remarks on them."""
    fixed: dict[str, Any] = {"output.fields_interval": None, "output.stress": False}
    notes = []
    computed = {default.key: default for default in beam.defaults}
    if case.contact.stiffness == "auto" and "contact.stiffness" in computed:
        chosen = computed["contact.stiffness"]
        fixed["contact.stiffness"] = chosen.value
        notes.append(
            f"contact.stiffness = {chosen.value:.4g} {chosen.unit} on all fidelity levels, "
            "as computed for the mesh of the case"
        )
    fixed["output.history_interval"] = case.output.history_interval or beam.step
    return fixed, notes


def _dofs(case: Case, changes: Mapping[str, Any]) -> float:
    """Return about how many DOFs a mesh has."""
    dimension, degree = changes["mesh.dimension"], changes.get("mesh.degree", case.mesh.degree)
    supported = case.layout.length
    free = case.beam.length - supported
    along = supported / changes["mesh.support_size"] + free / changes["mesh.size"]
    cells = [along, changes["mesh.cells_through_thickness"], changes["mesh.cells_across_width"]][:dimension]
    return float(dimension * prod(degree * count + 1.0 for count in cells))
