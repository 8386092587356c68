"""Longer run: continued until the interval of a statistic is narrow; from its options to a case and a rule."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from gapbeam.interface.case_source import CaseSource, shared_case
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.errors import UserError
from gapbeam.solver.wording.short_words import apart

if TYPE_CHECKING:
    from mpi4py import MPI

    from gapbeam.solver.case.case import Case
    from gapbeam.solver.run.stop_rule import StopRule

LONGER = 10.0  # times time.end is the longest run by default


def case_and_rule(
    source: CaseSource,
    overrides: Overrides,
    relative_error: float | None,
    of: str | None,
    at_most: float | None,
    comm: MPI.Comm,
) -> tuple[Case, StopRule | None]:
    """Return the case of a run and when it may end.

    With a relative error, `time.end` is the earliest end, and the case that is run ends at `at_most`.

    Args:
        source: As in `gapbeam.run`, like those that follow.
        overrides: Keys to replace.
        relative_error: Of the figure; None: the run ends at `time.end`.
        of: The figure.
        at_most: Longest time that is marched, s; None: 10 times `time.end`.
        comm: The ranks that read.

    Raises:
        CaseError: The case has faults.
        UserError: The options do not go together, or not with the case.

    Collective.
    """
    case = shared_case(source, overrides, comm)
    if relative_error is None and of is None and at_most is None:
        return case, None
    if relative_error is None or of is None:
        lacking = "relative_error" if relative_error is None else "of"
        raise UserError(
            f"`{lacking}=` is missing: a run goes on until the interval of one figure is narrow, such as "
            '`relative_error=` 0.01 with `of=` "probe.tip.rms"'
        )
    from gapbeam.solver.run.stop_rule import StopRule

    end = case.time.end
    longest = LONGER * end if at_most is None else at_most
    if not (isfinite(longest) and longest >= end):
        found, least = apart(longest, end)
        raise UserError(f"`at_most=`: found {found} s; expected at least time.end, {least} s, when the run may end")
    rule = StopRule(of, relative_error, end)
    rule.refuse_misfit(case)
    return shared_case(case, {"time.end": longest}, comm), rule
