"""Timoshenko beams of several prismatic parts, one behind the other: beams with [[segment]].

Deflection and rotation are continuous where two parts meet; curvature and shear strain jump there with section and
material. The elements do not know that the corners of a shoulder carry nothing: a solid with steps is a bit softer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.case.case import Case
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam, heave_and_pitch_at
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class SteppedBeam:
    """Prismatic beams in a row; DOFs w, theta of one node after the other.

    Attributes:
        parts: The prismatic beams; the last node of each is the first one of the next.
        starts: Where they begin, m.
        neutral: How far above the axis the centroid is, where bending gives no axial strain, m.
    """

    parts: tuple[TimoshenkoBeam, ...]
    starts: tuple[float, ...]
    neutral: float = 0.0

    @classmethod
    def of_case(cls, case: Case, elements: int, lateral: bool = False) -> SteppedBeam:
        """Return the beam of a case, in its bending plane or, in 3D, across it.

        Args:
            case: The case.
            elements: How many there are in all; each piece of the beam has its share, and one at least.
            lateral: Whether it bends across the bending plane.
        """
        pieces = case.profile.pieces
        shares = [elements * (piece.end - piece.start) / case.beam.length for piece in pieces]
        counts = [elements] if len(pieces) == 1 else [max(1, round(share)) for share in shares]
        parts = [
            TimoshenkoBeam.of_piece(case, piece, piece.end - piece.start, count, lateral)
            for piece, count in zip(pieces, counts, strict=True)
        ]
        neutral = pieces[0].beam.centroid[0 if lateral else 1]
        return cls(tuple(parts), tuple(piece.start for piece in pieces), neutral)

    @property
    def elements(self) -> int:
        """Number of elements."""
        return sum(part.elements for part in self.parts)

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return 2 * (self.elements + 1)

    @property
    def places(self) -> Array:
        """Places of the nodes, (elements + 1,), m."""
        places = [start + part.places for part, start in zip(self.parts, self.starts, strict=True)]
        return np.concatenate([*(one[:-1] for one in places), places[-1][-1:]])

    def rows(self, x: Array) -> tuple[csr_matrix, csr_matrix]:
        """Return what gives w and theta at places, (k, n) each."""
        if len(self.parts) == 1:
            return self.parts[0].rows(x)
        which = np.clip(np.searchsorted(self.starts, x, side="right") - 1, 0, len(self.parts) - 1)
        firsts = self._firsts()
        found = list[tuple[csr_matrix, csr_matrix]]()
        for number, (part, start) in enumerate(zip(self.parts, self.starts, strict=True)):
            here = np.flatnonzero(which == number)
            pairs = part.rows(x[here] - start)
            found.append(tuple(self._placed(rows, here, firsts[number], len(x)) for rows in pairs))  # type: ignore[arg-type]
        w, theta = (sum(rows[1:], rows[0]) for rows in zip(*found, strict=True))
        return csr_matrix(w), csr_matrix(theta)

    def heave_and_pitch(self) -> Array:
        """Return both rigid motions, (2, n): w = 1, and w = x with theta = 1."""
        return heave_and_pitch_at(self.places)

    def operators(self) -> DenseOperators:
        """Return M and K."""
        if len(self.parts) == 1:
            return self.parts[0].operators()
        mass, stiffness = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        for part, first in zip(self.parts, self._firsts(), strict=True):
            here, own = slice(first, first + part.size), part.operators()
            mass[here, here] += own.mass
            stiffness[here, here] += own.stiffness
        return DenseOperators(mass, stiffness)

    def _firsts(self) -> Sequence[int]:
        """Return the first DOF of each part."""
        counts = [2 * part.elements for part in self.parts]
        return [sum(counts[:number]) for number in range(len(counts))]

    def _placed(self, rows: csr_matrix, here: Array, first: int, count: int) -> csr_matrix:
        """Return rows of one part among those of all places, on the DOFs of the whole beam."""
        own = rows.tocoo()
        return csr_matrix((own.data, (here[own.row], first + own.col)), (count, self.size))
