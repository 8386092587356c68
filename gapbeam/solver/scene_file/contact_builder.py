"""Contacts of a file of several structures: pairs of points and of faces, and snubbers."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Any

from gapbeam.solver.messages.errors import Fault, Key, UserError
from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.face_pair import face_contacts
from gapbeam.solver.scene.flow_force import FlowSpan
from gapbeam.solver.scene.moving_point import MovingPoint
from gapbeam.solver.scene.snubber import snubber
from gapbeam.solver.scene.structure import Structure, StructurePoint
from gapbeam.solver.scene.structure_files import ImportedModel, PlacedPoint
from gapbeam.solver.scene_file.pair_tables import (
    HalfPlaneRegion,
    PairTable,
    at_nearest,
    meeting_faults,
    pair_faults,
)
from gapbeam.solver.scene_file.placed_bodies import PlacedBody
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.structure_tables import BodyTable, MemberTable, SnubberJoint

STATION = re.compile(r"(clamp|feedback|load|pair|point) \d+: ")  # no name of a point in a file has a blank
SPREAD = re.compile(r"(feedback|load|point) \d+: |clamp \d+: [CM]")  # these get no static responses
HINT = r"(?:; (?P<hint>.*))?$"
MESSAGES = (
    r"(?:.*?: )?found (?P<found>.*?),? expected (?P<expected>.*?)" + HINT,
    r"(?:.*?: )?expected (?P<expected>.*?)[,;] found (?P<found>.*?)" + HINT,
    r"(?P<found>.*?)(?:[,;:] expected (?P<expected>.*?)|; (?P<known>(?:it has|its) .*?))?" + HINT,
)


@dataclass
class Site:
    """Structures and points built so far, with faults; `finer`: so many times the modes and elements asked for.

    `counts` has the times of elements that each beam or frame got.
    """

    case: SceneCase
    finer: int = 1
    counts: dict[str, int] = field(default_factory=dict)
    bodies: dict[str, Structure] = field(default_factory=dict)
    models: dict[str, ImportedModel] = field(default_factory=dict)
    extents: dict[str, PlacedBody] = field(default_factory=dict)
    lengths: dict[str, float] = field(default_factory=dict)
    nearest: dict[str, dict[str, Any]] = field(default_factory=dict)
    places: dict[str, PlacedPoint] = field(default_factory=dict)
    moving: dict[str, MovingPoint] = field(default_factory=dict)
    spans: dict[str, FlowSpan] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)

    def members(self, table: BodyTable) -> list[MemberTable]:
        """Return the branches of a frame."""
        return [one for one in self.case.member if one.structure == table.name]

    def point(self, key: Key, place: str, may_move: bool = False) -> StructurePoint | None:
        """Return a point; None, with a fault, where its structure has none of that name, or it moves and may not."""
        if may_move and place in self.moving:
            return self.moving[place]
        if place in self.moving:
            self.faults.append(Fault(key, f'"{place}", which moves', "a point that stays: pairs and forces may move"))
            return None
        owner, _, name = place.partition(".")
        structure = self.bodies.get(owner)
        if structure is None:
            return None
        if name not in structure.points:
            known = ", ".join(f"{owner}.{one}" for one in structure.points if not STATION.match(one)) or "none"
            self.faults.append(Fault(key, f'"{place}", which is no point', f"one of {known}"))
            return None
        return structure[name]


def fault_of(key: Key, error: Exception) -> Fault:
    """Return an error as a fault: found, expected, advice."""
    words = " ".join(str(error).split("\n"))
    parts = next(found.groupdict() for form in MESSAGES if (found := re.match(form, words)) is not None)
    expected = parts["expected"] or parts.get("known") or "values that go together"
    return Fault(key, parts["found"], expected, parts["hint"] or "")


def at_points(site: Site, number: int, pair: PairTable) -> PairTable:
    """Return a pair at named points; nearest places become points."""
    if pair.at != "nearest" or any(name not in site.extents for name in pair.between):
        return pair
    try:
        found, points = at_nearest(pair, site.extents)
    except UserError as error:
        site.faults.append(fault_of(("pair", number, "between"), error))
        return pair
    for name, given in points.items():
        site.nearest.setdefault(name, {}).update(given)
    return found


def point_contact(site: Site, number: int, pair: PairTable) -> Contact | None:
    """Return the contact of a pair of points; None, with faults, where it cannot be meant."""
    key: Key = ("pair", number)
    ends = [site.point((*key, "between"), place, may_move=True) for place in pair.between]
    known = [end for end in ends if end is not None]
    if len(known) < len(ends):
        return None
    try:
        assert pair.region is not None
        region = pair.region.made()
    except UserError as error:
        site.faults.append(fault_of((*key, "region"), error))
        return None
    places = [site.places.get(place) for place in pair.between]
    faults = pair_faults(key, pair, known, region, places)
    owners = [place.partition(".")[0] for place in pair.between]
    faults = faults or list(meeting_faults(key, pair, places, [site.extents.get(owner) for owner in owners]))
    site.faults += faults
    if faults:
        return None
    assert pair.law is not None
    between = known[0] if len(known) == 1 else (known[0], known[1])
    try:
        return Contact(
            between, region, pair.law.made(), friction=pair.friction, sliding=pair.sliding, offset=pair.offset,
            name=pair.name,
        )  # fmt: skip
    except UserError as error:
        site.faults.append(fault_of((*key, error.argument if isinstance(error, ArgumentError) else "law"), error))
        return None


def face_pair(site: Site, number: int, pair: PairTable) -> list[Contact]:
    """Return the contacts of a pair of faces, whose points their structures get."""
    ends = [(site.bodies[owner], face) for owner, _, face in (place.partition(".") for place in pair.between)]
    assert pair.law is not None
    assert isinstance(pair.region, HalfPlaneRegion | None)
    clearance = None if pair.region is None else pair.region.clearance
    try:
        found = face_contacts(
            ends[0], ends[1], pair.law.made(), clearance=clearance,
            friction=pair.friction or 0.0, sliding=pair.sliding or 0.0, name=pair.name,
        )  # fmt: skip
    except UserError as error:
        site.faults.append(fault_of(("pair", number, "between"), error))
        return []
    for one in found:
        for point in one.points:
            point.structure.points[f"pair {number}: {one.name}"] = point
    return found


def condensed_face(site: Site, number: int, one: Contact) -> Contact:
    """Return a contact of faces between the structures as they are marched."""
    points = ((site.bodies[point.structure.name][f"pair {number}: {one.name}"], point.name) for point in one.points)
    first, second = (replace(point, name=face) for point, face in points)
    return replace(one, between=(first, second))


def snubber_of(site: Site, number: int, joint: SnubberJoint) -> Contact | None:
    """Return a snubber; None, with a fault, where it cannot be made."""
    ends = [one for place in joint.between if (one := site.point(("joint", number, "between"), place)) is not None]
    if len(ends) < len(joint.between):
        return None
    try:
        return snubber(
            ends[0] if len(ends) == 1 else (ends[0], ends[1]),
            **joint.model_dump(exclude={"type", "between"}),
        )
    except UserError as error:
        site.faults.append(fault_of(("joint", number, "between"), error))
        return None
