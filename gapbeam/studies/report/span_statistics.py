"""Statistics of a span of a run, and its wear, from the sums over time that its records hold.

Records lack the squares of forces and the approach speeds, whose figures are left out. So are records before the first
one of the span, and no burn-in is cut but the span's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gapbeam.postprocess.results.run_watch import SpanOfRun
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.statistics.run_statistics import SUMMED, RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import RMS_FORCE, WORK_RATE, Doubts
from gapbeam.solver.record_table import CASE_FILE
from gapbeam.solver.run.stop_rule import decay_time, has_statistics
from gapbeam.solver.run.wear_rates import all_rates, work_rate

UNKNOWN = (RMS_FORCE, "approach_speed")
"""Figures that records do not hold."""
MOTIONS = ("displacement", "acceleration_absolute")


def statistics_of_span(run: SpanOfRun) -> dict[str, Any] | None:
    """Return the statistics of a span, as the summary of a run has them; None for a run without any.

    Raises:
        UserError: The case of the results cannot be read.
    """
    if not run.summary.get("statistics"):
        return None
    case = read_case(run.folder / CASE_FILE)
    history = run.history
    if not has_statistics(case) or "contact_time" not in history or "closings" not in history:
        return None
    faces = tuple(str(name) for name in history["face"].values)
    probes = tuple(str(name) for name in history["probe"].values) if "probe" in history.coords else ()
    times = np.asarray(history["time"].values, dtype=float)
    slides = {"sliding_work", "work_by_mode"} <= set(history.variables)
    found = RunStatistics(
        faces, probes, bends_in_two_planes(case), float(np.median(np.diff(times))), decay_time(case), slides
    )
    none = np.zeros((len(times), len(faces)))
    wanted = (*SUMMED, *(("sliding_work", "work_by_mode") if slides else ()), *(MOTIONS if probes else ()))
    rows = {name: np.asarray(history[name].values, dtype=float) if name in history else none for name in wanted}
    found.see(rows | {"time": times})
    described = found.describe(Doubts.restored(run.summary["statistics"]))
    kept = [one for one in described["figures"] if one["name"].rpartition(".")[2] not in UNKNOWN]
    return described | {"figures": kept}


def wear_of_span(run: SpanOfRun, statistics: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return the summary's entry on wear, of a span; None for a run without [wear].

    Work and its parts are differences of records. Maps are of the whole run: records do not hold the points.

    Args:
        run: The span.
        statistics: Of its records, with their intervals; None: the run has none.
    """
    whole, history = run.summary.get("wear"), run.history
    if not whole or "sliding_work" not in history:
        return None
    seconds = run.times[1] - run.times[0]
    known = {one["name"]: one for one in (statistics or {}).get("figures", ())}
    faces = {}
    for name, of_run in whole["faces"].items():
        work = _change(history["sliding_work"].sel(worn_face=name).values)
        found = {"work": work, "coefficient": of_run.get("coefficient"), "area": of_run.get("area")}
        rate = work_rate(work, seconds, known.get(f"face.{name}.{WORK_RATE}"))
        if "work_by_mode" in history:
            parts = history["work_by_mode"].sel(worn_face=name)
            modes = {str(mode): _change(parts.sel(slip_mode=mode).values) for mode in parts["slip_mode"].values}
            found["work_by_mode"] = modes
            found["work_rate_by_mode"] = {
                mode: work_rate(part, seconds, known.get(f"face.{name}.{mode}_{WORK_RATE}"))
                for mode, part in modes.items()
            }
        faces[name] = found | all_rates(rate, found["coefficient"], found["area"])
    kept = {key: whole.get(key) for key in ("area", "impact_time", "sticking_speed")}
    return kept | {"seconds": seconds, "faces": faces}


def _change(values: np.ndarray) -> float:
    return float(values[-1] - values[0])
