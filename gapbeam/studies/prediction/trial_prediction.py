"""What a run will cost, from a trial of it on this machine.

    total = set-up + seat + once + steps * per_step + fields * per_field

Everything that a run does before its march is done and timed, then a few steps are marched with all their output, from
the seat with the loads at their full amplitude, so that contact opens and closes as it will. Nothing is kept for the
next time: what another day or another machine measured would not hold.
"""

from __future__ import annotations

import logging
import shutil
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from mpi4py import MPI

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.solver.case.case import Case
from gapbeam.solver.errors import Interrupted, RunError
from gapbeam.solver.march.compiled.eligibility import why_not_compiled
from gapbeam.solver.march.python.march import March
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import Model, model_of
from gapbeam.solver.run.interruption import Interruption, Signals
from gapbeam.solver.run.output.field_pieces import AT_ONCE
from gapbeam.solver.run.output.run_summary import peak_memory
from gapbeam.solver.run.run_consumers import RunConsumers
from gapbeam.solver.seat.static_seat import Seat
from gapbeam.solver.system.snapshots import Snapshots

LOG = logging.getLogger("gapbeam")
FIELDS = 3  # written for the time that one takes
WARM_UP = 2  # steps, in which everything happens for the first time
TRIAL_TIME, ENOUGH = 3.0, 0.3  # s of a trial, and the share of it below which a longer one follows
LONGEST = 30.0  # s of a trial that follows the first steps: where steps cost more, these have to do
GROWTH, MOST = 4, 100_000  # steps of a trial: at least times those of the one before, and at all
LOADED = 2.0  # s, to load compiled loops; what was compiled in the first steps is kept for the run
FIELDS_OF_A_RUN = 100  # by default


@dataclass(frozen=True)
class Prediction:
    """What a run will cost.

    Attributes:
        setup: Wall time of each part before the march, s.
        once: What only the first steps take, s.
        steps: Steps of the run.
        per_step: Mean wall time of a step with its records, s.
        back_substitution: Its back-substitution, s.
        fields: Fields that the run writes.
        per_field: Time to write one, s.
        memory: Peak of resident memory over all ranks together, bytes.
        basis: What the figures stand on, in words.
        scaled: Whether they are those of coarser meshes, scaled.
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

    @property
    def march(self) -> float:
        """Time of the march with its output, s."""
        return self.once + self.steps * self.per_step + self.fields * self.per_field

    @property
    def total(self) -> float:
        """Time of the run, s."""
        return sum(self.setup.values()) + self.march


def predict(model: Model, spent: float, comm: MPI.Comm) -> Prediction:
    """Try a run out and predict what all of it costs.

    Args:
        model: The model.
        spent: Wall time that making it took, s.
        comm: Its ranks.

    Raises:
        NotConverged: No seat was found.
        Interrupted: By the user.

    Collective.
    """
    trial = Simulation(model_of(at_full_amplitude(model.case), model.body))
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
        trials = _Trials(trial.model, plan, seat, folder, comm)
        most = min(MOST, plan.steps)
        first = trials.march(min(WARM_UP, most))
        done = first if GROWTH * first.spent > LONGEST else trials.march(min(GROWTH * WARM_UP, most))
        while done.steps < most and not done.early and comm.bcast(done.spent < ENOUGH * TRIAL_TIME):
            wanted = min(max(round(TRIAL_TIME / done.per_step), GROWTH * done.steps), most)
            done = trials.march(comm.bcast(wanted))
    finally:
        on_rank_zero(comm, lambda: shutil.rmtree(folder, ignore_errors=True))
    return Prediction(
        setup,
        min(max(0.0, first.steps * (first.per_step - done.per_step)), LOADED),
        plan.steps,
        done.per_step,
        done.back_substitution,
        1 + _fields(model.case, plan.dt, plan.steps),
        done.per_field,
        float(sum(peak_memory(comm))),
        done.words,
    )


def _size(model: Model) -> tuple[int, int]:
    """Return the DOFs that are marched and the contact points."""
    return model.dofs, model.system.contact.size


def at_full_amplitude(case: Case) -> Case:
    """Return the case with loads that do not rise smoothly but act at once: a trial shall meet them as they will be."""
    loads = tuple(load.at_full_amplitude() for load in case.load)
    return case.model_copy(update={"load": loads})


def _fields(case: Case, dt: float, steps: int) -> int:
    """Return how many fields a march of some steps writes after its start."""
    every = max(1, round((case.output.fields_interval or case.time.end / FIELDS_OF_A_RUN) / dt))
    return steps // every + (steps % every != 0)


@dataclass(frozen=True)
class _Trial:
    """What some steps cost.

    Their number, wall time, s per step, of that the back-substitution, s per field, all that in words, and whether they
    ended before all that were asked for.
    """

    steps: int
    spent: float
    per_step: float
    back_substitution: float
    per_field: float
    words: str
    early: bool


@dataclass(frozen=True)
class _Trials:
    """Marches a few steps from the seat, with their output into a folder that nobody keeps."""

    model: Model
    plan: March
    seat: Seat
    folder: Path
    comm: MPI.Comm

    def march(self, steps: int) -> _Trial:
        consumers = RunConsumers(self.model, self.folder, self.comm, self.seat.state)
        words, early = f"measured now: {steps} steps from the seat with the loads at their full amplitude", False
        with consumers, Signals(None) as signals:
            signals.march_begins()
            try:
                consumers.follow(replace(self.plan, steps=steps), None, None, Interruption(self.comm, signals))
            except Interrupted:
                raise
            except RunError as error:
                words, early = f"measured now, until the trial under the sudden loads ended early: {error}", True
            per_field = median(self._field(consumers) for _ in range(FIELDS))
        tally = consumers.accounts.tally
        parts = max(tally.steps, 1)
        whole = parts if early else steps
        output = _fields(self.model.case, self.plan.dt, whole) * per_field
        per_step = max(tally.march - output, tally.advance, 1.0e-9) / whole
        return _Trial(whole, tally.march, per_step, tally.back_substitution / parts, per_field, words, early)

    def _field(self, consumers: RunConsumers) -> float:
        """Return the wall time of a field, s: several are written at once where the march is compiled."""
        at_once = AT_ONCE if why_not_compiled(self.plan) is None else 1
        clock = time.perf_counter()
        consumers.fields.write(Snapshots.of_states([self.seat.state] * at_once), self.model)
        return (time.perf_counter() - clock) / at_once
