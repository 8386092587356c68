"""The watch on the pose of the beam: rotation, strain, stress, travel along the support and motion across it.

    W = (H - H^T)/2,  E = (H + H^T)/2,  H = du/dx;    rotation |W|/sqrt 2,  strain |E|,  stress sqrt(3/2) |2 mu dev E|

at points of the surface, |.| the Frobenius norm. A record is looked at where its strain energy exceeds all that was
looked at before by a tenth, and 200 times over the span of the run. Looks follow from the records alone, so that a
resumed run looks at the same ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from gapbeam.solver.system.operators import Array

LOOKS = 200  # over the span of a run
TOGETHER = 2**16  # points of all poses that are looked at together
HIGHER = 1.1  # times the largest strain energy looked at so far
ROTATION, STRAIN, STRESS, TRAVEL, ASIDE = range(5)


class PoseRows(Protocol):
    """Rows of displacement and gradient at points of the surface."""

    @property
    def places(self) -> Array:
        """The points, (k, 3), m."""

    @property
    def on_faces(self) -> int:
        """Number of points on base and gland; they come first."""

    def poses(self, u: Array) -> tuple[Array, Array]:
        """Return displacement (times, k, d) and gradient (times, k, d, d) of marched DOFs u, (times, n). Collective."""


@dataclass(frozen=True)
class PoseScales:
    """Scales that a pose is compared with.

    Attributes:
        shear_modulus: mu, Pa, of a beam of one material; of several ones that at each point, (k,).
        poisson_ratio: nu, likewise.
        thin: Rule that completes the strain across plane or beam: by -nu/(1-nu) of the sum (plane stress: "plane"),
            by -nu of that along the beam (beam models: "beam"), or not ("").
        support_length: m.
        width: m.
        radius: Of a beam in supports that are met along its radii; 0: there is none, m.
        span: Of the run, s.
        strength: Divisor of the watched stress: 1, or the yield stress at each point, (k,), Pa.
    """

    shear_modulus: float | Array
    poisson_ratio: float | Array
    thin: str
    support_length: float
    width: float
    radius: float
    span: float
    strength: float | Array = 1.0


def still(_time: float, _u: Array) -> float:
    """Return the motion of supports that do not move, 0."""
    return 0.0


@dataclass
class PoseWatch:
    """Keeps the largest rotation, strain, stress, travel and motion across the beam of a run.

    Attributes:
        rows: Rows of a pose.
        scales: Its scales.
        moved: By how much the supports of the points on faces have moved at a time, with marched DOFs (n,),
            (on_faces, d) or 0, m: travel and motion across are those in them.
        closest: Row by row of ROTATION, STRAIN, STRESS, TRAVEL, ASIDE: value, time and place, (5, 5).
        due: When the next look is due, s.
        highest: Largest strain energy looked at, J.
        at_start: Rotation at the first look, rad.
        looks: Number of looks.
    """

    rows: PoseRows
    scales: PoseScales
    moved: Callable[[float, Array], Array | float] = still
    closest: Array = field(default_factory=lambda: np.zeros((5, 5)))
    due: float = -1.0
    highest: float = 0.0
    at_start: float = 0.0
    looks: int = 0

    def see(self, times: Array, u: Array, strain_energy: Array) -> None:
        """See records.

        Args:
            times: (times,), s.
            u: Marched DOFs, (times, n).
            strain_energy: (times,), J.

        Collective.
        """
        chosen = []
        for place in np.flatnonzero((times >= self.due) | ~(strain_energy <= HIGHER * self.highest)):
            time, energy = float(times[place]), float(strain_energy[place])
            if time < self.due and energy <= HIGHER * self.highest:
                continue
            chosen.append(place)
            self.highest = max(self.highest, energy)
            if time >= self.due:
                self.due = time + self.scales.span / LOOKS
        together = max(1, TOGETHER // max(1, len(self.rows.places)))
        for first in range(0, len(chosen), together):
            some = chosen[first : first + together]
            self._look(times[some], u[some])
            self.looks += len(some)

    def end(self) -> None:
        """Look no more."""
        self.due = self.highest = np.inf

    def _look(self, times: Array, u: Array) -> None:
        displacement, gradient = self.rows.poses(u)
        rotation, strain, stress = deformation(gradient, self.scales)
        places, faces = self.rows.places, self.rows.on_faces
        self._keep(ROTATION, rotation, times, places)
        self._keep(STRAIN, strain, times, places)
        self._keep(STRESS, np.asarray(stress / self.scales.strength), times, places)
        if faces:
            inside = displacement[:, :faces].copy()
            for one, time, marched in zip(inside, times, u, strict=True):
                one -= self.moved(time, marched)
            moved = np.abs(np.mean(inside, axis=1))
            share = moved[:, 0] / self.scales.support_length
            if moved.shape[1] > 2:
                share = np.maximum(share, moved[:, 1] / self.scales.width)
            self._keep(TRAVEL, share[:, None], times, np.mean(places[:faces], axis=0, keepdims=True))
            if self.scales.radius:
                aside = np.linalg.norm(inside[..., 1:] - rolled(places[:faces], gradient[:, :faces]), axis=-1)
                self._keep(ASIDE, aside / self.scales.radius, times, places[:faces])
        if not self.looks:
            self.at_start = float(np.max(rotation[0]))

    def _keep(self, row: int, found: Array, times: Array, places: Array) -> None:
        """Keep the largest of values at times and places, (times, places), if it exceeds what was kept."""
        time, place = np.unravel_index(np.argmax(found), found.shape)
        if not found[time, place] <= self.closest[row, 0]:
            self.closest[row] = found[time, place], times[time], *places[place]


def rolled(places: Array, gradient: Array) -> Array:
    """Return the motion across the beam of surface points by its rotation about its axis, (..., k, 2), m.

    A round beam that rolls keeps its radii.

    Args:
        places: The points, (k, 3), m.
        gradient: du/dx there, (..., k, 3, 3).
    """
    turned = 0.5 * (gradient[..., 2, 1] - gradient[..., 1, 2])
    return np.stack([-turned * places[:, 2], turned * places[:, 1]], axis=-1)


def deformation(gradient: Array, scales: PoseScales) -> tuple[Array, Array, Array]:
    """Return rotation (rad), size of the strain and von Mises stress (Pa), (..., k), of gradients (..., k, d, d)."""
    turned = 0.5 * (gradient - np.swapaxes(gradient, -1, -2))
    strain = strain_of(gradient, scales)
    mean = np.trace(strain, axis1=-2, axis2=-1) / 3.0
    deviator = strain - mean[..., None, None] * np.identity(3)
    stress = 2.0 * scales.shear_modulus * np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1)))
    return np.sqrt(0.5 * np.sum(turned**2, axis=(-2, -1))), np.sqrt(np.sum(strain**2, axis=(-2, -1))), stress


def axial_stress(gradient: Array, scales: PoseScales) -> Array:
    """Return sigma_xx = 2 mu (e_xx + nu / (1 - 2 nu) tr e) of gradients (..., k, d, d), (..., k), Pa."""
    strain, nu = strain_of(gradient, scales), scales.poisson_ratio
    if scales.thin == "beam":  # exact for nu = 1/2, too
        return np.asarray(2.0 * scales.shear_modulus * (1.0 + nu) * strain[..., 0, 0])
    total = np.trace(strain, axis1=-2, axis2=-1)
    return np.asarray(2.0 * scales.shear_modulus * (strain[..., 0, 0] + nu / (1.0 - 2.0 * nu) * total))


def strain_of(gradient: Array, scales: PoseScales) -> Array:
    """Return the strain of gradients (..., k, d, d) in space, (..., k, 3, 3)."""
    dimension, nu = gradient.shape[-1], scales.poisson_ratio
    strain = np.zeros((*gradient.shape[:-2], 3, 3))
    strain[..., :dimension, :dimension] = 0.5 * (gradient + np.swapaxes(gradient, -1, -2))
    if scales.thin == "plane":
        strain[..., 2, 2] = -nu / (1.0 - nu) * (strain[..., 0, 0] + strain[..., 1, 1])
    elif scales.thin == "beam":
        strain[..., 1, 1] = strain[..., 2, 2] = -nu * strain[..., 0, 0]
    return strain
