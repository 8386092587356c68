"""Structures from and to the matrices of other programs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import scipy.io
import scipy.sparse as sp

from gapbeam.solver.case.reading.overrides import UNITS
from gapbeam.solver.messages.errors import NotWritten, UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError, checked
from gapbeam.solver.scene.beam_structure import driven_rows
from gapbeam.solver.scene.imported_points import DIRECTIONS, Label, PointGiven, Rows, check_imported
from gapbeam.solver.scene.matrix_digits import MORE_DIGITS, PrintedDigits, frequency_doubt
from gapbeam.solver.scene.matrix_files import FIRST_LETTERS, aligned, dmig_text, read_matrix, refuse_half
from gapbeam.solver.scene.node_files import read_nodes
from gapbeam.solver.scene.solid_material import strains_in
from gapbeam.solver.scene.structure import MOST_RIGID, SYMMETRY, Structure
from gapbeam.solver.scene.structure_geometry import Pose, StructureGeometry, directions_across
from gapbeam.solver.scene.surface_stress import gauge_rows
from gapbeam.solver.system.operators import Array


class PlacedPoint(NamedTuple):
    """A point of matrices: coordinates, m, and directions of its motions, (motions, 3); None where they are unknown."""

    place: Array | None
    axes: Array | None


@checked
def read_structure(
    stiffness: str | Path,
    mass: str | Path,
    *,
    units: str,
    damping: str | Path | None = None,
    dofs: str | Path | None = None,
    nodes: str | Path | None = None,
    points: Mapping[str, PointGiven] | None = None,
    clamped: Sequence[Label] = (),
    frame: Sequence[float] | None = None,
    place: Pose | None = None,
    name: str = "",
) -> Structure:
    """Return the structure of matrices in files, in m, kg and s.

    Args:
        stiffness: File of K: `.mtx` (Matrix Market, or Abaqus's COORDINATE or MATRIX INPUT), `.npz` (of scipy.sparse,
            or of `numpy.savez`), `.npy`, `.sti` of CalculiX, `.pch` with Nastran's DMIG; `.op4` and `.op2` where pyyeti
            is installed.
        mass: File of M, likewise; `.mas` of CalculiX.
        units: Units of the files: "m-kg-s", "mm-t-s" or "mm-kg-s".
        damping: File of C, likewise.
        dofs: File with a "node.direction" for each row, directions 1 to 3 along and 4 to 6 about x, y, z. Files of
            MATRIX INPUT and DMIG name their rows themselves.
        nodes: File with "node x y z" lines, input of Abaqus or CalculiX (`.inp`) with its sets, or a mesh that meshio
            reads: rigid motions then follow in closed form.
        points: Points by name, one or two DOFs, "node.direction" as in `dofs` or row numbers from 0 on; or
            {"node": 12, "direction": [0, 0, 1]} with a direction or two, where "node" may be "set" (the mean motion of
            its nodes) or "nearest" (to coordinates in m).
        clamped: Nodes (whole), sets or "node.direction" that do not move: their rows and columns are left out.
        frame: Direction in which the frame moves, (3,): what weight and base motions act along; needs `dofs`.
        place: Place of the structure in space: directions and coordinates are then those of space, and weight and base
            motions take a direction of their own where `frame` is left out.
        name: Name of the structure.

    Raises:
        UserError: A file cannot be read or is of an unknown kind, sizes differ, a matrix is not symmetric, a label is
            unknown, or units are.
    """
    model = read_model(
        stiffness, mass, units=units, damping=damping, dofs=dofs, nodes=nodes, place=place, name=name
    )  # fmt: skip
    return model.structure(points or {}, clamped, frame)[0]


class MeshSurface(NamedTuple):
    """Surface of a mesh: lines, (lines, 2), facets by the name of a set, (facets, nodes), their kind, `corners_of`."""

    lines: Any
    faces: dict[str, Any]
    facet: str
    corners_of: Any = None


@dataclass(frozen=True)
class ImportedModel:
    """Matrices of files before anything is clamped, in m, kg and s.

    Attributes:
        K: Stiffness, sparse.
        M: Mass.
        C: Damping, or None.
        rows: Names, nodes and place.
        name: Name of the structure.
        is_placed: Whether a place was given.
        surface: Lines and facets of a mesh, whose nodes are those of the rows in their order.
        digits: Digits of K and M, where their files have few.
        stress_at: Function of the names of nodes that returns rows of their mean stress, (6, DOFs), Pa; None: matrices.
    """

    K: Any
    M: Any
    C: Any
    rows: Rows
    name: str
    is_placed: bool
    surface: MeshSurface | None = None
    digits: tuple[PrintedDigits | None, PrintedDigits | None] = (None, None)
    stress_at: Callable[[Sequence[str], str, str], Array] | None = None

    @property
    def places(self) -> dict[str, Array]:
        """Places in space of the nodes that have rows, m; empty where the files do not say so."""
        nodes = self.rows.nodes
        if nodes is None:
            return {}
        meter, turned = self.rows.meter, self.rows.place.in_space
        return {node: turned(meter * nodes.places[node]) for node in self.rows.of_node}

    def structure(
        self,
        points: Mapping[str, PointGiven],
        clamped: Sequence[Label],
        frame: Sequence[float] | None,
        driven: Mapping[str, Sequence[Label]] = MappingProxyType({}),
        gauges: Sequence[str] = (),
    ) -> tuple[Structure, dict[str, PlacedPoint]]:
        """Return the structure, and where its points are; see `read_structure`, and `beam` for `driven`."""
        rows_of, size = self.rows, self.M.shape[0]
        fixed = {i for one in clamped for i in rows_of.clamped(str(one))}
        free = np.array([i for i in range(size) if i not in fixed])
        if not len(free):
            raise ArgumentError(f"structure {self.name or '?'}: all DOFs are clamped", "clamped")
        rows = {key: rows_of.rows(key, given, fixed)[:, free] for key, given in points.items()}
        inertia, moved = None, {}
        if (frame is not None or self.is_placed or driven) and not rows_of.named:
            key = "frame" if frame is not None else "place" if self.is_placed else "clamped"
            raise ArgumentError(
                f"structure {self.name or '?'}: `{key}` needs the directions of the DOFs: give `dofs`", key
            )
        shoved = dict[str, Array]()
        for key, labels in driven.items():
            own = [i for one in labels for i in rows_of.clamped(str(one))]
            shoved[key] = np.zeros((size, 3))
            shoved[key][own] = rows_of.along_axes[own]
        matrices = {"K": self.K, "M": self.M} | ({} if self.C is None else {"C": self.C})
        if frame is not None or self.is_placed:
            along = rows_of.along_axes if frame is None else rows_of.along(frame)
            inertia = np.asarray(self.M @ along)[free]
            moved = {key: row @ along[free] for key, row in rows.items()}
        rows |= driven_rows(shoved, matrices, lambda forces: forces[free])
        motions, rigid = rows_of.rigid(), MOST_RIGID
        if motions is not None:
            ranks = [np.linalg.matrix_rank(one) if len(one) else 0 for one in (motions, motions[sorted(fixed)])]
            rigid = int(ranks[0] - ranks[1])
        K, M = (A[free][:, free] for A in (self.K, self.M))
        C = None if self.C is None else self.C[free][:, free]
        motions = None if motions is None else _without_strain(K, motions[free])
        places = {key: PlacedPoint(*rows_of.placed(given)) for key, given in points.items()}
        geometry = self.geometry(free, places)
        made = Structure(M, K, C, rows, motions, self.name, inertia, moved or None, geometry)
        made.gauges = gauge_rows(
            gauges, points, shoved, f"structure {self.name or '?'}",
            lambda key, where, argument: self._stress(points[key], where, argument), lambda rows: rows[:, free],
        )  # fmt: skip
        if (doubt := frequency_doubt(made, free, *self.digits, rigid)) is not None:
            most = max(one.most for one in self.digits if one is not None)
            made.doubt = doubt._replace(
                words=f"structure {self.name or '?'}: found matrices of at most {counted(most, 'digit')}: {doubt.words}"
            )
            logging.getLogger("gapbeam").warning("%s; expected more digits; %s", made.doubt.words, MORE_DIGITS)
        return made, places

    def _stress(self, given: PointGiven, where: str, argument: str) -> Array:
        """Return the rows of the stress at a point for each of its directions, (6 directions, DOFs)."""
        if self.stress_at is None or not isinstance(given, Mapping):
            raise ArgumentError(
                f"{where}: found a stress of {'matrices' if self.stress_at is None else 'single DOFs'}, expected a "
                "mesh, and its node, set or nearest with a direction",
                argument,
            )
        nodes, (_, ways) = self.rows.nodes_of(given), self.rows.placed(given)
        own = self.stress_at(nodes, where, argument)
        assert ways is not None
        axes = [np.vstack([way, directions_across(way)]) @ self.rows.place.turn for way in ways]
        return np.vstack([strains_in(Q).T @ own for Q in axes])

    def geometry(self, free: Array, places: Mapping[str, PlacedPoint]) -> StructureGeometry | None:
        """Return the nodes in space of a structure with some of the rows; None where files do not say where they are.

        Args:
            free: Numbers of the rows that are kept.
            places: Places of its points.
        """
        nodes = self.places
        if not nodes:
            return None
        number = {node: k for k, node in enumerate(nodes)}
        parts = [label.partition(".") for label in self.rows.labels]
        node, way = (np.array(one) for one in zip(*((number[a], DIRECTIONS[b]) for a, _, b in parts), strict=True))
        some = np.flatnonzero(way < 3)
        value = self.rows.place.turn[:, way[some]]
        at = 3 * node[some] + np.arange(3)[:, None]
        shape = (3 * len(nodes), len(parts))
        moved = sp.csr_matrix((value.ravel(), (at.ravel(), np.tile(some, 3))), shape)
        moved.eliminate_zeros()
        lines, faces, facet, corners_of = self.surface or MeshSurface(np.zeros((0, 2), dtype=int), {}, "")
        known = {key: (one.place, one.axes) for key, one in places.items() if one.place is not None}
        points = {key: (place, axes) for key, (place, axes) in known.items() if axes is not None}
        return StructureGeometry(
            np.array(list(nodes.values())), moved[:, free], lines, points, faces, facet, corners_of
        )


def read_model(
    stiffness: str | Path,
    mass: str | Path,
    *,
    units: str,
    damping: str | Path | None,
    dofs: str | Path | None,
    nodes: str | Path | None,
    place: Pose | None,
    name: str,
) -> ImportedModel:
    """Return the matrices of files, checked; see `read_structure`."""
    if units not in UNITS:
        raise ArgumentError(
            f"structure {name or '?'}: found units {units!r}, expected one of {', '.join(UNITS)}", "units"
        )
    files = {"stiffness": stiffness, "mass": mass, "damping": damping}
    read = [None if file is None else read_matrix(Path(file), key) for key, file in files.items()]
    matrices, labels = aligned(read)
    size = matrices[0].shape[0]
    for A, (key, file) in zip(matrices, files.items(), strict=True):
        if A is None:
            continue
        if A.shape != (size, size):
            raise ArgumentError(f"{file}: found {counted(A.shape[0], 'row')}, {stiffness} has {size}", key)
        if not np.all(np.isfinite(A.data)):
            bad = np.count_nonzero(~np.isfinite(A.data))
            raise ArgumentError(f"{file}: found {bad} entries that are no finite numbers, expected finite numbers", key)
        refuse_half(A, Path(str(file)), key)
    if dofs is not None:
        labels = _labels(Path(dofs), size)
    meter, kilogram = UNITS[units]
    held = None if nodes is None else read_nodes(Path(nodes))
    names = labels or [str(i) for i in range(size)]
    rows_of = Rows(names, held, meter, labels is not None, place or Pose())
    lengths = np.array([meter if DIRECTIONS.get(one.partition(".")[2], 0) < 3 else 1.0 for one in rows_of.labels])
    printed = [PrintedDigits.of(A, kilogram * meter**2, 1.0 / lengths) for A in matrices[:2]]
    K, M, C = (None if A is None else _in_si(A, kilogram * meter**2, lengths) for A in matrices)
    check_imported(K, M, C, rows_of, name, 2.0 * printed[0].relative if printed[0] else 0.0)
    return ImportedModel(K, M, C, rows_of, name, place is not None, digits=(printed[0], printed[1]))


def _in_si(A: Any, energy: float, lengths: Array) -> Any:
    """Return a matrix in m, kg and s: its energies times a factor, its displacements in m, its angles in rad."""
    D = sp.diags(1.0 / lengths)
    return sp.csr_matrix(energy * (D @ A @ D))


def _without_strain(K: Any, motions: Array) -> Array | None:
    """Return the rigid motions that a structure has; None: it is held."""
    strain, most = abs(K @ motions).max(axis=0), abs(K).max() * np.abs(motions).max(axis=0)
    kept = motions[:, strain <= SYMMETRY * np.where(most > 0.0, most, 1.0)]
    kept = kept[:, np.abs(kept).max(axis=0, initial=0.0) > 0.0]
    return kept if kept.size else None


def _labels(path: Path, count: int) -> list[str]:
    try:
        found = path.read_text(encoding="utf-8-sig").split()
    except (OSError, UnicodeDecodeError) as error:
        raise ArgumentError(f"{path}: cannot be read ({error})", "dofs") from None
    wrong = next(
        (one for one in found if one.partition(".")[2] not in DIRECTIONS or not one.partition(".")[0].isdigit()), None
    )
    if wrong is not None:
        raise ArgumentError(f"{path}: found {wrong!r}, expected node.direction with a direction of 1 to 6", "dofs")
    if len(found) != count:
        raise ArgumentError(
            f"{path}: found {len(found)} DOFs, the matrices have {count}; DOFs that the export "
            "clamps are in neither, or in both",
            "dofs",
        )
    if len(set(found)) < count:
        raise ArgumentError(f"{path}: a DOF stands there twice", "dofs")
    return found


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
