"""Matrices of a model of few DOFs as they were marched, in a file next to the checkpoints.

A reduced basis that is found anew, on another number of ranks or by another library, spans the same motions to some
1e-6 only, and with other signs. So the matrices themselves go on: every number of ranks marches the same bits.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from gapbeam.solver.models.body import Body, HoldingShapes, ProductExpansion
from gapbeam.solver.models.reduction.projection import DenseRow
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface
from gapbeam.solver.system.semi_discrete import ContactOperator

EXPANSION = "expansion"
COLUMNS = "columns"  # of a basis of beam elements
HOLDING = "holding"
CONTACT = "contact"
SPARSE = ("data", "indices", "indptr")

Matrices = dict[str, NDArray[Any]]


def matrices_of(body: Body) -> Matrices:
    """Return the matrices of a body that is marched in few DOFs, replicated on all ranks; the expansion apart."""
    operators = body.operators
    assert isinstance(operators, DenseOperators)
    found: Matrices = {
        "mass": operators.mass,
        "stiffness": operators.stiffness,
        "restraint": operators.restraint,
        "patterns": np.array(body.patterns).reshape(len(body.patterns), operators.size),
    }
    if isinstance(body.expansion, ProductExpansion):
        found |= _parts(COLUMNS, body.expansion.columns)
    for number, probe in enumerate(body.probes.values()):
        assert isinstance(probe, DenseRow)
        found[f"probe.{number}"] = probe.matrix
    if body.holding is not None:
        found |= {f"{HOLDING}.{name}": matrix for name, matrix in vars(body.holding).items()}
    return found | _named_arrays(CONTACT, body.contact)


def sum_of(matrices: Mapping[str, NDArray[Any]]) -> str:
    """Return a checksum of matrices."""
    total = hashlib.sha256()
    for name in sorted(matrices):
        total.update(f"{name} {matrices[name].shape} {matrices[name].dtype.str} ".encode())
        total.update(np.ascontiguousarray(matrices[name]).tobytes())
    return total.hexdigest()


def has_basis(body: Body) -> bool:
    """Return whether DOFs are in a basis of the mesh that was computed: fields need its columns, on every rank."""
    return isinstance(body.expansion, np.ndarray)


def taken_up(body: Body, matrices: Mapping[str, NDArray[Any]], expansion: Array | None) -> Body:
    """Return a body with the matrices that were kept instead of those found anew.

    Args:
        body: The body as it was found anew.
        matrices: Result of `matrices_of`.
        expansion: Map from the DOFs marched to those of the mesh that this rank owns; None: the one that was found.

    Raises:
        ValueError: The matrices are not those of such a body; likewise KeyError.
    """
    size = len(matrices["mass"])
    square = [matrices[name] for name in ("mass", "stiffness", "restraint")]
    if any(matrix.shape != (size, size) for matrix in square):
        raise ValueError(f"operators of shapes {[matrix.shape for matrix in square]}")
    rows = [matrices[f"probe.{number}"] for number in range(len(body.probes))]
    if matrices["patterns"].shape != (len(body.patterns), size) or any(row.shape[1] != size for row in rows):
        raise ValueError("loads or probes of another model")
    for name, matrix in matrices.items():
        if matrix.dtype.kind not in "fi" or not np.all(np.isfinite(matrix)):
            raise ValueError(f"{name} holds other things than finite numbers")
    if expansion is not None:
        found: Array | csr_matrix | ProductExpansion | None = expansion
    elif isinstance(body.expansion, ProductExpansion):
        found = replace(body.expansion, columns=_sparse(COLUMNS, matrices, body.expansion.columns.shape))
    else:
        found = body.expansion
    return replace(
        body,
        operators=DenseOperators.of_whole(*square),
        contact=_with(CONTACT, body.contact, matrices, size),
        patterns=tuple(matrices["patterns"]),
        probes=dict(zip(body.probes, map(DenseRow, rows), strict=True)),
        expansion=found,
        holding=None if body.holding is None else _holding(body.holding, matrices, size),
    )


def _holding(found: HoldingShapes, matrices: Mapping[str, NDArray[Any]], size: int) -> HoldingShapes:
    """Return the shapes that were kept instead of those found anew."""
    kept = {name: matrices[f"{HOLDING}.{name}"] for name in vars(found)}
    for name, matrix in vars(found).items():
        wanted = (len(matrix), size if name in ("mass", "stiffness") else matrix.shape[1])
        if kept[name].shape != wanted:
            raise ValueError(f"{HOLDING}.{name} of shape {kept[name].shape}, expected {wanted}")
    return HoldingShapes(**kept)


def _named_arrays(name: str, contact: ContactOperator) -> Matrices:
    """Return the arrays of an operator, those of operators in it with their names before theirs."""
    found: Matrices = {}
    for field in fields(contact):
        value, key = getattr(contact, field.name), f"{name}.{field.name}"
        if isinstance(value, ContactOperator):
            found |= _named_arrays(key, value)
        elif isinstance(value, csr_matrix):
            found |= _parts(key, value)
        elif isinstance(value, np.ndarray):
            found[key] = value
    return found


def _parts(name: str, matrix: csr_matrix) -> Matrices:
    return {f"{name}.{part}": getattr(matrix, part) for part in SPARSE}


def _sparse(name: str, matrices: Mapping[str, NDArray[Any]], shape: tuple[int, int]) -> csr_matrix:
    """Return a sparse matrix of `_parts`."""
    found = csr_matrix(tuple(matrices[f"{name}.{part}"] for part in SPARSE), shape)
    found.check_format(full_check=True)
    return found


def _with(name: str, contact: ContactOperator, matrices: Mapping[str, NDArray[Any]], size: int) -> ContactOperator:
    """Return an operator on `size` DOFs with other arrays of the same meaning."""
    everywhere = np.arange(size)
    others: dict[str, Any] = {"interface": Interface(size, everywhere, everywhere)}
    for field in fields(contact):
        value, key = getattr(contact, field.name), f"{name}.{field.name}"
        if isinstance(value, ContactOperator):
            others[field.name] = _with(key, value, matrices, size)
        elif isinstance(value, csr_matrix):
            columns = size if value.shape[1] == contact.interface.size else value.shape[1]
            others[field.name] = _sparse(key, matrices, (value.shape[0], columns))
        elif isinstance(value, np.ndarray):
            if (matrices[key].shape, matrices[key].dtype) != (value.shape, value.dtype):
                raise ValueError(f"{key} of shape {matrices[key].shape}, expected {value.shape}")
            others[field.name] = matrices[key]
    return replace(contact, **others)
