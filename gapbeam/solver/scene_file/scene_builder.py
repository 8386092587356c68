"""The scene that a file of several structures makes; what turns out wrong on the way are faults of its keys."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.errors import RunError, UserError
from gapbeam.solver.faults import CaseError, Fault, Key
from gapbeam.solver.loads.scene_load_choice import AnyLoad, point_of, structure_of
from gapbeam.solver.scene.beam_structure import beam, figures
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.feedback import Joint
from gapbeam.solver.scene.given_numbers import ArgumentError
from gapbeam.solver.scene.modal_files import read_modes
from gapbeam.solver.scene.point_basis import reduced_at_points
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import BaseMotion, Force, Load, weight
from gapbeam.solver.scene.structure import Structure, StructurePoint, mass
from gapbeam.solver.scene.structure_files import PlacedPoint, read_placed
from gapbeam.solver.scene_file.pair_checks import pair_faults
from gapbeam.solver.scene_file.pair_tables import PairTable
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.structure_tables import (
    BodyTable,
    ClampedBody,
    ElementBeam,
    ImportedMatrices,
    LumpedMass,
    ModesOfFile,
    PinnedBody,
    PointTable,
    SpringJoint,
)
from gapbeam.solver.system.operators import Array

MESSAGE = re.compile(r"(?:.*?: )?found (?P<found>.*?),? expected (?P<expected>.*?)(?:; (?P<hint>.*))?$", re.DOTALL)


@dataclass(frozen=True)
class _Signal:
    """The function of time of a load, for arrays of any shape."""

    value: Callable[[Any], Any]

    def __call__(self, times: Any) -> Array:
        flat = np.ravel(times)
        return np.array(np.broadcast_to(self.value(flat), flat.shape), dtype=float).reshape(np.shape(times))


@dataclass
class _Site:
    """Structures and points built so far, with their faults."""

    case: SceneCase
    bodies: dict[str, Structure] = field(default_factory=dict)
    places: dict[str, PlacedPoint] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)

    def point(self, key: Key, place: str) -> StructurePoint | None:
        """Return a point; None, with a fault, where its structure has none of that name."""
        owner, _, name = place.partition(".")
        structure = self.bodies.get(owner)
        if structure is None:
            return None
        if name not in structure.points:
            known = ", ".join(f"{owner}.{one}" for one in structure.points) or "none"
            self.faults.append(Fault(key, f'"{place}", which is no point', f"one of {known}"))
            return None
        return structure[name]


def built_scene(case: SceneCase, source: str, put: Callable[[list[Fault]], list[Fault]]) -> Scene:
    """Return the scene of a file.

    Args:
        case: What the file says.
        source: How it is called in messages.
        put: Returns faults with their places in the file.

    Raises:
        CaseError: A structure cannot be read, or parts do not fit: all of it in the message.
    """
    site = _Site(case)
    for number, table in enumerate(case.structure):
        try:
            site.bodies[table.name] = _body(site, table)
        except (UserError, RunError) as error:
            site.faults.append(_fault(site, number, error))
    contacts = [_contact(site, number, pair) for number, pair in enumerate(case.pair)]
    loads = [load for number, one in enumerate(case.load) for load in _loads(site, number, one)]
    joints, masses = [], []
    for number, joint in enumerate(case.joint):
        if isinstance(joint, SpringJoint):
            ends = [site.point(("joint", number, "between"), place) for place in joint.between]
            known = [end for end in ends if end is not None]
            if len(known) == len(ends) > 1 and len(known[0].rows) != len(known[1].rows):
                site.faults.append(
                    Fault(("joint", number, "between"), "points of 1 and of 2 motions", "points of as many motions")
                )
            elif len(known) == len(ends):
                between = known[0] if len(known) == 1 else (known[0], known[1])
                joints.append(Joint(between, joint.stiffness, joint.damping))
    for number, loaded in enumerate(case.mass):
        at = site.point(("mass", number, "point"), loaded.point)
        if at is not None:
            masses.append((at, loaded.mass))
    if site.faults:
        raise CaseError(source, put(site.faults))
    return Scene(
        *site.bodies.values(), contacts=[one for one in contacts if one is not None], loads=loads, joints=joints,
        masses=masses,
    )  # fmt: skip


def start_velocities(case: SceneCase, scene: Scene) -> dict[Structure, Array]:
    """Return the velocities of all DOFs of structures that move as a whole at the start."""
    found = {}
    for table, one in zip(case.structure, scene.structures, strict=True):
        if table.velocity:
            assert one.inertia is not None
            solved = sla.spsolve(sp.csc_matrix(one.M), one.inertia)
            found[one] = table.velocity * np.atleast_1d(solved)
    return found


def _body(site: _Site, table: BodyTable) -> Structure:
    """Return a structure.

    Raises:
        UserError: It cannot be made.
    """
    model, points = table.model, [one for one in site.case.point if one.structure == table.name]
    held = [one for one in site.case.joint if getattr(one, "structure", None) == table.name]
    if isinstance(model, LumpedMass):
        one = mass(model.mass, model.motions, model.stiffness, model.damping, table.name)
    elif isinstance(model, ModesOfFile):
        one = read_modes(model.file, table.name)
    elif isinstance(model, ImportedMatrices):
        one = _imported(site, table, model, points, held)
    else:
        flexible = isinstance(model, ElementBeam)
        one = beam(
            model.length,
            figures(model.section, model.thickness, model.width or model.thickness, model.material.poisson_ratio),
            model.material,
            {point.name: float(point.at or 0.0) for point in points},
            model="beam" if flexible else "rigid",
            clamped=[float(joint.at or 0.0) for joint in held if isinstance(joint, ClampedBody)],
            pinned=[joint.at for joint in held if isinstance(joint, PinnedBody)],
            elements=model.elements if isinstance(model, ElementBeam) else None,
            name=table.name,
        )
    if table.velocity and one.inertia is None:
        raise ArgumentError("found a velocity, expected a structure with `frame`, a direction", "velocity")
    if table.reduce is not None:
        one = reduced_at_points(one, table.reduce.modes)
    if table.ratio:
        if one.is_large:
            raise ArgumentError(
                f"found a ratio for {one.size} DOFs, expected a reduced structure; add reduce = {{ modes = 40 }}",
                "ratio",
            )
        one = one.reduced(one.size, table.ratio)
    return one


def _imported(
    site: _Site, table: BodyTable, model: ImportedMatrices, points: list[PointTable], held: list[Any]
) -> Structure:
    given: dict[str, Any] = {}
    for point in points:
        if point.dof is not None:
            given[point.name] = point.dof
        else:
            keys = {"node": point.node, "set": point.set, "nearest": point.nearest, "direction": point.direction}
            given[point.name] = {key: value for key, value in keys.items() if value is not None}
    clamped = [one for joint in held for one in ((joint.nodes,) if isinstance(joint.nodes, str) else joint.nodes or ())]
    structure, places = read_placed(
        model.stiffness, model.mass, units=model.units, damping=model.damping, dofs=model.dofs, nodes=model.nodes,
        points=given, clamped=clamped, frame=table.frame, name=table.name,
    )  # fmt: skip
    site.places |= {f"{table.name}.{key}": place for key, place in places.items()}
    return structure


def _fault(site: _Site, number: int, error: Exception) -> Fault:
    """Return the fault of the key that an error is about."""
    table, argument = site.case.structure[number], getattr(error, "argument", "")
    model = type(table.model)
    key: Key = ("structure", number)
    if argument in model.model_fields:
        key = (*key, "model", argument)
    elif argument in type(table).model_fields:
        key = (*key, argument)
    elif argument.startswith("points."):
        names = [(one.structure, one.name) for one in site.case.point]
        key = ("point", names.index((table.name, argument.removeprefix("points."))))
    elif argument == "clamped":
        key = ("joint", [getattr(one, "structure", None) for one in site.case.joint].index(table.name))
    elif table.reduce is not None and "modes" in str(error):
        key = (*key, "reduce")
    return fault_of(key, error)


def fault_of(key: Key, error: Exception) -> Fault:
    """Return an error as a fault: what it found, what it expected and what to try."""
    words = " ".join(str(error).split("\n"))
    parts = MESSAGE.match(words)
    if parts is None:
        return Fault(key, words, "values that go together")
    return Fault(key, parts["found"], parts["expected"], parts["hint"] or "")


def _contact(site: _Site, number: int, pair: PairTable) -> Contact | None:
    default, key = site.case.contact, ("pair", number)
    ends = [site.point((*key, "between"), place) for place in pair.between]
    known = [end for end in ends if end is not None]
    if len(known) < len(ends):
        return None
    try:
        region = pair.region.made()
    except UserError as error:
        site.faults.append(fault_of((*key, "region"), error))
        return None
    faults = pair_faults(key, pair, default, known, region, [site.places.get(place) for place in pair.between])
    site.faults += faults
    if faults:
        return None
    law = pair.law or default.law
    assert law is not None
    return Contact(
        known[0] if len(known) == 1 else (known[0], known[1]),
        region,
        law.made(),
        friction=default.friction if pair.friction is None else pair.friction,
        sliding=default.sliding if pair.sliding is None else pair.sliding,
        offset=pair.offset,
        name=pair.name,
    )


def _loads(site: _Site, number: int, load: AnyLoad) -> list[Load]:
    key: Key = ("load", number)
    name, value, place = str(vars(load)["name"]), _Signal(load.time_function().value), point_of(load)
    if place is not None:
        point, along = site.point((*key, "point"), place), vars(load)["direction"]
        if point is None:
            return []
        given = np.eye(len(point.rows))[0] if along is None else np.asarray(along, dtype=float)
        if len(given) != len(point.rows) or not np.any(given):
            site.faults.append(
                Fault((*key, "direction"), f"{list(given)} at a point of {len(point.rows)} motions",
                      "a number for each motion, not all 0")
            )  # fmt: skip
            return []
        return [Force(point, value, given / np.linalg.norm(given), name)]
    wanted = structure_of(load)
    bodies = {one: body for one, body in site.bodies.items() if wanted in (None, one)}
    bare = [one for one, body in bodies.items() if body.inertia is None]
    if bare:
        site.faults.append(
            Fault((*key, "structure"), f"{', '.join(bare)}, of which no motion with the frame is known",
                  "structures with a direction: `frame` of matrices, a column frame of modes",
                  'add frame = [0, 0, 1] to the structure, or name another structure')
        )  # fmt: skip
        return []
    return [
        _on_inertia(load, body, value, name if len(bodies) == 1 else f"{name}-{one}") for one, body in bodies.items()
    ]


def _on_inertia(load: AnyLoad, body: Structure, value: _Signal, name: str) -> Load:
    if load.static:
        return weight(body, load.default_sense * load.weight_acceleration, name=name)
    return BaseMotion(body, value, name=name)
