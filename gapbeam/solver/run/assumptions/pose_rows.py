"""The pose of a model at points of its surface, for full, reduced, beam and rigid models alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, vstack

from gapbeam.solver.assembly.face_quadrature import body_points
from gapbeam.solver.assembly.surface_rows import SurfaceRows, rows_at, surface_rows
from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import BeamModel
from gapbeam.solver.diagnostics.assumption import PoseScales, PoseWatch
from gapbeam.solver.diagnostics.point_contact import Gauges
from gapbeam.solver.loads.load_choice import axis_point
from gapbeam.solver.loads.support_walls import shifts_at
from gapbeam.solver.models.model import Model
from gapbeam.solver.supports.layout import body_shifts
from gapbeam.solver.system.operators import Array, Interface, Operators, row_product


@dataclass(frozen=True)
class ModelPose:
    """Displacement and gradient at k points of the surface of a model.

    Attributes:
        places: The points, (k, 3), m.
        on_faces: Number of them on base and gland; they come first.
        dimension: d.
        matrix: Map from `interface` values, or from the DOFs of a small model, (k d (1 + d), n).
        interface: DOFs of the mesh that the rows depend on; None: the model is small, on every rank.
        operators: Operators of the model.
    """

    places: Array
    on_faces: int
    dimension: int
    matrix: csr_matrix | Array
    interface: Interface | None
    operators: Operators

    def poses(self, u: Array) -> tuple[Array, Array]:
        """Return displacement (times, k, d) and gradient (times, k, d, d) of marched DOFs u, (times, n). Collective."""
        if self.interface is None:
            assert isinstance(self.matrix, np.ndarray)
            values = row_product(u[:, : self.matrix.shape[1]], self.matrix.T)  # bodies of supports come after the beam
        else:
            values = np.stack([self.matrix @ self.interface.trace(one, self.operators) for one in u])
        count, d = len(self.places), self.dimension
        return values[:, : count * d].reshape(-1, count, d), values[:, count * d :].reshape(-1, count, d, d)


def watch_of(case: Case, model: Model) -> PoseWatch:
    """Return the watch on the pose of a model of a case. Collective."""
    rows = surface_rows(model.space, np.concatenate(list(model.body.meshed.faces.values())))
    pose, places = _pose_at(model, rows), rows.cell_middles
    walls, on_faces = model.system.contact.walls, pose.places[: pose.on_faces, 0]
    of_bodies = body_shifts(case.layout, on_faces, pose.dimension)
    if not walls.motions and not len(of_bodies):
        return PoseWatch(pose, scales_of(case, places))
    shifts = shifts_at(case.load, case.layout, on_faces, pose.dimension)

    def moved(time: float, u: Array) -> Array:
        of_walls = np.tensordot(walls.places(np.array([time]))[0], shifts, 1) if walls.motions else 0.0
        bodies = u[len(u) - len(of_bodies) :]
        return np.asarray(of_walls + np.tensordot(bodies, of_bodies, 1) if len(bodies) else of_walls)

    return PoseWatch(pose, scales_of(case, places), moved)


def gauges_of(case: Case, model: Model) -> Gauges | None:
    """Return the stress gauges of probes that ask for stress; None where none does.

    Raises:
        UserError: Such a probe is outside of the mesh; on all ranks.

    Collective.
    """
    asked = [probe for probe in case.probe if probe.stress]
    if not asked:
        return None
    points, numbers = body_points(
        model.space, [(f"[[probe]] {probe.name}", axis_point(probe.point)) for probe in asked]
    )
    places = np.array([axis_point(probe.point)[0] for probe in asked])
    shares = 1.0 / np.bincount(numbers, minlength=len(asked))
    return Gauges(_pose_at(model, rows_at(model.space, points)), scales_of(case, places), numbers, shares)


def _pose_at(model: Model, found: SurfaceRows) -> ModelPose:
    rows = csr_matrix(vstack([found.displacement, found.gradient]))
    dimension, operators, expansion = model.space.mesh.geometry.dim, model.system.operators, model.body.expansion
    if expansion is None:
        return ModelPose(found.places, found.on_faces, dimension, rows, found.interface, operators)
    trace = np.zeros((found.interface.size, expansion.shape[1]))
    taken = expansion[found.interface.owned]
    trace[found.interface.slots] = taken if isinstance(taken, np.ndarray) else taken.toarray()
    small = np.ascontiguousarray(rows @ model.space.mesh.comm.allreduce(trace))
    return ModelPose(found.places, found.on_faces, dimension, small, None, operators)


def scales_of(case: Case, places: Array) -> PoseScales:
    """Return the scales of the pose of a case at places along the beam, (k,), m."""
    profile, plane = case.profile, case.mesh.dimension == 2 and case.mesh.plane == "stress"
    shear, poisson, strength = zip(*(_constants(profile.at(x).material) for x in map(float, places)), strict=True)
    several = not profile.one_material
    first, nu, _ = _constants(profile.pieces[0].material)
    supported, holes = profile.supported(case.layout), case.layout.holes
    return PoseScales(
        shear_modulus=np.array(shear) if several else first,
        poisson_ratio=np.array(poisson) if several else nu,
        thin="beam" if isinstance(case.model, BeamModel) else "plane" if plane else "",
        support_length=case.layout.shortest,
        width=np.inf if holes else min(piece.beam.width for piece in supported),
        radius=_radii(case, places),
        span=case.time.end,
        strength=np.array(strength) if several else 1.0,
    )


def _radii(case: Case, places: Array) -> Array:
    """Return the radius of the beam where supports are met along its radii, else infinity, (k,), m."""
    radii, slack = np.full(len(places), np.inf), ROUND_OFF * case.beam.length
    for support in case.layout.holes:
        if support.met_region.along_radii:
            inside = (support.start - slack <= places) & (places <= support.end + slack)
            radii[inside] = [0.5 * case.profile.at(float(x)).beam.thickness for x in places[inside]]
    return radii


ROUND_OFF = 1e-9  # of the length


def _constants(material: Material) -> tuple[float, float, float]:
    """Return shear modulus, Pa, Poisson ratio and yield stress, infinite where none is given, Pa."""
    most = np.inf if material.yield_stress is None else material.yield_stress
    return material.shear_modulus, material.poisson_ratio, most
