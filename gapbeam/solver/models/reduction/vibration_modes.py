"""Vibration modes of a finite element body.

    K x = s M x,    found by shift and invert: (K + sigma M)^-1 M x = x / (s + sigma)

with a factor by SLEPc, without one by iterations that need no solve. sigma > 0 makes the
operator of a floating body positive definite.

The lowest vibration modes by iterations, without a solve: locally optimal block preconditioned conjugate gradients.

    K x = s M x,    A = K + sigma M,    A x = (s + sigma) M x

From shapes X a step goes to the best shapes in the span of X, of the preconditioned residuals B (A X - M X diag(s +
sigma)) and of the step before. A residual r has about the error sqrt(r^T B r) in the energy norm, of shapes
of energy 1.

Source: Knyazev (2001), SIAM J. Sci. Comput. 23, 517.
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
from gapbeam.solver.linear_algebra.smooth_modes import Map
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.models.reduction.modal_basis import symmetric_part, unit_directions
from gapbeam.solver.system.operators import Array, Factor, Indices

MOST_STEPS = 1000  # thin walls, where the preconditioner is weak, take some 300
GUARDS = 0.2  # of the modes wanted: more that are sought, as those at the end are found last
LEAST_GUARDS = 4
STALLED = 1.0e-4  # error that round-off may leave; frequencies are off by its square
RENEWED = 10  # steps after which products are computed anew: combined from earlier ones, they gather round-off
PATIENCE = 10  # steps in which an error above round-off halves
INDEPENDENT = (1.0e-12, 1.0e-12)  # of the largest eigenvalue of a Gram matrix of unit vectors
ROWS = 2**16  # that are combined at once


@dataclass(frozen=True)
class _Block:
    """Vectors x with A x and M x."""

    x: Array
    energy: Array
    mass: Array

    def arrays(self) -> tuple[Array, Array, Array]:
        """Return the three."""
        return self.x, self.energy, self.mass


def lowest_shapes(
    factor: ConjugateGradients, multiply_mass: Map, count: int, tolerance: float, start: Array | None = None
) -> tuple[Array, Array, float]:
    """Return (s + sigma), ascending, (count,), shapes, (n, count), with x^T M x = 1, and their largest error.

    Args:
        factor: Products with A = K + sigma M, and its preconditioner.
        multiply_mass: M on blocks of columns.
        count: Their number.
        tolerance: Error of a shape, in the energy norm. Where round-off leaves more, up to 1e-4, that has to do.
        start: Shapes to start from, (n, k); None: rigid motions. The rest is noise.

    Raises:
        RunError: The iterations did not converge.

    Collective.
    """

    def block(x: Array) -> _Block:
        return _Block(x, factor.multiply(x), multiply_mass(x))

    total = factor.sum
    size = count + max(LEAST_GUARDS, int(GUARDS * count))
    given = factor.rigid if start is None else start
    noise = np.random.default_rng(0).standard_normal((len(given), max(size - given.shape[1], 0)))
    first = np.concatenate([given, factor.precondition(multiply_mass(noise))], axis=1)
    begun = block(first)
    share, compliances = _best([begun], total, size)
    shapes = _Block(*(array @ share for array in begun.arrays()))
    steps = _Block(*(np.zeros_like(array) for array in shapes.arrays()))
    size = share.shape[1]  # there may be no more
    del first, begun
    worst: list[float] = []
    errors, looked = np.full(size, np.inf), np.arange(size)
    for step in range(1, MOST_STEPS + 1):
        residual = shapes.energy[:, looked] - shapes.mass[:, looked] / compliances[looked]
        weighed = factor.precondition(residual)
        errors[looked] = np.sqrt(np.maximum(factor.dots(residual, weighed), 0.0))
        del residual
        open_ones = looked[errors[looked] > tolerance]
        worst.append(float(np.max(errors[:count])))
        stalled = len(worst) > PATIENCE and 0.5 * worst[-PATIENCE] < worst[-1] <= STALLED
        if stalled or not np.any(open_ones < count):
            if not stalled and len(looked) < size:  # those that had converged may be others by now
                looked = np.arange(size)
                continue
            lengths = np.sqrt(compliances[:count])
            return np.asarray(1.0 / compliances[:count]), np.asarray(shapes.x[:, :count] / lengths), worst[-1]
        weighed = weighed[:, errors[looked] > tolerance]
        weighed -= shapes.x @ total(np.ascontiguousarray(shapes.energy.T @ weighed))
        further = block(weighed)
        share, compliances = _best([shapes, further, steps], total, size, open_ones)
        _move(shapes, further, steps, share, open_ones)
        if step % RENEWED == 0:
            for one in (shapes, steps):
                one.energy[:], one.mass[:] = factor.multiply(one.x), multiply_mass(one.x)
        looked = open_ones
    raise RunError(
        f"{int(np.sum(errors[:count] <= tolerance))} of {count} vibration modes converged in {MOST_STEPS} iterations; "
        'ask for fewer in [model], or take solver.effective = "factor", which finds them without iterations'
    )


def _best(blocks: list[_Block], total: Map, size: int, last: Indices | None = None) -> tuple[Array, Array]:
    """Return the shapes of lowest frequency in terms of blocks, (columns, size), with x^T A x = 1.

    Of the `last` block these columns are taken only; also returns x^T M x of the shapes.
    """
    ends = np.cumsum([one.x.shape[1] for one in blocks])
    taken = np.arange(ends[-1])
    if last is not None:
        taken = np.concatenate([taken[: ends[-2]], ends[-2] + last])
    chosen = np.ix_(taken, taken)
    energy = total(np.block([[one.x.T @ other.energy for other in blocks] for one in blocks]))[chosen]
    inertia = total(np.block([[one.x.T @ other.mass for other in blocks] for one in blocks]))[chosen]
    combine = unit_directions(energy, INDEPENDENT)
    compliances, modes = np.linalg.eigh(symmetric_part(combine.T @ inertia @ combine))
    return combine @ modes[:, ::-1][:, :size], compliances[::-1][:size]


def _move(shapes: _Block, further: _Block, steps: _Block, share: Array, before: Indices) -> None:
    """Overwrite shapes with better ones, and steps with their changes; `before` lists columns of the last steps.

    Some rows at a time: at a million unknowns all of them would be gigabytes more.
    """
    ends = np.cumsum([shapes.x.shape[1], further.x.shape[1]])
    own, new, old = np.split(share, ends)
    for shape, more, step in zip(shapes.arrays(), further.arrays(), steps.arrays(), strict=True):
        for first in range(0, len(shape), ROWS):
            rows = slice(first, first + ROWS)
            moved = more[rows] @ new + step[rows][:, before] @ old
            shape[rows] = shape[rows] @ own + moved
            step[rows] = moved


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

    Rigid motions share the frequency 0, and a Krylov space of one vector holds a frequency once up to round-off.
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
        solver.setDimensions(nev=wanted, ncv=min(2 * space, most), mpd=PETSc.DECIDE)
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
