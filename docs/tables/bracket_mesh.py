"""Write the mesh of cases/scenes/bracket.toml: a steel bracket with a rubber pad at its end, in mm, by gmsh.

Tetrahedra of order 2 in groups STEEL and RUBBER, and the nodes of the faces ROOT and TIP as sets of a `.inp` file.

python3 docs/tables/bracket_mesh.py
"""

from __future__ import annotations

from pathlib import Path

import gmsh
import meshio
import numpy as np

FILE = Path(__file__).resolve().parents[2] / "cases" / "scenes" / "bracket.inp"
LENGTH, WIDTH, HIGH, FOOT = 120.0, 20.0, 8.0, 50.0  # mm: the arm, and the height of the foot
PAD = 6.0  # mm
SIZE = 12.0  # mm, of cells


def mesh() -> meshio.Mesh:
    """Return the mesh with its sets."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        box = gmsh.model.occ.addBox
        foot, arm = box(0, 0, 0, HIGH, WIDTH, FOOT), box(0, 0, FOOT, LENGTH, WIDTH, HIGH)
        pad = box(LENGTH - 20.0, 0, FOOT + HIGH, 20.0, WIDTH, PAD)
        parts, _ = gmsh.model.occ.fragment([(3, foot), (3, arm)], [(3, pad)])
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", SIZE)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        tags, x, _ = gmsh.model.mesh.getNodes()
        row = np.zeros(int(tags.max()) + 1, dtype=int)
        row[tags.astype(int)] = np.arange(len(tags))
        blocks = [row[gmsh.model.mesh.getElements(3, tag)[2][0].astype(int)].reshape(-1, 10) for _, tag in parts]
    finally:
        gmsh.finalize()
    points = np.round(np.reshape(x, (-1, 3)), 6)
    cells = np.concatenate(blocks)[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]  # the last two of gmsh are exchanged
    soft = points[cells[:, :4], 2].mean(axis=1) > FOOT + HIGH
    used = np.unique(cells)
    points, cells = points[used], np.searchsorted(used, cells)
    found = meshio.Mesh(points, [("tetra10", cells)])
    found.cell_sets = {"STEEL": [np.flatnonzero(~soft)], "RUBBER": [np.flatnonzero(soft)]}
    top = points[:, 2] > FOOT + HIGH + PAD - 1e-3
    found.point_sets = {"ROOT": np.flatnonzero(points[:, 2] < 1e-3), "TIP": np.flatnonzero(top)}
    return found


if __name__ == "__main__":
    mesh().write(FILE, float_fmt=".7g")
