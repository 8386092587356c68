"""Quasi-steady forces of a cross flow on a tube, which lag behind the motion by a delay.

The delay exp(-s tau) is a Pade approximant of order p, a quotient of polynomials Q(-s tau) / Q(s tau); its states are
the partial fractions of this quotient.
"""

from __future__ import annotations

from functools import lru_cache
from math import factorial
from typing import Any

import numpy as np
import scipy.linalg as sl

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.feedback import Place
from gapbeam.solver.scene.flow_force import Flow, FlowLaw, SectionForce, square
from gapbeam.solver.scene.flow_span import FlowSpan
from gapbeam.solver.scene.given_numbers import ArgumentError, finite, positive
from gapbeam.solver.system.operators import Array

HIGHEST = 12
"""Order beyond which round-off of the partial fractions is larger than what another order gains."""


def pade_error(order: int, angle: float) -> float:
    """Return |R(i a) - exp(-i a)| of the Pade approximant R at the angle a = omega tau; it grows with the angle."""
    Q = np.polyval(_polynomial(order), 1j * angle)
    return float(abs(np.conj(Q) / Q - np.exp(-1j * angle)))


def pade_order(angle: float, tolerance: float) -> int:
    """Return the least order whose error is within a tolerance up to an angle omega tau.

    Raises:
        UserError: Even the highest order has a larger error.
    """
    for order in range(1, HIGHEST + 1):
        if pade_error(order, angle) <= tolerance:
            return order
    raise ArgumentError(
        f"delay: omega tau = {angle:.3g} has an error of {pade_error(HIGHEST, angle):.2g} with {HIGHEST} states, "
        f"expected at most {tolerance:g}; give a lower `frequency`, or a larger `tolerance`",
        "frequency",
    )


def _polynomial(order: int) -> Array:
    """Return the coefficients of Q, the highest power first."""
    powers = range(order, -1, -1)
    return np.array([factorial(2 * order - j) / (factorial(j) * factorial(order - j)) for j in powers], dtype=float)


@lru_cache(maxsize=64)
def pade_states(order: int) -> tuple[Array, Array, Array, float]:
    """Return A, b, c, d of x' = A x + b u, y = c x + d u, which delays u by 1 s.

    Source: Baker and Graves-Morris (1996), Pade Approximants, sec. 1.2, for the polynomials.
    """
    Q = _polynomial(order)
    P = Q * (-1.0) ** np.arange(order, -1, -1)
    A, b, c = list[Array](), list[float](), list[float]()
    for pole in np.roots(Q):
        if pole.imag < 0.0:
            continue
        pole -= np.polyval(Q, pole) / np.polyval(np.polyder(Q), pole)
        residue = np.polyval(P, pole) / np.polyval(np.polyder(Q), pole)
        if abs(pole.imag) < 1e-9 * abs(pole):
            A, b, c = [*A, np.array([[pole.real]])], [*b, 1.0], [*c, float(residue.real)]
        else:
            A += [np.array([[pole.real, pole.imag], [-pole.imag, pole.real]])]
            b, c = [*b, 1.0, 0.0], [*c, float(2.0 * residue.real), float(2.0 * residue.imag)]
    return sl.block_diag(*A), np.array(b), np.array(c), (-1.0) ** order


@checked
def quasi_steady(
    where: FlowSpan | Place, *, velocity: float, density: float, diameter: float, drag: float, slope: Any,
    frequency: float, lift: float = 0.0, delay: float = 1.0, tolerance: float = 1e-5, modes: int | None = None,
    name: str = "",
) -> Flow:  # fmt: skip
    """Return the quasi-steady force of a cross flow on a tube in a bundle, which lags behind the displacement.

    Across the flow, for points of one motion y, per length:

        f = rho U^2 D / 2 [ slope y(t - tau) / D - C_D y' / U ],     tau = delay D / U.

    For points of two motions (x along, y across the flow) the relative velocity turns drag and lift:

        f_x = rho U^2 D / 2 [ (dC_D/dx x + dC_D/dy y)(t - tau) / D - 2 C_D x' / U + C_L y' / U ],
        f_y = rho U^2 D / 2 [ (dC_L/dx x + dC_L/dy y)(t - tau) / D - 2 C_L x' / U - C_D y' / U ].

    Args:
        where: A span; or a point, whose force is then that of 1 m.
        velocity: U, of which the coefficients are, m/s.
        density: rho, kg/m^3.
        diameter: D, m.
        drag: C_D.
        slope: dC_L/d(y/D); for two motions [[dC_D/d(x/D), dC_D/d(y/D)], [dC_L/d(x/D), dC_L/d(y/D)]].
        frequency: Largest angular frequency of interest, rad/s: the order of the delay follows from omega tau.
        lift: C_L of the tube at rest.
        delay: mu, of the order of 1.
        tolerance: Error of the delay in the transfer function up to that frequency; `.error` is the error there.
        modes: See `Flow`.
        name: See `Flow`.

    Raises:
        UserError: A value is out of range, or the delay is too long for that frequency.

    Source: Price and Paidoussis (1984), J. Sound Vib. 97, 615; (1986), J. Sound Vib. 107, 1.
    """
    text = f"flow {name or '?'}"
    D, highest = float(positive(diameter, f"{text}: diameter")), float(positive(frequency, f"{text}: frequency"))
    mu = float(positive(delay, f"{text}: delay", zero=True))
    steady, tilt = float(positive(drag, f"{text}: drag", zero=True)), float(finite(lift, f"{text}: lift"))
    gradient = square(slope, f"{text}: slope")
    d = len(gradient)
    if d > 2:
        raise UserError(f"{text}: found a slope of shape {gradient.shape}, expected a number or a matrix (2, 2)")
    drags = np.array([[-steady]]) if d == 1 else np.array([[-2.0 * steady, tilt], [-2.0 * tilt, -steady]])
    if not 0.0 < tolerance < 1.0:
        raise UserError(f"{text}: found tolerance {tolerance!r}, expected a number between 0 and 1")

    def section(U: float) -> SectionForce:
        q, tau, unit = 0.5 * U * U * D, mu * D / U, np.eye(d)
        if tau == 0.0:
            none = np.zeros((0, 0))
            return SectionForce(none, np.zeros((0, 2 * d)), np.zeros((d, 0)), q * np.hstack([gradient / D, drags / U]))
        order = pade_order(highest * tau, tolerance)
        A, b, c, through = pade_states(order)
        read = np.hstack([np.kron(b[:, None], unit), np.zeros((order * d, d))]) / tau
        direct = q * np.hstack([through * gradient / D, drags / U])
        error = pade_error(order, highest * tau)
        inner = np.asarray(np.kron(A, unit) / tau, dtype=float)
        return SectionForce(inner, read, q / D * np.kron(c, gradient), direct, tau, error)

    return Flow(FlowLaw(section, D, highest=highest), where, velocity, density, modes, name)
