"""Reports on sweeps (every response of every point, how often each was reached) and on studies of uncertain values.

Equal warnings of several signals become one, with the names of the signals and the range of each number.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown_by
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    Listing,
    Picture,
    ReportSection,
    TableBlock,
    Verdict,
    number,
    picture_section,
    statistics_row,
    warnings_of,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve, Mode
from gapbeam.postprocess.report.study_json import read_object, read_records
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE
from gapbeam.postprocess.study_figures.study_axis import StudyAxis, axis_of, si_key, value_words
from gapbeam.postprocess.study_figures.sweep_branches import (
    Branch,
    SweepPoint,
    census,
    census_words,
    figure_unit,
    grid_of,
    start_words,
)
from gapbeam.solver.messages.wording import counted

_SIGNAL = re.compile(r"((?:[^:]+: )?(?:smoothed acceleration|acceleration|velocity|displacement)): (.+)", re.DOTALL)
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def alike(texts: Sequence[str]) -> list[str]:
    """Return warnings in their order, those that differ by their signal and by numbers alone as one.

    Args:
        texts: "velocity: lines of 2 % ...", "tip: acceleration: lines of 50 % ...", or anything else.
    """
    found: dict[str, tuple[list[str], list[list[str]]]] = {}
    for text in texts:
        match = _SIGNAL.fullmatch(text)
        name, rest = (match[1], match[2]) if match else ("", text)
        key = _NUMBER.sub("\0", rest) if name else f"\n{text}"
        names, numbers = found.setdefault(key, ([], []))
        names.append(name.replace(": ", " "))
        numbers.append(_NUMBER.findall(rest))
    return [_joined(key, names, numbers) if names[0] else key[1:] for key, (names, numbers) in found.items()]


def _joined(key: str, names: Sequence[str], numbers: Sequence[Sequence[str]]) -> str:
    spans = iter([_span(list(column)) for column in zip(*numbers, strict=True)])
    return f"{', '.join(names)}: {re.sub(chr(0), lambda _: next(spans), key)}"


def _span(values: Sequence[str]) -> str:
    """Return a number, or the smallest and the largest of several."""
    low, high = min(values, key=float), max(values, key=float)
    return low if float(low) == float(high) else f"{low} to {high}"


SWEEP_FILE, PLAN_FILE, PICTURE = "sweep.json", "plan.json", "sweep.png"
MAP_FILE = "sweep-map.png"
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
        command: Command that makes the report.

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
    if (folder / MAP_FILE).is_file():
        curves.insert(0, Picture(folder / MAP_FILE, _map_words(points)))
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
        title = (
            f"{counted(one['members'], 'member')}, {number(one['seconds'])} s together{f', {where}' if where else ''}"
        )
        rows = [statistics_row(figure) for figure in one["figures"]]
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
        blocks.append(Verdict("passed", f"All {len(records)} responses at {counted(len(points), 'point')} passed."))
    several, *unsettled = census_words(points)
    if any(point.coexisting > 1 for point in points):
        blocks.append(Verdict("note", f"{several.capitalize()}."))
    blocks += [Verdict("warning", f"{words.capitalize()}.") for words in unsettled]
    notes = Counter(note for record in records for note in record.get("notes") or ())
    return [*blocks, *warnings_of([f"{note} ({count} of {len(records)})" for note, count in notes.most_common(10)])]


def shown_figures(points: Sequence[SweepPoint]) -> dict[str, tuple[str, float]]:
    """Return the figures of a sweep that its report shows, with the units shown and the factors to them.

    Those of one's own, and the usual ones.
    """
    branches = [branch for point in points for branch in point.branches]
    members = [member["figures"] for branch in branches for member in branch.members]
    names = [name for figures in members for name, one in figures.items() if one.get("own")]
    names += [name for branch in branches for name in branch.figures if name.endswith(SHOWN)]
    return {name: figure_unit(points, name) for name in dict.fromkeys(names)}


def _response_curves(points: Sequence[SweepPoint], command: str) -> list[Block]:
    """Return a chart of every figure over the last key, with a button for each value of the other keys."""
    along = axis_of([point.values for point in points], points[0].units)
    return [_response_curve(points, name, unit, along, command) for name, unit in shown_figures(points).items()]


def _response_curve(
    points: Sequence[SweepPoint], name: str, unit: tuple[str, float], along: StudyAxis, command: str
) -> Chart:
    parts: dict[tuple[str, str | None], list[tuple[float, float, float, str]]] = {}
    label, factor = unit
    for point in points:
        for branch in point.branches:
            if name not in branch.figures:
                continue
            mean, scatter = (factor * value for value in branch.figures[name][:2])
            text = _point_words(point, branch, name, mean, scatter, label)
            for direction in dict.fromkeys(str(member["direction"]) for member in branch.members):
                words = ", ".join(filter(None, (branch.word, _WAYS.get(direction, direction))))
                place = (along.place(point.values), mean, scatter, text)
                parts.setdefault((words, along.others(point.values)), []).append(place)
    curves = []
    for (words, others), found in sorted(parts.items(), key=lambda entry: entry[0][0]):
        found.sort()
        x, y, bars, texts = zip(*found, strict=True)
        mode: Mode = "lines+markers" if len(set(x)) == len(x) else "markers"
        curves.append(ChartCurve(words, x, y, mode, others, texts=texts, bars=bars if any(bars) else ()))
    ends = [value for curve in curves for value in curve.y]
    first, last = (value_words(one, along.units.get(along.key, "")) for one in (along.texts[0], along.texts[-1]))
    return Chart(
        f"Every response over `{along.key}`: {name}, {number(min(ends))} to {number(max(ends))} {_unit(label)}over "
        f"{first} to {last}. Bars are the scatter over windows and starts, of statistics the 95 % "
        f"interval.{along.legend}",
        along.title,
        f"{name} ({label})",
        curves,
        command,
        choices=[choice for choice in along.choices if choice in {curve.choice for curve in curves}],
        choice="",
        log_x=along.is_logarithmic,
    )


def _map_words(points: Sequence[SweepPoint]) -> str:
    """Return the caption of the map: its keys and figures with their ranges."""
    found = grid_of(points)
    if found is None:
        return "Figures over the two keys of the sweep."
    keys, *axes = found
    units = points[0].units
    ends = [[value_words(f"{end:.6g}", units.get(key, "")) for end in (axis[0], axis[-1])]
            for key, axis in zip(keys, axes, strict=True)]  # fmt: skip
    ranges = [f"`{key}` {low} to {high}" for key, (low, high) in zip(keys, ends, strict=True)]
    return (
        f"Figures over {' and '.join(ranges)}, of the response that most starts reached. Crosses: a response did not "
        "pass; rings: responses coexist."
    )


def _unit(label: str) -> str:
    return "" if label == "1" else f"{label} "


def _point_words(point: SweepPoint, branch: Branch, name: str, mean: float, scatter: float, unit: str) -> str:
    values = [f"{key} = {value_words(value, point.units.get(key, ''))}" for key, value in point.values.items()]
    spread = f" ± {scatter:.2g}" if scatter > 0.0 else ""
    reached = f"{branch.word}, reached {branch.count} times: {', '.join(dict.fromkeys(branch.reached_from))}"
    return "\n".join([*values, f"{name}: {mean:.5g}{spread} {unit}", reached])


def _harmonics(points: Sequence[SweepPoint], command: str) -> Chart | None:
    """Return the harmonics of every response, with a button for every point; None for many points or none."""
    curves = []
    every = [branch.figures for point in points for branch in point.branches]
    unit, factor = shown_by("m", (figures[name][0] for figures in every for name in figures if " harmonic " in name))
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
                curves.append(
                    ChartCurve(name, range(1, ORDERS + 1), factor * np.array(heights), "lines+markers", label)
                )
    choices = list(dict.fromkeys(str(curve.choice) for curve in curves))
    if not curves or len(choices) > BUTTONS:
        return None
    return Chart(
        "Harmonics of the displacement of every response, the one that was reached most often first.",
        "harmonic of the forcing", f"amplitude ({unit})", curves, command, log_y=True, choices=choices,
        choice=", ".join(points[0].values),
    )  # fmt: skip


def _census_table(points: Sequence[SweepPoint]) -> TableBlock:
    keys = list(points[0].values)
    names = shown_figures(points)
    rows: list[tuple[Cell, ...]] = []
    for point in points:
        for branch in point.branches:
            ways = ", ".join(dict.fromkeys(branch.reached_from))
            cells: list[Cell] = []
            for name, (_, factor) in names.items():
                value = branch.figures.get(name)
                cells.append(None if value is None else factor * value[0])
            rows.append((*point.values.values(), branch.word, branch.count, ways, *cells))
        for record in point.failures:
            outcome = record["verdict"] if record["verdict"] != "passed" else "no figures"
            found = record.get("figures") or {}
            cells = [factor * found[name]["mean"] if name in found else None for name, (_, factor) in names.items()]
            rows.append((*point.values.values(), outcome, None, start_words(record), *cells))
    heads = (
        *(si_key(key, points[0].units) for key in keys),
        "response",
        "reached",
        "from",
        *(f"{name} ({label})" for name, (label, _) in names.items()),
    )
    return TableBlock("Every response of every point, peak to peak over its windows", heads, rows)


UNCERTAIN_FILE, UNCERTAIN_PICTURE = "uncertain.json", "uncertain.png"
TABLES = {
    "probabilities": "Probabilities with 95 % intervals",
    "distributions": "Figures of each response: mean with 95 % interval, standard deviation, quantiles",
    "sobol-indices": "Sobol indices with 95 % intervals, and from half of the points",
    "convergence": "Probabilities from a part of the members",
}


def uncertain_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the verdict, the picture and the tables.

    Args:
        folder: As a study of uncertain values left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    del command
    (record,) = read_records(folder / UNCERTAIN_FILE, ("headline", "complete", *TABLES))
    blocks: list[Block] = [Verdict("passed" if record["complete"] else "warning", str(record["headline"]))]
    for name, caption in TABLES.items():
        heads, rows = record[name]["heads"], record[name]["rows"]
        if rows:
            blocks.append(TableBlock(caption, tuple(heads), [tuple(row) for row in rows], digits=4))
    caption = "Figures of all members by response; dashed: limits."
    return [
        ReportSection("Summary", "summary", blocks),
        *picture_section(folder / UNCERTAIN_PICTURE, caption, "gapbeam.uncertain"),
    ]
