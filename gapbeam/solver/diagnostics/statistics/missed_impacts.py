"""The part of the impacts of a face that steps are too long to see.

A face is looked at once a step h. A touch of duration d < h is seen with the probability d / h, and so is a parting of
that duration between two touches, which are otherwise counted as one. Where durations are spread evenly below h,

    missed = integral of (1 - d / h) dd = h / 2 = integral of (d / h) dd = seen:

as many are missed as are seen to be shorter than a step. A contact of one spring and one mass has no touch that is much
shorter than half its period; fast modes of a beam make some at any step.
"""

from __future__ import annotations

import numpy as np

from gapbeam.solver.diagnostics.impact_list import DURATION, ImpactList

MOST_MISSED = 0.03  # of the impacts; beyond, an interval on their rate does not hold what steps leave out


def missed_share(impacts: ImpactList, step: float) -> float:
    """Return about how many impacts were missed, over those that were seen; 0 where there were none.

    Args:
        impacts: Of a face.
        step: s.
    """
    durations = impacts.rows[:, DURATION]
    if not len(durations):
        return 0.0
    return float(np.sum(durations < step) + np.sum(impacts.partings < step)) / len(durations)
