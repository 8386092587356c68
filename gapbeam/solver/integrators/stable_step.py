"""The largest stable step of the explicit scheme.

    dt <= 2/omega (sqrt(1 + xi^2) - xi),   omega^2 = lambda_max(M^-1 (K + G^T w k G)),   xi = delta / (2 omega),
    delta = lambda_max(M^-1 (c_K K + G^T w c G))

with stiffness k and damping c of the contact law, closed everywhere. Massless contact nodes are held by the contact:
they do not take part, and k and c play no role. M belongs to the body alone: masses attached to it lower
its frequencies, so that the step is on the safe side. Dashpots are implicit.

Source: Belytschko, Liu, Moran and Elkhodary (2014), ch. 6; Lanczos (1950) for the largest eigenvalue.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import ROUND_FLOOR, Context
from math import floor, frexp, inf, ldexp, sqrt

import numpy as np
from scipy.linalg import eigh_tridiagonal

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.rank_one_update import AttachedOperators
from gapbeam.solver.system.semi_discrete import SemiDiscreteSystem

SAFETY = 0.9
ACCURACY = 1.0e-3
MOST_ITERATIONS = 200
BINARY_DIGITS = 7


@dataclass(frozen=True)
class StableStep:
    """The largest step with its safety, the one without damping (both s), the highest frequency (rad/s)."""

    step: float
    undamped: float
    frequency: float

    @property
    def written(self) -> str:
        """The step in three digits, none of them rounded up."""
        return f"{float(Context(prec=3, rounding=ROUND_FLOOR).create_decimal(self.step)):g}"


def stable_step(system: SemiDiscreteSystem, law: ContactLaw, depth: float) -> StableStep:
    """Return the largest step that the explicit scheme is given.

    M of the body has to be diagonal. The step is rounded down to seven binary digits, so that it does not depend on the
    number of ranks, nor its digits on the size of the scene.

    Args:
        system: The system.
        law: Its contact law.
        depth: Depth at which the slope of laws with an exponent is taken, m.

    Collective.
    """
    operators, contact = system.operators, system.contact
    body = operators.body if isinstance(operators, AttachedOperators) else operators
    masses = body.apply_mass(np.ones(operators.size))
    scale = np.where(operators.massless, 0.0, 1.0 / np.sqrt(np.where(operators.massless, 1.0, masses)))
    touched = np.full(contact.size, depth)
    stiffness, damping = law.static(touched).slope, law.damping(touched)

    def springs(per_area: Array, x: Array) -> Array:
        point_forces = contact.weights * per_area * (contact.gap_matrix @ contact.interface.trace(x, operators))
        result = np.zeros_like(x)
        contact.interface.add(result, contact.resultant(point_forces))
        return result

    def elastic(x: Array) -> Array:
        x = scale * x
        return np.asarray(scale * (operators.apply_stiffness(x) + springs(stiffness, x)))

    def damped(x: Array) -> Array:
        x = scale * x
        return np.asarray(scale * (system.stiffness_damping * operators.apply_stiffness(x) + springs(damping, x)))

    frequency = sqrt(_largest_eigenvalue(system, elastic))
    is_damped = system.stiffness_damping > 0.0 or bool(np.any(damping > 0.0))
    ratio = 0.5 * _largest_eigenvalue(system, damped) / frequency if is_damped else 0.0
    undamped = SAFETY * 2.0 / frequency
    limit = undamped / (sqrt(1.0 + ratio * ratio) + ratio)
    return StableStep(_rounded_down(limit), _rounded_down(undamped), frequency)


def _largest_eigenvalue(system: SemiDiscreteSystem, apply: Callable[[Array], Array]) -> float:
    """Return an upper estimate of the largest eigenvalue of a symmetric operator, by Lanczos iteration. Collective."""

    def norm(x: Array) -> float:
        return sqrt(float(system.dots([(x, x)])[0]))

    vector: Array = np.random.default_rng(1).standard_normal(system.operators.size)
    vector /= norm(vector)
    before, beta = np.zeros_like(vector), 0.0
    diagonal: list[float] = []
    below: list[float] = []
    bound = inf
    for _ in range(MOST_ITERATIONS):
        image = np.asarray(apply(vector) - beta * before)
        diagonal.append(float(system.dots([(vector, image)])[0]))
        image -= diagonal[-1] * vector
        beta = norm(image)
        values, vectors = eigh_tridiagonal(np.array(diagonal), np.array(below))
        error = beta * abs(float(vectors[-1, -1]))
        bound = float(values[-1]) + error
        if error <= ACCURACY * bound:
            break
        below.append(beta)
        before, vector = vector, np.asarray(image / beta)
    return bound


def _rounded_down(value: float) -> float:
    mantissa, exponent = frexp(value)
    return ldexp(floor(ldexp(mantissa, BINARY_DIGITS) * (1.0 + 1.0e-9)), exponent - BINARY_DIGITS)
