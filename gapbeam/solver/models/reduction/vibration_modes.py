"""Vibration modes of a finite element body.

    K x = s M x,    found by shift and invert: (K + sigma M)^-1 M x = x / (s + sigma)

with a factor by SLEPc, without one by iterations that need no solve (`reduction.lobpcg`). sigma > 0 makes the
operator of a floating body positive definite.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from petsc4py import PETSc
from scipy.linalg import eigh
from slepc4py import SLEPc

from gapbeam.solver.linear_algebra.iterative_factor import ConjugateGradients
from gapbeam.solver.linear_algebra.petsc_operators import PetscOperators
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.models.reduction.lobpcg import lowest_shapes
from gapbeam.solver.system.operators import Array, Factor

TOLERANCE = 1.0e-12
SHAPES = 1.0e-7  # error of shapes by iterations, in the energy norm; squares of frequencies are off by its square
INEXACT = 3.0  # times the tolerance of iterative solves: what is asked of modes found without
SPACES = 4  # each twice the one before, until all modes converge
MISSED = 1.0e-6  # of the mass of a rigid motion: more than the tolerance leaves
MARGIN = 1.3  # more modes than a first count, when all below a frequency are wanted


_STOPPED: list[SLEPc.EPS] = []  # kept up to the end of the process: PETSc complains when they are destroyed


@dataclass(frozen=True)
class Modes:
    """Vibration modes.

    Attributes:
        squares: Squares of the angular frequencies, ascending, (k,), 1/s^2.
        shapes: Mode shapes on the DOFs of this rank, (n, k), with x^T M x = 1.
        factor: Solver for K + sigma M.
        left: Error of the shapes in the energy norm, where round-off left more than was asked for; else 0.
    """

    squares: Array
    shapes: Array
    factor: Factor
    left: float = 0.0

    @property
    def frequencies(self) -> Array:
        """Frequencies, (k,), Hz."""
        return np.asarray(np.sqrt(np.maximum(self.squares, 0.0)) / (2.0 * pi))


class _Solve:
    """A solve as PETSc's Python preconditioner."""

    def __init__(self, factor: Factor) -> None:
        self._factor = factor
        self.stopped: BaseException | None = None

    def apply(self, _preconditioner: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        try:
            y.array[:] = self._factor.solve(x.array_r)
        except BaseException as error:  # such as a signal, of which PETSc reports a number only
            self.stopped = error
            raise


def lowest_modes(
    mass: PETSc.Mat,
    stiffness: PETSc.Mat,
    factor: Factor,
    shift: float,
    count: int,
    below: float | None = None,
    massless: bool = True,
) -> Modes:
    """Return the modes with the lowest frequencies.

    Args:
        mass: M, in rows or as a product.
        stiffness: K, likewise, positive semi-definite.
        factor: Solver for K + sigma M.
        shift: sigma, 1/s^2.
        count: Their number, if `below` is not given; at least one is found.
        below: All below this frequency, Hz.
        massless: Whether M may be singular. One more solve for each shape then takes out what M does not see.

    Raises:
        RunError: Not all modes converged.

    Collective.
    """
    if isinstance(factor, ConjugateGradients):
        return _iterated(mass, factor, shift, count, below)
    solver = SLEPc.EPS().create(mass.comm)
    solver.setOptionsPrefix("gapbeam_modes_")
    solver.setOperators(stiffness, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setTarget(-shift)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTolerances(TOLERANCE)
    solver.setPurify(massless)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.setMatMode(SLEPc.ST.MatMode.SHELL)
    linear = transform.getKSP()
    linear.setType("preonly")
    linear.getPC().setType("python")
    solve = _Solve(factor)
    linear.getPC().setPythonContext(solve)
    most = stiffness.getSize()[0]
    wanted = min(max(count, 1), most)
    while True:
        found = _solved(solver, solve, wanted, most)
        squares = np.array([solver.getEigenvalue(number).real for number in range(found)])
        if below is None or squares.max() > (2.0 * pi * below) ** 2 or wanted == most:
            break
        wanted = min(int(MARGIN * 2 * wanted) + 1, most)
    order = np.argsort(squares)
    order = order[:wanted] if below is None else order[squares[order] <= (2.0 * pi * below) ** 2]
    shapes = np.empty((mass.getLocalSize()[0], len(order)), order="F")
    shape = mass.createVecRight()
    for column, number in enumerate(order):
        solver.getEigenvector(int(number), shape)
        shapes[:, column] = shape.array_r
    return Modes(squares[order], shapes, factor)


def with_rigid_motions(modes: Modes, operators: PetscOperators) -> Modes:
    """Return the modes with rigid motions that the eigensolver missed among them; the same modes where it missed none.

    Rigid motions share the frequency 0, and a Krylov space of one vector holds a frequency once but for round-off.
    What the modes leave of a rigid motion is a missed mode where its Rayleigh quotient lies below the highest mode.

    Args:
        modes: As found.
        operators: M and K, whose rigid motions are known in closed form.

    Collective.
    """
    motions = operators.rigid_motions
    left = motions
    for _ in range(2):  # the second time takes the round-off of the first
        left = left - modes.shapes @ operators.sum(modes.shapes.T @ operators.apply_mass(left))
    whole, rest = (operators.sum(x.T @ operators.apply_mass(x)) for x in (motions, left))
    shares, directions = eigh(rest, whole)
    missed = shares > MISSED
    if not np.any(missed):
        return modes
    found = left @ (directions[:, missed] / np.sqrt(shares[missed]))
    found_squares, turned = np.linalg.eigh(operators.sum(found.T @ operators.apply_stiffness(found)))
    low = found_squares <= modes.squares.max(initial=0.0)
    squares = np.concatenate([found_squares[low], modes.squares])
    order = np.argsort(squares, kind="stable")
    shapes = np.column_stack([found @ turned[:, low], modes.shapes])
    return Modes(squares[order], np.asfortranarray(shapes[:, order]), modes.factor, modes.left)


def _solved(solver: SLEPc.EPS, solve: _Solve, wanted: int, most: int) -> int:
    """Solve, in a larger space where modes are left over, and return how many modes were found."""
    solver.setDimensions(nev=wanted, ncv=PETSc.DECIDE, mpd=PETSc.DECIDE)  # not those of an earlier, smaller number
    for _ in range(SPACES):
        solver.setFromOptions()
        try:
            solver.solve()
        except (PETSc.Error, SystemError) as error:  # the latter where petsc4py >= 3.25 leaves the error of a solve set
            if solve.stopped is not None:
                _STOPPED.append(solver)
                raise solve.stopped from None
            raise RunError(f"the vibration modes of {most} DOFs could not be found ({error})") from error
        found, space = int(solver.getConverged()), int(solver.getDimensions()[1])
        if found >= wanted:
            return found
        if space >= most:
            break
        solver.setDimensions(nev=wanted, ncv=min(2 * space, most))
    raise RunError(
        f"{found} of {wanted} vibration modes of {most} DOFs converged, in a space of {space}: frequencies may lie too "
        "close together for that number; try more modes or fewer in [model]"
    )


def _iterated(mass: PETSc.Mat, factor: ConjugateGradients, shift: float, count: int, below: float | None) -> Modes:
    """Return the modes as `lowest_modes` does, without a solve. Collective."""
    given, image = mass.createVecs()

    def multiply_mass(x: Array) -> Array:
        result = np.empty_like(x)
        for number, column in enumerate(x.T):
            given.array[:] = column
            mass.mult(given, image)
            result[:, number] = image.array_r
        return result

    most = mass.getSize()[0]
    wanted, shapes = min(max(count, 1), most), None
    tolerance = max(SHAPES, INEXACT * factor.tolerance)
    while True:
        values, shapes, error = lowest_shapes(factor, multiply_mass, wanted, tolerance, shapes)
        squares = values - shift
        if below is None or squares[-1] > (2.0 * pi * below) ** 2 or wanted == most:
            break
        wanted = min(int(MARGIN * 2 * wanted) + 1, most)
    kept = slice(None) if below is None else squares <= (2.0 * pi * below) ** 2
    return Modes(squares[kept], shapes[:, kept], factor, error if error > tolerance else 0.0)
