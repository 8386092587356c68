"""A trade-off as a table, as plain data that `gapbeam run --tolerance` reads again, and as a picture."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from rich.table import Table

from gapbeam.postprocess.study_figures.tradeoff_figure import Place, draw_pareto
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.studies.tradeoff.level_errors import GROUPS, Judged, percent
from gapbeam.studies.tradeoff.tradeoff_study import TradeoffStudy

DATA_FILE = "tradeoff.json"
PICTURE = "tradeoff.png"


def write_study(folder: Path, study: TradeoffStudy, key: Mapping[str, Any]) -> list[Path]:
    """Write tradeoff.json and tradeoff.png.

    Args:
        folder: Made if it is not there.
        study: The trade-off.
        key: Inputs of the study, see `gapbeam.studies.tradeoff.run_tradeoff.study_key`.

    Returns:
        The files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_beside(folder / DATA_FILE, json.dumps(as_data(study, key), indent=1, allow_nan=False) + "\n")
    places = [
        Place(one.level.name, one.seconds, one.error, one in study.front, one is study.chosen)
        for one in study.levels
        if one.measured.verdict == "passed"
    ]
    picture = folder / PICTURE
    draw_pareto(places, max(study.grounds.uncertainty.values(), default=0.0), study.tolerance, picture)
    return [folder / DATA_FILE, picture]


def as_data(study: TradeoffStudy, key: Mapping[str, Any]) -> dict[str, Any]:
    """Return a trade-off as plain data in SI units."""
    return {
        "key": dict(key),
        "tolerance": study.tolerance,
        "chosen": study.chosen.level.name if study.chosen else None,
        "verdict": verdict(study),
        "promised": study.promised,
        "doubts": study.doubts,
        "end": study.grounds.end,
        "covered": study.reference.covered,
        "not_covered_because": study.grounds.cut,
        "periods_compared": study.periods,
        "chaotic": study.grounds.chaotic,
        "seconds": study.seconds,
        "notes": list(study.notes),
        "fixed": dict(study.plan.fixed),
        "reference": _row(study.reference, study),
        "uncertainty": dict(study.grounds.uncertainty),
        "reduced_against_full_on_the_mesh_of_the_case": study.full_check,
        "rungs": [_row(one, study) for one in study.levels],
        "skipped": [{"name": level.name, "predicted_seconds": seconds} for level, seconds in study.skipped],
    }


def _row(one: Judged, study: TradeoffStudy) -> dict[str, Any]:
    measured = one.measured
    return {
        "name": one.level.name,
        "changes": dict(one.level.changes),
        "verdict": measured.verdict,
        "message": measured.message,
        "dofs": measured.dofs,
        "mesh_dofs": measured.mesh_dofs,
        "step": measured.step,
        "set_up": measured.set_up,
        "per_simulated_second": measured.per_second,
        "seconds_of_the_case": one.seconds,
        "memory": measured.memory,
        "energy_residual": measured.residual if isfinite(measured.residual) else None,
        "errors": one.errors,
        "covered": one.covered,
        "below_the_uncertainty": [
            name for name, error in one.errors.items() if error <= study.grounds.uncertainty[name]
        ],
        "statistics_beyond_scatter": _finite(one.statistics),
        "means_known_to": _finite(one.means),
        "other_cycle": one.statistics is not None and not isfinite(one.statistics),
        "responses": measured.words,
        "on_the_front": one in study.front,
        "long": {
            name: {"unit": figure.unit, "mean": figure.mean, "standard_error": figure.uncertainty}
            for name, figure in measured.long.items()
        },
    }


def as_table(study: TradeoffStudy) -> Table:
    """Return a trade-off for the terminal, fidelity levels from cheap to expensive."""
    table = Table(
        "", "DOFs", "set-up, s", "s per simulated s", "case, s", "memory, GB", "errors up to, s",
        *(f"{name}, %" for name in GROUPS), "means",
        title=f"Errors against {study.reference.level.name}", title_justify="left", box=None,
    )  # fmt: skip
    uncertain = [f"± {100 * study.grounds.uncertainty.get(name, 0.0):.2g}" for name in GROUPS]
    covered = f"{study.reference.covered:.3g}"
    table.add_row("the reference itself", *_costs(study.reference), covered, *uncertain, "")
    for one in sorted(study.levels, key=lambda one: one.seconds):
        mark = "* " if one is study.chosen else "  "
        if one.measured.verdict != "passed":
            table.add_row(f"  {one.level.name}", one.measured.verdict)
            continue
        cells = [_error(one, name, study) for name in GROUPS]
        table.add_row(mark + one.level.name, *_costs(one), f"{one.covered:.3g}", *cells, _means(one))
    return table


def verdict(study: TradeoffStudy) -> str:
    """Return the result of a trade-off in a sentence or two: the level to take, the span, and every doubt."""
    asked, grounds = f"{100 * study.tolerance:.3g} %", study.grounds
    doubt = f" The tolerance is not promised: {'; '.join(study.doubts)}." if study.doubts else ""
    if study.chosen is None:
        span = grounds.span_words(study.reference.covered)
        return f"no fidelity level is within {asked} of the reference {span}.{doubt}"
    one = study.chosen
    return (
        f"the cheapest fidelity level within {asked} of the reference {grounds.span_words(one.covered)}: "
        f"{one.level.name}, {percent(one.error)} off, {one.seconds:.3g} s for the case.{doubt}"
    )


def _costs(one: Judged) -> list[str]:
    measured = one.measured
    return [
        f"{measured.dofs}",
        f"{measured.set_up:.3g}",
        f"{measured.per_second:.3g}",
        f"{one.seconds:.3g}",
        f"{measured.memory / 1e9:.2f}",
    ]


def _error(one: Judged, name: str, study: TradeoffStudy) -> str:
    error = one.errors.get(name)
    if error is None:
        return "-"
    text = f"{100 * error:.2g}"
    return f"({text})" if error <= study.grounds.uncertainty.get(name, 0.0) else text


def _means(one: Judged) -> str:
    if one.statistics is None:
        return ""
    if not isfinite(one.statistics):
        return "another cycle"
    return "agree" if one.statistics <= 0.0 else f"{100 * one.statistics:.2g} % beyond"


def _finite(value: float | None) -> float | None:
    return value if value is not None and isfinite(value) else None
