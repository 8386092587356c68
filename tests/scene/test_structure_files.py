"""Structures from files of matrices: what is written is what is read, in its units, held where it is said to be."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import gapbeam as gb
from gapbeam.solver.scene.imported_points import Rows
from gapbeam.solver.scene.node_files import read_nodes
from gapbeam.solver.scene.order_of_rows import check_order
from tests.shared.command import PROJECT

LENGTH, NODES = 1.0, 21
SECTION = gb.section("rectangle", 0.01)._replace(shear_area=float("inf"))
STEEL = gb.material(2e11, 8000.0)


def written(folder: Path, kind: str = "ccx", units: str = "m-kg-s") -> dict[str, Path]:
    """Write a free beam along x that bends in z; angles about y, as finite element programs have them."""
    beam = gb.beam(LENGTH, SECTION, STEEL, {}, elements=NODES - 1)
    meter, kilogram = {"m-kg-s": (1.0, 1.0), "mm-t-s": (1e-3, 1e3)}[units]
    signs = np.tile([meter, -1.0], NODES)  # DOFs in their unit; an angle about y is minus the slope
    matrices = {name: signs[:, None] * A * signs / (kilogram * meter**2) for name, A in (("K", beam.K), ("M", beam.M))}
    files = {}
    for name, A in matrices.items():
        if kind == "ccx":
            files[name] = folder / f"beam.{'sti' if name == 'K' else 'mas'}"
            i, j = np.nonzero(np.triu(A))
            np.savetxt(files[name], np.column_stack([i + 1, j + 1, A[i, j]]), fmt=["%d", "%d", "%.17e"])
        elif kind == "mtx":
            files[name] = folder / f"{name}.mtx"
            scipy.io.mmwrite(files[name], sp.csr_matrix(A), precision=17)
        else:
            files[name] = folder / f"{name}.npz"
            sp.save_npz(files[name], sp.csr_matrix(A))
    files["dofs"], files["nodes"] = folder / "beam.dof", folder / "beam.inp"
    files["dofs"].write_text("".join(f"{node}.3\n{node}.5\n" for node in range(1, NODES + 1)))
    x = np.linspace(0.0, LENGTH, NODES) / meter
    files["nodes"].write_text("*NODE\n" + "".join(f"{i}, {at:.17g}, 0, 0\n" for i, at in enumerate(x, 1)))
    return files


def read(files: dict[str, Path], units: str = "m-kg-s", **others: object) -> gb.Structure:
    return gb.read_structure(
        files["K"],
        files["M"],
        dofs=files["dofs"],
        nodes=files["nodes"],
        units=units,
        **others,  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("units", ["m-kg-s", "mm-t-s"])
@pytest.mark.parametrize("kind", ["ccx", "mtx", "npz"])
def test_matrices_are_read_as_they_were_written(tmp_path: Path, kind: str, units: str) -> None:
    """All entries, in SI, with two rigid motions in closed form and the mass that a frame along z moves."""
    beam = gb.beam(LENGTH, SECTION, STEEL, {}, elements=NODES - 1)
    found = read(written(tmp_path, kind, units), units, points={"tip": f"{NODES}.3"}, frame=[0.0, 0.0, 2.0])
    signs = np.tile([1.0, -1.0], NODES)
    for A, B in ((found.K, beam.K), (found.M, beam.M)):
        assert np.abs(A.toarray() - signs[:, None] * B * signs).max() <= 2e-15 * np.abs(B).max()
    assert found.rigid is not None
    assert found.rigid.shape == (2 * NODES, 2)
    assert float(found.inertia @ np.tile([1.0, 0.0], NODES)) == pytest.approx(8000.0 * 1e-4 * LENGTH, rel=1e-12)
    assert found.modes[0][:2] == pytest.approx(0.0, abs=0.0)


def test_a_free_export_is_clamped_here(tmp_path: Path) -> None:
    """Frequencies of Euler and Bernoulli's cantilever; nothing of it is rigid any more."""
    found = read(written(tmp_path), clamped=[1], points={"tip": "21.3"})
    assert found.rigid is None
    factor = sqrt(2e11 * SECTION.second_moment / (8000.0 * SECTION.area))
    assert np.sqrt(found.modes[0][:2]) == pytest.approx(
        factor * np.array([3.516015, 22.03449]), rel=2e-4
    )  # rotary inertia


def test_a_reduced_import_hits_its_gap_as_the_whole(tmp_path: Path) -> None:
    """Six modes and the static response at the tip against all 40 DOFs, and worse without that response."""
    whole = read(written(tmp_path), clamped=[1], points={"tip": "21.3", "middle": "11.3"})
    ends, stiff = {}, 1e5
    for name, beam in {
        "whole": whole,
        "reduced": gb.reduced_at_points(whole, 6, ["tip"]),
        "modes": whole.reduced(6),
    }.items():
        stop = gb.Contact(beam["tip"], gb.Slot(1e-3), gb.KelvinVoigt(stiffness=stiff, damping=100.0), name="stop")
        load = gb.Force(beam["middle"], lambda t: 40.0 * np.sin(60.0 * t))
        ends[name] = gb.history(gb.Scene(beam, contacts=[stop], loads=[load]), 1e-5, 0.1).displacement["tip"]
    close = {name: np.abs(x - ends["whole"]).max() for name, x in ends.items()}
    assert close["reduced"] < 0.02 * np.abs(ends["whole"]).max()
    assert close["reduced"] < 0.6 * close["modes"]


def test_flexibility_at_points_is_kept(tmp_path: Path) -> None:
    """Displacement of the tip by a unit force there: L^3 / (3 EI) with one mode and the static response."""
    whole = read(written(tmp_path), clamped=[1], points={"tip": "21.3"})
    small = gb.reduced_at_points(whole, 1)
    across = small["tip"].rows
    tip = float((across @ np.linalg.solve(small.K, across.T))[0, 0])
    assert tip == pytest.approx(LENGTH**3 / (3 * 2e11 * SECTION.second_moment), rel=1e-4)
    assert small.size == 2


REFUSED = {
    "units": (lambda f: read(f, "inch"), "expected one of m-kg-s"),
    "suffix": (lambda _: gb.read_structure("k.txt", "m.txt", units="m-kg-s"), "found .txt, expected .mtx"),
    "no file": (lambda _: gb.read_structure("k.mtx", "m.mtx", units="m-kg-s"), "cannot be read as a matrix"),
    "clamped": (lambda f: read(f, clamped=["99"]), "found '99', expected a node or DOF"),
    "point": (
        lambda f: read(f, points={"tip": "21.1"}),
        "'21.1', expected a DOF of the matrices, .* to .*; that node has 21.3, 21.5",
    ),
    "held": (lambda f: read(f, clamped=[1], points={"root": "1.3"}), "DOF 1.3 is clamped"),
    "all": (lambda f: read(f, clamped=range(1, NODES + 1)), "all DOFs are clamped"),
    "frame": (lambda f: read(f, frame=[0.0, 0.0, 0.0]), "three numbers that are not all 0"),
    "frame alone": (lambda f: gb.read_structure(f["K"], f["M"], units="m-kg-s", frame=[0, 0, 1.0]), "give `dofs`"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_files_that_do_not_fit_are_refused(tmp_path: Path, name: str) -> None:
    call, words = REFUSED[name]
    with pytest.raises(gb.UserError) as refused:
        call(written(tmp_path))
    assert re.search(words, str(refused.value)), str(refused.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f["dofs"].write_text("1.3\n1.5\n"), "found 2 DOFs, the matrices have 42"),
        (lambda f: f["dofs"].write_text("1.7\n" * 42), "found '1.7', expected node.direction"),
        (lambda f: f["dofs"].write_text("1.3\n" * 42), "stands there twice"),
        (lambda f: f["nodes"].write_text("1, 0, 0, 0\n"), "has no coordinates"),
        (lambda f: f["M"].write_text("1 1 0.5\n"), "found 1 row, .* has 42"),
        (lambda f: f["K"].write_text("1 1 0.5 7\n"), "4 columns, expected row, column and value"),
        (lambda f: f["K"].write_text("0 0 0.5\n"), "row 0, expected rows from 1 on"),
        (lambda f: f["K"].write_bytes(b"\xff\xfe\x00"), "cannot be read as a matrix"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, change: object, words: str) -> None:
    files = written(tmp_path)
    change(files)  # type: ignore[operator]
    with pytest.raises(gb.UserError, match=words):
        read(files)


def test_half_of_a_matrix_is_not_taken_for_all_of_it(tmp_path: Path) -> None:
    scipy.io.mmwrite(tmp_path / "half.mtx", sp.triu(sp.csr_matrix(np.array([[2.0, -1.0], [-1.0, 2.0]]))))
    with pytest.raises(gb.UserError, match="one side of the diagonal only"):
        gb.read_structure(tmp_path / "half.mtx", tmp_path / "half.mtx", units="m-kg-s")


SCENES = PROJECT / "cases" / "scenes"
Edit = Callable[[Any, list[str], dict[str, Any]], tuple[Any, list[str], dict[str, Any]]]


def renamed(change: Callable[[list[str]], list[str]]) -> Edit:
    return lambda K, labels, places: (K, change(labels), places)


def moved(change: Callable[[Any], Any]) -> Edit:
    return lambda K, labels, places: (
        K,
        labels,
        dict(zip(places, change(np.array(list(places.values()))), strict=True)),
    )


def grounded(K: Any, labels: list[str], places: dict[str, Any]) -> tuple[Any, list[str], dict[str, Any]]:
    """Add springs of other sizes along all directions at each node."""
    along = [float(one.partition(".")[2] in "123") for one in labels]
    return K + sp.diags(np.geomspace(0.01, 3.0, K.shape[0]) * along * K.diagonal()), labels, places


def cut(K: Any, labels: list[str], places: dict[str, Any]) -> tuple[Any, list[str], dict[str, Any]]:
    """Leave out the rows of the first two nodes, as an export of a clamped model does."""
    kept = [i for i, one in enumerate(labels) if one.partition(".")[0] not in ("1", "2")]
    return K.tocsr()[kept][:, kept], [labels[i] for i in kept], places


def rounded(K: Any, labels: list[str], places: dict[str, Any]) -> tuple[Any, list[str], dict[str, Any]]:
    return sp.csr_matrix(np.vectorize(lambda x: float(f"{x:.4e}"))(K.toarray())), labels, places


SLIPS: dict[str, Edit] = {
    "directions swapped": renamed(
        lambda rows: [re.sub(r"\.([13])$", lambda m: f".{4 - int(m[1])}", one) for one in rows]
    ),
    "directions shifted": renamed(lambda rows: [rows[3 * (i // 3) + (i + 1) % 3] for i in range(len(rows))]),
    "backward": renamed(lambda rows: rows[::-1]),
    "direction by direction": renamed(lambda rows: sorted(rows, key=lambda one: one[::-1])),
    "nodes in another order": renamed(
        lambda rows: [one for k in range(3) for i in range(k, len(rows) // 3, 3) for one in rows[3 * i : 3 * i + 3]]
    ),
    "places in another order": moved(lambda X: np.roll(X, 5, axis=0)),
    "axes of the places swapped": moved(lambda X: X[:, ::-1]),
}
RIGHT: dict[str, Edit] = {
    "as it is": lambda *given: given,
    "on springs": grounded,
    "clamped in the export": cut,
    "five digits": rounded,
    "another origin": moved(lambda X: X + 1e4),
}  # fmt: skip


def order_checked(stem: str, edit: Edit) -> None:
    """Check a shipped frame of beams or a solid, in m, after a change."""
    table = np.loadtxt(SCENES / f"{stem}.sti")
    i, j = table[:, :2].astype(int).T - 1
    upper = sp.csr_matrix((table[:, 2], (i, j)))
    K = upper + upper.T - sp.diags(upper.diagonal())
    labels = (SCENES / f"{stem}.dof").read_text().split()
    places = read_nodes(SCENES / f"{stem}.inp").places
    K, labels, places = edit(
        K, labels, {one: places[one] for one in dict.fromkeys(r.partition(".")[0] for r in labels)}
    )
    rows = Rows(labels, None, 1.0, True)
    check_order(K, rows.of_node, np.array([places[one] for one in rows.of_node]), 0.0)


@pytest.mark.parametrize("stem", ["rack", "arm"])
@pytest.mark.parametrize("slip", SLIPS)
def test_rows_in_another_order_are_refused(stem: str, slip: str) -> None:
    """Slips that keep some translation, and those of frames, whose nodes also rotate."""
    with pytest.raises(gb.UserError, match="not in the order of the matrices"):
        order_checked(stem, SLIPS[slip])


@pytest.mark.parametrize("stem", ["rack", "arm"])
@pytest.mark.parametrize("right", RIGHT)
def test_rows_in_their_order_are_taken(stem: str, right: str) -> None:
    order_checked(stem, RIGHT[right])


@pytest.mark.parametrize("change", [lambda X: 1e-3 * X, lambda X: -X], ids=["another unit", "another sign"])
def test_places_of_a_frame_that_do_not_fit_are_refused(change: Callable[[Any], Any]) -> None:
    with pytest.raises(gb.UserError, match="rotations have another sign or unit"):
        order_checked("rack", moved(change))


DRIVES: dict[str, Callable[[Any, Any], Any]] = {
    "sign": lambda K, _: -1e-5 * K,
    "one direction": lambda K, M: 1e-5 * K - 3.0 * sp.diags(np.eye(M.shape[0])[2]) * M.diagonal()[2],
    "far less than K": lambda K, M: 1e-9 * K - 1e-6 * M,
}
TAKES: dict[str, Callable[[Any, Any], Any]] = {
    "Rayleigh": lambda K, M: 1e-5 * K + 2.0 * M,
    "of strains alone": lambda K, _: 1e-5 * K,
    "none": lambda K, _: 0.0 * K,
    "gyroscopic": lambda K, _: sp.triu(K, 1) - sp.triu(K, 1).T,
    "of one direction": lambda K, _: sp.diags(np.eye(K.shape[0])[4]),
}


@pytest.mark.parametrize("damping", [*DRIVES, *TAKES])
@pytest.mark.parametrize("suffix", ["npz", "mtx", "npy"])
def test_a_damping_that_drives_a_motion_is_refused(tmp_path: Path, damping: str, suffix: str) -> None:
    """Such motions grow without a word; matrices that take energy, or none, are read."""
    files = written(tmp_path)
    plain = read(files)
    C = sp.csr_matrix((DRIVES | TAKES)[damping](plain.K, plain.M))
    path = tmp_path / f"C.{suffix}"
    if suffix == "mtx":
        scipy.io.mmwrite(path, C, symmetry="general")
    elif suffix == "npz":
        sp.save_npz(path, C)
    else:
        np.save(path, C.toarray())
    if damping in TAKES:
        assert abs(read(files, damping=path).C - C).max() <= 1e-12 * max(abs(C).max(), 1e-300)
        return
    with pytest.raises(gb.UserError, match="C that drives a motion"):
        read(files, damping=path)
