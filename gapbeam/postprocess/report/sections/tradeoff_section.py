"""Reports on trade-offs (cost and error of models, meshes and steps) and on stability studies of schemes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.blocks import Block, Cell, Picture, ReportSection, TableBlock, Verdict, warnings_of
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.markdown_text import sentence
from gapbeam.postprocess.report.study_json import read_object, read_records
from gapbeam.postprocess.study_figures.stability_map import LABELS, QUANTITIES
from gapbeam.postprocess.study_figures.tradeoff_figure import KINDS, OTHERS

STABILITY_FILE = "stability.json"
STIFFNESS, STEP, SCHEME = "contact.stiffness", "time.step", "time.scheme"
Record = Mapping[str, Any]


def stability_sections(folder: Path, command: str) -> list[ReportSection]:
    """Return the counts of every scheme, the energy it creates over the step, the maps, and all trials.

    Args:
        folder: As `gapbeam stability` left it.
        command: That makes the report.

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
        command: That makes the report.

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
