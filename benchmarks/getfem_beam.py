"""The slice in plane stress in GetFEM: its elasticity, its penalized contact with rigid obstacles, its Newton.

Mesh, degree, penalty, quadrature and time scheme (midpoint rule, contact at the end of the step) are those of a gapbeam
model; the matrices are GetFEM's own. Obstacles are given as signed distances, as its manual has it.
"""

from __future__ import annotations

from typing import Any

import getfem as gf
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from gapbeam.solver.assembly.elasticity import lame
from gapbeam.solver.case.beam_motions import axial_restraint
from gapbeam.solver.case.case import Case
from gapbeam.solver.models.model import Model

gf.util_trace_level(0)  # its default reports every term assembled

Array = NDArray[np.float64]
Terms = tuple[tuple[str, int], ...]  # weak forms and the regions they are integrated over, -1 the body

BASE, GLAND = 1, 2
ENGAGED = 1.0e-6  # m, of penetration to start the seat with: Newton's method finds no hold in an open gap
RESIDUAL = 1.0e-5  # N, summed over the DOFs: about ten times what round-off leaves
MOST_ITERATIONS = 60
ON_LINE = 1.0e-9  # m


class GetfemBeam:
    """A beam of GetFEM on the mesh of a gapbeam model.

    Args:
        case: The case of the model.
        model: A 2D model on a structured mesh of quadrilaterals, with penalty contact, without contact damping.
    """

    def __init__(self, case: Case, model: Model) -> None:
        self._case, self._dt = case, model.step
        places = model.space.mesh.geometry.x
        lines = [np.unique(np.round(places[:, axis], 9)) for axis in (0, 1)]
        self._mesh = mesh = gf.Mesh("cartesian", *lines)
        self._space = gf.MeshFem(mesh, 2)
        self._space.set_fem(gf.Fem(f"FEM_QK(2,{case.mesh.degree})"))
        self._volume = gf.MeshIm(mesh, gf.Integ("IM_GAUSS_PARALLELEPIPED(2,6)"))
        faces = gf.MeshIm(mesh, gf.Integ(f"IM_GAUSS_PARALLELEPIPED(2,{model.point_rule.degree})"))
        low, high, end = lines[1][0], lines[1][-1], case.layout.end
        for region, level in ((BASE, low), (GLAND, high)):
            mesh.set_region(region, _supported(mesh, level, end))
        first, second = lame(case.material, case.mesh.plane == "stress")
        width, area = case.beam.width, model.system.contact.area
        strain = f"({first}*Div_u*Div_Test_u + {second}*((Grad_u+Grad_u'):Grad_Test_u))"
        held = f"{width * axial_restraint(case).value / area}*u(1)*Test_u(1)"
        self._inertia = ((f"{width * case.material.density}*u.Test_u", -1),)
        self._elastic = ((f"{width}*{strain}", -1), (held, BASE), (held, GLAND))
        self.mass, self.stiffness = self._assembled(self._inertia), self._assembled(self._elastic)
        self._damping = (model.system.mass_damping, model.system.stiffness_damping)
        self.nodes = self._space.basic_dof_nodes()[:, ::2].T
        self.gap_levels = {BASE: low, GLAND: high + case.layout.clearance}
        self._faces, self._penalty = faces, model.law.stiffness * width

    def seat(self) -> Array:
        """Return the static contact equilibrium under gravity, (nodes, 2), m."""
        case = self._case
        solver = self._solver(0.0, 1.0)
        solver.set_private_rhs(self._rhs, self._weight())
        tilt = (case.layout.clearance + 2.0 * ENGAGED) / case.layout.end
        guess = np.zeros_like(self.nodes)
        guess[:, 1] = case.layout.clearance + ENGAGED - tilt * self.nodes[:, 0]
        guess[:, 0] = tilt * (self.nodes[:, 1] - self.gap_levels[BASE])
        return self._solved(solver, guess)

    def reactions(self, rest: Array) -> dict[str, float]:
        """Return the contact forces of a state at rest on base and gland, N: what its balance leaves there."""
        left = (self.stiffness @ rest.reshape(-1) - self._weight()).reshape(-1, 2)[:, 1]
        case = self._case
        supported = self.nodes[:, 0] < case.layout.end + ON_LINE
        low, high = self.nodes[:, 1].min(), self.nodes[:, 1].max()
        return {
            "base": float(np.sum(left[supported & (self.nodes[:, 1] < low + ON_LINE)])),
            "gland": -float(np.sum(left[supported & (self.nodes[:, 1] > high - ON_LINE)])),
        }

    def march(self, start: Array, steps: int, loads: Any) -> tuple[list[Array], int]:
        """March from rest.

        Args:
            start: Displacements, (nodes, 2), m.
            steps: Number of steps.
            loads: Forces at a time, besides gravity: time -> (nodes, 2), N.

        Returns:
            Displacements after each step, and the iterations of all steps together.
        """
        dt, (c_mass, c_stiffness) = self._dt, self._damping
        M, K = self.mass, self.stiffness
        solver = self._solver(2.0 / dt**2 + c_mass / dt, 0.5 + c_stiffness / dt)
        weight = self._weight()
        old: Array = start.reshape(-1)
        velocity: Array = np.zeros(start.size)
        states: list[Array] = []
        iterations = 0
        for number in range(steps):
            force = weight + loads((number + 0.5) * dt).reshape(-1)
            force += M @ ((2.0 / dt**2 + c_mass / dt) * old + (2.0 / dt) * velocity)
            force += K @ ((c_stiffness / dt - 0.5) * old)
            solver.set_private_rhs(self._rhs, force)
            new = self._solved(solver, (old + dt * velocity).reshape(-1, 2)).reshape(-1)
            iterations += self._iterations
            velocity = 2.0 / dt * (new - old) - velocity
            old = new
            states.append(new.reshape(-1, 2))
        return states, iterations

    def _weight(self) -> Array:
        gravity = np.zeros_like(self.nodes)
        gravity[:, 1] = -sum(load.weight_acceleration for load in self._case.load)
        return np.asarray(self.mass @ gravity.reshape(-1))

    def _solver(self, mass: float, stiffness: float) -> Any:
        """Return a GetFEM model: mass M + stiffness K, forces, and contact with both obstacles."""
        solver = gf.Model("real")
        solver.add_fem_variable("u", self._space)
        for factor, terms in ((mass, self._inertia), (stiffness, self._elastic)):
            for form, region in terms if factor else ():
                solver.add_linear_term(self._volume, f"{factor}*({form})", region)
        self._rhs = solver.add_explicit_rhs("u", np.zeros(self._space.nbdof()))
        solver.add_initialized_data("penalty", [self._penalty])
        distances = gf.MeshFem(self._mesh, 1)
        distances.set_classical_fem(1)
        for region, name, up in ((BASE, "below", 1.0), (GLAND, "above", -1.0)):
            level = up * (distances.basic_dof_nodes()[1] - self.gap_levels[region])
            solver.add_initialized_fem_data(name, distances, level)
            solver.add_penalized_contact_with_rigid_obstacle_brick(self._faces, "u", name, "penalty", region)
        return solver

    def _solved(self, solver: Any, guess: Array) -> Array:
        solver.set_variable("u", guess.reshape(-1))
        self._iterations, converged = solver.solve("max_res", RESIDUAL, "max_iter", MOST_ITERATIONS, "lsolver", "mumps")
        if not converged:
            raise RuntimeError("GetFEM's Newton did not converge")
        return np.array(solver.variable("u")).reshape(-1, 2)

    def _assembled(self, terms: Terms) -> csc_matrix:
        size = self._space.nbdof()
        total = csc_matrix((size, size))
        for form, region in terms:
            found = gf.asm_generic(self._volume, 2, form, region, "u", 1, self._space, np.zeros(size))
            pointers, rows = found.csc_ind()
            total = total + csc_matrix((found.csc_val(), rows, pointers), shape=(size, size))
        return total


def _supported(mesh: Any, level: float, end: float) -> Any:
    """Return the faces of cells at a level of y within the support."""
    faces = mesh.outer_faces()
    points = mesh.pts()
    keep = []
    for cell, face in faces.T:
        ids = mesh.pid_in_faces(np.array([[cell], [face]]))
        x, y = points[:, ids]
        keep.append(bool(np.all(np.abs(y - level) < ON_LINE) and np.all(x < end + ON_LINE)))
    return faces[:, np.array(keep)]
