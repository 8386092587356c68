"""Figures of one period of a march, such as "tip.rms" or "stop.peak_force", and their derivatives by its steps."""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.system.operators import Array

POINT_FIGURES, CONTACT_FIGURES = ("peak", "rms", "harmonic_1"), ("peak_force", "impulse", "work")
TIED, ALIKE = 1e-9, 1e-6
"""Relative: difference of two maxima that are one to round-off, and of their derivatives where these are one, too."""


@dataclass(frozen=True)
class OrbitFigure:
    """A figure of displacements or contact forces of all steps of a period.

    Attributes:
        name: Name with its owner.
        kind: "peak", "rms", "harmonic_3", "peak_force", "impulse" or "work".
        columns: Columns of the motions of its owners; for the work those of forces, then those of moves.
        harmonic: Number of the harmonic.
        owners: Number of contacts, whose forces add up.
    """

    name: str
    kind: str
    columns: list[int]
    harmonic: int = 0
    owners: int = 1

    @property
    def forces(self) -> bool:
        """True for a figure of contact forces."""
        return self.kind in CONTACT_FIGURES

    def own(self, series: Array) -> Array:
        """Return its motions of a series: the sum over its owners, or for the work those of all."""
        x = series[:, self.columns]
        if self.kind == "work" or self.owners == 1:
            return x
        total: Array = x.reshape(len(x), self.owners, -1).sum(axis=1)
        return total

    def value(self, series: Array, h: float) -> tuple[float, Array]:
        """Return the figure and its derivative by each value of its own motions.

        Args:
            series: Displacements of all points, (steps, motions), or forces of all contacts, then their moves in each
                step.
            h: Step, s.
        """
        x = self.own(series)
        size, steps = np.linalg.norm(x, axis=1), len(x)
        unit: Array = x / np.where(size > 0.0, size, 1.0)[:, None]
        if self.kind in ("peak", "peak_force"):
            at = int(np.argmax(size))
            return float(size[at]), unit * (np.arange(steps) == at)[:, None]
        if self.kind == "work":
            F, way = np.split(x, 2, axis=1)
            return -float((F * way).sum()), -np.hstack([way, F])
        if self.kind == "rms":
            rms = float(np.sqrt(np.mean(size**2)))
            return rms, np.asarray(x / (steps * rms or 1.0), dtype=float)
        if self.kind == "impulse":
            return h * float(size.sum()), h * unit
        turns = (
            np.exp(-2j * np.pi * self.harmonic / steps * np.arange(1, steps + 1)) * (2 if self.harmonic else 1) / steps
        )
        parts = turns @ x
        amplitude = float(np.linalg.norm(parts))
        weight: Array = np.asarray(np.real(np.conj(parts) * turns[:, None]) / (amplitude or 1.0), dtype=float)
        return amplitude, weight

    def scale(self, series: Array, h: float) -> float:
        """Return the size that round-off is relative to: the figure, or the elastic work that the work is a part of."""
        value, weight = self.value(series, h)
        return 0.5 * float(np.abs(self.own(series) * weight).sum()) if self.kind == "work" else value

    def slope(self, series: Array, moves: Array, h: float, growth: float) -> float:
        """Return the derivative of the figure.

        Args:
            series: See `value`.
            moves: Derivative of the series, (steps, motions).
            h: Step, s.
            growth: Derivative of the step.

        Raises:
            UserError: The figure has no derivative.
        """
        x, moves, (value, weight) = self.own(series), self.own(moves), self.value(series, h)
        if not (moves * weight if self.kind == "work" else moves).any():
            return growth / h * value if self.kind == "impulse" else 0.0
        size = np.linalg.norm(x, axis=1)
        most = {"impulse": h * size.max(), "work": self.scale(series, h)}.get(self.kind, size.max())
        if not value > TIED * most:
            raise UserError(f"tangents: {self.name} is 0 within round-off, where it has no derivative")
        if self.kind in ("peak", "peak_force"):
            ways = (x * moves).sum(axis=1)[size >= (1.0 - TIED) * value] / value
            if np.ptp(ways) > ALIKE * np.abs(ways).max():
                raise UserError(
                    f"tangents: {self.name} is reached at {len(ways)} steps within round-off, with a derivative each; "
                    "change a parameter or the start a little"
                )
        return float((weight * moves).sum()) + (growth / h * value if self.kind == "impulse" else 0.0)


def figure_of(scene: Scene, name: str) -> OrbitFigure:
    """Return a figure by its name, "owner.kind" or "structure.point.kind".

    A star in the name of contacts of as many motions stands for letters.

    Raises:
        UserError: The scene has no such figure.
    """
    given, _, kind = name.rpartition(".")
    owner = scene.short_name(given)
    at, columns = 0, dict[str, list[int]]()
    for point, one in scene.point_names.items():
        columns[point], at = list(range(at, at + len(one.rows))), at + len(one.rows)
    contacts = {
        one.name: list(range(int(first), int(first) + one.region.motions))
        for one, first in zip(scene.contacts, scene.first, strict=False)
    }
    number = kind.removeprefix("harmonic_")
    if owner in columns and (kind in ("peak", "rms") or (number != kind and number.isdigit())):
        return OrbitFigure(name, kind, columns[owner], int(number) if number.isdigit() else 0)
    found = [one for key, one in contacts.items() if key == owner or (key and fnmatchcase(key, owner))]
    if kind in CONTACT_FIGURES and len({len(one) for one in found}) == 1:
        forces = [k for one in found for k in one]
        moves = [scene.motions + k for k in forces] if kind == "work" else []
        return OrbitFigure(name, kind, forces + moves, owners=len(found))
    known = [f"{one}.{kind}" for one in columns for kind in POINT_FIGURES]
    known += [f"{one}.{kind}" for one in contacts for kind in CONTACT_FIGURES]
    raise UserError(f"tangents: found figure {name!r}, expected one of {', '.join(known)}")
