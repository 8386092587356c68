"""Small beams for verification: cases built in place, and their matrices for SciPy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import eigsh

from gapbeam.solver.case.case import Case
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.seat.escape import RigidMotions
from gapbeam.solver.seat.static_seat import Seat, find_seat
from gapbeam.solver.system.operators import Springs
from gapbeam.solver.system.semi_discrete import ContactOperator, SemiDiscreteSystem, State, imaged

BEAM: dict[str, dict[str, Any]] = {
    "beam": {"length": 0.51, "thickness": 0.012, "width": 0.02},
    "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7919.0},
    "support": {"length": 0.05, "clearance": 0.107e-3},
    "mesh": {"dimension": 2, "size": 0.02, "support_size": 6.25e-3, "cells_through_thickness": 2},
    "time": {"end": 1.0e-2, "step": 1.0e-4},
}
"""The beam of Li et al. (2013) as a slice in plane stress, about 800 DOFs."""

GRAVITY = {"type": "gravity"}
COARSE = {"size": 0.06, "support_size": 12.5e-3, "edge_size": 12.5e-3, "cells_through_thickness": 1}
"""Mesh of a slice with few DOFs."""

SOLID = {
    "dimension": 3,
    "size": 0.06,
    "support_size": 12.5e-3,
    "cells_through_thickness": 1,
    "cells_across_width": 1,
}
"""Mesh of a solid beam with few DOFs."""


def beam_case(
    changes: Mapping[str, Mapping[str, Any]] | None = None,
    loads: tuple[Mapping[str, Any], ...] = (GRAVITY,),
    probes: Mapping[str, float | tuple[float, ...]] | None = None,
) -> Case:
    """Return the beam with some keys of its tables changed, under these loads, with probes at these x."""
    tables: dict[str, Any] = {name: dict(table) for name, table in BEAM.items()}
    for name, table in (changes or {}).items():
        tables.setdefault(name, {}).update(table)
    tables["load"] = [dict(load) for load in loads]
    tables["probe"] = [{"name": name, "point": x} for name, x in (probes or {}).items()]
    return Case.model_validate(tables)


def beam_model(
    changes: Mapping[str, Mapping[str, Any]] | None = None,
    loads: tuple[Mapping[str, Any], ...] = (GRAVITY,),
    probes: Mapping[str, float | tuple[float, ...]] | None = None,
) -> Model:
    """Return the assembled model of `beam_case`."""
    return build_model(beam_case(changes, loads, probes), MPI.COMM_SELF)


def seat_of(model: Model, carries_acceleration: bool = False) -> Seat:
    """Return the static seat of a model."""
    rigid = lambda: RigidMotions.of_body(model.body, model.system.operators.size)  # noqa: E731
    return find_seat(model.system, model.law, model.seat_springs, carries_acceleration, rigid)


def out_of_reach(system: SemiDiscreteSystem, distance: float = 1.0) -> SemiDiscreteSystem:
    """Return the system with both faces moved away by a distance: no contact, the beam floats."""
    contact = replace(system.contact, initial_gap=system.contact.initial_gap + distance)
    return replace(system, contact=contact)


def mass_of(model: Model) -> csr_matrix:
    """Return M, (n, n)."""
    return _sparse(model.system.operators.matrices()[0])


def stiffness_of(model: Model) -> csr_matrix:
    """Return K with the weak restraint, (n, n)."""
    return _sparse(model.system.operators.matrices()[1])


def spread(springs: Springs, size: int) -> csr_matrix:
    """Return a matrix on the interface DOFs as one on all DOFs, (n, n)."""
    interface = springs.interface
    columns = np.empty(interface.size, dtype=np.int64)
    columns[interface.slots] = interface.owned
    place = csr_matrix((np.ones(interface.size), (np.arange(interface.size), columns)), (interface.size, size))
    return csr_matrix(place.T @ springs.matrix @ place)


def bending_frequencies(model: Model, count: int, stiffness: csr_matrix | None = None) -> np.ndarray:
    """Return the first frequencies (Hz) of elastic bending in the bending direction.

    Rigid motions, and modes along or across, are left out: they have less than half of their kinetic energy in the
    bending direction, or a frequency below a thousandth of the highest one that was computed.
    """
    mass, matrix = mass_of(model), stiffness_of(model) if stiffness is None else stiffness
    dimension = model.case.mesh.dimension
    speed = np.sqrt(model.case.material.young_modulus / model.case.material.density)
    shift = -((0.1 * speed * model.case.beam.thickness / model.case.beam.length**2) ** 2)
    squares, shapes = eigsh(matrix, 2 * count + 6, mass, sigma=shift, which="LM", tol=1e-12)
    order = np.argsort(squares)
    found = []
    for square, shape in zip(squares[order], shapes.T[order], strict=True):
        bending = np.zeros_like(shape)
        bending[dimension - 1 :: dimension] = shape[dimension - 1 :: dimension]
        if square > 1e-6 * squares.max() and bending @ (mass @ bending) > 0.5:
            found.append(np.sqrt(square) / (2.0 * np.pi))
    return np.array(found[:count])


def thrown(model: Model, speed: float = 0.2, turning: float = -2.0) -> State:
    """Return the undeformed beam at t = 0, moving at a speed (m/s) at x = 0 and turning (rad/s)."""
    operators, contact, dimension = model.system.operators, model.system.contact, model.case.mesh.dimension
    x = model.space.tabulate_dof_coordinates()
    u, v = np.zeros(operators.size), np.zeros(operators.size)
    v[dimension - 1 :: dimension] = speed + turning * x[:, 0]
    v[0::dimension] = -turning * x[:, dimension - 1]
    depth = contact.depth(np.zeros(contact.interface.size))
    return State(0.0, imaged(operators, u), imaged(operators, v), depth, np.zeros(contact.size))


def face_forces(contact: ContactOperator, pressure: np.ndarray) -> dict[str, float]:
    """Return the contact force of each face, N."""
    forces = contact.weights * pressure
    return {name: float(forces[contact.faces == face].sum()) for face, name in enumerate(contact.face_names)}


def _sparse(matrix: Any) -> csr_matrix:
    indptr, indices, data = matrix.getValuesCSR()
    return csr_matrix((data, indices, indptr), shape=matrix.getSize())
