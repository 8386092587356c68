"""What a sweep leaves behind: one table of all responses, the census, and a picture."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.sections.sweep_section import ENSEMBLES_FILE
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE
from gapbeam.postprocess.study_figures.response_census import Branch, SweepPoint
from gapbeam.postprocess.study_figures.sweep_branches import draw_branches
from gapbeam.solver.run.output.results_folder import finite, write_beside
from gapbeam.studies.sweep.seed_ensembles import Ensemble, ensembles_of

PLAIN = ("direction", "start", "verdict", "response", "period", "repeats_within", "transient", "windows")
FIGURES = ("periods_in_a_window", "created", "residual", "penetration", "peak_force")


def write_tables(folder: Path, records: Sequence[Mapping[str, Any]], points: Sequence[SweepPoint]) -> list[Path]:
    """Write sweep.csv (a row a response), sweep.json (all that is known of it), census.json and sweep.png.

    Where points differ in the seeds of noise only, ensembles.json has their pooled statistics.

    Returns:
        The files.
    """
    paths = [folder / name for name in ("sweep.csv", "sweep.json", "census.json", "sweep.png")]
    rows = [_row(record) for record in records]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with paths[0].open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)
    write_beside(paths[1], json.dumps(list(records), indent=1) + "\n")
    write_beside(paths[2], json.dumps([_as_data(point) for point in points], indent=1) + "\n")
    ensembles = ensembles_of(records)
    pooled = folder / ENSEMBLES_FILE
    pooled.unlink(missing_ok=True)
    if ensembles:
        write_beside(pooled, json.dumps(finite([one.as_data() for one in ensembles]), indent=1) + "\n")
    more = [pooled] if ensembles else []
    if any(point.branches for point in points):
        draw_branches(points, paths[3])
        return [*paths, *more]
    return [*paths[:3], *more]


def _row(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record as one flat row; accelerations in g too."""
    row: dict[str, Any] = dict(record["values"])
    row |= {name: record.get(name) for name in PLAIN + FIGURES}
    row |= {f"{name} (s)": value for name, value in (record.get("seconds") or {}).items()}
    for name, figure in (record.get("figures") or {}).items():
        row[f"{name} ({figure['unit']})"] = figure["mean"]
        row[f"{name} scatter ({figure['unit']})"] = figure["scatter"]
        if "low" in figure:
            row |= {f"{name} {end} ({figure['unit']})": figure[end] for end in ("low", "high")}
        if "mean_in_g" in figure:
            row[f"{name} (g)"] = figure["mean_in_g"]
    return row | {"message": record["message"], "notes": "; ".join(record["notes"])}


def _as_data(point: SweepPoint) -> dict[str, Any]:
    return {
        "values": point.values,
        "responses": [
            {
                "response": branch.word,
                "reached": branch.count,
                "reached_from": branch.reached_from,
                "figures": {
                    name: {"mean": mean, "scatter": scatter, "unit": unit}
                    for name, (mean, scatter, unit) in branch.figures.items()
                },
            }
            for branch in point.branches
        ],
        "did_not_pass": [
            {name: record.get(name) for name in ("start", "direction", "verdict", "message", "notes")}
            for record in point.failures
        ],
    }


def ensemble_table(one: Ensemble) -> Table:
    """Return the pooled figures of an ensemble for the terminal."""
    where = ", ".join(f"{key} = {value}" for key, value in one.values.items())
    title = f"{one.members} members together{f', {where}' if where else ''}"
    heads = ("figure", "value", "95 % interval", "+-", "independent", "variance x T", "s for 2 %", "judged")
    table = Table(*heads, box=None, title=title, title_justify="left")
    for figure in one.figures:
        known = figure["relative"] is not None
        unit = "" if figure["unit"] == "1" else f" {figure['unit']}"
        table.add_row(
            figure["name"],
            f"{figure['value']:.4g}{unit}",
            f"{figure['low']:.4g} to {figure['high']:.4g}",
            f"{figure['relative']:.1%}" if known else "",
            f"{figure['effective_samples']:.0f}",
            f"{figure['relative_variance_times_time']:.3g} s" if known else "",
            f"{figure['time_for_2_percent']:.3g}" if known else "",
            figure["verdict"],
        )
    return table


def census_table(points: Sequence[SweepPoint]) -> Table:
    """Return the census for the terminal: a row a response of a point."""
    names = _amplitudes(branch for point in points for branch in point.branches)
    heads = [f"{name}, {shown(unit)[0]}" for name, unit in names.items()]
    table = Table(*points[0].values, "response", "reached", *heads, box=None, title="Responses", title_justify="left")
    for point in points:
        for branch in point.branches:
            cells = [_cell(branch, name) for name in names]
            ways = ", ".join(f"{way}" for way in dict.fromkeys(branch.reached_from))
            table.add_row(*point.values.values(), branch.word, f"{branch.count} ({ways})", *cells)
        for record in point.failures:
            words = record["verdict"] if record["verdict"] != "passed" else "no figures"
            start = " ".join(filter(None, (record["start"], record["direction"])))
            table.add_row(*point.values.values(), words, f"from {start}" if start else "", *("" for _ in names))
    return table


def _amplitudes(branches: Iterable[Branch]) -> dict[str, str]:
    """Return names and units of what the terminal shows."""
    names: dict[str, str] = {}
    for branch in branches:
        for name, (_, _, unit) in branch.figures.items():
            if name.endswith((" smoothed acceleration", " displacement", f" {LARGEST_FORCE}", ".rms")):
                names.setdefault(name, unit)
    return names


def _cell(branch: Branch, name: str) -> str:
    if name not in branch.figures:
        return "-"
    mean, scatter, unit = branch.figures[name]
    factor = shown(unit)[1]
    return f"{factor * mean:.4g}" + (f" ± {factor * scatter:.2g}" if scatter > 5e-4 * abs(mean) else "")
