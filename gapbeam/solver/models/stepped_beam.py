"""Timoshenko beams of several prismatic parts, one behind the other: beams with [[segment]], and graded elements.

Deflection and rotation are continuous where two parts meet; curvature and shear strain jump there with section and
material. The elements do not know that the corners of a shoulder carry nothing: a solid with steps is a bit softer.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.element_spacing import graded_places
from gapbeam.solver.models.timoshenko_beam import TimoshenkoBeam, as_rows, heave_and_pitch_at, of_elements
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.sparse_operators import SparseOperators


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
    def of_case(cls, case: Case, elements: int, lateral: bool = False, graded: bool = False) -> SteppedBeam:
        """Return the beam of a case, in its bending plane or, in 3D, across it.

        Args:
            case: The case.
            elements: How many there are in all; each piece of the beam has its share, and one at least.
            lateral: Whether it bends across the bending plane.
            graded: Whether elements are shorter in supports than between them; else those of a piece are equal.
        """
        pieces = case.profile.pieces
        neutral = pieces[0].beam.centroid[0 if lateral else 1]
        if graded:
            places = graded_places(case, elements)
            alike = {piece: TimoshenkoBeam.of_piece(case, piece, 1.0, 1, lateral) for piece in pieces}
            parts = [
                alike[case.profile.at(0.5 * (start + end))].of_length(end - start)
                for start, end in pairwise(map(float, places))
            ]
            return cls(tuple(parts), tuple(map(float, places[:-1])), neutral)
        shares = [elements * (piece.end - piece.start) / case.beam.length for piece in pieces]
        counts = [elements] if len(pieces) == 1 else [max(1, round(share)) for share in shares]
        parts = [
            TimoshenkoBeam.of_piece(case, piece, piece.end - piece.start, count, lateral)
            for piece, count in zip(pieces, counts, strict=True)
        ]
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
        which = np.clip(np.searchsorted(self.starts, x, side="right") - 1, 0, len(self.parts) - 1)
        firsts = 2 * np.cumsum([0, *(part.elements for part in self.parts)])
        order = np.argsort(which, kind="stable")
        w, theta, columns = np.empty((len(x), 4)), np.empty((len(x), 4)), np.empty((len(x), 4), dtype=int)
        breaks = np.flatnonzero(np.diff(which[order])) + 1
        for here in np.split(order, breaks) if len(order) else ():
            number = which[here[0]]
            w[here], theta[here], own = self.parts[number].shapes_at(x[here] - self.starts[number])
            columns[here] = firsts[number] + own
        return as_rows(w, theta, columns, self.size)

    def heave_and_pitch(self) -> Array:
        """Return both rigid motions, (2, n): w = 1, and w = x with theta = 1."""
        return heave_and_pitch_at(self.places)

    def operators(self) -> SparseOperators:
        """Return M and K."""
        return of_elements(self.parts)
