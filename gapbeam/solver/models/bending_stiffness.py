"""Accuracy of the bending stiffness of a mesh: loss by round-off, and excess by locking of its cells.

Both are measured on the softest bending mode of the beam by Timoshenko's theory: deflection w(x), frequency W, mass 1.

* Round-off. The entries of K are right to a relative eps. A mesh resists bending by small differences of large forces,
  and the deflection does work against the noise of these forces, which is that of a random walk over the DOFs i,

      e = 2 eps (sum_i (K_ii w_i^2)^2)^(1/2) / W^2,

  twice its standard deviation, since the noise of one mesh may be of any size within it.

  It grows with the fourth power of length over thickness, and with thin cells.
* Locking. Cells of degree 1 bend by shear, and in plane strain and solids by compression, which a Poisson's ratio near
  1/2 resists; long cells of degree 2 feel it as well. One step of inverse iteration gives the frequency W' that the
  mesh has,

      (K + W^2 M) x = M w,    W'^2 = x^T K x / x^T M x,    1 - W^2 / W'^2,

  the share of the deflection that is missing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import eigh, null_space

from gapbeam.meshes.sections.section_patches import CELLS_THROUGH
from gapbeam.solver.case.analysis_table import unit_motions
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.solution_tables import BeamModel
from gapbeam.solver.loads.attachments import BENDING, IN_PLANE, SIDEWAYS, MotionName
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.timoshenko_beam import SteppedBeam
from gapbeam.solver.system.operators import Array

if TYPE_CHECKING:
    from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators

DEVIATIONS = 2.0  # of a random walk: 19 of 20 stay within
ELEMENTS = 40  # of the beam whose mode is looked at
INDEPENDENT = 1.0e-9  # of rows of unit length: two holds may hold the same motion
FEWEST = 2  # cells through the thickness that have nodes on the axis
OF_THIN_CELLS = 1.5  # round-off grows with this power of the number of cells through the thickness
LEAST_DEGREE = 2  # of cells that bend without shear
COMPRESSIBLE = 10.0  # modulus of compression over that of shear, lambda / mu, up to which they bend without compression
NOTABLE_NOISE, MOST_NOISE = 2.0e-3, 0.05  # of a deflection; a full model finds no seat from about 0.1 on
NOTABLE_LOCKING = 0.02  # of a deflection; no refusal: a stubby block on springs hardly bends
LEAST_LEFT = 1.0e-9  # of a deflection, by which the error stays finite


@dataclass(frozen=True)
class BendingStiffness:
    """Relative errors of the bending stiffness of a mesh.

    Attributes:
        round_off: Share of a deflection that round-off may change, e, in the plane that is softer.
        missing: Share of the softest deflection that locked cells leave out, 0 to 1.
    """

    round_off: float = 0.0
    missing: float = 0.0

    @property
    def off(self) -> float:
        """Relative error of a figure by both."""
        return self.round_off + self.missing / max(1.0 - self.missing, LEAST_LEFT)


def bending_stiffness(case: Case, space: Any, operators: PetscOperators, rigid: Array) -> BendingStiffness:
    """Return the accuracy of the bending stiffness of a case.

    Args:
        case: The case.
        space: Blocked Lagrange space.
        operators: M and K of the beam alone, without what joints hold.
        rigid: M times the rigid motions, as in `Body`.

    Raises:
        RunError: The shifted stiffness could not be factored.

    Collective.
    """
    planes = ((BENDING, -1), (SIDEWAYS, 1)) if case.mesh.dimension == 3 else ((BENDING, -1),)
    round_off = 0.0
    for names, component in planes:
        beam, shape, square = softest_bending(case, names, held=True)
        square = min(square, (2.0 * pi * overhang_frequency(case)) ** 2)  # where contact holds the beam
        moved = _on_mesh(space, beam, shape, component, turned=False)
        noise = operators.stiffness_round_off(moved) * moved
        deviation = float(np.sqrt(operators.sum(np.array([noise @ noise]))[0])) / square
        round_off = max(round_off, DEVIATIONS * deviation)
    missing = _missing(case, space, operators, rigid) if _may_lock(case) else 0.0
    return BendingStiffness(round_off, missing)


def refuse_poor_bending(case: Case, found: BendingStiffness) -> None:
    """Refuse a mesh whose bending is noise; locked cells are a warning and part of the error.

    Raises:
        UserError: Round-off leaves too little of the deflection.
    """
    if found.round_off > MOST_NOISE:
        raise UserError(f"{_noisy(case, found.round_off)}; at most {MOST_NOISE:.0%} is accepted")


def bending_remarks(case: Case, found: BendingStiffness) -> Iterator[str]:
    """Yield the remarks on the bending stiffness of a mesh, one sentence each."""
    if found.round_off > NOTABLE_NOISE:
        yield _noisy(case, found.round_off)
    if found.missing > NOTABLE_LOCKING:
        yield _locked(case, found.missing)


def _noisy(case: Case, share: float) -> str:
    slender = f"the beam is {case.beam.length / case.profile.thinnest:.3g} times as long as it is thick"
    noise = f"round-off in the stiffness of the mesh may change deflections by {_percent(share)}: {slender}"
    return f"{noise}; {_against_round_off(case, share)}"


def _locked(case: Case, share: float) -> str:
    poisson = max(piece.material.poisson_ratio for piece in case.profile.pieces)
    remedies = ["mesh.degree = 2"] if case.mesh.degree < LEAST_DEGREE else ["a smaller mesh.size"]
    if case.mesh.degree >= LEAST_DEGREE and _may_be_beam(case):
        remedies.append('model.type = "beam"')
    return (
        f"cells of degree {case.mesh.degree} leave out up to {_percent(share)} of the deflection of the beam "
        f"(they are too stiff in bending, with Poisson's ratio {poisson:g}); try {' or '.join(remedies)}"
    )


def _against_round_off(case: Case, share: float) -> str:
    """Return the advice against a share of round-off."""
    through = case.mesh.cells_through_thickness or CELLS_THROUGH
    remedies = ['model.type = "beam", whose elements have no such round-off'] if _may_be_beam(case) else []
    if through > FEWEST and case.mesh.file is None and share * (FEWEST / through) ** OF_THIN_CELLS < MOST_NOISE:
        remedies.append(f"mesh.cells_through_thickness = {FEWEST}")
    return f"try {' or '.join(remedies)}" if remedies else "finite elements are too thin for so slender a beam"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 1.0 else "100 % and more"


def _may_be_beam(case: Case) -> bool:
    """Return whether beam elements take the case."""
    return not contradictions_in(case.model_copy(update={"model": BeamModel(type="beam")}))


def _may_lock(case: Case) -> bool:
    """Return whether cells may be too stiff in bending."""
    stress = case.mesh.dimension == 2 and case.mesh.plane == "stress"
    poisson = 0.0 if stress else max(piece.material.poisson_ratio for piece in case.profile.pieces)
    return case.mesh.degree < LEAST_DEGREE or 2.0 * poisson > COMPRESSIBLE * (1.0 - 2.0 * poisson)


def _missing(case: Case, space: Any, operators: PetscOperators, rigid: Array) -> float:
    """Return the missing share of the softest deflection of the free beam, 0 to 1. Collective."""
    beam, shape, square = softest_bending(case, BENDING, held=False)
    moved = _on_mesh(space, beam, shape, -1, turned=True)
    found = operators.shifted_factor(square).solve(operators.apply_mass(moved))
    motions = rigid_motions(space)
    sizes = operators.sum(rigid @ motions.T)
    which = np.flatnonzero(np.diagonal(sizes))
    shares = np.linalg.solve(sizes[np.ix_(which, which)], operators.sum(rigid[which] @ found))
    found = found - shares @ motions[which]
    energy = found @ (operators.apply_stiffness(found) - operators.apply_restraint(found))
    twice, mass = operators.sum(np.array([energy, found @ operators.apply_mass(found)]))
    return float(max(0.0, 1.0 - square * mass / twice)) if twice > 0.0 else 0.0


def softest_bending(case: Case, names: Sequence[MotionName], held: bool) -> tuple[SteppedBeam, Array, float]:
    """Return a beam, its softest bending mode with a mass of 1, (n,), and W^2, 1/s^2.

    Args:
        case: The case.
        names: Deflection and rotation of the plane.
        held: Whether joints hold it; their springs count, too.
    """
    beam = SteppedBeam.of_case(case, ELEMENTS, lateral=names == SIDEWAYS)
    operators = beam.operators().dense
    stiffness, rows = operators.stiffness.copy(), list[Array]()
    joints = [one for joint in case.joint for one in joint.attached() if one.motion.name in names] if held else []
    for one in joints:
        row = beam.rows(np.array([one.motion.x]))[names.index(one.motion.name)].toarray()[0]
        if one.held:
            rows.append(row)
        else:
            stiffness += one.attachment.stiffness * np.outer(row, row)
    free = null_space(np.array(rows), rcond=INDEPENDENT) if rows else np.identity(beam.size)
    squares, shapes = eigh(free.T @ stiffness @ free, free.T @ operators.mass @ free)
    rigid = beam.heave_and_pitch()
    kept = 2 - int(np.linalg.matrix_rank(np.array(rows) @ rigid.T)) if rows else 2
    return beam, free @ shapes[:, kept], float(squares[kept])


def rigid_motions(space: Any) -> Array:
    """Return the six rigid motions on the DOFs of this rank, (6, n); those out of the plane of a slice are 0.

    Args:
        space: Blocked Lagrange space.
    """
    dimension = space.mesh.geometry.dim
    places = _places(space)
    axes = [0, 1, 2] if dimension == 3 else [0, 2]
    inside, found = np.zeros((len(places), 3)), list[Array]()
    inside[:, axes] = places[:, :dimension]
    for motion in unit_motions():
        moves = dimension == 3 or motion.names <= set(IN_PLANE)
        found.append(motion.at(inside)[:, axes].reshape(-1) if moves else np.zeros(len(places) * dimension))
    return np.array(found)


def _places(space: Any) -> Array:
    return np.asarray(space.tabulate_dof_coordinates()[: space.dofmap.index_map.size_local])


def _on_mesh(space: Any, beam: SteppedBeam, shape: Array, component: int, turned: bool) -> Array:
    """Return the deflection of a beam on the DOFs of this rank, (n,), with the turn of its sections or without."""
    places, dimension = _places(space), space.mesh.geometry.dim
    deflection, rotation = beam.rows(places[:, 0])
    moved = np.zeros((len(places), dimension))
    moved[:, component] = deflection @ shape
    if turned:
        moved[:, 0] = (beam.neutral - places[:, dimension - 1]) * (rotation @ shape)
    return moved.reshape(-1)
