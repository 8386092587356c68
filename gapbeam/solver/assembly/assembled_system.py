"""Assembled system: a beam under its loads, with attached masses, springs, dampers, joints and fluids.

An exciter pulls with s(t) + preload along its direction e at a point x_p, and moves with the beam there. With
b = N(x_p)^T e,

    M = M_beam + m b b^T,    K = K_beam + k b b^T,    C = c_M M_beam + c_K K_beam + c b b^T,

since Rayleigh damping belongs to the beam alone: its share of the attachment is subtracted from the dashpot,
c' = c - c_M m - c_K k. The suspension stands on the frame of the support. Base motion a_b(t) along e_b therefore
pushes the moving mass too, by -m (e . e_b) b a_b; gravity does not: the suspension carries its weight.

Joints and masses add the same to the mean motions of cross-sections, b being those (`assembly.section_rows`); gravity
acts on masses. Fluid is fixed to the sections at its Gauss points; gravity and base motion act on the mass that the
beam displaces, upside down (`attachments.attachment_tables`). What joints hold is in the operators already
(`attached_motions`).

A motion that a joint holds has no DOF in a reduced, beam or rigid model (`models.reduction.projection`). In a full
model a spring in K holds the motion: 1e4 E A / h, or 1e4 E A h for a rotation, far stiffer than a section of
thickness h.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gapbeam.solver.case.beam_motions import is_symmetric, section_motions, twist_restraint
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import BeamModel, FullModel
from gapbeam.solver.loads.attachments import IN_PLANE, OUT_OF_PLANE, Attached, MeanMotion, MotionName
from gapbeam.solver.loads.load_choice import Load, load_direction
from gapbeam.solver.loads.places import (
    Attachment,
    BodyForce,
    LineForce,
    PointForce,
    SupportAcceleration,
    SupportWalls,
    patterned,
)
from gapbeam.solver.loads.support_walls import make_loads
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Operators, RankOnes
from gapbeam.solver.system.rank_one_update import attached
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem

HARD = 1.0e4  # times the stiffness of a section over its thickness


def attached_motions(case: Case) -> tuple[Attached, ...]:
    """Return the contributions of joints, masses and fluids to the motions that the model of a case has."""
    motions = model_motions(case)
    entries = (*case.joint, *case.mass, *case.fluid)
    found = tuple(one for entry in entries for one in entry.attached() if one.motion.name in motions)
    return (*found, *(one for one in roll_springs(case) if one.motion.name in motions))


def in_stiffness(case: Case, one: Attached) -> bool:
    """Return whether the stiffness of a body includes a part: joints and the restraint of a mesh."""
    return one.held or (one.restrains and isinstance(case.model, FullModel))


def roll_springs(case: Case) -> tuple[Attached, ...]:
    """Return the weak spring that keeps a round beam in holes from rotating about its axis; nothing without holes.

    It replaces the lateral restraint, which would pull the beam to the middle of a hole: that stiffness
    at the radius of the beam.
    """
    holes = case.layout.holes
    if not holes:
        return ()
    place = 0.5 * (holes[0].start + holes[0].end)
    stiffness = twist_restraint(case, 0.5 * case.profile.at(place).beam.thickness)
    if stiffness == 0.0:
        return ()
    spring = Attachment(0.0, stiffness, 0.0)
    return (Attached(MeanMotion(place, "twist"), spring, restrains=True),)


def model_motions(case: Case) -> tuple[MotionName, ...]:
    """Return the motions of cross-sections that a model has: those of a beam model, all in the plane, or all."""
    if isinstance(case.model, BeamModel):
        return section_motions(case)
    if case.mesh.dimension == 2 or (not isinstance(case.model, FullModel) and is_symmetric(case)):
        return IN_PLANE
    return (*IN_PLANE, *OUT_OF_PLANE)


def attached_rows(case: Case, patterns: Sequence[Array]) -> list[tuple[Attached, Array]]:
    """Return the contributions of joints, masses and fluids with the rows of their motions, (n,).

    The rows stand behind the patterns of loads.

    Args:
        case: The case.
        patterns: Forces of its loads, and after them the rows of `attached_motions`.
    """
    return list(zip(attached_motions(case), patterns[len(patterned(case.load)) :], strict=True))


def acting_rows(case: Case, patterns: Sequence[Array]) -> list[Array]:
    """Return the rows that a basis has a static shape for: those of loads, and of attachments at one place.

    Args:
        case: The case.
        patterns: As in `attached_rows`.
    """
    parts = zip(patterned(case.load), patterns, strict=False)
    of_loads = [row for (_, part), row in parts if not isinstance(part.place, SupportWalls | LineForce)]
    return [*of_loads, *(row for one, row in attached_rows(case, patterns) if not one.spread)]


def holding_springs(case: Case, patterns: Sequence[Array], *, restraining: bool) -> RankOnes | None:
    """Return the springs that stand for holds in a full model, or those that restrain it; None without any.

    Args:
        case: The case.
        patterns: As in `attached_rows`.
        restraining: Whether the springs are those that restrain the model, not those for holds.
    """
    rows, stiffness = list[Array](), list[float]()
    for one, row in attached_rows(case, patterns):
        if in_stiffness(case, one) and one.restrains == restraining:
            rows.append(row)
            stiffness.append(hold_stiffness(case, one) if one.held else one.attachment.stiffness)
    return RankOnes(np.array(rows), np.array(stiffness)) if rows else None


def hold_stiffness(case: Case, one: Attached) -> float:
    """Return the stiffness of the spring that stands for a hold in a full model, N/m or N m/rad."""
    piece = case.profile.at(one.motion.x)
    section = HARD * piece.material.young_modulus * piece.beam.area
    return section * piece.beam.thickness if one.motion.turns else section / piece.beam.thickness


def assembled_system(
    case: Case,
    operators: Operators,
    contact: ContactOperator,
    patterns: Sequence[Array],
    dimension: int,
    rayleigh: tuple[float, float],
) -> SemiDiscreteSystem:
    """Return the system of a beam under its loads, with their attachments.

    Args:
        case: The case.
        operators: M and K of the beam alone.
        contact: G, H, w and g0.
        patterns: Forces of each part of the loads of the case per unit factor, (n,), N, and after them the rows of
            `attached_motions`.
        dimension: 2 or 3.
        rayleigh: c_M, 1/s, and c_K, s, of the beam.
    """
    of_loads = patterns[: len(patterned(case.load))]
    loads = list(make_loads(case.load, of_loads, dimension))
    fixed = [*_of_loads(case, of_loads, dimension), *_of_sections(case, patterns, dimension)]
    if not fixed:
        return SemiDiscreteSystem(operators, contact, tuple(loads), *rayleigh, _of_modes(case, operators))
    rows = np.array([one.row for one in fixed])
    mass, stiffness, damping = np.array([one.added for one in fixed]).T
    for number, load in enumerate(case.load):
        place = load.place
        if isinstance(place, BodyForce | SupportAcceleration):
            driven = np.array([one.shaken if isinstance(place, SupportAcceleration) else one.weight for one in fixed])
            along = np.array([one.along @ load_direction(load, dimension) for one in fixed])
            loads[number] = replace(loads[number], pattern=loads[number].pattern + (driven * along) @ rows)
    weak = np.where([one.restrains for one in fixed], stiffness, 0.0)
    whole = attached(operators, RankOnes(rows, mass), RankOnes(rows, stiffness), RankOnes(rows, weak))
    dashpots = RankOnes(rows, damping - rayleigh[0] * mass - rayleigh[1] * stiffness)
    return SemiDiscreteSystem(whole, contact, tuple(loads), *rayleigh, dashpots.and_also(_of_modes(case, whole)))


def _of_modes(case: Case, operators: Operators) -> RankOnes | None:
    """Return modal damping, sum_i 2 z w_i (M x_i) (M x_i)^T over modes x_i with x_i^T M x_i = 1; None without."""
    if not case.damping.ratio:
        return None
    if not isinstance(operators, DenseOperators):
        raise TypeError("modal damping needs the modes of the model, which a full model does not have")
    squares, shapes = operators.modes
    rows = np.ascontiguousarray((operators.mass @ shapes).T)
    return RankOnes(rows, 2.0 * case.damping.ratio * np.sqrt(np.maximum(squares, 0.0)))


@dataclass(frozen=True)
class _Fixed:
    """Mass, spring and damper that are fixed to the beam at a place.

    Attributes:
        row: b, (n,).
        along: e, (dimension,); 0 for a rotation.
        added: m, k and c.
        weight: Mass that gravity acts on, kg.
        shaken: Mass that the motion of the frame acts on, kg.
        restrains: Whether k is a weak restraint.
    """

    row: Array
    along: Array
    added: tuple[float, float, float]
    weight: float
    shaken: float
    restrains: bool = False


def _of_loads(case: Case, patterns: Sequence[Array], dimension: int) -> Iterator[_Fixed]:
    for load, row in zip(case.load, patterns, strict=False):
        if (added := _added(load)) is not None:
            numbers = (added.mass, added.stiffness, added.damping)
            yield _Fixed(row, load_direction(load, dimension), numbers, weight=0.0, shaken=added.mass)


def _of_sections(case: Case, patterns: Sequence[Array], dimension: int) -> Iterator[_Fixed]:
    """Yield the joints, masses and fluids fixed to the beam, except for those in its operators already."""
    for one, row in attached_rows(case, patterns):
        if not in_stiffness(case, one):
            added = one.attachment
            numbers = (added.mass, added.stiffness, added.damping)
            driven = added.mass if one.driven is None else one.driven
            yield _Fixed(
                row, one.motion.direction(dimension), numbers, weight=driven, shaken=driven, restrains=one.restrains
            )


def _added(load: Load) -> Attachment | None:
    """Return the attachment of a load; None for none.

    Raises:
        TypeError: The load does not act at a point, where alone something can be attached.
    """
    added = load.attachment
    if added is None or not added.acts:
        return None
    if not isinstance(load.place, PointForce):
        raise TypeError(f"the load {load.name} attaches a mass, a spring or a damper, but acts at no point")
    return added
