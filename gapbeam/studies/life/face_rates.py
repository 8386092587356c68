"""Work rates of faces in a run: how often to record, their intervals and verdicts, and what a run that failed says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE, Doubts
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.loads.scene_load_choice import AnyLoad
from gapbeam.solver.messages.errors import RunError, UserError
from gapbeam.studies.life.worn_march import DepthRates
from gapbeam.studies.trials.response import TrialResponse

PERIODS = 100  # of a forcing, of which statistics need some dozens behind the burn-in
WHOLE = 1.0e-6
REPEATED = 1.0e-4  # of a rate, between the ends of the interval of a motion that repeats


class RunFailed(RunError):  # noqa: N818 - as other ends of runs are called
    """A run on worn gaps did not pass.

    Attributes:
        exit_status: Of that run.
    """

    def __init__(self, message: str, exit_status: int) -> None:
        super().__init__(message, exit_status)
        self.exit_status = exit_status


def passed(response: TrialResponse, names: Sequence[str], depths: Sequence[float]) -> None:
    """Pass a run on worn gaps.

    Args:
        response: Response of the run.
        names: Names of the faces.
        depths: Depths of all faces, m.

    Raises:
        RunFailed: It did not pass.
    """
    if response.exit_status:
        worn = ", ".join(f"{name} {depth:.3g} m" for name, depth in zip(names, depths, strict=True))
        raise RunFailed(
            f"the run with the faces worn by {worn} did not pass: {response.verdict}: {response.message}",
            response.exit_status,
        )


def rate_verdict(rate: Mapping[str, Any]) -> str:
    """Return the verdict on the interval of a rate; that of a motion that repeats is good."""
    repeats = float(rate["high"]) - float(rate["low"]) < REPEATED * float(rate["value"])
    return "good" if repeats else str(rate["verdict"])


def record_steps(loads: Sequence[AnyLoad], end: float, step: float, interval: float) -> int:
    """Return the steps between records: of an interval, or a period of a forcing that repeats often enough.

    The work of whole periods is the same in a motion that repeats, and has no chance in it.

    Args:
        loads: That may force a motion that repeats.
        end: End of the run, s.
        step: s.
        interval: s.
    """
    frequencies = forcing_frequencies(loads)
    if len(frequencies) == 1 and frequencies[0] * end >= PERIODS:
        steps = round(1.0 / (frequencies[0] * step))
        if abs(steps * step * frequencies[0] - 1.0) < WHOLE:
            return steps
    return max(1, round(interval / step))


def depth_rates(works: Sequence[Mapping[str, Any]], factors: ArrayLike) -> DepthRates:
    """Return rates of depth, m/s, from work rates.

    Args:
        works: Works of each face, of `work_rates`.
        factors: Depth worn per work of sliding of each face, m/J.
    """
    values, low, high = (
        np.asarray(factors) * np.array([max(float(one[key]), 0.0) for one in works]) for key in ("value", "low", "high")
    )
    return DepthRates(values, low, high, tuple(map(rate_verdict, works)))


def work_rates(
    statistics: RunStatistics, names: Sequence[str], end: float, doubts: Doubts | None = None
) -> list[Mapping[str, Any]]:
    """Return the work rate of each face with its interval, as statistics describe it, W.

    Args:
        statistics: Statistics of a run.
        names: Names of the faces.
        end: End of the run, s.
        doubts: On the statistics.

    Raises:
        UserError: The run has too few records for statistics.
    """
    figures = {one["name"]: one for one in statistics.describe(doubts)["figures"]}
    if not figures:
        raise UserError(
            f"time.end: {end:g} s with a record every {statistics.interval:g} s are too few records for the mean of a "
            "work rate; expected a hundred and more: a later time.end, or a shorter output.history_interval"
        )
    return [figures[f"face.{name}.{WORK_RATE}"] for name in names]
