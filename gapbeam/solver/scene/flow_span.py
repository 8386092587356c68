"""Spans of a tube in a flow: points of a structure, each with its length and its share of the flow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.given_numbers import ArgumentError, finite, positive
from gapbeam.solver.scene.structure import Structure, StructurePoint, dense
from gapbeam.solver.system.operators import Array

Profile = float | Callable[[Array], Any]
KEPT = 1e-9  # of the largest: directions below are round-off of the quadrature
DEGREE = 5


@dataclass(frozen=True, eq=False)
class FlowSpan:
    """Points of one structure in a flow.

    Attributes:
        points: StructurePoints of the same motions: 1 across the flow, or 2, along and across the flow.
        lengths: That each point stands for, (points,), m.
        velocity: At each point over the reference velocity, (points,).
        density: At each point over the reference density, (points,).
    """

    points: tuple[StructurePoint, ...]
    lengths: Array
    velocity: Array
    density: Array

    @property
    def structure(self) -> Structure:
        """The tube."""
        return self.points[0].structure

    @property
    def motions(self) -> int:
        """Motions of each point."""
        return len(self.points[0].rows)

    def directions(self, modes: int | None = None) -> list[tuple[StructurePoint, float]]:
        """Return the fewest points that feel the same forces, each with its velocity over the reference velocity.

        Points with one velocity are joined: sum_k w_k b_k b_k^T with weights w of length and density is kept exactly,
        by the singular vectors of sqrt(w_k) b_k.

        Args:
            modes: The force acts on so many modes of the structure, from the lowest; default all.
        """
        rows = np.stack([point.rows for point in self.points])
        if modes is not None:
            X = self.structure.modes[2]
            if not 1 <= modes <= X.shape[1]:
                raise ArgumentError(f"flow: found {modes} modes, expected 1 to {X.shape[1]}", "modes")
            rows = rows @ X[:, :modes] @ (X[:, :modes].T @ dense(self.structure.M))
        weighted, found = np.sqrt(self.lengths * self.density)[:, None, None] * rows, []
        for velocity in np.unique(self.velocity):
            some = weighted[self.velocity == velocity]
            U, sizes, _ = np.linalg.svd(some.reshape(len(some), -1), full_matrices=False)
            U = U[:, sizes > KEPT * sizes[0]] if sizes[0] > 0.0 else U[:, :0]
            joined = np.einsum("kj,kdn->jdn", U, some)
            found += [(StructurePoint(self.structure, one), float(velocity)) for one in joined]
        return found


@checked
def span(
    structure: Structure, places: Mapping[str, float], velocity: Profile = 1.0, density: Profile = 1.0
) -> FlowSpan:
    """Return the span of a tube between the first and the last of some of its points.

    Integrals along the span are those of a spline of degree 5 through the points: the error falls with the sixth power
    of their distance.

    Args:
        structure: The tube.
        places: Places along the tube by name of a point, m; two or more, the ends of the span among them.
        velocity: Profile of the velocity over a reference velocity: a number, or a function of the places.
        density: Profile of the density over a reference density.

    Raises:
        UserError: A point is unknown, places coincide or are too uneven, or a profile is not positive.
    """
    where = f"span of {structure.name or '?'}"
    names = sorted(places, key=lambda name: float(places[name]))
    x = finite([places[name] for name in names], f"{where}: places")
    if len(x) < 2 or not np.all(np.diff(x) > 0.0):
        raise UserError(f"{where}: found places {x.tolist()}, expected two or more that differ")
    points = tuple(structure[name] for name in names)
    if len({len(point.rows) for point in points}) > 1:
        raise UserError(f"{where}: its points have different numbers of motions; expected the same number")
    spline = make_interp_spline(x, np.eye(len(x)), k=min(DEGREE, len(x) - 1))
    lengths = spline.integrate(x[0], x[-1])
    if not np.all(lengths > 0.0):
        raise UserError(f"{where}: the places are too uneven for a spline; space the points evenly")
    profiles = []
    for profile, what in ((velocity, "velocity"), (density, "density")):
        values = profile(x) if callable(profile) else profile
        profiles.append(np.broadcast_to(positive(values, f"{where}: {what}"), x.shape).copy())
    return FlowSpan(points, lengths, *profiles)


@checked
def in_fluid(dry: Structure, places: Mapping[str, float], mass: float) -> Structure:
    """Return a structure that carries the added mass of a fluid along a span; the added mass has no weight.

    Args:
        dry: The structure.
        places: As of `span`.
        mass: Added mass per length, kg/m.

    Raises:
        UserError: As `span`; or the mass is negative.
    """
    where = f"fluid around {dry.name or '?'}"
    per_length, along = float(positive(mass, f"{where}: mass", zero=True)), span(dry, places)
    M = dense(dry.M).copy()
    for point, length in zip(along.points, along.lengths, strict=True):
        M += per_length * length * point.rows.T @ point.rows
    rows = {name: point.rows for name, point in dry.points.items()}
    return Structure(M, dry.K, dry.C, rows, dry.rigid, dry.name, dry.inertia, dry.frame or None)
