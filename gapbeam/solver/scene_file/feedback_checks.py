"""Contradictions in [[feedback]], found before anything is read or computed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene_file.feedback_tables import (
    AnyFeedback,
    ConnorsCheck,
    Controller,
    LaggedForces,
    MeasuredFlow,
    QuasiSteadyFlow,
    UnsteadyFlow,
)
from gapbeam.solver.scene_file.structure_tables import BodyTable, ElementBeam, LumpedMass, RigidBar

Exists = Callable[[Key, str], Iterable[Fault]]
PROFILES = ("velocity", "density")


def feedback_faults(
    tables: Mapping[str, Any], by_name: Mapping[str, BodyTable], point: Exists, structure: Exists
) -> Iterator[Fault]:
    """Yield the contradictions in [[feedback]].

    Args:
        tables: Those that are intact, arrays of tables as {number: entry}.
        by_name: The structures.
        point: Yields a fault where a point does not exist.
        structure: Yields a fault where a structure does not exist.
    """
    time = tables.get("time")
    for number, one in tables.get("feedback", {}).items():
        key: Key = ("feedback", number)
        for name in ("point", "points", "sense", "act"):
            given = getattr(one, name, None)
            for place in (given,) if isinstance(given, str) else given or ():
                yield from point((*key, name), place)
        if isinstance(one, MeasuredFlow) and not Path(one.file).is_file():
            yield Fault((*key, "file"), f'"{one.file}", which is no file', "a file that is there")
        yield from _rows(key, one)
        if isinstance(one, QuasiSteadyFlow | UnsteadyFlow | MeasuredFlow) and (one.span is None) == (one.point is None):
            found = "neither" if one.span is None else "both"
            yield Fault((*key, "span"), f"{found} of span and point", "one of them: where the flow acts",
                        'span = { structure = "tube" }', ((*key, "point"),))  # fmt: skip
        span = getattr(one, "span", None)
        unknown = [] if span is None else list(structure((*key, "span", "structure"), span.structure))
        yield from unknown
        slowest = 1.0
        if span is not None and not unknown and span.structure in by_name:
            faults = list(_span((*key, "span"), span, by_name[span.structure], point))
            yield from faults
            if isinstance(one, ConnorsCheck) and one.decrement is None and not by_name[span.structure].damping:
                yield Fault((*key, "decrement"), f'nothing, and no damping ratio of "{span.structure}"',
                            "a decrement, or a structure with ratio or two_phase")  # fmt: skip
            slowest = min((row[1] for row in span.velocity or ()), default=1.0) if not faults else 1.0
        if isinstance(one, QuasiSteadyFlow) and time is not None:
            lag = one.delay * one.diameter / (one.velocity * slowest)
            if lag > time.end:
                yield Fault((*key, "delay"), f"a delay of {lag:.4g} s, longer than the run of {time.end:g} s",
                            "a delay within the run: its force would never begin", "a larger time.end",
                            (("time", "end"),))  # fmt: skip


def _rows(key: Key, one: AnyFeedback) -> Iterator[Fault]:
    """Rows of one matrix have one length."""
    matrices: dict[tuple[str | int, ...], Any] = {}
    if isinstance(one, LaggedForces):
        matrices = {("steady",): one.steady, ("damping",): one.damping}
        matrices |= {("matrices",): [row for matrix in one.matrices for row in matrix]}
    elif isinstance(one, Controller):
        matrices = {(name,): getattr(one, name) for name in ("A", "B", "C", "D")}
    for name, rows in matrices.items():
        lengths = sorted({len(row) for row in rows})
        if len(lengths) > 1:
            yield Fault((*key, *name), f"rows of {' and '.join(map(str, lengths))} numbers", "rows of one length")


def _span(key: Key, span: Any, body: BodyTable, point: Exists) -> Iterator[Fault]:
    """Yield the faults of a span of a structure that exists."""
    model, ends = body.model, (vars(span)["from"], vars(span)["to"])
    if isinstance(model, LumpedMass):
        yield Fault((*key, "structure"), f'"{body.name}", a mass', "a structure with a length",
                    f'point = "{body.name}.at"')  # fmt: skip
        return
    if body.place is not None:
        yield Fault((*key, "structure"), f'"{body.name}", which has a place in space', "a structure without place",
                    "leave its place out; motions = 2 lets a beam bend along and across the flow")  # fmt: skip
        return
    if isinstance(model, ElementBeam | RigidBar):
        for name in ("points", "at"):
            if getattr(span, name) is not None:
                yield Fault((*key, name), f"{name} of a model {model.type}", "from and to: places along it, m")
                return
        low, high = ends[0] or 0.0, ends[1] or model.length
        if high > model.length:
            yield Fault((*key, "to"), f"{high:g} m, beyond the end", f"at most {model.length:g} m")
            return
        if not low < high:
            yield Fault((*key, "from"), f"{low:g} m, not before the end of the span", f"less than {high:g} m")
            return
    else:
        for name, value in (("points", span.points), ("at", span.at)):
            if value is None:
                yield Fault((*key, name), "nothing: the key is missing",
                            f"points of a model {model.type} along the tube, and `at`, their places, m")  # fmt: skip
                return
        for name in span.points:
            yield from point((*key, "points"), f"{body.name}.{name}")
        for name, value in zip(("from", "to"), ends, strict=True):
            if value is not None:
                yield Fault((*key, name), f"{value:g} m of a model {model.type}", "points and at", f"leave {name} out")
        if len(span.at) != len(span.points) or not all(a < b for a, b in pairwise(span.at)):
            yield Fault((*key, "at"), f"{counted(len(span.at), 'place')} for {counted(len(span.points), 'point')}",
                        "a place for each point, one after the other along the tube")  # fmt: skip
            return
        low, high = span.at[0], span.at[-1]
    for name in PROFILES:
        rows = getattr(span, name)
        if rows is None:
            continue
        places = [row[0] for row in rows]
        if not all(a < b for a, b in pairwise(places)):
            yield Fault((*key, name), "places that do not increase", "rows one after the other along the tube")
        elif places[0] > low or places[-1] < high:
            yield Fault((*key, name), f"a profile from {places[0]:g} to {places[-1]:g} m",
                        f"one that covers the span, {low:g} to {high:g} m")  # fmt: skip
        elif not all(row[1] > 0.0 for row in rows):
            yield Fault((*key, name), f"a share of {min(row[1] for row in rows):g}", "shares above 0",
                        "end the span where the flow ends")  # fmt: skip
