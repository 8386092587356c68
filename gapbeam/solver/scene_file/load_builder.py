"""Loads of a file of several structures: forces, gravity, and motions of what their pairs and joints stand on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gapbeam.solver.loads.scene_load_choice import (
    AnyLoad,
    LineLoad,
    is_along_beam,
    opens,
    point_of,
    structure_of,
    support_of,
)
from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.moving_point import MovingPoint, moving_force
from gapbeam.solver.scene.scene_load import (
    BaseMotion,
    ClampMotion,
    Force,
    Load,
    sine,
    sine_of,
    weight,
)
from gapbeam.solver.scene.structure import Structure, StructurePoint
from gapbeam.solver.scene.support_force import HELD
from gapbeam.solver.scene_file.contact_builder import Site
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.structure_tables import (
    ClampedBody,
    HeldBody,
    LumpedMass,
    ModesOfFile,
    PinnedBody,
    SnubberJoint,
    SpringJoint,
)
from gapbeam.solver.system.operators import Array

Between = SnubberJoint | SpringJoint


@dataclass(frozen=True)
class LoadSignal:
    """The function of time of a load, for arrays of any shape.

    Attributes:
        value: s at each of an array of times; steps take it in their middle.
    """

    value: Callable[[Any], Any]

    def __call__(self, times: Any, scale: Any = 1.0) -> Array:
        """Return the values at these times, times a parameter of the load."""
        flat = np.ravel(times)
        found = np.array(np.broadcast_to(self.value(flat), flat.shape), dtype=float).reshape(np.shape(times))
        return np.asarray(scale * found)


@dataclass(frozen=True)
class JumpSignal(LoadSignal):
    """The function of time of a load that jumps.

    Attributes:
        mean: Mean of s over intervals, from starts to ends, which steps take.
    """

    mean: Callable[[Array, Array], Any]

    def mean_over(self, starts: Array, ends: Array, scale: Any = 1.0) -> Any:
        """Return the means over intervals, (intervals, 1), times a parameter of the load."""
        return scale * self.mean(starts.ravel(), ends.ravel())[:, None]


def signal_of(s: TimeFunction) -> LoadSignal:
    """Return the function of time of a load."""
    return JumpSignal(s.value, s.mean) if s.jumps else LoadSignal(s.value)


def valued(load: AnyLoad) -> tuple[Callable[..., Any], dict[str, Any]]:
    """Return the value of a load and its parameters, which members of an ensemble may differ in."""
    signal = signal_of(load.time_function())
    own = {"mean": float(signal(0.0))} if load.static else sine_of(signal.value)
    return (signal, {"scale": 1.0}) if own is None else (sine, own | {"scale": 1.0})


def loads_of(site: Site, number: int, load: AnyLoad) -> list[Load]:
    """Return the forces of a load; none, with faults, where it fits no place, and where it moves a support."""
    key: Key = ("load", number)
    name, place = str(vars(load)["name"]), point_of(load)
    wanted = structure_of(load)
    if is_along_beam(load):
        body = site.bodies.get(wanted or "")
        return [] if body is None else _along_beam(site, number, load, body)
    if support_of(load) is not None or opens(load):
        clamps = {clamp: one for clamp, one in driven_joints(site.case).items() if one.name == support_of(load)}
        parts = [part for clamp, joint in clamps.items() for part in _at_clamp(site, number, load, clamp, joint)]
        for k, part in enumerate(parts, start=1):
            part.name = f"{name}-{k}"
        return parts
    value, own = valued(load)
    if place is not None:
        point = site.point((*key, "point"), place, may_move=not load.noise)
        unit = None if point is None else _in_motions(site, number, load, point)
        if isinstance(point, MovingPoint) and unit is not None:
            way = point.track
            return [
                *moving_force(way.points, list(way.places), signal_of(load.time_function()), way.position, name, unit)
            ]
        return [] if point is None or unit is None else [Force(point, value, unit, name, **own)]
    bodies = {one: body for one, body in site.bodies.items() if wanted in (None, one)}
    bare = [one for one, body in bodies.items() if body.inertia is None]
    if bare:
        site.faults.append(
            Fault((*key, "structure"), f"{', '.join(bare)}, of which no motion with the frame is known",
                  "structures with a direction: `frame` of matrices or a mesh, a column frame of modes, `place` of a "
                  "mass of several motions",
                  f"{_way_of(site, bare[0])}, or name another structure")
        )  # fmt: skip
        return []
    given = vars(load)["direction"]
    for one, body in bodies.items():
        fault = _direction_fault(one, body, given, load.static)
        if fault:
            site.faults.append(Fault((*key, "direction"), *fault))
            return []
    return [
        _on_inertia(load, body, name if len(bodies) == 1 else f"{name}-{one}", given) for one, body in bodies.items()
    ]


def _way_of(site: Site, name: str) -> str:
    """Return the advice that gives a structure its motion with the frame."""
    model = next(one.model for one in site.case.structure if one.name == name)
    if isinstance(model, LumpedMass):
        return f"add place = {{ across = [0, 0, 1] }} to {name}"
    if isinstance(model, ModesOfFile):
        universal = "" if model.file.lower().endswith(".csv") else "a CSV file in place of "
        return f"add the column frame to {universal}{model.file}"
    return f"add frame = [0, 0, 1] to {name}"


def _in_motions(site: Site, number: int, load: AnyLoad, point: StructurePoint) -> Array | None:
    """Return the direction of a load in the motions of a point, of length 1; None, with a fault, where it has none."""
    along = vars(load)["direction"]
    given = np.eye(len(point.rows))[0] if along is None else np.asarray(along, dtype=float)
    if len(given) != len(point.rows) or not np.any(given):
        site.faults.append(
            Fault(("load", number, "direction"), f"{given.tolist()} at a point of {counted(len(point.rows), 'motion')}",
                  "a number for each motion, not all 0")
        )  # fmt: skip
        return None
    return np.asarray(given / np.linalg.norm(given))


def _along_beam(site: Site, number: int, load: LineLoad, body: Structure) -> list[Load]:
    """Return a load for each pattern of forces along a beam, each with its own noise."""
    points = [body[f"load {number}: {i}"] for i in range(len(load.patterns[0].places))]
    unit = _in_motions(site, number, load, points[0])
    if unit is None:
        return []
    rows = np.stack([unit @ point.rows for point in points])
    return [
        Load(body, np.asarray(pattern.weights) @ rows, signal_of(part.time_function()), f"{load.name}-{k}")
        for k, (part, pattern) in enumerate(zip(load.parts, load.patterns, strict=True), start=1)
    ]


def _direction_fault(name: str, body: Structure, given: Any, static: bool) -> tuple[str, str, str] | None:
    """Return the fault of the direction of a load on a structure."""
    if not body.is_spatial and given is not None:
        return (
            f'a direction of a load on "{name}", which has no place in space',
            "no direction: `frame` of a structure is the direction",
            "leave direction out, or give the structure a place",
        )
    if body.is_spatial and (given is None or len(given) != 3 or not any(given)) and not (static and given is None):
        found = "nothing: the key is missing" if given is None else f"{list(given)}"
        return found, f'a vector (x, y, z): "{name}" is placed in space', "direction = [0, 0, 1] is along z"
    return None


def _on_inertia(load: AnyLoad, body: Structure, name: str, given: Any) -> Load:
    if load.static:
        downward = load.default_sense if given is None else 1.0
        along = None if not body.is_spatial else (0.0, 0.0, 1.0) if given is None else given
        return weight(body, downward * load.weight_acceleration, along, name)
    value, own = valued(load)
    return BaseMotion(body, value, given, name, **own)


def driven_joints(case: SceneCase) -> dict[str, ClampedBody | PinnedBody | HeldBody]:
    """Return the joints that loads move and that hold a structure, by the names of its points there."""
    moved = {support_of(load) for load in case.load} - {None}
    held = {f"clamp {number}": one for number, one in enumerate(case.joint) if not isinstance(one, Between)}
    return {clamp: one for clamp, one in held.items() if one.name in moved}


def _at_clamp(
    site: Site, number: int, load: AnyLoad, clamp: str, joint: ClampedBody | PinnedBody | HeldBody
) -> list[Load]:
    """Return the forces on a structure, one of whose clamps moves by s, counted from t = 0; see `driven_rows`.

    The damping ratio of modes acts beside the motion that the structure follows slowly, K^-1 f for the force f of
    s = 1: w_i^2 q_i = f_i, so that 2 zeta w_i q_i s' is a force of s'.
    """
    body = site.bodies.get(joint.structure)
    if body is None:
        return []
    point = body[f"{clamp}: K"]
    if isinstance(joint, HeldBody) and vars(load)["direction"] is None:
        load = load.model_copy(update={"direction": joint.direction})
    unit = _in_motions(site, number, load, point)
    if unit is None:
        return []
    force = {letter: unit @ body[f"{clamp}: {letter}"].rows for letter in "KCM" if f"{clamp}: {letter}" in body.points}
    if not np.any(force["K"]):
        site.faults.append(
            Fault(("load", number, "direction"), f'{list(unit)}, along which "{joint.name}" does not hold',
                  "a direction that the joint holds")
        )  # fmt: skip
        return []
    damping = next(one.damping for one in site.case.structure if one.name == joint.structure)
    if damping:  # in modes, rigid ones first
        still = 0 if body.rigid is None else body.rigid.shape[1]
        follows = np.zeros(body.size)
        follows[still:] = 2.0 * damping * force["K"][still:] / np.sqrt(np.diag(body.K)[still:])
        force["C"] = force.get("C", 0.0) + follows
    s = load.time_function()
    assert s.rate is not None
    assert s.acceleration is not None
    value, rate = LoadSignal(lambda t: s.value(t) - s.value(0.0)), LoadSignal(s.rate)
    others = {"C": rate, "M": LoadSignal(s.acceleration)}
    found: dict[str, Load] = {"K": ClampMotion(body, force.pop("K"), value, rate)}
    found |= {letter: Load(body, f, others[letter]) for letter, f in force.items()}
    for letter in {"K", "M"} & set(found):
        found[letter].held = {key: -one.driven[f"{clamp}: {letter}"] @ unit for key, one in body.reactions.items()}
    return list(found.values())


def at_moving_end(site: Site, number: int, joint: SpringJoint, point: StructurePoint) -> list[Load]:
    """Return the forces k s + c s' on a point by the end of a joint that moves by s, counted from t = 0."""

    def force(s: TimeFunction) -> Callable[[Any], Any]:
        rate = s.rate
        assert rate is not None
        return lambda t: joint.stiffness * (s.value(t) - s.value(0.0)) + joint.damping * rate(t)

    motions = _motions(site, joint.name, point) if len(joint.between) == 1 else []
    named = [(f"{joint.name} {number}-{k}", unit, s) for k, (unit, s) in enumerate(motions)]
    loads = [Force(point, LoadSignal(force(s)), unit, name) for name, unit, s in named]
    along = point.directions
    for load, (unit, _) in zip(loads, motions, strict=True):
        if along is not None:
            load.held[joint.name] = -np.pad(along.T @ unit, (0, HELD - 3))
    return list(loads)


def moved_contacts(site: Site, contact: Contact, pair: str) -> list[Contact]:
    """Return a contact as the loads move its region, counted from t = 0.

    Where its clearance changes, each flat face of the region is a contact that moves along its normal; a disc grows.

    Args:
        site: The structures, with the loads.
        contact: The contact.
        pair: Name of its pair.
    """
    motions = _motions(site, contact.name, contact.points[0])
    if motions:
        contact = replace(contact, wall=_wall(motions))
    changes = [one.time_function() for one in site.case.load if opens(one) and one.support == pair]
    if not changes:
        return [contact]
    found, faces = list[Contact](), contact.region.flat_faces
    if not faces:
        return [replace(contact, opening=_growth(changes))]
    for i, (face, share) in enumerate(faces):
        ways = [(share * face.normals[0, : contact.motions], s) for s in changes]
        name = contact.name if len(faces) == 1 else f"{contact.name}-{i}"
        found.append(replace(contact, region=face, wall=_wall([*motions, *ways]), name=name))
    return found


Motions = list[tuple[Array, TimeFunction]]
"""Ways of a region in the motions of a point, each with its displacement over time."""


def _motions(site: Site, name: str, point: StructurePoint) -> Motions:
    """Return the motions of the side on the frame of a pair or joint."""
    moving = [(number, one) for number, one in enumerate(site.case.load) if name and support_of(one) == name]
    units = [(_in_motions(site, number, one, point), one.time_function()) for number, one in moving]
    return [(unit, s) for unit, s in units if unit is not None]


def _growth(changes: list[TimeFunction]) -> Callable[[float], float]:
    return lambda t: sum(float(s.value(t)) - float(s.value(0.0)) for s in changes)


def _wall(motions: Motions) -> Callable[[float], Array]:
    return lambda t: np.asarray(sum(way * (float(s.value(t)) - float(s.value(0.0))) for way, s in motions))
