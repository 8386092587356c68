"""Motion of a case by an independent computation, for comparison with its run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import ceil, log
from typing import Any
from unittest.mock import patch

import numpy as np

import gapbeam
from benchmarks.drawn_schema.ways import FINER, Way, begun
from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import FullModel
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials.response import TrialResponse, respond
from gapbeam.studies.trials.starts import seated

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
        step: Of the run, s.
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
    return MotionRecord.of_history(as_history(_passed(response).history, response.labels), bends_in_two_planes(case))


def long_march(
    way: Way,
    case: Case,
    step: float,
    computed: dict[str, float],
    multiplier: float,
    varied: dict[str, float] | None = None,
) -> tuple[MotionRecord, float]:
    """March a case for many forcing periods, and return the last period of the response and how periodic it is.

    The change of the displacements over this period, relative to their range, goes with it.

    Args:
        way: The other way.
        case: The case.
        step: Of the run, s; here the nearest to it that divides the forcing period.
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
    motion = MotionRecord.of_history(as_history(_passed(response).history, response.labels), bends_in_two_planes(case))
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
