"""Frames of a file: routes of [[structure]] and [[member]], their sections, points and supports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gapbeam.solver.scene.frame_route import FrameAxes, Station
from gapbeam.solver.scene.frame_structure import ANGLE, Member, frame, frame_axes, space_figures
from gapbeam.solver.scene.structure import Structure
from gapbeam.solver.scene.structure_files import PlacedPoint
from gapbeam.solver.scene_file.placed_bodies import PlacedBody
from gapbeam.solver.scene_file.structure_tables import (
    BodyTable,
    ClampedBody,
    ElementFrame,
    HeldBody,
    MemberTable,
    PinnedBody,
    PointTable,
)
from gapbeam.solver.system.operators import Array

NEAREST_PARTS = 400
"""Parts of the axes of a frame, about, between which its nearest places are looked for."""
Directed = dict[str, tuple[Station, Any]]


def _axes(table: BodyTable, model: ElementFrame, members: Sequence[MemberTable]) -> FrameAxes:
    routes = [(model.route, model.bend_radius), *((one.route, one.bend_radius) for one in members)]
    return frame_axes(routes, f"frame {table.name}")


def extent_of(table: BodyTable, model: ElementFrame, members: Sequence[MemberTable]) -> tuple[PlacedBody, float]:
    """Return the extent of a frame in space, places along all of its axes, and the length of its route, m.

    Raises:
        UserError: A route is none, or a member meets no other.
    """
    axes = _axes(table, model, members)
    stations = axes.stations((), axes.length / NEAREST_PARTS, ANGLE)
    lines = [np.array([route.at(float(s)) for s in some]) for route, some in zip(axes.routes, stations, strict=True)]
    places, along = np.vstack(lines), np.vstack([_sides(line) for line in lines])
    thick = [model.thickness, *(one.outer_sizes(model)[0] for one in members)]
    halves = tuple(0.5 * one for one, some in zip(thick, stations, strict=True) for _ in some)
    body = PlacedBody(tuple(map(str, range(len(places)))), places, half=max(halves), halves=halves, axes=along)
    return body, axes.routes[0].length


def _sides(line: Array) -> Array:
    """Return the directions of a line before and behind each of its places, (places, 2, 3)."""
    ways = np.diff(line, axis=0)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    return np.stack([ways[[0, *range(len(ways))]], ways[[*range(len(ways)), -1]]], axis=1)


def stations_of(points: Sequence[PointTable], nearest: Mapping[str, Any], extent: PlacedBody | None) -> Directed:
    """Return station and directions of each point, also of those that pairs at nearest places made."""
    given: Directed = {one.name: (one.nearest or float(one.at or 0.0), direction_of(one)) for one in points}
    for name, node in nearest.items():
        assert extent is not None
        given[name] = (tuple(map(float, extent.places[int(node["node"])])), node["direction"])
    return given


def direction_of(point: PointTable) -> Any:
    """Return the direction of a point, or its rotation as six numbers."""
    return point.direction if point.about is None else (0.0, 0.0, 0.0, *point.about)


def framed(
    table: BodyTable,
    model: ElementFrame,
    members: Sequence[MemberTable],
    points: Directed,
    held: Sequence[Any],
    driven: Mapping[str, Any],
    gauges: Sequence[str],
    elements: int,
) -> tuple[Structure, dict[str, PlacedPoint]]:
    """Return a frame, and where its points are.

    Args:
        table: Table of the structure.
        model: Model of the structure.
        members: Its branches.
        points: Station and directions by name.
        held: Joints of the structure.
        driven: Joints that loads move, by the name of their points.
        gauges: Points whose stress is recorded.
        elements: About so many along straight legs.

    Raises:
        UserError: The frame cannot be made.
    """
    axes, places = _axes(table, model, members), dict[str, PlacedPoint]()
    for name, (at, way) in points.items():
        ways = np.atleast_2d(np.asarray(way, dtype=float))
        on_axis = (not isinstance(at, float) or at <= axes.routes[0].length) and ways.shape[1] == 3
        place = axes.at(axes.nearest(np.asarray(at)) if np.shape(at) else axes.along(at, "point")) if on_axis else None
        size = np.linalg.norm(ways, axis=1)[:, None]
        places[f"{table.name}.{name}"] = PlacedPoint(
            place, ways / np.where(size > 0.0, size, 1.0)
        )  # 0 is refused below
    one = frame(
        model.route,
        space_figures(model.section, model.thickness, model.width or model.thickness, model.material.poisson_ratio),
        model.material,
        points,
        bends=model.bend_radius,
        flexibility=model.flexibility,
        clamped=[_where(joint) for joint in held if isinstance(joint, ClampedBody)],
        pinned=[_where(joint) for joint in held if isinstance(joint, PinnedBody)],
        held=[(_where(joint), joint.direction) for joint in held if isinstance(joint, HeldBody)],
        up=model.up,
        branches=[_branch(model, member) for member in members],
        elements=elements,
        added_mass=model.added_mass,
        tension=model.tension,
        name=table.name,
        driven={clamp: _where(joint) for clamp, joint in driven.items()},
        gauges=gauges,
        reactions={joint.name: _where(joint) for joint in held if joint.force},
    )
    return one, places


def _branch(model: ElementFrame, member: MemberTable) -> Member:
    """Return a branch; values that it leaves out are those of the frame."""
    material, (thickness, width) = member.material or model.material, member.outer_sizes(model)
    section = space_figures(member.section or model.section, thickness, width, material.poisson_ratio)
    up = model.up if member.up is None else member.up
    wet = model.added_mass if member.added_mass is None else member.added_mass
    return Member(
        member.route, section, material, member.bend_radius, member.flexibility, up, member.hinged, wet, member.tension
    )


def _where(joint: ClampedBody | PinnedBody | HeldBody) -> Station:
    return joint.at if joint.nearest is None and joint.at is not None else joint.nearest or ()
