"""Feedback: a linear force with states that follows the motion.

    z' = A z + B u,     F = C z + D u,     u = (displacements, velocities) of `sense`,     F acts at `act`.

The states follow the scheme and are eliminated exactly, so that stability boundaries of the linear system hold at any
step of the midpoint rule. A joint is a feedback without states. Places may be lists of points: motions one after the
other. Forces of a flow are in `flow_force`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.linalg as sl
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import ARTICLES, ArgumentError, checked, finite, positive, shown
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.system.operators import Array

One = StructurePoint | tuple[StructurePoint, StructurePoint]
Place = One | list[One]
UNSEEN = 1e-9  # of the norms of A and C: what round-off leaves of a state that no output shows


def parts_of(place: Place) -> list[One]:
    """Return the points and pairs of a place.

    Raises:
        UserError: It holds something else.
    """
    parts = place if isinstance(place, list) else [place]
    for part in parts:
        for one in part if isinstance(part, tuple) else (part,):
            if not isinstance(one, StructurePoint):
                raise UserError(f"feedback: found {shown(one)} as a place, expected {ARTICLES['StructurePoint']}")
    return parts


def motions_of(place: Place) -> int:
    """Return the number of motions of a place."""
    return sum(len((one[0] if isinstance(one, tuple) else one).rows) for one in parts_of(place))


def outputs_of(feedbacks: Sequence[Feedback]) -> list[slice]:
    """Return the places of the forces of each feedback among those of all."""
    ends = np.cumsum([0, *(motions_of(one.act) for one in feedbacks)])
    return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def side_by_side(laws: Sequence[Any]) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C, D of linear laws next to each other; B and D take displacements of all, then velocities."""

    def whole(parts: Iterable[Array]) -> Any:
        return sl.block_diag(np.zeros((0, 0)), *parts)

    def halves(name: str) -> Any:
        pairs = [np.split(getattr(one, name), 2, axis=1) for one in laws]
        return np.hstack([whole(pair[i] for pair in pairs) for i in (0, 1)])

    return whole(one.A for one in laws), halves("B"), whole(one.C for one in laws), halves("D")


class Feedback:
    """A linear force with n states; see the module.

    Args:
        sense: StructurePoint or pair of points whose displacements and velocities it reads, or a list of these.
        act: StructurePoint or pair of points that its force acts on, or a list of these; equal and opposite on the
            second of a pair.
        A: (n, n), 1/s; [] without states.
        B: (n, 2 motions of `sense`): displacements first.
        C: (motions of `act`, n).
        D: (motions of `act`, 2 motions of `sense`); default 0.
        name: For messages and paths.

    Raises:
        UserError: A shape does not fit, or a state grows by itself and no output shows that.
    """

    delay = 0.0
    """Time that the force lags behind the motion, s."""

    @checked
    def __init__(
        self, sense: Place, act: Place, A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike | None = None,
        name: str = "",
    ) -> None:  # fmt: skip
        self.sense, self.act, self.name = sense, act, name
        inputs, outputs, where = 2 * motions_of(sense), motions_of(act), f"feedback {name or '?'}"
        for one in self.points:
            one.refuse_moving(where, "points that stay, or a contact")
        self.A: Array = np.atleast_2d(finite(A, where)) if np.size(np.asarray(A)) else np.zeros((0, 0))
        n = len(self.A)
        shapes = {"A": (self.A, (n, n)), "B": (B, (n, inputs)), "C": (C, (outputs, n))}
        shapes |= {} if D is None else {"D": (D, (outputs, inputs))}
        for key, (value, shape) in shapes.items():
            if np.size(np.asarray(value)) != shape[0] * shape[1]:
                raise ArgumentError(f"{where}: found {key} of shape {np.shape(value)}, expected {shape}", key)
        self.B: Array = finite(B, where).reshape(n, inputs)
        self.C: Array = finite(C, where).reshape(outputs, n)
        self.D: Array = np.zeros((outputs, inputs)) if D is None else finite(D, where).reshape(outputs, inputs)
        for value in np.linalg.eigvals(self.A):
            if value.real > UNSEEN * np.linalg.norm(self.A):
                shown = np.vstack([self.A - value * np.eye(n), self.C * _ratio(self.A, self.C)])
                if np.linalg.svd(shown, compute_uv=False)[-1] <= UNSEEN * np.linalg.norm(self.A):
                    raise ArgumentError(
                        f"{where}: a state grows as exp({value.real:.4g} t) and no output shows it; remove that state, "
                        "or show it by C",
                        "A",
                    )

    @property
    def points(self) -> tuple[StructurePoint, ...]:
        """All points that it reads or acts on."""
        parts = [*parts_of(self.sense), *parts_of(self.act)]
        return tuple(point for one in parts for point in (one if isinstance(one, tuple) else (one,)))

    @property
    def resting(self) -> Array:
        """States at rest for unit displacements of `sense`, (n, motions).

        Raises:
            UserError: A state has no rest, as that of an integrator.
        """
        try:
            with np.errstate(all="ignore"):
                found: Any = -np.linalg.solve(self.A, self.B[:, : self.B.shape[1] // 2])
        except np.linalg.LinAlgError:
            found = np.full((len(self.A), 1), np.inf)
        if not np.isfinite(found).all():
            raise UserError(f"feedback {self.name or '?'}: a state has no rest; march from rest instead")
        return np.asarray(found, dtype=float)

    def check(self, *frequencies: float) -> None:
        """Raise UserError if the law does not hold at angular frequencies, rad/s; without any, at those of interest."""

    def replaced(self, name: str, value: Any) -> Feedback:  # noqa: ARG002
        """Return the feedback with another value of that name.

        Raises:
            UserError: It has no such value.
        """
        raise UserError(f"feedback {self.name or '?'} has no value {name!r}; forces of a flow have a velocity")


def _ratio(A: Array, C: Array) -> float:
    """Return the factor that makes C as large as A."""
    size = float(np.linalg.norm(C))
    return float(np.linalg.norm(A)) / size if size > 0.0 else 1.0


class Joint(Feedback):
    """A spring and damper between two points, or from a point to the frame; as stiff as you like.

    Args:
        between: A point, or (point, point).
        stiffness: In each motion, N/m.
        damping: In each motion, N s/m.
        name: For messages and paths.

    Raises:
        UserError: A value is negative or not finite.
    """

    @checked
    def __init__(self, between: Place, stiffness: float, damping: float = 0.0, name: str = "") -> None:
        for value, key in ((stiffness, "stiffness"), (damping, "damping")):
            positive(value, f"joint {name or '?'}: {key}", zero=True)
        unit = np.eye(motions_of(between))
        super().__init__(between, between, [], [], [], np.hstack([-stiffness * unit, -damping * unit]), name)
