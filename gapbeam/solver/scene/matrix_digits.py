"""Digits of matrices that programs print, and the frequencies that cut digits leave unknown.

Springs between many nodes cancel in slow motions: relative errors of 1e-4 in entries may be as large as the first
squared frequency. Each entry a is known to half a unit of its last digit, h. Entries that print alike share their
error, which is uniform. A squared frequency s with the mass-normalized shape x then has the standard deviation of
x^T (E - s E_M) x, sum over different values v of h_v^2 / 3 (sum of sign(a_ij) x_i x_j over |a_ij| = v)^2 (first order
of perturbations: Stewart and Sun, Matrix Perturbation Theory, 1990).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from gapbeam.solver.scene.structure import FIRST_GUESS, MOST_RIGID, FrequencyDoubt, Structure
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array

DOUBLE, SINGLE = 15, 7  # digits that the formats hold
FEWEST = 3  # digits: with less, all entries are exact, written by hand
SHORTER = 2  # digits that a field of 8 characters loses to a sign and a longer exponent
SAMPLE = 200
NOISE = 4.0  # standard deviations
MORE_DIGITS = (
    "try DMIG in fields of 16 characters, output4 or Matrix Market, or "
    'gates.warnings.digits_of_matrices = "never" where the entries are exact'
)
MOST_OFF = 0.01
"""Part of the first frequency that digits may leave unknown: two standard deviations, one of its square."""


@dataclass(frozen=True)
class PrintedDigits:
    """Entries of a matrix that has few digits.

    Attributes:
        most: Largest number of digits of an entry.
        rows: Rows of its entries.
        columns: Columns of its entries.
        signs: Signs of its entries, times the factor of the scale.
        alike: Number of the value of each entry.
        halves: Half a unit of the last digit of each value, in the units of the file.
        scale: Factors of the rows, which bring motions to the units of the file.
    """

    most: int
    rows: Array
    columns: Array
    signs: Array
    alike: Array
    halves: Array
    scale: Array

    @staticmethod
    def of(A: Any, energy: float, scale: Array) -> PrintedDigits | None:
        """Return the digits of a matrix; None: it has all that floating point holds, or is exact.

        Args:
            A: The matrix in the units of its file, sparse.
            energy: Factor to SI.
            scale: Factors of the rows, (n,).
        """
        entries = sp.coo_matrix(A)
        kept = entries.data != 0.0
        data, rows, columns = entries.data[kept], entries.row[kept], entries.col[kept]
        values, place = np.unique(data, return_inverse=True)
        if not len(values):
            return None
        texts = [_digits(one) for one in values[:: max(1, len(values) // SAMPLE)]]
        if max(map(len, texts)) < DOUBLE:
            texts = [_digits(one) for one in values]
        count = np.array([len(one) for one in texts])
        most = int(count.max())
        if most > SINGLE + SHORTER and np.array_equal(np.float32(values), values):
            most, halves = SINGLE, 2.0 ** (np.frexp(values)[1] - 25.0)
        elif FEWEST <= most < DOUBLE:
            decade = np.floor(np.log10(np.abs(values)))
            last = decade - count + 1.0
            point = last.min() if last.min() <= 0.0 else -np.inf  # of a format with a fixed number of decimals
            kind = 2 * (values < 0.0) + (np.abs(decade) >= 10.0)
            of_kind = [count[kind == k] for k in range(4)]
            full = np.array([max(one.max(), most - SHORTER) if len(one) > FEWEST else most for one in of_kind])[kind]
            cut = {(one, bool(a)) for one, a in zip(texts, (count >= full) | (last == point), strict=True)}
            if 2 * sum(a for _, a in cut) <= len(cut):
                return None
            halves = 0.5 * 10.0 ** np.maximum(decade - full + 1.0, point)
        else:
            return None
        sizes, alike = np.unique(np.abs(values), return_inverse=True)
        half = np.zeros(len(sizes))
        np.maximum.at(half, alike, halves)
        return PrintedDigits(most, rows, columns, energy * np.sign(data), alike[place], half, scale)

    @property
    def relative(self) -> float:
        """Relative error of an entry, at most."""
        return 0.5 * 10.0 ** (1 + SHORTER - self.most)

    def unknown(self, X: Array) -> Array:
        """Return the standard deviation of x^T A x of columns, (DOFs, k), in SI, (k,)."""
        Y = self.scale[:, None] * X
        sums = [np.bincount(self.alike, self.signs * y[self.rows] * y[self.columns]) for y in Y.T]
        return np.sqrt(np.array(sums) ** 2 @ (self.halves**2 / 3.0))


def _digits(value: float) -> str:
    """Return the digits that round to a value, without zeros before and behind them."""
    return repr(abs(float(value))).partition("e")[0].replace(".", "").strip("0")


def frequency_doubt(
    structure: Structure, free: Array, stiffness: PrintedDigits | None, mass: PrintedDigits | None, most_rigid: int
) -> FrequencyDoubt | None:
    """Return the part of the first frequency that the digits leave unknown; None: at most MOST_OFF.

    Args:
        structure: The structure.
        free: Rows of the matrices that are its DOFs.
        stiffness: Digits of K, or None.
        mass: Digits of M.
        most_rigid: Rigid motions that it may have.
    """
    if stiffness is None and mass is None:
        return None
    known = 0 if structure.rigid is None else structure.rigid.shape[1]
    if structure.is_large:
        operators = SparseOperators(structure.M, structure.K)
        near = FIRST_GUESS * float((operators.stiffness.diagonal() / operators.mass.diagonal()).mean())
        squares, X = operators.lowest_modes(near, MOST_RIGID + 1, operators.factor(near, 1.0))
    else:
        squares, _, X = structure.modes
    squares, X = squares[known : MOST_RIGID + 1], X[:, known : MOST_RIGID + 1]
    if not len(squares):
        return None
    whole = np.zeros(((stiffness or mass).scale.size, len(squares)))  # type: ignore[union-attr]
    whole[free] = X
    off = np.zeros(len(squares)) if stiffness is None else stiffness.unknown(whole)
    if mass is not None:
        off = np.hypot(off, squares * mass.unknown(whole))
    still = 0  # modes that noise alone may stiffen
    while still < min(most_rigid - known, len(squares) - 1) and squares[still] <= NOISE * off[still]:
        still += 1
    first = float(squares[still])
    stray = float(np.sqrt(np.maximum(np.abs(squares), off)[:still].max(initial=0.0) / first))
    lost = float(off[still]) / first
    if lost > MOST_OFF:
        hertz = np.sqrt(off[still] / MOST_OFF) / (2.0 * np.pi)
        words = f"frequencies below about {hertz:.3g} Hz are unknown by more than {MOST_OFF:.0%}"
        return FrequencyDoubt(max(lost, stray), words)
    words = f"a rigid motion vibrates at {stray:.2g} of the first frequency"
    return FrequencyDoubt(stray, words) if stray > MOST_OFF else None
