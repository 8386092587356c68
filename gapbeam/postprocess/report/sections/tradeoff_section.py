"""Reports on trade-offs, on stability studies of schemes, and on identifications with misfits around unknowns."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    Picture,
    ReportSection,
    TableBlock,
    Verdict,
    Words,
    cell,
    percent,
    warnings_of,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.html_page import sentence
from gapbeam.postprocess.report.study_json import read_object, read_records
from gapbeam.postprocess.study_figures.identification_figures import (
    CLOUD,
    abscissa,
    measured_unit,
    read_cloud,
    read_identification_data,
)
from gapbeam.postprocess.study_figures.stability_map import KINDS, LABELS, OTHERS, QUANTITIES, SCHEME, STEP, STIFFNESS

STABILITY_FILE = "stability.json"
Record = Mapping[str, Any]


def stability_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the counts of every scheme, the energy it creates over the step, the maps, and all trials.

    Args:
        folder: As `gapbeam stability` left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no such study.
    """
    records = read_records(folder / STABILITY_FILE, (STIFFNESS, STEP, SCHEME, "verdict", "created", "residual"))
    schemes = list(dict.fromkeys(str(record[SCHEME]) for record in records))
    bad = Counter(str(record["verdict"]) for record in records if record["verdict"] != "passed")
    blocks: list[Block] = [
        Verdict("warning", f"{sum(bad.values())} of {len(records)} trials did not pass: "
                           f"{', '.join(f'{count} {word}' for word, count in bad.most_common())}.")
        if bad
        else Verdict("passed", f"All {len(records)} trials passed.")
    ]  # fmt: skip
    blocks.append(_counts(records, schemes))
    sections = [ReportSection("Summary", "summary", blocks)]
    charts = [chart for chart in (_chart(records, schemes, key, command) for key in _SHOWN) if chart is not None]
    if charts:
        sections.append(ReportSection("Over the step", "over-the-step", charts))
    pictures = [
        Picture(folder / f"stability-{name}.png", f"Map of every scheme: {quantity.label}. Marks show how "
                "failed runs ended.", "gapbeam stability")
        for name, quantity in QUANTITIES.items()
        if (folder / f"stability-{name}.png").is_file()
    ]  # fmt: skip
    if pictures:
        sections.append(ReportSection("Maps", "maps", pictures))
    sections.append(ReportSection("All trials", "trials", [_table(records)]))
    return sections


_SHOWN = {
    "created": "energy created / exchanged",
    "relative_penetration": "largest penetration / clearance",
    "iterations": "contact iterations of a step, mean",
}


def _counts(records: Sequence[Record], schemes: Sequence[str]) -> TableBlock:
    verdicts = list(dict.fromkeys(str(record["verdict"]) for record in records))
    rows: list[tuple[Cell, ...]] = []
    for scheme in schemes:
        mine = [record for record in records if record[SCHEME] == scheme]
        counts = Counter(str(record["verdict"]) for record in mine)
        passed = [abs(float(record["residual"])) for record in mine if record["verdict"] == "passed"]
        rows.append((scheme, *(counts[verdict] for verdict in verdicts), max(passed, default=None)))
    heads = ("scheme", *verdicts, "largest residual of those that passed, of the energy exchanged")
    return TableBlock("How the trials of every scheme ended", heads, rows)


def _chart(records: Sequence[Record], schemes: Sequence[str], key: str, command: str) -> Chart | None:
    curves = []
    for scheme in schemes:
        for stiffness in sorted({str(record[STIFFNESS]) for record in records}, key=float):
            mine = [r for r in records if str(r[STIFFNESS]) == stiffness and r[SCHEME] == scheme]
            places = sorted(
                (float(r[STEP]), float(r[key]), str(r["verdict"])) for r in mine if (r.get(key) or 0.0) > 0.0
            )
            if places:
                x, y, texts = zip(*places, strict=True)
                text = [f"step {a:g} s: {b:.3g}\n{word}" for a, b, word in zip(x, y, texts, strict=True)]
                curves.append(ChartCurve(f"{stiffness} Pa/m", x, y, "lines+markers", scheme, texts=text))
    if not curves:
        return None
    choices = [scheme for scheme in schemes if any(curve.choice == scheme for curve in curves)]
    lacking = [scheme for scheme in schemes if scheme not in choices]
    words = f" Nothing above zero: {', '.join(lacking)}." if lacking else ""
    return Chart(
        f"{_SHOWN[key].capitalize()}, as far as it is above zero, a line a contact stiffness.{words}",
        LABELS[STEP], _SHOWN[key], curves, command, log_x=True, log_y=True, choices=choices, choice="scheme",
    )  # fmt: skip


def _table(records: Sequence[Record]) -> TableBlock:
    keys = [key for key in records[0] if "." in key]
    figures = ("verdict", "created", "residual", "relative_penetration", "peak_force", "iterations", "seconds")
    rows = [(*(str(record[key]) for key in keys), *(_cell(record.get(name)) for name in figures)) for record in records]
    heads = (*keys, "verdict", "created", "residual", "penetration / clearance", "largest force (N)", "iterations",
             "wall time (s)")  # fmt: skip
    return TableBlock("All trials; energies of the energy exchanged", heads, rows, digits=3)


def _cell(value: Any) -> Cell:
    return value if value is None or isinstance(value, str) else float(value)


TRADEOFF_FILE = "tradeoff.json"
Level = Mapping[str, Any]


def tradeoff_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the verdict, error over wall time, and a table of all fidelity levels.

    Args:
        folder: As `gapbeam tradeoff` left it.
        command: Command that makes the report.

    Raises:
        ResultsError: The file cannot be read, or is no trade-off.
    """
    found = read_object(folder / TRADEOFF_FILE, ("tolerance", "chosen", "verdict", "reference", "rungs", "uncertainty"))
    blocks: list[Block] = [Verdict("passed" if found.get("promised") else "warning", sentence(str(found["verdict"])))]
    if found.get("chaotic"):
        blocks.append(Verdict("note", "The response does not repeat: means over windows are compared."))
    blocks += warnings_of([str(note) for note in found.get("notes") or ()])
    blocks.append(_tradeoff_section_chart(found, command))
    blocks.append(_tradeoff_section_table(found))
    skipped = [(one["name"], float(one["predicted_seconds"])) for one in found.get("skipped") or ()]
    if skipped:
        blocks.append(
            TableBlock("Fidelity levels left out for their time", ("fidelity level", "predicted (s)"), skipped)
        )
    return [ReportSection("The trade-off", "tradeoff", blocks)]


def _error(level: Level) -> float | None:
    errors = level.get("errors") or {}
    return max((float(value) for value in errors.values()), default=None)


def _tradeoff_section_chart(found: Mapping[str, Any], command: str) -> Chart:
    curves, places = [], list[float]()
    for kind in (*KINDS, *OTHERS):
        levels = [(level, _error(level)) for level in found["rungs"] if level["name"].startswith(kind)]
        passed = [(level, error) for level, error in levels if level["verdict"] == "passed" and error]
        if passed:
            x = [float(level["seconds_of_the_case"]) for level, _ in passed]
            places += x
            texts = [
                f"{level['name']}: {100 * error:.3g} %, {level['seconds_of_the_case']:.3g} s" for level, error in passed
            ]
            curves.append(ChartCurve(kind, x, [100.0 * error for _, error in passed], "markers", texts=texts))
    ends = [min(places, default=1.0), max(places, default=10.0)]
    curves.append(ChartCurve("asked for", ends, [100.0 * float(found["tolerance"])] * 2, dashed=True))
    uncertain = 100.0 * max((float(value) for value in found["uncertainty"].values()), default=0.0)
    if uncertain > 0.0:
        curves.append(ChartCurve("uncertainty of the reference", ends, [uncertain] * 2, dashed=True))
    return Chart(
        "Largest error of a figure against the reference, over the wall time of the whole case.",
        "wall time of the case (s)", "largest error (%)", curves, command, log_x=True, log_y=True,
    )  # fmt: skip


def _tradeoff_section_table(found: Mapping[str, Any]) -> TableBlock:
    groups = list(found["uncertainty"])
    levels: Sequence[Level] = sorted(found["rungs"], key=lambda level: float(level["seconds_of_the_case"] or 0.0))
    rows: list[tuple[Cell, ...]] = []
    for level, mark in [(found["reference"], "reference"), *((level, _mark(level, found)) for level in levels)]:
        errors = level.get("errors") or {}
        cells = [100.0 * float(errors[name]) if name in errors else None for name in groups]
        memory = level.get("memory")
        rows.append(
            (
                level["name"], mark, level.get("dofs"), level.get("set_up"), level.get("per_simulated_second"),
                level.get("seconds_of_the_case"), None if memory is None else memory / 1e9, *cells,
            )
        )  # fmt: skip
    heads = ("fidelity level", "", "DOFs", "set-up (s)", "per simulated s (s)", "case (s)", "memory (GB)",
             *(f"{name} (%)" for name in groups))  # fmt: skip
    return TableBlock("Costs and errors of all fidelity levels", heads, rows, digits=3)


def _mark(level: Level, found: Mapping[str, Any]) -> str:
    if level["verdict"] != "passed":
        return str(level["verdict"])
    return "to take" if level["name"] == found["chosen"] else "on the front" if level.get("on_the_front") else ""


USES = {"fit": "fitted", "predict": "held out"}
IDENTIFICATION_FILE = "identification.json"
HIGHEST = 1e3  # sums of squares over the bound that are drawn


def identification_blocks(folder: Path, command: str = "") -> list[Block]:
    """Return the blocks on an identification, from its folder.

    Args:
        folder: Folder of `gapbeam identify`.
        command: Command that made the results.

    Raises:
        ResultsError: No identification there.
    """
    data = read_identification_data(folder)
    names = list(dict.fromkeys(row["figure"] for row in data["measurements"]))
    blocks: list[Block] = [_verdict(data)]
    blocks += [_comparison(data, name, command) for name in names]
    blocks += [_figure_chart(data, name, command) for name in names]
    blocks += [_unknowns(data, command), _misfit_chart(data, folder, command), _sensitivities(data, command)]
    notes = [note for note in data["notes"] if not note.startswith("WARNING")]
    return [*blocks, Words("\n".join(f"- {note}" for note in notes))] if notes else blocks


def _verdict(data: Mapping[str, Any]) -> Verdict:
    """Return the warnings, or how well the fit is where there are none."""
    loud = [note.removeprefix("WARNING: ") for note in data["notes"] if note.startswith("WARNING")]
    tolerance, rms = data["tolerance"], data["rms"]["fit"]
    if tolerance is not None and (rms is None or rms > tolerance):
        loud.insert(0, f"the fit misses its tolerance: rms {_number(rms)}, asked for {tolerance:g}")
    held_out = data["rms"]["predict"]
    words = f"rms of {data['residual']}: fitted {_number(rms)}"
    words += f", held out {_number(held_out)}" if held_out is not None else ""
    return Verdict("warning", "; ".join([*loud, words])) if loud else Verdict("passed", words)


def _comparison(data: Mapping[str, Any], name: str, command: str) -> TableBlock:
    mine = [row for row in data["measurements"] if row["figure"] == name]
    unit, factor = measured_unit(mine)
    rows: list[tuple[Cell, ...]] = []
    for row in mine:
        measured, computed, scatter = row["measured"], row["computed"], row["scatter"]
        words = cell(None if computed is None else factor * computed)
        words += "" if scatter is None else f" ± {cell(factor * scatter, 2)}"
        off = None if computed is None or measured == 0.0 else (computed - measured) / abs(measured)
        rows.append((f"{_experiment(row)} ({unit})", factor * measured, words, percent(off), _note(row, factor)))
    notes = ["± is the scatter of the computed figure over windows of whole forcing periods."]
    heads = ("", "measured", "gapbeam", "deviation", "")
    return TableBlock(f"{name}: {mine[0]['meaning']}", heads, rows, notes, command=command)


def _experiment(row: Mapping[str, Any]) -> str:
    parts = []
    for key, value in row["set"].items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        unit, factor = shown(row["set_units"][key], value if number else 0.0)
        parts.append(f"{key} = {factor * value:.4g} {unit}".strip() if number else f"{key} = {value}")
    return ", ".join(parts) or "the case"


def _note(row: Mapping[str, Any], factor: float) -> str:
    words = [USES[row["use"]], row["response"]]
    if row["other_responses"]:
        words.append("from other starts " + ", ".join(f"{factor * other:.3g}" for other in row["other_responses"]))
    if row["left_out"] is not None:
        words.append(f"predicted from the others: residual {row['left_out']:+.3f}")
    return "; ".join(words)


def _figure_chart(data: Mapping[str, Any], name: str, command: str) -> Chart:
    rows = [row for row in data["measurements"] if row["figure"] == name]
    label, places = abscissa(rows)
    unit, factor = measured_unit(rows)
    measured = factor * np.array([row["measured"] for row in rows])
    computed = factor * np.array([math.nan if row["computed"] is None else row["computed"] for row in rows])
    order = np.argsort(places, kind="stable")
    curves = [ChartCurve("computed", places[order], computed[order], "lines+markers")]
    for use, word in USES.items():
        mine = np.array([row["use"] == use for row in rows])
        if mine.any():
            curves.append(ChartCurve(f"measured, {word}", places[mine], measured[mine], "markers"))
    logarithmic = data["residual"] == "log10" and float(measured.min()) > 0.0
    return Chart(f"{name}: {rows[0]['meaning']}.", label, f"{name} ({unit})", curves, command, log_y=logarithmic)


def _unknowns(data: Mapping[str, Any], command: str) -> TableBlock:
    level = f"{100.0 * data['confidence']:g} %"
    rows = [
        (
            one["key"], one["value"], one["unit"], _ends(one["interval"]), _ends(one["profile"]),
            _ends((one["lower"], one["upper"])),
            one["sentence"] if one["word"] == "only in combination" else one["word"],
        )
        for one in data["unknowns"]
    ]  # fmt: skip
    heads = ("unknown", "best", "unit", f"interval, {level}", f"profile, {level}", "searched between", "finding")
    notes = (
        f"Standard deviation of the residuals {_number(data['standard_deviation'])}, from "
        f"{data['standard_deviation_from']}. The interval follows from the derivatives at the best values, the profile "
        "is the range of all evaluations that fit as well.",
    )
    return TableBlock("What is known of the unknowns", heads, rows, notes, command=command)


def _misfit_chart(data: Mapping[str, Any], folder: Path, command: str) -> Chart:
    keys, cloud = read_cloud(folder)
    bound = data["bound_of_misfit"]
    drawn = cloud[cloud[:, -1] <= HIGHEST * bound]
    curves, choices = [], []
    for number, one in enumerate(data["unknowns"]):
        low, high = one["lower"], one["upper"]
        places = drawn[:, number]
        shares = np.log(places / low) / math.log(high / low) if one["scale"] == "log" else (places - low) / (high - low)
        ends = f"{low:.3g} to {high:.3g} {one['unit']}, {one['scale']}"
        choices.append(f"{one['key']}, {ends}")
        texts = [f"{one['key']} = {value:.4g} {one['unit']}" for value in places]
        curves.append(ChartCurve("evaluations", 100.0 * shares, drawn[:, -1], "markers", choices[-1], texts=texts))
        curves.append(ChartCurve("bound of the profile", [0.0, 100.0], [bound, bound], choice=choices[-1], dashed=True))
    return Chart(
        f"Misfit of every evaluation over each of {', '.join(keys)} ({CLOUD}).", "place between the bounds (%)",
        "sum of squares", curves, command, log_y=True, choices=choices, choice="unknown",
    )  # fmt: skip


def _sensitivities(data: Mapping[str, Any], command: str) -> TableBlock:
    heads = ("figure", "experiment", *(one["key"] for one in data["unknowns"]))
    rows = [
        (row["figure"], _experiment(row), *slopes)
        for row, slopes in zip(data["measurements"], data["sensitivity"], strict=True)
    ]
    return TableBlock(
        "Sensitivity d ln(figure) / d ln(unknown) at the best values", heads, rows, digits=3, command=command
    )


def _ends(ends: Any) -> str:
    return f"{ends[0]:.3g} to {ends[1]:.3g}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
