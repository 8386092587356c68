"""Matrices in files of other programs: Matrix Market, NumPy, CalculiX, Abaqus and Nastran.

CalculiX (`*FREQUENCY, SOLVER=MATRIXSTORAGE`) writes `.sti` and `.mas`, upper triangles as "row column value" from 1 on.
Abaqus (`*MATRIX OUTPUT`) writes `.mtx` as "row column value" (FORMAT=COORDINATE), or as "node, DOF, node, DOF, value"
(FORMAT=MATRIX INPUT); a triangle stands for a symmetric matrix.

DMIG of Nastran names rows by grid point and component. A header `DMIG NAME 0 IFO TIN` (IFO 6: symmetric, one triangle;
1 or 2: whole) precedes columns `DMIG NAME GJ CJ` with entries `GI CI A`. Fields have 8 characters, 16 after `DMIG*`, or
commas between them. 16 characters hold ten digits, 8 three to five. Source: MSC Nastran Quick Reference Guide, DMIG.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io
import scipy.sparse as sp

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError

SYMMETRIC = 6
COMPLEX = ("3", "4")  # types of numbers, TIN
FIRST_LETTERS = {"stiffness": "K", "mass": "M", "damping": "B"}
BARE_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")  # 1.5+3 is 1.5e3


class ReadMatrix(NamedTuple):
    """A matrix and, where its file names them, the "node.direction" of its rows, sorted; direction 0: a scalar."""

    matrix: Any
    labels: list[str] | None = None


def read_matrix(path: Path, argument: str) -> ReadMatrix:
    """Return the matrix of a file, sparse.

    Args:
        path: The file; its suffix says what it is.
        argument: "stiffness", "mass" or "damping": which matrix is taken from a file of several, and for messages.

    Raises:
        ArgumentError: The file cannot be read, or its kind is unknown.
    """
    if path.suffix not in READERS:
        found, known = path.suffix or "no suffix", list(READERS)
        raise ArgumentError(f"{path}: found {found}, expected {', '.join(known[:-1])} or {known[-1]}", argument)
    try:
        read = READERS[path.suffix](path, argument)
    except ArgumentError:
        raise
    except Exception as error:  # readers raise errors of any kind on damaged files
        raise ArgumentError(f"{path}: cannot be read as a matrix ({error})", argument) from None
    if np.iscomplexobj(read.matrix):
        raise ArgumentError(
            f"{path}: found complex entries, expected real ones; try their real part, and a damping ratio", argument
        )
    return read


def refuse_half(A: Any, path: Path, argument: str) -> None:
    """Refuse a matrix with entries on one side of its diagonal only.

    Raises:
        ArgumentError: The matrix has entries on one side of its diagonal only.
    """
    upper, lower = abs(sp.triu(A, 1)).sum(), abs(sp.tril(A, -1)).sum()
    if (upper == 0.0) != (lower == 0.0):
        raise ArgumentError(
            f"{path}: found entries on one side of the diagonal only, expected the whole matrix; write it with "
            "symmetry (Matrix Market: symmetric), or complete it as A + A.T - diag(A)",
            argument,
        )


def aligned(read: Sequence[ReadMatrix | None]) -> tuple[list[Any], list[str] | None]:
    """Return matrices with one order of rows: where files name their rows, by node and direction.

    Files name only rows that have entries: a row that one of them lacks is empty in its matrix.
    """
    named = [set(one.labels) for one in read if one is not None and one.labels is not None]
    if not named:
        return [None if one is None else one.matrix for one in read], None
    labels = sorted(set().union(*named), key=label_order)
    places = {label: i for i, label in enumerate(labels)}
    found: list[Any] = []
    for one in read:
        if one is None or one.labels is None:
            found.append(None if one is None else one.matrix)
            continue
        at = np.array([places[label] for label in one.labels])
        entries = sp.coo_matrix(one.matrix)
        shape = (len(labels), len(labels))
        found.append(sp.csr_matrix((entries.data, (at[entries.row], at[entries.col])), shape=shape))
    return found, labels


def label_order(label: str) -> tuple[int, int]:
    """Return the key that sorts "node.direction" by numbers."""
    node, _, way = label.partition(".")
    return int(node), int(way or 0)


LONGEST = 64  # bytes of a number


def _mtx(path: Path, _: str) -> ReadMatrix:
    """Return a matrix of Matrix Market, or of Abaqus, which takes the same suffix."""
    with path.open(encoding="utf-8") as lines:
        first = lines.readline()
        while first.startswith("**") or (first.isspace() and first):
            first = lines.readline()
    if first.startswith("%%MatrixMarket"):
        with path.open("rb") as text:
            text.seek(max(0, path.stat().st_size - LONGEST))
            last = (text.read().split() or [b"0"])[-1]  # blank lines may follow
        if not last[-1:].isdigit() and last[-1:] != b".":  # SciPy 1.18 crashes on an exponent without digits
            raise ValueError(f"a last number that is cut off: {last.decode(errors='replace')}")
        return ReadMatrix(sp.csr_matrix(scipy.io.mmread(path)))
    if "," not in first and not first.startswith("*"):
        return _coordinate(path, None)
    rows = np.loadtxt(path, ndmin=2, delimiter=",", comments="*")
    if rows.shape[1] != 5:
        raise ValueError(f"{counted(rows.shape[1], 'column')}, expected node, DOF, node, DOF and value")
    ends = [[f"{int(node)}.{int(way)}" for node, way in rows[:, at : at + 2]] for at in (0, 2)]
    return _named(ends[0], ends[1], rows[:, 4], None)


def _coordinate(path: Path, is_triangle: bool | None) -> ReadMatrix:
    """Return the matrix of "row column value" lines, from 1 on."""
    table = np.loadtxt(path, ndmin=2, comments=("#", "**"))
    if table.shape[1] != 3:
        raise ValueError(f"{counted(table.shape[1], 'column')}, expected row, column and value")
    i, j = table[:, :2].astype(int).T - 1
    if not len(i) or min(i.min(), j.min()) < 0:
        raise ValueError("row 0, expected rows from 1 on")
    return ReadMatrix(_whole(i, j, table[:, 2], int(max(i.max(), j.max())) + 1, is_triangle))


def _named(rows: Sequence[str], columns: Sequence[str], values: Any, is_triangle: bool | None) -> ReadMatrix:
    """Return the matrix of entries in named rows and columns."""
    labels = sorted({*rows, *columns}, key=label_order)
    places = {label: i for i, label in enumerate(labels)}
    i, j = (np.array([places[one] for one in end], dtype=int) for end in (rows, columns))
    return ReadMatrix(_whole(i, j, np.asarray(values, dtype=float), len(labels), is_triangle), labels)


def _whole(i: Any, j: Any, values: Any, size: int, is_triangle: bool | None) -> Any:
    """Return a matrix, a triangle with its mirror; None: it is one where no entry has its mirror."""
    off = i != j
    if is_triangle is None:
        pairs = np.sort(np.column_stack([i, j])[off], axis=1)
        is_triangle = len(np.unique(pairs, axis=0)) == len(pairs)
    if is_triangle:
        i, j, values = np.concatenate([i, j[off]]), np.concatenate([j, i[off]]), np.concatenate([values, values[off]])
    found = sp.csr_matrix((values, (i, j)), shape=(size, size))
    if found.nnz < len(values):
        raise ValueError(f"found {counted(len(values) - found.nnz, 'entry')} twice, expected each once")
    return found


def _dmig(path: Path, argument: str) -> ReadMatrix:
    """Return the matrix of a file whose name begins with K, M or B, or the only one."""
    kinds: dict[str, int] = {}
    entries: dict[str, list[tuple[str, str, float]]] = {}
    for card in _cards(path.read_text(encoding="utf-8-sig")):
        name, first, second = card[0], card[1], card[2]
        if first == "0" and name not in kinds:
            if len(card) > 3 and card[3] in COMPLEX:
                raise ValueError(f"matrix {name} is complex, expected a real one")
            kinds[name], entries[name] = int(second), []
            continue
        if name not in kinds:
            raise ValueError(f"matrix {name} has a column before its header")
        column, rest = f"{first}.{second or 0}", [one for one in card[3:] if one]
        if len(rest) % 3:
            raise ValueError(
                f"column {column} of {name} has {counted(len(rest), 'field')}, expected grid, component and value"
            )
        entries[name] += [
            (f"{node}.{way}", column, _number(value))
            for node, way, value in zip(rest[::3], rest[1::3], rest[2::3], strict=True)
        ]
    name = _name_of(kinds, path, argument)
    rows, columns, values = zip(*entries[name], strict=True) if entries[name] else ((), (), ())
    return _named(rows, columns, values, kinds[name] == SYMMETRIC)


def _name_of(known: Iterable[str], path: Path, argument: str) -> str:
    """Return the name that begins with K, M or B, or the only one, if the letter of another kind does not begin it.

    Raises:
        ArgumentError: No name is right, or several are.
    """
    first, held = FIRST_LETTERS[argument], list(known)
    names = [one for one in held if one.upper().startswith(first)]
    if len(held) == 1 and held[0][0].upper() not in FIRST_LETTERS.values():
        names = held
    if len(names) != 1:
        raise ArgumentError(
            f"{path}: found the matrices {', '.join(held) or 'none'}, expected one whose name begins with {first}",
            argument,
        )
    return names[0]


def _cards(text: str) -> Iterator[list[str]]:
    """Yield the fields of each DMIG behind its name, those of continued lines among them."""
    card: list[str] | None = None
    for line in text.splitlines():
        body = line.partition("$")[0].rstrip()
        if not body:
            continue
        if body.upper().startswith("DMIG"):
            if card is not None:
                yield card
            card = _fields(body)
        elif card is not None and body[0] in "*+, ":
            card += _fields(body)
        elif card is not None:  # other bulk data
            yield card
            card = None
    if card is not None:
        yield card


def _fields(line: str) -> list[str]:
    """Return the fields behind the first of a line."""
    if "," in line:
        return [one.strip() for one in line.split(",")[1:]]
    width = 16 if "*" in line[:8] else 8
    return [line[at : at + width].strip() for at in range(8, min(len(line), 72), width)]


def _number(text: str) -> float:
    return float(BARE_EXPONENT.sub(r"e\1", text.upper().replace("D", "E")))


def dmig_text(A: Any, name: str, labels: Sequence[str]) -> str:
    """Return a symmetric matrix as DMIG in fields of 16 characters: the lower triangle, ten digits an entry."""
    lower = sp.csc_matrix(sp.tril(sp.csr_matrix(A)))
    lower.sort_indices()
    lines = [f"DMIG    {name:<8}{0:>8}{SYMMETRIC:>8}{2:>8}{0:>8}"]
    for j, label in enumerate(labels):
        node, _, way = label.partition(".")
        span = slice(lower.indptr[j], lower.indptr[j + 1])
        if span.start == span.stop:
            continue
        lines.append(f"DMIG*   {name:<16}{node:>16}{way:>16}")
        for i, value in zip(lower.indices[span], lower.data[span], strict=True):
            row, _, along = labels[i].partition(".")
            lines.append(f"*       {row:>16}{along:>16}{f'{value:.9E}'.replace('E', 'D'):>16}")
    return "\n".join(lines) + "\n"


def _by_pyyeti(path: Path, argument: str) -> ReadMatrix:
    """Return a matrix of Nastran's output4 or output2, through pyyeti where it is installed."""
    path.open("rb").close()
    try:
        from pyyeti.nastran import op2, op4  # type: ignore[import-not-found]
    except ImportError:
        raise ArgumentError(
            f"{path}: found Nastran's {path.suffix}, expected the package pyyeti to read it; pip install pyyeti, or "
            "write DMIG (.pch) or Matrix Market (.mtx)",
            argument,
        ) from None
    if path.suffix == ".op4":
        names, matrices, *_ = op4.load(str(path), into="list", sparse=True)
    else:
        with op2.OP2(str(path)) as file:
            every = file.rdop2mats(which="all")
        names, matrices = (
            zip(*((name, one) for name in every for one in every[name]), strict=True) if every else ((), ())
        )
    return ReadMatrix(sp.csr_matrix(matrices[list(names).index(_name_of(names, path, argument))]))


def _archive(path: Path, argument: str) -> ReadMatrix:
    """Return a matrix that scipy.sparse.save_npz or numpy.savez wrote."""
    with np.load(path) as found:
        if "format" in found:
            return ReadMatrix(sp.csr_matrix(sp.load_npz(path)))
        return ReadMatrix(sp.csr_matrix(found[_name_of(found.files, path, argument)]))


READERS: dict[str, Callable[[Path, str], ReadMatrix]] = {
    ".mtx": _mtx,
    ".npz": _archive,
    ".npy": lambda path, _: ReadMatrix(sp.csr_matrix(np.load(path))),
    **dict.fromkeys((".sti", ".mas", ".dam"), lambda path, _: _coordinate(path, True)),
    **dict.fromkeys((".pch", ".dmig", ".bdf"), _dmig),
    **dict.fromkeys((".op4", ".op2"), _by_pyyeti),
}
"""Readers by the suffix of a file."""
