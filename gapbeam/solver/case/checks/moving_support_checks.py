"""Contradictions between supports that move in time and the rest of a case."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.analysis_table import Periodic, Transient
from gapbeam.solver.case.case import Beam, Mesh
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.faults import Fault, Key
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.loads.places import SupportWalls
from gapbeam.solver.loads.support_walls import moved_by
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport
from gapbeam.solver.wording.short_words import apart, either, exceeds

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
                f"{entry.type} without the key support, in a case of {len(layout.supports)} supports",
                f"the name of the support that moves, {names}",
                f'support = "{layout.supports[0].name}"; base_motion moves all of them',
                (("support",),),
            )
        else:
            yield Fault(("load", number, "support"), f'"{place.support}"', f"{names}", "", (("support",),))


def motions_reach_the_beam(support: AnySupports, load: Loads, mesh: Mesh) -> Iterator[Fault]:
    """A motion changes gaps: across the beam, and sideways only of what is met around it."""
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
        if not place.opens and moved.around and contact.rubs is not None and moved.friction != 0.0:
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
