"""First screen of the report of a run: supports with their loads, doubts, and advice.

Values along the beam are charts, with a button for each support where supports lie far apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gapbeam.postprocess.display_units import shown_along, shown_by
from gapbeam.postprocess.report.blocks import Block, Cell, TableBlock, Verdict, number, percent
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.html_page import sentence
from gapbeam.postprocess.signals.figure_names import IMPULSE, LARGEST_FORCE, MEAN_FORCE, NOT_SETTLED, REFUSED, usable

USE_HEAD = "use of the peak"
RESOLVED = "contacts resolved by the step"
MOST_TO_DO = 3
LEAST = 1.0e-4  # of a figure: a smaller error is not written
ADVICE = ("try ", "use ", "make it ", "add ")  # words of warnings that say what to do
SAID = (RESOLVED, f"the {LARGEST_FORCE} on ", "can be predicted up to")  # warnings that advice of ours stands for
RANGE, COUNTED = " †", " counted"  # behind a number of impacts
FINE = ("good", "rough", "no contact")  # verdicts of figures that may be used
IMPULSES_ONLY = "the law is impulses, which act at once; a force of a step is the impulse over the step."
Summary = Mapping[str, Any]


def support_table(summary: Summary) -> TableBlock | None:
    """Return peak force, impulse, impacts a second and wear of each face, each with its interval; None without faces.

    Impacts have the 95 % interval of the statistics. Without statistics the interval is the range over the run and its
    comparison runs, which have another step, mesh or contact stiffness: it says what these change, not what another
    start would. Impacts of a run without either have none.

    Args:
        summary: Summary of a run.
    """
    faces = _faces(summary)
    if not faces:
        return None
    closing = str((summary.get("closing") or {}).get("part") or "")
    span = closing.partition(",")[0]
    figures = {
        str(one["name"]): one for one in (summary.get("errors") or {}).get("figures") or () if one.get("span") == span
    }
    worn, unit = _wear(summary)
    spans = {str(one["name"]): float(one["width"]) for one in (summary.get("errors") or {}).get("spans") or ()}
    over = f" in {spans[span]:.3g} s" if span in spans else ""
    wear_head = (f"wear ({unit})",) if worn else ()
    kinds = [f"{face} {kind}" for face in faces for kind in (LARGEST_FORCE, MEAN_FORCE)]
    every = [figures[name]["value"] for name in kinds if name in figures]
    recorded = summary.get("peak_contact_force") or {}
    force, in_force = shown_by("N", every or [recorded.get(face) for face in faces])
    push, in_push = shown_by("N s", [one["value"] for name, one in figures.items() if name.endswith(f" {IMPULSE}")])
    heads = ("face", f"peak force ({force})", f"impulse{over} ({push})", "impacts (1/s)", *wear_head, USE_HEAD)
    rows = list[tuple[Cell, ...]]()
    for face in faces:
        peak, judged = _peak(summary, face, figures, in_force)
        wear = (worn.get(face, ""),) if worn else ()
        impulse = _figure(figures.get(f"{face} {IMPULSE}"), in_push)
        rows.append((face, peak, impulse, _impacts(summary, face), *wear, judged))
    part = f", {closing}" if closing else ""
    notes = (
        [f"A star: the {MEAN_FORCE} over a contact, ten records at most, as blows are not resolved."]
        if any("*" in str(row[1]) for row in rows)
        else []
    )
    if set(faces) & set(impulsive_faces(summary)):
        notes.append(f"No peak force: {IMPULSES_ONLY} The last column judges the impulse.")
    turning = set((summary.get("scene") or {}).get("turning") or ())
    if turned := [face for face in faces if face in turning]:
        notes.append(
            f"{', '.join(turned)}: moments of rotations, in {force} m and {push.removesuffix(' s')} m s; speeds of "
            "impacts in rad/s."
        )
    if any(RANGE in str(row[3]) for row in rows):
        notes.append("†: of the whole run, with the range over it and its comparison runs; light touches count.")
    if any(COUNTED in str(row[3]) for row in rows):
        notes.append("Impacts without an interval: no comparison run counted them.")
    return TableBlock(f"Loads on the supports{part}", heads, rows, notes, digits=3)


def _faces(summary: Summary) -> list[str]:
    """Return the faces that a run reports, in their order."""
    supports = [one for one in (summary.get("impacts") or {}).values() if isinstance(one, Mapping)]
    found = [str(face) for one in supports for face in one.get("faces") or {}]
    return found or list(dict.fromkeys([*(summary.get("peak_contact_force") or {}), *impulsive_faces(summary)]))


def impulsive_faces(summary: Summary) -> list[str]:
    """Return the contacts of a scene whose law is impulses: they have no peak force."""
    contacts = (summary.get("scene") or {}).get("contacts") or ()
    return [str(one["name"]) for one in contacts if one.get("impulsive")]


def _peak(summary: Summary, face: str, figures: Mapping[str, Summary], factor: float) -> tuple[str, str]:
    """Return the peak force of a face with its interval, and whether it, or the impulse, may be used."""
    names = ((IMPULSE, ""),) if face in impulsive_faces(summary) else ((LARGEST_FORCE, ""), (MEAN_FORCE, " *"))
    for name, star in names:
        if one := figures.get(f"{face} {name}"):
            if one["value"] == 0.0 == one.get("error"):
                return "0", "no contact"
            return "none" if name == IMPULSE else f"{_figure(one, factor)}{star}", usable(one.get("relative_error"))
    force = (summary.get("peak_contact_force") or {}).get(face)
    return ("", "") if force is None else (number(factor * float(force), 3), "error not known")


def _figure(one: Summary | None, factor: float) -> str:
    """Return a figure of a run with its error, times a factor."""
    if one is None:
        return ""
    value, relative, error = factor * float(one["value"]), one.get("relative_error"), one.get("error")
    if relative is None:
        return number(value, 3) if error is None else f"{number(value, 3)} ± {number(factor * float(error), 2)}"
    part = (
        percent(float(relative), signed=False) if relative >= LEAST or not error else f"less than {percent(LEAST)[1:]}"
    )
    return f"{number(value, 3)} ± {part}"


def _impacts(summary: Summary, face: str) -> str:
    """Return the impacts of a face a second: with the interval of the statistics, else that of `support_table`."""
    for one in (summary.get("statistics") or {}).get("figures") or ():
        if one["name"] == f"face.{face}.impact_rate" and one.get("relative") is not None:
            return _rate(one)
    for name, one in (summary.get("impacts") or {}).items():  # of supports with faces, or of contacts of a scene
        found = ((one.get("faces") or {}).get(face) or (name == face and one)) if isinstance(one, Mapping) else None
        if found and found.get("rate") is not None:
            rate, ranges = float(found["rate"]), (summary.get("errors") or {}).get("impact_rates") or {}
            if face not in ranges:
                return f"{number(rate, 3)} ({found['count']}{COUNTED})"
            low, high = ranges[face]  # an impact that has not ended has closed the face, and is not counted
            return f"{number(rate, 3)} ({number(min(low, rate), 3)} to {number(max(high, rate), 3)}){RANGE}"
    return ""


def _wear(summary: Summary) -> tuple[dict[str, str], str]:
    """Return the rate at which each face wears, with its interval, and its unit: depth where it is known, else work."""
    faces = (summary.get("wear") or {}).get("faces") or {}
    for key, unit in (("depth_rate", "m/s"), ("work_rate", "W")):
        rates = {str(face): one[key] for face, one in faces.items() if one.get(key)}
        if rates:
            return {face: _rate(one) for face, one in rates.items()}, unit
    return {}, ""


def _rate(one: Summary) -> str:
    low, high = one.get("low"), one.get("high")
    between = "" if low is None or high is None else f" ({number(float(low), 2)} to {number(float(high), 2)})"
    return f"{number(float(one['value']), 3)}{between}"


def doubts_of_figures(summary: Summary) -> list[str]:
    """Return the doubts on the figures of a completed run; none where all of them may be used.

    Args:
        summary: Summary of the run.
    """
    errors = summary.get("errors") or {}
    found = []
    if _unresolved(summary) is not None:
        found.append("peak forces are not resolved by the time step")
    if errors.get("horizon") is not None and not errors.get("settled_part_repeats"):
        found.append(f"the time history cannot be predicted after t = {number(float(errors['horizon']), 3)} s")
    if NOT_SETTLED in ((summary.get("closing") or {}).get("part") or ""):
        found.append("the response has not settled")
    if refused := _refused(summary):
        found.append(f"{_listed(refused)} may not be used")
    statistics = summary.get("statistics") or {}
    if doubtful := [one for one in statistics.get("figures") or () if one.get("verdict") not in (*FINE, "no event")]:
        kinds = dict.fromkeys(str(one["verdict"]) for one in doubtful)
        found.append(f"{len(doubtful)} statistics are {_listed(kinds)}")
    if errors.get("status") == "not estimated" and not summary.get("periodic"):
        found.append("the errors of the figures are not known")
    others = [
        str(one["name"])
        for one in summary.get("assumptions") or ()
        if one.get("verdict") not in ("holds", None) and one["name"] != RESOLVED
    ]
    return found + ([f"beyond its limit: {_listed(others)}"] if others else [])


def _unresolved(summary: Summary) -> Summary | None:
    """Return the assumption that the step resolves contacts, where it does not hold."""
    of_steps = (one for one in summary.get("assumptions") or () if one["name"] == RESOLVED)
    return next((one for one in of_steps if one.get("verdict") != "holds"), None)


def _refused(summary: Summary) -> list[str]:
    """Return the figures on the first screen, and in the table that closed the run, that may not be used."""
    rows = (summary.get("closing") or {}).get("rows") or ()
    table, struck = support_table(summary), impulsive_faces(summary)
    peaks = [
        f"{IMPULSE if row[0] in struck else 'peak force'} on {row[0]}"
        for row in (table.rows if table else ())
        if row[-1] == REFUSED
    ]
    others = [str(row["figure"]) for row in rows if row["verdict"] == REFUSED]
    said = (f" {LARGEST_FORCE}", f" {MEAN_FORCE}", f" {IMPULSE}")
    return peaks + [name for name in others if not any(words in name for words in said)]


def _listed(names: Sequence[str] | Mapping[str, Any]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def things_to_do(summary: Summary) -> list[Block]:
    """Return at most three remedies for the doubts of a run, in one frame; nothing where there are none.

    Args:
        summary: Summary of the run.
    """
    errors, found = summary.get("errors") or {}, list[str]()
    if (short := _unresolved(summary)) is not None:
        share = percent(float(short["closest"]), signed=False) if short.get("closest") is not None else "Much"
        found.append(
            f"**Take a smaller `time.step`**: {share} of the impulse passes in contacts shorter than 10 steps. "
            f"Until then, use the {MEAN_FORCE} over a contact, not peaks."
        )
    if errors.get("horizon") is not None and not errors.get("settled_part_repeats"):
        found.append(
            f"**Use averages, not the time history**, after t = {number(float(errors['horizon']), 3)} s. A longer "
            "`time.end` narrows their intervals."
        )
    if refused := _refused(summary):
        found.append(f"**Do not use {_listed(refused)}**: the error is larger than half of the value.")
    for text in summary.get("warnings") or ():
        if any(words in text for words in ADVICE) and not any(words in text for words in SAID):
            found.append(sentence(" ".join(str(text).split())))
    return [Verdict("note", "Things to do:\n\n" + "\n".join(f"- {one}" for one in found[:MOST_TO_DO]))] if found else []


_APART = 1.0  # of the length of what lies together: a larger distance to the next one leaves no room for both
MARKED = 60  # points of a line that has a mark for each


def chart_along(caption: str, y: str, lines: Mapping[str, tuple[np.ndarray, np.ndarray]], command: str = "") -> Chart:
    """Return a chart of values of faces along the beam.

    Args:
        caption: Description.
        y: Name of the vertical axis.
        lines: Places along the beam, m, increasing, and values, by face; at least one.
        command: Command that makes the chart.
    """
    unit, factor = shown_along([x for x, _ in lines.values()])
    curves = {
        face: ChartCurve(face, factor * x, values, "lines+markers" if len(x) < MARKED else "lines")
        for face, (x, values) in lines.items()
    }
    together = groups({face: (float(x[0]), float(x[-1])) for face, (x, _) in lines.items()})
    if len(together) == 1:
        return Chart(caption, f"x ({unit})", y, list(curves.values()), command)
    names = {face: " and ".join(group) for group in together for face in group}
    chosen = [replace(curve, choice=names[face]) for face, curve in curves.items()]
    return Chart(caption, f"x ({unit})", y, chosen, command, choices=list(dict.fromkeys(names.values())), choice="face")


def groups(spans: Mapping[str, tuple[float, float]]) -> list[list[str]]:
    """Group the names of neighboring spans; all in one group where no gap between them is long.

    Args:
        spans: Begin and end of each, m.
    """
    found: list[list[str]] = []
    begin = end = 0.0
    for name, (first, last) in sorted(spans.items(), key=lambda item: item[1]):
        if found and first - end <= _APART * max(end - begin, last - first):
            found[-1].append(name)
            end = max(end, last)
        else:
            found.append([name])
            begin, end = first, last
    return found


ZOOM = 3  # forcing periods


def end_words(frequency: float | None) -> str:
    """Return words for the part that charts zoom in on, with a forcing of a frequency in Hz or none."""
    return f"the last {ZOOM} forcing periods" if frequency is not None else "the tenth of the record where most happens"


def is_long(time: np.ndarray, frequency: float | None) -> bool:
    """Return whether the record is longer than the part that charts zoom in on.

    Args:
        time: (n,), s.
        frequency: Frequency of the forcing, Hz.
    """
    return frequency is None or float(np.ptp(time)) > 1.2 * ZOOM / frequency
