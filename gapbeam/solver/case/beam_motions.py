"""Motions of a beam model that its case calls for, each with the reason, and restraints of the others.

A beam always bends in its bending plane. It bends across that plane where a hole, a load or its start moves it there.
It moves along its axis where something pushes, pulls or rubs there, or its start does. It twists where a force passes
beside its axis, or something turns with it. What a joint holds needs no motion: a motion that the model has not is
held everywhere.

Weak springs act on motions that nothing else may hold, too soft to change the results.

A motion that joints hold has none. Otherwise a spring is a share of the beam's own stiffness along its axis,

    k = 1e-6 (E A / L),    at most (2 pi 0.1 f)^2 m

with f of `overhang_frequency` and the mass m of the beam. The axial springs act on the faces, at h/2 from the axis, so
that they resist pitch as well: there the limit is what turns the beam back, in its play and by the tilt and offset of
its supports, with 1e-4 of the moment M of the loads,

    k (h/2)^2 a <= 1e-4 M,    a = largest clearance / length of a support + tilt + difference of offsets / reach,

but 1e-11 E A / L at least, which round-off does not hide. Friction holds the beam as well: then 1e-11 E A / L is left
for what is at rest, and sliding and rolling do not feel it; unless the seat, which knows no friction, needs more.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import inf, pi
from typing import Literal

import numpy as np

from gapbeam.solver.case.analysis_table import Analysis
from gapbeam.solver.case.case import Case, Contact, Mesh, acting_friction
from gapbeam.solver.case.computed_defaults import Default, overhang_frequency, support_reaction
from gapbeam.solver.case.solution_tables import BeamModel, BeamMotion
from gapbeam.solver.loads.attachments import (
    IN_PLANE,
    OUT_OF_PLANE,
    SIDEWAYS,
    Joint,
    MotionName,
    PointMass,
    bending_rank,
    holds_motion,
)
from gapbeam.solver.loads.load_choice import Load, axis_point
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.support_tables import AnySupports


def is_symmetric(case: Case) -> bool:
    """Return whether mesh, loads and start are symmetric about the bending plane (3D), as far as the case shows.

    A start along the beam counts as one that is not: of symmetric bodies only those motions are kept that contact or
    loads cause.
    """
    if case.mesh.dimension == 2 or case.mesh.file is not None or case.mesh.cell not in (None, "hexahedron"):
        return False
    if not all(piece.beam.section.mirrored for piece in case.profile.pieces):
        return False
    if case.layout.holes:  # the beam may roll to one side of a hole
        return False
    if case.friction is not None or case.contact.points is not None or case.analysis.moves_aside:
        return False
    if any(mass.away[1] != 0.0 for mass in case.mass):
        return False
    points = [load.place.point for load in case.load]
    directions = [load.direction for load in case.load if load.direction is not None]
    return not any(isinstance(vector, tuple) and len(vector) > 1 and vector[1] != 0.0 for vector in points + directions)


def bends_in_two_planes(case: Case) -> bool:
    """Return whether a hole, or a load or mass off its plane, or a start moves the beam out of its bending plane."""
    return moves_in_space(case.mesh.dimension, case.layout, case.load, case.mass, case.analysis)


def moves_in_space(
    dimension: int, layout: Layout, loads: Iterable[Load], masses: Iterable[PointMass], analysis: Analysis
) -> bool:
    """Return the same by the dimension of the mesh, the supports, the loads, the masses and the start."""
    if dimension == 2:
        return False
    if any(mass.away[1] != 0.0 for mass in masses):
        return True
    starts = not analysis.moves_aside.isdisjoint(SIDEWAYS)
    return starts or bool(layout.holes) or any(bends_sideways(load) for load in loads)


def bends_sideways(load: Load) -> bool:
    """Return whether a load in 3D acts sideways, or along the beam off its bending plane."""
    if load.direction is None:
        return False
    point = load.place.point
    beside = isinstance(point, tuple) and len(point) > 1 and point[1] != 0.0
    return load.direction[1] != 0.0 or (beside and load.direction[0] != 0.0)


SECTION_MOTIONS: Mapping[BeamMotion, tuple[MotionName, ...]] = {
    "bending": ("vertical", "rotation"),
    "lateral": ("lateral", "lateral_rotation"),
    "axial": ("axial",),
    "torsion": ("twist",),
}
"""The motions of a cross-section by each motion of a beam."""


Reasons = dict[BeamMotion, str]
"""Motions with what calls for them, in words."""


def beam_motions(case: Case) -> Reasons:
    """Return the motions of a beam model in the order of `SECTION_MOTIONS`, with the reason for each."""
    needed = needed_motions(case.mesh, case.layout, case.load, case.joint, case.mass, case.contact, case.analysis)
    return with_given(needed, getattr(case.model, "motions", "auto"))


def motions_of_tables(
    mesh: Mesh,
    support: AnySupports,
    load: Mapping[int, Load],
    joint: Mapping[int, Joint],
    mass: Mapping[int, PointMass],
    contact: Contact,
    analysis: Analysis,
) -> Reasons:
    """Return the motions that the tables of a case call for, before they are a case; arguments as in `checks`."""
    tables = tuple(load.values()), tuple(joint.values()), tuple(mass.values())
    return needed_motions(mesh, Layout.of(support), *tables, contact, analysis)


def with_given(needed: Reasons, given: Literal["auto"] | Sequence[BeamMotion]) -> Reasons:
    """Return the motions that a case calls for with those that its model is given, in the order of `SECTION_MOTIONS`.

    Args:
        needed: Motions that the case calls for.
        given: `model.motions`.
    """
    asked: Reasons = {} if given == "auto" else dict.fromkeys(given, "given in the case")
    found = asked | needed
    return {name: found[name] for name in SECTION_MOTIONS if name in found}


def section_motions(case: Case) -> tuple[MotionName, ...]:
    """Return the motions of cross-sections that a beam model has."""
    had = {name for motion in beam_motions(case) for name in SECTION_MOTIONS[motion]}
    return tuple(name for name in (*IN_PLANE, *OUT_OF_PLANE) if name in had)


def motions_in_words(case: Case) -> list[tuple[str, str]]:
    """Return the motions of a beam model besides bending, each with its reason; nothing for other models."""
    if not isinstance(case.model, BeamModel):
        return []
    return [(name, why) for name, why in beam_motions(case).items() if name != "bending"]


def needed_motions(
    mesh: Mesh,
    layout: Layout,
    loads: Sequence[Load],
    joints: Sequence[Joint],
    masses: Sequence[PointMass],
    contact: Contact,
    analysis: Analysis,
) -> Reasons:
    """Return the motions that a case calls for.

    Friction on a beam that leaves its bending plane acts around the section, too, and couples both: a beam that rolls
    moves sideways. A mass above the axis couples bending with the motion along the beam, and lateral bending with
    twist; one beside the bending plane couples all motions.

    Args:
        mesh: A slice or a solid.
        layout: The supports.
        loads: The loads.
        joints: The joints.
        masses: The masses.
        contact: Contact table, with or without friction.
        analysis: Table [analysis] of the case.
    """
    dimension, rubs = mesh.dimension, acting_friction(contact, layout) is not None
    fixtures: list[Joint | PointMass] = [*joints, *masses]
    found: Reasons = {"bending": "every beam bends"}
    along = [*_along(loads), *_attached(fixtures, "axial"), *(["friction acts along the beam"] if rubs else [])]
    if "axial" in analysis.moves_aside:
        along.append("the start moves it along its axis")
    above = [f"the mass {one.name} is above or below the axis" for one in masses if one.away[2] != 0.0]
    beside = [f"the mass {one.name} is beside the bending plane" for one in masses if one.away[1] != 0.0]
    along += [*above, *beside]
    if along:
        found["axial"] = along[0]
    if dimension == 2:
        return found
    if moves_in_space(dimension, layout, loads, masses, analysis):
        found["lateral"] = beside[0] if beside else "a hole, a load or the start moves it across its bending plane"
    elif across := [*_attached(joints, "lateral"), *_attached(joints, "lateral_rotation")]:
        found["lateral"] = across[0]
    twisting = [*_beside(loads), *beside, *_attached(fixtures, "twist")]
    if rubs and "lateral" in found:
        twisting.append("friction acts around the section")
    if "lateral" in found:
        twisting += above
    if "twist" in analysis.moves_aside:
        twisting.append("the start turns it about its axis")
    if twisting:
        found["torsion"] = twisting[0]
        if rubs:
            found.setdefault("lateral", "friction of a section that twists acts sideways")
        if above:
            found.setdefault("lateral", above[0])
    return found


def _along(loads: Sequence[Load]) -> Iterator[str]:
    for load in loads:
        if load.direction is not None and load.direction[0] != 0.0:
            yield f"the load {load.name} acts along the beam"


def _beside(loads: Sequence[Load]) -> Iterator[str]:
    """Yield the loads whose force does not pass through the axis of the beam."""
    for load in loads:
        along = (0.0, 0.0, 1.0) if load.direction is None else load.direction
        if load.place.point is None or len(along) != 3:
            continue
        _, y, z = axis_point(load.place.point)
        if y * along[2] != z * along[1]:
            yield f"the force of the load {load.name} passes beside the axis"


def _attached(fixtures: Sequence[Joint | PointMass], motion: MotionName) -> Iterator[str]:
    """Yield the springs, dampers and rotary inertias on a motion; a mass alone moves along with any."""
    words = {"twist": "twist", "axial": "motion along the beam"}.get(motion, "motion across the bending plane")
    for entry in fixtures:
        for one in entry.attached():
            added = one.attachment
            acts = added.stiffness > 0.0 or added.damping > 0.0 or (one.motion.turns and added.mass > 0.0)
            if one.motion.name == motion and not one.held and acts:
                yield f"{entry.name} has a spring, damper or inertia against {words}"


SHARE = 1.0e-6  # of E A / L
UNDER_FRICTION = 1.0e-11  # of E A / L
LEAST = 1.0e-11  # of E A / L: what round-off leaves of a spring
OF_LOADS = 1.0e-4  # of their moment: what may turn the beam back
OF_FREQUENCY = 0.1  # of the lowest bending frequency: frequency of the rigid beam on the restraint
AXIAL, LATERAL = 0, 1
RANK_OF_A_PLANE = 2


def axial_restraint(case: Case) -> Default:
    """Return the stiffness of the restraint along the beam, N/m: given, computed, or 0 where a joint holds it."""
    return _restraint(case, "axial", holds_motion(case.joint, "axial"), AXIAL)


def lateral_restraint(case: Case) -> Default:
    """Return the stiffness of the restraint across the bending plane, N/m; it keeps from swaying, yaw and twist."""
    held = bending_rank(case.joint, held_only=False, plane=SIDEWAYS) == RANK_OF_A_PLANE
    return _restraint(case, "lateral", held and holds_motion(case.joint, "twist"), LATERAL)


def twist_restraint(case: Case, radius: float) -> float:
    """Return the spring against twist of a round beam in holes, N m/rad: the lateral restraint at its radius, m."""
    return _restraint(case, "lateral", holds_motion(case.joint, "twist"), LATERAL).value * radius * radius


def _restraint(case: Case, name: str, held: bool, axis: int) -> Default:
    key, given = f"restraint.{name}", getattr(case.restraint, name)
    if given != "auto":
        return Default(key, given, "N/m", "given in the case")
    if held:
        return Default(key, 0.0, "N/m", "joints hold the beam")
    profile = case.profile
    own = min(one.material.young_modulus * one.beam.area for one in profile.pieces) / case.beam.length
    if case.friction is not None and not _pulled(case, axis):
        return Default(key, UNDER_FRICTION * own, "N/m", f"{UNDER_FRICTION:g} E A / L: friction holds the beam")
    slow = (2.0 * pi * OF_FREQUENCY * overhang_frequency(case)) ** 2 * profile.mass
    turned = max(_by_pitch(case), LEAST * own) if axis == AXIAL else inf
    if turned < min(slow, SHARE * own):
        return Default(key, turned, "N/m", "the beam pitches in its supports as if it was free")
    if slow < SHARE * own:
        return Default(key, slow, "N/m", f"the rigid beam on it has {OF_FREQUENCY:g} of its lowest bending frequency")
    return Default(key, SHARE * own, "N/m", f"{SHARE:g} E A / L")


def _by_pitch(case: Case) -> float:
    """Return the stiffness along the faces that turns the beam back with a small share of the moment of the loads, N/m.

    It is infinite where there are no loads, or nothing to pitch by.
    """
    layout, supports = case.layout, case.layout.supports
    moment = support_reaction(case) * layout.reach
    aside = sum(np.ptp([getattr(one, key) for one in supports]) for key in ("offset", "lateral")) / layout.reach
    angle = layout.steepest + max(abs(one.tilt) for one in supports) + aside
    lever = 0.5 * max(piece.beam.thickness for piece in case.profile.pieces)
    return OF_LOADS * moment / (lever * lever * angle) if moment > 0.0 and angle > 0.0 else inf


def _pulled(case: Case, axis: int) -> bool:
    """Return whether forces at rest pull the beam along an axis, or turn it, before friction is there."""
    aside = axis == LATERAL and any(one.away[1] != 0.0 for one in case.mass)
    along = (load.direction for load in case.load if load.may_rest and axis < case.mesh.dimension - 1)
    return aside or any(direction is not None and direction[axis] != 0.0 for direction in along)
