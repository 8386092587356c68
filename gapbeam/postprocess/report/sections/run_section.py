"""Reports on one run, and on several runs: figures, waveforms and keys that differ."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.comparison_report import as_data
from gapbeam.postprocess.display_units import shown, shown_by
from gapbeam.postprocess.figures.motion_figures import farthest, moves_in_space, rooms_at_probes, shifts_at_probes
from gapbeam.postprocess.figures.shape_figures import shape_picture, shapes_of
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    Command,
    Listing,
    Picture,
    Report,
    ReportSection,
    TableBlock,
    Verdict,
    Words,
    percent,
    warnings_of,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve, envelope
from gapbeam.postprocess.report.html_page import sentence
from gapbeam.postprocess.report.sections.contact_section import contact_section, random_loads_section, wear_section
from gapbeam.postprocess.report.sections.curve_section import comparison_blocks, curve_section, periodic_section
from gapbeam.postprocess.report.sections.motion_section import motion_section, periodicity_section, spectra_section
from gapbeam.postprocess.report.sections.scene_section import scene_of, still_scene_of
from gapbeam.postprocess.report.sections.statistics_section import (
    energy_section,
    impacts_section,
    peak_rows,
    points_section,
    statistics_section,
)
from gapbeam.postprocess.report.sections.support_section import impulsive_faces
from gapbeam.postprocess.report.sections.sweep_section import alike
from gapbeam.postprocess.report.sections.verdict_section import (
    computation_section,
    cost_figures,
    figures_section,
    limits_section,
    opening_section,
    result_figures,
    run_verdicts,
    scene_table,
    summary_section,
)
from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results.columns_of_run import impacts_of, points_of, supports_of, wear_of
from gapbeam.postprocess.results.results import Results
from gapbeam.postprocess.results.run_watch import is_periodic, motion_of
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.run_comparison import ComparisonError, RunComparison, compare, is_raw
from gapbeam.postprocess.shell_command import shell_command
from gapbeam.postprocess.signals.probe_analysis import Analysis, Options, analyze
from gapbeam.postprocess.signals.signal import SignalError, names_along, turning_in
from gapbeam.solver.schema.record_table import CASE_FILE, CURVE_FILE, HISTORY_FILE

PARTS = {"real": "real part", "imaginary": "imaginary part"}
REDUCED = "reduced velocity U/(f D) (1)"


def flow_section(summary: Mapping[str, Any], command: str) -> ReportSection | None:
    """Return the section on feedback; None for a run without any.

    Args:
        summary: `Results.summary`.
        command: Command that makes the report.
    """
    scene = summary.get("scene")
    forces = scene.get("feedbacks") if isinstance(scene, Mapping) else None
    if not isinstance(forces, list) or not forces:  # a number in results of earlier releases
        return None
    works = (summary.get("energy") or {}).get("work_of_feedback") or {}
    rows: list[tuple[Cell, ...]] = [
        (
            one["name"] or "?", one["states"], one.get("velocity"), one.get("density"), one.get("delay"),
            works.get(one["name"]),
        )
        for one in forces
    ]  # fmt: skip
    heads = ("force", "states", "velocity (m/s)", "density (kg/m³)", "delay (s)", "work in the run (J)")
    blocks: list[Block] = [TableBlock("Forces that follow the motion", heads, rows)]
    for one in forces:
        if one.get("coefficients"):
            blocks += _coefficients(one["name"], one["coefficients"], command)
    return ReportSection("Flow", "flow", blocks)


def _coefficients(name: str, found: Mapping[str, Any], command: str) -> list[Block]:
    names = [key for key in found["measured"] if key != "reduced_velocity"]
    curves = [
        ChartCurve(
            f"{words}, {kind}", found[kind]["reduced_velocity"], found[kind][coefficient][part],
            "markers" if kind == "measured" else "lines", coefficient if len(names) > 1 else None, like=words,
        )
        for coefficient in names
        for part, words in PARTS.items()
        for kind in ("measured", "fit")
    ]  # fmt: skip
    misfit = percent(found["misfit"], signed=False)
    good = found["misfit"] <= found["tolerance"]
    words = f"`{name}`: the fit of {found['states']} states misses measured coefficients by {misfit} of the largest."
    chart = Chart(
        f"Coefficients of `{name}`: measured, and the fit that the run used.", REDUCED, "coefficient c (1)", curves,
        command, choices=names if len(names) > 1 else (), choice="coefficient" if len(names) > 1 else "",
    )  # fmt: skip
    return [Verdict("passed" if good else "warning", words), chart]


MOST = 6000  # points of an orbit


def orbits_section(results: Results, command: str) -> ReportSection | None:
    """Return z over y of every probe within the play of its support; None where all stay in the bending plane.

    Args:
        results: Results of a run with a history.
        command: Command that makes the figure.

    Raises:
        ResultsError: The history cannot be read.
    """
    history = results.history
    if history.sizes["time"] < 2 or not moves_in_space(history):
        return None
    supports = supports_of(results.summary, results.case)
    rooms = rooms_at_probes(results.case, supports, farthest(history))
    shifts = shifts_at_probes(results.case, supports, history)
    unit, factor = shown("m", farthest(history))
    every = slice(None, None, -(-history.sizes["time"] // MOST))
    curves, names = [], [str(name) for name in history["probe"].values]
    for name in names:
        path = np.stack([history["displacement"].sel(probe=name, component=axis).values for axis in "yz"], axis=1)
        y, z = factor * (path - shifts.get(name, 0.0))[every].T
        curves.append(ChartCurve("orbit", y, z, choice=name, times=history["time"].values[every]))
        room = rooms.get(name)
        if room is not None and len(room):
            aside, up = factor * np.asarray(room).T
            curves.append(ChartCurve("room in the support", aside, up, choice=name, dashed=True))
    bodies = _body_orbits(history, factor, every)
    curves += bodies
    words = "Orbit of each probe across the beam, from the undeformed beam in the origin; the dot follows the time."
    if rooms:
        words += " Dashed: the region that a support leaves to a probe on the axis in it."
    if bodies:
        words += " Supports with a mass have orbits of their own, from where their springs are relaxed."
    if shifts:
        words += f" Orbits of {', '.join(shifts)} are drawn in their supports, which move."
    choices = [*names, *(str(curve.choice) for curve in bodies)]
    chart = Chart(words, f"y ({unit})", f"z ({unit})", curves, command, choices=choices, choice="of", equal=True)
    return ReportSection("Orbits", "orbits", [chart])


def _body_orbits(history: xr.Dataset, factor: float, every: slice) -> list[ChartCurve]:
    """Return the orbits of flexible supports in space."""
    if "support_displacement" not in history or not {"y", "z"} <= set(map(str, history["support_axis"].values)):
        return []
    moved, curves = factor * history["support_displacement"].isel(time=every), []
    for name in moved["support_body"].values:
        y, z = (moved.sel(support_body=name, support_axis=axis).values for axis in "yz")
        if np.any(y) or np.any(z):
            curves.append(ChartCurve("orbit", y, z, choice=f"support {name}", times=moved["time"].values))
    return curves


PICTURES = "pictures"
OPEN = ("summary", "motion")  # the sections that readers need not unfold
NO_SCENE = (
    "There is no scene, since the run left fewer than three fields of the motion and no case with a beam to draw. A "
    "run in time with `output.fields_interval` well below `time.end` writes fields."
)
NO_GEOMETRY = "The run is one of a scene whose structures have no geometry: there is nothing to draw but its records."
SHAPE_WORDS = "The structures in space, with the walls of their supports; displacements and gaps are enlarged alike."
PICTURE_WORDS = {
    "largest_contact_force": "The beam in its support at the field with the largest contact force.",
    "largest_displacement": "The beam in its support at the field with the largest displacement of the free end.",
}


def run_report(results: Results, command: str) -> Report:
    """Return the report on a run: how it ended, the moving scene, results; then motion, contact, energy, margins, cost.

    What the results do not allow is left out, or reported where it would stand.

    Args:
        results: Results of a run, finished or not.
        command: Command that makes the report.

    Raises:
        ResultsError: A file of the results cannot be read.
    """
    recorded = (results.folder / HISTORY_FILE).is_file()
    scene = _scene(results, command) if recorded else []
    sections = [opening_section(results, scene)]
    if (results.folder / HISTORY_FILE).is_file():
        sections += _of_history(results, command)
    else:
        sections.append(ReportSection("Motion", "motion", [Verdict("warning", f"There is no `{HISTORY_FILE}`.")]))
    curve = results.folder / CURVE_FILE
    if curve.is_file():
        sections.append(curve_section(read_object(curve, ("key", "unit", "points")), command))
    margins, cost = limits_section(results), computation_section(results)
    worn = wear_section(results.summary, wear_of(results.folder), command)
    figures = figures_section(results, peak_rows(results.history) if recorded else ())
    ends = (
        figures, statistics_section(results.summary), worn, random_loads_section(results.summary),
        flow_section(results.summary, command), margins, _pictures(results.folder), case_section(results),
        scene_table(results.summary), cost,
    )  # fmt: skip
    sections += [section for section in ends if section is not None]
    sections = [one if one.anchor in OPEN else replace(one, folded=True) for one in sections]
    return Report(results.title, f"Run in `{results.folder}`", sections, meta_of(results, command))


def _scene(results: Results, command: str) -> list[Block]:
    """Return the moving scene, a still one without fields, or the reason why there is none."""
    if results.summary.get("scene"):
        shapes = shapes_of(results.folder)
        if shapes is None:
            return [Words(NO_GEOMETRY)]
        return [Picture(shape_picture(shapes), SHAPE_WORDS, shell_command("gapbeam", "plot", results.folder))]
    try:
        scene = scene_of(results, command) or still_scene_of(results, command)
    except (ResultsError, SignalError) as fault:
        return [Verdict("warning", f"There is no moving scene: {fault}")]
    return [Words(NO_SCENE)] if scene is None else [scene]


def meta_of(results: Results, command: str) -> dict[str, str]:
    """Return the origin of a report on results: folder, command, versions."""
    versions = results.summary.get("versions") or {}
    message = ", ".join(f"{name} {version}" for name, version in versions.items())
    return {"results": str(results.folder), "made by": command} | ({"computed with": message} if message else {})


def case_section(results: Results) -> ReportSection | None:
    """Return the case as it was run, and how to run it again; None where it is not there."""
    path = results.folder / CASE_FILE
    if not path.is_file():
        return None
    changes = results.summary.get("overrides") or {}
    sets = [word for key, value in changes.items() for word in ("--set", f"{key}={json.dumps(value)}")]
    blocks: list[Block] = [
        Command(shell_command("gapbeam", "run", path, *sets, "--output", Path(f"{results.folder}-again"))),
        Listing(f"`{CASE_FILE}`, with every default", results.case_text),
    ]
    return ReportSection("The case", "case", blocks)


def probe_analyses(results: Results) -> dict[str, Analysis]:
    """Return the analysis of every probe; a computed periodic response is repeated as often as the analysis needs.

    Raises:
        ResultsError: The history cannot be read.
        SignalError: Values that are not finite.
    """
    history = motion_of(results, results.forcing_frequency)
    return {probe: analyze(results, Options(probe=probe), history) for probe in names_along(history, "probe")}


def _of_history(results: Results, command: str) -> list[ReportSection]:
    history, periodic = results.history, results.summary.get("periodic")
    found = sections_of_records(results, command)
    found += _made("Contact points", "contact-points", lambda: [points_section(points_of(results.folder), command)])
    if not periodic:
        span = float(history["time"][-1] - history["time"][0])
        turning = turning_in(history)
        found += _made(
            "Impacts", "impacts", lambda: [impacts_section(impacts_of(results.folder), span, turning=turning)]
        )
    return found + _made("Energy", "energy", lambda: [energy_section(history, results.summary, command)])


def sections_of_records(results: Results, command: str) -> list[ReportSection]:
    """Return the sections that follow from records alone: motion, spectra, orbits, contact.

    Args:
        results: Results of a run with a history.
        command: Command that makes the figures.

    Raises:
        ResultsError: The history cannot be read.
    """
    history, frequency = results.history, results.forcing_frequency
    periodic = results.summary.get("periodic")
    found = _made("Motion", "motion", lambda: _of_probes(results, command))
    if periodic:
        found += _made("Periodic response", "periodic", lambda: [periodic_section(periodic, command)])
    else:
        found += _made("Orbits", "orbits", lambda: [orbits_section(results, command)])
    if "contact_force" in history and "penetration" in history:
        struck = impulsive_faces(results.summary)
        found += _made("Contact", "contact", lambda: [contact_section(history, frequency, command, struck)])
    return found


def _made(title: str, anchor: str, make: Callable[[], Sequence[ReportSection | None]]) -> list[ReportSection]:
    """Return sections, or instead the faults of the values that they show."""
    try:
        return [section for section in make() if section is not None]
    except SignalError as fault:
        return [ReportSection(title, anchor, [Verdict("error", str(fault))])]


def _of_probes(results: Results, command: str) -> list[ReportSection | None]:
    found = probe_analyses(results)
    if not found:
        words = "The run recorded no motion of a probe: add `[[probe]]` to the case."
        return [ReportSection("Motion", "motion", [Verdict("note", words)])]
    message = [text for one in found.values() for text in one.warnings]
    notes = alike(
        list(
            dict.fromkeys(
                text if message.count(text) == len(found) else f"{probe}: {text}"
                for probe, one in found.items()
                for text in one.warnings
            )
        )
    )
    analyses = {probe: one for probe, one in found.items() if one.displacement is not None}
    if not analyses:
        return [ReportSection("Motion", "motion", warnings_of(notes))]
    repeats = is_periodic(results)
    motion = motion_section(analyses, command, repeats)
    opening = [Words("The run computed one period of the response; it is shown here as it repeats.")] if repeats else []
    motion = ReportSection(motion.title, motion.anchor, [*opening, *warnings_of(notes), *motion.blocks])
    return [motion, spectra_section(analyses, command), periodicity_section(analyses, command)]


def _pictures(folder: Path) -> ReportSection | None:
    """Return the pictures that `gapbeam render` left; None where there are none."""
    paths = sorted((folder / PICTURES).glob("*.png"))
    if not paths:
        return None
    command = shell_command("gapbeam", "render", folder)
    blocks = [Picture(path, PICTURE_WORDS.get(path.stem, path.stem.replace("_", " ")), command) for path in paths]
    return ReportSection("Pictures", "pictures", blocks)


def several_sections(runs: Sequence[Results], command: str) -> list[ReportSection]:
    """Return a comparison of two runs or more, the first against each of the others, and a summary of each.

    Args:
        runs: Two at least.
        command: Command that makes the report.

    Raises:
        ResultsError: Results that cannot be read.
    """
    names = names_of(runs)
    overview: list[Block] = [*_verdicts(runs, names), _key_table(runs, names), *_case_table(runs, names)]
    sections = [ReportSection("Side by side", "side-by-side", overview)]
    found: dict[str, RunComparison] = {}
    faults: dict[str, str] = {}
    for name, other in zip(names[1:], runs[1:], strict=True):
        try:
            found[name] = compare(runs[0], other)
        except (ComparisonError, SignalError) as fault:
            faults[name] = str(fault)
    waves = _waveforms(found, names[0], command)
    if waves:
        sections.append(ReportSection("Waveforms", "waveforms", waves))
    for number, name in enumerate(names[1:], start=1):
        blocks: list[Block] = (
            comparison_blocks(as_data(found[name]), command) if name in found else [Verdict("warning", faults[name])]
        )
        sections.append(ReportSection(f"{names[0]} against {name}", f"against-{number}", blocks))
    for number, (name, run) in enumerate(zip(names, runs, strict=True), start=1):
        summary = summary_section(run, f"run-{number}")
        sections.append(ReportSection(name, summary.anchor, summary.blocks))
    return sections


def names_of(runs: Sequence[Results]) -> list[str]:
    """Return a name for every run: the name of its folder where those differ, else the whole path."""
    names = [run.folder.name for run in runs]
    return names if len(set(names)) == len(names) else [str(run.folder) for run in runs]


def _verdicts(runs: Sequence[Results], names: Sequence[str]) -> list[Verdict]:
    """Return the faults of all runs, or one verdict that there are none."""
    bad = [
        Verdict(one.level, f"{name}: {one.text}")
        for name, run in zip(names, runs, strict=True)
        for one in run_verdicts(run)
        if one.level == "error"
    ]
    return bad or [Verdict("passed", f"None of the {len(runs)} runs failed.")]


def _key_table(runs: Sequence[Results], names: Sequence[str]) -> TableBlock:
    tables = [{(row[0], row[2]): row[1] for row in [*result_figures(run), *cost_figures(run)]} for run in runs]
    keys = dict.fromkeys(key for table in tables for key in table)
    rows: list[tuple[Cell, ...]] = [(key[0], key[1], *(table.get(key) for table in tables)) for key in keys]
    return TableBlock("Key figures of the runs", ("figure", "unit", *names), rows)


def _case_table(runs: Sequence[Results], names: Sequence[str]) -> list[TableBlock]:
    """Return the keys in which the cases differ; nothing where one of them cannot be read."""
    try:
        cases = [_flat(run.case) for run in runs]
    except ResultsError:
        return []
    keys = dict.fromkeys(key for case in cases for key in case)
    rows = [(key, *(case.get(key) for case in cases)) for key in keys if len({case.get(key) for case in cases}) > 1]
    return [TableBlock("Keys in which the cases differ", ("key", *names), rows)] if rows else []


def _flat(value: Any, key: str = "") -> dict[str, str]:
    """Return a nested table as texts by dotted key; entries of arrays by their names or numbers."""
    if isinstance(value, Mapping):
        entries = [(str(name), inner) for name, inner in value.items()]
    elif isinstance(value, list) and any(isinstance(entry, Mapping) for entry in value):
        entries = [(str(entry.get("name", place)), entry) for place, entry in enumerate(value)]
    else:
        return {key: str(value)}
    found: dict[str, str] = {}
    for name, inner in entries:
        found |= _flat(inner, f"{key}.{name}" if key else name)
    return found


def _waveforms(found: Mapping[str, RunComparison], first: str, command: str) -> list[Block]:
    """Return a chart of every signal, with a button for every run that is laid over the first."""
    signals = dict.fromkeys(
        (one.name, one.unit) for comparison in found.values() for one in comparison.overlays if not is_raw(one.name)
    )
    charts: list[Block] = []
    for signal, unit in signals:
        laid = [(name, one) for name, run in found.items() for one in run.overlays if one.name == signal]
        shown_unit, factor = shown(unit, max(float(np.abs([one.a, one.b]).max()) for _, one in laid))
        clock, in_clock = shown_by("s", (float(np.abs(one.time).max()) for _, one in laid))
        curves = []
        for name, one in laid:
            curves.append(ChartCurve(first, *envelope(in_clock * one.time, factor * one.a), choice=name))
            curves.append(ChartCurve("the other", *envelope(in_clock * one.time, factor * one.b), choice=name))
        charts.append(
            Chart(
                f"{sentence(signal)} of {first} and of the run chosen, at the same phases of the forcing or, where "
                "neither repeats, at the same times.",
                f"time ({clock})", f"{signal} ({shown_unit})", curves, command,
                choices=list(dict.fromkeys(str(curve.choice) for curve in curves)), choice="against",
            )
        )  # fmt: skip
    return charts
