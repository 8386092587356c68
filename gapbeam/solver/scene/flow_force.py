"""Forces of a flow: linear forces per length that follow the motion, spread over a span or at points.

A law gives, for a velocity U and unit density, states and force per length of one section:

    z' = A z + B (y, y'),     f = C z + D (y, y').

It is integrated over the span with the profiles of velocity and density; the force is a `Feedback`. Quasi-steady forces
of a cross flow on a tube lag behind the motion by a delay: exp(-s tau) is a Pade approximant of order p, a quotient of
polynomials Q(-s tau) / Q(s tau), whose partial fractions are its states.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import factorial, inf, pi
from typing import Any, NamedTuple

import numpy as np
import scipy
import scipy.linalg as sl

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import (
    ArgumentError,
    answered,
    checked,
    finite,
    for_each,
    matrix,
    positive,
    positives,
)
from gapbeam.solver.scene.feedback import Feedback, Place, motions_of, side_by_side
from gapbeam.solver.scene.structure import Structure, StructurePoint, dense
from gapbeam.solver.system.operators import Array

Profile = float | Callable[[Array], Any]
KEPT = 1e-9  # of the largest: directions below are round-off of the quadrature
SAME, DEGREE = 1e-9, 5  # relative, of two velocities or frequencies; of the spline along a span


@dataclass(frozen=True, eq=False)
class FlowSpan:
    """Points of one structure in a flow.

    Attributes:
        points: StructurePoints of the same motions: 1 across the flow, or 2, along and across the flow.
        lengths: Length that each point stands for, (points,), m.
        velocity: Velocity at each point over the reference velocity, (points,).
        density: Density at each point over the reference density, (points,).
    """

    points: tuple[StructurePoint, ...]
    lengths: Array
    velocity: Array
    density: Array

    @property
    def structure(self) -> Structure:
        """The tube."""
        return self.points[0].structure

    def directions(self, modes: int | None = None) -> list[tuple[StructurePoint, float]]:
        """Return the fewest points that feel the same forces in the lowest modes, each with its share of the velocity.

        Points with one velocity are joined: sum_k w_k b_k b_k^T with weights w of length and density is kept exactly,
        by the singular vectors of sqrt(w_k) b_k.
        """
        rows = np.stack([point.rows for point in self.points])
        if modes is not None:
            X = self.structure.modes[2]
            if not 1 <= modes <= X.shape[1]:
                raise ArgumentError(f"flow: found {modes} modes, expected 1 to {X.shape[1]}", "modes")
            rows = rows @ X[:, :modes] @ (X[:, :modes].T @ dense(self.structure.M))
        weighted, found = np.sqrt(self.lengths * self.density)[:, None, None] * rows, []
        for velocity in np.unique(self.velocity):
            some = weighted[self.velocity == velocity]
            U, sizes, _ = np.linalg.svd(some.reshape(len(some), -1), full_matrices=False)
            U = U[:, sizes > KEPT * sizes[0]] if sizes[0] > 0.0 else U[:, :0]
            joined = np.einsum("kj,kdn->jdn", U, some)
            found += [(StructurePoint(self.structure, one), float(velocity)) for one in joined]
        return found


@checked
def span(
    structure: Structure, places: Mapping[str, float], velocity: Profile = 1.0, density: Profile = 1.0
) -> FlowSpan:
    """Return the span of a tube between the first and the last of some of its points.

    Integrals along the span are those of a spline of degree 5 through the points: the error falls with the sixth power
    of their distance.

    Args:
        structure: The tube.
        places: Places along the tube by name of a point, m; two or more, the ends of the span among them.
        velocity: Profile of the velocity over a reference velocity: a number, or a function of the places.
        density: Profile of the density over a reference density.

    Raises:
        UserError: A point is unknown, places coincide or are too uneven, or a profile is not positive.
    """
    where = f"span of {structure.name or '?'}"
    names = sorted(places, key=lambda name: float(places[name]))
    x = finite([places[name] for name in names], f"{where}: places")
    if len(x) < 2 or not np.all(np.diff(x) > 0.0):
        raise UserError(f"{where}: found places {x.tolist()}, expected two or more that differ")
    points = tuple(structure[name] for name in names)
    if len({len(point.rows) for point in points}) > 1:
        raise UserError(f"{where}: its points have different numbers of motions; expected the same number")
    spline = scipy.interpolate.make_interp_spline(x, np.eye(len(x)), k=min(DEGREE, len(x) - 1))
    lengths = spline.integrate(x[0], x[-1])
    if not np.all(lengths > 0.0):
        raise UserError(f"{where}: the places are too uneven for a spline; space the points evenly")
    profiles = []
    given: list[tuple[Any, str]] = [(velocity, "velocity"), (density, "density")]
    for profile, what in given:
        named, values = f"{where}: {what}", profile
        if callable(profile):
            values = [float(answered(profile, one, (1,), f"{named}: its function at {one:.6g} m")[0]) for one in x]
        profiles.append(positive(for_each(values, len(x), named), named).copy())
    return FlowSpan(points, lengths, *profiles)


@checked
def in_fluid(dry: Structure, places: Mapping[str, float], mass: float) -> Structure:
    """Return a structure that carries the added mass of a fluid along a span; the added mass has no weight.

    Args:
        dry: The structure.
        places: As of `span`.
        mass: Added mass per length, kg/m.

    Raises:
        UserError: As `span`; or the mass is negative.
    """
    (per_length,), along = positives(f"fluid around {dry.name or '?'}", zero=True, mass=mass), span(dry, places)
    M = dense(dry.M).copy()
    for point, length in zip(along.points, along.lengths, strict=True):
        M += per_length * length * point.rows.T @ point.rows
    rows = {name: point.rows for name, point in dry.points.items()}
    return Structure(M, dry.K, dry.C, rows, dry.rigid, dry.name, dry.inertia, dry.frame or None).made_of(dry)


MOTIONS = "motions"  # the argument of a fault where a law is of other motions than its points


class SectionForce(NamedTuple):
    """Force per length on motions of a section at unit density, A to D as of `Feedback`.

    Also the delay of the force, s, and the largest relative error of the transfer function that states stand for.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    delay: float = 0.0
    error: float = 0.0


@dataclass(frozen=True, eq=False)
class FlowLaw:
    """A force per length as a function of the velocity.

    Attributes:
        section: The force of a velocity, m/s.
        diameter: D, m.
        reduced: Range of U/(f D) that was measured.
        highest: Angular frequency up to which a delay keeps its error, rad/s.
        fit: `CoefficientFit` of measured coefficients; default none.
        frequencies: Angular frequencies of interest, rad/s, at which the law must hold where a scene marches.
    """

    section: Callable[[float], SectionForce]
    diameter: float
    reduced: tuple[float, float] = (0.0, inf)
    highest: float = inf
    fit: Any = None
    frequencies: tuple[float, ...] = ()


class Flow(Feedback):
    """The force of a flow on a span or at points; its paths are "name.velocity" and "name.density".

    Args:
        law: Result of `quasi_steady`, `unsteady`, `measured` or `aerodynamic_lag`.
        where: A span; or a point, or a list of points, whose motions the law couples.
        velocity: Reference velocity, m/s.
        density: Reference density, kg/m^3.
        modes: The force acts on so many modes of the structure, from the lowest; default all.
        name: Name in messages and paths.

    Raises:
        UserError: A value is out of range, or motions do not fit.
    """

    def __init__(
        self, law: FlowLaw, where: FlowSpan | Place, velocity: float, density: float, modes: int | None = None,
        name: str = "",
    ) -> None:  # fmt: skip
        text, self.law = f"flow {name or '?'}", law
        if isinstance(where, FlowSpan):
            parts = where.directions(modes)
            place: Place = [point for point, _ in parts]
            self.sections = [(share, len(point.rows)) for point, share in parts]
        elif modes is None:
            place, self.sections = where, [(1.0, motions_of(where))]
        else:
            raise ArgumentError(f"{text}: found modes = {modes} at points, expected them for a span only", "modes")
        self.velocity, self.density = positives(text, velocity=velocity, density=density)
        super().__init__(place, place, *self._matrices(text), name)

    def _matrices(self, where: str) -> tuple[Array, Array, Array, Array]:
        """Return the matrices of all sections one after the other."""
        known = {share: self.law.section(self.velocity * share) for share, _ in self.sections}
        found = [known[share] for share, _ in self.sections]
        for one, (_, motions) in zip(found, self.sections, strict=True):
            if len(one.D) != motions:
                words = f"found points of {counted(motions, 'motion')} and a law of {len(one.D)}"
                raise ArgumentError(f"{where}: {words}", MOTIONS)
        self.delay, self.error = max(one.delay for one in found), max(one.error for one in found)
        A, B, C, D = side_by_side(found)
        order = np.argsort(np.concatenate([np.arange(len(one.A)) for one in found]), kind="stable")
        return A[np.ix_(order, order)], B[order], self.density * C[:, order], self.density * D  # like states together

    def check(self, *frequencies: float) -> None:
        """See `Feedback.check`."""
        law, where = self.law, f"flow {self.name or '?'}"
        shares = {share for share, _ in self.sections}
        for U, w in product((self.velocity * share for share in shares), frequencies or law.frequencies):
            found, (low, high) = 2.0 * pi * U / (w * law.diameter), law.reduced
            if not low * (1.0 - SAME) <= found <= high * (1.0 + SAME):
                raise ArgumentError(
                    f"{where}: reduced velocity U/(f D) = {found:.4g} at {U:.4g} m/s and {0.5 * w / pi:.4g} Hz is "
                    f"outside of the table, {low:.4g} to {high:.4g}; measure there, or take another velocity",
                    "velocity",
                )
            if w > law.highest * (1.0 + SAME):
                raise UserError(
                    f"{where}: the motion has {0.5 * w / pi:.4g} Hz, but states of its delay cover up to "
                    f"{0.5 * law.highest / pi:.4g} Hz; give a larger `frequency` (in Python {w:.4g} rad/s)"
                )

    def replaced(self, name: str, value: Any) -> Flow:
        """Return the flow at another "velocity" or "density", one number; refuse another name."""
        where = f"flow {self.name or '?'}"
        if name not in ("velocity", "density"):
            raise UserError(f"{where} has no value {name!r}; it has velocity, density")
        if finite(value, where).ndim:
            raise UserError(f"{where}: found several values of {name}; a flow has one {name}")
        other: Flow = object.__new__(type(self))
        other.__dict__ |= self.__dict__ | {name: positives(where, **{name: value})[0]}
        other.A, other.B, other.C, other.D = other._matrices(where)
        return other


def fit_doubts(feedbacks: Iterable[Feedback]) -> list[str]:
    """Return a sentence for each fit of measured coefficients that misses them by more than its tolerance."""
    fits = [(one.name, one.law.fit) for one in feedbacks if isinstance(one, Flow)]
    return [f"{name or 'flow'}: {fit.doubt}" for name, fit in fits if fit is not None and fit.doubt]


HIGHEST = 12  # order beyond which round-off of the partial fractions is larger than what another order gains


def pade_error(order: int, angle: float) -> float:
    """Return |R(i a) - exp(-i a)| of the Pade approximant R at the angle a = omega tau; it grows with the angle."""
    Q = np.polyval(_polynomial(order), 1j * angle)
    return float(abs(np.conj(Q) / Q - np.exp(-1j * angle)))


def pade_order(angle: float, tolerance: float) -> int:
    """Return the least order whose error is within a tolerance up to an angle omega tau; refuse too large an angle."""
    for order in range(angle > 0.0, HIGHEST + 1):
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
    P, slope = Q * (-1.0) ** np.arange(order, -1, -1), np.polyder(Q)
    A, b, c = list[Array](), list[float](), list[float]()
    for pole in np.roots(Q):
        if pole.imag < 0.0:
            continue
        pole -= np.polyval(Q, pole) / np.polyval(slope, pole)
        residue = np.polyval(P, pole) / np.polyval(slope, pole)
        if abs(pole.imag) < 1e-9 * abs(pole):
            A, b, c = [*A, np.array([[pole.real]])], [*b, 1.0], [*c, float(residue.real)]
        else:
            A += [np.array([[pole.real, pole.imag], [-pole.imag, pole.real]])]
            b, c = [*b, 1.0, 0.0], [*c, float(2.0 * residue.real), float(2.0 * residue.imag)]
    return sl.block_diag(np.zeros((0, 0)), *A), np.array(b), np.array(c), (-1.0) ** order


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
    D, highest = positives(text, diameter=diameter, frequency=frequency)
    mu, steady = positives(text, zero=True, delay=delay, drag=drag)
    tilt, gradient = float(finite(lift, f"{text}: lift")), matrix(slope, f"{text}: slope")
    d = len(gradient)
    if d > 2:
        raise UserError(f"{text}: found a slope of shape {gradient.shape}, expected a number or a matrix (2, 2)")
    drags = np.array([[-steady]]) if d == 1 else np.array([[-2.0 * steady, tilt], [-2.0 * tilt, -steady]])
    if not 0.0 < tolerance < 1.0:
        raise UserError(f"{text}: found tolerance {tolerance!r}, expected a number between 0 and 1")

    def section(U: float) -> SectionForce:
        q, tau, unit = 0.5 * U * U * D, mu * D / U, np.eye(d)
        order = pade_order(highest * tau, tolerance)
        A, b, c, through = pade_states(order)
        read = np.hstack([np.kron(b[:, None], unit), np.zeros((order * d, d))]) / tau
        inner: Any = np.kron(A, unit) / tau
        direct = q * np.hstack([through * gradient / D, drags / U])
        return SectionForce(inner, read, q / D * np.kron(c, gradient), direct, tau, pade_error(order, highest * tau))

    return Flow(FlowLaw(section, D, highest=highest), where, velocity, density, modes, name)
