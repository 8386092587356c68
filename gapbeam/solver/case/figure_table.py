"""A figure of one's own: one statistic of a recorded quantity at a place, over a part of a run.

Statistics of a quantity over a part of a run, and the value of a figure.

Between records t_i the quantity x is a straight line. With n intervals h_i of the part, T = sum h_i, a_i and b_i the
values at the ends of an interval,

    mean     m = sum h_i (a_i + b_i) / (2 T)
    rms      s^2 = sum h_i (a_i^2 + a_i b_i + b_i^2) / (3 T), of x - m
    share    of the time above a limit L: sum h_i p_i / T, p_i the part of the line that is above L
    quantile the limit whose share is one less its level

The probability that x is above L within a time d is the share of the windows of length d whose largest value is. Its
95 % interval is that of k windows out of m, which count as independent.
Source: Clopper and Pearson, Biometrika 26 (1934) 404.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any, ClassVar, Literal

import numpy as np
import scipy
from pydantic import Field, ValidationError

from gapbeam.solver.messages.errors import Fault, Key, UserError
from gapbeam.solver.messages.wording import apart, either, near
from gapbeam.solver.schema.record_table import HISTORY, TURNING, unit_where
from gapbeam.solver.schema.table import Name, NonNegative, Number, Positive, Switch, Table, faults_in

CONFIDENCE = 0.95
_WHOLE = 1.0e-9


@dataclass(frozen=True)
class FigureValue:
    """The value of a figure.

    Attributes:
        name: Name of the figure.
        unit: SI unit; "1" for shares and probabilities.
        value: SI; None: it is not known.
        low: Lower end of the 95 % interval of a probability; None: the figure has none.
        high: Its upper end.
        at: Time of a maximum or minimum, s.
        reason: Why there is no value.
    """

    name: str
    unit: str
    value: float | None
    low: float | None = None
    high: float | None = None
    at: float | None = None
    reason: str = ""

    def as_data(self) -> dict[str, Any]:
        """Return the value for JSON, without empty entries."""
        return {key: value for key, value in vars(self).items() if value not in (None, "")} | {"value": self.value}


def extreme(blank: FigureValue, t: np.ndarray, x: np.ndarray, place: int, timed: bool) -> FigureValue:
    """Return a largest or smallest value with its time, or that time.

    Args:
        blank: The figure without its value.
        t: Times, s, (n,).
        x: Values, (n,).
        place: Place of the value.
        timed: Whether the figure is the time.
    """
    return replace(blank, value=float(t[place])) if timed else replace(blank, value=float(x[place]), at=float(t[place]))


def probability(blank: FigureValue, t: np.ndarray, x: np.ndarray, limit: float, duration: float) -> FigureValue:
    """Return the probability that a quantity is above a limit within a time, with its interval.

    Args:
        blank: The figure without its value.
        t: Times, s, (n,).
        x: Values, (n,).
        limit: The limit, in the unit of x.
        duration: The time, s.
    """
    count = int((t[-1] - t[0]) / duration * (1.0 + _WHOLE))
    if count < 1:
        return replace(blank, reason=f"the records have no window of {duration:g} s")
    edges = t[0] + duration * np.arange(count + 1)
    above = np.concatenate([t[x > limit], edges[np.interp(edges, t, x) > limit]])
    ends = np.union1d(np.searchsorted(edges, above, "left"), np.searchsorted(edges, above, "right"))
    happened = scipy.stats.binomtest(int(np.count_nonzero((ends > 0) & (ends <= count))), count)
    interval = happened.proportion_ci(CONFIDENCE)
    return replace(blank, value=float(happened.statistic), low=float(interval.low), high=float(interval.high))


def mean(t: np.ndarray, x: np.ndarray) -> float:
    """Return the mean over time."""
    return float(np.trapezoid(x, t) / (t[-1] - t[0])) if t[-1] > t[0] else float(x[-1])


def deviation(t: np.ndarray, x: np.ndarray) -> float:
    """Return the root mean square about the mean."""
    middle = mean(t, x)
    a, b = x[:-1] - middle, x[1:] - middle
    square = float(np.diff(t) @ (a * a + a * b + b * b)) / 3.0
    return float(np.sqrt(square / (t[-1] - t[0]))) if t[-1] > t[0] else 0.0


def share_above(t: np.ndarray, x: np.ndarray, limit: float) -> float:
    """Return the share of the time above a limit."""
    return float(np.diff(t) @ part_above(x, limit) / (t[-1] - t[0])) if t[-1] > t[0] else float(x[-1] > limit)


def value_below(t: np.ndarray, x: np.ndarray, level: float) -> float:
    """Return the value below which a quantity is for a share of the time.

    Args:
        t: Times, s, (n,).
        x: Values, (n,).
        level: The share of the time.
    """
    known = np.unique(x)
    place = bisect_left(known, level, hi=len(known) - 1, key=lambda limit: 1.0 - share_above(t, x, limit))
    if place == 0:
        return float(known[0])
    low, high = 1.0 - share_above(t, x, known[place - 1]), share_above(t, -x, -known[place])
    part = min((level - low) / (high - low), 1.0) if high > low else 1.0  # beyond: it rests at this value
    return float(known[place - 1] + part * (known[place] - known[place - 1]))


def part_above(x: np.ndarray, limit: float) -> np.ndarray:
    """Return the part of each interval in which a quantity, (n, ...), is above a limit, (n - 1, ...)."""
    low, high = np.minimum(x[:-1], x[1:]) - limit, np.maximum(x[:-1], x[1:]) - limit
    crossing = (high > 0.0) & (low < 0.0)
    whole = np.asarray(low >= 0.0, dtype=float) * (high > 0.0)
    return np.asarray(np.divide(high, high - low, out=whole, where=crossing))


RECORDED = {one.name: one for one in HISTORY}
SUMS = ("contact_force", "contact_area", "impulse", "active_points", "sliding_work")
"""Quantities of which a support has the sum over its faces; of a penetration it has the largest."""
PLACED = ("probe", "moved_probe", "turned_probe", "gauge", "face", "worn_face", "joint", "load", "moving",
          "support_body")  # fmt: skip
"""Dimensions along which records have a place; others are components."""
NUMBERS = ("1", "2")
"""Components by the numbers of the motions of a point of a structure."""
OF_FACES = ("face", "worn_face")
Statistic = Literal[
    "value", "maximum", "minimum", "peak-to-peak", "mean", "rms", "quantile", "share", "probability", "time-of-maximum",
    "time-of-minimum",
]  # fmt: skip
EXTRA = {"value": ("time",), "quantile": ("level",), "share": ("limit",), "probability": ("limit", "duration")}
"""Keys that a statistic asks for, and no other takes."""
STEPWISE = ("contact_force", "friction_force", "joint_force", "joint_moment", "acceleration_relative",
            "acceleration_absolute")  # fmt: skip
"""Quantities that an impulse makes as large as the time step is short; their means and times do not follow it."""
SCALELESS = ("share", "probability")
LATE = 1.0e-9  # of the end of the records, by which a time may lie after it


class Figure(Table):
    """A result of one's own: a statistic of a recorded quantity at a place, over a part of the run."""

    elsewhere: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("probe", "point", "face", "support", "pair", "contact", "joint", "load"), "the key `place` has its name"
    ) | {"value": 'the key `quantity` has what is taken, `statistic` how: "value" is that at a `time`'}

    name: Name = Field(description="unique name, in results", examples=["knock"])
    quantity: str = Field(
        min_length=1,
        max_length=60,
        description="recorded quantity, as history.h5 names it: displacement, velocity, acceleration_absolute, "
        "rotation, contact_force, penetration, impulse, von_mises_stress, joint_force, kinetic_energy ...",
        examples=["contact_force"],
    )
    place: str | None = Field(
        default=None,
        min_length=1,
        max_length=81,
        description="name of the probe, face, joint, load or support body; a whole support has the sum over its "
        "faces, a pair of faces over its contacts, or the largest penetration; default none: the quantity has no place",
        examples=["gland"],
    )
    component: str | None = Field(
        default=None,
        min_length=1,
        max_length=40,
        description="component, such as x, y or z, or number of a motion of a [[point]]; default the last one, of a "
        "motion the bending direction",
    )
    magnitude: Switch = Field(default=False, description="take the absolute value of the quantity first")
    statistic: Statistic = Field(
        default="maximum",
        description="what is taken of it; rms is about the mean, share the part of the time above `limit`, probability "
        "that of being above `limit` within `duration`",
    )
    time: NonNegative | None = Field(default=None, description="value: when, s")
    level: Number | None = Field(
        default=None, gt=0, lt=1, description="quantile: part of the records below it, no unit", examples=[0.95]
    )
    limit: Number | None = Field(default=None, description="share, probability: limit, in the unit of the quantity")
    duration: Positive | None = Field(default=None, description="probability: time within which the limit counts, s")
    start: NonNegative = Field(default=0.0, description="time from which records count, s")
    end: Positive | None = Field(default=None, description="time up to which they count, s; default the end of the run")

    @property
    def unit(self) -> str:
        """SI unit."""
        if self.statistic in SCALELESS:
            return "1"
        return "s" if self.statistic.startswith("time-of") else RECORDED[self.quantity].unit

    def unit_in(self, labels: Mapping[str, Sequence[str]]) -> str:
        """Return the SI unit among these names: rad and N m in place of m and N where its place rotates."""
        return unit_where(self.unit, self.place in labels.get(TURNING, ()))

    @property
    def last(self) -> float | None:
        """Time after which records do not count, s; None: all do."""
        return self.time if self.statistic == "value" else self.end

    @property
    def is_stepless(self) -> bool:
        """True of a mean or a time, which impulses do not make follow the step."""
        return self.statistic == "mean" or self.statistic.startswith("time-of")

    @property
    def averages(self) -> bool:
        """True where the figure is the mean of something over the whole run: blocks of records have intervals then."""
        return self.statistic in ("mean", "rms", "share") and self.start == 0.0 and self.end is None

    @property
    def is_sampled(self) -> bool:
        """True where records of the whole run have an interval under noise: of what averages, and of a quantile."""
        return self.averages or (self.statistic == "quantile" and self.start == 0.0 and self.end is None)

    def earlier(self, by: float) -> Figure:
        """Return the figure on records whose times are less by so many s."""
        moved = {key: max(getattr(self, key) - by, 0.0) for key in ("start", "end", "time") if getattr(self, key)}
        return self.model_copy(update=moved) if by else self

    def series(self, records: Mapping[str, np.ndarray], labels: Mapping[str, Sequence[str]]) -> np.ndarray:
        """Return the quantity at the records, (times,).

        Args:
            records: Records by name, (times, ...).
            labels: Names along their dimensions.

        Raises:
            UserError: The quantity is not recorded, or not at the place.
        """
        if self.quantity not in records:
            self._refuse("quantity", self.quantity, [name for name in records if name in RECORDED])
        found, dims = np.asarray(records[self.quantity], dtype=float), RECORDED[self.quantity].dims[1:]
        for dim in dims:
            names = [str(one) for one in labels.get(dim, ())]
            if dim in PLACED:
                found = self._at_place(found, names, dim)
                continue
            wanted = names[-1] if self.component is None and names else self.component
            if wanted in NUMBERS[: len(names)]:
                wanted = names[NUMBERS.index(wanted)]
            if wanted not in names:
                self._refuse("component", wanted, names)
            found = found[:, names.index(str(wanted))]
        return np.abs(found) if self.magnitude else found

    def of(self, history: Any) -> FigureValue:
        """Return the figure of the history of a run: an xarray dataset as `open_results(folder).history`.

        Raises:
            UserError: As `series`.
        """
        records = {str(name): values.values for name, values in history.data_vars.items()}
        labels = labels_of(history)
        found = self.value(np.asarray(history["time"].values, dtype=float), self.series(records, labels))
        return replace(found, unit=self.unit_in(labels))

    def value(self, times: np.ndarray, series: np.ndarray) -> FigureValue:
        """Return the figure of a quantity.

        Args:
            times: Times of the records, s, (n,).
            series: Their values, (n,).
        """
        blank = FigureValue(self.name, self.unit, None)
        until = times[-1] if self.last is None else self.last
        begin = until if self.statistic == "value" else max(self.start, times[0])
        if until > times[-1] * (1.0 + LATE) or not times[0] <= begin <= times[-1]:
            return replace(blank, reason=f"the records go from t = {times[0]:.6g} s to {times[-1]:.6g} s")
        inside = (times > begin) & (times < until)
        t = np.concatenate([[begin], times[inside], [until]])
        x = np.interp(t, times, series)
        match self.statistic:
            case "value":
                found = float(x[-1])
            case "maximum" | "time-of-maximum":
                return extreme(blank, t, x, int(np.argmax(x)), self.statistic != "maximum")
            case "minimum" | "time-of-minimum":
                return extreme(blank, t, x, int(np.argmin(x)), self.statistic != "minimum")
            case "probability":
                return probability(blank, t, x, self.limit or 0.0, self.duration or 0.0)
            case "peak-to-peak":
                found = float(np.ptp(x))
            case "mean":
                found = mean(t, x)
            case "rms":
                found = deviation(t, x)
            case "quantile":
                found = value_below(t, x, self.level or 0.0)
            case "share":
                found = share_above(t, x, self.limit or 0.0)
        return replace(blank, value=found)

    def _at_place(self, found: np.ndarray, names: Sequence[str], dim: str) -> np.ndarray:
        mine = [number for number, name in enumerate(names) if name == self.place]
        if dim in OF_FACES and not mine:
            parts = parts_of(self.place or "", names)
            mine = [number for number, name in enumerate(names) if name in parts]
            whole = self.quantity in SUMS or self.quantity == "penetration"
            if mine and not whole:
                self._refuse("place", self.place, [names[number] for number in mine])
        if not mine:
            self._refuse("place", self.place, names)
        if len(mine) == 1:
            return np.asarray(found[:, mine[0]])
        part = found[:, mine]
        return np.asarray(part.max(axis=1) if self.quantity == "penetration" else part.sum(axis=1))

    def _refuse(self, key: str, found: str | None, known: Sequence[str]) -> None:
        close = near(found, known) if found else None
        words = f"one of {', '.join(dict.fromkeys(known))}" if known else "none: nothing of the kind is recorded"
        raise UserError(
            f"figure {self.name}: {key} = {found!r}; expected {words}{f'; did you mean {close}?' if close else ''}"
        )


def figure(name: str, quantity: str, place: str | None = None, **keys: Any) -> Figure:
    """Return a figure of one's own, of the history of a run (`figure(...).of(history)`) or for `run(scene, figures=)`.

    Args:
        name: Name in results.
        quantity: As history.h5 names it, such as "contact_force".
        place: Probe, face, joint, load, support body or support; of a scene a point or contact.
        keys: Others of the table [[figure]] of case files: statistic, component, limit, level, time, start, end ...

    Raises:
        UserError: A key is unknown, or does not fit the others.
    """
    try:
        found = Figure.model_validate({"name": name, "quantity": quantity, "place": place, **keys})
    except ValidationError as error:
        raise UserError(f"figure: {faults_in(error)}") from None
    for fault in figure_faults({0: found}, {}, inf):
        raise UserError(f"figure: {fault.key[-1]}: found {fault.found}; expected {fault.expected}")
    return found


def parts_of(place: str, names: Iterable[str]) -> list[str]:
    """Return the names of the faces of a whole support, "NAME_below", or of the contacts of a pair, "NAME-0"."""
    form = re.compile(rf"{re.escape(place)}(_.*|-\d+)")
    return [name for name in names if form.fullmatch(name)]


def labels_of(history: Any) -> dict[str, list[str]]:
    """Return the names along each dimension of a history, an xarray dataset."""
    return {str(dim): [str(one) for one in history[dim].values] for dim in history.dims if dim in history.coords}


def figure_values(
    figures: Sequence[Figure], records: Mapping[str, np.ndarray], labels: Mapping[str, Sequence[str]]
) -> dict[str, dict[str, Any]]:
    """Return figures by name, as JSON has them; one that cannot be taken has its reason.

    Args:
        figures: Figures that are asked for.
        records: Records by name, (times, ...), and "time".
        labels: Names along their dimensions.
    """
    found: dict[str, dict[str, Any]] = {}
    for one in figures:
        try:
            value = one.value(records["time"], one.series(records, labels))
        except UserError as error:
            value = FigureValue(one.name, one.unit, None, reason=str(error))
        found[one.name] = replace(value, unit=one.unit_in(labels)).as_data()
    return found


def figure_faults(figures: Mapping[int, Figure], places: Mapping[str, Sequence[str]], end: float) -> Iterator[Fault]:
    """Yield the faults of figures, by number.

    Args:
        figures: Figures by number.
        places: Names along dimensions, "component" too; "component of PLACE" are those of one place, "support" has
            whole supports, "struck" places of impulses.
            Others are not checked.
        end: End of the run, s.
    """
    for number, one in figures.items():
        key: Key = ("figure", number)
        if one.quantity not in RECORDED:
            close = near(one.quantity, RECORDED)
            hint = f'"{close}"' if close else ""
            yield Fault((*key, "quantity"), f'"{one.quantity}"', f"one of {', '.join(RECORDED)}", hint)
            continue
        yield from _key_faults(one, key)
        yield from _place_faults(one, key, places)
        if one.component is not None:
            dims = [dim for dim in RECORDED[one.quantity].dims[1:] if dim not in PLACED]
            known = places.get(f"component of {one.place}", places.get(dims[0], ())) if dims else ()
            if one.component not in known and (known or not dims):
                expected = f"one of {', '.join(known)}" if dims else f"no component: {one.quantity} has none"
                hint = f'component = "{NUMBERS[0]}" is the first motion of the point' if NUMBERS[0] in known else ""
                yield Fault((*key, "component"), f'"{one.component}"', expected, hint)
        if one.quantity in STEPWISE and one.place in places.get("struck", ()) and not one.is_stepless:
            yield Fault((*key, "quantity"), f'"{one.quantity}" of {one.place}, which impulses strike: it follows the '
                        "step", 'statistic = "mean", or impulse, velocity and displacement',
                        'a stiff spring has forces: law = { type = "kelvin-voigt", stiffness = 1e8 }')  # fmt: skip
        for name, value in (("start", one.start), ("end", one.end), ("time", one.time)):
            if value is not None and value > end:
                words, limit = apart(value, end)
                yield Fault((*key, name), f"{words} s", f"at most time.end = {limit} s")
        if one.end is not None and one.end <= one.start:
            yield Fault((*key, "end"), f"{one.end:g} s", f"more than start = {one.start:g} s")


def _key_faults(one: Figure, key: Key) -> Iterator[Fault]:
    wanted = EXTRA.get(one.statistic, ())
    for name in ("time", "level", "limit", "duration"):
        given = getattr(one, name) is not None
        if given and name not in wanted:
            others = [statistic for statistic, keys in EXTRA.items() if name in keys]
            yield Fault((*key, name), f'{name} with statistic = "{one.statistic}"', f"statistic = {either(others)}")
        elif name in wanted and not given:
            yield Fault((*key, "statistic"), f'"{one.statistic}" without {name}', f"the key {name}")
    if one.statistic == "value" and (one.end is not None or one.start):
        yield Fault((*key, "statistic"), '"value" with start or end', "time alone")


def _place_faults(one: Figure, key: Key, places: Mapping[str, Sequence[str]]) -> Iterator[Fault]:
    dims = [dim for dim in RECORDED[one.quantity].dims if dim in PLACED]
    if not dims:
        if one.place is not None:
            yield Fault((*key, "place"), f'"{one.place}"', f"no place: {one.quantity} is one of the whole system")
        return
    dim = dims[0]
    if dim not in places:
        return
    known = [*places[dim]]
    if dim in OF_FACES and (one.quantity in SUMS or one.quantity == "penetration"):
        known += places.get("support", ())
    if one.place in known:
        return
    close = near(one.place, known) if one.place else None
    asks = {"gauge": "a [[probe]] or [[point]] with stress = true", "turned_probe": "a [[probe]] with rotation = true"}
    expected = either([f'"{name}"' for name in dict.fromkeys(known)]) if known else asks.get(dim, f"a [[{dim}]]")
    yield Fault(
        (*key, "place"), "no place" if one.place is None else f'"{one.place}"', f"{expected}, for {one.quantity}",
        f'did you mean "{close}"?' if close else asks.get(dim, "") if known else "",
    )  # fmt: skip
