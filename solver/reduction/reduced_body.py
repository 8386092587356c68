"""From an assembled body to one of few DOFs.

    u = V q,    V^T M V = 1,    V^T K V = diag(s)

V spans the vibration modes of the body, its deflections under unit loads and those under pressures on the contact
faces. With free contact faces the latter are A^-1 G^T p, A = K + sigma M: what the modes miss of the static response,
the residual flexibility (Rubin 1975); with fixed ones they are the static response to motions of the interface DOFs,
the constraint modes (Craig and Bampton 1968). Rigid motions are always in V: the body floats.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, identity

from solver.body import Body, ProbeRow
from solver.case import Case, PointForce
from solver.case_tables.model import ReducedModel
from solver.defaults import overhang_frequency
from solver.dense import DenseOperators
from solver.operators import Array, Interface, Operators
from solver.petsc_operators import PetscOperators
from solver.reduction.basis import Basis, modal_basis
from solver.reduction.face_shapes import face_shapes
from solver.reduction.fixed_interface import fixed_interface_vectors
from solver.reduction.lines import across_lines
from solver.reduction.modes import Modes, lowest_modes
from solver.reduction.neglected import neglected_share, random_pressures
from solver.reduction.report import BasisReport
from solver.resultants import ResultantOperator
from solver.system import ContactOperator

Kept = NDArray[np.bool_]

RIGID_MODES = {2: 3, 3: 6}
UNMOVED = 1.0e-8  # of the largest motion that a unit force gives a mode
SPACING = 0.25  # of a facet, between lines of points that do not lie on lines
UNSYMMETRIC = 4  # times as many points across the width, where faces may close on one side alone
CHECKED = 8  # random pressures of the truncation check


@dataclass(frozen=True)
class DenseRow:
    """Basis functions at one point in terms of reduced DOFs, (components, r)."""

    matrix: Array

    def evaluate(self, x: Array, _operators: Operators) -> Array:
        """Return the vector field at the point, (components,), or row by row of x, (times, components)."""
        return np.asarray(x @ self.matrix.T)


def reduced_body(body: Body, settings: ReducedModel) -> Body:
    """Reduce a finite element body.

    Raises:
        RunError: The modes could not be found.

    Collective.
    """
    started = time.perf_counter()
    case, operators, contact = body.case, body.operators, body.contact
    assert isinstance(operators, PetscOperators)
    symmetric = is_symmetric(case)
    shift = (2.0 * pi * overhang_frequency(case)) ** 2
    mass, stiffness = operators.matrices
    count = RIGID_MODES[case.mesh.dimension] + settings.modes
    modes = lowest_modes(mass, stiffness, shift, count, settings.frequency)
    shapes = _pressures(case, contact, settings, symmetric)
    loads = np.stack([modes.factor.solve(pattern) for pattern in body.patterns], axis=1) if body.patterns else None
    vectors = _vectors(operators, contact, modes, shapes, settings, shift)
    basis = modal_basis(operators, np.concatenate([vectors, *([] if loads is None else [loads])], axis=1), shift)
    fewer = contact
    gathers = case.mesh.dimension == 3 and case.contact.points is None and contact.tangents is None
    if gathers and settings.points_across != "all":
        nodes = settings.points_across if symmetric else UNSYMMETRIC * settings.points_across
        fewer = across_lines(contact, nodes, symmetric, SPACING * body.meshed.facet_length)
    patterns = [basis.project(operators, pattern) for pattern in body.patterns]
    moved: Kept = np.ones(len(basis.squares), dtype=bool)
    if symmetric:
        moved = _moved(operators, fewer, basis, patterns)
    smooth = random_pressures(contact, CHECKED, face_shapes(contact, 2 * settings.shapes - 1, (0,)))
    local = random_pressures(contact, CHECKED)
    report = BasisReport(
        modes=len(modes.squares),
        highest_mode=float(modes.frequencies.max(initial=0.0)),
        contact_shapes=contact.interface.size if shapes is None else shapes.shape[1],
        load_shapes=len(body.patterns),
        size=int(np.sum(moved)),
        left_out=int(np.sum(~moved)),
        highest=float(np.sqrt(basis.squares[moved].max()) / (2.0 * pi)),
        neglected=neglected_share(operators, contact, modes.factor, basis, shift, local),
        neglected_smooth=neglected_share(operators, contact, modes.factor, basis, shift, smooth),
    )
    marched = basis.kept(moved)
    probes = {name: _dense_row(probe, marched, operators) for name, probe in body.probes.items()}
    return replace(
        _projected(body, fewer, marched),
        patterns=tuple(pattern[moved] for pattern in patterns),
        probes=probes,
        basis=report,
        seconds=body.seconds | {"reduction": time.perf_counter() - started},
    )


def is_symmetric(case: Case) -> bool:
    """Return whether mesh and loads of a case are mirrored at the bending plane (3D), as far as the case tells."""
    if case.mesh.dimension == 2 or case.mesh.file is not None or case.mesh.cell not in (None, "hexahedron"):
        return False
    if case.contact.rubs is not None or case.contact.points is not None:
        return False
    points = [load.point for load in case.load if isinstance(load, PointForce)]
    directions = [load.direction for load in case.load if load.direction is not None]
    return not any(isinstance(vector, tuple) and len(vector) > 1 and vector[1] != 0.0 for vector in points + directions)


def _pressures(case: Case, contact: ContactOperator, settings: ReducedModel, symmetric: bool) -> Array | None:
    """Return the pressures whose shapes are kept, (m, shapes); None: one for each interface DOF."""
    if settings.contact == "all":
        return None
    if case.contact.points is not None:
        return np.asarray(np.identity(contact.size))
    powers = (0,) if case.mesh.dimension == 2 else (0, 2) if symmetric else (0, 1, 2)
    return face_shapes(contact, settings.shapes, powers)


def _vectors(
    operators: PetscOperators,
    contact: ContactOperator,
    modes: Modes,
    shapes: Array | None,
    settings: ReducedModel,
    shift: float,
) -> Array:
    """Return modes and contact shapes, (n, k). Collective."""
    if settings.interface == "fixed":
        return fixed_interface_vectors(operators, contact, modes, shapes, settings, shift)
    interface = contact.interface
    if shapes is None:
        columns = csr_matrix(identity(interface.size))
    else:
        columns = csr_matrix(contact.resultants @ (contact.weights[:, None] * shapes))
    return np.concatenate([modes.shapes, modes.factor.solve_columns(interface, columns)], axis=1)


def _moved(operators: Operators, contact: ContactOperator, basis: Basis, patterns: list[Array]) -> Kept:
    """Return which columns of a basis loads or contact can move, (r,): those that are symmetric. Collective."""
    trace = _trace(operators, contact.interface, basis)
    gaps = np.sqrt(contact.weights[:, None]) * (contact.gap_matrix @ trace)
    touched = np.linalg.norm(gaps, axis=0)
    moved: Kept = touched > UNMOVED * touched.max()
    for pattern in patterns:
        moved |= np.abs(pattern) > UNMOVED * np.abs(pattern).max()
    return moved


def _trace(operators: Operators, interface: Interface, basis: Basis) -> Array:
    """Return the interface values of a basis on every rank, (interface.size, r). Collective."""
    values = np.zeros((interface.size, len(basis.squares)))
    values[interface.slots] = basis.columns[interface.owned]
    return operators.sum(values)


def _dense_row(probe: ProbeRow, basis: Basis, operators: Operators) -> DenseRow:
    columns = [probe.evaluate(np.ascontiguousarray(column), operators) for column in basis.columns.T]
    return DenseRow(np.stack(columns, axis=1))


def _projected(body: Body, contact: ContactOperator, basis: Basis) -> Body:
    """Return the body with operators and contact in terms of q. Collective."""
    operators = body.operators
    restraint = np.stack([operators.apply_restraint(column) for column in basis.columns.T], axis=1)
    held = basis.project(operators, restraint)
    size = len(basis.squares)
    elastic = np.diag(basis.squares) - held
    trace = _trace(operators, contact.interface, basis)
    everywhere = Interface(size, np.arange(size), np.arange(size))
    return replace(
        body,
        operators=DenseOperators(np.identity(size), elastic, 0.5 * (held + held.T)),
        contact=_in_terms_of(contact, everywhere, trace),
        expansion=basis.columns,
    )


def _in_terms_of(contact: ContactOperator, interface: Interface, trace: Array) -> ContactOperator:
    """Return an operator on reduced DOFs whose interface values are `trace` q."""
    tangents = None if contact.tangents is None else csr_matrix(contact.tangents @ trace)
    moved = replace(contact, interface=interface, gap_matrix=csr_matrix(contact.gap_matrix @ trace), tangents=tangents)
    if isinstance(moved, ResultantOperator):
        return replace(moved, distributed=_in_terms_of(moved.distributed, interface, trace))
    return moved
