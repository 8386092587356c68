"""Scenes and results in a Python session: a table of structures, contacts, loads; shapes and ranges of arrays.

The classes import this module.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.feedback import parts_of

if TYPE_CHECKING:
    from gapbeam.solver.scene.contact_pair import Contact
    from gapbeam.solver.scene.scene_load import Load
    from gapbeam.solver.scene.structure import StructurePoint

HEADS = ("", "name", "at", "values")


def scene_words(scene: Any) -> str:
    """Return a scene in one line."""
    parts = ((scene.structures, "structure"), (scene.contacts, "contact"), (scene.loads, "load"))
    return f"<scene of {', '.join(counted(len(some), one) for some, one in parts)}, {counted(scene.size, 'DOF')}>"


def scene_html(scene: Any) -> str:
    """Return the table of a scene as HTML, with names of users escaped."""
    rows: list[tuple[str, ...]] = [
        ("structure", one.name, ", ".join(one.points), counted(one.size, "DOF")) for one in scene.structures
    ]
    rows += [("contact", *row) for row in _contacts(scene)]
    rows += [("load", one.name, one.structure.name, _of_load(one)) for one in scene.loads]
    rows += [
        (type(one).__name__.lower(), one.name, f"{_places(one.act)}, by {_places(one.sense)}", "")
        for one in scene.feedbacks
    ]
    lines = [_line("th", HEADS), *(_line("td", row) for row in rows)]
    return "\n".join(["<table>", f"<caption>{escape(scene_words(scene))}</caption>", *lines, "</table>"])


def _line(tag: str, cells: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in cells)}</tr>"


def _contacts(scene: Any) -> Iterator[tuple[str, str, str]]:
    """Yield a row for each contact; one for all contact points of a face, which have its name and a number."""
    groups: dict[tuple[Any, ...], list[tuple[str, Contact]]] = {}
    for name, one in zip(scene.contact_names, scene.contacts, strict=True):
        face = name.rstrip("0123456789") if one.name else name
        key = face, _place(one.points), one.region.kind, one.law.kind, one.is_moved
        groups.setdefault(key, []).append((name, one))
    for (_, at, *_), some in groups.items():
        first, last = some[0][0], some[-1][0]
        yield first if first == last else f"{first} to {last}", at, _of_contacts([one for _, one in some])


def _places(place: Any) -> str:
    return ", ".join(map(_place, parts_of(place)))


def _place(points: Sequence[StructurePoint]) -> str:
    """Return a point as `structure.point`, or both of a pair."""
    return " and ".join(f"{one.structure.name or '?'}.{one.name or '?'}" for one in points)


def _of_contacts(some: Sequence[Contact]) -> str:
    """Return the values of contacts of one kind by the names that `Scene.with_` takes."""
    region, law = some[0].region.kind, some[0].law.kind
    own = [key for key in ("friction", "sliding", "offset") if any(np.any(getattr(one, key)) for one in some)]
    found = [
        f"{region.name}: {_listed(region.names, [one.region.values for one in some])}",
        f"{law.name}: {_listed(law.names, [one.law.values for one in some])}",
        _listed(own, [[getattr(one, key) for key in own] for one in some]),
        "moving wall" if some[0].is_moved else "",
    ]
    return "; ".join(filter(None, found))


def _of_load(one: Load) -> str:
    """Return the value of a load with its unit, or its function with the parameters."""
    if isinstance(one.value, tuple):
        times = one.value[0]
        return f"table from {times[0]:.4g} to {times[-1]:.4g} s"
    if not callable(one.value):
        return f"{_number(one.value)} {one.unit}".rstrip()
    name = getattr(one.value, "__name__", "function of time")
    return ": ".join([name, *([_listed(one.parameters, [list(one.parameters.values())])] if one.parameters else [])])


def _listed(names: Iterable[str], values: Iterable[Sequence[Any]]) -> str:
    """Return names with their numbers, or with the ranges of these over contacts and members of an ensemble."""
    ranges = zip(names, zip(*values, strict=True), strict=True)
    return ", ".join(f"{name} {_number(np.concatenate([np.ravel(one) for one in many]))}" for name, many in ranges)


def _number(value: Any) -> str:
    if np.asarray(value).dtype.kind not in "biuf":
        return "given"
    low, high = float(np.min(value)), float(np.max(value))
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"


FEW = 4
"""Numbers or names up to which all are shown."""


def result_words(result: Any) -> str:
    """Return a dataclass with a line for each attribute; arrays of many numbers as their shape and range."""
    lines = [f"{one.name}: {_words(getattr(result, one.name))}" for one in fields(result)]
    return "\n  ".join([f"<{type(result).__name__}", *lines]) + ">"


def called(one: Any) -> str:
    """Return a law or a region as it is made: its kind with its values by name."""
    pairs = zip(getattr(one.kind, "given", one.kind.names), one.values, strict=False)
    named = ", ".join(f"{name}={_words(value)}" for name, value in pairs)
    return f"{one.kind.name}({named or _words(one.values)})"


def load_words(one: Any) -> str:
    """Return a load in one line: its kind, name and structure, and its value."""
    return f"<{type(one).__name__} {one.name or '?'} on {one.structure.name or '?'}: {_of_load(one)}>"


def _words(value: Any) -> str:
    if isinstance(value, Mapping):
        parts = [f"{key} {_words(one)}" for key, one in list(value.items())[:FEW]]
        more = [f"... {len(value)} in all"] if len(value) > FEW else []
        return ", ".join([*parts, *more]) or "none"
    if is_dataclass(value) or (isinstance(value, (list, tuple)) and any(map(is_dataclass, value))):
        return type(value).__name__ if is_dataclass(value) else f"{len(value)} of {type(value[0]).__name__}"
    array = np.asarray(value)
    if array.dtype.kind not in "biufc":
        return repr(value)
    shape = str(array.shape).replace(",)", ")")
    if array.size <= FEW:
        numbers = ", ".join(str(one) if array.dtype.kind == "b" else f"{one:.6g}" for one in array.ravel())
        return f"{shape} {numbers}".rstrip() if array.ndim else numbers
    if array.dtype.kind == "b":
        return f"{shape} {int(array.sum())} of {array.size} true"
    known = array[np.isfinite(array)]
    sizes, of = (np.abs(known), "absolute ") if array.dtype.kind == "c" else (known, "")
    span = f" {of}{sizes.min():.6g} to {sizes.max():.6g}" if known.size else ""
    lost = f", {array.size - known.size} not finite" if known.size < array.size else ""
    return f"{shape}{span}{lost}"
