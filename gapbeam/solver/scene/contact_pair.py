"""Contacts: a point, or a pair of points, that a region holds by a law."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import (
    ARTICLES,
    ArgumentError,
    answered,
    check_fields,
    finite,
    positive,
    shown,
)
from gapbeam.solver.scene.convex_region import ConvexRegion
from gapbeam.solver.scene.force_law import ForceLaw
from gapbeam.solver.scene.shipped_laws import check_law
from gapbeam.solver.scene.structure import StructurePoint
from gapbeam.solver.scene.touch_kernel import IN_SPACE, ROWS, VALUES, settled, touch
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True, eq=False)
class Contact:
    """A point, or a pair of points, that may not leave a region.

    The place of the contact is r = offset + motion of the first point - motion of the second - wall(t). Inside the
    region there is no force, outside the law presses along the normal, and friction opposes the slip across it. Where
    its faces open over time, the growth of the region is one more motion of the place, except at a single flat face.

    Attributes:
        between: A point, or (point, point): the motion of the first relative to the second.
        region: Region in which the place may be.
        law: Law of forces beyond.
        friction: Coefficient, for contacts of two motions, or of three: in space, against the slip.
        sliding: Speed at which friction reaches 0.71 of its limit, m/s; 0: Coulomb's own law, which sticks without
            creep.
        offset: Place at rest, m; a number, or one for each motion. Members of an ensemble: (members,) for one motion,
            (members, motions) for more.
        wall: Given motion of the region, a function of time, m; a number, or one for each motion.
        opening: Given change of the clearance, a function of time, m: all faces move outward by it, those of a slot by
            half of it.
        name: Name in results and paths; unique in a scene.

    Raises:
        UserError: Motions do not fit, or a value is out of range.
    """

    between: StructurePoint | tuple[StructurePoint, StructurePoint]
    region: ConvexRegion
    law: ForceLaw
    friction: Any = 0.0
    sliding: Any = 0.0
    offset: Any = 0.0
    wall: Callable[[float], Any] | None = None
    opening: Callable[[float], Any] | None = None
    name: str = ""

    def __post_init__(self) -> None:
        check_fields(self, "contact")
        where = f"contact {self.name or '(without a name)'}"
        for point in self.points:
            if not isinstance(point, StructurePoint):
                raise UserError(f"{where}: found {shown(point)}, expected {ARTICLES['StructurePoint']}")
        counts = {len(point.rows) for point in self.points}
        if counts != {self.region.motions}:
            raise UserError(
                f"{where}: found points of {' and '.join(counted(one, 'motion') for one in sorted(counts))}, expected "
                f"{counted(self.region.motions, 'motion')} for the region {self.region.kind.name}"
            )
        positive(self.friction, f"{where}: friction", zero=True)
        slow = positive(self.sliding, f"{where}: sliding", zero=True)
        if np.any(slow > 0.0) and not np.all(slow > 0.0):
            raise UserError(
                f"{where}: sliding speeds are 0 in some members and above 0 in others; expected one of both"
            )
        rest = finite(self.offset, f"{where}: offset")
        motions = self.region.motions
        if not rest.size or rest.ndim > 2 or (rest.ndim and motions > 1 and rest.shape[-1] != motions):
            raise UserError(f"{where}: found an offset of shape {rest.shape}, expected a number or {motions}")
        if motions == 1 and self.is_rough:
            raise UserError(f"{where}: friction needs points of two or three motions: normal and slip")
        if self.is_impulsive:
            self._check_impulses(where)
        remembers = bool(self.law.kind.memory) and not self.is_impulsive
        if self.grows and (remembers or any(point.is_moving for point in self.points)):
            raise UserError(
                f"{where}: found a clearance of region {self.region.kind.name} that changes, with a law that remembers "
                "or a point that moves along a structure, expected a half plane"
            )
        kept, each = self._kept
        room = ROWS - VALUES - len(self.law.values) - kept
        if len(self.region.values) + each * self.region.kind.faces > room:
            raise ArgumentError(f"{where}: {self._too_many(room, each)}", "region")
        check_law(self.law)
        self.region.check_own(self.place_at_rest[:motions, 0], where)

    @property
    def _kept(self) -> tuple[int, int]:
        """Numbers that friction keeps: of the contact, and of each face."""
        if not self.is_rough:
            return 0, 0
        if self.region.motions == 3:
            return IN_SPACE, 0
        return (2, 3) if self.sticks and self.region.kind.faces > 1 else (0, 0)

    def _too_many(self, room: int, each: int) -> str:
        """Return the fault of a region of more values than a contact has room for."""
        kind, rough = self.region.kind, " with friction" if self.is_rough else ""
        if not kind.period:
            return (
                f"found {counted(len(self.region.values), 'value')} of region {kind.name}{rough}, expected at most "
                f"{room - each * kind.faces}; let its distance hold constants, as numbers or a table of its own"
            )
        sliding = "a sliding speed above 0 allows more, " if each else ""
        return (
            f"found {counted(kind.faces, 'corner')}{rough}, expected at most {room // (kind.period + each)}; {sliding}"
            "a disc is round, and gapbeam.Polar has any number of corners"
        )

    def _check_impulses(self, where: str) -> None:
        if self.is_rough or not self.sticks:
            raise UserError(
                f"{where}: found friction with a law of impulses, expected none; a stiff law takes friction"
            )
        if self.region.kind.faces > 1 and self.region.motions > 1:
            found = f"found region {self.region.kind.name} with a law of impulses"
            raise UserError(f"{where}: {found}, expected HalfPlane, Slot or Disc")
        if any(point.is_moving for point in self.points):
            raise UserError(
                f"{where}: found a point that moves along a structure, expected one that stays for impulses"
            )

    @property
    def points(self) -> tuple[StructurePoint, ...]:
        """The point, or both."""
        return self.between if isinstance(self.between, tuple) else (self.between,)

    @property
    def motions(self) -> int:
        """1, 2 in a section plane, or 3 in space, and one more where the region grows."""
        return self.region.motions + self.grows

    @property
    def grows(self) -> bool:
        """True where the last motion of the place is the growth of the region."""
        return self.opening is not None and not self.region.is_half_plane

    @property
    def is_moved(self) -> bool:
        """True where the region has a given motion, or opens."""
        return self.wall is not None or self.opening is not None

    def moved(self, t: float) -> Array:
        """Return the given motion of the region at a time, (motions,), m; the place is less by it."""
        found, motions = np.zeros(self.motions), self.region.motions
        if self.wall is not None:
            found[:motions] = self._given(lambda t, wall=self.wall: np.ravel(wall(t)), "wall", t, (motions,))
        if self.opening is not None:
            by = self.region.share * float(self._given(self.opening, "opening", t, (1,))[0])
            if by < -self.region.reach:
                raise UserError(
                    f"contact {self.name or '?'}: found a clearance that closes by {-by:.6g} m at {t:.6g} s, expected "
                    f"at most {self.region.reach:.6g} m, where region {self.region.kind.name} is a point"
                )
            found += -by * np.eye(self.motions)[motions] if self.grows else by * self.region.normal
        return found

    def _given(self, function: Callable[..., Any], what: str, t: float, shape: tuple[int, ...]) -> Array:
        where = f"contact {self.name or '?'}: its {what} at {t:.6g} s"
        return finite(answered(function, t, shape, where), where)

    def penetration(self, places: Array) -> tuple[Array, Array]:
        """Return penetrations, negative inside, (n,), and outward normals, (n, 1 to 3), at places (n, motions)."""
        motions = self.region.motions
        depth, normals = self.region.penetration(places[:, :motions])
        return depth - places[:, motions:].sum(axis=1), normals

    @property
    def is_rough(self) -> bool:
        """True where any member has friction."""
        return bool(np.any(np.asarray(self.friction) > 0.0))

    @property
    def place_at_rest(self) -> Array:
        """The offset, (motions, members), or (motions, 1)."""
        rest = np.asarray(self.offset, dtype=float)
        motions = self.region.motions
        if motions == 1:
            found: Array = rest.reshape(1, -1)
        else:
            found = np.broadcast_to(rest, (motions,))[:, None] if rest.ndim < 2 else rest.T
        return np.vstack([found, np.zeros((int(self.grows), found.shape[1]))])

    @property
    def sticks(self) -> bool:
        """True where friction is Coulomb's own law, which sticks without creep."""
        return not np.any(self.sliding)

    @property
    def is_impulsive(self) -> bool:
        """True where the law is impulses, and no spring."""
        return self.law.kind.impact is not None

    def values(self, stick: float) -> list[Any]:
        """Return rows VALUES - 2, ... of the workspace; stick: the stiffness of friction that sticks, N/m."""
        return [self.friction, stick if self.sticks else self.sliding, *self.region.values, *self.law.values]

    def check_members(self, lanes: int) -> None:
        """Refuse arrays of values of another length than the members that are marched side by side.

        Raises:
            UserError: A value has another length.
        """
        names = ("friction", "sliding", *self.region.kind.names, *self.law.kind.names, "offset")
        counts = [*(np.size(one) for one in self.values(0.0)), self.place_at_rest.shape[1]]
        wrong = [f"{count} of {name}" for name, count in zip(names, counts, strict=True) if count not in (1, lanes)]
        if wrong:
            raise UserError(
                f"contact {self.name or '?'}: found {', '.join(wrong)}, expected "
                + ("one value; several are for the members of `gapbeam.ensemble`" if lanes == 1 else f"{lanes}")
            )

    def compiled(self, level: float = 0.0, rough: bool = True) -> int:
        """Return the address of the touch for forces at that level of a step (0: the mean over it)."""
        exact, damped = self.sticks, self.law.is_damped
        motions, rough = self.region.motions, rough and self.is_rough
        return touch(self.region.kind, self.law.kind, motions, rough, exact, damped, level, self.grows)

    @property
    def memory(self) -> tuple[int, int, int]:
        """Address of the function that settles the contact after a step; first row and number of rows of memory."""
        kind, region = self.law.kind, self.region.kind
        first = VALUES + len(region.names) + len(kind.given)
        return (settled(region, kind) if kind.memory else 0), first, len(kind.memory)

    def replaced(self, name: str, value: Any) -> Contact:
        """Return the contact with another friction, sliding or offset, or value of the region or the law by its name.

        "stiffness_factor" is the stiffness over the present one, so that points of different areas keep their ratio;
        likewise for other values of the law.

        Raises:
            UserError: The contact has no such value.
        """
        whole = name.removesuffix("_factor")
        if whole != name and whole in self.law.kind.names:
            present = self.law.values[self.law.kind.names.index(whole)]
            return self.replaced(whole, finite(value, name) * present)
        if name in ("friction", "sliding", "offset"):
            return replace(self, **{name: value})
        if name in self.law.kind.given:
            return replace(self, law=self.law.replaced(**{name: value}))
        if name in self.region.kind.names:
            return replace(self, region=self.region.replaced(name, value))
        known = ", ".join(("friction", "sliding", "offset", *self.region.kind.names, *self.law.kind.given))
        raise UserError(f"contact {self.name or '?'} has no value {name!r}; it has {known}")


def refuse_impulses(contacts: Iterable[Contact], what: str, expected: str) -> None:
    """Refuse contacts whose laws are impulses.

    Raises:
        UserError: A contact has such a law.
    """
    for one in contacts:
        if one.is_impulsive:
            raise UserError(f"{what}: found contact {one.name or '?'}, whose law is impulses, expected {expected}")
