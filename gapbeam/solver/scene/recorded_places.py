"""Recorded places of a scene by kind: those that impulses strike, and those that turn."""

from __future__ import annotations

from gapbeam.solver.scene.scene import Scene


def struck_places(scene: Scene) -> tuple[str, ...]:
    """Return the contacts of impulses, and the recorded points of their structures, whose velocities jump."""
    hard = [(one, name) for one, name in zip(scene.contacts, scene.contact_names, strict=True) if one.is_impulsive]
    bodies = {scene.place_of(point.structure, name) for one, name in hard for point in one.points}
    points = [name for name, one in scene.point_names.items() if scene.place_of(one.structure, name) in bodies]
    probes = [one for one in scene.probe_names if one in points or one.rpartition(" ")[0] in points]
    return (*(name for _, name in hard), *probes)


def turning_places(scene: Scene) -> tuple[str, ...]:
    """Return recorded points that are rotations, rad, and contacts between them, whose forces are moments, N m."""
    points = [name for name, one in scene.point_names.items() if one.turns]
    probes = [one for one in scene.probe_names if one in points or one.rpartition(" ")[0] in points]
    pairs = zip(scene.contact_names, scene.contacts, strict=True)
    return (*probes, *(name for name, one in pairs if one.points[0].turns))
