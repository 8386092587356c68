"""The report on a sweep: every response of every point, how often each was reached, what did not pass."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    Listing,
    Picture,
    ReportSection,
    TableBlock,
    Verdict,
    number,
    warnings_of,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.sections.study_axis import StudyAxis, axis_of
from gapbeam.postprocess.report.study_json import read_object, read_records
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE
from gapbeam.postprocess.study_figures.response_census import Branch, SweepPoint, census, census_words

SWEEP_FILE, PLAN_FILE, PICTURE = "sweep.json", "plan.json", "sweep.png"
ENSEMBLES_FILE = "ensembles.json"
ENSEMBLE_HEADER = ("figure", "value", "unit", "95 % interval", "independent samples", "judged", "s for 2 %")
SHOWN = (".rms", " smoothed acceleration", " displacement", f" {LARGEST_FORCE}")
ORDERS = 5
BUTTONS = 24  # points that get a button each
TOLERANCE = 0.02  # of amplitudes that are the same, where the plan does not say
_WAYS = {"up": "carried up", "down": "carried down", "": ""}


def sweep_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return census, response curves, harmonics of every point and failures of a sweep.

    Args:
        folder: As `gapbeam sweep` left it.
        command: That makes the report.

    Raises:
        ResultsError: A file cannot be read, or is no sweep.
    """
    records = read_records(folder / SWEEP_FILE, ("values", "verdict", "start", "direction", "message"))
    plan = read_object(folder / PLAN_FILE) if (folder / PLAN_FILE).is_file() else {}
    points = census(records, float(plan.get("--tolerance") or TOLERANCE))
    sections = [ReportSection("Summary", "summary", _summary(records, points))]
    curves = _response_curves(points, command)
    if not curves and (folder / PICTURE).is_file():
        curves = [Picture(folder / PICTURE, "Responses over the last key of the sweep.")]
    if curves:
        sections.append(ReportSection("Response curves", "response-curves", curves))
    harmonics = _harmonics(points, command)
    if harmonics is not None:
        sections.append(ReportSection("Harmonics", "harmonics", [harmonics]))
    sections.append(ReportSection("Responses", "responses", [_census_table(points)]))
    if ensembles := _ensembles(folder):
        sections.append(ReportSection("Members together", "ensembles", ensembles))
    asked = "\n".join(f"{key} = {value}" for key, value in plan.items() if value is not None)
    if asked:
        sections.append(ReportSection("The sweep", "plan", [Listing("What the sweep was asked for", asked)]))
    return sections


def _ensembles(folder: Path) -> list[Block]:
    """Return a table for each ensemble of seeds; none where the sweep has none."""
    path = folder / ENSEMBLES_FILE
    if not path.is_file():
        return []
    blocks: list[Block] = []
    for one in read_records(path, ("values", "members", "seconds", "figures")):
        where = ", ".join(f"{key} = {value}" for key, value in one["values"].items())
        title = f"{one['members']} members, {number(one['seconds'])} s together{f', {where}' if where else ''}"
        rows = [
            (
                figure["name"],
                figure["value"],
                "" if figure["unit"] == "1" else figure["unit"],
                f"{number(figure['low'])} to {number(figure['high'])}",
                f"{figure['effective_samples']:.0f}",
                figure["verdict"],
                "" if figure["time_for_2_percent"] is None else number(figure["time_for_2_percent"]),
            )
            for figure in one["figures"]
        ]
        blocks.append(TableBlock(title, ENSEMBLE_HEADER, rows))
    return blocks


def _summary(records: Sequence[dict[str, Any]], points: Sequence[SweepPoint]) -> list[Block]:
    failed = [record for record in records if record["verdict"] != "passed"]
    blocks: list[Block] = []
    for verdict, count in Counter(record["verdict"] for record in failed).most_common():
        message = next(str(record["message"]) for record in failed if record["verdict"] == verdict).splitlines()
        first = f" First of them: {message[0]}" if message else ""
        blocks.append(Verdict("error", f"**{count} of {len(records)} responses did not pass: {verdict}.**{first}"))
    if not failed:
        blocks.append(Verdict("passed", f"All {len(records)} responses at {len(points)} points passed."))
    several, *unsettled = census_words(points)
    if any(point.coexisting > 1 for point in points):
        blocks.append(Verdict("note", f"{several}."))
    blocks += [Verdict("warning", f"{words}.") for words in unsettled]
    notes = Counter(note for record in records for note in record.get("notes") or ())
    return [*blocks, *warnings_of([f"{note} ({count} of {len(records)})" for note, count in notes.most_common(10)])]


def _response_curves(points: Sequence[SweepPoint], command: str) -> list[Block]:
    """Return a chart of every figure over the last key, with a button for each value of the other keys."""
    names = dict.fromkeys(name for point in points for branch in point.branches for name in branch.figures)
    along = axis_of([point.values for point in points])
    blocks: list[Block] = []
    for ending in SHOWN:
        for name in (name for name in names if name.endswith(ending)):
            chart = _response_curve(points, name, along, command)
            if chart is not None:
                blocks.append(chart)
    return blocks


def _response_curve(points: Sequence[SweepPoint], name: str, along: StudyAxis, command: str) -> Chart | None:
    parts: dict[tuple[str, str | None], list[tuple[float, float, str]]] = {}
    unit = ""
    for point in points:
        for branch in point.branches:
            if name not in branch.figures:
                continue
            mean, scatter, unit = branch.figures[name]
            factor = shown(unit)[1]
            text = _point_words(point, branch, name, factor * mean, factor * scatter, shown(unit)[0])
            for direction in dict.fromkeys(str(member["direction"]) for member in branch.members):
                label = ", ".join(filter(None, (branch.word, _WAYS.get(direction, direction))))
                place = (along.place(point.values), factor * mean, text)
                parts.setdefault((label, along.others(point.values)), []).append(place)
    if not parts:
        return None
    curves = []
    for (label, others), found in sorted(parts.items(), key=lambda entry: entry[0][0]):
        found.sort()
        x, y, texts = zip(*found, strict=True)
        curves.append(ChartCurve(label, x, y, "markers", others, texts=texts))
    return Chart(
        f"Every response over `{along.key}`: {name}. Point at a mark for its scatter and how often it was reached."
        f"{along.legend}",
        along.title,
        f"{name} ({shown(unit)[0]})",
        curves,
        command,
        choices=[choice for choice in along.choices if choice in {curve.choice for curve in curves}],
        choice="",
    )


def _point_words(point: SweepPoint, branch: Branch, name: str, mean: float, scatter: float, unit: str) -> str:
    values = [f"{key} = {value}" for key, value in point.values.items()]
    spread = f" ± {scatter:.2g}" if scatter > 0.0 else ""
    reached = f"{branch.word}, reached {branch.count} times: {', '.join(dict.fromkeys(branch.reached_from))}"
    return "\n".join([*values, f"{name}: {mean:.5g}{spread} {unit}", reached])


def _harmonics(points: Sequence[SweepPoint], command: str) -> Chart | None:
    """Return the harmonics of every response, with a button for every point; None for many points or none."""
    curves = []
    for point in points:
        label = ", ".join(point.values.values())
        for place, branch in enumerate(point.branches, start=1):
            for probe in dict.fromkeys(
                name.rsplit(" harmonic ", 1)[0] for name in branch.figures if " harmonic " in name
            ):
                heights = [
                    branch.figures.get(f"{probe} harmonic {n}", (np.nan, 0.0, "m"))[0] for n in range(1, ORDERS + 1)
                ]
                name = f"{probe}, response {place}"
                values = shown("m")[1] * np.array(heights)
                curves.append(ChartCurve(name, range(1, ORDERS + 1), values, "lines+markers", label))
    choices = list(dict.fromkeys(str(curve.choice) for curve in curves))
    if not curves or len(choices) > BUTTONS:
        return None
    return Chart(
        "Harmonics of the displacement of every response, the one that was reached most often first.",
        "harmonic of the forcing", f"amplitude ({shown('m')[0]})", curves, command, log_y=True, choices=choices,
        choice=", ".join(points[0].values),
    )  # fmt: skip


def _census_table(points: Sequence[SweepPoint]) -> TableBlock:
    keys = list(points[0].values)
    names: dict[str, str] = {}
    for point in points:
        for branch in point.branches:
            names |= {name: unit for name, (_, _, unit) in branch.figures.items() if name.endswith(SHOWN)}
    rows: list[tuple[Cell, ...]] = []
    for point in points:
        for branch in point.branches:
            ways = ", ".join(dict.fromkeys(branch.reached_from))
            cells: list[Cell] = []
            for name, unit in names.items():
                found = branch.figures.get(name)
                cells.append(None if found is None else shown(unit)[1] * found[0])
            rows.append((*point.values.values(), branch.word, branch.count, ways, *cells))
        for record in point.failures:
            outcome = record["verdict"] if record["verdict"] != "passed" else "no figures"
            rows.append((*point.values.values(), outcome, None, str(record["start"]), *(None for _ in names)))
    heads = (*keys, "response", "reached", "from", *(f"{name} ({shown(unit)[0]})" for name, unit in names.items()))
    return TableBlock("Every response of every point, peak to peak over its windows", heads, rows)
