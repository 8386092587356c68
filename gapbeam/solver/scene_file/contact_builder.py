"""Contacts of a file of several structures: pairs of points and of faces, and snubbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gapbeam.solver.loads.time_function import TimeFunction
from gapbeam.solver.messages.errors import Key, UserError
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.face_pair import face_contacts
from gapbeam.solver.scene.snubber import snubber
from gapbeam.solver.scene_file.pair_tables import (
    HalfPlaneRegion,
    LinearLaw,
    PairTable,
    at_nearest,
    meeting_faults,
    pair_faults,
)
from gapbeam.solver.scene_file.scene_site import Site, fault_of
from gapbeam.solver.scene_file.structure_tables import SnubberJoint
from gapbeam.solver.system.operators import Array


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
    return Contact(
        between, region, pair.law.made(), friction=pair.friction, sliding=pair.sliding, offset=pair.offset,
        name=pair.name,
    )  # fmt: skip


def face_pair(site: Site, number: int, pair: PairTable) -> list[Contact]:
    """Return the contacts of a pair of faces, whose points their structures get."""
    ends = [(site.bodies[owner], face) for owner, _, face in (place.partition(".") for place in pair.between)]
    assert isinstance(pair.law, LinearLaw)
    assert isinstance(pair.region, HalfPlaneRegion | None)
    clearance = None if pair.region is None else pair.region.clearance
    try:
        found = face_contacts(
            ends[0], ends[1], pair.law.stiffness, damping=pair.law.damping, clearance=clearance,
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


Motions = list[tuple[Array, TimeFunction]]
"""Unit vectors in the motions of a point, each with its displacement over time."""


def on_moving_walls(contact: Contact, motions: Motions) -> Contact:
    """Return a contact whose side on the frame moves, counted from t = 0."""

    def wall(t: float) -> Array:
        return np.asarray(sum(unit * (float(s.value(t)) - float(s.value(0.0))) for unit, s in motions))

    return replace(contact, wall=wall) if motions else contact
