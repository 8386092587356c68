"""Files of several structures: the scene that they say, and every slip refused by the key that it is in."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import gapbeam as gb
from gapbeam.solver.case.reading.case_reader import read_tables
from gapbeam.solver.kernel.kernel_data import kernel_data
from gapbeam.solver.scene_file.scene_reader import ReadScene, read_scene
from gapbeam.studies.identification.identification_file import Identification
from gapbeam.studies.optimum.optimum_study import OptimumStudy
from gapbeam.studies.uncertain.uncertain_file import UncertainStudy
from tests.shared.command import PROJECT, called, on_ranks
from tests.shared.slips import Tables, check_slip, put

NODES = 13
STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}
PUSH = {"type": "harmonic_force", "point": "box.at", "amplitude": 5.0, "frequency": 30.0}
LAW = {"type": "kelvin-voigt", "stiffness": 1e6, "damping": 10.0}


def beam(length: float) -> Tables:
    return {"type": "beam", "length": length, "thickness": 0.012, "material": dict(STEEL)}


def solid(folder: Path) -> Tables:
    """Write a free chain of masses that move in x, y and z along a line, held together by springs and bending."""
    n, h = NODES, 0.05
    steps = np.diff(np.eye(n), axis=0)
    bends = np.diff(steps, axis=0)
    along, across = 1e8 * steps.T @ steps, 1e6 * bends.T @ bends
    K, M = np.zeros((3 * n, 3 * n)), np.eye(3 * n) * 0.5
    for way, block in enumerate((along, across, across)):
        K[way::3, way::3] = block
    for name, A in (("K", K), ("M", M)):
        scipy.io.mmwrite(folder / f"{name}.mtx", sp.csr_matrix(A), precision=17, symmetry="general")
    (folder / "rack.dof").write_text("".join(f"{node}.{way}\n" for node in range(1, n + 1) for way in (1, 2, 3)))
    lines = [f"{i + 1}, {h * i}, 0, 0" for i in range(n)]
    (folder / "rack.inp").write_text("\n".join(["*NODE", *lines, "*NSET, NSET=ROOT", "1, 2"]) + "\n")
    files = {"stiffness": "K.mtx", "mass": "M.mtx", "dofs": "rack.dof", "nodes": "rack.inp"}
    return {"type": "matrices", **{key: str(folder / file) for key, file in files.items()}, "units": "m-kg-s"}


def tables(folder: Path) -> Tables:
    """Return a sound file: a beam against matrices, and a mass on the frame."""
    return {
        "structure": [
            {"name": "tube", "model": beam(0.5), "ratio": 0.01},
            {"name": "rack", "model": solid(folder), "frame": [0.0, 0.0, 1.0]},
            {"name": "box", "model": {"type": "mass", "mass": 2.0, "stiffness": 1e4}},
        ],
        "point": [
            {"name": "tip", "structure": "tube", "at": 0.5},
            {"name": "end", "structure": "rack", "node": NODES, "direction": [0.0, 0.0, 1.0]},
            {"name": "mid", "structure": "rack", "dof": "7.3"},
        ],
        "joint": [
            {"type": "clamped", "structure": "tube", "at": 0.0},
            {"type": "clamped", "structure": "rack", "nodes": "ROOT"},
            {"type": "elastic", "between": ["rack.mid", "box.at"], "stiffness": 1e5, "damping": 1.0},
        ],
        "contact": {"law": dict(LAW)},
        "pair": [
            {"name": "gap", "between": ["tube.tip", "rack.end"], "region": {"type": "slot", "clearance": 1e-5}},
            {"name": "stop", "between": ["box.at"], "region": {"type": "half-plane", "clearance": 1e-5}},
        ],
        "load": [
            {"type": "harmonic_force", "name": "shaker", "point": "tube.tip", "amplitude": 5.0, "frequency": 30.0},
            {"type": "gravity"},
            {"type": "base_motion", "structure": "rack", "amplitude": 3.0, "frequency": 50.0},
        ],
        "time": {"step": 1e-4, "end": 0.05},
        "start": {"state": "seat"},
    }


def test_a_file_is_the_scene_that_python_makes(tmp_path: Path) -> None:
    """The same structures, contacts, loads and start from public nouns: the same motion to the last digits."""
    given = tables(tmp_path)
    outcome = gb.run(given, output=tmp_path / "results")
    assert outcome.exit_status == 0
    scene = gb.scene(given)
    section, steel = gb.section("rectangle", 0.012), gb.material(2.1e11, 7850.0)
    tube = gb.beam(0.5, section, steel, {"tip": 0.5}, clamped=[0.0], ratio=0.01, name="tube")
    files = given["structure"][1]["model"]
    rack = gb.read_structure(
        files["stiffness"], files["mass"], dofs=files["dofs"], nodes=files["nodes"], units="m-kg-s", clamped=[1, 2],
        points={"end": f"{NODES}.3", "mid": "7.3"}, frame=[0, 0, 1], name="rack",
    )  # fmt: skip
    box = gb.mass(2.0, stiffness=1e4, name="box")
    law = gb.KelvinVoigt(stiffness=1e6, damping=10.0)
    own = gb.Scene(
        tube, rack, box,
        contacts=[
            gb.Contact((tube["tip"], rack["end"]), gb.Slot(1e-5), law, name="gap"),
            gb.Contact(box["at"], gb.HalfPlane(1e-5), law, name="stop"),
        ],
        loads=[
            gb.Force(tube["tip"], lambda t: 5.0 * np.sin(60.0 * np.pi * t)),
            *(gb.weight(one, -9.81) for one in (tube, rack, box)),
            gb.BaseMotion(rack, lambda t: 3.0 * np.sin(100.0 * np.pi * t)),
        ],
        joints=[gb.Joint((rack["mid"], box["at"]), 1e5, 1.0)],
    )  # fmt: skip
    ends = [gb.history(one, 1e-4, 0.05, gb.seat(one)) for one in (scene, own)]
    for name, x in ends[1].displacement.items():
        assert np.abs(ends[0].displacement[name] - x).max() <= 1e-9 * np.abs(x).max()
    assert np.abs(ends[1].force["gap"]).max() > 0.0
    described = gb.check(given)
    assert described.seated
    assert "rack.end" in str(described)


def box(stiffness: float, *loads: Tables, clearance: float = 1e-5, **law: Any) -> ReadScene:
    """Return the file of a mass of 2 kg on 1e4 N/m, 11.25 Hz, beside a stop, without a step."""
    return read_scene({
        "structure": [{"name": "box", "model": {"type": "mass", "mass": 2.0, "stiffness": 1e4}}],
        "pair": [{"name": "stop", "between": ["box.at"], "region": {"type": "half-plane", "clearance": clearance},
                  "law": {"type": "kelvin-voigt", "stiffness": stiffness} | law}],
        "load": list(loads),
        "time": {"end": 1.0},
    })  # fmt: skip


@pytest.mark.parametrize(
    ("read", "step", "words"),
    [
        (lambda: box(4e5), np.pi * np.sqrt(2.0 / 4e5) / 20, "contact of 0.00702 s at stop"),
        (lambda: box(1e7), 2 * np.pi * np.sqrt(2.0 / 1e4) / 50, "11.25 Hz, the frequency of box"),
        (lambda: box(1e9, PUSH), 1 / 50 / 150, "150 Hz, 5 times the highest forcing frequency"),
        (
            lambda: box(1e6, PUSH, type="hunt-crossley", exponent=2.0),
            np.pi * np.sqrt(2.0 / (3e6 * 1e-7)) / 20,
            "150 Hz",
        ),
        (
            lambda: box(1e6, type="hunt-crossley", clearance=0.0),
            2 * np.pi * np.sqrt(2.0 / 1e4) / 50,
            "the frequency of box",
        ),
    ],
    ids=["contact", "stiff contact", "load", "power law", "power law without a clearance"],
)
def test_a_step_follows_from_loads_modes_and_contacts(read: Any, step: float, words: str) -> None:
    """Twenty steps in a contact in reach of ten times the frequency of interest, fifty in its period."""
    found = read()
    longest = min(step, 1 / 50 / 150) if "150" in words else step
    assert 0.95 * longest < found.step <= longest * (1 + 1e-12)
    assert words in found.reason
    count = (1 / 30 if "150" in words else 1.0) / found.step
    assert count == pytest.approx(round(count)), "the period, or the run, is a whole number of steps"


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e4])
@pytest.mark.parametrize("grounded", [False, True])
@pytest.mark.parametrize("load", [None, 1.0, 1e-3, 20.0])
def test_a_step_resolves_bodies_on_their_joints(scale: float, grounded: bool, load: float | None) -> None:
    """A chain of three masses: its second frequency, unless it is rigid beside the frequencies of the loads."""
    masses, springs = [2.0 * scale, 1.0 * scale, 0.5 * scale], [3e4 * scale, 5e4 * scale]
    K = np.zeros((3, 3))
    for i, k in enumerate(springs):
        K[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[0, 0] += 1e4 * scale * grounded
    values = np.linalg.eigvals(K / np.array(masses)[:, None]).real
    second = np.sort(np.sqrt(values[values > 1e-3 * values.max()]))[1] / (2.0 * np.pi)
    ends = [["m0.at", "m1.at"], ["m1.at", "m2.at"], *([["m0.at"]] if grounded else [])]
    given: Tables = {
        "structure": [{"name": f"m{i}", "model": {"type": "mass", "mass": one}} for i, one in enumerate(masses)],
        "joint": [{"type": "elastic", "name": f"s{i}", "between": end, "stiffness": k}
                  for i, (end, k) in enumerate(zip(ends, [*springs, 1e4 * scale], strict=False))],
        "time": {"end": 1.0},
    }  # fmt: skip
    frequency = 0.0 if load is None else 5.0 * load * second
    if load is not None:
        given["load"] = [{"type": "harmonic_force", "point": "m2.at", "amplitude": 1.0, "frequency": load * second}]
    interest = frequency if second >= 10.0 * frequency > 0.0 else max(second, frequency)
    span = 1.0 if load is None else min(1.0, 1.0 / (load * second))
    found = read_scene(given)
    count = 50.0 * interest * span
    assert span / (count + 1.01) <= found.step <= span / count * (1.0 + 1e-9)
    assert ("the second frequency of m0 and m1 and m2 on elastic joints" in found.reason) == (interest == second)


def test_a_structure_whose_modes_are_not_known_needs_a_step() -> None:
    tube = {"name": "tube", "model": beam(0.5) | {"elements": 2000}}
    joint = {"type": "clamped", "structure": "tube", "at": 0.0}
    with pytest.raises(gb.CaseError, match=r"time\] step(.|\n)*reduce = \{ modes = 40 \}"):
        gb.scene({"structure": [tube], "joint": [joint], "time": {"end": 0.1}})


@pytest.mark.parametrize("reduce", [None, {"modes": 4}])
def test_the_ratio_of_a_structure_is_that_of_modes_that_move(reduce: Tables | None) -> None:
    """A tube that carries five times its mass: each mode of the loaded tube has the ratio."""
    tube = {"name": "tube", "model": beam(0.5), "ratio": 0.02} | ({} if reduce is None else {"reduce": reduce})
    scene = gb.scene({
        "structure": [tube],
        "point": [{"name": "tip", "structure": "tube", "at": 0.5}],
        "joint": [{"type": "clamped", "structure": "tube", "at": 0.0}],
        "mass": [{"point": "tube.tip", "mass": 2.0}, {"point": "tube.tip", "mass": 1.0}],
        "time": {"step": 1e-4, "end": 0.05},
    })  # fmt: skip
    values = gb.eigenvalues(scene)
    stiffness = 3.0 * 2.1e11 * 0.012**4 / 12.0 / 0.5**3
    assert np.abs(values).min() == pytest.approx(np.sqrt(stiffness / (3.0 + 0.236 * 7850.0 * 0.5 * 0.012**2)), rel=2e-3)
    assert -values.real / np.abs(values) == pytest.approx(0.02, rel=1e-6)


def test_a_velocity_is_that_of_all_points() -> None:
    """A free beam that starts at 2 m/s flies on, and two masses exchange their velocities."""
    given: Tables = {
        "structure": [
            {"name": "fly", "model": beam(0.3), "velocity": 2.0},
            {"name": "a", "model": {"type": "mass", "mass": 1.0}, "velocity": 1.0},
            {"name": "b", "model": {"type": "mass", "mass": 1.0}},
        ],
        "point": [{"name": "end", "structure": "fly", "at": 0.3}],
        "pair": [{"name": "hit", "between": ["a.at", "b.at"], "region": {"type": "half-plane", "clearance": 1e-3},
                  "law": {"type": "kelvin-voigt", "stiffness": 1e6}}],
        "time": {"step": 1e-5, "end": 0.01},
    }  # fmt: skip
    scene = gb.scene(given)
    from gapbeam.solver.scene_file.scene_reader import read_scene

    last = gb.history(scene, 1e-5, 0.01, read_scene(given).start()).last
    assert last["end"].displacement == pytest.approx(0.02, rel=1e-9)
    assert last["a.at"].velocity == pytest.approx(0.0, abs=1e-9)
    assert last["b.at"].velocity == pytest.approx(1.0, rel=1e-9)


def changed(file: str, edit: Callable[[np.ndarray], np.ndarray]) -> Callable[[Tables, Path], None]:
    """Return what edits a matrix in its file."""

    def change(_: Tables, folder: Path) -> None:
        A = scipy.io.mmread(folder / file).toarray()
        scipy.io.mmwrite(folder / file, sp.csr_matrix(edit(A)), precision=17, symmetry="general")

    return change


def mixed(_: Tables, folder: Path) -> None:
    order = np.random.default_rng(3).permutation(3 * NODES)
    lines = (folder / "rack.dof").read_text().splitlines()
    (folder / "rack.dof").write_text("\n".join(lines[i] for i in order) + "\n")


def suffixed(given: Tables, folder: Path) -> None:
    (folder / "K.xyz").write_text("1 1 1.0\n")
    given["structure"][1]["model"]["stiffness"] = str(folder / "K.xyz")


def entry(i: int, j: int, value: float) -> Callable[[np.ndarray], np.ndarray]:
    def edit(A: np.ndarray) -> np.ndarray:
        A[i, j] = value
        return A

    return edit


def written(file: str, text: str) -> Callable[[Tables, Path], None]:

    def change(_: Tables, folder: Path) -> None:
        (folder / file).write_text(text)

    return change


SLIPS: dict[str, tuple[Callable[[Tables, Path], None], str, str]] = {
    "half a matrix": (changed("K.mtx", np.triu), "rack.*stiffness", "one side of the diagonal"),
    "half a mass": (changed("M.mtx", lambda A: np.triu(A + np.eye(len(A), k=3))), "rack.*mass", "one side"),
    "unsymmetric": (changed("K.mtx", entry(0, 3, 5e8)), "rack.*stiffness", "differs from its transpose"),
    "no mass": (changed("M.mtx", entry(8, 8, 0.0)), "rack.*mass", r"1 DOFs without mass, the first is 3\.3"),
    "M indefinite": (changed("M.mtx", lambda A: A + 0.6 * (np.eye(39, k=3) + np.eye(39, k=-3))), "rack.*mass",
                     "not positive definite"),
    "K indefinite": (changed("K.mtx", lambda A: A - 1e6 * np.eye(39)), "rack.*stiffness", "negative direction"),
    "a NaN": (changed("K.mtx", entry(0, 0, np.nan)), "rack.*stiffness", "finite"),
    "another size": (changed("M.mtx", lambda A: A[:-1, :-1]), "rack.*mass", "found 38 rows, .* has 39"),
    "no matrix": (written("K.mtx", "hello\n"), "rack.*stiffness", "cannot be read"),
    "no file": (put("structure", 1, "model", "mass", value="none.mtx"), "rack.*mass", "no file"),
    "another suffix": (suffixed, "rack.*stiffness", r"\.xyz\n  expected: \.mtx"),
    "no units": (put("structure", 1, "model", "units", value=None), "rack.*units", "missing"),
    "unknown units": (put("structure", 1, "model", "units", value="inch"), "rack.*units", "mm-t-s"),
    "order of DOFs": (mixed, "rack.*dofs", "not in the order of the matrices"),
    "too few DOFs": (written("rack.dof", "1.1\n1.2\n"), "rack.*dofs", "found 2 DOFs, the matrices have 39"),
    "a DOF twice": (written("rack.dof", "1.1\n" * 39), "rack.*dofs", "twice"),
    "no DOF": (written("rack.dof", "tip\n" * 39), "rack.*dofs", r"node\.direction"),
    "a node without place": (written("rack.inp", "1 0 0 0\n"), "rack.*nodes", "has no coordinates"),
    "no nodes at all": (written("rack.inp", "*HEADING\n"), "rack.*nodes", "no nodes"),
    "a node without rows": (put("point", 1, "node", value=99), '"end"', "node 99, which has no rows"),
    "a DOF without row": (put("point", 2, "dof", value="99.3"), '"mid"', r"'99\.3'\s+expected: a DOF of the matrices"),
    "a clamped DOF": (put("point", 2, "dof", value="1.3"), '"mid"', "is clamped"),
    "no such set": (put("joint", 1, "nodes", value="BASE"), "joint.*number 2", "set: ROOT"),
    "all clamped": (put("joint", 1, "nodes", value=list(range(1, NODES + 1))), "joint.*number 2", "all DOFs"),
    "no place of a point": (put("point", 1, "node", value=None), '"end"', "one of node, set, nearest, dof"),
    "no direction": (put("point", 1, "direction", value=None), '"end".*direction', "the direction"),
    "a direction of 0": (put("point", 1, "direction", value=[0.0, 0.0, 0.0]), '"end"', "length 0"),
    "off the beam": (put("point", 0, "at", value=0.6), '"tip".*at', "beyond the end"),
    "a node of a beam": (put("point", 0, "node", value=3), '"tip".*node', "at: x from its start"),
    "an unknown structure": (put("point", 0, "structure", value="tub"), '"tip".*structure', "did you mean|one of"),
    "an unknown point": (put("pair", 0, "between", value=["tube.tpi", "rack.end"]), '"gap".*between', "tube.tip"),
    "no structure of a point": (put("load", 0, "point", value="tip"), '"shaker".*point', "tube.tip"),
    "a point twice": (put("pair", 0, "between", value=["tube.tip", "tube.tip"]), '"gap".*between', "two different"),
    "two names": (put("pair", 1, "name", value="gap"), '"gap".*name', "different names"),
    "no law": (put("contact", value=None), '"gap".*law', "a law of forces"),
    "overlap": (put("pair", 0, "offset", value=1e-3), '"gap".*region', "overlap by 0.000995 m"),
    "pressed": (put("pair", 1, "region", "clearance", value=-1e-5), '"stop".*region', "interference = true"),
    "a disc for one motion": (put("pair", 0, "region", value={"type": "disc", "clearance": 1e-4}), '"gap".*region',
                              "as many motions"),
    "friction of one motion": (put("pair", 0, "friction", value=0.3), '"gap".*friction', "two or three motions"),
    "a concave polygon": (put("pair", 0, "region", value={"type": "polygon", "corners":
                              [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]}), '"gap".*region', "turn left"),
    "weight without frame": (put("structure", 1, "frame", value=None), "load.*number", "no motion with the frame"),
    "too many modes": (put("structure", 1, "reduce", value={"modes": 500}), "rack.*reduce", "expected: 1 to 32"),
    "a reduced mass": (put("structure", 2, "reduce", value={"modes": 1}), "box.*reduce", "no reduction"),
    "a step beyond the end": (put("time", "step", value=1.0), "time.*step", "longer than the whole run"),
    "a step that jumps over the load": (put("time", "step", value=0.02), "time.*step", "half its period"),
    "an unknown table": (put("support", value={"clearance": 1e-4}), "support", "unknown table"),
    "a support of a case": (put("support", value=[{"clearance": 1e-4}]), "support", r"a \[\[pair\]\] between one"),
    "a probe of a case": (put("probe", value=[{"name": "tip", "point": 0.1}]), "probe", r"a \[\[point\]\] adds one"),
    "a place in another word": (put("figure", value=[{"name": "x", "quantity": "displacement", "place": "tube.tip",
                                                      "point": "tube.tip"}]), "figure.*point", "key `place` has"),
    "a place of nothing": (put("figure", value=[{"name": "x", "quantity": "velocity", "place": "tube.tipp"}]),
                           "figure.*place", "expected"),
    "a component that no point has": (put("figure", value=[{"name": "x", "quantity": "velocity", "place": "tube.tip",
                                                            "component": "x"}]), "figure.*component", "one of y"),
    "an unknown load": (put("load", 0, "type", value="exciter"), '"shaker".*type', "harmonic_force"),
    "a wall without bore": (put("structure", 0, "model", "section", value={"type": "tube", "wall": 0.2}),
                            "tube.*section.*wall", "half of the diameter"),
    "a wide circle": (put("structure", 0, "model", value={**beam(0.5), "width": 0.1, "section": {"type": "round"}}),
                      "tube.*section", "both the outer diameter"),
    "a seat in flight": (put("structure", 0, "velocity", value=1.0), "tube.*velocity", "at rest"),
    "a seat in flight in space": (lambda given, _: given["structure"][0].update(velocity=[0.0, 0.0, 1.0], place={}),
                                  "tube.*velocity", "at rest"),
}  # fmt: skip


def inward(given: Tables, folder: Path) -> None:
    """Make a pair of two racks whose normal points away from the second."""
    given["structure"].append({"name": "wall", "model": solid(folder)})
    given["point"] += [
        {"name": "side", "structure": "rack", "node": 5, "direction": [1.0, 0.0, 0.0]},
        {"name": "side", "structure": "wall", "node": 9, "direction": [1.0, 0.0, 0.0]},
    ]
    region = {"type": "half-plane", "clearance": 1e-3, "normal": -1}
    given["pair"].append({"name": "bump", "between": ["rack.side", "wall.side"], "region": region})
    given["load"] = given["load"][:1]


def skewed(given: Tables, folder: Path) -> None:
    """Make a pair of two racks whose points move in other directions."""
    inward(given, folder)
    given["point"][-1]["direction"] = [0.0, 1.0, 0.0]


SLIPS["a normal that points inward"] = (inward, '"bump".*normal', "points inward")
SLIPS["other directions of a pair"] = (skewed, '"bump".*between', "the same directions")


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_are_refused_by_their_key(tmp_path: Path, slip: str) -> None:
    """One fault, status 2, at the key that is wrong, in words that name it."""
    given = tables(tmp_path)
    check_slip(given, SLIPS[slip], tmp_path)


def test_unusual_units_are_asked_about(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A rack of 3 km, whose waves no material has, is a question, not a fault: models may be scaled."""
    given = tables(tmp_path)
    text = (tmp_path / "rack.inp").read_text().splitlines()
    (tmp_path / "rack.inp").write_text(
        "\n".join([re.sub(r", ([0-9.]+), 0, 0", lambda at: f", {5000.0 * float(at[1])}, 0, 0", line) for line in text])
    )
    gb.scene(given)
    [record] = [one for one in caplog.records if "other units" in one.message]
    assert "structure rack" in record.message
    assert "the nodes span 3e+03 m" in record.message


def test_all_faults_come_at_once_and_in_order(tmp_path: Path) -> None:
    """Faults of several tables in one message; nothing is read before the tables are sound."""
    given = tables(tmp_path)
    put("point", 0, "at", value=0.6)(given, tmp_path)
    put("contact", value=None)(given, tmp_path)
    put("load", 0, "point", value="tube.top")(given, tmp_path)
    with pytest.raises(gb.CaseError) as refused:
        gb.scene(given)
    assert len(refused.value.faults) == 4  # both pairs lack a law


def test_studies_of_one_beam_refuse_scenes(tmp_path: Path) -> None:
    """Calls for a case with [beam] name the table, and what takes it."""
    given = tables(tmp_path)
    for call in (gb.read_case, gb.model, gb.modes):
        with pytest.raises(gb.CaseError, match="several structures"):
            call(given)  # type: ignore[operator]


@pytest.mark.slow(minutes=0.3)
def test_ranks_march_a_file_once(tmp_path: Path) -> None:
    """Two ranks write the records of one; a fault ends both with status 2 and one message."""
    file = PROJECT / "cases" / "scenes" / "rack.toml"
    few = ("--set", "time.end=0.02")
    one = called("run", file, *few, "--output", tmp_path / "one")
    two = on_ranks(2, "run", file, *few, "--output", tmp_path / "two")
    assert one.returncode == two.returncode == 0, two.stderr
    first, second = (gb.open_results(tmp_path / name).history for name in ("one", "two"))
    assert first.equals(second)
    wrong = on_ranks(2, "run", file, "--set", "time.step=3", "--output", tmp_path / "three")
    assert wrong.returncode == 2
    assert wrong.stderr.count("longer than the whole run") == 1


@pytest.mark.parametrize("seed", range(6))
def test_loads_of_a_file_are_varied_by_paths(seed: int) -> None:
    """Amplitude, frequency and scale of each load that a point or a base has, as in a file with other numbers."""
    random = np.random.default_rng(seed)
    kind, point = [
        ({"type": "harmonic_force", "amplitude": 3.0, "frequency": 7.0, "phase": 30.0, "ramp": 0.2}, True),
        ({"type": "constant_force", "amplitude": 3.0}, True),
        ({"type": "base_motion", "amplitude": 3e-3, "frequency": 7.0, "quantity": "displacement"}, False),
        ({"type": "base_motion", "amplitude": 3.0, "frequency": 7.0, "ramp": 0.2}, False),
        ({"type": "base_motion", "amplitude": 3e-3, "frequency": 7.0, "ramp": 0.2, "quantity": "displacement"}, False),
        ({"type": "step_force", "amplitude": 3.0, "start": 0.1}, True),
    ][seed]  # fmt: skip
    mass = {"type": "mass", "mass": 2.0, "stiffness": 1e4, "motions": 2}
    structure = {"name": "a", "model": mass, "place": {"axis": [1.0, 0.0, 0.0], "across": [0.0, 0.0, 1.0]}}

    def table(**changes: Any) -> Any:
        where = {"point": "a.at", "direction": [1.0, 0.0]} if point else {"direction": [0.0, 0.0, 1.0]}
        load = kind | {"name": "shaker"} | where | changes
        scene = read_scene({"structure": [structure], "load": [load], "time": {"end": 1.0, "step": 1e-3}}).scene
        return scene, scene.loads[0].table(times)

    times = np.sort(random.uniform(0.0, 1.0, 50))
    scene, plain = table()
    factor = float(random.uniform(0.3, 3.0))
    assert np.any(plain)
    many = scene.with_({"shaker.scale": np.array([1.0, factor])}).loads[0].table(times, 2)
    assert np.allclose(many, plain * [1.0, factor], rtol=1e-14, atol=0.0)
    if "amplitude" in scene.loads[0].parameters:
        bigger = factor * scene.loads[0].parameters["amplitude"]
        assert np.allclose(scene.with_({"shaker.amplitude": bigger}).loads[0].table(times), factor * plain)
        if kind.get("quantity") != "displacement":
            assert np.allclose(scene.with_({"shaker.frequency": 9.0}).loads[0].table(times), table(frequency=9.0)[1])
        kernel_data(scene, 1e-3)


@pytest.mark.parametrize("study", [UncertainStudy, OptimumStudy, Identification])
@pytest.mark.parametrize("case", ["demo.toml", "scenes/clip.toml"])
def test_a_case_in_place_of_a_study_is_named_as_such(study: Any, case: str) -> None:
    """One fault, of the key that names the case, in place of one for each of its tables; it says what to write."""
    path = PROJECT / "cases" / case
    with pytest.raises(gb.CaseError) as refused:
        read_tables(path, study)
    (fault,) = refused.value.faults
    assert fault.key == ("case",)
    assert "a case itself" in fault.found
    assert f'case = "{path.name}"' in fault.hint
    assert "`case`" in fault.expected
