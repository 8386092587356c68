"""Sections on contact: forces, gaps and penetrations of the faces, their wear, and the spectra of random loads."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.report.blocks import Block, Cell, ReportSection, TableBlock, Words, number
from gapbeam.postprocess.report.charts import Chart, ChartCurve, envelope, thinning_words
from gapbeam.postprocess.report.sections.support_section import IMPULSES_ONLY, ZOOM, chart_along, end_words, is_long
from gapbeam.postprocess.results.columns_of_run import WearMap
from gapbeam.postprocess.signals.signal import (
    Signal,
    display_of,
    enlarged_span,
    face_signal,
    unit_of_record,
    unit_of_time,
)
from gapbeam.solver.messages.wording import counted

HEADER = ("face", "rate", "value", "unit", "95 % interval", "judged")
WHERE_HEADER = ("face", "x (m)", "angle (deg)", "work rate per area (W/m^2)", "over the mean", "depth rate (m/s)")
PARTS_HEADER = ("face", "work (J)", "impact (%)", "sliding (%)", "sticking (%)")
PART_RATES_HEADER = ("face", "motion", "work rate (W)", "95 % interval (W)", "judged")
LARGEST_HEADER = (
    "face", "x (m)", "angle (deg)", "work rate per area (W/m^2)", "95 % interval of the largest", "by other batches",
    "depth rate (m/s)",
)  # fmt: skip
LARGEST_NOTE = (
    "Behind the burn-in. The largest of many means with chance in them is larger than the mean of its place: the "
    "interval belongs to the largest true mean (all points at once, Bonferroni). By other batches: the mean at "
    "places that the other half of the record chose, which chance does not lift."
)
RATES = {"work_rate": ("work rate", "W"), "volume_rate": ("volume rate", "m^3/s"), "depth_rate": ("depth rate", "m/s")}


def wear_section(
    summary: dict[str, Any],
    maps: Mapping[str, WearMap],
    command: str = "",
    since: str = "t = 0",
) -> ReportSection | None:
    """Return the wear of a run; None for a run of a case without [wear].

    Args:
        summary: Summary of a run.
        maps: Wear maps of its faces; none of earlier releases.
        command: Command that makes the report.
        since: Time from which work counts.
    """
    found = summary.get("wear")
    if not found:
        return None
    words = f"Work of sliding over {number(found['seconds'])} s. Rates without an interval are means from {since}."
    areas = {face: one.get("area", found["area"]) for face, one in found["faces"].items()}
    if known := {face: area for face, area in areas.items() if area is not None}:
        spread = ", ".join(f"{number(area)} m^2 of {face}" for face, area in known.items())
        words += f" Depths are volumes spread evenly over {spread}."
    rows = [
        (face, name, of_face[key]["value"], unit, _interval(of_face[key]), of_face["verdict"])
        for face, of_face in found["faces"].items()
        for key, (name, unit) in RATES.items()
        if of_face[key] is not None
    ]
    blocks: list[Block] = [Words(words), TableBlock("How fast the faces wear", HEADER, rows)]
    if (parts := _parts(found)) is not None:
        blocks += parts
    blocks += [*_largest(found), *_where(maps, command)]
    return ReportSection("Wear", "wear", blocks)


def _largest(found: dict[str, Any]) -> list[Block]:
    """Return the largest work rate per area of each face with its interval; nothing for runs without statistics."""
    rows: list[tuple[Cell, ...]] = []
    for face, of_face in found["faces"].items():
        if (one := of_face.get("largest")) is not None:
            rate, depth = one["work_rate_per_area"], one["depth_rate"]
            at = one["at_places_of_other_batches"]
            deepest = "" if depth is None else f"{number(depth['value'])} ({_interval(depth)})"
            rows.append((face, one["x"], one["angle"], rate["value"], _interval(rate), at, deepest))
    if not rows:
        return []
    return [TableBlock("The largest of each map", LARGEST_HEADER, rows, notes=(LARGEST_NOTE,))]


def _where(maps: Mapping[str, WearMap], command: str) -> list[Block]:
    """Return the places of largest wear, and charts along the beam and around it."""
    worn = {face: one for face, one in maps.items() if one.unevenness > 0.0}
    if not worn:
        return []
    rows: list[tuple[Cell, ...]] = []
    for face, one in worn.items():
        most = int(np.argmax(one.density))
        depth = None if one.depth_rate is None else float(one.depth_rate[most])
        rows.append((face, float(one.x[most]), float(one.angle[most]), float(one.density[most]), one.unevenness, depth))
    note = "The depth rate is that of this point alone, with its own area. Angles are from straight down."
    found: list[Block] = [TableBlock("Where the faces wear most", WHERE_HEADER, rows, notes=(note,))]
    density = "work rate per area (W/m^2)"
    lines = {face: one.along(one.density) for face, one in worn.items()}
    found.append(chart_along("Wear along the beam", density, lines, command))
    if turned := [ChartCurve(face, *one.turned(one.density)) for face, one in worn.items() if one.around]:
        found.append(Chart("Wear around the beam", "angle from straight down (deg)", density, turned, command))
    return found


def _parts(found: dict[str, Any]) -> list[Block] | None:
    """Return the work by mode of motion; None: nothing was done, or the run did not separate impact from sliding."""
    rows = [
        (face, of_face["work"], *(100.0 * part / of_face["work"] for part in of_face["work_by_mode"].values()))
        for face, of_face in found["faces"].items()
        if of_face["work"] > 0.0 and "work_by_mode" in of_face
    ]
    if not rows or "impact_time" not in found:
        return None
    words = f"Impact: the first {number(found['impact_time'])} s of each contact of a face. "
    slip = found["sticking_speed"]
    words += f"Sticking: slower than {number(slip)} m/s behind that." if slip else "Without friction nothing sticks."
    if doubt := found.get("parts_doubt"):
        words += f" **Doubt:** {doubt}. Their sum is not concerned."
    rates = [
        (face, mode, rate["value"], _interval(rate), rate["verdict"])
        for face, of_face in found["faces"].items()
        for mode, rate in of_face.get("work_rate_by_mode", {}).items()
        if rate["low"] is not None and rate["verdict"] != "no event"
    ]
    more = [TableBlock("Work rate by motion", PART_RATES_HEADER, rates)] if rates else []
    return [TableBlock("By which motion", PARTS_HEADER, rows), Words(words), *more]


def _interval(rate: dict[str, Any]) -> str:
    return "" if rate["low"] is None else f"{number(rate['low'])} to {number(rate['high'])}"


def contact_section(
    history: xr.Dataset, frequency: float | None, command: str, impulsive: Collection[str] = ()
) -> ReportSection:
    """Return force, gap and penetration of every face over the record and over its end.

    Args:
        history: `Results.history`, with contact_force and penetration.
        frequency: Frequency of the forcing, Hz; None shows the tenth of the record where most happens.
        command: Command that makes the figures.
        impulsive: Faces whose law is impulses.

    Raises:
        SignalError: A value is not finite.
    """
    faces = [str(name) for name in history["face"].values]
    force = {face: face_signal(history, "contact_force", face) for face in faces}
    depth = {face: face_signal(history, "penetration", face) for face in faces}
    pushed = {face: face_signal(history, "impulse", face) for face in faces if "impulse" in history}
    time = np.asarray(history["time"].values, dtype=float)
    end = end_words(frequency) if is_long(time, frequency) else "the whole record"
    size = max(one.time.size for one in force.values())
    (unit, in_unit), (small, in_small) = display_of(force.values()), display_of(depth.values())
    (deep, in_deep), (clock, in_clock) = display_of(depth.values(), 1), unit_of_record(time)
    whole = [ChartCurve(face, *envelope(in_clock * one.time, in_unit * one.values)) for face, one in force.items()]
    span = enlarged_span(time, np.sum([one.values for one in force.values()], axis=0), frequency, ZOOM)
    near, in_near = unit_of_time(span)
    last = [ChartCurve(face, *_part(one.between(*span), in_near, in_unit)) for face, one in force.items()]
    gaps = [ChartCurve(face, *_part(one.between(*span), in_near, -in_small)) for face, one in depth.items()]
    push, in_push = display_of(pushed.values()) if pushed else ("N s", 1.0)
    rows = []
    for face in faces:
        pressed = force[face].values > 0.0
        impulses = pushed[face].values if pushed else None
        rows.append(
            (
                face, None if face in impulsive else in_unit * float(force[face].values.max()),
                in_unit * float(force[face].values.mean()), 100.0 * float(pressed.mean()),
                in_deep * float(max(depth[face].values.max(), 0.0)),
                in_small * float(max(-depth[face].values.min(), 0.0)),
                None if impulses is None else in_push * float(impulses[-1] - impulses[0]),
            )
        )  # fmt: skip
    heads = ("face", f"largest recorded force ({unit})", f"mean force ({unit})", "in contact (% of the records)",
             f"largest penetration ({deep})", f"largest gap ({small})", f"impulse ({push})")  # fmt: skip
    notes = [f"No largest force of {' and '.join(impulsive)}: {IMPULSES_ONLY}"] if impulsive else []
    blocks: list[Block] = []
    if is_long(time, frequency):
        words = f"Normal force on the beam, the whole record.{thinning_words(size)}"
        blocks.append(Chart(words, f"time ({clock})", f"contact force ({unit})", whole, command))
    blocks += [
        Chart(f"Normal force on the beam, {end}.", f"time ({near})", f"contact force ({unit})", last, command),
        Chart(
            f"Smallest gap of each face, {end}; below zero the largest penetration.",
            f"time ({near})", f"gap ({small})", gaps, command,
        ),
        TableBlock("The faces over the whole record, at the recorded instants", heads, rows, notes),
        *_bodies(history),
    ]  # fmt: skip
    return ReportSection("Contact", "contact", blocks)


def _bodies(history: xr.Dataset) -> list[Block]:
    """Return the table of the flexible supports; nothing where all stand still."""
    if "support_displacement" not in history:
        return []
    moves, forces = history["support_displacement"].values, history["support_force"].values
    (unit, factor), (push, in_push) = shown("m", np.abs(moves).max()), shown("N", np.abs(forces).max())
    heads = (
        "support", "axis", f"largest displacement ({unit})", f"at the start ({unit})",
        f"largest force on the frame ({push})",
    )  # fmt: skip
    rows = []
    for name in history["support_body"].values:
        for axis in history["support_axis"].values:
            moved, force = (
                history[key].sel(support_body=name, support_axis=axis).values
                for key in ("support_displacement", "support_force")
            )
            if np.any(moved):
                sizes = factor * float(np.abs(moved).max()), factor * float(moved[0])
                rows.append((str(name), str(axis), *sizes, in_push * float(np.abs(force).max())))
    return [TableBlock("The supports that give way, at the recorded instants", heads, rows)]


def _part(part: Signal, in_unit: float, factor: float) -> tuple[np.ndarray, np.ndarray]:
    return envelope(in_unit * part.time, factor * part.values)


COHERENCE_HEADER = ("x (m)", "distance (m)", "coherence there", "asked", "generated", "95 % interval", "within")
CROSS_HEADER = ("band (Hz)", "asked", "generated", "95 % interval", "phase error (degrees)", "within")
RANDOM_LOADS_SECTION_HEADER = ("band (Hz)", "asked", "generated", "ratio", "95 % interval of the ratio", "within")


def random_loads_section(summary: dict[str, Any]) -> ReportSection | None:
    """Return the section on random loads as generated and as asked for; None for a run without any.

    Args:
        summary: Summary of a run.
    """
    loads = summary.get("random_loads") or ()
    blocks = [block for load in loads for block in [*_spectrum(load), *_coherence(load), *_cross_spectrum(load)]]
    return ReportSection("Random loads", "random-loads", blocks) if blocks else None


def _cross_spectrum(load: dict[str, Any]) -> list[Block]:
    """Return the coherence with another load; nothing for loads that name none, and of earlier releases."""
    found = load.get("cross_spectrum")
    if not found:
        return []
    both = f"`{load['name']}` and `{found['load']}`"
    before = f"Coherence of {both} at the phase asked for"
    behind = "The phase error is the phase generated less the one asked for."
    return _compared(both, CROSS_HEADER, [_cross_row(band) for band in found["bands"]], before, behind)


def _cross_row(band: dict[str, Any]) -> tuple[Cell, ...]:
    low, value, high = band["low"], band["generated"], band["high"]
    return (
        f"{number(band['from'])} to {number(band['to'])}", band["asked"], value, f"{low:.3f} to {high:.3f}",
        band["phase_error"], _within(low, value, high),
    )  # fmt: skip


def _coherence(load: dict[str, Any]) -> list[Block]:
    """Return the generated and the requested coherence; nothing for loads at one place, and of earlier releases."""
    found = load.get("coherence")
    if not found:
        return []
    name, rows = f"`{load['name']}`", [_coherence_row(one) for one in found["places"]]
    before = f"{name} acts as forces at {counted(len(rows) + 1, 'station')}. Their correlation with the one at x = "
    before += f"{number(found['from'])} m over {number(found['independent'])} independent pairs" if rows else ""
    behind = "The coherence asked for is averaged over the reach of both stations, and also given at their "
    return _compared(name, COHERENCE_HEADER, rows, before, f"{behind}distance.")


def _compared(what: str, header: tuple[str, ...], rows: Sequence[tuple[Cell, ...]], *words: str) -> list[Block]:
    """Return a table of coherences; `words` stand before and behind how many of them lie in their intervals."""
    if not rows:
        return [Words(f"The run is too short to compare the coherence of {what} with the one asked for.")]
    inside = sum(row[-1] == "yes" for row in rows)
    counted = f"{inside} of {len(rows)} lie within the interval that chance leaves"
    return [Words(f"{words[0]}: {counted}. {words[1]}"), TableBlock(f"Coherence of {what}", header, rows)]


def _coherence_row(one: dict[str, Any]) -> tuple[float, float, float, float, float, str, str]:
    low, high = one["low"], one["high"]
    found = one["generated"]
    return (
        one["x"], one["distance"], one["curve"], one["asked"], found, f"{low:.3f} to {high:.3f}",
        _within(low, found, high),
    )  # fmt: skip


def _spectrum(load: dict[str, Any]) -> list[Block]:
    name = f"`{load['name']}`"
    asked = f"{name}: rms {number(load['rms'])} {load['unit']}, seed {load['seed']}"
    if not load["bands"]:
        return [Words(f"{asked}. The run is too short to compare the spectrum of its signal with the one asked for.")]
    rows = [_row(band) for band in load["bands"]]
    inside = sum(row[-1] == "yes" for row in rows)
    words = (
        f"{asked}. Over {number(load['seconds'])} s, {inside} of {counted(len(rows), 'band')} lie within the "
        "interval that chance "
        "leaves; one in 20 lies outside where all is as asked for."
    )
    square = {"N": "N²", "N/m": "(N/m)²"}.get(load["unit"], "(m/s²)²")
    title = f"Mean squares of {name} in bands of equal power, {square}"
    return [Words(words), TableBlock(title, RANDOM_LOADS_SECTION_HEADER, rows)]


def _row(band: dict[str, Any]) -> tuple[str, float, float, float, str, str]:
    ratio = band["generated"] / band["asked"]
    least, most = band["least_ratio"], band["most_ratio"]
    return (
        f"{number(band['from'])} to {number(band['to'])}",
        band["asked"],
        band["generated"],
        ratio,
        f"{number(least)} to {number(most)}",
        _within(least, ratio, most),
    )


def _within(low: float, value: float, high: float) -> str:
    return "yes" if low <= value <= high else "no"
