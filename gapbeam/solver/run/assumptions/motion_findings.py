"""Findings on pose, contact and restraint of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import squeezed_stiffness
from gapbeam.solver.case.solution_tables import BeamModel, RigidModel
from gapbeam.solver.diagnostics.assumption import (
    ASIDE,
    ROTATION,
    STRAIN,
    STRESS,
    TRAVEL,
    Assumption,
    Finding,
    PoseWatch,
)
from gapbeam.solver.diagnostics.contact_episodes import RESOLVING_STEPS, Episodes
from gapbeam.solver.diagnostics.point_contact import Peaks
from gapbeam.solver.loads.attachments import MotionName
from gapbeam.solver.loads.load_choice import load_direction
from gapbeam.solver.loads.support_walls import interference
from gapbeam.solver.system.operators import Array

SMALL_ROTATION = Assumption(
    "small rotation", "largest rotation", "rad", 0.1, 0.5,
    "the equations are those of small rotations, whose error is about rotation^2 / 2; smaller loads, a stiffer beam or "
    "less clearance keep inside them",
)  # fmt: skip
SMALL_STRAIN = Assumption(
    "small strain", "largest strain at the surface", "1", 0.01, 0.1,
    "the strain is taken as linear in the displacement, and the material as linear; check loads and Young's modulus",
)  # fmt: skip
ELASTIC = "no yield", "largest stress (von Mises) at the surface", "Pa"
ELASTIC_EVERYWHERE = "no yield", "largest stress (von Mises) at the surface over the yield stress there", "1"
ELASTIC_MEANING = "beyond material.yield_stress the beam deforms plastically, which the equations do not know"
INSIDE = "inside the support", "travel along the support over its length (across it over the width)", "1", 0.05, 0.5
STAYS = (
    "the beam has slid on, and contact stays at the sections that lay in the support at the start: others lie there now"
)
ALONG_RADII = Assumption(
    "radii in supports around the beam", "largest motion across the beam over its radius", "1", 0.02, 0.2,
    "forces act along the radii of the undeformed beam, though it touches elsewhere; less clearance or smaller loads "
    "keep the motion small beside the radius",
)  # fmt: skip
LINEAR_SEAT = Assumption(
    "linear seat", "largest rotation at the start", "rad", 0.1, 0.5,
    "the start is found by the equations of small rotations; check gravity, clearance and the direction of loads",
)  # fmt: skip
SHALLOW = Assumption(
    "penetration beside the thickness", "largest penetration over the thickness", "1", 0.01, 0.1,
    "the penetration is deeper than a contact stiffness can represent; check loads and contact.stiffness",
)  # fmt: skip
BESIDE_CLEARANCE = "penetration beside the clearance", "1", 0.1
RESTRAINED = Assumption(
    "weak restraint", "largest energy of the restraint over the energy of the beam", "1", 0.01, None,
    "the restraint is not weak; soften [restraint], or look for a load along it",
)  # fmt: skip
RESOLVED = Assumption(
    "contacts resolved by the step", f"impulse in contacts shorter than {RESOLVING_STEPS} steps, over the whole", "1",
    0.05, None, "peak forces and accelerations of these contacts are not resolved; try a smaller time.step",
)  # fmt: skip


def of_pose(watch: PoseWatch, case: Case) -> list[Finding]:
    """Return the findings on rotation, strain, stress and travel, and on the start."""

    def found(assumption: Assumption, row: int, estimate: float | None = None) -> Finding:
        value, time, *place = watch.closest[row].tolist()
        return Finding(assumption, value, time, np.array(place), estimate)

    rotation, travel = float(watch.closest[ROTATION, 0]), float(watch.closest[TRAVEL, 0])
    findings = [
        found(SMALL_ROTATION, ROTATION, 0.5 * rotation**2),
        found(SMALL_STRAIN, STRAIN, float(watch.closest[STRAIN, 0])),
        replace(found(_inside(case, watch), TRAVEL, travel), detail=_slid(case, watch, travel)),
        Finding(LINEAR_SEAT, watch.at_start, estimate=0.5 * watch.at_start**2),
    ]
    if any(support.met_region.along_radii for support in case.layout.holes):
        findings.append(found(ALONG_RADII, ASIDE, float(watch.closest[ASIDE, 0])))
    limits = [piece.material.yield_stress for piece in case.profile.pieces]
    if any(limits) and not isinstance(case.model, RigidModel):
        name, quantity, unit = ELASTIC if case.profile.one_material else ELASTIC_EVERYWHERE
        limit = (limits[0] or 0.0) if case.profile.one_material else 1.0
        findings.append(found(Assumption(name, quantity, unit, limit, None, ELASTIC_MEANING), STRESS))
    return findings


TURNED = 0.5  # share of the travel that rotation alone may make


def _inside(case: Case, watch: PoseWatch) -> Assumption:
    """Return the assumption that the beam stays in its supports, with advice for a beam that slides on or turns."""
    by_rotation = 0.5 * case.profile.thickest * float(watch.closest[ROTATION, 0])
    drives = [f"load {load.name}" for load in case.load if _along(case, load_direction(load, case.mesh.dimension))]
    motion = case.analysis.motion if isinstance(case.analysis, Transient) else None
    if motion is not None:
        length = case.beam.length
        if any(_along(case, one.section(0.0)) for one in (motion.pose(length), motion.rate(length))):
            drives.append("[analysis.motion]")
    if drives and case.friction is not None and float(watch.closest[TRAVEL, 1]) == 0.0:
        remedy = (
            f"{' and '.join(drives)} moves it in the seat, which is found without friction: where friction holds the "
            'beam, load it after the start, by type = "step_force" with a ramp; else it needs a [[joint]] or a larger '
            "[restraint]"
        )
    elif drives:
        remedy = (
            f"{' and '.join(drives)} drives this motion, which needs a larger [restraint], a [[joint]] or less drive "
            "where the beam shall stay, and a smaller time.end where the motion is meant: until the limit is passed, "
            "figures hold"
        )
    elif by_rotation > TURNED * float(watch.closest[TRAVEL, 0]) * watch.scales.support_length:
        remedy = (
            "rotation moves its surface along the support, half the thickness off the axis: smaller loads, a stiffer "
            "beam or less clearance keep it there"
        )
    else:
        remedy = (
            "no load drives this motion: a [[joint]] that holds the motion, or a stiffer [restraint], keeps the beam"
        )
    return Assumption(*INSIDE, f"{STAYS}; {remedy}")


def _along(case: Case, motion: Array | Mapping[MotionName, float]) -> bool:
    """Return whether a direction or the motion of a section has a part along the beam, or across it in 3D."""
    if not isinstance(motion, np.ndarray):
        return motion["axial"] != 0.0 or motion["lateral"] != 0.0
    across = motion[1:-1] if not case.layout.holes else motion[:0]
    return bool(motion[0] != 0.0 or np.any(across != 0.0))


def _slid(case: Case, watch: PoseWatch, share: float) -> str:
    """Return the slip of the beam along the support in words, where its travel is not across it; empty: none."""
    if share == 0.0 or case.mesh.dimension > 2:
        return ""
    length = watch.scales.support_length
    return f"{share * length:.3g} m along a support of {length:.3g} m"


def of_contact(case: Case, peaks: Peaks, episodes: Episodes) -> Iterator[Finding]:
    """Yield the findings on penetration and on contacts that the step does not resolve."""
    faces = [(float(d), one) for d, one in zip(peaks.deepest, case.layout.by_face, strict=True)]
    shared = [(d, one.clearance) for d, one in faces if not one.brings_stiffness]  # one that gives way is no penalty
    deepest = max((d for d, _ in shared), default=0.0)
    yield Finding(SHALLOW, deepest / case.profile.thinnest, detail=f"{deepest:.3g} m")
    beside = [(d, gap) for d, gap in shared if gap != 0.0]
    deepest, clearance = max(beside, key=lambda one: one[0] / abs(one[1]), default=(0.0, case.layout.clearance))
    if clearance != 0.0 and squeezed_stiffness(case) is None:  # there the springs are the squeezed section
        name, unit, limit = BESIDE_CLEARANCE
        size = "interference" if clearance < 0.0 else "clearance"
        one = Assumption(name, f"largest penetration over the {size}", unit, limit, None, _remedy(case))
        yield Finding(one, deepest / abs(clearance), detail=f"{deepest:.3g} m")
    yield Finding(RESOLVED, episodes.unresolved_share, detail=f"{episodes.short} of {episodes.count} contacts")


def _remedy(case: Case) -> str:
    """Return the meaning of a large penetration in a case, and its remedy."""
    if case.layout.clearance < 0.0 or interference(case.load, case.layout) > 0.0:
        if isinstance(case.model, BeamModel | RigidModel):
            return (
                "this model cannot be squeezed, so that the springs of the contact take up the whole interference; "
                'model.type = "full" or "reduced" lets the beam give way'
            )
        return "springs of the contact take up the interference as well as the beam, so that it is held more softly"
    if case.contact.formulation.holds_points or case.contact.formulation.stress_terms is not None:
        return "the formulation leaves none at rest; smaller cells (mesh.support_size) or a smaller time.step reduce it"
    return "try a stiffer contact.stiffness"
