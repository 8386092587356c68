"""Two structures of solids that touch against one of as many DOFs: cost of set-up and of a step.

Set-up reads the meshes, assembles and factors; a step is one back-substitution. Each is measured in processor time of a
process of its own.

    environment/run python3 -m benchmarks.two_structures
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import meshio
import numpy as np

import gapbeam as gb
from benchmarks.table import Cell, Figures, Table, machine_words, measured_apart, options, print_figures, seconds
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.scene_march import marcher_of

CELLS = (60, 23, 22)
"""Hexahedra along, across and through one of two structures."""
SIDE, STEPS = 0.005, 40  # m of a cell, steps


def block(folder: Path, cells: Sequence[int], shift: float, name: str) -> gb.Structure:
    """Return a block that is clamped at its far end, with a point in the middle of the other."""
    x = np.stack(np.meshgrid(*(np.arange(n + 1.0) for n in cells), indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(x)).reshape([n + 1 for n in cells])
    ends = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    rows = [number[i : i + cells[0], j : j + cells[1], k : k + cells[2]].ravel() for i, j, k in ends]
    path = folder / f"{name}.vtk"
    meshio.Mesh(SIDE * x, [("hexahedron", np.column_stack(rows))]).write(path)
    held = [str(i + 1) for i in np.flatnonzero(x[:, 0] == cells[0])]
    tip = {"nearest": [shift, 0.5 * SIDE * cells[1], 0.5 * SIDE * cells[2]], "direction": [0.0, 0.0, 1.0]}
    return gb.from_mesh(
        path, gb.material(2e11, 7800.0, 0.3), units="m", clamped=held, points={"tip": tip}, name=name,
        place=gb.Pose((shift, 0.0, 0.0)),
    )  # fmt: skip


def measure(count: int, cells: Sequence[int]) -> None:
    """Print the costs of one structure, or of two, each of `cells`; one is twice as long."""
    clock, law = time.process_time(), gb.KelvinVoigt(stiffness=1e8)
    with tempfile.TemporaryDirectory() as folder:
        long = (2 * cells[0], *cells[1:]) if count == 1 else cells
        bodies = [block(Path(folder), long, k * SIDE * (cells[0] + 1), f"b{k}") for k in range(count)]
    between = bodies[0]["tip"] if count == 1 else (bodies[0]["tip"], bodies[1]["tip"])
    touch = gb.Contact(between, gb.HalfPlane(1e-6), law, name="touch")
    scene = gb.Scene(*bodies, contacts=[touch], loads=[gb.Force(bodies[0]["tip"], 1e3, name="push")])
    marcher = marcher_of(scene, 1e-5)
    setup = time.process_time() - clock
    marcher.advance(2)
    clock = time.process_time()
    marcher.advance(STEPS)
    print_figures({"dofs": scene.size, "setup": setup, "step": (time.process_time() - clock) / STEPS})


def table(cells: Sequence[int] = CELLS) -> Table:
    """Return the table."""
    found: dict[int, Figures] = {}
    for count in (1, 2):
        words = ",".join(map(str, cells))
        found[count] = measured_apart("benchmarks.two_structures", f"--{count}", words)
    rows: list[tuple[Cell, ...]] = [
        (counted(count, "structure"), int(one["dofs"]), seconds(one["setup"]), seconds(one["step"]))
        for count, one in found.items()
    ]
    ratios = {name: found[2][name] / found[1][name] for name in ("setup", "step")}
    note = f"two over one: set-up {ratios['setup']:.2f}, step {ratios['step']:.2f}"
    return Table("two-structures", "Two structures against one of as many DOFs", ("scene", "DOFs", "set-up", "step"),
                 tuple(rows), (machine_words(), note), ratios)  # fmt: skip


if __name__ == "__main__":
    if sys.argv[1:2] in (["--1"], ["--2"]):
        measure(int(sys.argv[1][2:]), tuple(map(int, sys.argv[2].split(","))))
    else:
        chosen = options(__doc__)
        table().write(chosen.output)
