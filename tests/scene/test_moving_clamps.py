"""Clamps that move: all supports together are the frame, and a lifted end bends a beam as closed forms say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.signal
import scipy.sparse as sp

import gapbeam as gb
from gapbeam.solver.loads.support_motion import HarmonicSupportMotion

STEEL = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}
SHAKEN: dict[str, Any] = {"type": "support_motion", "amplitude": 2e-3, "frequency": 9.0, "ramp": 0.1}
ROUTE = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.5], [0.7, 0.0, 0.5]]


def bent(**more: Any) -> dict[str, Any]:
    """Return a frame with a corner."""
    return {"type": "frame", "route": ROUTE, "thickness": 0.02, "elements": 8, "material": STEEL, **more}


def written(folder: Path) -> dict[str, Any]:
    """Write the matrices of the frame, free, and return the model of these files."""
    section, steel = gb.space_section("rectangle", 0.02), gb.material(2.1e11, 7850.0)
    free = gb.frame(ROUTE, section, steel, {}, elements=8)
    for name, A in (("K", free.K), ("M", free.M)):
        sp.save_npz(folder / f"{name}.npz", sp.csr_matrix(A))
    assert free.geometry is not None
    nodes = free.geometry.places
    (folder / "all.dof").write_text("\n".join(f"{n + 1}.{d}" for n in range(len(nodes)) for d in range(1, 7)))
    (folder / "all.txt").write_text("\n".join(f"{n + 1} {x} {y} {z}" for n, (x, y, z) in enumerate(nodes)))
    files = {name: str(folder / name) for name in ("K.npz", "M.npz", "all.dof", "all.txt")}
    return {"type": "matrices", "units": "m-kg-s", "stiffness": files["K.npz"], "mass": files["M.npz"],
            "dofs": files["all.dof"], "nodes": files["all.txt"]}  # fmt: skip


def cantilever(kind: str, folder: Path, **more: Any) -> dict[str, Any]:
    """Return the tables of a structure that is clamped once, and moves there."""
    plane = {"type": "beam", "length": 1.0, "thickness": 0.02, "elements": 8, "material": STEEL}
    model = {"beam": plane, "two": plane | {"motions": 2, "section": "round"}, "frame": bent()}.get(kind)
    model = written(folder) if model is None else model
    spatial, beam = kind in ("frame", "matrices"), kind in ("beam", "two")
    tip = {"at": 1.0} if beam else {"nearest": ROUTE[-1], "direction": [0.6, 0.0, 0.8]}
    along = {"two": [0.6, 0.8], "frame": [0.6, 0.0, 0.8], "matrices": [0.6, 0.0, 0.8]}.get(kind)
    place = {"place": {}} if kind == "matrices" else {}
    return {
        "structure": [{"name": "a", "model": model, "ratio": 0.02, **place, **more}],
        "point": [{"name": "tip", "structure": "a", **tip}],
        "joint": [{"type": "clamped", "name": "foot", "structure": "a",
                   **({"nodes": [1]} if spatial and kind == "matrices" else {"at": 0.0})}],
        "load": [SHAKEN | {"support": "foot"} | ({} if along is None else {"direction": along})],
        "time": {"step": 1e-4, "end": 0.4},
    }  # fmt: skip


@pytest.mark.parametrize("more", [{}, {"reduce": {"modes": 6}}])
@pytest.mark.parametrize("kind", ["beam", "frame", "matrices"])
def test_the_only_clamp_that_moves_is_a_frame_that_moves(tmp_path: Path, kind: str, more: dict[str, Any]) -> None:
    """Displacements relative to a frame with the same acceleration, plus its displacement; the balance closes."""
    tables = cantilever(kind, tmp_path, **more)
    moved = HarmonicSupportMotion(name="m", **SHAKEN).time_function()
    found = gb.history(gb.scene(tables), step=1e-4, end=0.4)
    held = gb.scene(tables | {"load": []}).structures[0]
    way = None if kind == "beam" else [0.6, 0.0, 0.8]
    frame = gb.BaseMotion(held, moved.acceleration, way, name="frame")
    relative = gb.history(gb.Scene(held, loads=[frame]), step=1e-4, end=0.4)
    wanted = relative.displacement["tip"] + moved.value(relative.t)
    assert found.displacement["tip"] == pytest.approx(wanted, abs=2e-5 * np.abs(wanted).max())
    assert abs(found.last.balance) < 1e-9 * found.last.energy["strain"]


def energies(scene: gb.Scene, folder: Path, step: float = 1e-4, **more: Any) -> dict[str, np.ndarray]:
    """Return the energies in the history of a run, and that exchanged in its summary."""
    run = gb.run(scene, step=step, end=0.4, output=folder, **more)
    history = gb.open_results(run).history
    named = {name: history[f"{name}_energy"].values for name in ("kinetic", "strain")}
    named["lost"] = history["structural_dissipation"].values
    named["work"] = history["load_work"].values.sum(axis=1)
    return named | {"exchanged": np.array(run.summary["energy"]["exchanged"])}


@pytest.mark.parametrize(
    ("kind", "more", "speed"),
    [*((kind, {}, speed) for kind in ("beam", "two", "frame", "matrices") for speed in (0.0, 0.05)),
     *((kind, {"reduce": {"modes": 6}}, 0.0) for kind in ("beam", "frame", "matrices"))],
)  # fmt: skip
def test_energies_beside_the_only_clamp_are_those_of_a_frame_that_moves(
    tmp_path: Path, kind: str, more: dict[str, Any], speed: float
) -> None:
    """Stored, lost, brought in and exchanged: the clamp is at rest where the frame is. From rest, and in motion."""
    tables = cantilever(kind, tmp_path, **more)
    read, body = gb.scene(tables), gb.scene(tables | {"load": []}).structures[0]
    moved = HarmonicSupportMotion(name="m", **SHAKEN).time_function().acceleration
    assert moved is not None
    way = [0.6, 0.0, 0.8] if kind in ("frame", "matrices") else None
    frame: list[gb.Load] = [gb.BaseMotion(body, moved, way, name="frame")]
    if kind == "two":
        assert body.inertia is not None
        turned = 0.6 * body.inertia + 0.8 * np.roll(body.inertia, 1)  # motions of both planes alternate
        frame = [gb.Load(body, -turned, moved, name="frame")]
    framed = gb.Scene(body, loads=frame)
    shape = speed * body.modes[2][:, 0] / np.abs(body.modes[2][:, 0]).max() if speed else 0.0
    starts = [one.state(velocity={one.structures[0]: shape}) for one in (read, framed)]
    found = energies(read, tmp_path / "clamp", every=7, start=starts[0])
    wanted = energies(framed, tmp_path / "frame", every=7, start=starts[1])
    for name, value in wanted.items():
        assert found[name] == pytest.approx(value, abs=1e-3 * float(wanted["exchanged"])), name


def test_energies_beside_one_of_two_clamps_are_those_of_what_it_does_not_follow_slowly(tmp_path: Path) -> None:
    """Modes of own matrices with both ends held, driven by their inertia as the other end lifts them slowly."""
    tables = cantilever("matrices", tmp_path)
    K, M = (sp.load_npz(tmp_path / f"{name}.npz").toarray() for name in "KM")
    count = len(K)
    tables["joint"] = [{"type": "clamped", "structure": "a", "nodes": [1]},
                       {"type": "clamped", "name": "foot", "structure": "a", "nodes": [count // 6]}]  # fmt: skip
    tables["point"] = [{"name": "tip", "structure": "a", "node": count // 12, "direction": [0.6, 0.0, 0.8]}]
    found = energies(gb.scene(tables), tmp_path / "run", step=2e-5)
    free, lifted = np.arange(6, count - 6), np.zeros(count)
    lifted[count - 6 : count - 3] = 0.6, 0.0, 0.8
    squares, X = sl.eigh(K[np.ix_(free, free)], M[np.ix_(free, free)])
    lifted[free] = np.linalg.solve(K[np.ix_(free, free)], -(K @ lifted)[free])
    w, drive = np.sqrt(squares), X.T @ (M @ lifted)[free]
    t = np.linspace(0.0, 0.4, 20001)
    s = HarmonicSupportMotion(name="m", **SHAKEN).time_function()
    assert s.acceleration is not None
    push = np.array([s.acceleration(one) for one in t])
    kinetic, strain = np.zeros(len(t)), np.zeros(len(t))
    for one, share in zip(w[:20], drive[:20], strict=True):
        system = ([[0.0, 1.0], [-(one**2), -0.04 * one]], [[0.0], [-share]], np.eye(2), np.zeros((2, 1)))
        y = scipy.signal.lsim(system, push, t)[1]
        strain += 0.5 * (one * y[:, 0]) ** 2
        kinetic += 0.5 * y[:, 1] ** 2
    assert found["kinetic"] == pytest.approx(kinetic, abs=2e-3 * kinetic.max())
    assert found["strain"] == pytest.approx(strain, abs=2e-3 * strain.max())
    assert np.all(np.diff(found["lost"]) >= -1e-9 * found["lost"][-1])


def test_supports_of_one_name_move_together(tmp_path: Path) -> None:
    """All of them, with a mass on the structure: the frame that moves, again."""
    tables = cantilever("frame", tmp_path, reduce={"modes": 6})
    tables["joint"] += [{"type": "pinned", "name": "foot", "structure": "a", "nearest": ROUTE[-1]}]
    tables["point"][0] = {"name": "tip", "structure": "a", "at": 0.8, "direction": [0.6, 0.0, 0.8]}
    tables["mass"] = [{"point": "a.tip", "mass": 1.5}]
    moved = HarmonicSupportMotion(name="m", **SHAKEN).time_function()
    found = gb.history(gb.scene(tables), step=1e-4, end=0.4)
    held = gb.scene(tables | {"load": []}).structures[0]
    frame = gb.BaseMotion(held, moved.acceleration, [0.6, 0.0, 0.8], name="frame")
    relative = gb.history(gb.Scene(held, loads=[frame]), step=1e-4, end=0.4)
    wanted = relative.displacement["tip"] + moved.value(relative.t)
    assert found.displacement["tip"] == pytest.approx(wanted, abs=2e-5 * np.abs(wanted).max())


def test_a_clamp_moves_in_two_planes(tmp_path: Path) -> None:
    """As a beam in one plane does along each: 0.6 and 0.8 of the motion."""
    both = gb.history(gb.scene(cantilever("two", tmp_path)), step=1e-4, end=0.2).displacement["tip"]
    tables = cantilever("two", tmp_path)
    tables["structure"][0]["model"] |= {"motions": 1}
    tables["load"][0].pop("direction")
    one = gb.history(gb.scene(tables), step=1e-4, end=0.2).displacement["tip"]
    assert both == pytest.approx(np.outer(one, [0.6, 0.8]), abs=1e-9 * np.abs(one).max())


SLOW = SHAKEN | {"amplitude": 1e-3, "frequency": 0.5, "ramp": 0.4}


@pytest.mark.parametrize("kind", ["clamped", "pinned", "held"])
@pytest.mark.parametrize("record", [False, True])
def test_a_lifted_end_bends_a_beam_against_a_spring(tmp_path: Path, kind: str, record: bool) -> None:
    """Slender, and slowly: the middle moves by s/2, or 5 s / 16 of a propped one, times k_b / (k_b + k).

    k_b = 192 E I / L^3 between clamps, 768 / 7 with a pin.
    """
    if record:
        times = np.linspace(0.0, 1.0, 401)
        values = HarmonicSupportMotion(name="m", **SLOW).time_function().value(times)
        np.savetxt(tmp_path / "lift.csv", np.column_stack([times, values]), delimiter=",")
    length, d, spring = 2.0, 0.03, 5e4
    bends = 2.1e11 * np.pi * d**4 / 64.0 / length**3
    share, own = (0.5, 192.0 * bends) if kind == "clamped" else (5.0 / 16.0, 768.0 / 7.0 * bends)
    lifted = {"type": "recorded_support_motion", "file": str(tmp_path / "lift.csv")} if record else SLOW
    tables = {
        "structure": [{"name": "a", "ratio": 0.3, "reduce": {"modes": 6},
                       "model": bent(route=[[0, 0, 0], [2, 0, 0]], thickness=d, section="round")}],
        "point": [{"name": "mid", "structure": "a", "at": 1.0, "direction": [0.0, 0.0, 1.0]}],
        "joint": [{"type": "clamped", "structure": "a", "at": 0.0},
                  {"type": kind, "name": "end", "structure": "a", "at": 2.0}
                  | ({"direction": [0.0, 0.0, 1.0]} if kind == "held" else {}),
                  {"type": "elastic", "between": ["a.mid"], "stiffness": spring}],
        "load": [lifted | {"support": "end"} | ({} if kind == "held" else {"direction": [0.0, 0.0, 1.0]})],
        "time": {"step": 1e-3, "end": 1.0},
    }  # fmt: skip
    found = gb.history(gb.scene(tables), step=1e-3, end=0.8).displacement["mid"]
    s = HarmonicSupportMotion(name="m", **SLOW).time_function().value(np.arange(1, 801) * 1e-3)
    assert found == pytest.approx(share * s * own / (own + spring), abs=0.01 * np.abs(share * s).max())


def slipped(load: dict[str, Any], joint: dict[str, Any]) -> dict[str, Any]:
    tables = cantilever("frame", Path())
    tables["load"][0] |= load
    tables["joint"] += [{"type": "held", "name": "side", "structure": "a", "at": 1.0, "direction": [0.0, 1.0, 0.0]}]
    tables["joint"][1] |= joint
    return tables


@pytest.mark.parametrize(
    ("load", "joint", "words"),
    [
        ({"support": "side", "direction": [1.0, 0.0, 0.0]}, {}, "does not hold"),
        ({"support": "side"}, {"name": None}, "give its .*joint.* a name"),
        ({"support": "foot", "direction": [1.0]}, {}, "a number for each motion"),
    ],
)
def test_what_no_joint_holds_is_refused(load: dict[str, Any], joint: dict[str, Any], words: str) -> None:
    """At the load, with what would do."""
    tables = slipped(load, joint)
    tables["joint"][1] = {name: value for name, value in tables["joint"][1].items() if value is not None}
    with pytest.raises(gb.CaseError, match=words):
        gb.scene(tables)
