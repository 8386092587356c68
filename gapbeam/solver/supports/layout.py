"""Layout of the supports of a beam: places, lengths and play that scales follow from, and the motions of their bodies.

Bodies move along the bending axis, and around the beam also across it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.messages.errors import Key
from gapbeam.solver.schema.record_table import COMPONENTS
from gapbeam.solver.supports.regions.region import Placement
from gapbeam.solver.supports.support import Face, SupportBody
from gapbeam.solver.supports.support_tables import AnySupports, BaseAndGland, OneSupport

NEAR = 1.0e-7  # of the length of a support: round-off of places along the beam


def keyed(support: AnySupports) -> Iterator[tuple[Key, OneSupport]]:
    """Yield each support with its key in the case: ("support",) of the table, ("support", number) of an array."""
    if isinstance(support, BaseAndGland):
        yield ("support",), support
        return
    entries = support if isinstance(support, Mapping) else dict(enumerate(support))
    for number, entry in entries.items():
        yield ("support", number), entry


def support_at(support: AnySupports, x: float) -> OneSupport | None:
    """Return the first support at a place along the beam; None where there is none."""
    return next((one for _, one in keyed(support) if one.start <= x <= one.end), None)


def variable_key(support: OneSupport) -> tuple[str, ...]:
    """Return the way to the keys of a support, as overrides write it: support, or support and its name."""
    return ("support",) if isinstance(support, BaseAndGland) else ("support", support.name)


def stiffness_key(support: OneSupport) -> str:
    """Return the key of the contact stiffness at a support, as overrides write it."""
    own = "stiffness" if support.support_stiffness is None else "support_stiffness"
    return ".".join((*variable_key(support), own)) if support.brings_stiffness else "contact.stiffness"


def with_value(support: AnySupports, key: str, value: float) -> OneSupport | tuple[OneSupport, ...]:
    """Return the supports of a case with another value of a key, such as "support.clearance"."""
    *place, field = key.split(".")
    changed = tuple(
        one.model_copy(update={field: value}) if variable_key(one) == tuple(place) else one for _, one in keyed(support)
    )
    return changed[0] if isinstance(support, BaseAndGland) else changed


@dataclass(frozen=True)
class Layout:
    """The supports of a beam, in the order in which they stand along it.

    Attributes:
        supports: Each with its start, end, clearance and faces.
    """

    supports: tuple[OneSupport, ...]

    @classmethod
    def of(cls, support: AnySupports) -> Layout:
        """Return the layout of the supports of a case."""
        found = sorted((one for _, one in keyed(support)), key=lambda one: (one.start, one.end))
        return cls(tuple(found))

    @property
    def faces(self) -> tuple[Face, ...]:
        """The faces of all supports, one support after the other."""
        return tuple(face for one in self.supports for face in one.faces)

    @property
    def holes(self) -> tuple[OneSupport, ...]:
        """The supports that are met all around the beam."""
        return tuple(one for one in self.supports if one.around)

    def own(self, key: str) -> tuple[float | None, ...]:
        """Return a figure of the contact that supports bring themselves, for each face; None: that of [contact].

        Args:
            key: One of `support_tables.OWN_CONTACT`.
        """
        return tuple(getattr(one, key) for one in self.by_face)

    @property
    def by_face(self) -> tuple[OneSupport, ...]:
        """The support of each face."""
        return tuple(one for one in self.supports for _ in one.faces)

    @property
    def face_spans(self) -> tuple[tuple[float, float], ...]:
        """First and last x of each face, m."""
        return tuple((one.start, one.end) for one in self.by_face)

    @property
    def stiffness_keys(self) -> str:
        """The keys of the contact stiffness that act, as overrides write them, in words."""
        return " or ".join(dict.fromkeys(map(stiffness_key, self.supports)))

    @property
    def start(self) -> float:
        """Start of the first support, m."""
        return min((one.start for one in self.supports), default=0.0)

    @property
    def end(self) -> float:
        """End of the last support, m."""
        return max((one.end for one in self.supports), default=0.0)

    @property
    def length(self) -> float:
        """Length of all supports together, m."""
        return sum(one.length for one in self.supports)

    @property
    def shortest(self) -> float:
        """Length of the shortest support, m."""
        return min((one.length for one in self.supports), default=0.0)

    @property
    def clearance(self) -> float:
        """The clearance that is smallest in size and not 0, with its sign; 0 where there is none, m."""
        return min((one.clearance for one in self.supports if one.clearance != 0.0), key=abs, default=0.0)

    @property
    def widest(self) -> float:
        """The largest clearance, at least 0, m."""
        return max(0.0, *(one.clearance for one in self.supports))

    @property
    def interference(self) -> float:
        """The largest interference, at least 0, m."""
        return max(0.0, *(-one.clearance for one in self.supports))

    @property
    def steepest(self) -> float:
        """The largest clearance over the length of its support: the angle by which a beam can tilt there."""
        return max((abs(one.clearance) / one.length for one in self.supports), default=0.0)

    @property
    def reach(self) -> float:
        """Distance from the first to the last edge of all supports, m."""
        return self.end - self.start

    def arm(self, x: float) -> float:
        """Return the lever arm of a force at x about the last edge of the supports, or the farther one of several, m.

        Over `reach`, it is the force on the opposite edge by a unit force on the rigid beam.
        """
        arms = [abs(x - self.end)] if len(self.supports) == 1 else [abs(x - self.end), abs(x - self.start)]
        return max(arms)

    def spans(self) -> Iterator[tuple[float, float]]:
        """Yield start and length of the parts between one support that a beam can rest on and the next, m."""
        resting = [one for one in self.supports if any(face.carries for face in one.faces)]
        for one, following in pairwise(resting):
            if following.start > one.end:
                yield one.end, following.start - one.end

    def overhangs(self, length: float) -> Iterator[tuple[float, float]]:
        """Yield start and length of the parts of a beam beyond its last and its first support, m."""
        yield from ((start, free) for start, free in ((self.end, length - self.end), (0.0, self.start)) if free > 0.0)


def within(places: NDArray[np.float64], support: OneSupport) -> NDArray[np.bool_]:
    """Return True for places along the beam that lie in a support, or at its ends up to round-off."""
    near = NEAR * (support.end - support.start)
    return np.asarray((places >= support.start - near) & (places <= support.end + near))


@dataclass(frozen=True)
class BodyMotion:
    """One motion q of the body of a support.

    Attributes:
        support: The support.
        body: Its mass, spring and damper.
        axis: Component of displacement: 1 or 2.
        dimension: 2 or 3.
    """

    support: OneSupport
    body: SupportBody
    axis: int
    dimension: int

    @property
    def bends(self) -> bool:
        """True for a motion along the bending axis."""
        return self.axis == self.dimension - 1

    @property
    def axis_name(self) -> str:
        """Name of the component."""
        return COMPONENTS[self.dimension][self.axis]

    @property
    def label(self) -> str:
        """Name of the motion in descriptions of faces; no load has a name with a dot."""
        return f"{self.support.name}.{self.axis_name}"

    def face_changes(self) -> dict[str, tuple[float, float, float]]:
        """Return by how much a unit of the motion changes gap, offset and lateral of each face, by its name."""
        unit = Placement(0.0, offset=1.0) if self.bends else Placement(0.0, lateral=1.0)
        pairs = zip(self.support.faces_at(unit), self.support.faces_at(Placement(0.0)), strict=True)
        found = {}
        for new, old in pairs:
            up, aside = (new.shape.get(key, 0.0) - old.shape.get(key, 0.0) for key in ("offset", "lateral"))
            found[new.name] = (new.gap - old.gap, up, aside)
        return found


def body_motions(layout: Layout, dimension: int) -> tuple[BodyMotion, ...]:
    """Return the motions of all support bodies, support by support along the beam; none where supports stand still.

    Args:
        layout: The supports.
        dimension: 2 or 3.
    """
    return tuple(
        BodyMotion(one, one.body, axis, dimension)
        for one in layout.supports
        if one.body is not None
        for axis in ((dimension - 1, 1) if one.around and dimension > 2 else (dimension - 1,))
    )


def body_shifts(layout: Layout, places: np.ndarray, dimension: int) -> np.ndarray:
    """Return by how much a unit of each motion moves the support at places along the beam, (k, places, dimension).

    Args:
        layout: The supports.
        places: x, (places,), m.
        dimension: 2 or 3.
    """
    motions = body_motions(layout, dimension)
    found = np.zeros((len(motions), len(places), dimension))
    for shift, one in zip(found, motions, strict=True):
        shift[within(places, one.support), one.axis] = 1.0
    return found
