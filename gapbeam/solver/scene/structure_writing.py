"""Structures as files of matrices that other programs read: Matrix Market, NumPy, Abaqus and Nastran."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from gapbeam.solver.errors import NotWritten, UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.dmig_file import FIRST_LETTERS, dmig_text
from gapbeam.solver.scene.structure import Structure

SUFFIXES = {"mtx": ".mtx", "npz": ".npz", "coordinate": ".mtx", "matrix-input": ".mtx", "dmig": ".pch"}
"""Suffix of each format."""
NAMED = ("matrix-input", "dmig")


@checked
def write_structure(
    structure: Structure,
    stem: str | Path,
    format: str = "mtx",  # noqa: A002
    dofs: Sequence[str] | None = None,
) -> dict[str, Path]:
    """Write the matrices of a structure, m, kg and s, for `read_structure` and other programs.

    "mtx" (Matrix Market) and "npz" (scipy) hold every bit, "coordinate" and "matrix-input" (Abaqus) 17 digits, "dmig"
    (Nastran) ten digits.

    Args:
        structure: The structure to write.
        stem: Path without a suffix: "out/rack" gives out/rack-stiffness.mtx, out/rack-mass.mtx and, with damping,
            out/rack-damping.mtx.
        format: "mtx", "npz", "coordinate", "matrix-input" or "dmig".
        dofs: "node.direction" of each DOF, which "matrix-input" and "dmig" name; default 1.1, 2.1, ...

    Returns:
        The files by "stiffness", "mass" and "damping".

    Raises:
        UserError: The format is unknown, or `dofs` do not fit.
        NotWritten: A file cannot be written.
    """
    where = f"structure {structure.name or '?'}"
    if format not in SUFFIXES:
        raise UserError(f"{where}: found format {format!r}, expected one of {', '.join(SUFFIXES)}")
    labels = [f"{i + 1}.1" for i in range(structure.size)] if dofs is None else [str(one) for one in dofs]
    if len(labels) != structure.size or len(set(labels)) < len(labels):
        raise UserError(f"{where}: found {len(set(labels))} different DOFs, expected {structure.size}")
    wrong = next((one for one in labels if not all(part.isdigit() for part in one.split(".")) or "." not in one), None)
    if wrong is not None:
        raise UserError(f"{where}: found the DOF {wrong!r}, expected node.direction, such as 12.3")
    if format == "dmig":
        logging.getLogger("gapbeam").warning("%s: DMIG holds ten digits of each entry; mtx and npz hold all", where)
    files = {}
    for key, A in (("stiffness", structure.K), ("mass", structure.M), ("damping", structure.C)):
        if A is None:
            continue
        path = Path(f"{stem}-{key}{SUFFIXES[format]}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            _write(path, sp.csr_matrix(A), format, labels, FIRST_LETTERS[key] + "AAX")
        except OSError as error:
            raise NotWritten(f"{path} cannot be written ({error.strerror})") from error
        files[key] = path
    return files


def _write(path: Path, A: Any, format: str, labels: Sequence[str], name: str) -> None:  # noqa: A002
    if format == "npz":
        sp.save_npz(path, A)
    elif format == "mtx":
        scipy.io.mmwrite(path, A, precision=17, symmetry="general")
    elif format == "dmig":
        path.write_text(dmig_text(A, name, labels), encoding="utf-8")
    elif format == "coordinate":
        entries = sp.coo_matrix(A)
        table = np.column_stack([entries.row + 1, entries.col + 1, entries.data])
        np.savetxt(path, table, fmt=["%d", "%d", "%.16e"])
    else:
        lower = sp.coo_matrix(sp.tril(A))
        ends = ([labels[i].replace(".", ",") for i in side] for side in (lower.row, lower.col))
        rows = (f"{i},{j},{value:.16e}" for i, j, value in zip(*ends, lower.data, strict=True))
        path.write_text("\n".join(["*MATRIX INPUT, NAME=" + name, *rows]) + "\n", encoding="utf-8")
