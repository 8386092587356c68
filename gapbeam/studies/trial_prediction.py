"""Prediction of the cost of a run, from a trial of it on this machine.

    total = set-up + seat + once + steps * per_step + fields * per_field + errors

Everything that a run does before its march is done and timed, then a few steps are marched with all their output, from
the seat with the loads at their full amplitude, so that contact opens and closes as it will. Nothing is kept for the
next time: what another day or another machine measured would not hold.

A run that is too large to try out is tried out on coarser meshes of the same beam, and scaled,

    cost(n) = cost(n2) (n / n2)^b,    b = ln(cost(n2) / cost(n1)) / ln(n2 / n1)

for each part of the set-up, for a step, and for the memory above that of a process that has done nothing.
"""

from __future__ import annotations

import gc
import shutil
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import log
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import FullModel
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.memory.memory_check import memory_of
from gapbeam.solver.messages.errors import Interrupted, RunError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.models.energy_creation import refuse_energy_creators
from gapbeam.solver.models.model import Model, build_model, model_of
from gapbeam.solver.run.interruption import Interruption, Signals
from gapbeam.solver.run.output.hdf5_files import AT_ONCE
from gapbeam.solver.run.output.run_summary import peak_memory
from gapbeam.solver.run.run_consumers import RunConsumers
from gapbeam.solver.seat.static_seat import Seat
from gapbeam.solver.system.semi_discrete import Snapshots
from gapbeam.studies.error_estimate.companion_marches import companion_motions
from gapbeam.studies.error_estimate.companions import error_way
from gapbeam.studies.error_estimate.run_errors import plan_of

if TYPE_CHECKING:
    from mpi4py import MPI

FIELDS = 3  # written for the time that one takes
WARM_UP = 2  # steps, in which everything happens for the first time
TRIAL_TIME, ENOUGH = 1.0, 0.3  # s of a trial, and the share of it below which a longer one follows
LONGEST = 30.0  # s of a trial that follows the first steps: where steps cost more, these have to do
FEW, AFTER_FEW = 200, 0.3  # steps, and share of LONGEST that a trial after so few of them may take
GROWTH, MOST = 4, 100_000  # steps of a trial: at least times those of the one before, and at all
LOADED = 2.0  # s, to load compiled loops; what was compiled in the first steps is kept for the run
FIELDS_OF_A_RUN = 100  # by default
ENOUGH_TRIED = 0.1  # of the steps of a run: so many of them show what the others cost


@dataclass(frozen=True)
class Prediction:
    """Predicted cost of a run.

    Attributes:
        setup: Wall time of each part before the march, s.
        once: Extra time of the first steps, s.
        steps: Steps of the run.
        per_step: Mean wall time of a step with its records, s.
        back_substitution: Its back-substitution, s.
        fields: Fields that the run writes.
        per_field: Time to write one, s.
        memory: Peak of resident memory over all ranks together, bytes.
        basis: Basis of the figures, in words.
        scaled: Whether they are those of coarser meshes, scaled.
        errors: Wall time of the error estimate after the run, s.
        companions: Number of comparison runs in it.
        tried: Steps of the run that were tried out.
        ended: Reason for which the run ends before its first step; empty where it does not.
    """

    setup: dict[str, float]
    once: float
    steps: int
    per_step: float
    back_substitution: float
    fields: int
    per_field: float
    memory: float
    basis: str
    scaled: bool = False
    errors: float = 0.0
    companions: int = 0
    tried: int = 0
    ended: str = ""

    @property
    def certainty(self) -> str:
        """Trust in the wall time, in words: a few steps from the seat stand for no flight and no hard impact."""
        if self.ended:
            return "the run ends at its start"
        if self.scaled:
            return "a scaled estimate"
        if self.tried < ENOUGH_TRIED * self.steps:
            return f"predicted from {self.tried} of {self.steps} steps: the others may take far less or more"
        return "predicted within a factor of 2"

    @property
    def march(self) -> float:
        """Time of the march with its output, s."""
        return 0.0 if self.ended else self.once + self.steps * self.per_step + self.fields * self.per_field

    @property
    def total(self) -> float:
        """Time of the run and its error estimate, s."""
        return sum(self.setup.values()) + self.march + self.errors


def predict(simulation: Simulation, spent: float, comm: MPI.Comm) -> Prediction:
    """Try a run out and predict the cost of all of it.

    Args:
        simulation: The model of the run with its scheme.
        spent: Wall time that making the model took, s.
        comm: Its ranks.

    Raises:
        NotConverged: No seat was found.
        Interrupted: The user interrupted.

    Collective.
    """
    model, case = simulation.model, simulation.case
    trial = Simulation(model_of(at_full_amplitude(case), model.body))
    clock = time.perf_counter()
    if comm.rank == 0:
        LOG.info("model made in %.2g s: %d DOFs, %d contact points; seats the beam", spent, *_size(model))
    seat = trial.seat()
    setup = {"model": spent, "seat": time.perf_counter() - clock}
    setup |= trial.factor()
    if comm.rank == 0:
        LOG.info("seated in %.2g s; marches some steps to see what they cost", setup["seat"])
    plan, folder = trial.plan, on_rank_zero(comm, lambda: Path(tempfile.mkdtemp(prefix="gapbeam-check-")))
    try:
        trials = _Trials(trial, seat, folder)
        first, done = tried(trials.march, min(MOST, plan.steps), comm)
    finally:
        on_rank_zero(comm, lambda: shutil.rmtree(folder, ignore_errors=True))
    errors, companions = 0.0, 0
    if not done.ended:
        if comm.rank == 0:
            LOG.info("sets up the comparison runs of its error estimate")
        errors, companions = cost_of_errors(case, model, comm)
    return Prediction(
        setup,
        min(max(0.0, first.steps * (first.per_step - done.per_step)), LOADED),
        plan.steps,
        done.per_step,
        done.back_substitution,
        1 + _fields(trial.case, plan.dt, plan.steps),
        done.per_field,
        float(sum(peak_memory(comm))),
        done.words,
        errors=errors,
        companions=companions,
        tried=done.steps,
        ended=done.ended,
    )


def tried(march: Callable[[int], TriedSteps], most: int, comm: MPI.Comm) -> tuple[TriedSteps, TriedSteps]:
    """Return the first trial, which makes machine code where there is none, and the one that stands for the run.

    Args:
        march: March of some steps from the seat.
        most: Largest number of steps.
        comm: Its ranks.

    Collective.
    """
    first = march(min(WARM_UP, most))  # up to minutes
    done = first if first.ended else march(min(WARM_UP, most))
    if comm.bcast(not done.ended and GROWTH * done.spent < LONGEST):
        done = march(min(GROWTH * WARM_UP, most))
    while done.steps < most and not done.early and comm.bcast(done.goes_on):
        wanted = min(max(round(TRIAL_TIME / done.per_step), GROWTH * done.steps), most)
        done = march(comm.bcast(wanted))
    return first, done


def _size(model: Model) -> tuple[int, int]:
    """Return the DOFs that are marched and the contact points."""
    return model.dofs, model.system.contact.size


def at_full_amplitude(case: Case) -> Case:
    """Return the case with loads that do not rise smoothly but act at once: a trial shall meet them as they will be."""
    loads = tuple(load.at_full_amplitude() for load in case.load)
    return case.model_copy(update={"load": loads})


def _fields(case: Case, dt: float, steps: int) -> int:
    """Return the number of fields that a march of some steps writes after its start."""
    every = max(1, round((case.output.fields_interval or case.time.end / FIELDS_OF_A_RUN) / dt))
    return steps // every + (steps % every != 0)


@dataclass(frozen=True)
class TriedSteps:
    """Cost of the steps of a trial.

    Their number, wall time, s per step, of that the back-substitution, s per field, all that in words, and whether they
    ended before all that were asked for; the reason where not even the first one was taken.
    """

    steps: int
    spent: float
    per_step: float
    back_substitution: float
    per_field: float
    words: str
    early: bool
    ended: str = ""

    @property
    def goes_on(self) -> bool:
        """True where a longer trial follows: the first steps from a seat may cost a hundred times as much as others."""
        return self.spent < ENOUGH * TRIAL_TIME or (self.steps < FEW and GROWTH * self.spent < AFTER_FEW * LONGEST)


@dataclass(frozen=True)
class _Trials:
    """Marches a few steps from the seat, with their output into a folder that nobody keeps."""

    trial: Simulation
    seat: Seat
    folder: Path

    def march(self, steps: int) -> TriedSteps:
        case, model, plan = self.trial.case, self.trial.model, self.trial.plan
        consumers = RunConsumers(case, model, self.folder, self.seat.state)
        words, early = f"measured now: {steps} steps from the seat with the loads at their full amplitude", False
        ended = ""
        with consumers, Signals(None) as signals:
            signals.march_begins()
            try:
                consumers.follow(replace(plan, steps=steps), None, None, Interruption(consumers.comm, signals))
            except Interrupted:
                raise
            except RunError as error:
                words, early = f"measured now, until the trial under the sudden loads ended early: {error}", True
                if consumers.accounts.tally.steps == 0:
                    words, ended = "not measured", str(error)
            per_field = median(self._field(consumers) for _ in range(FIELDS))
        tally = consumers.accounts.tally
        parts = max(tally.steps, 1)
        whole = parts if early else steps
        output = _fields(case, plan.dt, whole) * per_field
        per_step = max(tally.march - output, tally.advance, 1.0e-9) / whole
        return TriedSteps(whole, tally.march, per_step, tally.back_substitution / parts, per_field, words, early, ended)

    def _field(self, consumers: RunConsumers) -> float:
        """Return the wall time of a field, s: several are written at once where the march is compiled."""
        at_once = AT_ONCE if why_not_compiled(self.trial.plan) is None else 1
        clock = time.perf_counter()
        consumers.fields.write(Snapshots.of_states([self.seat.state] * at_once), consumers.model)
        return (time.perf_counter() - clock) / at_once


LARGEST = 300_000  # DOFs of a model that is tried out
TRIED = (20_000, 60_000)  # DOFs, about, of those tried out in its place
STEEPEST = 2.0  # power of DOFs with which a factor of a solid grows
CELLS = 4  # through the thickness and across the width, by default


def predict_large(case: Case, dofs: int, comm: MPI.Comm) -> Prediction:
    """Predict the cost of a run on a mesh with many DOFs.

    Args:
        case: The case.
        dofs: DOFs of its mesh.
        comm: Its ranks.

    Raises:
        UserError: Scheme and contact are known to create energy.
        NotConverged: A coarser beam found no seat.

    Collective.
    """
    idle = float(sum(peak_memory(comm)))
    tried: list[Prediction] = []
    sizes: list[int] = []
    for target in TRIED:
        clock = time.perf_counter()
        if comm.rank == 0:
            LOG.info("tries out a coarser mesh of about %d DOFs: %d are too many for that", target, dofs)
        model = build_model(coarser(case, dofs / target), comm)
        refuse_energy_creators(case, model)
        tried.append(predict(Simulation(model), time.perf_counter() - clock, comm))
        sizes.append(model.mesh_dofs)
        del model
        gc.collect()
    small, large = tried

    def needed(size: float) -> float:
        return sum(memory_of(case, size).values())  # as what refuses a run counts: peaks of two trials have no power

    ratio, growth = log(sizes[1] / sizes[0]), dofs / sizes[1]

    def scaled(first: float, second: float) -> float:
        power = log(second / first) / ratio if min(first, second) > 0.0 and ratio > 0.0 else 0.0
        return float(second * growth ** min(max(power, 0.0), STEEPEST))

    return replace(
        large,
        setup={name: scaled(small.setup[name], seconds) for name, seconds in large.setup.items()},
        per_step=scaled(small.per_step, large.per_step),
        back_substitution=scaled(small.back_substitution, large.back_substitution),
        per_field=scaled(small.per_field, large.per_field),
        errors=scaled(small.errors, large.errors),
        memory=idle + (large.memory - idle) * needed(dofs) / needed(sizes[1]),
        basis=f"scaled from coarser meshes of {sizes[0]} and {sizes[1]} DOFs, which were tried out: "
        f"more than {LARGEST} DOFs are too many for that",
        scaled=True,
    )


def coarser(case: Case, share: float) -> Case:
    """Return a case on a mesh that has about 1 / share of the DOFs; instead of a mesh file, on one of gmsh."""
    mesh = case.mesh
    scale = share ** (1.0 / mesh.dimension)
    thickness = case.profile.thickest
    support = mesh.support_size or thickness / 3.0
    sizes: dict[str, float | int | None] = {
        "file": None,
        "size": (mesh.size or thickness) * scale,
        "support_size": support * scale,
        "edge_size": mesh.edge_size and mesh.edge_size * scale,
        "cells_through_thickness": max(1, round((mesh.cells_through_thickness or CELLS) / scale)),
    }
    if mesh.dimension == 3:
        sizes["cells_across_width"] = max(1, round((mesh.cells_across_width or CELLS) / scale))
    return case.model_copy(update={"mesh": mesh.model_copy(update=sizes)})


RECORDS = 256  # of each companion that is tried out


def cost_of_errors(case: Case, model: Model, comm: MPI.Comm) -> tuple[float, int]:
    """Return the wall time that the error estimate of a run takes, s, and the number of its companions.

    Each companion is set up as it will be, and marched for some records, all together for at most LONGEST s; the rest
    of its steps take as long. What is compiled in the first steps of the first companion is kept, and does not count.

    Args:
        case: Case of the run.
        model: Its model.
        comm: Its ranks; the first one works, as it does for the estimate.

    Collective.
    """
    if error_way(case) == "none" or not isinstance(case.analysis, Transient) or case.analysis.state is not None:
        return 0.0, 0
    computed = {default.key: default.value for default in model.defaults}
    small = comm.size == 1 and not isinstance(case.model, FullModel)

    def tried() -> tuple[float, int]:
        plan = plan_of(case, computed)
        interval = plan.records * (case.output.history_interval or model.step)
        end, body = min(RECORDS * interval, case.time.end), model.body if small else None
        if not small:
            list(companion_motions(case, plan.companions[:1], end, interval, body=body))
        found = list(companion_motions(case, plan.companions, end, interval, LONGEST, body))
        set_up = sum(one.seconds - one.march for one in found)
        marches = sum(one.march / one.steps * case.time.end / one.step for one in found if one.steps)
        return set_up + marches, len(found)

    return on_rank_zero(comm, tried)
