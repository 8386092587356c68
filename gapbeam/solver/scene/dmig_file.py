"""DMIG: matrices in the bulk data of Nastran, by grid points and components.

A header `DMIG NAME 0 IFO TIN` (IFO 6: symmetric, one triangle; 1 or 2: whole) precedes columns `DMIG NAME GJ CJ` with
entries `GI CI A`. Fields have 8 characters, 16 after `DMIG*`, or commas between them. 16 characters hold ten digits.

Source: MSC Nastran Quick Reference Guide, DMIG.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import ArgumentError

SYMMETRIC = 6
FIRST_LETTERS = {"stiffness": "K", "mass": "M", "damping": "B"}
BARE_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")  # 1.5+3 is 1.5e3


def read_dmig(path: Path, argument: str) -> tuple[Any, list[str]]:
    """Return a matrix of a file, and the "node.direction" of its rows, sorted; direction 0 is a scalar point.

    Args:
        path: The file.
        argument: "stiffness", "mass" or "damping": of several matrices, that whose name begins with K, M or B.

    Raises:
        ArgumentError: There is no such matrix, or there are several.
        ValueError: A line is none of DMIG.
        OSError: The file cannot be read.
    """
    kinds: dict[str, int] = {}
    entries: dict[str, list[tuple[str, str, float]]] = {}
    for card in _cards(path.read_text(encoding="utf-8")):
        name, first, second = card[0], card[1], card[2]
        if first == "0" and name not in kinds:
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
    names = [one for one in kinds if one.startswith(FIRST_LETTERS[argument])] if len(kinds) > 1 else list(kinds)
    if len(names) != 1:
        known = ", ".join(kinds) or "none"
        raise ArgumentError(
            f"{path}: found the matrices {known}, expected one whose name begins with {FIRST_LETTERS[argument]}",
            argument,
        )
    return _matrix(entries[names[0]], kinds[names[0]] == SYMMETRIC)


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


def _matrix(entries: Sequence[tuple[str, str, float]], symmetric: bool) -> tuple[Any, list[str]]:
    rows = {row for row, _, _ in entries} | {column for _, column, _ in entries}
    labels = sorted(rows, key=lambda label: tuple(map(int, label.split("."))))
    places = {label: i for i, label in enumerate(labels)}
    i = np.array([places[row] for row, _, _ in entries], dtype=int)
    j = np.array([places[column] for _, column, _ in entries], dtype=int)
    values = np.array([value for _, _, value in entries])
    if symmetric:
        off = i != j
        i, j, values = np.concatenate([i, j[off]]), np.concatenate([j, i[off]]), np.concatenate([values, values[off]])
    return sp.csr_matrix((values, (i, j)), shape=(len(labels), len(labels))), labels


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
