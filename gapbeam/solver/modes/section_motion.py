"""Motion of the cross-sections in a mode: bending, stretching and twist of a finite element body as a beam.

The nodes are gathered in slices along x. In each slice their masses (the diagonal of M, scaled to its total) give the
mean motion, and its first moment about the axis the twist; the share of the kinetic energy that each of these holds
names the mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx.fem import petsc as fem_petsc

from gapbeam.solver.assembly.elasticity import density_of
from gapbeam.solver.assembly.form_cache import compiled_form
from gapbeam.solver.models.model import Model
from gapbeam.solver.system.operators import Array

KINDS = {2: ("axial", "bending"), 3: ("axial", "lateral", "bending", "torsional")}
MIXED = "mixed"
OF_SUPPORT = "support"
MOST_SLICES = 96
HELD = 0.5  # of the kinetic energy, for a name


@dataclass(frozen=True)
class SectionMotion:
    """The motion of the sections in one mode.

    Attributes:
        kind: "axial", "bending", "lateral", "torsional", or "mixed" where no share is above one half; "support" where
            that of the bodies of supports is.
        share: Of the kinetic energy that the motion of that kind holds.
        bending: Mean motion in the bending direction, (slices,), as the shape is scaled.
    """

    kind: str
    share: float
    bending: Array


class Sections:
    """Slices of a beam along its axis, on all ranks.

    Attributes:
        places: Mean x of each slice, (slices,), m.
        masses: Mass of each slice, (slices,), kg.

    Collective to make and to use.
    """

    def __init__(self, model: Model) -> None:
        self._model, self._comm = model, model.space.mesh.comm
        space = model.space
        self._components = space.dofmap.index_map_bs
        owned = space.dofmap.index_map.size_local
        x = space.tabulate_dof_coordinates()[:owned]
        self._node_masses = self._masses(owned)
        slices = self._slices(x)
        edges = np.linspace(0.0, model.case.beam.length, slices + 1)
        self._slice = np.clip(np.searchsorted(edges, x[:, 0], side="right") - 1, 0, slices - 1)
        self._count = slices
        sums = self._sums(np.stack([np.ones(owned), *x.T]))
        self._filled = sums[0] > 0.0
        inverse = np.where(self._filled, 1.0, 0.0) / np.where(self._filled, sums[0], 1.0)
        self._inverse = inverse
        means = sums[1:] * inverse
        self._off = x.T - means[:, self._slice]
        self._moments = self._sums(self._off**2)
        self.masses, self.places = sums[0][self._filled], means[0][self._filled]

    def motion(self, shape: Array) -> SectionMotion:
        """Return the motion of the sections.

        Args:
            shape: Marched DOFs that this rank owns, (n,).
        """
        of_bodies = self._of_bodies(shape)
        if of_bodies > HELD:
            return SectionMotion(OF_SUPPORT, of_bodies, np.zeros(int(np.sum(self._filled))))
        return self._of_beam(self._model.expand(shape))

    def _of_bodies(self, shape: Array) -> float:
        """Return the share of the kinetic energy that the bodies of supports have."""
        size = self._model.body.operators.size
        if len(shape) == size:
            return 0.0
        weighted = self._model.system.operators.apply_mass(shape)
        return float(shape[size:] @ weighted[size:] / (shape @ weighted))

    def _of_beam(self, shape: Array) -> SectionMotion:
        """Return the motion of the sections where the nodes of this rank move so, (n,)."""
        u = shape.reshape(-1, self._components).T
        components = self._components
        bending = components - 1
        sums = self._sums(np.concatenate([u, (u * u).sum(axis=0)[None]]))
        means = sums[:components] * self._inverse
        energies = [float(mass) for mass in (sums[:components] * means).sum(axis=1)]
        if components == 3:
            energies.append(self._twisting(u))
        total = float(sums[components].sum())
        best = int(np.argmax(energies))
        share = energies[best] / total
        kind = KINDS[components][best] if share > HELD else MIXED
        return SectionMotion(kind, share, means[bending][self._filled])

    def _twisting(self, u: Array) -> float:
        """Return the share of u_z = r y and of u_y = -r z, each with its own r in a slice."""
        energy = 0.0
        for component, lever in ((2, 1), (1, 2)):
            moved = self._sums((u[component] * self._off[lever])[None])[0]
            held = self._moments[lever] > 0.0
            energy += float(np.sum(moved[held] ** 2 / self._moments[lever][held]))
        return energy

    def _sums(self, values: Array) -> Array:
        """Return sum of m v over the nodes of each slice, (rows, slices), the same on all ranks."""
        local = np.stack(
            [np.bincount(self._slice, weights=self._node_masses * row, minlength=self._count) for row in values]
        )
        total: Array = np.empty_like(local)
        self._comm.Reduce(local, total)
        self._comm.Bcast(total)
        return total

    def _masses(self, owned: int) -> Array:
        """Return masses of the nodes: the diagonal of the consistent mass matrix, scaled to the mass of the beam."""
        space, meshed = self._model.space, self._model.body.meshed
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        profile = self._model.case.profile
        moved = ufl.inner(u, v) if profile.one_material else density_of(space.mesh, profile) * ufl.inner(u, v)
        matrix: Any = fem_petsc.assemble_matrix(compiled_form(moved * ufl.dx))
        matrix.assemble()
        diagonal = np.array(matrix.getDiagonal().array_r)[: owned * self._components : self._components]
        matrix.destroy()
        total = self._comm.bcast(self._comm.reduce(float(diagonal.sum())))
        mass = profile.pieces[0].material.density * meshed.section.volume if profile.one_material else profile.mass
        return np.asarray(diagonal * (mass / total))

    def _slices(self, x: Array) -> int:
        """Return how many slices hold at least one node each, from the largest distance between columns of nodes."""
        gathered = self._comm.gather(np.unique(np.round(x[:, 0] / self._model.case.beam.length, 6)))
        widest = 0.0
        if gathered is not None:
            widest = float(np.max(np.diff(np.unique(np.concatenate(gathered)))))
        widest = self._comm.bcast(widest)
        return int(np.clip(np.floor(1.0 / widest), 4, MOST_SLICES))
