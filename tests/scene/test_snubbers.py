"""Snubbers against an adaptive integration that finds each crossing, with their energy balance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam as gb
from gapbeam.solver.scene.scene import SceneState

MASS, SPRING, PUSH, TURN = 2.0, 800.0, 30.0, 13.0  # kg, N/m, N, rad/s
LOCK: dict[str, dict[str, float]] = {
    "velocity": {"velocity": 0.3, "release": 0.1, "stiffness": 0.0, "damping": 150.0, "drag": 2.0},
    "acceleration": {"acceleration": 8.0, "release": 1.0, "stiffness": 2e3, "damping": 1.0, "drag": 0.5},
}


def push(t: Any) -> Any:
    return PUSH * np.sin(TURN * t) * np.minimum(t, 1.0)


def scene(kind: str) -> gb.Scene:
    one = gb.mass(MASS, stiffness=SPRING, name="box")
    held = gb.snubber(one["at"], **LOCK[kind], name="snubber")  # type: ignore[arg-type]
    return gb.Scene(one, contacts=[held], loads=[gb.Force(one["at"], push, name="push")])


def reference(kind: str, end: float, times: np.ndarray) -> tuple[np.ndarray, int]:
    """Integrate from crossing to crossing; return places at some times, and how often the snubber locked."""
    given = LOCK[kind]
    lock = given[kind]

    def acceleration(t: float, y: np.ndarray, anchor: float | None) -> float:
        x, v = y
        held = given["drag"] * v if anchor is None else given["stiffness"] * (x - anchor) + given["damping"] * v
        return float((push(t) - SPRING * x - held) / MASS)

    t, y, anchor, locks = 0.0, np.zeros(2), None, 0
    found = np.zeros(len(times))
    while t < end:
        limit = lock if anchor is None else given["release"]

        def off(t: float, y: np.ndarray, anchor: float | None = anchor, limit: float = limit) -> float:
            return abs(y[1] if kind == "velocity" else acceleration(t, y, anchor)) - limit

        if anchor is None and t > 0.0 and off(t, y) > 0.0:  # the jump of the force as it opened locks it again
            anchor, locks = float(y[0]), locks + 1
            continue
        off.terminal, off.direction = True, 1.0 if anchor is None else -1.0  # type: ignore[attr-defined]
        part = solve_ivp(
            lambda t, y, anchor=anchor: [y[1], acceleration(t, y, anchor)], (t, end), y, "DOP853", events=off,
            rtol=1e-10, atol=1e-13, dense_output=True, max_step=2e-4,
        )  # fmt: skip
        inside = (times >= t) & (times <= part.t[-1])
        found[inside] = part.sol(times[inside])[0]
        t, y = float(part.t[-1]), part.y[:, -1]
        if part.status == 1:
            anchor, locks = (float(y[0]), locks + 1) if anchor is None else (None, locks)
    return found, locks


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("kind", LOCK)
def test_motion_follows_adaptive_integration(kind: str) -> None:
    """Many lockings in three seconds: the error falls with the step, and is below 1 % at 1e-5 s."""
    end = 2.0
    errors = []
    wanted, locks = reference(kind, end, 1e-5 * np.arange(1, 200_001))
    assert locks > 5
    for step, every in ((1e-4, 10), (1e-5, 1)):
        found = gb.history(scene(kind), step, end)
        errors.append(np.abs(found.displacement["at"] - wanted[every - 1 :: every]).max() / np.abs(wanted).max())
        assert abs(found.last.balance) < 1e-11 * found.last.energy["loads"]  # after 2e5 steps
    free = gb.history(scene(kind).with_({"snubber.lock": 1e9}), 1e-5, end)
    assert np.abs(free.displacement["at"] - wanted).max() > 0.2 * np.abs(wanted).max()  # the snubber matters
    assert errors[1] < 0.01
    assert errors[1] < 0.3 * errors[0]


def test_a_march_continues_from_a_locked_state() -> None:
    """Cut while it is locked, the march continues to the same bits; without what it remembers it does not."""
    whole = gb.history(scene("velocity"), 1e-4, 1.5)
    steps = gb.march(scene("velocity"), 1e-4, 1.5)
    cut = next(one for one in steps if one.t > 0.5 and abs(one.contacts["snubber"].force) > 5.0)
    state = cut.state
    assert state.memory is not None
    assert state.memory[0, 0] == 1.0
    rest = gb.history(scene("velocity"), 1e-4, 1.5, start=state)
    assert rest.displacement["at"][-1] == pytest.approx(whole.displacement["at"][-1], rel=1e-12)
    bare = SceneState(state.t, state.q, state.v, state.z, state.F)
    other = gb.history(scene("velocity"), 1e-4, 1.5, start=bare)
    assert abs(other.displacement["at"][-1] / whole.displacement["at"][-1] - 1.0) > 1e-6


def test_members_lock_on_their_own() -> None:
    """An ensemble over the velocity of locking against single marches."""
    locks = np.array([0.2, 0.3, 0.45, 1e9])
    many = gb.ensemble(scene("velocity"), {"snubber.lock": locks}, step=1e-4, end=1.5)
    for peak, lock in zip(many.peak["at"], locks, strict=True):
        one = gb.history(scene("velocity").with_({"snubber.lock": float(lock)}), 1e-4, 1.5)
        assert peak == pytest.approx(np.abs(one.displacement["at"]).max(), rel=1e-9)
    assert len(set(np.round(many.peak["at"], 6))) == 4


def test_studies_of_states_refuse_memory() -> None:
    with pytest.raises(gb.UserError, match="periodic: found snubber, which remembers"):
        gb.periodic(scene("velocity"), 2.0 * np.pi / TURN, 100)


def tables(**joint: Any) -> dict[str, Any]:
    given = {"type": "snubber", "name": "snubber", "between": ["box.at"], **LOCK["velocity"], **joint}
    return {
        "structure": [{"name": "box", "model": {"type": "mass", "mass": MASS, "stiffness": SPRING}}],
        "joint": [{key: value for key, value in given.items() if value is not None}],
        "load": [{"type": "harmonic_force", "name": "push", "point": "box.at", "amplitude": PUSH, "frequency": 2.0}],
        "time": {"step": 1e-4, "end": 2.0},
    }


def test_a_file_with_a_snubber_runs(tmp_path: Path) -> None:
    """Status 0, forces of the snubber in the results, and the motion of the scene that Python makes."""
    outcome = gb.run(tables(), output=tmp_path / "out")
    assert outcome.exit_status == 0, outcome.message
    one = gb.mass(MASS, stiffness=SPRING, name="box")
    load = gb.Force(one["at"], lambda t: PUSH * np.sin(4.0 * np.pi * t))
    own = gb.Scene(one, contacts=[gb.snubber(one["at"], **LOCK["velocity"])], loads=[load])  # type: ignore[arg-type]
    wanted = gb.history(own, 1e-4, 2.0)
    read = gb.history(gb.scene(tables()), 1e-4, 2.0)
    assert np.array_equal(read.displacement["at"], wanted.displacement["at"])
    assert outcome.summary["peak_contact_force"]["snubber"] == pytest.approx(np.abs(wanted.force[0]).max(), rel=0.01)


@pytest.mark.parametrize(
    ("slip", "words"),
    [
        ({"acceleration": 3.0}, "velocity and acceleration"),
        ({"velocity": None}, "neither velocity nor acceleration"),
        ({"release": 0.4}, "less than 0.3, at which it locks"),
        ({"damping": 0.0}, "does nothing"),
        ({"name": "push"}, 'name = "push-2"'),
        ({"between": ["box.tip"]}, "which is no point"),
        ({"release": None}, "missing"),
        ({"drag": -1.0}, "drag"),
    ],
)
def test_slips_are_refused(slip: dict[str, Any], words: str) -> None:
    with pytest.raises(gb.CaseError, match=words) as refused:
        gb.scene(tables(**slip))
    assert refused.value.exit_status == 2


def test_nonsense_is_refused_in_python() -> None:
    at = gb.mass(1.0)["at"]
    for given, words in (
        ({"velocity": 1.0, "acceleration": 1.0}, "both"), ({}, "neither"), ({"velocity": 0.1}, "less than"),
        ({"velocity": -1.0}, "above 0"), ({"velocity": 1.0, "drag": -1.0}, "drag"),
        ({"velocity": 1.0, "stiffness": 0.0}, "one that holds"),
    ):  # fmt: skip
        with pytest.raises(gb.UserError, match=words):
            gb.snubber(at, **{"stiffness": 1.0, "release": 0.5, **given})  # type: ignore[arg-type]
    with pytest.raises(gb.UserError, match="expected 1 motion"):
        gb.snubber(gb.mass(1.0, 2)["at"], 1.0, velocity=1.0, release=0.5)
