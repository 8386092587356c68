"""Sections on the figures of a run: statistics, energies, largest values, contact of the points, impacts."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import shown, shown_along
from gapbeam.postprocess.report.blocks import (
    Block,
    Cell,
    ReportSection,
    TableBlock,
    Words,
    number,
    percent,
    statistics_row,
)
from gapbeam.postprocess.report.charts import Chart, ChartCurve, envelope, thinning_words
from gapbeam.postprocess.report.sections.support_section import chart_along
from gapbeam.postprocess.results.columns_of_run import PointMap
from gapbeam.postprocess.signals.cycle_counts import HEADS, distributions, impact_units, rates
from gapbeam.postprocess.signals.signal import finite_record, unit_at, unit_of_record
from gapbeam.solver.schema.record_table import HISTORY

SMALL = 1.0e-4  # of the largest stored energy: what stays below is not drawn
_STORED = ("kinetic_energy", "strain_energy", "contact_energy", "restraint_energy")
_LOST = ("structural_dissipation", "contact_dissipation", "friction_dissipation", "algorithmic_dissipation")
_NAMES = {
    "algorithmic_dissipation": "lost to the scheme",
    "structural_dissipation": "lost to structural damping",
    "contact_dissipation": "lost to contact damping",
    "friction_dissipation": "lost to friction",
}
_GATES = (
    ("impacts", "impacts"),
    ("violations", "impacts outside the gates"),
    ("largest_growth", "largest growth in an impact"),
    ("largest_loss", "largest loss in an impact"),
)
_LIMITS = (("impact_growth", "growth allowed in an impact"), ("impact_loss", "loss allowed in an impact"),
           ("total_growth", "growth allowed in the whole run"))  # fmt: skip


def energy_section(
    history: xr.Dataset, summary: Mapping[str, Any], command: str, since: str = "t = 0"
) -> ReportSection | None:
    """Return the ledger of energies and the gates; None where neither is there.

    Args:
        history: `Results.history`.
        summary: `Results.summary`.
        command: Command that makes the figures.
        since: Time from which works and losses count.

    Raises:
        SignalError: A value is not finite.
    """
    blocks: list[Block] = []
    there = {name: finite_record(history, name) for name in _STORED if name in history}
    most = max((float(values.max()) for values in there.values()), default=0.0)
    stored = {name.replace("_", " "): values for name, values in there.items() if values.max() >= SMALL * most}
    spent = _work(history) | {_NAMES[name]: finite_record(history, name) for name in _LOST if _any(history, name)}
    residual = {"residual": finite_record(history, "energy_residual")} if "energy_residual" in history else {}
    time = np.asarray(history["time"].values, dtype=float)
    for words, label, curves in (
        ("Stored energy", "energy", stored),
        (f"Work of the loads and losses since {since}", "energy", spent),
        ("What the balance of energy leaves over", "residual", residual),
    ):
        if curves:
            blocks.append(_over_time(words, label, time, curves, command))
    table = _gates_table(summary)
    if table is not None:
        blocks.append(table)
    return ReportSection("Energy", "energy", blocks) if blocks else None


def energy_of_span(history: xr.Dataset, command: str) -> ReportSection | None:
    """Return the energies of a span of a run: works and losses from its first record on, and their balance.

    Gates judge impacts and the whole run, and are left out.

    Args:
        history: Records of the span.
        command: Command that makes the figures.

    Raises:
        SignalError: A value is not finite.
    """
    summed = [name for name in ("load_work", *_LOST, "energy_residual") if name in history]
    changed = history.assign({name: history[name] - history[name].isel(time=0) for name in summed})
    first = f"t = {float(history['time'][0]):.6g} s"
    section = energy_section(changed, {}, command, since=first)
    if section is None:
        return None
    return ReportSection(section.title, section.anchor, [_balance(changed, first), *section.blocks])


def _balance(changed: xr.Dataset, first: str) -> TableBlock:
    """Return the energy that came, left, and is stored, from the first record of a span to its end."""
    there = [name for name in _STORED if name in changed]
    stored = float(sum(finite_record(changed, name)[-1] - finite_record(changed, name)[0] for name in there))
    ends = {name: float(work[-1]) for name, work in _work(changed).items()}
    ends |= {_NAMES[name]: -float(finite_record(changed, name)[-1]) for name in _LOST if _any(changed, name)}
    if "energy_residual" in changed:
        ends["residual"] = float(finite_record(changed, "energy_residual")[-1])
    ends["stored more than at the start of the span"] = stored
    unit, factor = shown("J", max(map(abs, ends.values())))
    caption = f"Energy from {first} on: the last line is the sum of those above"
    return TableBlock(caption, ("", f"energy ({unit})"), [(name, factor * end) for name, end in ends.items()])


def _over_time(words: str, label: str, time: np.ndarray, curves: Mapping[str, np.ndarray], command: str) -> Chart:
    unit, factor = shown("J", max(float(np.abs(values).max(initial=0.0)) for values in curves.values()))
    clock, in_clock = unit_of_record(time)
    lines = [ChartCurve(name, *envelope(in_clock * time, factor * values)) for name, values in curves.items()]
    return Chart(f"{words}.{thinning_words(time.size)}", f"time ({clock})", f"{label} ({unit})", lines, command)


def _any(history: xr.Dataset, name: str) -> bool:
    return name in history and bool(np.any(history[name].values))


def _work(history: xr.Dataset) -> dict[str, np.ndarray]:
    if "load_work" not in history:
        return {}
    names = [str(name) for name in history["load"].values]
    return {f"work of {name}": work for name, work in zip(names, finite_record(history, "load_work").T, strict=True)}


def _gates_table(summary: Mapping[str, Any]) -> TableBlock | None:
    gates, energy = summary.get("gates") or {}, summary.get("energy") or {}
    limits = gates.get("limits") or {}
    rows: list[tuple[Cell, ...]] = []
    for key, name in _GATES:
        if gates.get(key) is not None:
            whole = isinstance(gates[key], int)
            rows.append((name, gates[key] if whole else 100.0 * gates[key], "" if whole else "%"))
    for key, name in _LIMITS:
        if limits.get(key) is not None:
            rows.append((name, 100.0 * float(limits[key]), "%"))
    if energy.get("relative_growth") is not None:
        rows.append(("created in the whole run, of the energy exchanged", 100.0 * energy["relative_growth"], "%"))
    if not rows:
        return None
    notes = [record.meaning for record in HISTORY if record.name == "algorithmic_dissipation"]
    return TableBlock("Gates on the energy", ("", "value", "unit"), rows, notes=[f"Scheme: {notes[0]}."])


Row = tuple[Cell, ...]
_WORDS = {
    "axial_stress": ("gauge", "largest axial stress at {}"),
    "von_mises_stress": ("gauge", "largest von Mises stress at {}"),
}


def peak_rows(history: xr.Dataset) -> list[Row]:
    """Return name, value and unit of the largest finite value of each record over the whole history.

    Displacements and accelerations are those across the beam: in space the length of both components.

    Args:
        history: `Results.history`.
    """
    rows: list[Row] = []
    for record, dimension, words in (
        ("displacement", "probe", "largest displacement of {}"),
        ("displacement_from_supports", "moved_probe", "largest displacement of {} from its supports"),
        ("acceleration_absolute", "probe", "largest acceleration of {}"),
        ("acceleration_from_supports", "moved_probe", "largest acceleration of {} from its supports"),
    ):
        if record in history and history.sizes.get(dimension, 0):
            across = history[record].sel(component=[axis for axis in history["component"].values if axis != "x"])
            sizes = np.sqrt((across**2).sum("component"))
            rows += _largest(history, record, sizes, words)
    for record, (dimension, words) in _WORDS.items():
        if record in history and history.sizes.get(dimension, 0) and np.any(history[record].values):
            rows += _largest(history, record, np.abs(history[record]), words)
    if "joint_force" in history and history.sizes.get("joint", 0):
        sizes = np.sqrt((history["joint_force"] ** 2).sum("translation"))
        rows += _largest(history, "joint_force", sizes, "largest force of the joint {}")
    return rows


def _largest(history: xr.Dataset, record: str, values: xr.DataArray, words: str) -> list[Row]:
    """Return a row for each place of a record, from values over time at each."""
    (place,) = (dim for dim in values.dims if dim != "time")
    found = zip(values[place].values, values.max("time").values.tolist(), strict=True)
    displays = ((n, one, *shown(unit_at(history, record, [str(n)]), one)) for n, one in found if np.isfinite(one))
    return [(words.format(name), factor * one, written) for name, one, written, factor in displays]


SHARE, PRESSED = "contact share (%)", "impulse per area (N s/m²)"


def points_section(points: Mapping[str, PointMap], command: str = "") -> ReportSection | None:
    """Return the section on the contact points of a run; None for a run without `output.points`.

    Args:
        points: Points of the faces, by name.
        command: Command that makes the report.
    """
    if not points:
        return None
    touched = {face: one for face, one in points.items() if one.touched}
    title = "Contact points"
    if not touched:
        return ReportSection(title, "contact-points", [Words("No contact point was in contact at a record.")])
    rest = [face for face in points if face not in touched]
    note = "Seen at the records of the history. Angles are from straight down, positive toward +y."
    notes = (note, f"Not touched at a record: {', '.join(rest)}.") if rest else (note,)
    along = shown_along([one.x for one in touched.values()])
    deep = shown("m", max(float(one.deepest.max()) for one in touched.values()))
    heads = (
        "face", "points touched", "first touch (s)", f"at x ({along[0]})", "at angle (deg)",
        "contact share, largest (%)", f"penetration, largest ({deep[0]})",
    )  # fmt: skip
    rows = [_row(face, one, along[1], deep[1]) for face, one in touched.items()]
    first = TableBlock("What was touched", heads, rows, notes=notes)
    blocks: list[Block] = [first]
    known = {face: one for face, one in touched.items() if np.all(np.isfinite(one.impulse)) and one.impulse.sum() > 0.0}
    if known:
        rows = [_pressed(face, one, along[1]) for face, one in known.items()]
        pressed = "face", "impulse (N s)", "most per area (N s/m²)", "over the mean", *heads[3:5]
        blocks.append(TableBlock("Where the impulse is largest", pressed, rows))
    blocks += _charts(
        "Contact share", SHARE, {face: (one, 100.0 * one.share) for face, one in touched.items()}, command
    )
    blocks += _charts("Impulse", PRESSED, {face: (one, one.pressed) for face, one in known.items()}, command)
    return ReportSection(title, "contact-points", blocks)


def _row(face: str, one: PointMap, in_x: float, in_depth: float) -> tuple[Cell, ...]:
    at = int(np.nanargmin(one.first_touch))
    count = f"{int(np.isfinite(one.first_touch).sum())} of {len(one.x)}"
    share, deepest = 100.0 * float(one.share.max()), in_depth * float(one.deepest.max())
    return face, count, float(one.first_touch[at]), in_x * float(one.x[at]), _angle(one, at), share, deepest


def _pressed(face: str, one: PointMap, in_x: float) -> tuple[Cell, ...]:
    at, total = int(np.argmax(one.pressed)), float(one.impulse.sum())
    most = float(one.pressed[at])
    mean = total / float(one.area.sum())
    return face, total, most, most / mean, in_x * float(one.x[at]), _angle(one, at)


def _angle(one: PointMap, at: int) -> float | None:
    """Return the direction of a point, degrees; None on a plane, which has one for all."""
    return float(one.angle[at]) if one.around else None


def _charts(name: str, unit: str, faces: Mapping[str, tuple[PointMap, np.ndarray]], command: str) -> list[Block]:
    """Return means of values along the beam, and around it where faces have several directions."""
    if not faces:
        return []
    lines = {face: one.along(values) for face, (one, values) in faces.items()}
    found: list[Block] = [chart_along(f"{name} along the beam, means by area", unit, lines, command)]
    around = [ChartCurve(face, *one.turned(values)) for face, (one, values) in faces.items() if one.around]
    if around:
        angle = "angle from straight down (deg)"
        found.append(Chart(f"{name} around the beam, means by area", angle, unit, around, command))
    return found


def impacts_section(
    impacts: Mapping[str, np.ndarray], seconds: float, span: str = "over the whole run", turning: Collection[str] = ()
) -> ReportSection | None:
    """Return the impacts of a run, or of a part of it; None where there were none.

    Args:
        impacts: Impacts by face, as `impacts_of` has them.
        seconds: Span of time, s.
        span: Name of this span, in words.
        turning: Faces between rotations.
    """
    if not impacts or not seconds > 0.0:
        return None
    found = ", ".join(f"{face} {number(rate)}" for face, rate in rates(impacts, seconds).items())
    rows: list[tuple[Cell, ...]] = []
    units = impact_units(impacts, turning)
    for face, mine in impacts.items():
        for name, values in distributions(mine).items():
            unit, factor = units[face][name]
            rows.append((face, f"{name} ({unit})", *map(float, factor * values)))
    notes = [
        f"{face}: one in {int(mine[0, 4])} impacts was kept for the distributions."
        for face, mine in impacts.items()
        if mine[0, 4] > 1
    ]
    table = TableBlock(f"Impacts {span}", ("face", "figure", *HEADS[2:]), rows, notes=tuple(notes))
    return ReportSection("Impacts", "impacts", [Words(f"Impacts in a second: {found}."), table])


STATISTICS_SECTION_HEADER = ("figure", "value", "unit", "95 % interval", "effective samples", "judged", "s for 2 %")


def statistics_section(summary: dict[str, Any]) -> ReportSection | None:
    """Return the statistics of a run; None for a run without any.

    Args:
        summary: Summary of a run.
    """
    found = summary.get("statistics")
    if not found:
        return None
    if not found["figures"]:
        words = f"The record of {number(found['seconds'])} s is too short for statistics."
        return ReportSection("Statistics", "statistics", [Words(words)])
    words = (
        f"Over {number(found['seconds'] - found['burn_in'])} s behind the first {number(found['burn_in'])} s. Only "
        "intervals judged good can be relied on."
    )
    until = found.get("until")
    if until is not None:
        met = "ended the run" if until.get("narrow", until["met"]) else "was not reached"
        words += f" The error of {percent(until['relative_error'], signed=False)} asked for `{until['figure']}` {met}."
        if "doubt_words" in until:
            words += f" The figure is in doubt: {until['doubt_words']}."
    energy = found.get("scheme_bias", {}).get("energy")
    if energy:
        side = "less" if energy < 0.0 else "more"
        words += (
            f" The scheme leaves the motion {percent(abs(energy), signed=False)} {side} energy than the noise gives."
        )
    rows = [statistics_row(one) for one in found["figures"]]
    return ReportSection(
        "Statistics", "statistics", [Words(words), TableBlock("Figures of the motion", STATISTICS_SECTION_HEADER, rows)]
    )
