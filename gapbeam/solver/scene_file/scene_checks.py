"""Contradictions between the tables of a file of several structures, found before anything is read or computed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

from gapbeam.solver.case.checks.run_checks import run_has_steps, step_follows_the_forcing
from gapbeam.solver.case.figure_table import figure_faults
from gapbeam.solver.loads.scene_load_choice import (
    LineLoad,
    OpenedPair,
    is_along_beam,
    opens,
    point_of,
    structure_of,
    support_of,
)
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import near
from gapbeam.solver.scene_file.feedback_tables import feedback_faults
from gapbeam.solver.scene_file.pair_tables import DiscRegion, PairContact, PairTable, faces_faults, nearest_faults
from gapbeam.solver.scene_file.structure_tables import (
    NODAL,
    BodyTable,
    ClampedBody,
    ElementBeam,
    ElementFrame,
    HeldBody,
    LumpedMass,
    MemberTable,
    MeshFile,
    ModesOfFile,
    PinnedBody,
    PointTable,
    RigidBar,
    SnubberJoint,
    SpringJoint,
    material_faults,
)

ROUND = ("round", "tube")
OF_MATRICES = ("node", "set", "nearest", "dof")
FILES = ("stiffness", "mass", "damping", "dofs", "nodes", "file")


def scene_faults(tables: Mapping[str, Any]) -> list[Fault]:
    """Return the contradictions in tables that are intact, arrays of tables as {number: entry}."""
    bodies: dict[int, BodyTable] = tables.get("structure", {})
    by_name = {one.name: one for one in bodies.values()}
    known = _points(by_name, tables.get("point", {}).values())
    faults = [*_names(tables), *_files(bodies), *_bodies(tables, bodies)]
    for number, point in tables.get("point", {}).items():
        faults += _point(("point", number), point, by_name)
    for number, member in tables.get("member", {}).items():
        faults += _member(("member", number), member, by_name)
    for number, joint in tables.get("joint", {}).items():
        faults += _joint(("joint", number), joint, by_name, known)
    for number, mass in tables.get("mass", {}).items():
        faults += _exists(("mass", number, "point"), mass.point, known, by_name)
    faults += _pairs(tables, known, by_name)
    faults += _loads(tables, known, by_name)
    faults += feedback_faults(
        tables, by_name, lambda key, place: _exists(key, place, known, by_name),
        lambda key, name: _known_structure(key, name, by_name),
    )  # fmt: skip
    time = tables.get("time")
    if time is not None:
        faults += [*run_has_steps(time), *step_follows_the_forcing(time, tables.get("load", {}))]
        faults += figure_faults(tables.get("figure", {}), {}, time.end)
    return faults


def _points(by_name: Mapping[str, BodyTable], points: Any) -> dict[str, set[str] | None]:
    """Return the names of the points of each structure; None: a file has them."""
    known: dict[str, set[str] | None] = {
        name: None if isinstance(one.model, ModesOfFile) else {"at"} if isinstance(one.model, LumpedMass) else set()
        for name, one in by_name.items()
    }
    for one in points:
        names = known.get(one.structure)
        if names is not None:
            names.add(one.name)
    return known


def _names(tables: Mapping[str, Any]) -> Iterator[Fault]:
    """Names are given once."""
    seen: dict[str, Key] = {}
    for array in ("structure", "pair", "load", "feedback", "joint", "figure"):
        for number, one in tables.get(array, {}).items():
            if array == "joint" and not isinstance(one, SnubberJoint):
                continue
            key = (array, number, "name")
            if one.name in seen:
                free = next(name for k in count(2) if (name := f"{one.name}-{k}") not in seen)
                yield Fault(key, f'"{one.name}", a second time', "different names of structures, pairs, loads, forces",
                            f'name = "{free}"', (seen[one.name],))  # fmt: skip
            seen.setdefault(one.name, key)
    forces = {number: one for number, one in tables.get("joint", {}).items() if getattr(one, "force", False)}
    for array, entries, expected in (
        ("point", tables.get("point", {}), "different points of a structure"),
        ("joint", forces, "a name of its own for each force"),
    ):
        own: set[tuple[str, str | None]] = set()
        for number, one in entries.items():
            structure = one.between[0].partition(".")[0] if isinstance(one, SpringJoint) else one.structure
            if one.name is not None and (structure, one.name) in own:
                yield Fault((array, number, "name"), f'"{one.name}", a second time', expected)
            own.add((structure, one.name))


def _files(bodies: Mapping[int, BodyTable]) -> Iterator[Fault]:
    for number, one in bodies.items():
        for key in FILES if isinstance(one.model, NODAL | ModesOfFile) else ():
            file = getattr(one.model, key, None)
            if file is not None and not Path(file).is_file():
                yield Fault(("structure", number, "model", key), f'"{file}", which is no file', "a file that is there")


def _bodies(tables: Mapping[str, Any], bodies: Mapping[int, BodyTable]) -> Iterator[Fault]:
    """Keys that fit the model of a structure."""
    for number, one in bodies.items():
        where, model = ("structure", number), one.model
        if isinstance(model, ElementBeam | RigidBar | ElementFrame):
            for fault in model.section.faults(model.thickness, model.width or model.thickness):
                here = (*where, "model")
                yield replace(fault, key=(*here, *fault.key[1:]), related=((*here, "thickness"), (*here, "width")))
        if one.reduce is not None and isinstance(model, RigidBar | LumpedMass | ModesOfFile):
            yield Fault((*where, "reduce"), f"a reduction of a model {model.type}",
                        "no reduction: it has no more motions than it needs", "leave reduce out")  # fmt: skip
        if one.damping and isinstance(model, RigidBar | LumpedMass | ModesOfFile):
            name = "ratio" if one.ratio else "two_phase"
            yield Fault((*where, name), f"{name} of a model {model.type}",
                        "damping in the file of modes, or in the keys of the model", f"leave {name} out")  # fmt: skip
        if one.damping >= 1.0 and one.two_phase is not None:
            yield Fault((*where, "two_phase", "ratio"), f"{one.damping:g} with ratio = {one.ratio:g}",
                        "a sum below 1", related=((*where, "ratio"),))  # fmt: skip
        if isinstance(model, ElementBeam) and model.motions == 2 and one.place is not None:
            yield Fault((*where, "place"), "a place of a beam with motions = 2", "one of them",
                        "motions = 1: a beam with a place bends in one plane")  # fmt: skip
        if isinstance(model, ElementBeam) and model.motions == 2 and model.section.type not in ROUND:
            yield Fault((*where, "model", "motions"), f"2 of a section {model.section.type}",
                        f"1, or a section {' or '.join(ROUND)}: others bend differently in each plane")  # fmt: skip
        if isinstance(model, MeshFile):
            yield from material_faults((*where, "model", "materials"), model)
        if one.frame is not None and not any(one.frame):
            yield Fault((*where, "frame"), "a direction of length 0", "three numbers that are not all 0")
        if one.frame is not None and not isinstance(model, NODAL):
            yield Fault((*where, "frame"), f"a direction for a model {model.type}",
                        "no direction: it has one already", "leave frame out")  # fmt: skip
        if one.place is not None and isinstance(model, ElementFrame):
            yield Fault((*where, "place"), "a place of a frame", "no place: its route is in space", "leave place out")
        if one.place is not None and isinstance(model, ModesOfFile):
            yield Fault((*where, "place"), "a place of a file of modes",
                        "no place: modes do not say in which directions points move", "leave place out")  # fmt: skip
        if one.velocity and getattr(model, "added_mass", 0.0):
            yield Fault((*where, "velocity"), f"{one.velocity} m/s of a structure that moves a fluid",
                        "no velocity at the start, or no added_mass")  # fmt: skip
        if one.velocity and isinstance(model, ModesOfFile):
            yield Fault((*where, "velocity"), f"{one.velocity} m/s of a file of modes",
                        "no velocity: modes do not say how the whole structure moves")  # fmt: skip
        if one.velocity and getattr(tables.get("start"), "state", "rest") == "seat":
            yield Fault((*where, "velocity"), f"{one.velocity} m/s of a structure that is seated",
                        'a structure at rest, or [start] state = "rest"', related=(("start", "state"),))  # fmt: skip


def _known_structure(key: Key, name: str, by_name: Mapping[str, BodyTable]) -> Iterator[Fault]:
    if name not in by_name:
        close = near(name, list(by_name))
        yield Fault(key, f'"{name}", which is no structure', f"one of {', '.join(by_name) or 'none'}",
                    f'did you mean "{close}"?' if close else "", lacks=("structure",))  # fmt: skip


def _exists(
    key: Key, place: str, known: Mapping[str, set[str] | None], by_name: Mapping[str, BodyTable]
) -> Iterator[Fault]:
    """A point exists, as far as files need not be read."""
    structure, dot, name = place.partition(".")
    every = [f"{one}.{point}" for one, points in known.items() for point in sorted(points or ())]
    if not dot:
        meant = next((one for one in every if one.endswith(f".{place}") or one.startswith(f"{place}.")), "")
        yield Fault(key, f'"{place}"', "structure.point", f'did you mean "{meant}"?' if meant else "")
        return
    unknown = list(_known_structure(key, structure, by_name))
    yield from unknown
    names = known.get(structure)
    if not unknown and names is not None and name not in names:
        close = near(place, every)
        hint = f'did you mean "{close}"?' if close else f'add [[point]] with structure = "{structure}"'
        yield Fault(key, f'"{place}", which is no point', f"one of {', '.join(every) or 'none'}", hint,
                    lacks=("point",))  # fmt: skip


def _stress(key: Key, point: PointTable, model: Any) -> Iterator[Fault]:
    """Stress is known in meshes and at the surface of beams and frames, at points that stay and have a direction."""
    if not isinstance(model, ElementBeam | ElementFrame | MeshFile):
        yield Fault(key, f"a stress of a model {model.type}", "a model beam, frame or mesh", "leave it out")
    elif point.about is not None or point.speed is not None:
        found = "a rotation" if point.about is not None else "a point that moves"
        yield Fault(key, f"a stress of {found}", "a point with a direction that stays", "add a point for the stress")


def _point(key: Key, point: PointTable, by_name: Mapping[str, BodyTable]) -> Iterator[Fault]:
    yield from _known_structure((*key, "structure"), point.structure, by_name)
    if point.structure not in by_name:
        return
    model = by_name[point.structure].model
    given = [one for one in OF_MATRICES if getattr(point, one) is not None]
    if point.speed is not None and not isinstance(model, ElementBeam | RigidBar | ElementFrame):
        yield Fault((*key, "speed"), f"a point that moves along a model {model.type}", "a model beam, rigid or frame",
                    "gapbeam.moving_point takes points of other models")  # fmt: skip
    elif point.speed == 0.0:
        yield Fault((*key, "speed"), "0 m/s", "a speed along the axis", "leave speed out where the point stays")
    if (point.at or 0.0) < 0.0 and not (point.speed or 0.0) > 0.0:
        yield Fault((*key, "at"), f"{point.at:g}", "a number not less than 0, m, of a point that does not come later",
                    "no minus sign, or a speed above 0")  # fmt: skip
    if point.about is not None and not isinstance(model, ElementFrame):
        yield Fault((*key, "about"), f"a rotation of a model {model.type}", "a model frame",
                    'dof = "12.5" is a rotation of matrices')  # fmt: skip
    if point.rotation and point.dof is None:
        yield Fault((*key, "rotation"), "a rotation without dof", "dof: the row of matrices that is a rotation",
                    "about = [0, 1, 0] is a rotation of a frame")  # fmt: skip
    if point.stress:
        yield from _stress((*key, "stress"), point, model)
    if isinstance(model, ModesOfFile | LumpedMass):
        has = "the columns of its file" if isinstance(model, ModesOfFile) else f'"{point.structure}.at"'
        yield Fault(key, f"a point of a model {model.type}", f"no point: its points are {has}", "leave it out")
    elif isinstance(model, ElementFrame):
        for one in given:
            if one != "nearest":
                yield Fault((*key, one), f"{one} of a frame", "at: length along its axis, m, or nearest")
        if (point.at is None) == (point.nearest is None):
            yield Fault(key, "two places" if given else "no place", "at: length along its axis, m, or nearest")
        elif point.speed is not None and point.at is None:
            yield Fault((*key, "nearest"), "nearest of a point that moves", "at: length along its axis, m")
        if (point.direction is None) == (point.about is None):
            found = "nothing: the key is missing" if point.about is None else "a direction and an axis of rotation"
            yield Fault((*key, "direction"), found, "the direction of the motion, or about: the axis of a rotation")
    elif isinstance(model, ElementBeam | RigidBar):
        placed = by_name[point.structure].place is not None
        for one in [*given, *(["direction"] if point.direction is not None else [])]:
            if one == "nearest" and placed and point.at is None:
                continue
            need = "at: x from its start, m" if placed or one != "nearest" else "at, or a place of the structure"
            yield Fault((*key, one), f"{one} of a model {model.type}", need)
        if point.at is None:
            if not given:
                yield Fault((*key, "at"), "nothing: the key is missing", "x from the start of the beam, m")
        elif point.at > model.length and not (point.speed or 0.0) < 0.0:
            yield Fault((*key, "at"), f"{point.at:g} m, beyond the end", f"0 to {model.length:g} m")
    else:
        if point.at is not None:
            yield Fault((*key, "at"), f"{point.at:g} m of a model {model.type}", f"one of {', '.join(OF_MATRICES)}")
        elif len(given) != 1:
            yield Fault(key, f"{' and '.join(given) or 'no place'}", f"one of {', '.join(OF_MATRICES)}")
        elif (given[0] == "dof") == (point.direction is not None):
            found = "a direction of a DOF" if given[0] == "dof" else "nothing: the key is missing"
            expected = "no direction" if given[0] == "dof" else "the direction of the motion, such as [0, 0, 1]"
            yield Fault((*key, "direction"), found, expected)


def _member(key: Key, member: MemberTable, by_name: Mapping[str, BodyTable]) -> Iterator[Fault]:
    yield from _known_structure((*key, "structure"), member.structure, by_name)
    if member.structure not in by_name:
        return
    model = by_name[member.structure].model
    if not isinstance(model, ElementFrame):
        yield Fault((*key, "structure"), f'"{member.structure}", a model {model.type}', "a frame",
                    'model = { type = "frame", route = ... }')  # fmt: skip
        return
    for fault in (member.section or model.section).faults(*member.outer_sizes(model)):
        yield replace(fault, key=(*key, *fault.key[1:]), related=((*key, "thickness"), (*key, "width")))


def _support_force(key: Key, joint: Any, table: BodyTable) -> Iterator[Fault]:
    if not isinstance(table.model, ElementFrame):
        yield Fault(key, f"the force of a joint of a model {table.model.type}", "a joint of a frame",
                    'a straight beam is a frame, too: model = { type = "frame", route = ... }')  # fmt: skip
    if joint.name is None:
        yield Fault(key, "a joint without a name", "a name of its own, under which its force is recorded",
                    'add name = "anchor"')  # fmt: skip


def _joint(
    key: Key, joint: Any, by_name: Mapping[str, BodyTable], known: Mapping[str, set[str] | None]
) -> Iterator[Fault]:
    if isinstance(joint, SpringJoint | SnubberJoint):
        for place in joint.between:
            yield from _exists((*key, "between"), place, known, by_name)
        if joint.stiffness == joint.damping == 0.0:
            yield Fault((*key, "stiffness"), "0 without damping: the joint does nothing", "a stiffness or a damping")
        if isinstance(joint, SnubberJoint):
            lock = joint.acceleration if joint.velocity is None else joint.velocity
            if lock is None or None not in (joint.velocity, joint.acceleration):
                found = "neither velocity nor acceleration" if lock is None else "velocity and acceleration"
                yield Fault(key, found, "one of them: what locks it")
            elif not joint.release < lock:
                yield Fault((*key, "release"), f"{joint.release:g}", f"less than {lock:g}, at which it locks")
        return
    yield from _known_structure((*key, "structure"), joint.structure, by_name)
    if joint.structure not in by_name:
        return
    model = by_name[joint.structure].model
    if joint.force:
        yield from _support_force((*key, "force"), joint, by_name[joint.structure])
    if isinstance(joint, HeldBody):
        if not isinstance(model, ElementFrame):
            yield Fault((*key, "type"), f"a held joint of a model {model.type}", "a frame",
                        'type = "clamped" or "pinned"')  # fmt: skip
            return
        if not any(joint.direction):
            yield Fault((*key, "direction"), "a direction of length 0", "three numbers that are not all 0")
    if isinstance(model, ElementFrame):
        if (joint.at is None) == (joint.nearest is None) or getattr(joint, "nodes", None) is not None:
            yield Fault(key, "no place, or several", "at: length along the axis of the frame, m, or nearest")
        return
    if joint.nearest is not None:
        yield Fault((*key, "nearest"), f"nearest of a model {model.type}", "at of a beam, or nodes")
    elif isinstance(model, ElementBeam):
        if isinstance(joint, ClampedBody) and joint.nodes is not None:
            yield Fault((*key, "nodes"), "nodes of a beam", "at: x from its start, m")
        elif joint.at is None:
            yield Fault((*key, "at"), "nothing: the key is missing", "x from the start of the beam, m")
        elif joint.at > model.length:
            yield Fault((*key, "at"), f"{joint.at:g} m, beyond the end", f"0 to {model.length:g} m")
    elif isinstance(model, NODAL) and isinstance(joint, ClampedBody):
        if joint.at is not None:
            yield Fault((*key, "at"), f"{joint.at:g} m of a model {model.type}", "nodes: a set, or a list")
        elif joint.nodes is None:
            yield Fault((*key, "nodes"), "nothing: the key is missing", "a set of nodes, or a list of nodes")
    else:
        kinds = "beam or frame" if isinstance(joint, PinnedBody) else "beam, frame, matrices or mesh"
        yield Fault((*key, "type"), f"a {joint.type} joint of a model {model.type}", f"a structure of {kinds}",
                    'type = "elastic" between its point and the frame')  # fmt: skip


def _pairs(
    tables: Mapping[str, Any], known: Mapping[str, set[str] | None], by_name: Mapping[str, BodyTable]
) -> Iterator[Fault]:
    default = tables.get("contact")
    if default is not None and default.formulation != "penalty":
        yield Fault(
            ("contact", "formulation"),
            f'"{default.formulation}" between structures'
            + (", whose points and matrices have no stress" if default.formulation == "nitsche" else ""),
            '"penalty"', 'exact contact is a law: law = { type = "unilateral", restitution = 1.0 }',
        )  # fmt: skip
    for number, pair in tables.get("pair", {}).items():
        key: Key = ("pair", number)
        if pair.at == "faces":
            models = {name: one.model for name, one in by_name.items()}
            yield from faces_faults(key, pair.over(default or PairContact()), models)
        elif pair.at is not None:
            yield from nearest_faults(key, pair, {name: _is_placed(one) for name, one in by_name.items()})
        elif pair.region is None:
            yield Fault((*key, "region"), "nothing: the key is missing", "a region, a table with the type and its keys",
                        'add region = { type = "slot", clearance = 1e-4 }')  # fmt: skip
        for place in pair.between if pair.at is None else ():
            yield from _exists((*key, "between"), place, known, by_name)
        if len(set(pair.between)) < len(pair.between):
            yield Fault((*key, "between"), f'"{pair.between[0]}" twice', "two different points")
        if pair.law is None and default is not None and default.law is None:
            yield Fault((*key, "law"), "nothing: neither the pair nor [contact] has a law", "a law of forces",
                        'add law = { type = "kelvin-voigt", stiffness = 1e7 }', (("contact", "law"),))  # fmt: skip


def _is_placed(body: BodyTable) -> bool:
    model = body.model
    if isinstance(model, NODAL):
        return isinstance(model, MeshFile) or model.nodes is not None
    return isinstance(model, ElementFrame) or body.place is not None


def _along(key: Key, load: LineLoad, body: BodyTable) -> Iterator[Fault]:
    """A load along a beam has one, without a place in space, and ends on it."""
    if not isinstance(body.model, ElementBeam | RigidBar):
        yield Fault((*key, "structure"), f'"{body.name}", a model {body.model.type}',
                    "a model beam or rigid, which has places along it", 'type = "random" acts at a point')  # fmt: skip
    elif body.place is not None:
        yield Fault((*key, "structure"), f'"{body.name}", which has a place in space', "a structure without place")
    elif not 0.0 <= load.span[0] < load.span[1] <= body.model.length:
        yield Fault((*key, "span"), f"{load.span[0]:g} to {load.span[1]:g} m",
                    f"a span on the beam, from 0 to {body.model.length:g} m")  # fmt: skip


def _opened(key: Key, load: OpenedPair, pairs: Iterable[PairTable]) -> Iterator[Fault]:
    """A change of a clearance has a pair, and closes a disc at most to its center."""
    regions = {one.name: one.region for one in pairs}
    region = regions.get(str(load.support))
    if load.support not in regions:
        known = ", ".join(regions) or "none"
        yield Fault((*key, "support"), f'"{load.support}"', f"a pair: one of {known}", lacks=("pair",))
    elif isinstance(region, DiscRegion) and -min(load.changes) > region.clearance:
        yield Fault((*key, "changes"), f"{min(load.changes):g} m of a disc", f"at least -clearance = "
                    f"{-region.clearance:g} m: it is a point there")  # fmt: skip


def _loads(
    tables: Mapping[str, Any], known: Mapping[str, set[str] | None], by_name: Mapping[str, BodyTable]
) -> Iterator[Fault]:
    loads, time = tables.get("load", {}), tables.get("time")
    joints = tables.get("joint", {}).values()
    held = [one.name for one in (*tables.get("pair", {}).values(), *joints)
            if len(getattr(one, "between", ())) == 1 and getattr(one, "at", None) is None]  # fmt: skip
    held += [one.name for one in joints if not hasattr(one, "between") and one.name]
    for number, load in loads.items():
        key: Key = ("load", number)
        where, name = point_of(load), structure_of(load)
        if where is not None:
            yield from _exists((*key, "point"), where, known, by_name)
        if (support := support_of(load)) is not None and support not in held:
            yield Fault((*key, "support"), f'"{support}"', f"a pair, snubber or elastic joint of one point, or "
                        f"a joint that holds a structure: one of {', '.join(held) or 'none'}",
                        "all supports alike: base_motion; one clamp alone: give its [[joint]] a name",
                        lacks=("pair", "joint"))  # fmt: skip
        if opens(load):
            yield from _opened(key, load, tables.get("pair", {}).values())
        if name is not None:
            yield from _known_structure((*key, "structure"), name, by_name)
        if is_along_beam(load) and name is not None and name in by_name:
            yield from _along(key, load, by_name[name])
        yield from load.faults_among(key, loads)
        own = list(load.faults(key))
        yield from own
        if not own and time is not None:
            yield from load.faults_in_run(key, time.end, None if time.step == "auto" else time.step)
