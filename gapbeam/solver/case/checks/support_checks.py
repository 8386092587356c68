"""Contradictions of supports: names, places, holes, moving walls, flexible supports, figures of whole supports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

from gapbeam.solver.case.analysis_table import Analysis, Periodic, Transient
from gapbeam.solver.case.beam_profile import Beam, beam_at, span_lies_on_the_beam
from gapbeam.solver.case.case import Contact, Mesh, law_at, own_law, whole_unit
from gapbeam.solver.case.checks.contact_checks import by_penalty
from gapbeam.solver.case.checks.place_checks import Loads, Segments
from gapbeam.solver.case.solution_tables import FullModel, ModelTable, Time
from gapbeam.solver.contact.laws.law_tables import ElasticPlastic
from gapbeam.solver.loads.attachments import Joint, bending_rank
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.messages.wording import apart, counted, either, exceeds
from gapbeam.solver.supports.layout import Layout, keyed
from gapbeam.solver.supports.support_tables import WHOLE, AnySupports, BaseAndGland, OneSupport


def supports_lie_on_the_beam(beam: Beam, support: AnySupports) -> Iterator[Fault]:
    """Every support begins before it ends, and ends on the beam."""
    if isinstance(support, BaseAndGland):
        return
    for key, one in keyed(support):
        needs = "a support has a length: its planes touch the beam along it"
        yield from span_lies_on_the_beam(key, one, beam, "the support", needs)


def supports_keep_apart(support: AnySupports) -> Iterator[Fault]:
    """No part of the beam faces two supports on the same side."""
    if isinstance(support, BaseAndGland):
        return
    for (_, one), (key, other) in combinations(keyed(support), 2):
        first, last = max(one.start, other.start), min(one.end, other.end)
        sides = set(one.sides) & set(other.sides)
        if sides and exceeds(last, first):
            where = " and ".join("below" if side > 0.0 else "above" for side in sorted(sides, reverse=True))
            yield Fault(
                (*key, "from"),
                f"{other.start:g} m: the supports {one.name} and {other.name} both stand {where} the beam "
                f"from x = {first:g} to x = {last:g} m",
                "supports that do not overlap on the same side: each place of the beam has one contact on each side; a "
                "soft stop before a hard one is a law whose stiffness grows, piecewise-linear",
                f"from = {one.end:g}" if other.start >= one.start else f"to = {one.start:g}",
                ((*key, "to"),),
            )


def own_contact_fits_the_case(support: AnySupports, contact: Contact, time: Time) -> Iterator[Fault]:
    """A support brings stiffness, damping and friction of its own where those of [contact] could stand."""
    formulation = contact.formulation
    for key, one in keyed(support):
        law, own = law_at(contact, one), own_law(one) is not None
        for name, unit in (("stiffness", contact.unit_with(law)), ("support_stiffness", whole_unit(law))):
            if (stiffness := getattr(one, name)) is not None and not formulation.follows_the_law:
                yield Fault(
                    (*key, name),
                    f"{stiffness:g} {unit}, with the formulation {formulation.type}",
                    "no stiffness: this formulation is for rigid supports",
                    f"{by_penalty(contact, time)}, or leave {name} out",
                    (("contact", "formulation"),),
                )
        name, unit = ("support_damping", "N s/m") if one.damping is None else ("damping", contact.damping_unit)
        damping = getattr(one, name)
        if damping is not None and not (formulation.follows_the_law and law.takes_damping):
            plain = formulation.follows_the_law
            what = f"the law {law.type} brings its own" if plain else f"the formulation {formulation.type} has no"
            yield Fault(
                (*key, name),
                f"{damping:g} {unit}",
                f"no damping here: {what} damping",
                f"leave {name} out",
                ((*key, "law"),) if own and plain else (("contact", "law" if plain else "formulation"),),
            )
        elif damping is not None and getattr(law, "restitution", None) is not None:
            where = (*key, "law", "restitution") if own else ("contact", "law", "restitution")
            yield Fault(
                (*key, name),
                f"{damping:g} {unit}, with a restitution in {'its law' if own else '[contact]'}",
                "one of the two: the damping is computed from the restitution",
                f"leave {name} out, or give every support its damping and leave restitution out",
                (where,),
            )


def something_carries_the_beam(support: AnySupports, load: Loads, joint: Mapping[int, Joint]) -> Iterator[Fault]:
    """A beam with weight rests on something, where no other static force may press it against supports above."""
    gravity = max((entry.weight_acceleration for entry in load.values()), default=0.0)
    if gravity == 0.0 or isinstance(support, BaseAndGland):
        return
    pushes = (
        entry.static_force is not None or (entry.static and entry.weight_acceleration == 0.0) for entry in load.values()
    )
    if any(pushes):
        return
    if bending_rank(tuple(joint.values()), held_only=False) > 0:
        return
    if not any(face.carries for _, one in keyed(support) for face in one.faces):
        yield Fault(
            ("support",),
            "supports above the beam only, with gravity",
            "at least one plane below: nothing else carries the weight",
            'region = "slot", or side = "below" of a stop',
            (("load",),),
        )


def _around(support: AnySupports) -> Iterator[tuple[Key, OneSupport]]:
    """Yield the supports around the beam among those of a case, with the key of their region."""
    for key, one in keyed(support):
        if one.around:
            yield (*key, "region"), one


def regions_fit_the_beam(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """Values of a region fit each other and the beam."""
    for key, one in keyed(support):
        yield from one.region.faults((*key, "region"), 0.5 * _within(beam, segment, one).thickness)


def _within(beam: Beam, segment: Segments, support: OneSupport) -> Beam:
    """Return a beam that is all along as the one in a support is."""
    return beam_at(beam, segment.values(), 0.5 * (support.start + support.end))


def round_beams_are_met_around(beam: Beam, segment: Segments, support: AnySupports, mesh: Mesh) -> Iterator[Fault]:
    """A support around the beam has a round section in it, in a mesh that gapbeam builds."""
    for key, one in _around(support):
        name = one.region.type
        section = _within(beam, segment, one).section
        if not section.round:
            yield Fault(
                key,
                f'{name}, around the section "{section.type}"',
                f"a round section, which touches a {name} anywhere around it",
                'section = "round" or { type = "tube", wall = ... } in [beam], or region = "slot"',
                (("beam", "section"),),
            )
        elif mesh.file is not None:
            yield Fault(
                key,
                f"{name}, with a mesh file",
                "a mesh that gapbeam builds: the faces of mesh files look down and up",
                "leave file out, and give the section in [beam]",
                (("mesh", "file"),),
            )


def beams_fit_in(beam: Beam, segment: Segments, support: AnySupports) -> Iterator[Fault]:
    """The straight beam fits in a support around it."""
    for key, one in _around(support):
        radius = 0.5 * _within(beam, segment, one).thickness
        if any(one.region.faults(key, radius)):
            continue
        (face,) = one.faces
        if (one.offset or one.lateral) and face.smallest < 0.0:
            moved = "offset" if abs(one.offset) >= abs(one.lateral) else "lateral"
            yield Fault(
                (*key[:-1], moved),
                f"{getattr(one, moved):g} m, with which the straight beam is {-face.smallest:.3g} m in the wall",
                "a support that the straight beam fits in",
                f"a smaller {moved}, or a larger clearance",
                ((*key[:-1], "clearance"),),
            )


def planes_are_not_moved_aside(support: AnySupports) -> Iterator[Fault]:
    """A plane below or above the beam is the same wherever it is moved sideways."""
    for key, one in keyed(support):
        if one.lateral and not one.around:
            yield Fault(
                (*key, "lateral"),
                f"{one.lateral:g} m, for a {one.region.type}",
                "no lateral offset: planes across the bending direction are the same everywhere along y",
                'leave it out; region = "hole" and "polygon" hold the beam sideways',
                ((*key, "region"),),
            )


def holes_are_met_along_radii(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """The stress at the points around a section is not known along its radii."""
    for key, one in _around(support):
        if contact.formulation.stress_terms is not None:
            yield Fault(
                ("contact", "formulation"),
                f"{contact.formulation.type}, with a {one.region.type}",
                "a formulation without the stress at the contact points",
                'formulation = "penalty"',
                (key,),
            )
        return


def figures_are_of_one_kind(support: AnySupports) -> Iterator[Fault]:
    """A figure belongs to the whole support, or is per area."""
    for key, one in keyed(support):
        for name in WHOLE:
            per_area = name.removeprefix("support_")
            if getattr(one, name) is not None and getattr(one, per_area) is not None:
                yield Fault(
                    (*key, name),
                    f"{getattr(one, name):g}, together with {per_area} = {getattr(one, per_area):g}",
                    f"one of the two: {name} belongs to the whole support, {per_area} is per area",
                    f"leave {per_area} out",
                    ((*key, per_area),),
                )
        if one.support_damping is not None and one.support_stiffness is None:
            yield Fault(
                (*key, "support_damping"),
                f"{one.support_damping:g} N s/m, without support_stiffness",
                "both for the whole support, or stiffness and damping per area",
                "support_stiffness = 1e6, N/m",
            )


def whole_supports_touch_at_once(support: AnySupports) -> Iterator[Fault]:
    """A region is met along lines or areas that do not grow with the penetration."""
    for key, one in keyed(support):
        if one.support_stiffness is None or one.region.touches_at_once:
            continue
        circle = ', or contact = "circle"' if one.region.type == "hole" else ""
        yield Fault(
            (*key, "support_stiffness"),
            f"{one.support_stiffness:g}, with points around the section in a {one.region.type}",
            f"a slot, a stop, a polygon or a hole that is met as a circle{circle}: points around a section touch one "
            "after the other, and no one stiffness is that of all",
            'contact = "circle" in the region' if circle else "stiffness, per area",
            ((*key, "region"),),
        )


def yield_forces_are_of_whole_supports(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """A law that yields at a force acts at supports whose stiffness belongs to the whole support."""
    for key, one in keyed(support):
        law = law_at(contact, one)
        if isinstance(law, ElasticPlastic) and law.yield_force is not None and one.support_stiffness is None:
            where = ("contact", "law") if own_law(one) is None else (*key, "law")
            yield Fault(
                (*where, "yield_force"),
                f"{law.yield_force:g} N, at the support {one.name} without support_stiffness",
                "support_stiffness at every support where the law acts, or yield_pressure",
                f"support_stiffness = 1e6 in [[support]] {one.name}, N/m",
                (key,),
            )


DEEPEST = 0.5  # of the thickness: the largest interference


def _moving(support: AnySupports, load: Loads) -> Iterator[tuple[Key, Load, SupportWalls, OneSupport]]:
    """Yield the loads that move a support that is there, each with its key, place and support."""
    layout = Layout.of(support)
    for number, entry in load.items():
        if isinstance(entry.place, SupportWalls) and (moved := moved_by(entry.place, layout)) is not None:
            yield ("load", number), entry, entry.place, moved


def moved_supports_are_there(support: AnySupports, load: Loads) -> Iterator[Fault]:
    """A motion names the support that it moves."""
    layout = Layout.of(support)
    if not layout.supports:  # which another check reports
        return
    names = either([one.name for one in layout.supports])
    for number, entry in load.items():
        place = entry.place
        if not isinstance(place, SupportWalls) or moved_by(place, layout) is not None:
            continue
        if place.support is None:
            yield Fault(
                ("load", number, "type"),
                f"{entry.type} without the key support, in a case of {counted(len(layout.supports), 'support')}",
                f"the name of the support that moves, {names}",
                f'support = "{layout.supports[0].name}"; base_motion moves all of them',
                (("support",),),
            )
        else:
            yield Fault(("load", number, "support"), f'"{place.support}"', f"{names}", "", (("support",),))


def motions_reach_the_beam(support: AnySupports, load: Loads, mesh: Mesh) -> Iterator[Fault]:
    """A motion changes gaps across the beam, and sideways only in supports around it."""
    for key, entry, place, moved in _moving(support, load):
        along = entry.direction
        if place.opens or along is None or len(along) != mesh.dimension:
            continue
        if along[0] != 0.0:
            yield Fault(
                (*key, "direction"),
                f"{list(along)}, with a part along the beam",
                "a direction across the beam: a support that moves along it changes no gap",
                "leave direction out for a motion upward",
                ((*key, "support"),),
            )
        elif len(along) == 3 and along[1] != 0.0 and not moved.around:
            yield Fault(
                (*key, "direction"),
                f"{list(along)}, of the {moved.region.type} {moved.name}",
                "no part sideways: planes across the bending direction are the same everywhere along y",
                'direction = [0.0, 0.0, 1.0]; a region "hole" holds the beam sideways, too',
                ((*key, "support"),),
            )


def moving_supports_do_not_rub_around(support: AnySupports, load: Loads, contact: Contact) -> Iterator[Fault]:
    """A support around the beam that moves as it is slides on it, which friction does not know."""
    for key, entry, place, moved in _moving(support, load):
        rubs = contact.usual_friction.at_support(moved.friction, None)[0] > 0.0
        if not place.opens and moved.around and rubs:
            yield Fault(
                (*key, "type"),
                f"{entry.type} of the {moved.region.type} {moved.name}, with friction",
                "no friction there: the slip of walls that move around the beam is not followed",
                f"friction = 0.0 in [[support]] {moved.name}",
                (("contact", "friction"),),
            )


def moving_supports_are_marched(support: AnySupports, load: Loads, analysis: Transient | Periodic) -> Iterator[Fault]:
    """Nothing but marches knows walls that move."""
    if not isinstance(analysis, Periodic):
        return
    for key, entry, _, moved in _moving(support, load):
        yield Fault(
            ("analysis", "type"),
            f'"periodic", with {entry.type} of the support {moved.name}',
            "supports that stay where they are: no period is sought with walls that move",
            'type = "transient"; a base_motion, which moves all supports alike, may be periodic',
            ((*key, "type"),),
        )


def closures_leave_a_beam(beam: Beam, support: AnySupports, load: Loads) -> Iterator[Fault]:
    """A support that closes leaves at least half of the section that it squeezes, as one that does not move."""
    for key, entry, place, moved in _moving(support, load):
        if not place.opens:
            continue
        limit = -DEEPEST * beam.thickness * (0.5 if moved.around else 1.0)
        narrow = moved.clearance + entry.travel[0]
        if exceeds(limit, narrow):
            found, most = apart(-narrow, -limit)
            yield Fault(
                (*key, "changes"),
                f"{narrow - moved.clearance:g} m, which makes an interference of {found} m",
                f"an interference of at most {most} m in all",
                f"is it in mm? In m it is {(narrow - moved.clearance) / 1000:g}",
                (("beam", "thickness"),),
            )


def bodies_need_few_dofs(support: AnySupports, model: ModelTable) -> Iterator[Fault]:
    """Motions of supports are unknowns in addition to a basis, or to beam elements."""
    if not isinstance(model, FullModel):
        return
    for key, one in keyed(support):
        if one.body is not None:
            yield Fault(
                (*key, "body"),
                f"a body of {one.body.mass:g} kg, with the model full, whose unknowns are those of the mesh alone",
                "a reduced, beam or rigid model, which takes the motion of a support among its unknowns",
                'type = "reduced" in [model]',
                (("model", "type"),),
            )


def bodies_start_in_a_run(support: AnySupports, analysis: Analysis) -> Iterator[Fault]:
    """A body starts by itself in a march, and at its own rest where it does not start at the seat."""
    for key, one in keyed(support):
        if one.body is None or not one.body.moved:
            continue
        name = "displacement" if one.body.displacement != 0.0 else "velocity"
        if not isinstance(analysis, Transient):
            yield Fault(
                (*key, "body", name),
                f"{getattr(one.body, name)}, in the search for a periodic response",
                "no start: a periodic response has none",
                f"leave {name} out",
                (("analysis", "type"),),
            )
        elif one.body.displacement == "rest" and (analysis.state is not None or analysis.start == "seat"):
            yield Fault(
                (*key, "body", "displacement"),
                '"rest", in a run that starts ' + ("from a state" if analysis.state is not None else "at the seat"),
                "a number: beam and body start where they stand together",
                'start = "undeformed" in [analysis]',
                (("analysis", "state" if analysis.state is not None else "start"),),
            )


def bodies_stand_on_the_frame(support: AnySupports, load: Loads) -> Iterator[Fault]:
    """A flexible support moves by its contact forces, and not as a function of time."""
    layout = Layout.of(support)
    for number, entry in load.items():
        place = entry.place
        if not isinstance(place, SupportWalls) or place.opens:
            continue
        moved = moved_by(place, layout)
        if moved is not None and moved.body is not None:
            yield Fault(
                ("load", number, "type"),
                f"{entry.type} of the support {moved.name}, which has a body",
                "a support without body: the motion of this one follows from its mass, spring and damper",
                "base_motion moves the feet of all springs alike; leave body out for a prescribed motion",
                (("support",),),
            )
