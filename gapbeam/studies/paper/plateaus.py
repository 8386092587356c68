"""The plateaus that the paper reads off Figs. 4 to 6: what they are, and from which springs on they are reached."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from scipy.optimize import brentq

from gapbeam.solver.beam_theory.spring_beam import SpringBeam
from gapbeam.studies.paper.printed_figures import printed

NAMES = {(inf, inf): "clamped", (0.0, inf): "sliding", (inf, 0.0): "pinned", (0.0, 0.0): "free"}
DECADES = (-8.0, 18.0)  # of springs between which a plateau begins


@dataclass(frozen=True)
class Plateau:
    """A plateau of one root.

    Attributes:
        mode: n.
        printed: Its value in the paper.
        draught: The threshold of k1 in the paper, N/m.
        torsion: The threshold of k2 in the paper, N m/rad.
        limits: k1 and k2 that it belongs to, each 0 or infinite.
    """

    mode: int
    printed: float
    draught: float
    torsion: float
    limits: tuple[float, float]

    @property
    def name(self) -> str:
        """What the end is there: clamped, sliding, pinned or free."""
        return NAMES[self.limits]

    def value(self, beam: SpringBeam) -> float:
        """Return the root in the limit, whatever the beam."""
        return float(beam.roots(self.mode, *self.limits))

    def at_threshold(self, beam: SpringBeam) -> float:
        """Return the root at the springs that the paper names."""
        return float(beam.roots(self.mode, self.draught, self.torsion))

    def reached(self, beam: SpringBeam, share: float) -> tuple[float, float]:
        """Return k1, N/m, and k2, N m/rad, each with the other in its limit, where the root is off by a share."""
        value = self.value(beam)

        def off(place: int, exponent: float) -> float:
            springs = [*self.limits]
            springs[place] = 10.0**exponent
            return abs(float(beam.roots(self.mode, *springs)) / value - 1.0) - share

        first, second = (10.0 ** brentq(lambda x, at=at: off(at, x), *DECADES, xtol=1e-6) for at in (0, 1))
        return first, second


def printed_plateaus() -> tuple[Plateau, ...]:
    """Return the plateaus that the paper names."""
    return tuple(_plateau(table) for table in printed()["plateau"])


def _plateau(table: Mapping[str, Any]) -> Plateau:
    draught, first = _threshold(table, "k1")
    torsion, second = _threshold(table, "k2")
    return Plateau(int(table["mode"]), float(table["value"]), draught, torsion, (first, second))


def _threshold(table: Mapping[str, Any], spring: str) -> tuple[float, float]:
    """Return a threshold, and the limit on its far side."""
    above = f"{spring}_above"
    return (float(table[above]), inf) if above in table else (float(table[f"{spring}_below"]), 0.0)
