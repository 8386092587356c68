"""Contradictions between round holes that are met as circles and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

from gapbeam.solver.case.analysis_table import Analysis, Periodic
from gapbeam.solver.case.case import Contact, Wear, advised_scheme, law_at
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.solution_tables import FullModel, ModelTable, Time
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.supports.layout import Layout, keyed
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport

POINTS = 'contact = "points" in the region of the support'
PER_AREA = "stiffness, per area, instead of support_stiffness, which has a round hole met as a circle"


class _Circle(NamedTuple):
    """Support that is met as a circle: its key, the key of the choice, and the advice to choose points."""

    support: Key
    key: Key
    one: OneSupport
    points: str


def _circles(support: AnySupports) -> Iterator[_Circle]:
    """Yield the supports that are met as circles."""
    for key, one in keyed(support):
        if any(face.circle for face in one.faces):
            whole = one.support_stiffness is not None
            chosen = (*key, "support_stiffness") if whole else (*key, "region", "contact")
            both = f"{POINTS}, and {PER_AREA}" if one.met_region is one.region else PER_AREA
            yield _Circle(key, chosen, one, both if whole else POINTS)


def _beside_a_circle(support: AnySupports, key: Key, found: str, expected: str, advice: str) -> Iterator[Fault]:
    """Yield the fault of a value that does not go with holes that are met as circles, with the first of them."""
    for _, circle, _, points in islice(_circles(support), 1):
        yield Fault(key, f"{found}, with a hole that is met as a circle", expected, f"{advice}, or {points}", (circle,))


def circles_are_round(support: AnySupports, model: ModelTable) -> Iterator[Fault]:
    """A circle stays one where the section keeps its shape; with the stiffness of the whole, its mean motion is met."""
    for _, key, one, points in _circles(support):
        whole = one.support_stiffness is not None
        if model.keeps_sections or (whole and not isinstance(model, FullModel)):
            continue
        kept = "reduced" if whole else 'reduced" with sections = "rigid'
        yield Fault(
            key,
            f"circle, with the model {model.type}, whose sections deform",
            f'a model of type "beam", "rigid", or "{kept}"',
            f'type = "{kept}" in [model], or {points}',
            (("model", "type"),),
        )
        return


def circles_leave_play(support: AnySupports) -> Iterator[Fault]:
    """The direction of contact is that from the middle of the hole to the axis, which stand apart."""
    for place, key, one, points in _circles(support):
        if one.clearance <= 0.0:
            yield Fault(
                key,
                f"circle, with a clearance of {one.clearance:g} m",
                "a clearance above 0: a section that is squeezed all around has no direction of contact",
                points,
                ((*place, "clearance"),),
            )


def circles_have_a_midpoint_rule(support: AnySupports, time: Time, contact: Contact) -> Iterator[Fault]:
    """The directions of a step are those between its ends, which its law takes as they are."""
    scheme, formulation = time.scheme, contact.formulation.type
    if not scheme.has_period_map:
        expected = "discrete-gradient or implicit-midpoint: a step with one direction of contact"
        advice = f'scheme = "{advised_scheme(contact)}"'
        yield from _beside_a_circle(support, ("time", "scheme"), scheme.type, expected, advice)
    if formulation != "penalty":
        key = ("contact", "formulation")
        yield from _beside_a_circle(support, key, formulation, "penalty", 'formulation = "penalty"')


def circles_do_not_yield(support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """A plastic set belongs to one direction; circles are met in all."""
    for place, key, one, points in _circles(support):
        law = law_at(contact, one)
        usual, own = contact.usual_friction, one.static_friction is not None
        sliding, sticking = usual.at_support(one.friction, one.static_friction)
        if law.keeps_set:
            yield Fault(
                key,
                f"circle, with the law {law.type}, which keeps what has yielded",
                "a law without memory: the contact of a circle turns around it",
                points,
                (("contact", "law"),),
            )
        elif sliding > 0.0 and (own or (one.friction is None and usual.static_coefficient is not None)):
            static = (*place, "static_friction") if own else ("contact", "friction", "static_coefficient")
            yield Fault(
                static,
                f"{sticking:g}, with a hole that is met as a circle",
                "one coefficient: the contact of a circle turns around it and never sticks to a point",
                f"leave {static[-1]} out, or {points}",
                (key,),
            )


def circles_do_not_give_way(support: AnySupports) -> Iterator[Fault]:
    """Walls with a mass are those of contact points whose directions stay."""
    for place, key, one, points in _circles(support):
        if one.body is not None:
            yield Fault(
                key,
                "circle, of a support with a body of its own",
                "holes that stand still or move as loads say",
                points,
                ((*place, "body"),),
            )


def circles_stay_open(support: AnySupports, load: Loads) -> Iterator[Fault]:
    """A hole that closes in time leaves play, as one that does not."""
    layout = Layout.of(support)
    circles = {circle.one.name: circle for circle in _circles(support)}
    for number, entry in load.items():
        if isinstance(entry.place, SupportWalls) and entry.place.opens:
            moved = moved_by(entry.place, layout)
            if (
                moved is not None
                and moved.name in circles
                and moved.clearance + entry.travel[0] <= 0.0 < moved.clearance
            ):
                yield Fault(
                    ("load", number, "changes"),
                    f"{entry.travel[0]:g} m, which leaves no play in {moved.name}, a hole that is met as a circle",
                    f"changes above {-moved.clearance:g} m: a section that is squeezed all around has no direction of "
                    "contact",
                    circles[moved.name].points,
                    (circles[moved.name].key,),
                )


def circles_wear_evenly(support: AnySupports, wear: Wear | None) -> Iterator[Fault]:
    """Wear by points needs points around the section."""
    if wear is not None and wear.growth == "local":
        expected = "even: a circle has no points around it whose depths could differ"
        yield from _beside_a_circle(support, ("wear", "growth"), "local", expected, 'growth = "even"')


def circles_are_shot_at(support: AnySupports, analysis: Analysis) -> Iterator[Fault]:
    """Harmonics balance the forces of points whose directions stay."""
    if isinstance(analysis, Periodic) and analysis.method == "harmonic-balance":
        key = ("analysis", "method")
        yield from _beside_a_circle(support, key, analysis.method, "shooting", 'method = "shooting"')
