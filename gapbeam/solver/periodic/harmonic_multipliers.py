"""Multipliers along a solution of harmonic balance, and whether they have converged with the number of harmonics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gapbeam.solver.periodic.floquet import Stability, stability_of
from gapbeam.solver.periodic.harmonic_balance import HarmonicSolution
from gapbeam.solver.periodic.harmonic_continuation import Climb
from gapbeam.solver.periodic.known_multipliers import Judgment, judged
from gapbeam.solver.periodic.modal_period_map import ModalMap

NOTABLE_TRUNCATION = 0.1  # of the contact force beyond the harmonics: the instants of contact are not resolved
EXACT = 1.0e-9  # of the contact force beyond the harmonics: there is nothing that more harmonics would change


def balanced_multipliers(period_map: ModalMap, found: Climb, marched: Stability) -> Judgment:
    """Return the multipliers along a solution, judged by those with fewer harmonics and by those of a march from it.

    A march resolves every contact by its steps, whatever the series says; fewer harmonics show how it converges.

    Args:
        period_map: The period in steps.
        found: The solution, and the one with fewer harmonics.
        marched: Multipliers of a march over a period from the state of the solution at t = 0.
    """
    solution, before = found.solution, found.before
    harmonics = solution.series.harmonics
    others = {"a march over a period": marched}
    if before is not None:
        others[f"{before.series.harmonics} harmonics"] = _multipliers_along(period_map, before)
    judgment = judged(_multipliers_along(period_map, solution), others, f"{harmonics} harmonics")
    doubts = judgment.doubts
    if solution.truncated > NOTABLE_TRUNCATION:
        doubts += (f"{solution.truncated:.0%} of the contact force lies beyond harmonic {harmonics}",)
    if before is None and solution.truncated > EXACT:
        doubts += ("no smaller number of harmonics converged to compare with",)
    return replace(judgment, doubts=doubts)


def _multipliers_along(period_map: ModalMap, solution: HarmonicSolution) -> Stability:
    """Return the multipliers of the steps of a period along a Fourier series."""
    places, _, _ = solution.motion(np.asarray(period_map.dt * np.arange(period_map.steps + 1), dtype=float))
    return stability_of(period_map.tangent_along(places))
