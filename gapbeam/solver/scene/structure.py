"""Structures: linear bodies M u'' + C u' + K u = f, from matrices, modes or rigid masses.

A structure knows neither contact nor time. Contacts, loads and feedback act on its points: a point is a few rows b_i of
its degrees of freedom, and moves by b_i . u.

Large structures are reduced to their first modes and what unit forces at their points add.

What a few modes leave out is missing at a contact: without the static response to its force the point is too stiff, by
the flexibility of all higher modes. The basis is

    Q = [phi_1 ... phi_n, (K + s M)^-1 (1 - M phi phi^T) b_j],

made M-orthonormal, with a shift s that is small beside all elastic frequencies: free structures are factored, too, and
once for modes and responses. Source: Craig (1981), Structural Dynamics, sec. 19.5, residual attachment modes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from numpy.typing import ArrayLike

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.models.reduction.modal_basis import modal_basis
from gapbeam.solver.scene.argument_checks import checked, finite, matrix, positive
from gapbeam.solver.scene.structure_geometry import StructureGeometry
from gapbeam.solver.scene.support_force import SupportForce
from gapbeam.solver.system.dense_operators import DenseOperators, SparseOperators, with_steady_signs
from gapbeam.solver.system.operators import Array

LARGE = 600
"""Degrees of freedom beyond which a structure is marched with its sparse matrices, not with all of its modes."""
SYMMETRY = 1e-8  # of the largest entry: what exports leave as round-off
TURNS = 1e-9
"""Motion of a point with a unit motion of the frame below which it is round-off, no unit."""
NEGATIVE = 1e-9  # of the largest square of a frequency: what round-off leaves of rigid motions


@dataclass(frozen=True, eq=False)
class StructurePoint:
    """Named motions of a structure.

    Attributes:
        structure: The structure.
        rows: (motions, DOFs): the motions are rows @ u.
        name: As in the structure's table of points.
    """

    structure: Structure
    rows: Array
    name: str = ""

    @property
    def is_moving(self) -> bool:
        """True where it moves along the structure: of `moving_point`, for contacts only."""
        return False

    @property
    def turns(self) -> bool:
        """True of a rotation, rad: one that is named, or stays in space where the frame moves along x, y and z."""
        if self.name in self.structure.rotations:
            return True
        moved = self.directions
        return moved is not None and bool(np.abs(moved).max() < TURNS) and bool(np.any(self.rows))

    @property
    def directions(self) -> Array | None:
        """Directions of its motions in space, (motions, 3), 0 of rotations; None: unknown."""
        return self.structure.frame.get(self.name) if self.structure.is_spatial else None

    def refuse_moving(self, where: str, instead: str) -> None:
        """Refuse a point that moves along its structure.

        Raises:
            UserError: The point moves along its structure.
        """
        if self.is_moving:
            raise UserError(f"{where}: found point {self.name or '?'}, which moves, expected {instead}")

    def __repr__(self) -> str:
        return f"<point {self.name or '?'} of structure {self.structure.name or '?'}>"


class FrequencyDoubt(NamedTuple):
    """Doubt from digits of matrices: unknown part of the first frequency, or that of stray rigid motions; in words."""

    part: float
    words: str


class Structure:
    """A linear body: M u'' + C u' + K u = f.

    Args:
        M: Mass matrix, symmetric and positive definite, (DOFs, DOFs); numpy or scipy.sparse.
        K: Stiffness matrix, symmetric.
        C: Damping matrix of any kind; default none.
        points: Points at which something may touch, act or be read, by name: one or two DOF numbers (integers), or one
            or two rows (floats), (motions, DOFs), also of scipy.sparse.
        rigid: Motions without strain as columns, (DOFs, count), where they are known in closed form: momentum is then
            kept to round-off.
        name: Name of the structure, for messages and for points of the same name.
        inertia: Mass that meets a motion of the frame, M r for the motion r of all DOFs with the frame, (DOFs,), kg:
            what weight and base motions act on; or (DOFs, 3) for motions along x, y and z. Default M @ frame.
        frame: Motion r of all DOFs when the frame moves by 1, (DOFs,) or (DOFs, 3), or motions of the points then, by
            name.
        geometry: Nodes in space and how they move, for pictures and contacts of faces.
        rotations: Names of points whose motions are rotations, rad: forces on them are moments, N m.

    Attributes:
        gauges: Rows of the stress for each motion of a point, (6 motions, DOFs), Pa, by the name of the point; see
            `gapbeam.solver.scene.surface_stress`.
        reactions: Forces of supports by name; none after `reduced` to fewer modes, which miss what the others carry.

    Raises:
        UserError: Shapes do not fit, an entry is not finite, M is not positive definite, M or K is not symmetric, or a
            rigid motion strains.
    """

    doubt: FrequencyDoubt | None = None

    @checked
    def __init__(
        self,
        M: Any,
        K: Any,
        C: Any = None,
        points: Mapping[str, ArrayLike] | None = None,
        rigid: ArrayLike | None = None,
        name: str = "",
        inertia: ArrayLike | None = None,
        frame: ArrayLike | Mapping[str, Array] | None = None,
        geometry: StructureGeometry | None = None,
        rotations: Sequence[str] = (),
    ) -> None:
        where = f"structure {name or '(without a name)'}"
        self.name, self.geometry = name, geometry
        self.gauges: dict[str, Array] = {}
        self.reactions: dict[str, SupportForce] = {}
        self.M, self.K = matrix(M, f"{where}: M"), matrix(K, f"{where}: K")
        self.C = None if C is None else matrix(C, f"{where}: C")
        self.size = int(self.M.shape[0])
        for A, what in ((self.K, "K"), (self.C, "C")):
            if A is not None and A.shape != self.M.shape:
                raise UserError(f"{where}: found {what} of shape {A.shape}, expected that of M, {self.M.shape}")
        for A, what in ((self.M, "M"), (self.K, "K")):
            skew = abs(A - A.T).max()
            if not skew <= SYMMETRY * abs(A).max():
                raise UserError(
                    f"{where}: {what} differs from its transpose by up to {skew:.3g} of {abs(A).max():.3g}; expected a "
                    f"symmetric matrix: complete an exported triangle as A + A.T - diag(A)"
                )
        self.rigid = None if rigid is None else self._rigid(rigid, where)
        self.points = {key: StructurePoint(self, self._rows(value, key), key) for key, value in (points or {}).items()}
        self.rotations = frozenset(rotations)
        if strange := sorted(self.rotations - set(self.points)):
            known = ", ".join(self.points) or "none"
            raise UserError(f"{where}: rotations: found {', '.join(strange)}, expected some of its points: {known}")
        self.frame: dict[str, Array] = dict(frame) if isinstance(frame, Mapping) else {}
        if frame is not None and not isinstance(frame, Mapping):
            along = finite(frame, f"{where}: frame")
            if along.shape not in self._of_frame:
                raise UserError(f"{where}: found frame of shape {along.shape}, expected {self._frame_words}")
            inertia = self.M @ along if inertia is None else inertia
            self.frame = {key: point.rows @ along for key, point in self.points.items()}
        self.inertia = None if inertia is None else finite(inertia, f"{where}: inertia")
        if self.inertia is not None and self.inertia.shape not in self._of_frame:
            raise UserError(f"{where}: found inertia of shape {self.inertia.shape}, expected {self._frame_words}")

    def __getitem__(self, name: str) -> StructurePoint:
        """Return a point by its name."""
        if name not in self.points:
            known = ", ".join(sorted(self.points)) or "none"
            raise UserError(f"structure {self.name or '?'} has no point {name!r}; its points: {known}")
        return self.points[name]

    def __repr__(self) -> str:
        return f"<structure {self.name or '?'}: {self.size} DOFs, points {', '.join(self.points) or 'none'}>"

    def point(self, rows: ArrayLike, name: str = "") -> StructurePoint:
        """Return a point that is not in the table of points; see `Structure` for `rows`."""
        return StructurePoint(self, self._rows(rows, name), name)

    def made_of(self, other: Structure, basis: Array | None = None) -> Structure:
        """Return the structure, made from another one: as unknown, with its gauges, reactions and rotations.

        Args:
            other: The other structure.
            basis: Its DOFs are basis @ those of this one; default they are the same.
        """
        self.doubt, self.rotations = other.doubt, other.rotations
        self.gauges = {name: rows if basis is None else rows @ basis for name, rows in other.gauges.items()}
        self.reactions = {k: one if basis is None else one.over(basis) for k, one in other.reactions.items()}
        return self

    @property
    def is_spatial(self) -> bool:
        """True where the frame may move along x, y and z: weight and base motions then need a direction."""
        return self.inertia is not None and self.inertia.ndim == 2

    @property
    def _of_frame(self) -> tuple[tuple[int, ...], ...]:
        return (self.size,), (self.size, 3)

    @property
    def _frame_words(self) -> str:
        return f"({self.size},), or ({self.size}, 3) for motions along x, y and z"

    @property
    def is_large(self) -> bool:
        """True where the structure is marched with its sparse matrices."""
        return self.size > LARGE

    @cached_property
    def modes(self) -> tuple[Array, Array, Array]:
        """Squared angular frequencies (n,), modal damping matrix (n, n) and mass-normalized shapes (n, n) of all modes.

        Rigid motions that were given are exact, and all other modes are made orthogonal to them.
        """
        where, M = f"structure {self.name or '?'}", dense(self.M)
        try:
            np.linalg.cholesky(M)
        except np.linalg.LinAlgError as error:
            raise UserError(
                f"{where}: M is not positive definite ({error}); give every DOF a mass, or leave out DOFs without "
                "mass by static condensation"
            ) from None
        try:
            squares, X = (np.array(one) for one in DenseOperators(M, dense(self.K)).modes)
            softest, stiffest = float(squares.min()), float(np.abs(squares).max())
        except sl.LinAlgError:  # a negative direction beyond the lowest elastic one
            softest, stiffest = -inf, inf
        if softest < -NEGATIVE * stiffest:
            raise UserError(
                f"{where}: K has a negative direction; expected none: look at how K was exported, and give forces that "
                "soften as a Feedback"
            )
        order = np.argsort(squares, kind="stable")
        squares, X = squares[order], X[:, order]
        if self.rigid is not None:
            R = self.rigid @ np.linalg.inv(np.linalg.cholesky(self.rigid.T @ M @ self.rigid)).T
            count = R.shape[1]
            X[:, :count], squares[:count] = R, 0.0
            for _ in range(3):  # one pass leaves the round-off of the eigensolver
                X[:, count:] -= R @ (R.T @ M @ X[:, count:])
        C = np.zeros_like(M) if self.C is None else X.T @ dense(self.C) @ X
        return squares, C, X

    def with_masses(self, masses: Mapping[str, float] | Mapping[StructurePoint, float]) -> Structure:
        """Return the structure with more mass at its points, kg by point or name: M + sum m b^T b, in all motions.

        Raises:
            UserError: A point is unknown, a mass is below 0, or nothing says how the point moves with the frame.
        """
        M, inertia, where = self.M, self.inertia, f"structure {self.name or '?'}"
        for key, value in masses.items():
            point = key if isinstance(key, StructurePoint) else self[key]
            point.refuse_moving(f"{where}: mass", "a contact of a structure of that mass with it")
            kg, rows = float(positive(value, f"{where}: mass at {point.name or '?'}", zero=True)), point.rows
            M = M + kg * (sp.csr_matrix(rows).T @ sp.csr_matrix(rows) if sp.issparse(M) else rows.T @ rows)
            if inertia is not None:
                if point.name not in self.frame:
                    raise UserError(
                        f"{where}: a mass at {point.name or 'a point without a name'} weighs, but nothing says how the "
                        "point moves with the frame; make the structure with `frame`, and name the point there"
                    )
                inertia = inertia + kg * rows.T @ self.frame[point.name]
        points = {name: point.rows for name, point in self.points.items()}
        made = Structure(M, self.K, self.C, points, self.rigid, self.name, inertia, self.frame, self.geometry)
        return made.made_of(self)

    def reduced(self, count: int, ratio: float = 0.0) -> Structure:
        """Return the structure in its first modes.

        Args:
            count: Modes that are kept.
            ratio: Damping ratio that each mode gets beside C.

        Raises:
            UserError: The structure has fewer modes, or fewer are asked for than it has rigid motions.
        """
        still = 0 if self.rigid is None else self.rigid.shape[1]
        if not max(still, 1) <= count <= self.size:
            raise UserError(
                f"structure {self.name or '?'}: found {counted(count, 'mode')}, expected {max(still, 1)} (rigid "
                "motions are kept) "
                f"to {self.size}"
            )
        squares, C, X = self.modes
        w, X = np.sqrt(np.abs(squares[:count])), X[:, :count]
        points = {name: point.rows @ X for name, point in self.points.items()}
        damping = C[:count, :count] + np.diag(2.0 * ratio * w)
        made = Structure(
            np.eye(count),
            np.diag(w * w),
            damping,
            points,
            np.eye(count)[:, :still] if still else None,
            self.name,
            None if self.inertia is None else X.T @ self.inertia,
            self.frame,
            None if self.geometry is None else self.geometry.over(X),
        ).made_of(self, X)
        if count < self.size:
            made.reactions = {}
        return made

    def _rows(self, value: Any, name: str) -> Array:
        """Return the rows of a point."""
        where = f"structure {self.name or '?'}: point {name or '?'}"
        given = value.toarray() if sp.issparse(value) else np.asarray(value)
        if given.dtype.kind in "iu" and given.ndim < 2:
            numbers = np.atleast_1d(given)
            if not np.all((-self.size <= numbers) & (numbers < self.size)):
                raise UserError(f"{where}: found DOF {given}, expected numbers from 0 to {self.size - 1}")
            rows: Array = np.zeros((len(numbers), self.size))
            rows[np.arange(len(numbers)), numbers] = 1.0
        else:
            rows = np.atleast_2d(finite(given, where)).astype(float)
        if rows.ndim != 2 or rows.shape[1] != self.size:
            raise UserError(
                f"{where}: found a row of {counted(rows.shape[-1], 'entry')}, expected one for each of {self.size} DOFs"
            )
        if not 1 <= len(rows) <= 3:
            raise UserError(
                f"{where}: found {counted(len(rows), 'motion')}, expected 1, 2 in a section plane, or 3 in space; "
                "integers are "
                "DOF numbers, a row has floats"
            )
        return rows

    def _rigid(self, given: ArrayLike, where: str) -> Array:
        columns = finite(given, f"{where}: rigid")
        R = columns.reshape(self.size, -1) if columns.size % self.size == 0 else columns
        if R.ndim != 2 or R.shape[0] != self.size:
            raise UserError(f"{where}: found rigid motions of shape {columns.shape}, expected ({self.size}, count)")
        force, size = abs(self.K @ R).max(), abs(self.K).max() * abs(R).max()
        if not force <= SYMMETRY * size:
            raise UserError(
                f"{where}: a rigid motion strains: K @ rigid has {force:.3g} where {SYMMETRY * size:.3g} is round-off; "
                "leave `rigid` out where the structure is held"
            )
        return R


def dense(A: Any) -> Array:
    """Return a matrix as an array."""
    return A.toarray() if sp.issparse(A) else np.asarray(A, dtype=float)


@checked
def from_modes(
    frequencies: ArrayLike,
    ratio: ArrayLike,
    points: Mapping[str, ArrayLike],
    damping: ArrayLike = 0.0,
    name: str = "",
) -> Structure:
    """Return a structure of mass-normalized modes: q_i'' + 2 zeta_i w_i q_i' + w_i^2 q_i = phi_i . f.

    Args:
        frequencies: Angular frequencies, rad/s, (n,); 0 for rigid motions.
        ratio: Damping ratio of all modes, or one for each.
        points: Mode shapes at the points, (n,) or (motions, n), 1/sqrt(kg).
        damping: Matrix beside the ratios, (n, n), 1/s.
        name: Name of the structure.

    Raises:
        UserError: A frequency or a ratio is negative or not finite, or a shape has another number of modes.
    """
    w = np.atleast_1d(finite(frequencies, f"modes of {name or '?'}: frequencies"))
    zeta = finite(ratio, f"modes of {name or '?'}: ratio")
    if not (np.all(w >= 0.0) and np.all(zeta >= 0.0)) or zeta.shape not in ((), w.shape):
        raise UserError(
            f"modes of {name or '?'}: expected frequencies from 0 on, and a damping ratio from 0 on for all or for each"
        )
    if w.ndim != 1 or not w.size:
        raise UserError(f"modes of {name or '?'}: found frequencies of shape {w.shape}, expected one for each mode")
    still = np.eye(len(w))[:, w == 0.0]
    shapes = {key: finite(value, f"modes of {name or '?'}: point {key}") for key, value in points.items()}
    return Structure(
        np.eye(len(w)), np.diag(w * w), np.diag(2.0 * zeta * w) + finite(damping, "damping"), shapes,
        still if still.size else None, name,
    )  # fmt: skip


@checked
def mass(
    value: float, motions: int = 1, stiffness: float = 0.0, damping: float = 0.0, name: str = "", **points: ArrayLike
) -> Structure:
    """Return a rigid mass with an equal spring and damper in each motion; its point is "at".

    Args:
        value: kg.
        motions: 1, 2 in a section plane, or 3 in space.
        stiffness: Stiffness of a spring to the frame in each motion, N/m.
        damping: N s/m.
        name: Name of the structure.
        points: More points, as in `Structure`.

    Raises:
        UserError: The mass is not above 0, or there are other than one to three motions.
    """
    if not value > 0.0:
        raise UserError(f"mass {name or '?'}: found {value!r} kg, expected a mass above 0")
    if motions not in (1, 2, 3):
        raise UserError(
            f"mass {name or '?'}: found {counted(motions, 'motion')}, expected 1, 2 in a section plane, or 3 in space"
        )
    unit = np.eye(motions)
    held, frame, every = None if stiffness else unit, [1.0] if motions == 1 else None, {"at": unit, **points}
    return Structure(value * unit, stiffness * unit, damping * unit, every, held, name, None, frame)


SHIFT = 0.1
MOST_RIGID = 6
FIRST_GUESS = 1e-9  # of the mean square


@checked
def reduced_at_points(structure: Structure, modes: int, points: Iterable[str] | None = None) -> Structure:
    """Return a structure in its first modes and the static responses to unit forces at its points.

    Responses to motions of supports whose forces are recorded are kept, too: the forces at rest are then exact.

    Args:
        structure: The structure to reduce; sparse matrices stay sparse.
        modes: First modes that are kept.
        points: Points whose flexibility is kept; default all.

    Raises:
        UserError: More modes are asked for than there are, or a point is unknown.
        RunError: The modes did not converge.
    """
    kept = list(structure.points if points is None else points)
    rows = np.vstack([
        np.zeros((0, structure.size)), *(structure[name].rows for name in kept),
        *(one.stiffness for one in structure.reactions.values()),
    ])  # fmt: skip
    if not 1 <= modes < structure.size:
        raise UserError(
            f"structure {structure.name or '?'}: found {counted(modes, 'mode')}, expected 1 to {structure.size - 1}"
        )
    operators = SparseOperators(structure.M, structure.K)
    mean = float(operators.stiffness.diagonal().sum() / operators.mass.diagonal().sum())  # far above the first of many
    near = FIRST_GUESS * mean
    still = np.zeros((structure.size, 0)) if structure.rigid is None else structure.rigid
    count = min(max(modes, 1 + (still.shape[1] or MOST_RIGID)), structure.size - 1)
    factor = operators.factor(near, 1.0)
    squares, shapes = operators.lowest_modes(near, count, factor)
    elastic = squares[squares > near]
    shift = SHIFT * float(elastic.min() if elastic.size else mean)
    kept_modes = modal_basis(operators, np.column_stack([still, shapes[:, :modes]]), shift).columns
    heavy = operators.apply_mass(kept_modes)
    answers = factor.solve(rows.T - heavy @ (rows @ kept_modes).T)
    answers -= kept_modes @ (heavy.T @ answers)
    basis = modal_basis(operators, np.column_stack([kept_modes, answers]), shift)
    Q = with_steady_signs(basis.columns)
    carried = {name: point.rows @ Q for name, point in structure.points.items()}
    C = None if structure.C is None else Q.T @ (structure.C @ Q)
    rigid = None if structure.rigid is None else Q.T @ operators.apply_mass(structure.rigid)
    inertia = None if structure.inertia is None else Q.T @ structure.inertia
    stiffness = np.diag(basis.squares)
    geometry = None if structure.geometry is None else structure.geometry.over(Q)
    return Structure(
        np.eye(len(stiffness)), stiffness, C, carried, rigid, structure.name, inertia, structure.frame, geometry
    ).made_of(structure, Q)
