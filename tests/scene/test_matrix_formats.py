"""Structures written in the formats of other programs and read again: every bit, or the digits that a format has."""

from __future__ import annotations

import logging
import re
import sys
import types
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import gapbeam as gb

SECTION, STEEL = gb.section("rectangle", 0.01), gb.material(2.1e11, 7850.0)
DIGITS = {"mtx": 0.0, "npz": 0.0, "coordinate": 1e-13, "matrix-input": 1e-13, "dmig": 5.01e-10}
NODES = 9


def beam(damped: bool = False) -> gb.Structure:
    """Return a free beam; with damping in proportion to its stiffness."""
    one = gb.beam(1.0, SECTION, STEEL, {}, elements=NODES - 1)
    M, K = (np.tril(A) + np.tril(A, -1).T for A in (one.M, one.K))  # symmetric to the last bit
    return gb.Structure(M, K, 1e-5 * K if damped else None, rigid=one.rigid)


def labels() -> list[str]:
    return [f"{node}.{way}" for node in range(1, NODES + 1) for way in (3, 5)]


@pytest.mark.parametrize("format_", DIGITS)
def test_formats_hold_their_digits(tmp_path: Path, format_: str, caplog: pytest.LogCaptureFixture) -> None:
    """Every entry of M, C and K comes back within the digits of the format; DMIG warns."""
    one = beam(damped=True)
    with caplog.at_level(logging.WARNING, "gapbeam"):
        files = gb.write_structure(one, tmp_path / "beam", format_, labels())
    assert ("ten digits" in caplog.text) == (format_ == "dmig")
    found = gb.read_structure(files["stiffness"], files["mass"], damping=files["damping"], units="m-kg-s")
    for A, B in ((found.M, one.M), (found.K, one.K), (found.C, one.C)):
        difference = np.abs(A.toarray() - sp.csr_matrix(B).toarray())
        assert np.all(difference <= DIGITS[format_] * np.abs(sp.csr_matrix(B).toarray()))


@pytest.mark.parametrize("format_", ["matrix-input", "dmig"])
def test_files_name_their_rows(tmp_path: Path, format_: str) -> None:
    """Rows come by their names, sorted: a point by node and direction needs no file of DOFs, only coordinates."""
    one, order = beam(), np.random.default_rng(1).permutation(2 * NODES)
    mixed = gb.Structure(one.M[order][:, order], one.K[order][:, order])
    files = gb.write_structure(mixed, tmp_path / "beam", format_, [labels()[i] for i in order])
    nodes = tmp_path / "nodes.txt"
    nodes.write_text("".join(f"{i + 1} {i / (NODES - 1)} 0 0\n" for i in range(NODES)))
    points = {
        "tip": {"node": NODES, "direction": [0, 0, 2.0]},
        "down": {"nearest": [0.99, 0.1, 0.0], "direction": [0, 0, -1]},
    }
    found = gb.read_structure(files["stiffness"], files["mass"], units="m-kg-s", nodes=nodes, points=points)
    row = np.zeros(2 * NODES)
    row[labels().index(f"{NODES}.3")] = 1.0
    assert np.array_equal(found["tip"].rows[0], row)
    assert np.array_equal(found["down"].rows[0], -row)
    assert np.abs(found.K.toarray() - one.K).max() <= 1e-9 * np.abs(one.K).max()


def test_two_matrices_of_one_dmig_file(tmp_path: Path) -> None:
    """K and M of a punch file are found by their names, columns without mass are zero; short fields and commas."""
    punch = tmp_path / "model.pch"
    punch.write_text(
        "$ a comment\nDMIG    KAAX           0       6       2       0\n"
        "DMIG    KAAX           1       3               1       32.5+3\n"
        "DMIG,KAAX,2,3,,2,3,1.D3\n"
        "DMIG    MAAX           0       6       2       0\n"
        "DMIG    MAAX           1       3               1       3    0.25\n"
        "ENDDATA\n"
    )
    files = pytest.importorskip("gapbeam.solver.scene.structure_files")
    K, M = (files.read_matrix(punch, what) for what in ("stiffness", "mass"))
    (K, M), rows = files.aligned([K, M])
    assert rows == ["1.3", "2.3"]
    assert np.array_equal(K.toarray(), np.diag([2500.0, 1000.0]))
    assert np.array_equal(M.toarray(), np.diag([0.25, 0.0]))


def punched(entries: list[tuple[int, int, str]], name: str = "KAAX", number: int = 2, form: int = 6) -> str:
    """Return DMIG with a column for each entry (row, column, fields of its value)."""
    lines = [f"DMIG    {name:<8}{0:>8}{form:>8}{number:>8}{0:>8}"]
    return "\n".join(lines + [f"DMIG,{name},{j},1,,{i},1,{value}" for i, j, value in entries]) + "\n"


WHOLE = [(1, 1, "2.0"), (2, 1, "-1.0"), (1, 2, "-1.0"), (2, 2, "2.0")]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("whole.pch", punched(WHOLE), "2 entries twice"),
        ("twice.pch", punched([*WHOLE[::3], (2, 2, "2.0")], form=1), "1 entry twice"),
        ("whole.sti", "".join(f"{i} {j} {value}\n" for i, j, value in WHOLE), "2 entries twice"),
        ("twice.mtx", "1 1 2.0\n1 2 1.0\n2 1 1.0\n2 2 2.0\n2 2 2.0\n", "1 entry twice"),
        ("complex.pch", punched([(1, 1, "2.0,0.1"), (2, 2, "2.0,0.1"), (3, 3, "2.0,0.1")], number=4), "complex"),
        (
            "complex.mtx",
            "%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 2.0 0.1\n",
            "found complex entries",
        ),
        ("other.pch", punched(WHOLE[::3], "MAAX"), "the matrices MAAX, expected one whose name begins with K"),
        ("many.pch", punched(WHOLE[::3]) + punched(WHOLE[::3], "KBBX"), "the matrices KAAX, KBBX, expected one"),
    ],
)
def test_matrices_that_would_be_misread_are_refused(tmp_path: Path, name: str, text: str, words: str) -> None:
    """Both triangles where one stands for both were added, a complex matrix and the mass were read as the stiffness."""
    (tmp_path / name).write_text(text)
    with pytest.raises(gb.UserError, match=words):
        gb.read_structure(tmp_path / name, tmp_path / name, units="m-kg-s")


@pytest.mark.parametrize("suffix", [".op2", ".op4"])
def test_matrices_through_pyyeti(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All matrices are asked for, by pyyeti's own names: one of several by its letter; of superelements none."""
    held = {"KAA": [np.diag([2.0, 3.0])], "MAA": [np.eye(2)], "BAA": [np.eye(2), np.eye(2)]}

    class File:
        """A stand-in for the reader of output2."""

        def __init__(self, path: str) -> None:
            assert Path(path).exists()

        def __enter__(self) -> File:
            return self

        def __exit__(self, *_: object) -> None:
            return

        def rdop2mats(self, which: str) -> dict[str, list[np.ndarray]]:
            assert which == "all"
            return held

    def load(_: str, into: str, sparse: bool) -> tuple[list[str], list[sp.coo_matrix], list[int], list[int]]:
        assert (into, sparse) == ("list", True)
        flat = [(key.lower(), sp.coo_matrix(one)) for key, many in held.items() for one in many]
        return [key for key, _ in flat], [one for _, one in flat], [6] * len(flat), [2] * len(flat)

    op2, op4 = types.ModuleType("op2"), types.ModuleType("op4")
    op2.OP2, op4.load = File, load  # type: ignore[attr-defined]
    nastran = types.ModuleType("pyyeti.nastran")
    nastran.op2, nastran.op4 = op2, op4  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pyyeti", types.ModuleType("pyyeti"))
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", nastran)
    path = tmp_path / f"model{suffix}"
    path.touch()
    assert gb.read_structure(path, path, units="m-kg-s").K.toarray().tolist() == [[2.0, 0.0], [0.0, 3.0]]
    with pytest.raises(
        gb.UserError, match=r"(?i)the matrices KAA, MAA, BAA, BAA, expected one whose name begins with B"
    ):
        gb.read_structure(path, path, damping=path, units="m-kg-s")


@pytest.mark.parametrize("kind", [".npz", ".npy", ".mtx", ".sti"])
def test_a_damaged_file_is_refused_in_words(tmp_path: Path, kind: str) -> None:
    """Cut off, or with bytes that changed: no error but a refusal, and binary files are never read cut."""
    A, path = sp.csr_matrix(beam().K), tmp_path / f"k{kind}"
    if kind == ".npz":
        sp.save_npz(path, A)
    elif kind == ".npy":
        np.save(path, A.toarray())
    elif kind == ".mtx":
        scipy.io.mmwrite(path, A)
    else:
        upper = sp.coo_matrix(sp.triu(A))
        np.savetxt(path, np.column_stack([upper.row + 1, upper.col + 1, upper.data]), fmt=["%d", "%d", "%.9e"])
    held, rng = path.read_bytes(), np.random.default_rng(len(kind))
    files = pytest.importorskip("gapbeam.solver.scene.structure_files")
    for size in (0, 1, 3, *rng.integers(4, len(held) - 2, 40)):
        path.write_bytes(held[:size])
        if size > {".sti": 3, ".mtx": len(held) - 40}.get(kind, size):
            continue  # text without an end
        with pytest.raises(gb.UserError, match=re.escape(str(path))):
            files.read_matrix(path, "stiffness")
    for place in rng.integers(0, len(held), 0 if kind == ".mtx" else 40):  # SciPy crashes on some
        path.write_bytes(held[:place] + bytes([held[place] ^ 0x55]) + held[place + 1 :])
        with suppress(gb.UserError):
            files.read_matrix(path, "stiffness")


@pytest.mark.parametrize("end", ["1 1 5E", "1 1 5e-", "1 1 -"])
def test_a_matrix_market_file_that_ends_in_a_number_is_refused(end: str, tmp_path: Path) -> None:
    """SciPy crashes on some."""
    path = tmp_path / "k.mtx"
    path.write_text(f"%%MatrixMarket matrix coordinate real general\n1 1 1\n{end}")
    with pytest.raises(gb.UserError, match="cut off"):
        gb.read_structure(path, path, units="m-kg-s")


def test_sets_of_input_files(tmp_path: Path) -> None:
    """Clamped nodes and mean motions by the sets of an input file; elements are no nodes."""
    one = beam()
    files = gb.write_structure(one, tmp_path / "beam", "matrix-input", labels())
    nodes = tmp_path / "beam.inp"
    lines = [f"{i + 1}, {i / (NODES - 1)}, 0., 0." for i in range(NODES)]
    text = ["*HEADING", "*NODE, NSET=ALL", *lines, "*ELEMENT, TYPE=B31", "1, 7, 8, 9", "*NSET, NSET=Root", "1"]
    text += ["*NSET, NSET=END, GENERATE", f"{NODES - 1}, {NODES}, 1", "*NSET, NSET=BOTH", "Root, END"]
    nodes.write_text("\n".join(text) + "\n")
    found = gb.read_structure(
        files["stiffness"], files["mass"], units="m-kg-s", nodes=nodes, clamped=["ROOT"],
        points={"end": {"set": "end", "direction": [0, 0, 1]}}, frame=[0, 0, 1],
    )  # fmt: skip
    assert found.size == 2 * NODES - 2
    assert found["end"].rows[0, [-4, -2]] == pytest.approx([0.5, 0.5])
    assert float(found.frame["end"][0]) == pytest.approx(1.0)
    held = gb.beam(1.0, SECTION, STEEL, {}, elements=NODES - 1, clamped=[0.0])
    assert np.linalg.eigvalsh(found.K.toarray())[0] == pytest.approx(np.linalg.eigvalsh(held.K)[0], rel=1e-9)


def test_modes_of_a_file(tmp_path: Path) -> None:
    """A cantilever as its own modes in CSV: static deflection at the tip as of the matrices, to the modes kept."""
    held = gb.beam(1.0, SECTION, STEEL, {"tip": 1.0}, elements=8, clamped=[0.0])
    squares, _, X = held.modes
    shapes, part = held["tip"].rows @ X, X.T @ held.inertia
    table = np.column_stack([np.sqrt(squares) / (2 * np.pi), np.full(len(squares), 0.02), shapes[0], part])
    path = tmp_path / "modes.csv"
    np.savetxt(path, table, delimiter=",", header="frequency, damping, tip, frame", comments="", fmt="%.17e")
    found = gb.read_modes(path, "arm")
    b = found["tip"].rows
    static = held["tip"].rows @ np.linalg.solve(held.K, held["tip"].rows.T)
    assert (b @ np.linalg.solve(found.K, b.T))[0, 0] == pytest.approx(static[0, 0], rel=1e-10)
    assert gb.weight(found, 9.81).pattern == pytest.approx(gb.weight(held, 9.81).pattern @ X, rel=1e-9, abs=1e-12)
    assert np.diag(found.C) == pytest.approx(0.04 * np.sqrt(squares))


def test_files_that_spreadsheets_save_are_read(tmp_path: Path) -> None:
    """They begin with a mark of the byte order, which is no part of the first name."""
    mark = "\ufeff"
    (tmp_path / "modes.csv").write_text(f"{mark}frequency,tip\r\n3.0,1.5\r\n")
    assert gb.read_modes(tmp_path / "modes.csv")["tip"].rows.tolist() == [[1.5]]
    for name in ("k", "m"):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", scipy.sparse.eye(4))
    (tmp_path / "dofs.txt").write_text(f"{mark}1.1\n1.2\n2.1\n2.2\n")
    for name, text in (("nodes.txt", "1 0 0 0\n2 1 0 0\n"), ("nodes.inp", "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n")):
        (tmp_path / name).write_text(mark + text)
        files = {"dofs": tmp_path / "dofs.txt", "nodes": tmp_path / name}
        found = gb.read_structure(tmp_path / "k.mtx", tmp_path / "m.mtx", units="m-kg-s", **files)
        assert found.geometry is not None
        assert found.geometry.places.tolist() == [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("damping,tip\n0.1,1\n", "expected one called frequency"),
        ("frequency,tip\n", "found 1 line,"),
        ("frequency\n1.0\n", "no points"),
        ("frequency,tip\n1.0\n", "found 1 value for mode 1, expected 2"),
        ("frequency,tip\n1.0,1.0\n2.0,x\n", "tip of mode 2: found 'x'"),
        ("frequency,tip\n-1.0,1\n", "frequencies from 0 on"),
        ("frequency,tip.3\n1.0,1\n", "its motions .1 and .2"),
        ("frequency,tip,tip\n1.0,1,1\n", "twice"),
        (",frequency,tip\n0,1.0,1\n", "no name"),
        ("frequency,tip\n1.0,nan\n", "finite"),
    ],
)
def test_damaged_modes_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "modes.csv"
    path.write_text(text)
    with pytest.raises(gb.UserError, match=words):
        gb.read_modes(path)


UNITS = (
    "    -1\n   164\n         1                  mm         1\n"
    + f"{1e3:25.16E}{1.0:25.16E}{1.0:25.16E}\n{0.0:25.16E}\n    -1\n"
)


def universal(modes: list[tuple[float, float, dict[int, list[float]]]], head: str = "1 2 2 8 2 3") -> str:
    """Return data sets 55 of modes: frequency, modal mass, and displacements (x, y, z) by node."""
    text = ""
    for number, (frequency, modal_mass, nodes) in enumerate(modes, 1):
        text += "    -1\n    55\n" + "a line of text\n" * 5
        text += "".join(f"{int(word):10d}" for word in head.split()) + f"\n{2:10d}{4:10d}{1:10d}{number:10d}\n"
        text += f"{frequency:13.5E}{modal_mass:13.5E}{0.01:13.5E}{0.02:13.5E}\n"
        for node, values in nodes.items():
            text += f"{node:10d}\n" + "".join(f"{value:13.5E}" for value in values) + "\n"
        text += "    -1\n"
    return text


@pytest.mark.parametrize("units", ["", UNITS])
def test_modes_of_a_universal_file(tmp_path: Path, units: str) -> None:
    """A cantilever as its modes, of any modal mass: static deflections as of its matrices, to the five digits there."""
    held = gb.beam(1.0, SECTION, STEEL, {"tip": 1.0, "mid": 0.5}, elements=8, clamped=[0.0])
    squares, _, X = held.modes
    tip, mid = held["tip"].rows @ X, held["mid"].rows @ X
    scales = np.linspace(0.5, 3.0, len(squares))  # roots of modal masses, kg
    modes = [
        (np.sqrt(square) / (2 * np.pi), scale**2 * (1e-3 if units else 1.0),
         {12: [0.0, 0.0, tip[0, i] * scale], 7: [0.0, 0.5, mid[0, i] * scale]})
        for i, (square, scale) in enumerate(zip(squares, scales, strict=True))
    ]  # fmt: skip
    path = tmp_path / "arm.unv"
    path.write_text(units + universal(modes))
    found = gb.read_modes(path, "arm")
    for one, other in (("12z", "tip"), ("7z", "mid")):
        b, a = found[one].rows, held[other].rows
        assert (b @ np.linalg.solve(found.K, b.T))[0, 0] == pytest.approx(
            (a @ np.linalg.solve(held.K, a.T))[0, 0], rel=1e-4
        )
    assert np.diag(found.C) == pytest.approx(0.04 * np.sqrt(squares), rel=1e-4)
    assert list(found.points) == ["12x", "12y", "12z", "7x", "7y", "7z"]
    space = gb.read_modes(path, points=["7", "12xz"])
    assert [space[name].rows.shape[0] for name in ("7", "12xz")] == [3, 2]
    with pytest.raises(
        gb.UserError, match=r"no point 9x, expected a node .* such as 12x, 12xz, or 12 in space; nodes: 12, 7"
    ):
        gb.read_modes(path, points=["9x"])


def test_a_file_takes_the_nodes_that_it_names(tmp_path: Path) -> None:
    """Points of pairs and loads, and no others; a node that is not there is refused by the nodes that are."""
    (tmp_path / "arm.UNV").write_text(universal([(10.0, 4.0, {3: [2.0, 0.0, 1.0], 5: [0.0, 0.0, 1.0]})]))
    file = tmp_path / "arm.toml"
    text = """
        [[structure]]
        name = "arm"
        model = { type = "modes", file = "arm.UNV" }
        [[pair]]
        name = "pin"
        between = ["arm.3xz"]
        region = { type = "disc", clearance = 1e-3 }
        law = { type = "kelvin-voigt", stiffness = 1e4 }
        [[load]]
        type = "constant_force"
        point = "arm.5z"
        amplitude = 1.0
        [time]
        step = 1e-3
        end = 0.1
    """
    file.write_text(text)
    scene = gb.scene(file)
    assert list(scene.structures[0].points) == ["3xz", "5z"]
    assert scene.structures[0]["3xz"].rows[:, 0] == pytest.approx([1.0, 0.5])
    file.write_text(text.replace("arm.5z", "arm.4z"))
    with pytest.raises(gb.CaseError, match="no point 4z"):
        gb.scene(file)


ONE = [(10.0, 1.0, {3: [1.0, 0.0, 0.0]})]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no data set between lines of -1"),
        (UNITS, r"found data sets 164, expected a data set 55 \(data at nodes\)"),
        (universal(ONE, "1 3 2 8 5 3"), "complex modes; expected normal modes"),
        (universal(ONE, "1 4 2 8 2 3"), "a transient; expected normal modes"),
        (universal(ONE, "1 2 2 8 5 3"), "complex shapes; expected real ones"),
        (universal(ONE, "1 2 2 12 2 3"), "data of type 12; expected displacements"),
        (universal(ONE, "1 2 2 8 2 1"), "1 number each; expected the nodes of the first mode"),
        (universal([(10.0, 0.0, ONE[0][2])]), "the modal mass 0; expected one above 0"),
        (universal([*ONE, (20.0, 1.0, {4: [1.0, 0.0, 0.0]})]), "number 2: found 1 node"),
        (universal([(10.0, 1.0, {})]), "found 0 nodes"),
        (universal(ONE).replace("  1.00000E+01", "    frequency"), "'frequency' in line 10, column 1"),
        (universal(ONE)[:-7], "has no end, -1"),
        (universal([(float("inf"), 1.0, ONE[0][2])]), "'INF' in line 10"),
        (
            UNITS.replace("1.0", "0.0") + universal(ONE),
            "the factors 0 of lengths and 0 of forces; expected factors above 0",
        ),
        (universal(ONE).replace("    55", "   55b"), "found the binary data set 55b"),
    ],
)
def test_damaged_universal_modes_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "modes.uff"
    path.write_text(text)
    with pytest.raises(gb.UserError, match=words):
        gb.read_modes(path)


def test_what_cannot_be_written_or_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(gb.UserError, match="expected one of mtx, npz"):
        gb.write_structure(beam(), tmp_path / "beam", "op4")
    with pytest.raises(gb.UserError, match="expected 18"):
        gb.write_structure(beam(), tmp_path / "beam", "dmig", ["1.1"])
    with pytest.raises(gb.UserError, match=r"expected node\.direction"):
        gb.write_structure(beam(), tmp_path / "beam", "dmig", [f"n{i}.1" for i in range(18)])
    (tmp_path / "model.op4").write_bytes(b"")
    with pytest.raises(gb.UserError, match="pyyeti"):
        gb.read_structure(tmp_path / "model.op4", tmp_path / "model.op4", units="m-kg-s")


def test_archives_of_numpy_hold_both_matrices(tmp_path: Path) -> None:
    """Arrays of `numpy.savez` by the letters of their names; points may be rows of a sparse matrix."""
    one = beam()
    np.savez(tmp_path / "both.npz", K=sp.csr_matrix(one.K).toarray(), Maa=sp.csr_matrix(one.M).toarray())
    found = gb.read_structure(tmp_path / "both.npz", tmp_path / "both.npz", units="m-kg-s")
    assert abs(found.K - sp.csr_matrix(one.K)).max() == 0.0
    assert abs(found.M - sp.csr_matrix(one.M)).max() == 0.0
    row = sp.csr_matrix(([1.0, -0.5], ([0, 0], [0, 2])), (1, one.size))
    assert gb.Structure(one.M, one.K, points={"a": row})["a"].rows.tolist() == row.toarray().tolist()
    np.savez(tmp_path / "both.npz", C=sp.csr_matrix(one.K).toarray(), other=np.eye(2))
    with pytest.raises(gb.UserError, match="the matrices C, other, expected one whose name begins with K"):
        gb.read_structure(tmp_path / "both.npz", tmp_path / "both.npz", units="m-kg-s")
