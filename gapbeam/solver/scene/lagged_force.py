"""Unsteady forces of a flow: memories of exponentials, fits of measured coefficients, and Roger's form."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, finite, matrix, positive, positives
from gapbeam.solver.scene.coefficient_fit import TOLERANCE, fit, table_rows
from gapbeam.solver.scene.feedback import Place
from gapbeam.solver.scene.flow_force import Flow, FlowLaw, FlowSpan, SectionForce
from gapbeam.solver.system.operators import Array


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

    See `coefficient_fit` for the formula; `.law.fit` is the fit, with its misfit.

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
