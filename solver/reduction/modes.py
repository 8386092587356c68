"""Vibration modes of a finite element body by SLEPc, and the factor that found them.

    K x = s M x,    found by shift and invert: (K + sigma M)^-1 M x = x / (s + sigma)

sigma > 0 makes the operator of a floating body positive definite.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from solver.errors import RunError
from solver.operators import Array
from solver.petsc_operators import PetscFactor

TOLERANCE = 1.0e-12
MARGIN = 1.3  # more modes than a first count, when all below a frequency are wanted


@dataclass(frozen=True)
class Modes:
    """Vibration modes.

    Attributes:
        squares: Squares of the angular frequencies, ascending, (k,), 1/s^2.
        shapes: Mode shapes on the DOFs of this rank, (n, k), with x^T M x = 1.
        factor: The factor of K + sigma M.
    """

    squares: Array
    shapes: Array
    factor: PetscFactor

    @property
    def frequencies(self) -> Array:
        """Frequencies, (k,), Hz."""
        return np.asarray(np.sqrt(np.maximum(self.squares, 0.0)) / (2.0 * pi))


def lowest_modes(mass: PETSc.Mat, stiffness: PETSc.Mat, shift: float, count: int, below: float | None = None) -> Modes:
    """Return the modes with the lowest frequencies.

    Args:
        mass: M.
        stiffness: K, positive semi-definite.
        shift: sigma, 1/s^2.
        count: How many, if `below` is not given; at least one is found.
        below: All below this frequency, Hz.

    Raises:
        RunError: The factorization failed, or not all modes converged.

    Collective.
    """
    solver = SLEPc.EPS().create(mass.comm)
    solver.setOptionsPrefix("gapbeam_modes_")
    solver.setOperators(stiffness, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setTarget(-shift)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTolerances(TOLERANCE)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.setMatStructure(PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    linear = transform.getKSP()
    linear.setType("preonly")
    linear.getPC().setType("cholesky")
    linear.getPC().setFactorSolverType("mumps")
    most = stiffness.getSize()[0]
    wanted = min(max(count, 1), most)
    while True:
        solver.setDimensions(nev=wanted)
        solver.setFromOptions()
        try:
            solver.solve()
        except PETSc.Error as error:
            raise RunError(f"the vibration modes of {most} DOFs could not be found ({error})") from error
        found = solver.getConverged()
        if found < wanted:
            raise RunError(f"{found} of {wanted} vibration modes converged; ask for fewer in [model]")
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
    return Modes(squares[order], shapes, PetscFactor(stiffness, linear.getPC(), solver))
