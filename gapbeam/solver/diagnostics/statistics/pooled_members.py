"""One interval from several runs of the same motion under other noise: the members of an ensemble, pooled.

Each member j has a mean m_j over the time T_j with the standard error s_j from its own batches, which
knows what the member remembers. Members of other seeds are independent, so that

    m = sum T_j m_j / T,    s^2 = sum (T_j s_j / T)^2,    nu = s^4 / sum ((T_j s_j / T)^4 / 9),    T = sum T_j,

and the interval is m +- t_nu s, even about the logarithm for figures that are positive; an rms is pooled as its square.
Every member leaves out a burn-in of its own, and is judged by itself: pooling does not make members longer. Where
their means differ by more than their own intervals allow (F test at 1 %), the members disagree: they are too short, or
there are several motions, and the interval means nothing.

Sources: Law, Simulation Modeling and Analysis (2015), section 9.5, for independent replications; Welch, Biometrika 34
(1947) 28, for nu.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import log
from typing import Any

import numpy as np
import scipy

from gapbeam.solver.diagnostics.statistics.batch_interval import BATCHES, CONFIDENCE, Interval, interval_about, quantile
from gapbeam.solver.diagnostics.statistics.run_statistics import ORDER
from gapbeam.solver.diagnostics.statistics.statistic_figures import ASKED, PERCENTILES

DISAGREE = "members disagree"
BY_CHANCE = 0.01  # of ensembles disagree by chance
FEWEST = 2  # members

Described = Mapping[str, Any]


def pooled_figures(members: Sequence[Described]) -> list[dict[str, Any]]:
    """Return the figures that all members have, but percentiles, with the interval of all of them together.

    Args:
        members: Described statistics of each member, with `seconds`, `burn_in` and `figures`.
    """
    if len(members) < FEWEST or not all(one["figures"] for one in members):
        return []
    by_name = [{one["name"]: one for one in member["figures"]} for member in members]
    spans = np.array([float(member["seconds"]) - float(member["burn_in"]) for member in members])
    names = [name for name in by_name[0] if not name.endswith(tuple(PERCENTILES))]
    return [_pooled([one[name] for one in by_name], spans) for name in names if all(name in one for one in by_name)]


def _pooled(members: Sequence[Described], spans: np.ndarray) -> dict[str, Any]:
    """Return a figure of all members together."""
    name = str(members[0]["name"])
    power = 2.0 if name.endswith(("rms", "rms_force")) else 1.0
    shares = spans / spans.sum()
    values, errors = np.array([_mean_and_error(one, power, not name.endswith("mean")) for one in members]).T
    mean, error = float(shares @ values), float(np.sqrt(np.sum((shares * errors) ** 2)))
    verdict = max((str(one["verdict"]) for one in members), key=ORDER.index)
    if verdict != "no event" and _disagree(values, errors):
        verdict = DISAGREE
    if error == 0.0 or mean == 0.0:
        interval, kappa = Interval(mean, mean - error, mean + error), None
    else:
        freedom = error**4 / float(np.sum((shares * errors) ** 4)) * (BATCHES - 1)
        reach = error * float(scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
        interval = interval_about(mean, reach, positive=not name.endswith("mean"))
        kappa = (error / mean / power) ** 2 * float(spans.sum())
    interval = interval.root() if power > 1.0 else interval
    relative = interval.relative if kappa is not None else None
    return {
        "name": name,
        "unit": members[0]["unit"],
        "value": interval.value,
        "low": interval.low,
        "high": interval.high,
        "relative": relative,
        "effective_samples": float(sum(one["effective_samples"] for one in members)),
        "relative_variance_times_time": kappa,
        "verdict": verdict,
        f"time_for_{100 * ASKED:g}_percent": None if relative is None else float(spans.sum()) * (relative / ASKED) ** 2,
    }


def _mean_and_error(one: Described, power: float, positive: bool) -> tuple[float, float]:
    """Return the mean, of squares for an rms, and its standard error, from a figure with its interval."""
    value, high, reached = float(one["value"]), float(one["high"]), quantile(CONFIDENCE, BATCHES)
    if value == 0.0:
        return 0.0, 0.0
    if positive and value > 0.0:
        mean = value**power
        return mean, power * mean * log(high / value) / reached
    return value, (high - value) / reached


def _disagree(values: np.ndarray, errors: np.ndarray) -> bool:
    """Return whether means differ by more than their errors allow: those between members over those within."""
    within = float(np.mean(errors**2))
    if within == 0.0:
        return bool(np.ptp(values) > 0.0)
    ratio = float(np.var(values, ddof=1)) / within
    return bool(scipy.stats.f.sf(ratio, len(values) - 1, len(values) * (BATCHES - 1)) < BY_CHANCE)
