"""Builder of the scene of a file of several structures; errors on the way become faults of its keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from math import ceil
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from gapbeam.solver.case.reading.value_words import flat
from gapbeam.solver.loads.scene_load_choice import (
    AnyLoad,
    is_along_beam,
    structure_of,
)
from gapbeam.solver.messages.errors import CaseError, Fault, Key, RunError, UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.scene.argument_checks import ArgumentError, check_near
from gapbeam.solver.scene.beam_structure import beam, element_count, figures, in_two_planes
from gapbeam.solver.scene.feedback import Feedback, Joint
from gapbeam.solver.scene.finer_mesh import may_be_finer
from gapbeam.solver.scene.flow_force import FlowSpan
from gapbeam.solver.scene.modal_files import read_modes
from gapbeam.solver.scene.moving_point import MovingPoint, moving_point
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.structure import Structure, StructurePoint, mass, reduced_at_points
from gapbeam.solver.scene.structure_files import ImportedModel, PlacedPoint, read_model
from gapbeam.solver.scene.structure_geometry import Pose
from gapbeam.solver.scene.universal_file import UNIVERSAL
from gapbeam.solver.scene_file.contact_builder import (
    SPREAD,
    STATION,
    Site,
    at_points,
    condensed_face,
    face_pair,
    fault_of,
    point_contact,
    snubber_of,
)
from gapbeam.solver.scene_file.feedback_tables import (
    AnyFeedback,
    faulty_key,
    flow_span,
    made_feedback,
    places_of,
    stations,
)
from gapbeam.solver.scene_file.frame_builder import direction_of, extent_of, framed, stations_of
from gapbeam.solver.scene_file.load_builder import (
    at_moving_end,
    driven_joints,
    loads_of,
    moved_contacts,
    signal_of,
)
from gapbeam.solver.scene_file.placed_bodies import PlacedBody, in_space, line_of
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.structure_tables import (
    NODAL,
    BodyTable,
    ClampedBody,
    ElementBeam,
    ElementFrame,
    LumpedMass,
    MeshFile,
    ModesOfFile,
    PinnedBody,
    PointTable,
    RigidBar,
    SnubberJoint,
    SpringJoint,
)
from gapbeam.solver.system.operators import Array

WAY = 40  # parts of the way of a point that moves, at least


def built_scene(
    case: SceneCase, source: str, put: Callable[[list[Fault]], list[Fault]], finer: int = 1
) -> tuple[Scene, dict[str, FlowSpan]]:
    """Return the scene of a file, and the spans of its [[feedback]] by name.

    Args:
        case: Contents of the file.
        source: Its name in messages.
        put: Returns faults with their places in the file.
        finer: Keep so many times the modes that reduced structures ask for, or all, and so many times the elements of
            beams and frames, as far as all modes of those can be marched; with 2, reduced meshes are twice as fine.

    Raises:
        CaseError: A structure cannot be read, or parts do not fit: all of it in the message.
    """
    site = Site(case, finer)
    for number, table in enumerate(case.structure):
        try:
            _place(site, table)
        except UserError as error:
            site.faults.append(_fault(site, number, error))
    pairs = [at_points(site, number, pair.over(case.contact)) for number, pair in enumerate(case.pair)]
    _make(site, _body)
    touching = {} if site.faults else {number: one for number, one in enumerate(pairs) if one.at == "faces"}
    faces = {number: face_pair(site, number, one) for number, one in touching.items()}
    _make(site, _condensed)
    if not site.faults:
        site.moving = {name: point for one in case.structure for name, point in _moving(site, one).items()}
    feedbacks = [_feedback(site, number, one) for number, one in enumerate(case.feedback)]
    contacts = [point_contact(site, number, pair) for number, pair in enumerate(pairs) if pair.at != "faces"]
    contacts += [condensed_face(site, key, one) for key, some in faces.items() for one in some if not site.faults]
    owners = {one.name: pairs[number].name for number, some in faces.items() for one in some}
    loads = [load for number, one in enumerate(case.load) for load in loads_of(site, number, one)]
    for one in site.bodies.values():
        for name in [name for name in one.points if STATION.match(name)]:
            del one.points[name]
    joints = []
    for number, joint in enumerate(case.joint):
        if isinstance(joint, SnubberJoint):
            contacts.append(snubber_of(site, number, joint))
        if isinstance(joint, SpringJoint):
            ends = [site.point(("joint", number, "between"), place) for place in joint.between]
            known = [end for end in ends if end is not None]
            if len(known) == len(ends) > 1 and len(known[0].rows) != len(known[1].rows):
                site.faults.append(
                    Fault(("joint", number, "between"), "points of 1 and of 2 motions", "points of as many motions")
                )
            elif len(known) == len(ends):
                between = known[0] if len(known) == 1 else (known[0], known[1])
                own = (joint.name, True) if joint.force else ()
                try:
                    joints.append(Joint(between, joint.stiffness, joint.damping, *own))
                except UserError as error:
                    found = str(error).partition("found ")[2].partition(", expected ")
                    site.faults.append(Fault(("joint", number, "force"), found[0], found[2]))
                loads += at_moving_end(site, number, joint, known[0])
    moved = [
        part
        for one in contacts
        if one is not None
        for part in moved_contacts(site, one, owners.get(one.name, one.name))
    ]
    if site.faults:
        raise CaseError(source, put(site.faults))
    scene = Scene(
        *site.bodies.values(), contacts=moved, loads=loads, joints=joints,
        feedbacks=[one for one in feedbacks if one is not None],
    )  # fmt: skip
    return scene, site.spans


def with_noise(scene: Scene, loads: Iterable[AnyLoad]) -> Scene:
    """Return the scene of a file with the noise of these random loads of the file; all else is shared."""
    drawn = list[tuple[str, Any]]()
    for load in loads:
        name = str(vars(load)["name"])
        if is_along_beam(load):
            drawn += [(f"{name}-{k}", part) for k, part in enumerate(load.parts, start=1)]
        elif load.noise:
            drawn += [(name, load)]
    return scene.with_({f"{name}.value": signal_of(part.time_function()) for name, part in drawn})


def start_velocities(case: SceneCase, scene: Scene) -> dict[Structure, Array]:
    """Return the velocities of all DOFs of structures that move as a whole at the start."""
    found = {}
    for table, one in zip(case.structure, scene.structures, strict=True):
        if table.velocity:
            assert one.inertia is not None
            speed = np.asarray(table.velocity, dtype=float)
            moved = one.inertia @ speed if one.is_spatial else one.inertia * speed
            found[one] = np.atleast_1d(sla.spsolve(sp.csc_matrix(one.M), moved))
    return found


def _place(site: Site, table: BodyTable) -> None:
    """Find out where a structure is in space; matrices are read.

    Raises:
        UserError: A file cannot be read, or the place is none.
    """
    model, place = table.model, None if table.place is None else table.place.made()
    if isinstance(model, NODAL):
        read = _meshed(site, table, model, place) if isinstance(model, MeshFile) else read_model(
            model.stiffness, model.mass, units=model.units, damping=model.damping, dofs=model.dofs, nodes=model.nodes,
            place=place, name=table.name,
        )  # fmt: skip
        site.models[table.name] = read
        nodes = {node: at for node, at in read.places.items() if node in read.rows.of_file}
        if nodes:
            site.extents[table.name] = PlacedBody(tuple(nodes), np.array(list(nodes.values())))
    elif isinstance(model, ElementFrame):
        site.extents[table.name], site.lengths[table.name] = extent_of(table, model, site.members(table))
    elif place is not None and isinstance(model, LumpedMass):
        site.extents[table.name] = line_of(place, 0.0, model.motions, 0.0)
    elif place is not None and isinstance(model, ElementBeam | RigidBar):
        site.extents[table.name] = line_of(place, model.length, 1, 0.5 * model.thickness)


def _meshed(site: Site, table: BodyTable, model: MeshFile, place: Pose | None) -> ImportedModel:
    """Return the matrices of a mesh file, or of a finer mesh where that is reduced and not too large.

    Raises:
        UserError: The file cannot be read, or materials do not fit.
    """
    read = model.read(place, table.name, site.finer > 1 and table.reduce is not None)
    motions, dimension = len(read.rows.labels), 3 if model.plane is None else 2
    may = table.reduce is not None and may_be_finer(motions, dimension)
    if site.finer == 1 and site.case.output.errors != "none" and not may:
        why = "it is not reduced" if table.reduce is None else "it is too large for a finer one"
        LOG.warning(
            "structure %s: errors of figures leave out its mesh of %d motions, as %s; compare with a finer mesh",
            table.name, motions, why,
        )  # fmt: skip
    return read


def _make(site: Site, made: Callable[[Site, BodyTable], Structure]) -> None:
    """Make all structures, or make them anew, while there are no faults."""
    for number, table in enumerate(site.case.structure if not site.faults else ()):
        try:
            site.bodies[table.name] = made(site, table)
        except (UserError, RunError) as error:
            site.faults.append(_fault(site, number, error))


def _body(site: Site, table: BodyTable) -> Structure:
    """Return a structure.

    Raises:
        UserError: The structure cannot be made.
    """
    model, points = table.model, [one for one in site.case.point if one.structure == table.name and not one.speed]
    held = [one for one in site.case.joint if getattr(one, "structure", None) == table.name]
    extent, nearest = site.extents.get(table.name), site.nearest.get(table.name, {})
    driven = {clamp: joint for clamp, joint in driven_joints(site.case).items() if joint.structure == table.name}
    gauges = [point.name for point in points if point.stress]
    if isinstance(model, LumpedMass):
        more = {name: [[1.0]] for name in nearest}
        one = mass(model.mass, model.motions, model.stiffness, model.damping, table.name, **more)
        at = dict.fromkeys(one.points, 0.0)
    elif isinstance(model, ModesOfFile):
        named = _named(site, table) if model.file.lower().endswith(UNIVERSAL) else ()
        return read_modes(model.file, table.name, named)
    elif isinstance(model, NODAL):
        one, at = _imported(site, table, points, held, driven, gauges), {}
    elif isinstance(model, ElementFrame):
        given = stations_of(points, nearest, extent)
        one, places = _refined(site, table, lambda count: framed(
            table, model, site.members(table), given | {
                name: (x, direction_of(point)) for point, way in _ways(site, table) for name, x in way.items()
            }, held, driven, gauges, count * element_count(model.elements)
        ))  # fmt: skip
        at, site.places = {}, site.places | places
    else:
        fixed = {point.name: _along(extent, point) for point in points} | nearest

        def straight(count: int) -> tuple[Structure, dict[str, float]]:
            at = fixed | _stations(site, table)
            return _straight(table, model, at, held, driven, gauges, count), at

        one, at = _refined(site, table, straight)
        if isinstance(model, ElementBeam) and model.motions == 2:
            one = in_two_planes(one)
    if extent is not None and extent.ways is not None:
        one = in_space(one, extent.ways)
        for name, x in at.items():
            site.places[f"{table.name}.{name}"] = PlacedPoint(extent.at(x), extent.ways)
    if table.velocity and one.inertia is None:
        known = "`place`, and a vector" if isinstance(model, LumpedMass) else "`frame`, a direction"
        raise ArgumentError(f"found a velocity, expected a structure with {known}", "velocity")
    if table.velocity and one.is_spatial is not isinstance(table.velocity, tuple):
        expected = "a vector (x, y, z): it has a place" if one.is_spatial else "a number: it has no place"
        raise ArgumentError(f"found velocity {table.velocity}, expected {expected}", "velocity")
    return one


Part = TypeVar("Part")


def _refined(site: Site, table: BodyTable, made: Callable[[int], tuple[Structure, Part]]) -> tuple[Structure, Part]:
    """Return a structure with more elements, or with those of the file where it would be marched sparse."""
    for count in dict.fromkeys((site.finer, 1)):
        site.counts[table.name] = count
        found = made(count)
        if table.reduce is not None or not found[0].is_large:
            break
    return found


def _condensed(site: Site, table: BodyTable) -> Structure:
    """Return a structure as it is marched: reduced, and damped.

    Raises:
        UserError: The structure cannot be reduced or damped.
    """
    one = site.bodies[table.name]
    if table.reduce is not None:
        modes = table.reduce.modes if site.finer == 1 else min(site.finer * table.reduce.modes, one.size - 1)
        one = reduced_at_points(one, modes, [name for name in one.points if not SPREAD.match(name)])
    one = _with_masses(site, table, one)
    if table.damping:
        if one.is_large:
            raise ArgumentError(
                f"found a ratio for {one.size} DOFs, expected a reduced structure; add reduce = {{ modes = 40 }}",
                "ratio" if table.ratio else "two_phase",
            )
        one = one.reduced(one.size, table.damping)
    return one


def _with_masses(site: Site, table: BodyTable, one: Structure) -> Structure:
    """Return a structure with its [[mass]] tables: its ratio is then a ratio of the modes that move."""
    loaded = dict[str, float]()
    for number, entry in enumerate(site.case.mass):
        owner, _, name = entry.point.partition(".")
        if owner == table.name and site.point(("mass", number, "point"), entry.point) is not None:
            loaded[name] = loaded.get(name, 0.0) + entry.mass
    return one.with_masses(loaded) if loaded else one


def _along(extent: PlacedBody | None, point: PointTable) -> float:
    """Return the place of a point along its beam, m.

    Raises:
        ArgumentError: Its coordinates are far from the beam.
    """
    if point.nearest is not None and extent is not None:
        x, place = extent.nearest(np.asarray(point.nearest))
        apart, size = (float(np.linalg.norm(one)) for one in (place - point.nearest, np.ptp(extent.places, axis=0)))
        check_near(f"point {point.name}", f"points.{point.name}", apart, size)
        return float(x)
    return float(point.at or 0.0)


def _straight(
    table: BodyTable, model: ElementBeam | RigidBar, at: dict[str, float], held: list[Any], driven: dict[str, Any],
    gauges: list[str], finer: int,
) -> Structure:  # fmt: skip
    return beam(
        model.length,
        figures(model.section, model.thickness, model.width or model.thickness, model.material.poisson_ratio),
        model.material,
        at,
        model="beam" if isinstance(model, ElementBeam) else "rigid",
        clamped=[float(joint.at or 0.0) for joint in held if isinstance(joint, ClampedBody)],
        pinned=[float(joint.at or 0.0) for joint in held if isinstance(joint, PinnedBody)],
        elements=finer * element_count(model.elements) if isinstance(model, ElementBeam) else None,
        added_mass=model.added_mass,
        tension=model.tension if isinstance(model, ElementBeam) else 0.0,
        name=table.name,
        driven={clamp: float(joint.at or 0.0) for clamp, joint in driven.items()},
        gauges=gauges,
    )


def _stations(site: Site, table: BodyTable) -> dict[str, float]:
    """Return the stations of all spans, loads and ways of points along a beam."""
    found = dict[str, float]()
    for number, load in enumerate(site.case.load):
        if is_along_beam(load) and structure_of(load) == table.name:
            found |= {f"load {number}: {i}": x for i, x in enumerate(load.patterns[0].places)}
    for number, one in enumerate(site.case.feedback):
        found |= stations(number, one, table)
    return found | {name: x for _, way in _ways(site, table) for name, x in way.items()}


def _ways(site: Site, table: BodyTable) -> Iterator[tuple[PointTable, dict[str, float]]]:
    """Yield points that move along a beam or a frame, with the places along their ways by name, m, growing.

    Raises:
        ArgumentError: A point starts where its way ends, or moves away.
    """
    for number, point in enumerate(site.case.point):
        if point.speed and point.structure == table.name:
            length = table.model.length if isinstance(table.model, ElementBeam | RigidBar) else site.lengths[table.name]
            start, end = point.at or 0.0, length if point.speed > 0.0 else 0.0
            first = min(max(start, 0.0), length)  # what starts outside comes later
            if first == end:
                raise ArgumentError(
                    f"found {point.speed:g} m/s at {start:g} m of {length:g} m, expected a speed along the axis from "
                    "there; leave speed out where the point stays",
                    f"points.{point.name}",
                )
            elements = element_count(getattr(table.model, "elements", None))
            count = site.counts[table.name] * elements  # which follow the spans
            low, high = sorted([first, end])
            places = np.linspace(low, high, max(WAY, ceil(abs(end - first) / length * count)) + 1)
            yield point, {f"point {number}: {i}": float(x) for i, x in enumerate(places)}


def _moving(site: Site, table: BodyTable) -> dict[str, MovingPoint]:
    """Return the points that move along a structure."""
    body, found = site.bodies[table.name], dict[str, MovingPoint]()
    for point, way in _ways(site, table):
        first, speed = point.at or 0.0, point.speed or 0.0
        position = partial(lambda first, speed, t: first + speed * t, first, speed)
        stays = [body[name] for name in way]
        found[f"{table.name}.{point.name}"] = moving_point(stays, list(way.values()), position, point.name)
    return found


def _feedback(site: Site, number: int, table: AnyFeedback) -> Feedback | None:
    """Return the force of a table; None where it makes none, or, with a fault, where it is wrong."""
    along, points = getattr(table, "span", None), dict[str, list[StructurePoint]]()
    for name, places in places_of(table).items():
        known = [site.point(("feedback", number, name), place) for place in places]
        points[name] = [one for one in known if one is not None]
        if len(points[name]) < len(places):
            return None
    if along is not None and along.structure not in site.bodies:
        return None
    try:
        if along is not None:
            body = next(one for one in site.case.structure if one.name == along.structure)
            site.spans[table.name] = flow_span(number, table, site.bodies[along.structure], body)
        return made_feedback(table, site.spans.get(table.name), points)
    except UserError as error:
        site.faults.append(fault_of(faulty_key(number, table, error), error))
        return None


def _imported(
    site: Site, table: BodyTable, points: list[PointTable], held: list[Any], driven: dict[str, Any],
    gauges: list[str],
) -> Structure:  # fmt: skip
    given: dict[str, Any] = dict(site.nearest.get(table.name, {}))
    for point in points:
        if point.dof is not None:
            given[point.name] = point.dof
        else:
            keys = {"node": point.node, "set": point.set, "nearest": point.nearest, "direction": point.direction}
            given[point.name] = {key: value for key, value in keys.items() if value is not None}
    clamped = [one for joint in held for one in joint.labels]
    moved = {clamp: joint.labels for clamp, joint in driven.items()}
    structure, places = site.models[table.name].structure(given, clamped, table.frame, moved, gauges)
    structure.rotations |= {point.name for point in points if point.rotation}
    site.places |= {f"{table.name}.{key}": place for key, place in places.items()}
    return structure


def _named(site: Site, table: BodyTable) -> list[str]:
    """Return the points of a structure that the file names."""
    values = flat(site.case.model_dump(mode="json")).values()
    texts = [text for value in values for text in (value if isinstance(value, list) else [value])]
    named = [one.partition(".") for one in texts if isinstance(one, str)]
    return list(dict.fromkeys(point for structure, _, point in named if structure == table.name and point))


def _fault(site: Site, number: int, error: Exception) -> Fault:
    """Return the fault of the key that an error is about."""
    table, argument = site.case.structure[number], getattr(error, "argument", "")
    model = type(table.model)
    key: Key = ("structure", number)
    if argument in model.model_fields:
        key = (*key, "model", argument)
    elif argument in type(table).model_fields:
        key = (*key, argument)
    elif argument.startswith("points."):
        name = argument.removeprefix("points.")
        points = [(one.structure, one.name) for one in site.case.point]
        if name in site.nearest.get(table.name, {}):
            key = ("pair", [one.name for one in site.case.pair].index(name))
        else:
            key = ("point", points.index((table.name, name)))
    elif argument.startswith("members."):
        _, index, name = argument.split(".")
        key = ("member", [i for i, one in enumerate(site.case.member) if one.structure == table.name][int(index)], name)
    elif argument == "clamped":
        key = ("joint", [getattr(one, "structure", None) for one in site.case.joint].index(table.name))
    elif table.reduce is not None and "modes" in str(error):
        key = (*key, "reduce")
    return fault_of(key, error)
