"""A rigid body as the one part of a beam: its DOFs are the motions of its section in the middle of the beam.

As in multibody programs, a rigid body has

    M = int rho V^T V dV,    u = V q

with the three motions of the plane, or all six. The integral is over the cells of the mesh; contact, loads and probes
are those of the points of the beam.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_matrix

from gapbeam.meshes.tagged_mesh import cell_points
from gapbeam.meshes.versions.mesh_geometry import geometry_order
from gapbeam.solver.assembly.cell_values import in_cells
from gapbeam.solver.case.analysis_table import NAMES, RigidMotion, unit_motions
from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.attachments import IN_PLANE, MeanMotion, MotionName
from gapbeam.solver.models.body import MeshedBeam
from gapbeam.solver.system.dense_operators import SparseOperators
from gapbeam.solver.system.operators import Array

EXACT = {1: 6, 2: 10}  # degree of quadrature of squares of coordinates, by the order of the cells


@dataclass(frozen=True)
class RigidPart:
    """All motions of a rigid body.

    Attributes:
        middle: Where along the beam the section lies whose motions are the DOFs, m.
        dimension: Of displacements, 2 or 3.
        mass: M, (size, size).
        centroid: Returns (y, z) of the centroid of the cross-section at x, m.
    """

    middle: float
    dimension: int
    mass: Array
    centroid: Callable[[float], tuple[float, float]]

    @classmethod
    def of_case(cls, case: Case, meshed: MeshedBeam) -> RigidPart:
        """Return the part of a case, whose mass is that of its cells. Collective."""
        mesh, middle, dimension = meshed.tagged.mesh, 0.5 * case.beam.length, case.mesh.dimension
        massless = cls(middle, dimension, np.empty((0, 0)), _centroid(case, meshed))
        owned = mesh.topology.index_map(dimension).size_local
        density = in_cells(mesh, case.profile, lambda piece: piece.material.density)[:owned]
        mass = np.zeros((massless.size, massless.size))
        for volume, places in cell_points(mesh, EXACT[geometry_order(mesh)]):
            moved = massless._at(places)
            mass += np.einsum("c,cik,cjk->ij", meshed.width * density * volume, moved, moved, optimize=True)
        mass = np.asarray(sum(mesh.comm.allgather(mass)))
        return cls(middle, dimension, 0.5 * (mass + mass.T), massless.centroid)

    @property
    def names(self) -> tuple[MotionName, ...]:
        """The motions."""
        return NAMES if self.dimension == 3 else IN_PLANE

    nodal: ClassVar[int] = 0  # no DOFs belong to a node

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return len(self.names)

    @cached_property
    def _motions(self) -> tuple[RigidMotion, ...]:
        about = [
            RigidMotion.about((self.middle, 0.0, 0.0), one.translation, one.rotation)
            for name, one in zip(NAMES, unit_motions(), strict=True)
            if name in self.names
        ]
        return tuple(about)

    def _at(self, places: Array) -> Array:
        """Return the motions of points, (k, size, dimension)."""
        axes = [0, 1, 2] if self.dimension == 3 else [0, 2]
        inside = np.zeros((len(places), 3))
        inside[:, axes] = places[:, : self.dimension]
        return np.stack([motion.at(inside)[:, axes] for motion in self._motions], axis=1)

    def operators(self) -> SparseOperators:
        """Return M and K = 0."""
        return SparseOperators(csr_matrix(self.mass), csr_matrix(self.mass.shape))

    def along(self, places: Array, directions: Array) -> csr_matrix:
        """Return the motion of points along directions, (k, size)."""
        return csr_matrix(np.einsum("kid,kd->ki", self._at(places), directions))

    def displacement(self, places: Array) -> csr_matrix:
        """Return the displacement of points, (k dimension, size)."""
        return csr_matrix(self._at(places).transpose(0, 2, 1).reshape(-1, self.size))

    def section_motion(self, x: float, name: MotionName) -> Array | None:
        """Return the row of a motion of the cross-section at a place, (size,); None: the body has no such motion."""
        if name not in self.names:
            return None
        motion = MeanMotion(x, name)
        if motion.turns:
            return np.asarray(np.array(self.names) == name, dtype=float)
        beside, above = self.centroid(x)
        center = np.array([[x, beside, above]]) if self.dimension == 3 else np.array([[x, above, 0.0]])
        return np.asarray(self._at(center)[0] @ motion.direction(self.dimension))

    def uniform(self, direction: Array) -> Array:
        """Return the motion of all points by a vector, (size,)."""
        return np.asarray(self._at(np.array([[self.middle, 0.0, 0.0]]))[0] @ direction)

    def rigid_motions(self) -> dict[MotionName, Array]:
        """Return the rigid motions by what the section at x = 0 does, (size,) each."""
        found = dict[MotionName, Array]()
        for name, motion in zip(NAMES, unit_motions(), strict=True):
            if name in self.names:
                moved = motion.section(self.middle)
                found[name] = np.array([moved[own] for own in self.names])
        return found


def _centroid(case: Case, meshed: MeshedBeam) -> Callable[[float], tuple[float, float]]:
    """Return the function to the centroids of cross-sections: those of the sections, or of a mesh file."""
    if case.mesh.file is None:
        return lambda x: case.profile.at(x).beam.centroid
    from gapbeam.solver.assembly.section_cut import SectionCutter

    cutter = SectionCutter(meshed.space)

    def cut(x: float) -> tuple[float, float]:
        moments = cutter.cut(x, "a joint, a mass, a fluid or a restraint").moments
        center = moments[0, 1:] / moments[0, 0]
        return (0.0, float(center[0])) if len(center) == 1 else (float(center[0]), float(center[1]))

    return cut
