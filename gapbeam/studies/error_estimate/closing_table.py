"""The table that closes a run: its main figures, each with its interval and a verdict on its use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import ceil, floor, inf, log10
from textwrap import wrap
from typing import Any, NamedTuple

from gapbeam.postprocess.display_units import PREFIXES, shown
from gapbeam.postprocess.signals.figure_names import (
    AXIAL_STRESS,
    DISPLACEMENT,
    FORCES,
    IMPULSE,
    MEAN_FORCE,
    NOT_SETTLED,
    PEAKS,
    USE,
    VON_MISES_STRESS,
    usable,
)
from gapbeam.studies.error_estimate.figure_errors import FigureError
from gapbeam.studies.error_estimate.force_peaks import (
    BEYOND_HORIZON,
    FEWEST_WINDOWS,
    SECOND_HALF,
    SETTLED,
    UP_TO_HORIZON,
    WHOLE_RUN,
)

GAP = 2  # spaces between columns
MOST_ROWS, MOST_FORCES, MOST_STATISTICS = 8, 4, 3
LEAST_SHOWN = 0.001  # %: what rounds a sum of steps is no error estimate
LEAST_IN_MS = 1.0e-4  # s: widths of means below it are in microseconds
SHOWN_FIGURES = (f" {DISPLACEMENT}", f" {AXIAL_STRESS}", f" {VON_MISES_STRESS}", *FORCES)
SHOWN_STATISTICS = (".rms", ".impact_rate")
SHOWN_SPANS = (SETTLED, SECOND_HALF, WHOLE_RUN, "first part", BEYOND_HORIZON, UP_TO_HORIZON, "start-up")
NO_CONTACT = "no contact"


class ClosingRow(NamedTuple):
    """A row in words: the figure, its value, the interval around it, and whether it may be used."""

    figure: str
    value: str
    interval: str
    verdict: str


class ClosingTable(NamedTuple):
    """Rows, at most `MOST_ROWS`, the part of the run that they are of, and the number of figures left out."""

    part: str
    rows: tuple[ClosingRow, ...]
    others: int

    def as_data(self) -> dict[str, Any]:
        """Return the table for summary.json."""
        return {"part": self.part, "rows": [row._asdict() for row in self.rows], "others": self.others}


def closing_table(
    figures: Sequence[FigureError], reached: float, whole: bool, statistics: Mapping[str, Any] | None = None,
    horizon: float | None = None,
) -> ClosingTable:  # fmt: skip
    """Return the main figures of a run: own ones, all of them, statistics under noise, motions, the largest forces.

    Faces whose law is impulses have their impulse in place of a force.

    Args:
        figures: Figures of all parts of a run, with their errors.
        reached: Time up to which errors are known, s.
        whole: Whether that is the end of the run.
        statistics: Statistics in the summary of a run under random loads.
        horizon: Time up to which the motion is predictable, s; None: up to the end.
    """
    described = (statistics or {}).get("figures", ())
    counted = {one["name"]: one for one in described}
    own = [_statistic(counted[one.name]) if one.name in counted else _row(one) for one in figures if one.own]
    begun = (statistics or {}).get("burn_in")
    since = "" if begun is None else f", from {begun:.3g} s on"
    averaged = [_statistic(one, since) for one in described if one["name"].endswith(SHOWN_STATISTICS)]
    known = [one for one in figures if one.error is not None and not one.own]
    span = next((name for name in SHOWN_SPANS if any(one.span == name for one in known)), None)
    peaks = {one.name.removesuffix(end) for one in known for end in PEAKS if one.name.endswith(end)}
    shown = [one for one in known if one.span == span and one.name.endswith(SHOWN_FIGURES)]
    shown = [one for one in shown if one.name.removesuffix(f" {IMPULSE}") not in peaks]
    rows = [*own, *averaged[:MOST_STATISTICS]]
    forces = sorted((one for one in shown if one.name.endswith(FORCES)), key=lambda one: -abs(one.value))
    largest = forces[: max(min(MOST_FORCES, MOST_ROWS - len(rows)), 0)]
    motions = [one for one in shown if not one.name.endswith(FORCES)]
    room = max(MOST_ROWS - len(rows) - len(largest), 0)
    rows += [_row(one) for one in shown if one in motions[:room] or one in largest]
    until = f", {NOT_SETTLED}: means over its windows" if span == SECOND_HALF else ""
    until += f", t = {horizon:.3g} s" if span in (BEYOND_HORIZON, UP_TO_HORIZON) and horizon is not None else ""
    until += "" if whole else f", up to t = {reached:.3g} s"
    smaller = [one for one in forces if one not in largest and (one.value or one.error)]
    others = len(averaged[MOST_STATISTICS:]) + len(motions[room:]) + len(smaller)
    return ClosingTable(f"{span}{until}" if span else "", tuple(rows), others)


def words_beyond(
    figures: Iterable[FigureError], statistics: bool, frequency: float | None, rise: float, horizon: float,
    settled: float = 0.0,
) -> str:  # fmt: skip
    """Return in words which figures of a run have errors beyond its horizon, and from which end on some would have.

    There are enough windows where four of a forcing period lie in the second half, behind the horizon and the rise.

    Args:
        figures: Figures of all parts of a run, with their errors.
        statistics: Whether the run has statistics with intervals.
        frequency: Frequency of the forcing, Hz; None: it has none, or several.
        rise: Smooth start of the loads, s.
        horizon: Time up to which the motion is predictable, s.
        settled: Time at which the settled part begins, s, where the run has one.
    """
    known = {one.span for one in figures if one.error is not None}
    if SETTLED in known:
        digit = 10.0 ** (floor(log10(settled)) - 3)  # the fourth one; a start that is rounded down lies before it
        return f"its settled part repeats, and figures from t = {ceil(settled / digit) * digit:.4g} s on have errors"
    if statistics or BEYOND_HORIZON in known:
        return "only its statistics have errors"
    if frequency is None:
        return "no figure has an error"
    windows = FEWEST_WINDOWS / frequency
    end = max(2.0 * windows, rise + windows, 2.0 * horizon)
    digit = 10.0 ** (floor(log10(end)) - 1)  # the second one
    return f"no figure has an error, as the run is too short; time.end = {ceil(end / digit) * digit:g} would do"


def closing_lines(closing: Mapping[str, Any], width: float = inf) -> list[str]:
    """Return the closing table of a summary as text, for terminals and notebooks.

    Args:
        closing: As `ClosingTable.as_data` leaves it.
        width: Columns that long names of figures are folded for; what else a row holds stays in one line.
    """
    part, rows = closing["part"], [tuple(row.values()) for row in closing["rows"]]
    if rows:
        rows.insert(0, (f"figure, {part}" if part else "figure", *ClosingRow._fields[1:]))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = list[str]()
    for named, *cells in rows:
        others = "".join(f"{' ' * GAP}{cell:{size}}" for cell, size in zip(cells, widths[1:], strict=True))
        room = int(min(widths[0], max(width - len(others), len(rows[0][0]))))
        first, *more = wrap(named, room) or [""]
        lines += [f"{first:{room}}{others}".rstrip(), *more]
    return [*lines, f"{closing['others']} more in summary.json"] if closing["others"] else lines


def _row(one: FigureError) -> ClosingRow:
    if one.rests:
        return ClosingRow(one.name, "0 but for round-off", "", USE)
    verdict = usable(one.relative)
    if one.untouched:
        verdict = NO_CONTACT
    elif one.own and one.value == 0.0 == one.error:
        verdict = USE
    over = ""
    if one.window and one.name.endswith(f" {MEAN_FORCE}"):
        over = f" over {1e3 * one.window:.3g} ms" if one.window >= LEAST_IN_MS else f" over {1e6 * one.window:.3g} us"
    beside = one.error if one.error is not None and one.relative is None else 0.0
    return ClosingRow(one.name + over, with_unit(one.value, one.unit, largest=beside), plus_minus(one), verdict)


def _statistic(one: Mapping[str, Any], since: str = "") -> ClosingRow:
    """Return the row of a statistic: its part of the run, its 95 % interval, and the doubt about it, if any."""
    unit = one["unit"]
    verdict = one["verdict"] if one["verdict"] != "good" else usable(one["relative"])
    if one["relative"] is None:
        return ClosingRow(one["name"] + since, with_unit(one["value"], unit), "", verdict)
    value, low, high = (with_unit(one[end], unit, largest=one["high"]) for end in ("value", "low", "high"))
    return ClosingRow(one["name"] + since, value, f"{low} to {high}", verdict)


def plus_minus(one: FigureError) -> str:
    """Return an error in per cent of its figure, or in the unit of the figure where it is larger than that."""
    if one.error is None or one.untouched:
        return "not known"
    if one.relative is None:
        return f"+- {with_unit(one.error, one.unit, 2, one.value)}"
    percent = 100.0 * one.relative
    if percent < LEAST_SHOWN:
        return f"+- less than {LEAST_SHOWN:g} %"
    return f"+- {percent:.0f} %" if percent >= 10.0 else f"+- {percent:.2g} %"


def with_unit(value: float, unit: str, digits: int = 3, largest: float = 0.0) -> str:
    """Return a value with its unit, for terminals; its prefix by its size: 12 kN, 3 um.

    Args:
        value: The value, SI.
        unit: SI unit.
        digits: Significant digits.
        largest: Largest value beside it, which decides the prefix together with it, SI.
    """
    written, factor = shown(unit, max(abs(value), abs(largest))) if unit in PREFIXES else (unit, 1.0)
    return f"{factor * value:.{digits}g} {written.replace('µ', 'u')}".removesuffix(" 1")
