"""Escape: a rigid motion that nothing opposes, and along which the static loads do work.

`unopposed_motion` finds it among the rigid motions R, (n, k), that are all but free of stiffness: F = R^T f are the
loads along them, and G R what they open. Stations in round holes bar motions across the beam: a hole is closed in all
directions. Where there is none the beam has a seat; else the potential energy falls without end along the motion.

Translations are scaled by 1 and rotations by one over the length of the beam, so that c is dimensionless. A motion
counts as free where its stiffness would stop the loads only beyond a length of the beam: the weak restraint resists
a beam that tips by the lever of half its thickness.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from gapbeam.solver.case.analysis_table import NAMES, RigidMotion, unit_motions
from gapbeam.solver.contact.solve.unopposed_motion import unopposed_motion
from gapbeam.solver.loads.attachments import MotionName
from gapbeam.solver.models.body import Body, rigid_parts
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem

AWAY = 1.0  # lengths of the beam: what would move farther before its stiffness stops it is free
STRAIGHT = 1.0e-2  # of the largest component: less is not worth words
BESIDE = 0.1  # of the rise of its end: an axis that moves lengthwise by less tips, about an edge of its section


@dataclass(frozen=True)
class RigidMotions:
    """The rigid motions of the beam that its joints allow, on the DOFs of a system.

    Attributes:
        shapes: R^T, scaled, (k, n).
        motions: The same motions, as names and sizes.
        length: Length of the beam, m.
    """

    shapes: Array
    motions: tuple[RigidMotion, ...]
    length: float

    @classmethod
    def of_body(cls, body: Body, size: int) -> RigidMotions:
        """Return the rigid motions of a body, on DOFs of which those of supports with a mass come last. Collective."""
        length = body.case.beam.length
        shapes, motions = list[Array](), list[RigidMotion]()
        for unit in unit_motions():
            motion = _combined((unit,), np.array([1.0 if any(unit.translation) else 1.0 / length]))
            for part in rigid_parts(body, motion):
                if np.any(part):
                    shapes.append(part)
                    motions.append(motion)
        padded = np.zeros((len(shapes), size))
        for row, part in zip(padded, shapes, strict=True):
            row[: len(part)] = part
        holds = [one.motion for joint in body.case.joint for one in joint.attached() if one.held]
        if not holds:
            return cls(padded, tuple(motions), length)
        held = [[motion.section(one.x)[one.name] for motion in motions] for one in holds]
        left = null_space(np.array(held)).T
        return cls(left @ padded, tuple(_combined(motions, row) for row in left), length)


@dataclass(frozen=True)
class Escape:
    """A rigid motion that nothing opposes.

    Attributes:
        motion: The motion; the largest displacement of the axis, or of twist times length, is about 1 m.
        work: Work of the static loads along it, J.
        length: Length of the beam, m.
    """

    motion: RigidMotion
    work: float
    length: float

    @property
    def words(self) -> str:
        """The motion in words: a beam tips about a place, moves along a direction, or moves its ends."""
        here, there = self.motion.section(0.0), self.motion.section(self.length)
        largest = max(abs(end[name]) for end in (here, there) for name in ("axial", "lateral", "vertical"))
        twist = here["twist"] * self.length
        ends = [_vector(end, largest) for end in (here, there)]
        if abs(twist) > max(largest, STRAIGHT):
            return "turns it about its own axis"
        if ends[0] == ends[1]:
            return f"moves it along [{', '.join(f'{value:.3g}' for value in ends[0])}]"
        place = _pivot(self.motion, self.length)
        if place is not None:
            down = self.length if there["vertical"] < here["vertical"] else 0.0
            return f"tips it about x = {place:.4g} m, with its end at x = {down:.4g} m down"
        if all(end[:2] == (0.0, 0.0) and end[2] >= 0.0 for end in ends):
            return "lifts it"
        first, last = (f"[{', '.join(f'{value:.3g}' for value in end)}]" for end in ends)
        return f"moves its ends at x = 0 and x = {self.length:.4g} m in the ratio {first} to {last}"


def find_escape(system: SemiDiscreteSystem, force: Array, rigid: RigidMotions) -> Escape | None:
    """Return a rigid motion that nothing opposes and along which the static loads do work; None: there is none.

    Args:
        system: The system.
        force: The static loads f, (n,), N.
        rigid: Its rigid motions.

    Collective.
    """
    operators, contact, count = system.operators, system.contact, len(rigid.shapes)
    if count == 0:
        return None
    stiff = [operators.apply_stiffness(shape) for shape in rigid.shapes]
    products = system.dots([(x, y) for x in rigid.shapes for y in (*stiff, force)]).reshape(count, count + 1)
    stiffness, forces = 0.5 * (products[:, :count] + products[:, :count].T), products[:, count]
    largest = float(np.max(np.abs(forces)))
    if largest == 0.0:
        return None
    squares, turned = np.linalg.eigh(stiffness)
    free = turned[:, squares <= largest / (AWAY * rigid.length)]
    if free.shape[1] == 0:
        return None
    values = np.column_stack([contact.interface.trace(shape, operators) for shape in rigid.shapes]) @ free
    matrix = contact.gap_matrix if contact.geometry_matrix is None else contact.geometry_matrix
    planes = np.ones(contact.size, dtype=bool)
    planes[contact.circles.points] = False
    opened = np.unique(np.round(np.asarray(matrix @ values)[planes], 14), axis=0)
    found = unopposed_motion((forces @ free) / largest, opened, free, np.asarray(contact.circles.plane @ values))
    if found is None:
        return None
    sizes = free @ found
    return Escape(_combined(rigid.motions, sizes), float(forces @ sizes), rigid.length)


def _combined(motions: Sequence[RigidMotion], sizes: Array) -> RigidMotion:
    """Return the sum of motions times sizes."""
    translation, rotation = (
        sizes @ np.array([getattr(one, part) for one in motions]) for part in ("translation", "rotation")
    )
    return RigidMotion(tuple(map(float, translation)), tuple(map(float, rotation)))  # type: ignore[arg-type]


def _vector(section: Mapping[MotionName, float], largest: float) -> tuple[float, ...]:
    """Return the displacement of a section over the largest one, rounded."""
    sizes = (section[name] / largest if largest > 0.0 else 0.0 for name in NAMES[:3])
    return tuple(0.0 if abs(size) <= STRAIGHT else round(size, 6) for size in sizes)


def _pivot(motion: RigidMotion, length: float) -> float | None:
    """Return the fixed place of the axis, m, as it turns in the bending plane about a place of the beam; else None."""
    here, there = motion.section(0.0), motion.section(length)
    along, aside = (max(abs(end[name]) for end in (here, there)) for name in ("axial", "lateral"))
    rise = abs(there["vertical"] - here["vertical"])
    if along > BESIDE * rise or aside > STRAIGHT * rise or rise == 0.0:
        return None
    place = here["vertical"] / (here["vertical"] - there["vertical"]) * length
    return place if -1.0e-6 * length <= place <= (1.0 + 1.0e-6) * length else None
