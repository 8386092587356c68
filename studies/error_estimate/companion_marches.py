"""The motions of the companions of a run."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import floor

from gapbeam.postprocess.results.records_in_memory import as_history
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.case_writer import case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.case.symmetry import bends_in_two_planes
from gapbeam.solver.errors import RunError
from gapbeam.solver.faults import CaseError
from gapbeam.solver.models.body import Body
from gapbeam.studies.error_estimate.companions import COST, Companion
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials.kept_body import KeptBody
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import seated

WARM_UP = 20  # steps that are not timed: code is loaded and memory touched
TIMED = 200  # steps
PATIENCE = 2.0  # times the budget of time that all marches may take in the end: the cost of a march is a guess
FEWEST_RECORDS = 8


class EstimateError(Exception):
    """The errors of a run cannot be estimated, and why."""


@dataclass(frozen=True)
class CompanionMotion:
    """What a companion did.

    Attributes:
        name: Of the companion.
        motion: Its motion.
        dofs: DOFs marched.
        step: s.
        seconds: Wall time, s.
    """

    name: str
    motion: MotionRecord
    dofs: int
    step: float
    seconds: float


def companion_motions(
    case: Case,
    companions: Sequence[Companion],
    end: float,
    step: float,
    interval: float,
    budget: float,
    body: Body | None = None,
) -> Iterator[CompanionMotion]:
    """March the companions of a case, all up to the same time.

    That is the end of the run, or what the budget of time allows, by the first steps of the first companion. A
    companion that takes longer than its share all the same stops where it is, and those after it with it.

    Args:
        case: The case of the run.
        companions: Which ones.
        end: Of the run, s.
        step: Of the run, s.
        interval: Between records, s, a whole number of steps of every companion.
        budget: Wall time for all marches, s; setting up does not count.
        body: That of the run, which companions with its mesh and model share; None: they set up their own.

    Raises:
        EstimateError: A companion is refused, finds no seat, does not converge or takes far too long.
    """
    kept, reached = KeptBody(body), None
    whole = sum(COST[one.name] for one in companions)
    for companion in companions:
        clock = time.perf_counter()
        try:
            own = read_case_text(case_to_toml(case), companion.changes, f"the companion with {companion.name}")
            with _quiet():
                model = kept.model(own)
                start = seated(model).state
        except (CaseError, RunError) as error:
            raise EstimateError(f"{companion.name}: {error}") from error
        if reached is None:
            respond(model, start, WARM_UP, longest=budget)
            timed = respond(model, start, TIMED, longest=0.1 * budget)
            total = whole * timed.seconds / max(1, timed.steps) * end / step
            reached = end if total <= budget else floor(end / interval * budget / total) * interval
        longest = PATIENCE * budget * COST[companion.name] / whole
        response = respond(model, start, round(reached / model.step), interval, longest)
        if response.verdict != "passed":
            raise EstimateError(f"{companion.name}: {response.message}")
        if len(response.history["time"]) < FEWEST_RECORDS:
            raise EstimateError(f"{companion.name}: too slow for the {budget:.3g} s that it may take")
        motion = MotionRecord.of_history(as_history(response.history, response.labels), bends_in_two_planes(case))
        reached = min(reached, motion.end)
        yield CompanionMotion(companion.name, motion, model.dofs, model.step, time.perf_counter() - clock)


@contextmanager
def _quiet() -> Iterator[None]:
    """Leave the set-up of companions out of the log."""
    logger = logging.getLogger("gapbeam")
    before = logger.level
    logger.setLevel(max(before, logging.WARNING))
    try:
        yield
    finally:
        logger.setLevel(before)
