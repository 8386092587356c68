"""Feedback: a linear force with states that follows the motion.

    z' = A z + B u,     F = C z + D u,     u = (displacements, velocities) of `sense`,     F acts at `act`.

The states follow the scheme and are eliminated exactly, so that stability boundaries of the linear system hold at any
step of the midpoint rule. A joint is a feedback without states. Places may be lists of points: motions one after the
other. Forces of a flow are in `flow_force`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import chain, pairwise
from typing import Any

import numpy as np
import scipy.linalg as sl
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import ARTICLES, ArgumentError, checked, finite, positives, shown
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.system.operators import Array

One = StructurePoint | tuple[StructurePoint, StructurePoint]
Place = One | list[One]
UNSEEN = 1e-9  # of the norms of A and C: what round-off leaves of a state that no output shows


def parts_of(place: Place) -> list[tuple[StructurePoint, ...]]:
    """Return the points of a place, each alone or with the second of its pair; refuse anything else."""
    given = place if isinstance(place, list) else [place]
    parts: list[tuple[StructurePoint, ...]] = [one if isinstance(one, tuple) else (one,) for one in given]
    for one in chain(*parts):
        if not isinstance(one, StructurePoint):
            raise UserError(f"feedback: found {shown(one)} as a place, expected {ARTICLES['StructurePoint']}")
    return parts


def motions_of(place: Place) -> int:
    """Return the number of motions of a place."""
    return sum(len(first.rows) for first, *_ in parts_of(place))


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
        square = np.atleast_2d(finite(A, where)) if np.size(np.asarray(A)) else np.zeros((0, 0))
        n, direct = len(square), np.zeros((outputs, inputs)) if D is None else D

        def shaped(key: str, value: Any, *shape: int) -> Array:
            if np.size(np.asarray(value)) != shape[0] * shape[1]:
                raise ArgumentError(f"{where}: found {key} of shape {np.shape(value)}, expected {shape}", key)
            return finite(value, where).reshape(shape)

        self.A, self.B = shaped("A", square, n, n), shaped("B", B, n, inputs)
        self.C, self.D = shaped("C", C, outputs, n), shaped("D", direct, outputs, inputs)
        size, shows = np.linalg.norm(self.A), self.C / (np.linalg.norm(self.C) or 1.0)
        for value in np.linalg.eigvals(self.A):
            if value.real > UNSEEN * size:
                seen = np.vstack([(self.A - value * np.eye(n)) / size, shows])
                if np.linalg.svd(seen, compute_uv=False)[-1] <= UNSEEN:
                    raise ArgumentError(
                        f"{where}: a state grows as exp({value.real:.4g} t) and no output shows it; remove that state, "
                        "or show it by C",
                        "A",
                    )

    @property
    def points(self) -> tuple[StructurePoint, ...]:
        """All points that it reads or acts on."""
        return tuple(chain(*parts_of(self.sense), *parts_of(self.act)))

    @property
    def resting(self) -> Array:
        """States at rest for unit displacements of `sense`, (n, motions).

        Raises:
            UserError: A state has no rest, as that of an integrator.
        """
        with suppress(np.linalg.LinAlgError), np.errstate(all="ignore"):
            found: Any = -np.linalg.solve(self.A, self.B[:, : self.B.shape[1] // 2])
            if np.isfinite(found).all():
                return np.asarray(found, dtype=float)
        raise UserError(f"feedback {self.name or '?'}: a state has no rest; march from rest instead")

    def check(self, *frequencies: float) -> None:
        """Raise UserError if the law does not hold at angular frequencies, rad/s; without any, at those of interest."""

    def replaced(self, name: str, value: Any) -> Feedback:  # noqa: ARG002
        """Return the feedback with another value of that name; refuse a name that it has not."""
        raise UserError(f"feedback {self.name or '?'} has no value {name!r}; forces of a flow have a velocity")


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
        k, c = positives(f"joint {name or '?'}", zero=True, stiffness=stiffness, damping=damping)
        unit = np.eye(motions_of(between))
        super().__init__(between, between, [], [], [], np.hstack([-k * unit, -c * unit]), name)
