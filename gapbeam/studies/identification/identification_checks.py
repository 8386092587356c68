"""Contradictions between the tables of an identification."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gapbeam.solver.faults import Fault
from gapbeam.solver.wording.compared_numbers import apart
from gapbeam.solver.wording.near_names import near
from gapbeam.solver.wording.short_words import either
from gapbeam.studies.identification.identification_tables import Figure, Measurement, MotionFigure, Search, Unknown


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
