"""Table of a scene for notebooks: structures, contacts, loads; the class of scenes imports this module."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.feedback import parts_of
from gapbeam.solver.scene.printed_values import listed, value_of_load

if TYPE_CHECKING:
    from gapbeam.solver.scene.contact_pair import Contact
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
    rows += [("load", one.name, one.structure.name, value_of_load(one)) for one in scene.loads]
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
        f"{region.name}: {listed(region.names, [one.region.values for one in some])}",
        f"{law.name}: {listed(law.names, [one.law.values for one in some])}",
        listed(own, [[getattr(one, key) for key in own] for one in some]),
        "moving wall" if some[0].is_moved else "",
    ]
    return "; ".join(filter(None, found))
