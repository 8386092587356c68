"""The same tetrahedra in gapbeam and in CalculiX: matrices, frequencies and a motion in a gap.

A cantilever that gapbeam meshes with straight-sided tetrahedra of degree 2 is written as C3D10 cells. CalculiX exports
its free matrices, which gapbeam reads and clamps; CalculiX clamps the same deck itself for its own frequencies. In the
gap a coarser mesh is marched by both, in CalculiX with a nonlinear spring and Newmark's scheme. A pipe with three
elbows is made of B32R beams; under weight and a push sideways its supports with play are open or closed.

CalculiX is not a dependency. Debian and Ubuntu have it (`apt install calculix-ccx`); where there is no `ccx` the table
says so and holds no figures. CCX names a program that is not on the PATH.

    environment/run python3 -m benchmarks.calculix_peer
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from mpi4py import MPI

import gapbeam as gb
from benchmarks.table import Cell, Table, machine_words, options, seconds
from gapbeam.solver.case.case import Case
from gapbeam.solver.models.model import build_body
from gapbeam.solver.scene.frame_route import FrameRoute
from gapbeam.solver.system.operators import Array

LENGTH, HIGH, WIDE = 0.2, 0.012, 0.02  # m
YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7850.0
CASE = f"""
beam = {{ length = {LENGTH}, thickness = {HIGH}, width = {WIDE} }}
material = {{ young_modulus = {YOUNG}, poisson_ratio = {POISSON}, density = {DENSITY} }}
support = {{ length = 0.02, clearance = 1e-3 }}
contact = {{ stiffness = 1e11 }}
model = {{ type = "full" }}
mesh = {{ dimension = 3, cell = "tetrahedron", degree = 2 }}
time = {{ step = 1e-5, end = 1e-3 }}
load = [{{ type = "gravity" }}]
"""
FINE, COARSE = (4.5e-3, 3), (12e-3, 1)
"""Size of the cells, m, and how many lie through the thickness at least."""
MODES, KEPT = 8, 20
EDGES = (9, 6, 8, 7, 5, 4)  # nodes of basix between corners, in the order of C3D10
MIRROR = (0, 2, 1, 3, 6, 5, 4, 7, 9, 8)  # C3D10 of a mirrored cell
GAP, STOP = 2e-5, 2e6  # m, N/m
FORCE, FREQUENCY, SAMPLE = -20.0, 200.0, 1e-4  # N, Hz, s between rows of the table of the force
STEP, STEPS = 2e-5, 200
MOST = 3600.0  # s that CalculiX may take
CORNERS = [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [3.0, 0.0, 2.0], [3.0, 2.5, 2.0], [3.0, 2.5, 0.5]]  # m
BEND, OUTER, WALL, WET = 0.1524, 0.1143, 6e-3, 11900.0  # m, m, m, kg/m^3
PIPE_MODES, PIPE_PARTS, FINE_PARTS = 6, 30, 120
NOZZLE, STIFF, PLAY = 1e8, 2e7, 5e-4  # N/m of the spring at the end and of a support, m to either side
PUSH = np.array([4.0, 3.0, -9.81])  # m/s^2
SUPPORTS: dict[str, tuple[list[float], list[float]]] = {
    "rest": ([1.5, 0.0, 2.0], [0.0, 0.0, 1.0]), "guide": ([3.0, 1.0, 2.0], [1.0, 0.0, 0.0]),
    "snubber": ([2.6, 0.0, 2.0], [0.0, 1.0, 0.0]),
}  # fmt: skip


@dataclass(frozen=True)
class Tetrahedra:
    """A mesh of gapbeam, and its matrices in its own order of DOFs, node after node.

    Attributes:
        places: (nodes, 3), m.
        cells: (cells, 10), in the order of C3D10.
        K: Stiffness, sparse, N/m.
        M: Mass, kg.
    """

    places: Array
    cells: Array
    K: Any
    M: Any

    @property
    def tip(self) -> int:
        """Index of the node at the middle of the lower edge of the end, where the stop is."""
        return int(np.linalg.norm(self.places - [LENGTH, 0.0, -0.5 * HIGH], axis=1).argmin())

    def deck(self, more: str = "") -> str:
        """Return input of CalculiX, with the set ROOT."""
        nodes = (f"{i + 1},{','.join(f'{x:.12e}' for x in row)}" for i, row in enumerate(self.places))
        cells = (f"{i + 1},{','.join(str(j + 1) for j in row)}" for i, row in enumerate(self.cells))
        root = (str(i + 1) for i in np.flatnonzero(self.places[:, 0] < 1e-9 * LENGTH))
        lines = ["*NODE", *nodes, "*ELEMENT, TYPE=C3D10, ELSET=BODY", *cells, "*NSET, NSET=ROOT", *root,
                 "*MATERIAL, NAME=STEEL", "*ELASTIC", f"{YOUNG:.8e},{POISSON}", "*DENSITY", f"{DENSITY:.8e}",
                 "*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL", more]  # fmt: skip
        return "\n".join(lines)


def meshed(size: float, through: int) -> Tetrahedra:
    """Return the cantilever as gapbeam meshes and assembles it, still free."""
    given = tomllib.loads(CASE)
    given["mesh"] |= {"size": size, "support_size": size, "cells_through_thickness": through}
    body = build_body(Case.model_validate(given), MPI.COMM_SELF)
    places, rows = body.meshed.space.tabulate_dof_coordinates(), np.array(body.meshed.space.dofmap.list)
    cells = rows[:, [0, 1, 2, 3, *EDGES]]
    arms = places[cells[:, 1:4]] - places[cells[:, :1]]
    mirrored = np.linalg.det(arms) < 0.0
    cells[mirrored] = cells[mirrored][:, MIRROR]
    M, K = (sp.csr_matrix(one.getValuesCSR()[::-1]) for one in body.operators.matrices())  # type: ignore[attr-defined]
    return Tetrahedra(places, cells, K, M)


def program() -> str | None:
    """Return the path of CalculiX; None: there is none."""
    return os.environ.get("CCX") or shutil.which("ccx")


def solved(ccx: str, folder: Path, name: str, deck: str) -> float:
    """Write a deck, let CalculiX run it, and return the seconds that it took.

    Raises:
        RuntimeError: CalculiX failed.
    """
    (folder / f"{name}.inp").write_text(deck, encoding="utf-8")
    clock = time.perf_counter()
    done = subprocess.run([ccx, name], cwd=folder, capture_output=True, text=True, timeout=MOST, check=False)
    if done.returncode != 0 or "*ERROR" in done.stdout:
        raise RuntimeError(f"{ccx} {name} failed:\n{done.stdout[-2000:]}")
    return time.perf_counter() - clock


def printed_frequencies(path: Path) -> Array:
    """Return the angular frequencies that CalculiX printed, rad/s."""
    lines = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    return np.array([float(line[2]) for line in lines if len(line) == 5 and line[0].isdigit()])


def frequencies(A: Any, M: Any) -> Array:
    """Return the first angular frequencies, rad/s."""
    squares: Array = sla.eigsh(A, MODES, M, sigma=0.0, return_eigenvectors=False)
    return np.asarray(np.sqrt(np.sort(squares)))


def same_matrices(ccx: str, folder: Path, cells: tuple[float, int]) -> list[tuple[Cell, ...]]:
    """Return the rows about matrices and frequencies."""
    mesh = meshed(*cells)
    export, stiffness = folder / "free.inp", folder / "free.sti"
    solved(ccx, folder, "free", mesh.deck("*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n*END STEP\n"))
    deck = mesh.deck(f"*BOUNDARY\nROOT,1,3\n*STEP\n*FREQUENCY\n{MODES}\n*END STEP\n")
    solved(ccx, folder, "own", deck)
    theirs = printed_frequencies(folder / "own.dat")[:MODES]
    files: dict[str, Any] = {
        "stiffness": stiffness, "mass": folder / "free.mas", "dofs": folder / "free.dof", "nodes": export,
        "units": "m-kg-s",
    }  # fmt: skip
    read, held = gb.read_structure(**files), gb.read_structure(**files, clamped=["ROOT"])
    written = gb.write_structure(read, folder / "again")
    again = gb.read_structure(written["stiffness"], written["mass"], units="m-kg-s", dofs=files["dofs"])
    steel = gb.material(YOUNG, DENSITY, POISSON)
    (folder / "mesh.inp").write_text(mesh.deck(), encoding="utf-8")
    solid = gb.from_mesh(folder / "mesh.inp", steel, units="m", clamped=["ROOT"])
    free = np.flatnonzero(np.repeat(mesh.places[:, 0] >= 1e-9 * LENGTH, 3))
    full = mesh.K[free][:, free], mesh.M[free][:, free]
    triangle = np.loadtxt(stiffness)
    i, j = triangle[:, :2].astype(int).T - 1
    entries = np.asarray(read.K[i, j]).ravel()
    labels = (folder / "free.dof").read_text(encoding="utf-8").split()
    order = [3 * (int(node) - 1) + int(way) - 1 for node, _, way in (one.partition(".") for one in labels)]
    count = mesh.K.shape[0]
    return [
        ("entries of .sti, as read", count, float(np.abs(entries - triangle[:, 2]).max() / np.abs(entries).max())),
        ("written as Matrix Market, and read again", count, max(_apart(read.K, again.K), _apart(read.M, again.M))),
        ("stiffness of the full model", count, _apart(read.K, mesh.K[order][:, order])),
        ("mass of the full model", count, _apart(read.M, mesh.M[order][:, order])),
        *((f"{MODES} frequencies, {name}", count, float(np.abs(frequencies(*A) / theirs - 1.0).max()))
          for name, A in (("matrices of CalculiX", (held.K, held.M)), ("mesh file", (solid.K, solid.M)),
                          ("full model", full))),
    ]  # fmt: skip


def same_motion(ccx: str, folder: Path, steps: int) -> tuple[list[tuple[Cell, ...]], tuple[str, ...]]:
    """Return the rows about the motion of the tip in a gap, and a note."""
    mesh = meshed(*COARSE)
    tip, times = mesh.tip, SAMPLE * np.arange(int(steps * STEP / SAMPLE) + 2)
    force = np.sin(2.0 * np.pi * FREQUENCY * times)
    table = (f"{t:.10e},{value:.10e}" for t, value in zip(times, force, strict=True))
    wall, x = len(mesh.places) + 1, mesh.places[tip]
    lines = [
        # a spring to a node 1 m below that pushes once it is shorter by the gap
        "*NODE", f"{wall},{x[0]:.12e},{x[1]:.12e},{x[2] - 1.0:.12e}", "*ELEMENT, TYPE=SPRINGA, ELSET=STOP",
        f"{len(mesh.cells) + 1},{tip + 1},{wall}", "*SPRING, ELSET=STOP, NONLINEAR", "",
        f"{-STOP:.8e},{-1.0 - GAP:.8e}", f"0.,{-GAP:.8e}", "0.,1.", "*AMPLITUDE, NAME=SHAKER", *table,
        "*BOUNDARY", "ROOT,1,3", f"{wall},1,3", "*NSET, NSET=TIP", str(tip + 1), f"*STEP, INC={steps + 1}",
        "*DYNAMIC, DIRECT, ALPHA=0.", f"{STEP:.8e},{steps * STEP:.8e}", "*CLOAD, AMPLITUDE=SHAKER", f"TIP,3,{FORCE}",
        "*NODE PRINT, NSET=TIP", "U", "*END STEP", "",
    ]  # fmt: skip
    spent = solved(ccx, folder, "gap", mesh.deck("\n".join(lines)))
    rows = (line.split() for line in (folder / "gap.dat").read_text(encoding="utf-8").splitlines())
    theirs = np.array([float(row[3]) for row in rows if len(row) == 4 and row[0].isdigit()])
    (folder / "coarse.inp").write_text(mesh.deck(), encoding="utf-8")
    point = {"tip": {"node": tip + 1, "direction": [0.0, 0.0, 1.0]}}
    steel = gb.material(YOUNG, DENSITY, POISSON)
    solid = gb.from_mesh(folder / "coarse.inp", steel, units="m", clamped=["ROOT"], points=point)
    found: list[tuple[Cell, ...]] = []
    marched = 0.0
    for name, structure in (("all DOFs", solid), (f"{KEPT} modes", gb.reduced_at_points(solid, KEPT))):
        stop = gb.Contact(structure["tip"], gb.HalfPlane(GAP, -1), gb.KelvinVoigt(stiffness=STOP), name="stop")
        shaker = gb.Force(structure["tip"], lambda t: FORCE * np.interp(t, times, force), name="shaker")
        scene = gb.Scene(structure, contacts=[stop], loads=[shaker])
        clock = time.perf_counter()
        history = gb.history(scene, STEP, steps * STEP, scheme=gb.newmark())
        marched = marched or time.perf_counter() - clock
        ours = history.displacement["tip"]
        closed = np.count_nonzero(np.diff((history.force["stop"] > 0.0).astype(int)) > 0)
        apart = float(np.abs(ours - theirs).max() / np.abs(theirs).max())
        found.append((f"motion in a gap, {name}, {closed} impacts", solid.size, apart))
    return found, (f"the motion, {steps} steps: CalculiX {seconds(spent)}, gapbeam {seconds(marched)} with set-up",)


def pipe_lines(route: FrameRoute, ends: Array) -> list[str]:
    """Return lines of a deck with the pipe in B32R beams, in the set PIPE, between stations along its axis."""
    middles = 0.5 * (ends[:-1] + ends[1:])
    places = [route.at(float(s)) for s in np.sort([*ends, *middles])]
    lines = ["*NODE", *(f"{i + 1},{','.join(f'{x:.12e}' for x in row)}" for i, row in enumerate(places))]
    normal = np.array([0.0, 1.0, 0.0])  # across the plane of a bend, and of the leg behind it
    for k, part in enumerate(route.parts):
        own = [i for i, s in enumerate(middles) if route.part_at(float(s)) is part]
        normal = normal if part.inward is None else np.cross(part.along, part.inward)
        lines += [
            f"*ELEMENT, TYPE=B32R, ELSET=P{k}", *(f"{i + 1},{2 * i + 1},{2 * i + 2},{2 * i + 3}" for i in own),
            f"*BEAM SECTION, ELSET=P{k}, MATERIAL=STEEL, SECTION=PIPE", f"{0.5 * OUTER},{WALL}",
            ",".join(f"{x:.12e}" for x in normal),
        ]  # fmt: skip
    return [*lines, "*ELSET, ELSET=PIPE", *(f"P{k}" for k in range(len(route.parts))), "*MATERIAL, NAME=STEEL",
            "*ELASTIC", f"{YOUNG:.8e},{POISSON}", "*DENSITY", f"{WET:.8e}", "*BOUNDARY", "1,1,6"]  # fmt: skip


def pipe_of(points: dict[str, Any], pinned: list[Any]) -> gb.Structure:
    """Return the pipe of gapbeam, flexibility factor 1, clamped at its start."""
    steel, tube = gb.material(YOUNG, WET, POISSON), gb.space_section("tube", OUTER, wall=WALL)
    return gb.frame(CORNERS, tube, steel, points, bends=BEND, flexibility=1.0, clamped=[0.0], pinned=pinned,
                    elements=60)  # fmt: skip


def same_pipe(ccx: str, folder: Path) -> tuple[Cell, ...]:
    """Return the row about a pipe with three elbows, flexibility factor 1, in B32R beams: clamped, and pinned."""
    pipe, route = pipe_of({}, [CORNERS[-1]]), FrameRoute(CORNERS, BEND, "pipe")
    ends = route.stations([], route.length / PIPE_PARTS, np.pi / 16.0)
    lines = [*pipe_lines(route, ends), f"{2 * len(ends) - 1},1,3", "*STEP", "*FREQUENCY", str(PIPE_MODES),
             "*END STEP", ""]  # fmt: skip
    solved(ccx, folder, "pipe", "\n".join(lines))
    theirs, ours = printed_frequencies(folder / "pipe.dat"), np.sqrt(pipe.modes[0][:PIPE_MODES])
    return f"{PIPE_MODES} frequencies of a pipe", pipe.size, float(np.abs(ours / theirs[:PIPE_MODES] - 1.0).max())


def same_loads(ccx: str, folder: Path, closed: bool) -> tuple[Cell, ...]:
    """Return the row about the loads on the supports of the pipe at rest.

    At its end it stands on springs. Closed: it rests on one support, leans on another, and the snubber is locked.
    """
    pipe = pipe_of({**SUPPORTS, "nozzle": (CORNERS[-1], np.eye(3))}, [])
    law, far = gb.KelvinVoigt(stiffness=STIFF), 0.0 if closed else 1.0
    scene = gb.Scene(
        pipe,
        contacts=[gb.Contact(pipe["rest"], gb.HalfPlane(far, -1), law, name="rest"),
                  gb.Contact(pipe["guide"], gb.Slot(2.0 * (PLAY + far)), law, name="guide")],
        loads=[gb.weight(pipe, float(np.linalg.norm(PUSH)), PUSH)],
        joints=[gb.Joint(pipe["nozzle"], NOZZLE), *([gb.Joint(pipe["snubber"], STIFF)] if closed else [])],
    )  # fmt: skip
    q = gb.seat(scene).q[:, 0]
    moved = {name: scene.rows_at(point) @ q for name, point in pipe.points.items()}
    route = FrameRoute(CORNERS, BEND, "pipe")
    stations = {name: route.nearest(np.array(at)) for name, (at, _) in SUPPORTS.items()}
    ends = route.stations([*stations.values()], route.length / FINE_PARTS, np.pi / 32.0)
    node = {name: 2 * int(np.abs(ends - s).argmin()) + 1 for name, s in stations.items()}
    node["nozzle"] = 2 * len(ends) - 1
    lines, wall = [], 2 * len(ends)
    springs = [("nozzle", way, NOZZLE) for way in (1, 2, 3)] + [("snubber", 2, STIFF)] * closed
    for k, (name, way, stiffness) in enumerate(springs):
        lines += [f"*ELEMENT, TYPE=SPRING1, ELSET=S{k}", f"{9000 + k},{node[name]}", f"*SPRING, ELSET=S{k}", str(way),
                  f"{stiffness:.8e}"]  # fmt: skip
    walls = [("rest", [0.0, 0.0, -1.0], 0.0), ("guide", [-1.0, 0.0, 0.0], PLAY), ("guide", [1.0, 0.0, 0.0], PLAY)]
    for k, (name, away, play) in enumerate(walls if closed else ()):
        x = route.at(stations[name]) + away  # a node 1 m away, as in `same_motion`
        lines += [
            "*NODE", f"{wall + k},{','.join(f'{one:.12e}' for one in x)}", f"*ELEMENT, TYPE=SPRINGA, ELSET=W{k}",
            f"{9100 + k},{node[name]},{wall + k}", f"*SPRING, ELSET=W{k}, NONLINEAR", "",
            f"{-STIFF:.8e},{-1.0 - play:.8e}", f"0.,{-play:.8e}", "0.,1.", "*BOUNDARY", f"{wall + k},1,3",
        ]  # fmt: skip
    # stops are looked at again in each iteration only where the step is nonlinear
    lines += ["*NSET, NSET=SEEN", *(str(one) for one in sorted(node.values())), "*STEP, NLGEOM, INC=1000", "*STATIC",
              "0.1,1.", "*DLOAD",
              f"PIPE,GRAV,{np.linalg.norm(PUSH):.12e},{','.join(f'{x:.12e}' for x in PUSH / np.linalg.norm(PUSH))}",
              "*NODE PRINT, NSET=SEEN", "U", "*END STEP", ""]  # fmt: skip
    solved(ccx, folder, "loads", "\n".join([*pipe_lines(route, ends), *lines]))
    rows = (line.split() for line in (folder / "loads.dat").read_text(encoding="utf-8").splitlines())
    printed = {int(row[0]): np.array(row[1:], dtype=float) for row in rows if len(row) == 4 and row[0].isdigit()}
    theirs = {name: printed[node[name]] @ np.array(way) for name, (_, way) in SUPPORTS.items()}
    theirs["nozzle"] = printed[node["nozzle"]]

    def loads(moved: dict[str, Any]) -> Array:
        side = float(np.ravel(moved["guide"])[0])
        deep = np.sign(side) * max(abs(side) - PLAY, 0.0)
        stops = STIFF * np.hstack([moved["rest"], deep, moved["snubber"]])
        return np.hstack([NOZZLE * moved["nozzle"], *([stops] if closed else [])])

    worst = float(np.abs(loads(moved) / loads(theirs) - 1.0).max())
    return f"loads on the supports of the pipe, gaps {'closed' if closed else 'open'}", pipe.size, worst


def table(cells: tuple[float, int] = FINE, steps: int = STEPS) -> Table:
    """Return the table, or one without rows where there is no CalculiX.

    Args:
        cells: Cells of the mesh for matrices and frequencies, as `FINE`.
        steps: Steps of the motion.
    """
    title, columns = "gapbeam and CalculiX on the same tetrahedra", ("what", "DOFs", "largest difference")
    ccx = program()
    if ccx is None:
        note = "not measured: no ccx here; see benchmarks/calculix_peer.py"
        return Table("calculix", title, columns, (), (note,))
    with tempfile.TemporaryDirectory() as folder:
        rows = [*same_matrices(ccx, Path(folder), cells), same_pipe(ccx, Path(folder)),
                *(same_loads(ccx, Path(folder), closed) for closed in (False, True))]  # fmt: skip
        moved, notes = same_motion(ccx, Path(folder), steps)
    return Table(
        "calculix", title, columns, (*rows, *moved),
        (machine_words(), "differences are relative to the largest entry, to each frequency or to the largest motion",
         "CalculiX prints seven digits, and integrates the mass of C3D10 at the four points that are exact for its "
         "stiffness", *notes),
        {str(row[0]): row[2] for row in (*rows, *moved)},
    )  # fmt: skip


def _apart(A: Any, B: Any) -> float:
    return float(abs(A - B).max() / abs(A).max())


if __name__ == "__main__":
    chosen = options(__doc__)
    table().write(chosen.output)
