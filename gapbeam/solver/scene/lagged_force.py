"""Unsteady forces of a flow: memories of exponentials, fits of measured coefficients, and Roger's form."""

from __future__ import annotations

from itertools import product
from math import pi
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, finite, positive
from gapbeam.solver.scene.feedback import Place
from gapbeam.solver.scene.flow_force import Flow, FlowLaw, FlowSpan, lagging, square
from gapbeam.solver.system.operators import Array


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
    D = float(positive(diameter, f"{text}: diameter"))
    K, C = square(stiffness, f"{text}: stiffness"), square(damping, f"{text}: damping")
    a = np.atleast_1d(finite(amplitudes, f"{text}: amplitudes"))
    d = np.atleast_1d(positive(rates, f"{text}: rates"))
    if K.shape != C.shape:
        raise ArgumentError(f"{text}: found damping {C.shape}, expected the shape of stiffness, {K.shape}", "damping")
    if a.shape != d.shape or a.ndim != 1:
        raise ArgumentError(f"{text}: found {d.size} rates, expected a rate for each of {a.size} amplitudes", "rates")
    return Flow(FlowLaw(lagging(K, -C, -a[:, None, None] * K, d, D), D), where, velocity, density, modes, name)


@checked
def measured(
    where: FlowSpan | Place, table: ArrayLike | PathLike[str] | str, *, velocity: float, density: float,
    diameter: float, frequencies: ArrayLike, states: int = 2, modes: int | None = None, name: str = "",
) -> Flow:  # fmt: skip
    """Return the force of coefficients that were measured over the reduced velocity, fitted by states.

    A tube that moves as y e^(i w t) feels, per length, rho U^2 / 2 c(U / (f D)) y e^(i w t), f = w / (2 pi). With
    k = w D / U the fit is

        c = c_0 + c_1 i k + sum_j a_j i k / (i k + d_j),     d_j > 0,

    by least squares, the rates d_j in common to all coefficients; `.law.misfit` is its largest error over the largest
    coefficient.

    Args:
        where: A span; or a point, whose force is then that of 1 m.
        table: Rows of reduced velocity, real and imaginary part; for two motions the parts of c_xx, c_xy, c_yx and
            c_yy. Or a file of such rows, with commas.
        velocity: U, m/s.
        density: rho, kg/m^3.
        diameter: D, m.
        frequencies: Angular frequencies of interest, rad/s; the table must cover them at this velocity.
        states: Exponentials of the fit, from 0 on.
        modes: See `Flow`.
        name: See `Flow`.

    Raises:
        UserError: The table cannot be read, has too few rows, or does not cover a frequency.

    Source: Tanaka and Takahara (1981), J. Sound Vib. 77, 19, for the coefficients; Karpel (1982), J. Aircraft 19, 221,
    for fits with common rates.
    """
    text = f"flow {name or '?'}"
    D = float(positive(diameter, f"{text}: diameter"))
    rows = _rows(table, text)
    order = np.argsort(rows[:, 0])
    reduced, parts = rows[order, 0], rows[order, 1:]
    c = parts[:, 0::2] + 1j * parts[:, 1::2]
    if not 0 <= states <= len(rows) - 1:
        raise ArgumentError(
            f"{text}: found {states} states and {len(rows)} rows, expected fewer states than rows", "states"
        )
    rates, values, misfit = _fit(2.0 * pi / reduced, c, states)
    d = 1 if c.shape[1] == 1 else 2
    K, C, *lags = (one.reshape(d, d) for one in values)
    section = lagging(K, C, np.array(lags).reshape(states, d, d), rates, D)
    law = FlowLaw(section, D, (float(reduced[0]), float(reduced[-1])), misfit=misfit)
    found = Flow(law, where, velocity, density, modes, name)
    for frequency in np.atleast_1d(positive(frequencies, f"{text}: frequencies")):
        found.check(float(frequency))
    return found


def _rows(table: ArrayLike | PathLike[str] | str, where: str) -> Array:
    """Return the rows of a table."""
    if isinstance(table, (str, PathLike)):
        try:
            given: Any = np.genfromtxt(table, delimiter=",", comments="#", ndmin=2)
        except (OSError, ValueError) as error:
            raise ArgumentError(f"{where}: table {table}: {error}", "table") from None
        given = given[1:] if len(given) and np.all(np.isnan(given[0])) else given  # a line of names
    else:
        given = table
    try:
        rows = np.atleast_2d(finite(given, f"{where}: table"))
    except UserError as error:
        raise ArgumentError(str(error), "table") from None
    if rows.shape[1] not in (3, 9) or len(rows) < 2:
        raise ArgumentError(
            f"{where}: found a table of shape {rows.shape}, expected 2 rows or more of 3 or 9 columns", "table"
        )
    if not rows[:, 0].min() > 0.0 or len(np.unique(rows[:, 0])) < len(rows):
        raise ArgumentError(
            f"{where}: found {len(rows)} reduced velocities from {rows[:, 0].min():g} to {rows[:, 0].max():g}, "
            "expected numbers above 0, each once",
            "table",
        )
    return rows


def _fit(k: Array, c: Any, states: int) -> tuple[Array, Array, float]:
    """Return rates, coefficients (2 + states, columns) and the misfit; coefficients are linear for given rates."""

    def solved(logs: Array) -> tuple[Array, Array]:
        s = 1j * k[:, None]
        columns = np.hstack([np.ones_like(s), s, s / (s + np.exp(logs))])
        both, right = np.vstack([columns.real, columns.imag]), np.vstack([c.real, c.imag])
        values = np.linalg.lstsq(both, right, rcond=None)[0]
        return values, both @ values - right

    low, high = np.log(k.min() / 3.0), np.log(k.max() * 3.0)
    starts = np.linspace(low, high, max(2 * states, 3))
    best, least = np.zeros(0), np.inf
    for some in product(starts, repeat=states) if states <= 2 else [np.linspace(low, high, states)]:
        if states and np.all(np.diff(some) > 0.0):
            bounds = low - 2.0, high + 2.0
            options = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-14)
            found = least_squares(lambda x: solved(x)[1].ravel(), some, bounds=bounds, **options)
            if found.cost < least:
                best, least = found.x, found.cost
    values, left = solved(best)
    size = np.abs(c).max()
    misfit = np.abs(left[: len(k)] + 1j * left[len(k) :]).max() / size if size > 0.0 else 0.0
    return np.exp(best), values, float(misfit)


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
    b = float(positive(half_chord, f"{text}: half_chord"))
    A0, A1 = square(steady, f"{text}: steady"), square(damping, f"{text}: damping")
    rates = np.atleast_1d(positive(lags, f"{text}: lags"))
    lagged = finite(matrices, f"{text}: matrices").reshape(-1)
    if A1.shape != A0.shape:
        raise ArgumentError(f"{text}: found damping {A1.shape}, expected the shape of steady, {A0.shape}", "damping")
    if lagged.size != len(rates) * A0.size:
        raise ArgumentError(
            f"{text}: found {lagged.size} numbers in matrices, expected {len(rates)} matrices {A0.shape}, one for each "
            "lag",
            "matrices",
        )
    shaped = lagged.reshape(len(rates), *A0.shape)
    return Flow(FlowLaw(lagging(A0, A1, shaped, rates, b), b), where, velocity, density, None, name)
