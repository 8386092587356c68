"""Complex coefficients that were measured over the reduced velocity, and the states fitted to them.

A tube that moves as y e^(i w t) feels, per length, rho U^2 / 2 c(U / (f D)) y e^(i w t), f = w / (2 pi). With
k = w D / U the fit is

    c = c_0 + c_1 i k + sum_j a_j i k / (i k + d_j),     d_j > 0,

with the same rates d_j for all coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product
from math import pi
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError, finite
from gapbeam.solver.system.operators import Array

NAMES = {3: ("c",), 9: ("c_xx", "c_xy", "c_yx", "c_yy")}
"""Coefficients by the number of columns of a table."""
DRAWN = 121  # points of the line that stands for a fit
TOLERANCE = 0.05  # misfit above which a fit is doubted, of the largest coefficient


@dataclass(frozen=True, eq=False)
class CoefficientFit:
    """Measured coefficients and their fit.

    Attributes:
        reduced: Reduced velocities U/(f D), increasing, (rows,).
        measured: Coefficients at these, complex, (rows, coefficients).
        rates: d_j, (states,).
        values: c_0, c_1, a_1, a_2, ..., (2 + states, coefficients).
        tolerance: Misfit above which the fit is doubted.
    """

    reduced: Array
    measured: Any
    rates: Array
    values: Array
    tolerance: float = TOLERANCE

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coefficients."""
        return NAMES[1 + 2 * self.measured.shape[1]]

    @property
    def misfit(self) -> float:
        """Largest error over the largest coefficient."""
        size = float(np.abs(self.measured).max())
        return float(np.abs(self.fitted(self.reduced) - self.measured).max()) / size if size > 0.0 else 0.0

    @property
    def doubt(self) -> str:
        """A sentence where the misfit exceeds the tolerance, otherwise empty."""
        if self.misfit <= self.tolerance:
            return ""
        return (
            f"the fit of {counted(len(self.rates), 'state')} misses measured coefficients by {self.misfit:.2g} of the "
            f"largest, more than the tolerance of {self.tolerance:g}: take more states, or a smaller range of reduced "
            "velocities"
        )

    def fitted(self, reduced: ArrayLike) -> Any:
        """Return the coefficients of the fit, complex, (velocities, coefficients), at reduced velocities."""
        return _columns(2.0 * pi / np.asarray(reduced), self.rates) @ self.values

    def as_data(self) -> dict[str, Any]:
        """Return data and fit in the form of a summary: parts over the reduced velocity by name of a coefficient."""
        fine = np.linspace(self.reduced[0], self.reduced[-1], DRAWN)

        def curves(reduced: Array, values: Any) -> dict[str, Any]:
            named = zip(self.names, values.T, strict=True)
            parts = {name: {"real": one.real.tolist(), "imaginary": one.imag.tolist()} for name, one in named}
            return {"reduced_velocity": reduced.tolist(), **parts}

        numbers = {"misfit": self.misfit, "tolerance": self.tolerance, "states": len(self.rates)}
        return numbers | {"measured": curves(self.reduced, self.measured), "fit": curves(fine, self.fitted(fine))}


def _columns(k: Any, rates: Array) -> Any:
    s = 1j * k[:, None]
    return np.hstack([np.ones_like(s), s, s / (s + rates)])


def fit(rows: Array, states: int, tolerance: float = TOLERANCE) -> CoefficientFit:
    """Return the least-squares fit to `table_rows`; coefficients are linear for given rates, which a search finds."""
    reduced, c = rows[:, 0], rows[:, 1::2] + 1j * rows[:, 2::2]
    k, right = 2.0 * pi / reduced, np.vstack([c.real, c.imag])

    def solved(logs: Array) -> tuple[Array, Array]:
        columns = _columns(k, np.exp(logs))
        both = np.vstack([columns.real, columns.imag])
        values = np.linalg.lstsq(both, right, rcond=None)[0]
        return values, both @ values - right

    low, high = np.log(k.min() / 3.0), np.log(k.max() * 3.0)
    starts = np.linspace(low, high, max(2 * states, 3))
    best, least = np.zeros(0), np.inf
    for some in product(starts, repeat=states) if states <= 2 else [np.linspace(low, high, states)]:
        if states and np.all(np.diff(some) > 0.0):
            bounds = low - 2.0, high + 2.0
            options = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-14)
            found = scipy.optimize.least_squares(lambda x: solved(x)[1].ravel(), some, bounds=bounds, **options)
            if found.cost < least:
                best, least = found.x, found.cost
    return CoefficientFit(reduced, c, np.exp(best), solved(best)[0], tolerance)


def table_rows(table: ArrayLike | PathLike[str] | str, states: int, where: str) -> Array:
    """Return the rows of a table or CSV file, (rows, 3 or 9): reduced velocity, then real and imaginary parts.

    A file may have a line of names, and # begins a comment. Two rows more than states of the fit are needed, so that
    the misfit shows something.

    Raises:
        UserError: The file cannot be read, or rows, columns, values or the order of reduced velocities are wrong.
    """
    where, rows = f"{where}: table", dict[str, Array]()
    if isinstance(table, str | PathLike):
        where = f"{where} {table}"
        try:
            lines = Path(table).read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise ArgumentError(f"{where}: {error}", "table") from None
    else:
        lines, rows = [], {f"row {i}": row for i, row in enumerate(np.atleast_2d(finite(table, where)), start=1)}

    def fault(found: str, expected: str) -> ArgumentError:
        return ArgumentError(f"{where}: found {found}, expected {expected}", "table")

    for number, line in enumerate(lines, start=1):
        text = line.partition("#")[0].replace('"', "")
        row = np.genfromtxt([text], delimiter=",", ndmin=1) if text.strip(" ,") else np.zeros(0)  # NaN: no number
        if not len(row) or (not rows and np.isnan(row).all()):  # a line of names
            continue
        if not np.isfinite(row).all():
            raise fault(f"{line!r} in line {number}", "finite numbers with commas between")
        rows[f"line {number}"] = row
    first = len(next(iter(rows.values()), ()))
    for name, row in rows.items():
        if len(row) not in NAMES or len(row) != first:
            columns = "3 or 9 columns: the reduced velocity, then real and imaginary part of each coefficient"
            raise fault(f"{len(row)} numbers in {name}", columns)
    if len(rows) < states + 2:
        more = f"{states + 2} or more; measure at more velocities, or take fewer states"
        raise fault(f"{counted(len(rows), 'row')} for {counted(states, 'state')}", more)
    found = np.array(list(rows.values()))
    for (name, last), (after, one) in pairwise([("", 0.0), *zip(rows, found[:, 0], strict=True)]):
        if not one > last:
            before = f" after {last:g} in {name}" * bool(name)
            order = "numbers above 0 that increase; sort the rows, and take the mean of those at one velocity"
            raise fault(f"the reduced velocity {one:g} in {after}{before}", order)
    return found
