"""The lowest vibration modes by iterations, without a solve: locally optimal block preconditioned conjugate gradients.

    K x = s M x,    A = K + sigma M,    A x = (s + sigma) M x

From shapes X a step goes to the best shapes in the span of X, of the preconditioned residuals B (A X - M X diag(s +
sigma)) and of the step before. A residual r has about the error sqrt(r^T B r) in the energy norm, of shapes
of energy 1.

Source: Knyazev (2001), SIAM J. Sci. Comput. 23, 517.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gapbeam.solver.linear_algebra.iterative_factor import ConjugateGradients
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.models.reduction.modal_basis import symmetric_part, unit_directions
from gapbeam.solver.system.operators import Array, Indices

MOST_STEPS = 1000  # thin walls, where the preconditioner is weak, take some 300
GUARDS = 0.2  # of the modes wanted: more that are sought, as those at the end are found last
LEAST_GUARDS = 4
STALLED = 1.0e-4  # error that round-off may leave; frequencies are off by its square
RENEWED = 10  # steps after which products are computed anew: combined from earlier ones, they gather round-off
PATIENCE = 10  # steps in which an error above round-off halves
INDEPENDENT = (1.0e-12, 1.0e-12)  # of the largest eigenvalue of a Gram matrix of unit vectors
ROWS = 2**16  # that are combined at once
Part = Callable[[Array], Array]
Sum = Callable[[Array], Array]


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
    factor: ConjugateGradients, multiply_mass: Part, count: int, tolerance: float, start: Array | None = None
) -> tuple[Array, Array, float]:
    """Return (s + sigma), ascending, (count,), shapes, (n, count), with x^T M x = 1, and their largest error.

    Args:
        factor: Products with A = K + sigma M, and its preconditioner.
        multiply_mass: M on blocks of columns.
        count: Their number.
        tolerance: Error of a shape, in the energy norm. Where round-off leaves more, up to 1e-4, that has to do.
        start: Shapes to start from, (n, k); None: rigid motions. The rest is noise.

    Raises:
        RunError: They did not converge.

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


def _best(blocks: list[_Block], total: Sum, size: int, last: Indices | None = None) -> tuple[Array, Array]:
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
    """Overwrite shapes with better ones and steps with what they move by; of the steps these were taken `before`.

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
