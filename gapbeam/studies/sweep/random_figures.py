"""Figures of a random or chaotic response of a sweep: statistics with 95 % intervals besides its peaks.

A random response counts as settled where the rms of every probe is judged "good". One whose record is too short, or
whose figures rise or fall, is "not settled": it cannot tell whether responses coexist.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray as xr

from gapbeam.postprocess.signals.periodicity import NOT_SETTLED
from gapbeam.postprocess.signals.steady_figures import figures_of_record
from gapbeam.postprocess.study_figures.response_census import RANDOM
from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import Doubts
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.stop_rule import gathered_statistics, statistics_of
from gapbeam.studies.sweep.window_data import as_data

GOOD, BIASED = "good", "biased"
RMS = ("rms", "lateral_rms")


def statistics_of_response(model: Model, interval: float) -> RunStatistics | None:
    """Return the statistics to gather of a response; None where it is no transient.

    A response to a periodic force may turn out chaotic: its statistics are gathered, too. Its force holds it up, so
    that the damping of the beam is no time that its motion remembers.

    Args:
        model: The model.
        interval: Time between records, s.
    """
    if not isinstance(model.case.analysis, Transient):
        return None
    every = max(1, round(interval / model.step))
    return statistics_of(model, every) or gathered_statistics(model, every)


def random_response(
    history: xr.Dataset,
    statistics: RunStatistics | None,
    after: float | None,
    notes: list[str],
    doubts: Doubts | None = None,
) -> dict[str, Any]:
    """Return word and figures of a random response.

    Args:
        history: Its records.
        statistics: Its statistics.
        after: Time from which peaks count, s; statistics find their own start.
        notes: Gets what is to be said about it.
        doubts: On the figures of its statistics.

    Raises:
        SignalError: No probe, nothing after that time, or values that are not finite.
    """
    quantities, words = figures_of_record(history, after)
    found = {} if statistics is None else statistics.describe(doubts)
    verdicts = {one["verdict"] for one in found.get("figures", ()) if one["name"].rpartition(".")[2] in RMS}
    settled = bool(verdicts) and verdicts <= {GOOD, BIASED}
    notes += ["the forcing is random: statistics with 95 % intervals; displacements, accelerations and peak forces are "
              "largest values, which grow with the record", *words]  # fmt: skip
    if not settled:
        doubt = "figures rise or fall" if NOT_SETTLED in verdicts else "the record is too short for an interval"
        notes.append(f"not settled: {doubt}; try a larger time.end")
    data: dict[str, Any] = {
        "response": RANDOM if settled else NOT_SETTLED,
        "windows": 1,
        "figures": as_data(quantities),
    }
    return with_intervals(data, found)


def with_intervals(data: dict[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """Return the record of a response with its statistics, as far as they are judged good, among its figures.

    Args:
        data: With `figures`.
        found: Described statistics of the response; empty: there are none.
    """
    if not found:
        return data
    known = {
        one["name"]: {"unit": one["unit"], "mean": one["value"], "low": one["low"], "high": one["high"]}
        | {"scatter": 0.5 * (one["high"] - one["low"]), "unsettled": 0.0}
        for one in found["figures"]
        if one["verdict"] == GOOD
    }
    return data | {"figures": data["figures"] | known, "statistics": found}
