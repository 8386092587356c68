"""Contradictions between joints, masses or [wear] and the rest of a case: names, places, motions, faces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

from gapbeam.meshes.beam_geometry import SNAP
from gapbeam.solver.case.beam_profile import Beam, span_lies_on_the_beam
from gapbeam.solver.case.case import Contact, Mesh, Wear, advised_scheme
from gapbeam.solver.case.checks.place_checks import Loads, outside
from gapbeam.solver.case.solution_tables import ModelTable, RigidModel, Time
from gapbeam.solver.loads.attachments import ElasticJoint, Fluid, Joint, PointMass, bending_rank
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.messages.wording import apart, counted, exceeds
from gapbeam.solver.supports.layout import Layout, keyed, support_at
from gapbeam.solver.supports.support_tables import AnySupports

Joints = Mapping[int, Joint]
"""Joints by their number in the case file, from 0, without those that have faults of their own."""
Masses = Mapping[int, PointMass]
Fluids = Mapping[int, Fluid]


def joints_lie_on_the_beam(beam: Beam, mesh: Mesh, joint: Joints) -> Iterator[Fault]:
    """Joints hold cross-sections of the beam."""
    for number, entry in joint.items():
        yield from outside(("joint", number, "point"), entry.point, beam, mesh)


def masses_lie_on_the_beam(beam: Beam, mesh: Mesh, mass: Masses) -> Iterator[Fault]:
    """Masses sit on cross-sections of the beam."""
    for number, entry in mass.items():
        yield from outside(("mass", number, "point"), entry.point, beam, mesh)


def joints_keep_apart(beam: Beam, joint: Joints) -> Iterator[Fault]:
    """Two joints in one place act on different motions, such as a pin and a spring against rotation."""
    for (first, one), (number, other) in combinations(joint.items(), 2):
        if abs(other.point - one.point) > SNAP * beam.thickness:
            continue
        both = {each.motion.name for each in one.attached()} & {each.motion.name for each in other.attached()}
        if both or other.point != one.point:
            yield Fault(
                ("joint", number, "point"),
                f"{other.point:g} m, where the joint {one.name} is already",
                "joints in one place at exactly the same x, none of whose motions are the same",
                _one_of(one, other, sorted(both)) if both else f"point = {one.point!r}",
                (("joint", first, "point"),),
            )


def _one_of(one: Joint, other: Joint, both: Sequence[str]) -> str:
    """Return the advice that leaves the common motions of two joints to one of them."""
    springs = next((each for each in (other, one) if isinstance(each, ElasticJoint)), None)
    if springs is not None:
        return f"leave {', '.join(both)} out of the stiffness and damping of {springs.name}"
    if one.holds == other.holds:
        return f"one of {one.name} and {other.name}"
    return f'one joint with type = "clamped", which holds all that {one.name} and {other.name} hold'


def offsets_fit_the_mesh(beam: Beam, mesh: Mesh, mass: Masses) -> Iterator[Fault]:
    """An offset has as many components as the mesh has dimensions, none longer than the beam."""
    for number, entry in mass.items():
        if entry.offset is None:
            continue
        key, related = ("mass", number, "offset"), (("mesh", "dimension"),)
        if len(entry.offset) != mesh.dimension:
            flat = mesh.dimension == 2
            twists = flat and entry.away[1] != 0.0
            yield Fault(
                key,
                f"{counted(len(entry.offset), 'component')} with dimension = {mesh.dimension}",
                "[x, z]: a slice neither twists nor leaves its plane" if flat else "[x, y, z]",
                "dimension = 3 for a mass beside the bending plane"
                if twists
                else f"offset = {_listed((entry.away[0], entry.away[2]) if flat else entry.away)}",
                related,
            )
        elif exceeds(far := max(map(abs, entry.offset)), beam.length):
            hint = (
                f"is it in mm? In m it is {far / 1000.0:g}" if far / 1000.0 <= beam.length else "coordinates are in m"
            )
            found, length = apart(far, beam.length)
            yield Fault(key, f"{found} m", f"at most the length of the beam, {length} m", hint)


def _listed(numbers: tuple[float, ...]) -> str:
    return f"[{', '.join(f'{number:.6g}' for number in numbers)}]"


def elastic_joints_do_something(joint: Joints, mesh: Mesh) -> Iterator[Fault]:
    """An elastic joint has a spring or a damper, on a motion that the model has."""
    missing = ["lateral", "lateral_rotation", "twist"] if mesh.dimension == 2 else []
    for number, entry in joint.items():
        if not isinstance(entry, ElasticJoint):
            continue
        names = [one.motion.name for one in entry.attached()]
        if not names:
            yield Fault(
                ("joint", number, "stiffness"),
                "an elastic joint without springs and dampers",
                "at least one that is not 0",
                "stiffness = { vertical = 1e5 }",
            )
        for name in names:
            if name in missing:
                yield Fault(
                    ("joint", number, "stiffness" if getattr(entry.stiffness, name) > 0.0 else "damping"),
                    f"{name}, a motion that a slice (dimension = 2) does not have",
                    "axial, vertical or rotation",
                    f"leave {name} out, or take dimension = 3",
                    (("mesh", "dimension"),),
                )


def joints_let_the_body_move(joint: Joints, model: ModelTable) -> Iterator[Fault]:
    """A rigid body that joints hold altogether has no motion left."""
    if isinstance(model, RigidModel) and bending_rank(tuple(joint.values()), held_only=True) == 2:
        yield Fault(
            ("model", "type"),
            "rigid, with joints that neither let the body rise nor rotate",
            "a model that bends",
            'type = "beam"',
            tuple(("joint", number, "type") for number in joint),
        )


def holds_need_implicit_steps(joint: Joints, time: Time, contact: Contact) -> Iterator[Fault]:
    """Joints are far stiffer than the section, so that explicit steps would have to resolve their frequency."""
    if not time.scheme.explicit:
        return
    for number, entry in joint.items():
        if entry.holds:
            yield Fault(
                ("time", "scheme"),
                f"{time.scheme.type}, with the joint {entry.name}, which is {getattr(entry, 'type', 'rigid')}",
                "an implicit scheme, or an elastic joint: an explicit step is as short as the stiffest spring asks for",
                f'scheme = "{advised_scheme(contact)}"',
                (("joint", number, "type"),),
            )


def masses_sit_on_mass(support: AnySupports, contact: Contact, mass: Masses) -> Iterator[Fault]:
    """A mass cannot sit on contact nodes without mass."""
    if contact.mass != "redistributed":
        return
    for number, entry in mass.items():
        place = support_at(support, entry.point)
        if place is not None:
            yield Fault(
                ("mass", number, "point"),
                f"x = {entry.point:g} m, in a support, whose contact nodes have no mass",
                f"a mass at x above {place.end:g} m, or contact nodes with mass",
                'contact.mass = "consistent", or move the mass out of the support',
                (("contact", "mass"),),
            )


def fluids_surround_the_beam(beam: Beam, fluid: Fluids) -> Iterator[Fault]:
    """A fluid begins before it ends, lies along the beam, and does something."""
    for number, entry in fluid.items():
        key = ("fluid", number)
        yield from span_lies_on_the_beam(key, entry, beam, "the fluid", "a fluid has a length along the beam")
        if not max(entry.added_mass, entry.displaced_mass, entry.damping) > 0.0:
            yield Fault(
                (*key, "added_mass"),
                "a fluid without added mass, displaced mass and damping",
                "at least one that is not 0",
                "added_mass = 0.5",
            )


def fluids_move_mass(support: AnySupports, contact: Contact, fluid: Fluids) -> Iterator[Fault]:
    """Fluid that moves with contact nodes without mass would be all that they have."""
    if contact.mass != "redistributed":
        return
    for number, entry in fluid.items():
        near = [one for _, one in keyed(support) if one.start < entry.end and entry.start < one.end]
        if near and (entry.added_mass > 0.0 or entry.damping > 0.0):
            yield Fault(
                ("fluid", number, "from"),
                f"from x = {entry.start:g} to x = {entry.end:g} m, through the support {near[0].name}, whose contact "
                "nodes have no mass",
                "fluid beside the supports, or contact nodes with mass",
                'contact.mass = "consistent"',
                (("contact", "mass"),),
            )


OF_WEAR = {"wear": "1/Pa", "area": "m^2", "depth_limit": "m"}
"""Keys of a [[support]] that replace those of [wear], with their units."""


def wear_has_its_coefficients(support: AnySupports, wear: Wear | None) -> Iterator[Fault]:
    """A depth is that of something that wears, and coefficients of supports are those of a case with [wear]."""
    own = dict(keyed(support))
    for key, one in own.items() if wear is None else ():
        for name, unit in OF_WEAR.items():
            if (value := getattr(one, name)) is not None:
                yield Fault(
                    (*key, name),
                    f"{value:g} {unit}, without [wear]",
                    "the table [wear], by which a run measures the work that wears",
                    "[wear] with the coefficient of the other supports",
                )
    if wear is None or wear.coefficient is not None:
        return
    areas = {(*key, "area"): one.area for key, one in own.items() if one.wear is None and one.area is not None}
    if wear.area is not None and all(one.wear is None for one in own.values()):
        areas[("wear", "area")] = wear.area
    for key, area in areas.items():
        yield Fault(
            key,
            f"{area:g} m^2, without a coefficient",
            "a coefficient of wear: without one no volume is known that is spread over the area",
            "coefficient = 2e-14 in [wear], 1/Pa",
        )


def depth_limits_have_an_area(support: AnySupports, wear: Wear | None) -> Iterator[Fault]:
    """A depth is a volume over an area."""
    if wear is None or wear.area is not None or wear.growth == "local":
        return
    own = dict(keyed(support))
    limits = {(*key, "depth_limit"): one.depth_limit for key, one in own.items() if one.area is None}
    if any(one.area is None for one in own.values()):
        limits[("wear", "depth_limit")] = wear.depth_limit
    for key, limit in limits.items():
        if limit is not None:
            yield Fault(
                key,
                f"{limit:g} m, without the worn area",
                "the area over which the volume is spread: without one no depth is known",
                f"area = 1e-5 in {'[wear]' if key[0] == 'wear' else '[wear] or in this support'}, m^2",
            )


def local_growth_has_areas_of_its_own(support: AnySupports, wear: Wear | None) -> Iterator[Fault]:
    """Contact points that wear by themselves have areas of their own, and no other is given."""
    if wear is None or wear.growth != "local":
        return
    areas = {("wear", "area"): wear.area} | {(*key, "area"): one.area for key, one in keyed(support)}
    for key, area in areas.items():
        if area is not None:
            yield Fault(
                key,
                f'{area:g} m^2, with growth = "local"',
                "no area: each contact point wears over the area that belongs to it",
                'leave it out; or growth = "even", which spreads the volume of a face over its area',
                (("wear", "growth"),),
            )


def wear_fits_the_formulation(contact: Contact, wear: Wear | None) -> Iterator[Fault]:
    """Work needs points with a normal force and a motion along the face."""
    if wear is not None and contact.formulation.stress_terms is not None:
        yield Fault(
            ("wear",),
            f"the work of sliding, with the formulation {contact.formulation.type}",
            "contact whose forces are those of its points: the formulation does not follow motion along the faces",
            'formulation = "penalty" in [contact]',
            (("contact", "formulation"),),
        )


def moving_supports_do_not_wear_around(support: AnySupports, load: Loads, wear: Wear | None) -> Iterator[Fault]:
    """A support around the beam that moves as it is slides on it, which the measured motion does not know."""
    layout = Layout.of(support)
    for number, entry in load.items() if wear is not None else ():
        place = entry.place
        moved = moved_by(place, layout) if isinstance(place, SupportWalls) else None
        if isinstance(place, SupportWalls) and not place.opens and moved is not None and moved.around:
            yield Fault(
                ("wear",),
                f"the work of sliding, with {entry.type} of the {moved.region.type} {moved.name}",
                "supports around the beam that stay where they are: the slip of their walls is not followed",
                "a base_motion, which moves all supports alike; or leave [wear] out",
                (("load", number, "type"),),
            )
