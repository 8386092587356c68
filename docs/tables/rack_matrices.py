"""Write the matrices of cases/scenes/rack.toml as a finite element program exports them, in mm, t and s.

A frame in the plane x, z of Euler-Bernoulli elements with axial stiffness: two posts and two shelves. Nodes have the
directions 1, 3 and 5; `.sti` and `.mas` are upper triangles, `.dof` names the rows, `.inp` has nodes and sets.

python3 docs/tables/rack_matrices.py
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy.sparse as sp

FOLDER = Path(__file__).resolve().parents[2] / "cases" / "scenes"
YOUNG, DENSITY = 2.1e5, 7.85e-9  # N/mm^2, t/mm^3
AREA, MOMENT = 400.0, 40.0 * 10.0**3 / 12.0  # mm^2, mm^4: 40 x 10 mm, weak about y
WIDTH, HEIGHTS, PARTS = 600.0, (0.0, 400.0, 800.0), 4  # mm


def nodes_and_elements() -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Return coordinates x, z of the nodes, (n, 2), mm, and the ends of the elements."""
    places: list[tuple[float, float]] = []
    elements: list[tuple[int, int]] = []

    def node(x: float, z: float) -> int:
        at = (round(x, 9), round(z, 9))
        if at not in places:
            places.append(at)
        return places.index(at)

    def line(first: tuple[float, float], last: tuple[float, float]) -> None:
        steps = np.linspace(0.0, 1.0, PARTS + 1)
        ends = [node(*(np.array(first) + s * (np.array(last) - np.array(first)))) for s in steps]
        elements.extend(pairwise(ends))

    for x in (0.0, WIDTH):
        for low, high in pairwise(HEIGHTS):
            line((x, low), (x, high))
    for z in HEIGHTS[1:]:
        line((0.0, z), (WIDTH, z))
    return np.array(places), elements


def element(along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and mass of an element for u_x, u_z and the angle about y at its ends, (6, 6)."""
    L = float(np.linalg.norm(along))
    c, s = along / L
    a, b = YOUNG * AREA / L, YOUNG * MOMENT / L**3
    m = DENSITY * AREA * L
    bend = np.array([[12, 6 * L, -12, 6 * L], [6 * L, 4 * L * L, -6 * L, 2 * L * L],
                     [-12, -6 * L, 12, -6 * L], [6 * L, 2 * L * L, -6 * L, 4 * L * L]])  # fmt: skip
    inert = np.array([[156, 22 * L, 54, -13 * L], [22 * L, 4 * L * L, 13 * L, -3 * L * L],
                      [54, 13 * L, 156, -22 * L], [-13 * L, -3 * L * L, -22 * L, 4 * L * L]])  # fmt: skip
    K, M = np.zeros((6, 6)), np.zeros((6, 6))
    across, straight = np.ix_([1, 2, 4, 5], [1, 2, 4, 5]), np.ix_([0, 3], [0, 3])
    K[across], M[across] = b * bend, m / 420.0 * inert
    K[straight], M[straight] = a * np.array([[1, -1], [-1, 1]]), m / 6.0 * np.array([[2, 1], [1, 2]])
    turn = np.kron(np.eye(2), np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, -1.0]]))  # slope: minus the angle about y
    return turn.T @ K @ turn, turn.T @ M @ turn


def write(folder: Path = FOLDER) -> None:
    """Write rack.sti, rack.mas, rack.dof and rack.inp."""
    places, elements = nodes_and_elements()
    n = 3 * len(places)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for i, j in elements:
        rows = [*range(3 * i, 3 * i + 3), *range(3 * j, 3 * j + 3)]
        k, m = element(places[j] - places[i])
        K[np.ix_(rows, rows)] += k
        M[np.ix_(rows, rows)] += m
    for name, A in (("sti", K), ("mas", M)):
        upper = sp.coo_matrix(np.triu(A))
        table = np.column_stack([upper.row + 1, upper.col + 1, upper.data])
        np.savetxt(folder / f"rack.{name}", table, fmt=["%d", "%d", "%.13e"])
    numbers = range(1, len(places) + 1)
    (folder / "rack.dof").write_text("".join(f"{node}.{way}\n" for node in numbers for way in (1, 3, 5)))
    lines = [f"{node}, {x:g}, 0, {z:g}" for node, (x, z) in zip(numbers, places, strict=True)]
    roots = [str(node) for node, (_, z) in zip(numbers, places, strict=True) if z == 0.0]
    shelf = [str(node) for node, (_, z) in zip(numbers, places, strict=True) if z == HEIGHTS[-1]]
    text = ["*NODE", *lines, "*NSET, NSET=ROOT", ", ".join(roots), "*NSET, NSET=TOP", ", ".join(shelf)]
    (folder / "rack.inp").write_text("\n".join(text) + "\n")


if __name__ == "__main__":
    write()
