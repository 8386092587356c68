"""The slice in plane stress in gapbeam and in GetFEM: the seat, some steps of rattling, and what a step costs.

GetFEM is not a dependency. Debian and Ubuntu have it (`apt install python3-getfem`); where it cannot be imported the
table says so and holds no figures. In the root file system of environment/run, which is read only, unpack it beside:

    environment/run bash -c 'cd FOLDER && apt-get download python3-getfem libgetfem5t64 libmumps-seq-5.7 libqhull-r8.0
      libmetis5 libscotch-7.0 && for package in *.deb; do dpkg -x $package .; done'
    PYTHONPATH=FOLDER/usr/lib/python3/dist-packages LD_LIBRARY_PATH=FOLDER/usr/lib/x86_64-linux-gnu ...

    environment/run python3 -m benchmarks.getfem_peer
"""

from __future__ import annotations

import importlib.util
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.table import Cell, Table, machine_words, options, seconds
from benchmarks.textbook import marched, seated, shaken
from gapbeam.solver.system.semi_discrete import VALUE

CASES = Path(__file__).parents[1] / "cases"
SLICES = ("demo.toml", "li2013-2d.toml")
STEPS = 200
COLUMNS = (
    "case",
    "DOFs",
    "seat: displacement",
    "reaction",
    "steps: displacement",
    "gapbeam, per step",
    "GetFEM, per step",
    "times faster",
)


def compare(name: str, steps: int = STEPS) -> tuple[Cell, ...]:
    """Return the row of one slice: relative differences, and times."""
    from benchmarks.getfem_beam import GetfemBeam

    case = shaken(CASES / name)
    start = seated(case)
    model = start.model
    peer = GetfemBeam(case, model)
    rest = peer.seat()
    _, same = cKDTree(model.space.tabulate_dof_coordinates()[:, :2]).query(peer.nodes)
    ours = start.start.u[VALUE].reshape(-1, 2)[same]
    contact = model.system.contact
    forces = np.bincount(contact.faces, weights=contact.weights * start.start.pressure)
    reactions = dict(zip(contact.face_names, forces, strict=True))
    missed = max(abs(peer.reactions(rest)[face] / force - 1.0) for face, force in reactions.items())
    moving = [(load, load.pattern.reshape(-1, 2)[same]) for load in model.system.loads if not load.static]
    marched(start, 2)
    done = marched(start, steps, keep=True)
    clock = time.perf_counter()
    theirs, _ = peer.march(rest, steps, lambda now: sum(load.factor(now) * pattern for load, pattern in moving))
    spent = (time.perf_counter() - clock) / steps
    apart = [_apart(mine.reshape(-1, 2)[same], yours) for mine, yours in zip(done.displacements, theirs, strict=True)]
    return (
        name,
        model.dofs,
        _apart(ours, rest),
        float(missed),
        max(apart),
        seconds(done.per_step),
        seconds(spent),
        spent / done.per_step,
    )


def table(names: tuple[str, ...] = SLICES, steps: int = STEPS) -> Table:
    """Return the table of the slices, or one without rows where there is no GetFEM."""
    title = "gapbeam and GetFEM on the same slice in plane stress, penalty contact"
    if importlib.util.find_spec("getfem") is None:
        return Table(
            "getfem", title, COLUMNS, (), ("not measured: no python3-getfem here; see benchmarks/getfem_peer.py",)
        )
    rows = tuple(compare(name, steps) for name in names)
    return Table(
        "getfem",
        title,
        COLUMNS,
        rows,
        (
            machine_words(),
            "differences are relative to the largest displacement or to the reaction of the face; GetFEM is asked for "
            "a residual of 1e-5 N",
            f"{steps} steps of a rattling slice, midpoint rule with the contact at the end of the step; GetFEM keeps "
            "its constant matrices, and assembles the contact and factors in each iteration (MUMPS)",
        ),
        {f"ratio_{name}": row[-1] for name, row in zip(names, rows, strict=True)},
    )


def _apart(mine: np.ndarray, yours: np.ndarray) -> float:
    return float(np.max(np.abs(mine - yours)) / np.max(np.abs(mine)))


if __name__ == "__main__":
    chosen = options(__doc__)
    table().write(chosen.output)
