"""Which motions of cross-sections the joints, masses and fluids of a case act on, in its model.

A motion that a joint holds has no DOF in a reduced, beam or rigid model (`models.reduction.held_motions`). In a full
model a spring in K holds the motion: 1e4 E A / h, or 1e4 E A h for a rotation, far stiffer than a section of
thickness h.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gapbeam.solver.attachments.attached import Attached
from gapbeam.solver.attachments.mean_motion import IN_PLANE, OUT_OF_PLANE, MeanMotion, MotionName
from gapbeam.solver.case.beam_motions import section_motions
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_table import BeamModel, FullModel
from gapbeam.solver.case.symmetry import is_symmetric
from gapbeam.solver.case.weak_restraint import twist_restraint
from gapbeam.solver.loads.attachment import Attachment
from gapbeam.solver.loads.load_parts import patterned
from gapbeam.solver.loads.places import LineForce, SupportWalls
from gapbeam.solver.system.operators import Array, RankOnes

HARD = 1.0e4  # times the stiffness of a section over its thickness


def attached_motions(case: Case) -> tuple[Attached, ...]:
    """Return what joints, masses and fluids do to the motions that the model of a case has."""
    motions = model_motions(case)
    entries = (*case.joint, *case.mass, *case.fluid)
    found = tuple(one for entry in entries for one in entry.attached() if one.motion.name in motions)
    return (*found, *(one for one in roll_springs(case) if one.motion.name in motions))


def in_stiffness(case: Case, one: Attached) -> bool:
    """Return whether the stiffness of a body holds this: what joints hold, and what restrains a mesh."""
    return one.held or (one.restrains and isinstance(case.model, FullModel))


def roll_springs(case: Case) -> tuple[Attached, ...]:
    """Return the weak spring that keeps a round beam in holes from turning about its axis; nothing without holes.

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
    """Return what joints, masses and fluids do with the rows of the motions, (n,).

    The rows stand behind the patterns of loads.

    Args:
        case: The case.
        patterns: Forces of its loads, and after them the rows of `attached_motions`.
    """
    return list(zip(attached_motions(case), patterns[len(patterned(case.load)) :], strict=True))


def acting_rows(case: Case, patterns: Sequence[Array]) -> list[Array]:
    """Return the rows that a basis has a static shape for: those of loads, and of what is attached at one place.

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
        restraining: Which of both.
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
