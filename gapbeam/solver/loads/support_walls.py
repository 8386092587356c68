"""Loads of a semi-discrete system, and walls of a contact operator, from the loads of a case and their patterns.

    f(t) = sum_k s_k(t) f_k

A pattern f_k follows from place and direction of a load alone; s_k is its function of time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gapbeam.solver.loads.load_choice import Load as CaseLoad
from gapbeam.solver.loads.load_choice import load_direction
from gapbeam.solver.loads.places import LoadPart, SupportAcceleration, SupportWalls, patterned
from gapbeam.solver.loads.time_function import constant
from gapbeam.solver.supports.layout import Layout, within
from gapbeam.solver.supports.regions.region import Placement
from gapbeam.solver.supports.support_tables import OneSupport
from gapbeam.solver.system.operators import NO_WALLS, Array, Load, WallMotion, Walls
from gapbeam.solver.system.semi_discrete import ContactOperator


def moved_by(place: SupportWalls, layout: Layout) -> OneSupport | None:
    """Return the support whose walls move; None where there is none of that name, or no name and several supports."""
    if place.support is None:
        return layout.supports[0] if len(layout.supports) == 1 else None
    return next((one for one in layout.supports if one.name == place.support), None)


def walls_of(loads: Sequence[CaseLoad], layout: Layout, contact: ContactOperator, dimension: int) -> Walls:
    """Return the motions of walls.

    Args:
        loads: Loads of a case.
        layout: Its supports.
        contact: Operator at their contact points.
        dimension: 2 or 3.

    Raises:
        ValueError: A load moves a support that is not there.
    """
    motions, growths = list[WallMotion](), list[Array]()
    for number, load in enumerate(loads):
        if not isinstance(load.place, SupportWalls):
            continue
        s, support = load.time_function(), moved_by(load.place, layout)
        if support is None or s.rate is None:
            raise ValueError(f"the load {load.name} moves no support, or has no rate")
        motions.append(WallMotion(number, s.value, s.rate))
        growths.append(_growth(support, _unit(load, dimension), contact))
    return Walls(tuple(motions), np.array(growths)) if motions else NO_WALLS


def hole_shifts(loads: Sequence[CaseLoad], layout: Layout, contact: ContactOperator, dimension: int) -> Array:
    """Return the shifts of y, z and clearance of the hole of each station by a unit of each motion, (k, stations, 3).

    Args:
        loads: As in `walls_of`, in whose order the motions are.
        layout: The supports.
        contact: Operator with stations in round holes.
        dimension: 2 or 3.
    """
    faces, found = contact.faces[contact.circles.points], list[Array]()
    for load in loads:
        if isinstance(load.place, SupportWalls) and (support := moved_by(load.place, layout)) is not None:
            unit = _unit(load, dimension)
            moved = [contact.face_names.index(face.name) for face in support.faces]
            shift = np.array([unit.lateral, unit.offset, unit.clearance])
            found.append(np.where(np.isin(faces, moved)[:, None], shift, 0.0))
    return np.array(found).reshape(-1, len(faces), 3)


def interference(loads: Sequence[CaseLoad], layout: Layout) -> float:
    """Return the largest interference of supports at any time, at least 0, m."""
    least = {one.name: one.clearance for one in layout.supports}
    for load in loads:
        if isinstance(load.place, SupportWalls) and (support := moved_by(load.place, layout)) is not None:
            least[support.name] += load.travel[0]
    return max(0.0, *(-clearance for clearance in least.values()))


def shifts_at(loads: Sequence[CaseLoad], layout: Layout, places: Array, dimension: int) -> Array:
    """Return by how much a unit of each motion of walls moves the support at places along the beam, (k, places, d).

    Args:
        loads: As in `walls_of`, in whose order the motions are.
        layout: The supports.
        places: x, (places,), m.
        dimension: d.
    """
    found = list[Array]()
    for load in loads:
        if isinstance(load.place, SupportWalls) and (support := moved_by(load.place, layout)) is not None:
            here = within(places, support) & (not load.place.opens)
            found.append(np.where(here[:, None], load_direction(load, dimension), 0.0))
    return np.array(found)


def face_motions(loads: Sequence[CaseLoad], layout: Layout, dimension: int) -> dict[str, dict[str, tuple[float, ...]]]:
    """Return by how much a unit of each motion changes gap, offset and lateral of the faces that it moves.

    Args:
        loads: Loads of a case.
        layout: Its supports.
        dimension: 2 or 3.

    Returns:
        The changes by the name of the load, by the name of the face.
    """
    found = dict[str, dict[str, tuple[float, ...]]]()
    for load in loads:
        if isinstance(load.place, SupportWalls) and (support := moved_by(load.place, layout)) is not None:
            unit, none = (support.faces_at(placed) for placed in (_unit(load, dimension), Placement(0.0)))
            for new, old in zip(unit, none, strict=True):
                shapes = [(new.shape.get(key, 0.0), old.shape.get(key, 0.0)) for key in ("offset", "lateral")]
                changes = (new.gap - old.gap, *(one - other for one, other in shapes))
                found.setdefault(new.name, {})[load.name] = changes
    return found


def _unit(load: CaseLoad, dimension: int) -> Placement:
    """Return the shift of a support by a unit of a motion of walls."""
    if isinstance(load.place, SupportWalls) and load.place.opens:
        return Placement(1.0)
    along = load_direction(load, dimension)
    return Placement(0.0, float(along[-1]), float(along[1]) if dimension == 3 else 0.0)


def _growth(support: OneSupport, unit: Placement, contact: ContactOperator) -> Array:
    """Return the growth of gaps by a unit of a support's motion, (m,)."""
    found = np.zeros(contact.size)
    for new, old in zip(support.faces_at(unit), support.faces_at(Placement(0.0)), strict=True):
        here = contact.faces == contact.face_names.index(new.name)
        found[here] = new.growth(old, contact.positions[here])
    return found


def make_loads(loads: Sequence[CaseLoad], patterns: Sequence[Array], dimension: int) -> tuple[Load, ...]:
    """Return the loads of a system, and after them the static forces that loads add, such as preloads.

    Args:
        loads: Loads of a case.
        patterns: Forces of each part of `load_parts.patterned` per unit factor, (n,), N.
        dimension: 2 or 3.
    """
    parts = patterned(loads)
    made = [_make(load, part, pattern, dimension) for (load, part), pattern in zip(parts, patterns, strict=True)]
    for load, pattern in zip(loads, patterns, strict=False):
        if (added := load.static_force) is not None:
            made.append(Load(added.name, pattern, constant(added.force).value, static=True, of_arrays=True))
    return tuple(made)


def _make(load: CaseLoad, part: LoadPart, pattern: Array, dimension: int) -> Load:
    """Return a part of a load; of moving supports with the motion of their frame, of one support without force."""
    s = constant(0.0) if isinstance(part.place, SupportWalls) else part.time_function()
    if not isinstance(part.place, SupportAcceleration):
        return Load(
            part.name, pattern, s.value, static=load.static, mean=s.mean if s.jumps else None, of_arrays=True,
            signal=s.signal, unit=part.place.unit,
        )  # fmt: skip
    return Load(
        part.name,
        pattern,
        s.value,
        static=load.static,
        frame_direction=np.pad(-load_direction(load, dimension), (0, 3 - dimension)),
        mean=s.mean,
        of_arrays=True,
        signal=s.signal,
        unit=part.place.unit,
    )
