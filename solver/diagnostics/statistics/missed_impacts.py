"""The part of the impacts of a face that steps are too long to see.

A face is looked at once a step h. A touch of duration d < h is seen with the probability d / h, and so is a parting of
that duration between two touches, which are otherwise counted as one. Where durations are spread evenly below h,

    missed = integral of (1 - d / h) dd = h / 2 = integral of (d / h) dd = seen:

as many are missed as are seen to be shorter than a step. A contact of one spring and one mass has no touch that is much
shorter than half its period; fast modes of a beam make some at any step.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.diagnostics.impact_list import ImpactList

MOST_MISSED = 0.03  # of the impacts; beyond, an interval on their rate does not hold what steps leave out


def missed_share(impacts: ImpactList, step: float) -> float:
    """Return about how many impacts were missed, over those that were seen; 0 where there were none.

    Args:
        impacts: Of a face. Where only some of them are kept, partings are not known, and are not counted.
        step: s.
    """
    rows = impacts.rows
    if not len(rows):
        return 0.0
    short = int(np.sum(rows[:, 3] < step))
    if impacts.every == 1:
        short += int(np.sum(rows[1:, 0] - (rows[:-1, 0] + rows[:-1, 3]) < step))
    return short / len(rows)
