"""Forces of a flow: linear forces per length that follow the motion, spread over a span or at points.

A law gives, for a velocity U and unit density, states and force per length of one section:

    z' = A z + B (y, y'),     f = C z + D (y, y').

It is integrated over the span with the profiles of velocity and density. The force is a `Feedback`: its states follow
the time scheme, and stability boundaries of the linear system hold at any step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as sl

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.feedback import Feedback, Place, motions_of
from gapbeam.solver.scene.flow_span import FlowSpan
from gapbeam.solver.scene.given_numbers import ArgumentError, finite, positive
from gapbeam.solver.system.operators import Array

MOTIONS = "motions"
"""The argument of a fault where a law is of other motions than its points."""


class SectionForce(NamedTuple):
    """Force per length on d motions of a section, at unit density.

    Attributes:
        A: (n, n), 1/s.
        B: (n, 2 d): displacements first.
        C: (d, n).
        D: (d, 2 d).
        delay: Time that the force lags behind the motion, s.
        error: Largest relative error of the transfer function that states stand for.
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
        reduced: Range of U/(f D) that was measured; default any.
        highest: Angular frequency up to which a delay keeps its error, rad/s; default any.
        misfit: Largest error of a fit over the largest coefficient.
    """

    section: Callable[[float], SectionForce]
    diameter: float
    reduced: tuple[float, float] | None = None
    highest: float | None = None
    misfit: float = 0.0

    def check(self, velocity: float, frequency: float, where: str) -> None:
        """Raise UserError if the law does not hold for a velocity, m/s, and an angular frequency, rad/s."""
        if self.reduced is not None:
            found, (low, high) = 2.0 * pi * velocity / (frequency * self.diameter), self.reduced
            if not low * (1.0 - 1e-9) <= found <= high * (1.0 + 1e-9):
                raise ArgumentError(
                    f"{where}: reduced velocity U/(f D) = {found:.4g} at {velocity:.4g} m/s and {frequency:.4g} rad/s "
                    f"is outside of the table, {low:.4g} to {high:.4g}; measure there, or take another velocity",
                    "velocity",
                )
        if self.highest is not None and frequency > self.highest * (1.0 + 1e-9):
            raise UserError(
                f"{where}: the motion has {frequency:.4g} rad/s, but states of its delay cover {self.highest:.4g} "
                "rad/s; give a larger `frequency`"
            )


class Flow(Feedback):
    """The force of a flow on a span or at points; its paths are "name.velocity" and "name.density".

    Args:
        law: Of `quasi_steady`, `unsteady`, `measured` or `aerodynamic_lag`.
        where: A span; or a point, or a list of points, whose motions the law couples.
        velocity: Reference velocity, m/s.
        density: Reference density, kg/m^3.
        modes: The force acts on so many modes of the structure, from the lowest; default all.
        name: For messages and paths.

    Raises:
        UserError: A value is out of range, or motions do not fit.
    """

    def __init__(
        self, law: FlowLaw, where: FlowSpan | Place, velocity: float, density: float, modes: int | None = None,
        name: str = "",
    ) -> None:  # fmt: skip
        text = f"flow {name or '?'}"
        self.law, self.parts = law, [] if not isinstance(where, FlowSpan) else where.directions(modes)
        self.velocity = float(positive(velocity, f"{text}: velocity"))
        self.density = float(positive(density, f"{text}: density"))
        if isinstance(where, FlowSpan):
            place: Place = [point for point, _ in self.parts]
            self.sections = [(share, len(point.rows)) for point, share in self.parts]
        else:
            if modes is not None:
                raise ArgumentError(f"{text}: found modes = {modes} at points, expected them for a span only", "modes")
            place, self.sections = where, [(1.0, motions_of(where))]
        super().__init__(place, place, *self._matrices(text), name)

    def _matrices(self, where: str) -> tuple[Array, Array, Array, Array]:
        """Return the matrices of all sections one after the other."""
        known = {share: self.law.section(self.velocity * share) for share, _ in self.sections}
        found = [known[share] for share, _ in self.sections]
        for one, (_, motions) in zip(found, self.sections, strict=True):
            if len(one.D) != motions:
                raise ArgumentError(f"{where}: found points of {motions} motions and a law of {len(one.D)}", MOTIONS)
        self.delay = max(one.delay for one in found)
        self.error = max(one.error for one in found)

        def halves(name: str) -> Array:
            pairs = [np.split(getattr(one, name), 2, axis=1) for one in found]
            return np.hstack([sl.block_diag(*(pair[i] for pair in pairs)) for i in (0, 1)])

        A, C = (sl.block_diag(*(getattr(one, name) for one in found)) for name in ("A", "C"))
        return A, halves("B"), self.density * C, self.density * halves("D")

    def check(self, frequency: float) -> None:
        """Raise UserError if the law does not hold at an angular frequency, rad/s."""
        for share in {share for share, _ in self.sections}:
            self.law.check(self.velocity * share, frequency, f"flow {self.name or '?'}")

    def replaced(self, name: str, value: Any) -> Flow:
        """Return the flow at another "velocity" or "density".

        Raises:
            UserError: It has no such value, or several values are given.
        """
        where = f"flow {self.name or '?'}"
        if name not in ("velocity", "density"):
            raise UserError(f"{where} has no value {name!r}; it has velocity, density")
        if finite(value, where).ndim:
            raise UserError(f"{where}: found several values of {name}; a flow has one {name}")
        other: Flow = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        setattr(other, name, float(positive(value, f"{where}: {name}")))
        other.A, other.B, other.C, other.D = other._matrices(where)
        return other


def lagging(
    stiffness: Array, damping: Array, amplitudes: Array, rates: Array, size: float
) -> Callable[[float], SectionForce]:
    """Return f = U^2/2 [K y + (D/U) C y' + sum_i A_i z_i] with z_i' = y' - d_i (U/D) z_i.

    Args:
        stiffness: K, (d, d).
        damping: C, (d, d).
        amplitudes: A_i, (states, d, d).
        rates: d_i, (states,).
        size: D, m.
    """
    d, count = len(stiffness), len(rates)

    def section(velocity: float) -> SectionForce:
        q, unit = 0.5 * velocity**2, np.eye(d)
        B = np.hstack([np.zeros((count * d, d)), np.tile(unit, (count, 1))])
        C = q * np.hstack([np.zeros((d, 0)), *amplitudes])
        D = q * np.hstack([stiffness, size / velocity * damping])
        return SectionForce(-velocity / size * np.kron(np.diag(rates), unit), B, C, D)

    return section


def square(value: Any, where: str) -> Array:
    """Return a number or a square matrix as a matrix.

    Raises:
        UserError: It is neither.
    """
    found = np.atleast_2d(finite(value, where))
    if found.ndim != 2 or found.shape[0] != found.shape[1]:
        raise UserError(f"{where}: found shape {found.shape}, expected a number or a square matrix")
    return found
