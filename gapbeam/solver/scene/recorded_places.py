"""Recorded places of a scene by kind, those that impulses strike and those that turn, and units of its values."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import fnmatchcase
from math import log2

import numpy as np

from gapbeam.solver.case.figure_table import NUMBERS, Figure, parts_of
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.reaction_rows import ReactionRows
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import Load
from gapbeam.solver.scene.structure_geometry import ALONG
from gapbeam.solver.scene.surface_stress import TENSOR
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.system.operators import Array

OF_CONTACTS = {"clearance": "m", "center": "m", "offset": "m"}
_SPRING = {"stiffness": "N/m", "damping": "N s/m"}
OF_LAWS = {
    "KelvinVoigt": _SPRING, "ElastoGap": _SPRING, "Cubic": {"stiffness": "N/m", "scale": "m"},
    "HuntCrossley": {"stiffness": "N/m", "chi": "s/m"}, "Adhesive": {"stiffness": "N/m", "pull": "N", "reach": "m"},
}  # fmt: skip
OF_LOADS = {"frequency": "Hz", "phase": "degrees", "ramp": "s"}
OF_FLOWS = {"velocity": "m/s", "density": "kg/m^3"}


def struck_places(scene: Scene, supports: ReactionRows) -> tuple[str, ...]:
    """Return the contacts of impulses, and recorded points and supports of their structures, whose velocities jump."""
    hard = [(one, name) for one, name in zip(scene.contacts, scene.contact_names, strict=True) if one.is_impulsive]
    bodies = {scene.place_of(point.structure, name) for one, name in hard for point in one.points}
    points = [name for name, one in scene.point_names.items() if scene.place_of(one.structure, name) in bodies]
    probes = [one for one in scene.probe_names if one in points or one.rpartition(" ")[0] in points]
    held = zip(supports.names, supports.owners, strict=True)
    whole = [one for one in whole_pairs(scene) if parts_of(one, [name for _, name in hard])]
    return (
        *whole,
        *(name for _, name in hard),
        *probes,
        *(name for name, one in held if scene.place_of(one, name) in bodies),
    )


def whole_pairs(scene: Scene) -> tuple[str, ...]:
    """Return the names of pairs of several contacts, "seat" of "seat-0" and "seat-1", that have forces."""
    turning = turning_places(scene)
    names = {name: match[1] for name in scene.contact_names if (match := re.fullmatch(r"(.+)-\d+", name))}
    turned = {whole for name, whole in names.items() if name in turning}
    return tuple(dict.fromkeys(one for one in names.values() if one not in scene.contact_names and one not in turned))


def turning_places(scene: Scene) -> tuple[str, ...]:
    """Return recorded points that are rotations, rad, and contacts between them, whose forces are moments, N m."""
    points = [name for name, one in scene.point_names.items() if one.turns]
    probes = [one for one in scene.probe_names if one in points or one.rpartition(" ")[0] in points]
    pairs = zip(scene.contact_names, scene.contacts, strict=True)
    return (*probes, *(name for name, one in pairs if one.points[0].turns))


def gauges_of(scene: Scene) -> dict[str, Array]:
    """Return the rows of the stress, (6, n), Pa, of each motion of the points with gauges."""
    found = dict[str, Array]()
    for name, point in scene.point_names.items():
        rows = point.structure.gauges.get(point.name, np.zeros((0, point.structure.size)))
        for number, own in enumerate(np.split(rows, len(rows) // TENSOR or 1), 1):
            if len(own):
                found[f"{name} {number}" if len(rows) > TENSOR else name] = scene.rows_of(point.structure, own)
    return found


def components_of(scene: Scene) -> tuple[str, ...]:
    """Return the names of the components of motions in records: y, or y and z."""
    return ("y", "z")[: scene.probe_width] if scene.probe_names else ()


def places_of_figures(scene: Scene) -> dict[str, tuple[str, ...]]:
    """Return the places that figures of one's own may have, by kind; impulses strike those of "struck"."""
    supports = ReactionRows(scene)
    return {"joint": supports.names, "translation": supports.axes, "turn": supports.axes,
            "probe": scene.probe_names, "face": scene.contact_names, "support": whole_pairs(scene), "turned_probe": (),
            "gauge": tuple(gauges_of(scene)), "component": components_of(scene),
            "struck": struck_places(scene, supports),
            **{f"component of {name}": _components_at(scene, name) for name in scene.probe_names}}  # fmt: skip


def _components_at(scene: Scene, probe: str) -> tuple[str, ...]:
    """Return the components that figures of a point may name: y and z in space only where these are its motions."""
    names, (name, _, number) = components_of(scene), probe.rpartition(" ")
    point, first = (scene.point_names[probe], 0) if probe in scene.point_names else (
        scene.point_names[name], int(number) - 1
    )  # fmt: skip
    ways = point.directions
    along = [ways is None or ways[first + k]["xyz".index(one)] > 1.0 - ALONG for k, one in enumerate(names)]
    return (*(one for one, same in zip(names, along, strict=True) if same), *NUMBERS[: len(names)])


def as_recorded(scene: Scene, figures: Iterable[Figure]) -> tuple[Figure, ...]:
    """Return figures whose places "structure.point" have the names that records give them."""
    numbered = {
        f"{one.structure.name}.{one.name} {number}": f"{short} {number}"
        for short, one in scene.point_names.items()
        for number in range(1, len(one.rows) + 1)
    }
    return tuple(
        one.model_copy(update={"place": numbered.get(one.place, scene.short_name(one.place))}) if one.place else one
        for one in figures
    )


def units_of_values(scene: Scene, paths: Iterable[str]) -> dict[str, str]:
    """Return the SI units of values of a scene by path, as of `Scene.with_`; "": none, or none that is known."""
    return {path: _unit_of_value(scene, path) for path in paths}


def _unit_of_value(scene: Scene, path: str) -> str:
    name, _, key = path.partition(".")
    owners = [one for group in (scene.contacts, scene.loads, scene.feedbacks) for one in group]
    found = {_unit_at(one, key) for one in owners if one.name and fnmatchcase(one.name, name)}
    return found.pop() if len(found) == 1 else ""


def _unit_at(owner: object, key: str) -> str:
    if isinstance(owner, Load):
        own = owner.unit.replace("s2", "s^2")
        return own if key in ("value", "amplitude", "mean") else OF_LOADS.get(key, "")
    if not isinstance(owner, Contact):
        return OF_FLOWS.get(key, "")
    kind, turns = owner.law.kind, owner.points[0].turns
    unit = OF_CONTACTS.get(key.rstrip("0123456789")) or OF_LAWS.get(kind.name, {}).get(key, "")
    if (kind.name, key) == ("HuntCrossley", "stiffness"):
        double, single = (kind.potential.py_func(x, 1.0, 0.0) for x in (2.0, 1.0))
        exponent = log2(double / single) - 1.0
        return "N/m" if exponent == 1.0 else f"N/m^{exponent:.6g}"
    return unit_where(unit, turns)
