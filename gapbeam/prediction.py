"""What a run will cost, from a trial of it on this machine.

    total = set-up + seat + once + steps * per_step + fields * per_field

Everything that a run does before its march is done and timed, then a few steps are marched with all their output, from
the seat with the loads at their full amplitude, so that contact opens and closes as it will. Nothing is kept for the
next time: what another day or another machine measured would not hold.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

from mpi4py import MPI

from meshes.rank_zero import on_rank_zero
from solver.analyses.static import find_seat
from solver.analyses.transient import March
from solver.case import BaseMotion, Case, HarmonicForce
from solver.errors import Interrupted, RunError
from solver.integrators.schemes import make_integrator
from solver.march_of_model import march_of_model
from solver.model import Model, model_of
from solver.output.summary import peak_memory
from solver.run import Course

WARM_UP = 2  # steps, in which everything happens for the first time
TRIAL_TIME, FEWEST, MOST = 3.0, 8, 4000  # s, and steps of a trial
FIELDS_OF_A_RUN = 100.0  # by default


@dataclass(frozen=True)
class Prediction:
    """What a run will cost.

    Attributes:
        setup: Mesh, assembly, reduction, seat, factorization and Delassus operator together, s.
        once: What only the first steps take, s.
        steps: Steps of the run.
        per_step: Mean wall time of a step with its records, s.
        back_substitution: Its back-substitution, s.
        fields: Fields that the run writes.
        per_field: Time to write one, s.
        memory: Peak of resident memory over all ranks together, bytes.
        trial_steps: Steps that were marched for it.
        basis: What the figures stand on, in words.
    """

    setup: float
    once: float
    steps: int
    per_step: float
    back_substitution: float
    fields: int
    per_field: float
    memory: float
    trial_steps: int
    basis: str

    @property
    def march(self) -> float:
        """Time of the march with its output, s."""
        return self.once + self.steps * self.per_step + self.fields * self.per_field

    @property
    def total(self) -> float:
        """Time of the run, s."""
        return self.setup + self.march


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
    trial = model_of(at_full_amplitude(model.case), model.body)
    clock = time.perf_counter()
    scheme = make_integrator(trial.case.time.scheme)
    seat = find_seat(trial.system, trial.law, trial.seat_springs, scheme.carries_acceleration)
    plan = march_of_model(trial, scheme)
    plan.operators.at(plan.dt)
    setup = spent + time.perf_counter() - clock
    folder = on_rank_zero(comm, lambda: Path(tempfile.mkdtemp(prefix="gapbeam-check-")))
    try:
        trials = _Trials(trial, plan, folder, comm)
        first = trials.march(seat, WARM_UP)
        guess = first.per_step if first.steps else TRIAL_TIME
        asked = int(min(max(TRIAL_TIME / max(guess, 1.0e-9), FEWEST), MOST, plan.steps))
        asked = comm.bcast(asked)
        done = trials.march(seat, asked)
    finally:
        on_rank_zero(comm, lambda: shutil.rmtree(folder, ignore_errors=True))
    fields = 1 + plan.steps // fields_every(model.case, plan.dt)
    return Prediction(
        setup,
        max(0.0, first.steps * (first.per_step - done.per_step)),
        plan.steps,
        done.per_step,
        done.back_substitution,
        fields,
        done.per_field,
        float(sum(peak_memory(comm))),
        done.steps,
        done.words,
    )


def at_full_amplitude(case: Case) -> Case:
    """Return the case with loads that do not rise smoothly but act at once: a trial shall meet them as they will be."""
    loads = tuple(
        load.model_copy(update={"ramp": 0.0}) if isinstance(load, HarmonicForce | BaseMotion) else load
        for load in case.load
    )
    return case.model_copy(update={"load": loads})


def fields_every(case: Case, dt: float) -> int:
    """Return after how many steps a run writes fields."""
    return max(1, round((case.output.fields_interval or case.time.end / FIELDS_OF_A_RUN) / dt))


@dataclass(frozen=True)
class _Trial:
    steps: int
    per_step: float
    back_substitution: float
    per_field: float
    words: str


@dataclass(frozen=True)
class _Trials:
    """Marches a few steps with their output into a folder that nobody keeps."""

    model: Model
    plan: March
    folder: Path
    comm: MPI.Comm

    def march(self, seat: Any, steps: int) -> _Trial:
        """March some steps from the seat."""
        course = Course(self.model, self.folder, self.comm, seat)
        words = f"{steps} steps tried out"
        try:
            course.follow(replace(self.plan, steps=steps), None)
        except Interrupted:
            raise
        except RunError as error:
            words = f"the trial under sudden loads ended early: {error}"
        finally:
            clock = time.perf_counter()
            course.fields.write(seat.state, self.model)
            per_field = time.perf_counter() - clock
            course.close()
        tally = course.tally
        whole = round(tally.time / self.plan.dt) if False else tally.steps
        written = 1 + whole // fields_every(self.model.case, self.plan.dt)
        per_step = max(tally.march - written * per_field, tally.advance) / max(whole, 1)
        return _Trial(whole, per_step, tally.back_substitution / max(tally.steps, 1), per_field, words)
