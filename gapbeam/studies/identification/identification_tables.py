"""Tables of an identification file: unknowns, measurements and search, with the contradictions between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.messages.wording import apart, either, near
from gapbeam.solver.schema.table import OF_TYPE, Name, NonNegative, Number, Positive, Switch, Table, Whole


class Unknown(Table):
    """A key of the case whose value is to be found."""

    key: str = Field(
        min_length=1,
        max_length=100,
        description="dotted key of the case, as after --set; all entries of a list of numbers get the same value",
        examples=["contact.stiffness"],
    )
    lower: Number = Field(description="least value, in the unit of the key", examples=[1e5])
    upper: Number = Field(description="largest value, in the unit of the key", examples=[1e9])
    start: Number | None = Field(
        default=None, description="start value, in the unit of the key; default the middle of the scale"
    )
    scale: Literal["log", "linear"] = Field(default="log", description="on which values are searched and differenced")


class Average(Table):
    """A moving average over consecutive samples, each the mean over its sampling interval."""

    points: Whole = Field(ge=1, le=10_000, description="number of samples averaged", examples=[5])
    rate: Positive = Field(description="sampling rate, Hz", examples=[2000.0])


class MotionFigure(Table):
    """A figure of the motion of a probe."""

    type: Literal["motion"] = Field(description="kind of figure", examples=["motion"])
    name: Name = Field(description="unique name, in measurements and results", examples=["peak"])
    probe: Name = Field(description="name of the probe", examples=["test"])
    quantity: Literal["acceleration", "velocity", "displacement"] = Field(
        default="acceleration", description="quantity of the motion"
    )
    frame: Literal["absolute", "relative"] = Field(
        default="absolute",
        description="acceleration: absolute, or relative to the support; the other quantities are relative",
    )
    component: Literal["x", "y", "z"] | None = Field(
        default=None, description="direction; default the bending direction"
    )
    statistic: Literal["peak-to-peak", "maximum", "minimum", "rms", "harmonic"] = Field(
        default="peak-to-peak", description="figure of the signal in a window; rms is about the mean"
    )
    order: Whole = Field(
        default=1, ge=1, le=100, description="harmonic: number of the harmonic of the forcing frequency"
    )
    average: Average | None = Field(
        default=None, description="moving average before that, a table; default none: as recorded"
    )
    window: Whole | None = Field(
        default=None, ge=1, le=1000, description="forcing periods in a window; default 12, or a multiple of the cycle"
    )


class ForceFigure(Table):
    """A figure of the contact force on a face."""

    type: Literal["force"] = Field(description="kind of figure", examples=["force"])
    name: Name = Field(description="unique name, in measurements and results", examples=["blow"])
    face: Name = Field(description="face: base, gland, NAME_below or NAME_above", examples=["gland"])
    statistic: Literal["maximum", "impulse"] = Field(
        default="maximum", description="largest force on record in a window, or the impulse in a forcing period"
    )
    window: Whole | None = Field(
        default=None, ge=1, le=1000, description="forcing periods in a window; default 12, or a multiple of the cycle"
    )


class FrequencyFigure(Table):
    """A natural frequency of small vibrations about a state of contact."""

    type: Literal["frequency"] = Field(description="kind of figure", examples=["frequency"])
    name: Name = Field(description="unique name, in measurements and results", examples=["first"])
    held: Literal["seated", "free", "closed"] = Field(
        default="seated", description="closed contact points: of the seat, none, or all"
    )
    mode: Whole = Field(default=1, ge=1, le=100, description="number of the bending mode, rigid motions left out")


Figure = Annotated[MotionFigure | ForceFigure | FrequencyFigure, OF_TYPE]


class Measurement(Table):
    """A measured value."""

    figure: Name = Field(description="name of the [[figure]]", examples=["peak"])
    value: Number = Field(description="measured value, in SI units", examples=[3.27])
    set: dict[str, Any] = Field(default={}, description="changes of this experiment: keys and their values")
    sigma: Positive | None = Field(
        default=None, description="standard error of the value, in its unit; default none: found from the misfit"
    )
    relative_sigma: Positive | None = Field(
        default=None, description="the same as a fraction of the value, no unit; default none", examples=[0.05]
    )
    use: Literal["fit", "predict"] = Field(default="fit", description="predict: held out of the search")


class Search(Table):
    """Search for the unknowns."""

    residual: Literal["log10", "relative", "absolute"] = Field(
        default="log10", description="residual to minimize: log10(computed/measured), or the difference"
    )
    budget: Whole = Field(default=1000, ge=1, le=10_000_000, description="most sets of values tried")
    seed: Whole = Field(default=0, ge=0, description="of everything random")
    starts: Whole | None = Field(
        default=None,
        ge=1,
        le=10_000,
        description="places tried first, one of the file and others spread evenly; default 4 for each unknown and 4 "
        "more",
    )
    difference: Positive = Field(
        default=0.01, le=0.2, description="step of finite differences, as a fraction of the range of an unknown"
    )
    tolerance: Positive | None = Field(
        default=None,
        description="largest rms of the residuals, else exit status 5; default none asked for",
        examples=[0.06],
    )
    confidence: Number = Field(default=0.95, gt=0, lt=1, description="of the intervals, no unit")
    coexisting: Whole = Field(
        default=2, ge=0, le=100, description="random starts of each experiment at the end, to find other responses"
    )
    profile: Switch = Field(default=True, description="spend some evaluations on the profile of the misfit")


class Identification(Table):
    """A whole identification."""

    title: str = Field("", max_length=200, description="one line that says what is identified")
    case: str = Field(min_length=1, description="case file, relative to this file", examples=["li2013-2d.toml"])
    transient: NonNegative | None = Field(
        default=None, description="time before a response counts, s; default found in it"
    )
    set: dict[str, Any] = Field(default={}, description="changes to the case file: keys and their values")
    unknown: tuple[Unknown, ...] = Field(description="keys to be found")
    figure: tuple[Figure, ...] = Field(description="figures of a response")
    measurement: tuple[Measurement, ...] = Field(description="measured values")
    search: Search = Search()


def contradictions(tables: Mapping[str, Any]) -> list[Fault]:
    """Return the faults between the tables that are intact, arrays of tables as {number: entry}."""
    unknowns: Mapping[int, Unknown] = tables.get("unknown", {})
    figures: Mapping[int, Figure] = tables.get("figure", {})
    measurements: Mapping[int, Measurement] = tables.get("measurement", {})
    search = tables.get("search", Search())
    faults = [*_unknowns(unknowns), *_figures(figures)]
    faults += [
        *_measurements(measurements, figures, search),
        *_errors(measurements),
        *_settings(measurements, unknowns),
    ]
    fitted = [one for one in measurements.values() if one.use == "fit"]
    if measurements and not fitted:
        faults.append(Fault(("measurement",), 'use = "predict" everywhere', 'a measurement with use = "fit"'))
    return faults


def _unknowns(unknowns: Mapping[int, Unknown]) -> Iterator[Fault]:
    for number, one in unknowns.items():
        key = ("unknown", number)
        if not one.lower < one.upper:
            upper, lower = apart(one.upper, one.lower)
            hint = "exchange the two" if one.lower > one.upper else "leave the key at its value, without [[unknown]]"
            yield Fault((*key, "upper"), upper, f"more than lower = {lower}", hint)
        elif one.start is not None and not one.lower <= one.start <= one.upper:
            below = one.start < one.lower
            start, limit = apart(one.start, one.lower if below else one.upper)
            low, high = (limit, f"{one.upper:g}") if below else (f"{one.lower:g}", limit)
            yield Fault((*key, "start"), start, f"a value from {low} to {high}")
        if one.scale == "log" and one.lower <= 0.0:
            yield Fault((*key, "lower"), f"{one.lower:g}", "more than 0 on a logarithmic scale", 'scale = "linear"')
        twins = [other for other, entry in unknowns.items() if entry.key == one.key and other < number]
        if twins:
            yield Fault((*key, "key"), f"{one.key}, which is [[unknown]] number {twins[0] + 1} too", "every key once")


def _figures(figures: Mapping[int, Figure]) -> Iterator[Fault]:
    for number, one in figures.items():
        key = ("figure", number)
        twins = [other for other, entry in figures.items() if entry.name == one.name and other < number]
        if twins:
            yield Fault((*key, "name"), f'"{one.name}", the name of [[figure]] number {twins[0] + 1}', "another name")
        if not isinstance(one, MotionFigure):
            continue
        if one.statistic != "harmonic" and "order" in one.model_fields_set:
            yield Fault((*key, "order"), f'order with statistic = "{one.statistic}"', 'statistic = "harmonic"')
        if one.quantity != "acceleration" and one.frame == "absolute" and "frame" in one.model_fields_set:
            expected = f'"relative": the {one.quantity} is recorded relative to the support'
            yield Fault((*key, "frame"), '"absolute"', expected, "leave the key out")


def _measurements(
    measurements: Mapping[int, Measurement], figures: Mapping[int, Figure], search: Search
) -> Iterator[Fault]:
    names = {figure.name: figure for figure in figures.values()}
    seen: list[tuple[str, Any]] = []
    for number, one in measurements.items():
        key = ("measurement", number)
        if figures and one.figure not in names:
            close = near(one.figure, names)
            hint = f'did you mean "{close}"?' if close else f'add [[figure]] with name = "{one.figure}"'
            yield Fault((*key, "figure"), f'"{one.figure}"', f"the name of a [[figure]]: {either(names)}", hint)
        elif figures:
            yield from _value((*key, "value"), one, names[one.figure], search)
        if one.sigma is not None and one.relative_sigma is not None:
            yield Fault((*key, "relative_sigma"), "sigma and relative_sigma", "one of the two", "remove one",
                        ((*key, "sigma"),))  # fmt: skip
        if (one.figure, one.set) in seen:
            yield Fault((*key, "figure"), f'"{one.figure}" twice with the same set', "each figure of it once",
                        "give the mean of repeated measurements, and their scatter as sigma")  # fmt: skip
        seen.append((one.figure, one.set))


def _value(key: tuple[str | int, ...], one: Measurement, figure: Figure, search: Search) -> Iterator[Fault]:
    """A logarithm or a relative difference needs a value that is not 0, and of a sign that the figure can have."""
    if search.residual != "absolute" and one.value == 0.0:
        yield Fault(key, "0", f'a value that is not 0 with residual = "{search.residual}"', 'residual = "absolute"')
    signed = isinstance(figure, MotionFigure) and figure.statistic in ("maximum", "minimum")
    if one.value < 0.0 and not signed:
        kind = figure.statistic if isinstance(figure, MotionFigure) else figure.type
        yield Fault(key, f"{one.value:g}", f"not less than 0: a {kind} has no sign", "no minus sign")


def _errors(measurements: Mapping[int, Measurement]) -> Iterator[Fault]:
    fitted = {n: one for n, one in measurements.items() if one.use == "fit"}
    without = [n for n, one in fitted.items() if one.sigma is None and one.relative_sigma is None]
    if 0 < len(without) < len(fitted):
        words = f"no standard error, while {len(fitted) - len(without)} of {len(fitted)} measurements have one"
        expected = "sigma or relative_sigma for every measurement that is fitted, or for none"
        yield Fault(("measurement", without[0], "value"), words, expected)


def _settings(measurements: Mapping[int, Measurement], unknowns: Mapping[int, Unknown]) -> Iterator[Fault]:
    keys = {one.key: number for number, one in unknowns.items()}
    for number, one in measurements.items():
        for key in one.set:
            if key in keys:
                found = f"{key}, which is [[unknown]] number {keys[key] + 1}"
                yield Fault(("measurement", number, "set"), found, "a key that is known in the experiment",
                            "remove it here or there", (("unknown", keys[key], "key"),))  # fmt: skip
