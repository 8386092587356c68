"""Ensembles of scenes against single marches: motions, features, own steps, failures, and folders of blocks."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.scene import lane_ensemble
from gapbeam.solver.scene.scene import Scene, SceneState

PERIOD = 0.03
LAWS = {
    "kelvin-voigt": lambda: gb.KelvinVoigt(stiffness=1e6, damping=20.0),
    "hunt-crossley": lambda: gb.HuntCrossley(1e8, chi=0.3),
    "cubic": lambda: gb.Cubic(stiffness=1e6, scale=1e-4),
    "adhesive": lambda: gb.Adhesive(stiffness=1e6, pull=0.5, reach=1e-5),
}


def tube(law: str, supports: int, hole: bool = True) -> Scene:
    """Six modes in slots, beside a mass in a rough hole."""
    modes = np.arange(6) + 0.5
    places = np.linspace(1.0, 0.4, supports)
    shapes = {f"p{i}": np.sqrt(2.0) * np.sin(modes * np.pi * x) for i, x in enumerate(places)}
    body = gb.from_modes(2 * np.pi * 20 * modes**1.5, 0.02, shapes, name="tube")
    gaps = [gb.Contact(body[name], gb.Slot(2e-4), LAWS[law](), name=f"gap {name}") for name in shapes]
    shake = gb.Force(
        body["p0"], lambda t, size, phase: size * np.sin(2 * np.pi * t / PERIOD + phase), name="shaker", size=20.0,
        phase=0.0,
    )  # fmt: skip
    if not hole:
        return gb.Scene(body, contacts=gaps, loads=[shake])
    ball = gb.mass(0.5, motions=2, stiffness=2e3, damping=2.0, name="ball")
    rough = gb.Contact(ball["at"], gb.Disc(3e-4), LAWS["kelvin-voigt"](), friction=0.2, sliding=1e-3, name="hole")
    push = gb.Force(ball["at"], lambda t: 3.0 * np.sin(2 * np.pi * t / PERIOD), [0.8, 0.6], name="push")
    return gb.Scene(body, ball, contacts=[*gaps, rough], loads=[shake, push])


def drawn(scene: Scene, members: int, seed: int) -> tuple[dict[str, Any], SceneState]:
    draw = np.random.default_rng(seed)
    values: dict[str, Any] = {
        "gap *.clearance": draw.uniform(1e-4, 4e-4, members),
        "gap p0.offset": draw.uniform(-5e-5, 5e-5, members),
        "gap p0.stiffness": 10 ** draw.uniform(-0.5, 0.3, members) * scene.contacts[0].law.values[0],
        "shaker.size": draw.uniform(5.0, 40.0, members),
        "shaker.phase": draw.uniform(0.0, 2 * np.pi, members),
    }
    if scene.contacts[-1].name == "hole":
        values |= {
            "hole.friction": draw.uniform(0.0, 0.4, members),
            "hole.offset": draw.uniform(-1e-4, 1e-4, (members, 2)),
            "hole.sliding": draw.uniform(5e-4, 2e-3, members),
            "hole.damping": draw.uniform(0.0, 50.0, members),
        }
    v = 0.02 * draw.standard_normal((scene.size, members))
    still = scene.state()
    return values, SceneState(0.0, np.zeros_like(v), v, still.z, still.F)


def of(many: Any, i: int) -> Any:
    return np.array([*many.q[:, i], *many.v[:, i]])


def alone(scene: Scene, values: dict[str, Any], start: SceneState, i: int, nudge: float = 0.0) -> tuple[Scene, Any]:
    one = scene.with_({path: value[i] for path, value in values.items()})
    v = start.v[:, [i]] * (1.0 + nudge)
    return one, SceneState(0.0, start.q[:, [i]], v, start.z, start.F)


def agree(law: str, supports: int, members: int, seed: int) -> None:
    scene, h, steps = tube(law, supports), PERIOD / 800, 2000
    values, start = drawn(scene, members, seed)
    many = gb.ensemble(scene, values, step=h, end=steps * h, start=start)
    assert not many.untrusted.any()
    ranges, off, moved = np.ptp(many.q, axis=1).max(), np.zeros(members), np.zeros(members)
    for i in range(members):
        ends = []
        for nudge in (0.0, 1e-13):
            one, begin = alone(scene, values, start, i, nudge)
            *_, last = gb.march(one, h, steps * h, begin, every=steps)
            ends.append(last.state)
        off[i] = np.abs(many.q[:, i] - ends[0].q[:, 0]).max() / ranges
        moved[i] = np.abs(ends[1].q - ends[0].q).max() / ranges
    assert np.all((off <= 1e-9) | (off <= 10 * moved)), (off, moved)
    assert np.count_nonzero(off <= 1e-9) >= 0.7 * members


def test_drawn_members_are_their_single_marches() -> None:
    """Thirty members with own clearance, offset, stiffness, damping, friction, load, phase and start; 2000 steps."""
    agree("kelvin-voigt", 1, 30, seed=1)


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("supports", [1, 2, 4])
@pytest.mark.parametrize("law", LAWS)
def test_every_law_and_number_of_supports(law: str, supports: int) -> None:
    """A hundred members each."""
    agree(law, supports, 100, seed=supports)


def test_features_are_those_of_the_history() -> None:
    """Each feature again from the whole history of a single march, by its definition."""
    scene, n = tube("kelvin-voigt", 1), 198
    values, start = drawn(scene, 8, seed=3)
    h, end, settle = PERIOD / n, 8 * PERIOD, 2 * PERIOD
    many = gb.ensemble(
        scene, values, step=h, end=end, start=start, settle=settle, period=PERIOD, harmonics=3, strobes=2, every=54
    )
    assert many.displacement["p0"].shape == (22, 8)
    assert many.force["hole"].shape == (22, 2, 8)
    for i in (0, 7):
        one, begin = alone(scene, values, start, i)
        found = gb.history(one, h, end, begin)
        x, late = found.displacement["p0"], found.t > settle + 0.5 * h
        F = {name: np.abs(found.force["gap p0"]) if name == "gap p0" else np.hypot(*found.force["hole"].T)
             for name in ("gap p0", "hole")}  # fmt: skip
        for name, force in F.items():
            closed = force > 0.0
            begins = closed & ~np.append(False, closed[:-1])
            assert many.peak_force[name][i] == pytest.approx(force[late].max(), rel=1e-8)
            assert many.impulse[name][i] == pytest.approx(h * force[late].sum(), rel=1e-8)
            assert many.closed[name][i] == pytest.approx(h * closed[late].sum(), rel=1e-9)
            assert many.impacts[name][i] == begins[late].sum()
        assert many.impact_rate["hole"][i] == pytest.approx(many.impacts["hole"][i] / (6 * PERIOD))
        assert many.peak["p0"][i] == pytest.approx(np.abs(x[late]).max(), rel=1e-8)
        assert many.rms["p0"][i] == pytest.approx(np.sqrt(np.mean(x[late] ** 2)), rel=1e-8)
        for j in range(4):
            wave = (2 if j else 1) * np.mean(x[late] * np.exp(-2j * np.pi * j * found.t[late] / PERIOD))
            assert abs(many.harmonics["p0"][j, i] - wave) < 1e-9 * np.abs(x).max()
        assert np.allclose(many.displacement["p0"][:, i], x[late][53::54], atol=1e-9 * np.abs(x).max())
        *_, before = gb.march(one, h, end - PERIOD, begin, every=n)
        assert np.allclose(many.strobes[0, : scene.size, i], before.state.q[:, 0], atol=1e-9 * np.abs(x).max())
        assert np.allclose(many.strobes[1, scene.size :, i], found.last.state.v[:, 0], atol=1e-7)
    still = gb.ensemble(scene, values, step=h, end=end, start=start)
    lost = sum(still.work.values())
    assert np.allclose(lost, still.energy["law"] + still.energy["friction"], rtol=1e-10)


def test_members_have_their_own_steps_and_dampings() -> None:
    """Frequencies of the load and damping factors differ: blocks of equal ones, and members on their own."""
    body = gb.mass(1.0, stiffness=1.0, damping=0.1, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(0.5), gb.KelvinVoigt(stiffness=40.0), name="stop")
    push = gb.Force(body["at"], lambda t, w: 0.6 * np.cos(w * t), name="push", w=1.0)
    scene = gb.Scene(body, contacts=[stop], loads=[push])
    w = np.concatenate([np.repeat([0.8, 1.1], 40), np.linspace(0.7, 1.3, 5)])[np.random.default_rng(0).permutation(85)]
    T, factor = 2 * np.pi / w, np.where(np.arange(85) % 2, 1.0, 0.5)
    many = gb.ensemble(
        scene, {"push.w": w, "body.damping_factor": factor}, step=T / 100, end=10 * T, period=T, harmonics=1, strobes=1
    )
    assert many.span == pytest.approx(10 * T)
    for i in (0, 1, 30, 84):
        body = gb.mass(1.0, stiffness=1.0, damping=0.1 * factor[i], name="body")
        stop = gb.Contact(body["at"], gb.HalfPlane(0.5), gb.KelvinVoigt(stiffness=40.0), name="stop")
        one = gb.Scene(body, contacts=[stop], loads=[gb.Force(body["at"], lambda t, i=i: 0.6 * np.cos(w[i] * t))])
        found = gb.history(one, T[i] / 100, 10 * T[i])
        assert many.q[0, i] == pytest.approx(found.displacement["at"][-1], rel=1e-9)
        assert many.strobes[0, 0, i] == many.q[0, i]


def test_members_that_fail_are_reported_and_spare_the_others() -> None:
    """Twenty of seventy stops pull outward without limit, so that their motion grows beyond all numbers."""
    own = gb.law(potential=lambda x, stiffness: 0.5 * stiffness * x * x)(lambda x, stiffness: stiffness * x)
    ball = gb.mass(1.0, name="ball")
    stop = gb.Contact(ball["at"], gb.Slot(1e-3), own(stiffness=1e4), name="stop")
    scene = gb.Scene(ball, contacts=[stop])
    stiffness = np.full(70, 1e4)
    bad = np.arange(70) % 7 < 2
    stiffness[bad] = -1e7
    start = scene.state(velocity={ball: 1.0})
    many = gb.ensemble(scene, {"stop.stiffness": stiffness}, step=1e-3, end=0.5, start=start, every=100)
    assert np.array_equal(many.failed, bad)
    assert np.array_equal(many.untrusted, bad)
    assert np.isnan(many.peak["at"][bad]).all()
    one = gb.history(scene, 1e-3, 0.5, start)
    assert many.q[0, ~bad] == pytest.approx(one.displacement["at"][-1], rel=1e-10)


def test_an_ensemble_that_was_killed_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kill after two of four blocks: the second call computes the others only, and all bits are those of one call."""
    scene = tube("kelvin-voigt", 1, hole=False)
    values, start = drawn(scene, 250, seed=5)
    times: dict[str, Any] = {"step": PERIOD / 100, "end": 2 * PERIOD, "period": PERIOD, "harmonics": 1, "every": 50}
    whole = gb.ensemble(scene, values, start=start, **times)
    march, done = lane_ensemble._Job.block, []

    def killed(job: Any, members: Any, linear: Any) -> Any:
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(len(members))
        return march(job, members, linear)

    monkeypatch.setattr(lane_ensemble._Job, "block", killed)
    with pytest.raises(KeyboardInterrupt):
        gb.ensemble(scene, values, start=start, threads=1, output=tmp_path / "many", **times)
    assert len(list((tmp_path / "many").glob("block_*.npz"))) == 2

    def counted(job: Any, members: Any, linear: Any) -> Any:
        done.append(len(members))
        return march(job, members, linear)

    monkeypatch.setattr(lane_ensemble._Job, "block", counted)
    again = gb.ensemble(scene, values, start=start, output=tmp_path / "many", **times)
    assert done == [64, 64, 64, 58] or sorted(done) == [58, 64, 64, 64]
    for name, array in whole.flat().items():
        assert np.array_equal(array, again.flat()[name]), name
    with pytest.raises(gb.UserError, match="blocks of another ensemble"):
        gb.ensemble(scene, values | {"shaker.size": np.full(250, 9.0)}, start=start, output=tmp_path / "many", **times)
    (tmp_path / "full").write_text("a file")
    with pytest.raises(gb.NotWritten, match="could not be written"):
        gb.ensemble(scene, values, start=start, output=tmp_path / "full" / "many", **times)


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"period": 0.0101}, "no whole number of steps"),
        ({"harmonics": 2}, "need the period"),
        ({"strobes": 2}, "need the period"),
        ({"period": 0.02, "strobes": 9}, "strobes need"),
        ({"period": 0.03, "harmonics": 2}, "whole periods"),
        ({"period": 0.02, "harmonics": 10}, "more than two steps for each harmonic"),
        ({"settle": 0.2}, "features count from step"),
        ({"step": [1e-3, 2e-3]}, "one number for all members"),
        ({"step": -1e-3}, "numbers above 0"),
        ({"every": -1}, "numbers from 0 on"),
        ({"start": "two"}, "one length for all"),
    ],
)
def test_nonsense_is_refused(asked: dict[str, Any], says: str) -> None:
    """Messages name what was found."""
    scene = tube("kelvin-voigt", 1, hole=False)
    if "start" in asked:
        asked = {"members": 3}
    with pytest.raises(gb.UserError, match=says):
        gb.ensemble(scene, {"shaker.size": [1.0, 2.0]}, **({"step": 1e-3, "end": 0.1} | asked))


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_impulses_have_no_peak_force(restitution: float) -> None:
    """An impulse over the step is no force: finer steps multiplied it. Impulses stay, and peaks of springs."""
    a, b = gb.mass(1.0, stiffness=4.0, name="a"), gb.mass(2.0, stiffness=9.0, damping=0.1, name="b")
    hard = gb.Contact((a["at"], b["at"]), gb.HalfPlane(0.02), gb.Unilateral(restitution=restitution), name="hard")
    soft = gb.Contact(b["at"], gb.HalfPlane(0.02), gb.KelvinVoigt(stiffness=50.0), name="soft")
    scene = gb.Scene(a, b, contacts=[hard, soft])
    start = scene.state(velocity={a: 0.3})
    coarse, fine = (
        gb.ensemble(scene, {"soft.clearance": np.linspace(0.01, 0.03, 10)}, step=h, end=2.0, start=start)
        for h in (2e-3, 1e-3)
    )
    for many in (coarse, fine):
        assert np.isnan(many.peak_force["hard"]).all()
        assert not many.failed.any()
    assert fine.peak_force["soft"] == pytest.approx(coarse.peak_force["soft"], rel=0.02)
    assert fine.impulse["hard"] == pytest.approx(coarse.impulse["hard"], rel=0.02)


@pytest.mark.parametrize("members", [1, 7, 300])
@pytest.mark.parametrize("supports", [1, 9])
def test_results_print_short(members: int, supports: int) -> None:
    """A line for each attribute, with the true range of its numbers, however many members, contacts or steps."""
    scene = tube("kelvin-voigt", supports)
    values, start = drawn(scene, members, seed=3)
    many = gb.ensemble(
        scene, values, step=PERIOD / 100, end=2 * PERIOD, start=start, period=PERIOD, harmonics=1, every=9
    )
    whole = gb.history(scene, step=PERIOD / 100, end=2 * PERIOD)
    for one, line in ((many, f"peak: p0 ({members})"), (whole, "velocity: p0 (200)"), (whole.last.state, "q: (8, 1)")):
        words = repr(one)
        assert line in words
        assert len(words.splitlines()) == 1 + len(fields(one))
        assert max(map(len, words.splitlines())) < 400
    low, high = (f"{size(many.peak['p0']):.6g}" for size in (np.min, np.max))
    assert f"peak: p0 ({members}) {low}" in repr(many)
    assert members <= 4 or f"{low} to {high}" in repr(many)
    many.q[0, 0] = np.nan
    assert members == 1 or ", 1 not finite" in repr(many)


@pytest.mark.parametrize("members", [2, 9])
@pytest.mark.parametrize("points", [1, 2, 5])
def test_a_face_has_the_force_of_all_of_its_points(points: int, members: int) -> None:
    """A weight that falls from touch on a floor of any number of springs: 2 m g, half a period in contact at a time.

    m x'' + K x = m g from rest: the force is m g (1 - cos(w t)), at most 2 m g, m g in the mean, and always above 0
    between its returns to 0, one of which is in the march: one closing, for any split of K over the points.
    """
    mass, stiffness, weight = 2.0, 5e4, 30.0
    shares = np.random.default_rng(points).dirichlet(np.ones(points))
    body = gb.mass(mass, name="body")
    floor = [
        gb.Contact(body["at"], gb.HalfPlane(0.0), gb.KelvinVoigt(float(share) * stiffness), name=f"floor {i + 1}")
        for i, share in enumerate(shares)
    ]
    scene = gb.Scene(
        body, contacts=floor, loads=[gb.Force(body["at"], lambda t, size: size + 0.0 * t, name="g", size=1.0)]
    )
    period = 2.0 * np.pi * np.sqrt(mass / stiffness)
    sizes = np.linspace(1.0, 2.0, members) * weight
    many = gb.ensemble(scene, {"g.size": sizes}, step=period / 2000, end=0.75 * period)
    face = "floor" if points > 1 else "floor 1"
    assert many.peak_force[face] == pytest.approx(2.0 * sizes, rel=1e-5)
    assert many.impulse[face] == pytest.approx(sizes * period * (0.75 + 1.0 / (2.0 * np.pi)), rel=1e-4)
    assert np.all(many.impacts[face] == 1.0)
    assert many.closed[face] == pytest.approx(0.75 * period, rel=1e-3)
    if points > 1:
        each = sum(many.impulse[one.name] for one in floor)
        assert each == pytest.approx(many.impulse[face], rel=1e-12)
        assert list(many.work) == [one.name for one in floor]
