"""Linear stability of scenes: eigenvalues with feedback, with chosen contacts closed and all others idle.

    x' = S x,     x = (coordinates, velocities, states of the feedback).

A closed contact is a spring and damper to its place at rest in all of its motions; an idle contact does nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, positive, shown
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.feedback import Feedback, Joint, side_by_side
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.shipped_laws import KelvinVoigt
from gapbeam.solver.system.operators import Array

Closed = Iterable[str] | Mapping[str, float | tuple[float, float]]
SAME = 4.0 * float(np.finfo(float).eps)
MOST = 4096
"""Sets of idle supports that are tried at most."""


@checked
def eigenvalues(scene: Scene, closed: Closed = ()) -> Any:
    """Return the eigenvalues of the linear scene, 1/s, complex, the largest growth rate first.

    Args:
        scene: Its feedback acts, its loads do not.
        closed: Names of contacts that are closed, by stiffness and damping of their linear law; or a mapping of names
            to a stiffness, N/m, or to (stiffness, damping). All other contacts are idle.

    Raises:
        UserError: A name is unknown, a law is not linear, or a structure has too many DOFs.
    """
    values = np.linalg.eigvals(state_matrix(scene, closed))
    return values[np.lexsort((-values.imag, -values.real))]


def state_matrix(scene: Scene, closed: Closed = ()) -> Array:
    """Return S of x' = S x, x = (q, v, z); see `eigenvalues`."""
    if scene.is_large:
        raise UserError("eigenvalues: a structure is too large; reduce it: gapbeam.reduced_at_points")
    feedbacks, damping = [*scene.feedbacks, *closed_joints(scene, closed)], scene.damping
    sense, act = scene.rows([one.sense for one in feedbacks]), scene.rows([one.act for one in feedbacks])
    A, B, C, D = side_by_side(feedbacks)
    (Bd, Bv), (Dd, Dv), n = np.split(B, 2, axis=1), np.split(D, 2, axis=1), scene.size
    K = np.diag(scene.squares) - act.T @ Dd @ sense
    drag = (np.diag(damping[0]) if len(damping) == 1 else damping) - act.T @ Dv @ sense
    rows = [np.zeros((n, n)), np.eye(n), np.zeros((n, len(A)))], [-K, -drag, act.T @ C], [Bd @ sense, Bv @ sense, A]
    return np.block([*rows])


def closed_joints(scene: Scene, closed: Closed) -> list[Feedback]:
    """Return closed contacts as springs and dampers."""
    if isinstance(closed, str) or not isinstance(closed, Sequence | Mapping):
        raise UserError(f"closed: found {shown(closed)}, expected a list of names of contacts, or a mapping of them")
    known, found = {one.name: one for one in scene.contacts if one.name}, list[Feedback]()
    for name in closed:
        if name not in known:
            names = ", ".join(known) or "none"
            raise UserError(f"closed: no contact is called {name!r}; contacts with a name: {names}")
        given = closed[name] if isinstance(closed, Mapping) else _linear(known[name])
        values = np.atleast_1d(positive(given, f"closed: {name}", zero=True))
        if values.size > 2:
            raise UserError(f"closed: {name}: found {given!r}, expected a stiffness, or (stiffness, damping)")
        found.append(Joint(known[name].between, float(values[0]), float(values[1:].sum())))
    return found


def _linear(contact: Contact) -> tuple[float, float]:
    """Return stiffness and damping of a linear law."""
    if contact.law.kind is not KelvinVoigt or any(np.ndim(value) for value in contact.law.values):
        raise UserError(
            f"closed: the law of contact {contact.name} has no stiffness that is one number; give it: "
            f"closed={{{contact.name!r}: 1e6}}"
        )
    stiffness, damping = contact.law.values
    return float(stiffness), float(damping)


@checked
def root_locus(scene: Scene, path: str, values: ArrayLike, closed: Closed = (), modes: int | None = None) -> Any:
    """Return eigenvalues of the modes of a scene over a value, followed from mode to mode, (values, modes), complex.

    The modes are those of the scene without feedback, from the lowest frequency. Eigenvalues are matched to those of
    the value before by the least sum of distances.

    Args:
        scene: See `eigenvalues`.
        path: As in `scene.with_`, such as "flow.velocity".
        values: In the order in which they are followed; steps must be small beside the distance of two modes.
        closed: See `eigenvalues`.
        modes: Followed modes; default all that oscillate.

    Raises:
        UserError: As `eigenvalues` and `scene.with_`.
    """
    bare = scene.with_parts(scene.contacts, scene.loads, [])
    known = eigenvalues(bare, closed)
    known = known[known.imag > 0.0]
    known = known[np.argsort(known.imag)][: modes or len(known)]
    rows, last = [], known
    for value in np.atleast_1d(finite(values, path)):
        found = eigenvalues(scene.with_({path: float(value)}), closed)
        distance = np.abs(last[:, None] - found[None])
        last = found[scipy.optimize.linear_sum_assignment(distance)[1]]
        rows.append(last)
    return np.array(rows)


@dataclass(frozen=True)
class CriticalVelocity:
    """The value at which a scene turns unstable.

    Attributes:
        value: Value of the path, m/s for a velocity.
        frequency: Angular frequency of the mode that turns unstable, rad/s; 0 for divergence.
        eigenvalue: At this value, 1/s.
        residual: Growth rate that is left there over the size of the eigenvalue.
    """

    value: float
    frequency: float
    eigenvalue: complex
    residual: float


@checked
def critical_velocity(scene: Scene, path: str, low: float, high: float, closed: Closed = ()) -> CriticalVelocity:
    """Return the value between two bounds at which the largest growth rate is 0, by Brent's method.

    Args:
        scene: See `eigenvalues`.
        path: As in `scene.with_`, such as "flow.velocity", or "flow*.velocity" for all flows of these names.
        low: Where the scene is stable.
        high: Where the scene is unstable; or both the other way around. Of several changes between them, one is found.
        closed: See `eigenvalues`.

    Raises:
        UserError: The scene is stable or unstable at both bounds, or a law of the flow does not hold there.
    """

    def growth(value: float) -> float:
        return float(eigenvalues(scene.with_({path: value}), closed)[0].real)

    if not 0.0 < low < high:
        raise UserError(f"critical velocity: found bounds {low!r} and {high!r}, expected 0 < low < high")
    first, last = growth(low), growth(high)
    if not first * last < 0.0:
        raise UserError(
            f"critical velocity: the largest growth rate is {first:.4g} 1/s at {path} = {low:g} and {last:.4g} 1/s at "
            f"{high:g}; expected decay at one bound and growth at the other; a structure without damping or that can "
            "move freely decays nowhere"
        )
    value = float(scipy.optimize.brentq(growth, low, high, xtol=SAME * low, rtol=SAME))
    at = scene.with_({path: value})
    found = eigenvalues(at, closed)[0]
    frequency = abs(float(found.imag))
    for one in at.feedbacks if frequency > 0.0 else ():
        one.check(frequency)
    return CriticalVelocity(value, frequency, complex(found), float(abs(found.real) / abs(found)))


@dataclass(frozen=True)
class IdleSupports:
    """Stability of a scene by the set of its supports that are idle.

    Attributes:
        tolerated: Supports that may be idle, whichever they are: each set of so many is stable. -1: unstable with all
            supports closed.
        growth: Largest growth rate by set of idle supports, 1/s, for all sets up to the first count with an unstable
            one.
    """

    tolerated: int
    growth: dict[frozenset[str], float]

    @property
    def unstable(self) -> list[frozenset[str]]:
        """The unstable sets, the fastest growth first."""
        return sorted((one for one, rate in self.growth.items() if not rate < 0.0), key=lambda one: -self.growth[one])


@checked
def idle_supports(scene: Scene, supports: Sequence[str] | Mapping[str, float | tuple[float, float]]) -> IdleSupports:
    """Return the number of supports that may be idle, in any combination, before a tube becomes unstable.

    Args:
        scene: See `eigenvalues`, with its flow.
        supports: Contacts that close or idle, as in `eigenvalues`; all other contacts are idle.

    Raises:
        UserError: As `eigenvalues`; or there are too many sets.
    """
    names, growth = list(supports), dict[frozenset[str], float]()
    for count in range(len(names) + 1):
        if comb(len(names), count) > MOST:
            raise UserError(f"idle supports: {comb(len(names), count)} sets of {count} supports; name fewer of them")
        for idle in combinations(names, count):
            left = [name for name in names if name not in idle]
            closed: Closed = {name: supports[name] for name in left} if isinstance(supports, Mapping) else left
            growth[frozenset(idle)] = float(eigenvalues(scene, closed)[0].real)
        if not all(rate < 0.0 for idle, rate in growth.items() if len(idle) == count):
            return IdleSupports(count - 1, growth)
    return IdleSupports(len(names), growth)
