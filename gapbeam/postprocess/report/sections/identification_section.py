"""An identification: what was measured and computed, what is known of the unknowns, and the misfit around them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Block, Compared, ComparisonBlock, TableBlock, Verdict, Words
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.study_figures.identification_figures import (
    CLOUD,
    abscissa,
    read_cloud,
    read_identification_data,
)

KINDS = {"fit": "fitted", "predict": "held out"}
IDENTIFICATION_FILE = "identification.json"
HIGHEST = 1e3  # sums of squares over the bound that are drawn


def identification_blocks(folder: Path, command: str = "") -> list[Block]:
    """Return the blocks on an identification, from its folder.

    Args:
        folder: Of `gapbeam identify`.
        command: That made it.

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


def _comparison(data: Mapping[str, Any], name: str, command: str) -> ComparisonBlock:
    rows = [row for row in data["measurements"] if row["figure"] == name]
    unit, factor = shown(rows[0]["unit"])
    compared = [
        Compared(
            _experiment(row),
            factor * row["measured"],
            None if row["computed"] is None else factor * row["computed"],
            unit,
            _note(row, factor),
            None if row["scatter"] is None else factor * row["scatter"],
        )
        for row in rows
    ]
    notes = ["± is the scatter of the computed figure over windows of whole forcing periods."]
    return ComparisonBlock(f"{name}: {rows[0]['meaning']}", compared, "measured", notes=notes, command=command)


def _experiment(row: Mapping[str, Any]) -> str:
    parts = []
    for key, value in row["set"].items():
        unit, factor = shown(row["set_units"][key])
        number = isinstance(value, int | float) and not isinstance(value, bool)
        parts.append(f"{key} = {factor * value:.4g} {unit}".strip() if number else f"{key} = {value}")
    return ", ".join(parts) or "the case"


def _note(row: Mapping[str, Any], factor: float) -> str:
    words = [KINDS[row["use"]], row["response"]]
    if row["other_responses"]:
        words.append("from other starts " + ", ".join(f"{factor * other:.3g}" for other in row["other_responses"]))
    if row["left_out"] is not None:
        words.append(f"predicted from the others: residual {row['left_out']:+.3f}")
    return "; ".join(words)


def _figure_chart(data: Mapping[str, Any], name: str, command: str) -> Chart:
    rows = [row for row in data["measurements"] if row["figure"] == name]
    label, places = abscissa(rows)
    unit, factor = shown(rows[0]["unit"])
    measured = factor * np.array([row["measured"] for row in rows])
    computed = factor * np.array([math.nan if row["computed"] is None else row["computed"] for row in rows])
    order = np.argsort(places, kind="stable")
    curves = [ChartCurve("computed", places[order], computed[order], "lines+markers")]
    for use, word in KINDS.items():
        mine = np.array([row["use"] == use for row in rows])
        if mine.any():
            curves.append(ChartCurve(f"measured, {word}", places[mine], measured[mine], "markers"))
    logarithmic = data["residual"] == "log10" and float(measured.min()) > 0.0
    return Chart(f"{name}: {rows[0]['meaning']}.", label, f"{name} ({unit})", curves, command, log_y=logarithmic)


def _unknowns(data: Mapping[str, Any], command: str) -> TableBlock:
    percent = f"{100.0 * data['confidence']:g} %"
    rows = [
        (
            one["key"], one["value"], one["unit"], _ends(one["interval"]), _ends(one["profile"]),
            _ends((one["lower"], one["upper"])),
            one["sentence"] if one["word"] == "only in combination" else one["word"],
        )
        for one in data["unknowns"]
    ]  # fmt: skip
    heads = ("unknown", "best", "unit", f"interval, {percent}", f"profile, {percent}", "searched between", "finding")
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
