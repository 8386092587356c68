"""Contradictions between [wear] and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.contact_table import Contact, Wear
from gapbeam.solver.errors import Fault
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.supports.layout import Layout, keyed
from gapbeam.solver.supports.support_tables import AnySupports

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


WEAR_CHECKS = (
    depth_limits_have_an_area,
    local_growth_has_areas_of_its_own,
    wear_has_its_coefficients,
    wear_fits_the_formulation,
    moving_supports_do_not_wear_around,
)
"""The checks of `[wear]` and of the wear of supports."""
