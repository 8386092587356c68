"""The motions of the companions of a run."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import floor

from gapbeam.process.extra_packages import MissingExtraError
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case, case_to_toml
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.case.solution_tables import BeamModel, ReducedModel, RigidModel
from gapbeam.solver.messages.errors import CaseError, Interrupted, RunError, in_one_line
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.models.body import Body
from gapbeam.solver.run.output.progress import LINE
from gapbeam.studies.error_estimate.companions import Companion, quiet
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import KeptBody, seated

FEWEST_RECORDS = 8
WHOLE = 1.0e-6  # of an interval


class EstimateError(Exception):
    """The errors of a run cannot be estimated, and why."""


@dataclass(frozen=True)
class CompanionMotion:
    """Motion of a comparison run.

    Attributes:
        name: Name of the companion.
        motion: Its motion; None: it has none, for the reason in `failure`.
        dofs: DOFs marched.
        step: s.
        steps: Number of marched steps.
        seconds: Wall time, s.
        march: Wall time of the steps alone, s.
        failure: Why it was refused, found no seat or did not converge; "": it was not.
    """

    name: str
    motion: MotionRecord | None
    dofs: int = 0
    step: float = 0.0
    steps: int = 0
    seconds: float = 0.0
    march: float = 0.0
    failure: str = ""


def companion_motions(
    case: Case,
    companions: Sequence[Companion],
    end: float,
    interval: float,
    longest: float | None = None,
    body: Body | None = None,
) -> Iterator[CompanionMotion]:
    """March the companions of a case, all up to the same time.

    That is the last record before the end of the run, on any machine. Only where the user limits the wall time, a
    companion that takes longer than its share stops where it is, and those after it with it.

    Args:
        case: The case of the run.
        companions: Companions to march.
        end: End of the run, s.
        interval: Interval between records, s, a whole number of steps of every companion.
        longest: Wall time for all marches, s; setting up does not count. None: no limit.
        body: Body of the run, which companions with its mesh and model share; None: they set up their own.
    """
    kept, reached = KeptBody(body), floor(end / interval + WHOLE) * interval
    whole = sum(one.steps for one in companions)
    shown = time.perf_counter()
    for number, companion in enumerate(companions, start=1):
        clock = time.perf_counter()
        try:
            own = read_case_text(case_to_toml(case), companion.changes, f"the companion with {companion.name}")
            solid = isinstance(own.model, ReducedModel) and isinstance(case.model, BeamModel | RigidModel)
            if solid or clock - shown > LINE:
                words = " on a solid" if solid else ""
                LOG.info("errors: comparison run %d of %d, %s%s", number, len(companions), companion.name, words)
                shown = clock
            with quiet():
                model = kept.model(own)
                start = seated(model).state
        except Interrupted:
            raise
        except (CaseError, RunError, MissingExtraError) as error:
            yield CompanionMotion(companion.name, None, failure=in_one_line(str(error)))
            continue
        limit = None if longest is None else longest * companion.steps / whole
        response = respond(model, start, round(reached / model.step), interval, limit)
        costs = model.dofs, model.step, response.steps, time.perf_counter() - clock, response.seconds
        if response.verdict != "passed" or len(response.history["time"]) < FEWEST_RECORDS:
            failure = response.message or f"too slow for the {limit or 0.0:.3g} s that it may take"
            yield CompanionMotion(companion.name, None, *costs, failure)
            continue
        in_space = bends_in_two_planes(case)
        motion = MotionRecord.of_records(response.history, response.labels, in_space, case.figure)
        reached = min(reached, motion.end)
        yield CompanionMotion(companion.name, motion, *costs)
