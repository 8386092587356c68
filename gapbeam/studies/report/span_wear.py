"""The wear of a span of a run, from the sums over time that its records hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gapbeam.postprocess.results.span_of_run import SpanOfRun
from gapbeam.solver.diagnostics.statistics.figure_doubts import WORK_RATE
from gapbeam.solver.run.wear_figures import all_rates, work_rate


def wear_of_span(run: SpanOfRun, statistics: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return what the summary of a run says about wear, of a span of it; None for a run without [wear].

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
