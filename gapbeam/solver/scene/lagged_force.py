"""Unsteady forces of a flow: memories of exponentials, fits of measured coefficients, and Roger's form.

Coefficients are measured over the reduced velocity: a tube that moves as y e^(i w t) feels, per length,
rho U^2 / 2 c(U / (f D)) y e^(i w t), f = w / (2 pi). With k = w D / U the fit is

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
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, finite, matrix, positive, positives
from gapbeam.solver.scene.feedback import Place
from gapbeam.solver.scene.flow_force import Flow, FlowLaw, FlowSpan, SectionForce
from gapbeam.solver.system.operators import Array

NAMES = {3: ("c",), 9: ("c_xx", "c_xy", "c_yx", "c_yy")}  # coefficients by the number of columns of a table
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


def _law(stiffness: Array, damping: Array, amplitudes: Array, rates: Array, size: float, **known: Any) -> FlowLaw:
    """Return f = U^2/2 [K y + (D/U) C y' + sum_i A_i z_i] with z_i' = y' - d_i (U/D) z_i, A_i of (states, d, d)."""
    d, count = len(stiffness), len(rates)

    def section(velocity: float) -> SectionForce:
        q, unit = 0.5 * velocity**2, np.eye(d)
        B = np.hstack([np.zeros((count * d, d)), np.tile(unit, (count, 1))])
        C = q * np.hstack([np.zeros((d, 0)), *amplitudes])
        D = q * np.hstack([stiffness, size / velocity * damping])
        return SectionForce(-velocity / size * np.kron(np.diag(rates), unit), B, C, D)

    return FlowLaw(section, size, **known)


@checked
def unsteady(
    where: FlowSpan | Place, *, velocity: float, density: float, diameter: float, stiffness: Any, damping: Any,
    amplitudes: ArrayLike, rates: ArrayLike, modes: int | None = None, name: str = "",
) -> Flow:  # fmt: skip
    """Return a force that remembers the motion by decaying exponentials.

    Per length, f = rho U^2 / 2 [ K (y - sum_i a_i z_i) - C (D / U) y' ] with z_i' = y' - d_i (U / D) z_i: a tube that
    is moved suddenly feels (1 - sum a_i) of the steady force at once. Added mass belongs to the structure: `in_fluid`.

    Args:
        where: A span; or a point, whose force is then that of 1 m.
        velocity: U, m/s.
        density: rho, kg/m^3.
        diameter: D, m.
        stiffness: K, a number, or a matrix for two motions; it need not be symmetric.
        damping: C, likewise.
        amplitudes: a_i.
        rates: d_i, above 0.
        modes: See `Flow`.
        name: See `Flow`.

    Raises:
        UserError: A value is out of range.

    Source: Granger and Paidoussis (1996), J. Fluid Mech. 320, 163.
    """
    text = f"flow {name or '?'}"
    (D,) = positives(text, diameter=diameter)
    K, C = matrix(stiffness, f"{text}: stiffness"), matrix(damping, f"{text}: damping")
    a = np.atleast_1d(finite(amplitudes, f"{text}: amplitudes"))
    d = np.atleast_1d(positive(rates, f"{text}: rates"))
    if K.shape != C.shape:
        raise ArgumentError(f"{text}: found damping {C.shape}, expected the shape of stiffness, {K.shape}", "damping")
    if a.shape != d.shape or a.ndim != 1:
        found = f"{text}: found {counted(d.size, 'rate')}"
        raise ArgumentError(f"{found}, expected a rate for each of {counted(a.size, 'amplitude')}", "rates")
    return Flow(_law(K, -C, -a[:, None, None] * K, d, D), where, velocity, density, modes, name)


@checked
def measured(
    where: FlowSpan | Place, table: ArrayLike | PathLike[str] | str, *, velocity: float, density: float,
    diameter: float, frequencies: ArrayLike, states: int = 2, tolerance: float = TOLERANCE, modes: int | None = None,
    name: str = "",
) -> Flow:  # fmt: skip
    """Return the force of coefficients that were measured over the reduced velocity, fitted by states.

    See the module for the formula; `.law.fit` is the fit, with its misfit.

    Args:
        where: A span; or a point, whose force is then that of 1 m.
        table: Rows of reduced velocity, real and imaginary part; for two motions the parts of c_xx, c_xy, c_yx and
            c_yy; velocities increase. Or a file of such rows, with commas.
        velocity: U, m/s.
        density: rho, kg/m^3.
        diameter: D, m.
        frequencies: Angular frequencies of interest, rad/s; the table must cover them at this velocity.
        states: Exponentials of the fit, from 0 on; the table has at least two rows more.
        tolerance: Misfit, over the largest coefficient, above which a run warns.
        modes: See `Flow`.
        name: See `Flow`.

    Raises:
        UserError: The table cannot be read, has faults, or does not cover a frequency.

    Source: Tanaka and Takahara (1981), J. Sound Vib. 77, 19, for the coefficients; Karpel (1982), J. Aircraft 19, 221,
    for fits with common rates.
    """
    text = f"flow {name or '?'}"
    (D,) = positives(text, diameter=diameter)
    if states < 0:
        raise ArgumentError(f"{text}: found {counted(states, 'state')}, expected 0 or more", "states")
    if not 0.0 < tolerance < 1.0:
        raise ArgumentError(f"{text}: found tolerance {tolerance!r}, expected a number between 0 and 1", "tolerance")
    found = fit(table_rows(table, states, text), states, tolerance)
    d = 1 if len(found.names) == 1 else 2
    K, C, *lags = found.values.reshape(-1, d, d)
    interest = tuple(map(float, np.atleast_1d(positive(frequencies, f"{text}: frequencies"))))
    reduced = float(found.reduced[0]), float(found.reduced[-1])
    law = _law(K, C, np.reshape(lags, (states, d, d)), found.rates, D, reduced=reduced, fit=found, frequencies=interest)
    flow = Flow(law, where, velocity, density, modes, name)
    flow.check()
    return flow


@checked
def aerodynamic_lag(
    where: Place, *, velocity: float, density: float, half_chord: float, steady: Any, damping: Any,
    lags: ArrayLike, matrices: ArrayLike, name: str = "",
) -> Flow:  # fmt: skip
    """Return aerodynamic forces on given modes in Roger's form, without apparent mass.

    With k = w b / U the generalized forces are rho U^2 / 2 Q y e^(i w t),

        Q = A_0 + i k A_1 + sum_l A_(l+2) i k / (i k + b_l).

    The apparent mass of the form, A_2 (i k)^2, belongs to the structure: M - rho b^2 / 2 A_2.

    Args:
        where: A point or a list of points: their motions are those of the matrices, one after the other.
        velocity: U, m/s.
        density: rho, kg/m^3.
        half_chord: b, m.
        steady: A_0, (motions, motions).
        damping: A_1.
        lags: b_l, (lags,), above 0.
        matrices: A_3, A_4, ..., (lags, motions, motions).
        name: See `Flow`.

    Raises:
        UserError: A value is out of range, or shapes do not fit.

    Source: Roger (1977), AGARD CP-228, paper 4.
    """
    text = f"flow {name or '?'}"
    (b,) = positives(text, half_chord=half_chord)
    A0, A1 = matrix(steady, f"{text}: steady"), matrix(damping, f"{text}: damping")
    rates = np.atleast_1d(positive(lags, f"{text}: lags"))
    lagged = finite(matrices, f"{text}: matrices").reshape(-1)
    if A1.shape != A0.shape:
        raise ArgumentError(f"{text}: found damping {A1.shape}, expected the shape of steady, {A0.shape}", "damping")
    if lagged.size != len(rates) * A0.size:
        found = f"{text}: found {counted(lagged.size, 'number')} in matrices"
        raise ArgumentError(f"{found}, expected {len(rates)} matrices {A0.shape}, one for each lag", "matrices")
    return Flow(_law(A0, A1, lagged.reshape(len(rates), *A0.shape), rates, b), where, velocity, density, None, name)
