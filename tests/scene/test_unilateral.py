"""Exact contact between structures: impulses against closed forms, an event-driven integration and wave theory."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sla
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

import gapbeam as gb
from gapbeam.solver.scene_file.scene_reader import read_scene
from tests.scene.test_collisions import heave_and_pitch, rod
from tests.scene.test_face_contacts import sled

Array = np.ndarray
SECTION, STEEL = gb.CrossSection(1.2e-4, 1e-9, 1e-4), gb.material(2e11, 8000.0)


def pair(restitution: Any, gap: float, **spring: float) -> gb.Scene:
    """Return two masses, a of 2 kg before b of 0.7 kg."""
    a, b = (
        gb.mass(2.0, stiffness=spring.get("a", 0.0), name="a"),
        gb.mass(0.7, stiffness=spring.get("b", 0.0), name="b"),
    )
    law = gb.Unilateral(restitution=restitution)
    return gb.Scene(a, b, contacts=[gb.Contact((a["at"], b["at"]), gb.HalfPlane(gap), law, name="touch")])


@pytest.mark.parametrize("restitution", [0.0, 0.3, 1.0])
def test_rigid_bodies_leave_with_the_restitution(restitution: float) -> None:
    """Newton's law of impact in one step, whatever the step: velocities, impulse and energy in closed form."""
    scene, h = pair(restitution, 0.0103), 1e-3
    a, b = scene.structures
    impulse, balances, found, lost = 0.0, [], [], 0.0
    for step in gb.march(scene, h, 0.03, scene.state(velocity={a: 1.3, b: -0.4})):
        impulse += h * float(step.contacts["touch"].force)
        balances.append(step.balance)
        found, lost = [step[name].velocity for name in ("a.at", "b.at")], step.energy["law"]
    mean, jump = (2.0 * 1.3 - 0.7 * 0.4) / 2.7, -restitution * 1.7
    assert found == pytest.approx([mean + 0.7 / 2.7 * jump, mean - 2.0 / 2.7 * jump], rel=1e-13)
    assert impulse == pytest.approx(-(1.0 + restitution) * 1.7 * 2.0 * 0.7 / 2.7, rel=1e-12)
    assert lost == pytest.approx(0.5 * (2.0 * 0.7 / 2.7) * 1.7**2 * (1.0 - restitution**2), abs=1e-13)
    assert np.ptp(balances) < 1e-13


def with_events(restitution: float, gap: float, k: Array, drive: Any, end: float, times: Array) -> tuple[Array, int]:
    """Integrate two masses from impact to impact; return places of the first at some times, and the impacts."""
    y, t, hits, found = np.zeros(4), 0.0, 0, np.zeros(len(times))

    def rates(t: float, y: Array) -> list[float]:
        return [y[1], (drive(t) - k[0] * y[0]) / 2.0, y[3], -k[1] * y[2] / 0.7]

    def meet(t: float, y: Array) -> float:  # noqa: ARG001
        return float(y[0] - y[2] - gap)

    meet.terminal, meet.direction = True, 1.0  # type: ignore[attr-defined]
    while True:
        part = solve_ivp(rates, (t, end), y, "DOP853", events=meet, rtol=1e-11, atol=1e-14, dense_output=True)
        inside = (times >= t) & (times <= part.t[-1])
        found[inside] = part.sol(times[inside])[0]
        if part.status == 0:
            return found, hits
        t, y, hits = float(part.t[-1]), part.y[:, -1].copy(), hits + 1
        mean, jump = (2.0 * y[1] + 0.7 * y[3]) / 2.7, -restitution * (y[1] - y[3])
        y[1], y[3] = mean + 0.7 / 2.7 * jump, mean - 2.0 / 2.7 * jump


@pytest.mark.parametrize("restitution", [0.8, 1.0])
def test_driven_masses_follow_an_integration_from_impact_to_impact(restitution: float) -> None:
    """The error is of order 1 in the step: some part of a step at each impact."""

    def drive(t: Any) -> Any:
        return 12.0 * np.sin(40.0 * t)

    times, errors, k = np.linspace(0.0, 1.0, 251)[1:], [], np.array([2000.0, 300.0])
    exact, hits = with_events(restitution, 5e-3, k, drive, 1.0, times)
    steps = 1e-3 / 4.0 ** np.arange(4)
    for h in steps:
        scene = pair(restitution, 5e-3, a=k[0], b=k[1])
        load = gb.Force(scene.structures[0]["at"], drive, name="drive")
        found = gb.history(gb.Scene(*scene.structures, contacts=scene.contacts, loads=[load]), h, 1.0)
        closed = np.diff((found.force["touch"] != 0.0).astype(int), prepend=0)
        errors.append(np.abs(found.displacement["a.at"][round(4e-3 / h) - 1 :: round(4e-3 / h)] - exact).max())
    assert hits > 5
    assert (closed > 0).sum() == hits
    assert errors[-1] < 0.01 * np.abs(exact).max()
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize("restitution", [0.0, 1.0])
def test_rods_exchange_velocities_and_lose_what_their_end_nodes_had(restitution: float) -> None:
    """Wave theory: the first rod stays behind at rest. Impulses without restitution take energy of a node."""
    behind, lost, counts = [], [], np.array([25, 50, 100])
    for elements in counts:
        a, b = rod(elements, "a"), rod(elements, "b")
        law = gb.Unilateral(restitution=restitution)
        touch = gb.Contact((a["right"], b["left"]), gb.HalfPlane(0.0513), law, name="touch")
        scene, h = gb.Scene(a, b, contacts=[touch]), 0.5 / elements
        means = [one.M @ np.ones(one.size) @ one.modes[2] for one in (a, b)]
        given = 0.0
        for step in gb.march(scene, h, 2.5, scene.state(velocity={a: 1.0})):
            q = step.state.v[:, 0]
            p = means[0] @ q[: a.size], means[1] @ q[a.size :]
            given += h * float(step.contacts["touch"].force)
            assert abs(p[0] + p[1] - 1.0) < 1e-12
            assert abs(p[0] - 1.0 - given) < 1e-12
            assert abs(step.balance - 0.5) < 1e-12
        behind.append(abs(p[0]))
        lost.append(step.energy["law"])
    assert np.all(behind < 0.1 / np.sqrt(counts))
    if restitution == 1.0:
        assert np.abs(lost).max() < 1e-12
    else:  # a part of m v^2 / 2 of a node, once or twice
        assert np.abs(np.array(lost) * counts - 0.15).max() < 0.1


def test_free_beams_keep_momentum_angular_momentum_and_energy() -> None:
    """Two points of contact at once: what one beam gives the other gets, and nothing is lost."""
    a = gb.beam(0.5, SECTION, STEEL, {"left": 0.0, "right": 0.5, "one": 0.17, "two": 0.41}, elements=12, name="a")
    b = gb.beam(0.4, SECTION, STEEL, {"left": 0.0, "right": 0.4, "one": 0.04, "two": 0.28}, elements=9, name="b")
    law = gb.Unilateral(restitution=1.0)
    pairs = [gb.Contact((a[name], b[name]), gb.HalfPlane(1e-5), law, name=name) for name in ("one", "two")]
    scene, R = gb.Scene(a, b, contacts=pairs), [heave_and_pitch(a, 0.0), heave_and_pitch(b, 0.13)]
    start, rows = (
        scene.state(velocity={a: R[0] @ [1.0, 2.0], b: R[1] @ [-0.5, 1.0]}),
        [np.asarray(a.M), np.asarray(b.M)],
    )
    parts = [r.T @ m @ one.modes[2] for r, m, one in zip(R, rows, (a, b), strict=True)]
    moments = [parts[0] @ start.v[: a.size, 0] + parts[1] @ start.v[a.size :, 0]]
    balances, touched = [], 0
    for step in gb.march(scene, 2e-6, 6e-3, start):
        v = step.state.v[:, 0]
        moments.append(parts[0] @ v[: a.size] + parts[1] @ v[a.size :])
        balances.append(step.energy["kinetic"] + step.energy["strain"])
        touched += any(step.contacts[name].force != 0.0 for name in ("one", "two"))
    assert touched > 10
    assert np.abs(np.array(moments) - moments[0]).max() < 1e-12 * np.abs(moments).max()
    assert np.ptp(balances) < 1e-12 * balances[0]


@pytest.mark.parametrize("motions", [1, 2, 3])
def test_block_that_is_dropped_rests_where_the_step_lets_it(motions: int) -> None:
    """Its floor bears its weight exactly, at most half a step of its speed from where it is."""
    block, weight, h = gb.mass(2.0, motions=motions, name="block"), 20.0, 1e-3
    down = np.eye(motions)[-1]
    region = gb.HalfPlane(1e-4, 1 if motions == 1 else tuple(down))
    floor = gb.Contact(block["at"], region, gb.Unilateral(restitution=0.0), name="floor")
    found = gb.history(gb.Scene(block, contacts=[floor], loads=[gb.Force(block["at"], weight, down)]), h, 0.1)
    force, place = (np.reshape(part, (100, motions)) for part in (found.force["floor"], found.displacement["at"]))
    assert force[20:] == pytest.approx(np.outer(np.ones(80), -weight * down), rel=1e-12)
    assert np.ptp(place[20:], axis=0) == pytest.approx(0.0, abs=1e-17)
    assert abs(place[-1, -1] - 1e-4) <= 0.5 * h * np.sqrt(2.0 * 10.0 * 1e-4) + 10.0 * h**2


def test_mass_in_a_round_hole_keeps_energy_and_angular_momentum() -> None:
    """Impacts with restitution 1 turn the velocity only; impulses point at the middle."""
    ball = gb.mass(1.0, motions=2, name="ball")
    hole = gb.Contact(ball["at"], gb.Disc(1e-3), gb.Unilateral(restitution=1.0), name="hole")
    scene = gb.Scene(ball, contacts=[hole])
    hits, moments = 0, []
    for step in gb.march(scene, 1e-4, 0.3, scene.state({ball: [3e-4, 0.0]}, {ball: [0.1, 0.2]})):
        hits += np.any(step.contacts["hole"].force != 0.0)
        (x, y), (u, v) = step["at"].displacement, step["at"].velocity
        moments.append([np.hypot(u, v), x * v - y * u])
    assert hits > 20
    assert np.ptp(moments, axis=0) / np.abs(moments).max(axis=0) == pytest.approx(0.0, abs=1e-9)


def test_members_have_restitutions_of_their_own() -> None:
    """Sixteen members in lock-step move as each does alone, and a march continues from the state of another."""
    values, h = np.linspace(0.0, 1.0, 16), 1e-3
    scene = pair(0.5, 1e-3, a=300.0)
    begin = scene.state(velocity={scene.structures[0]: 1.0})
    found = gb.ensemble(scene, {"touch.restitution": values}, step=h, end=0.2, start=begin)
    for k in (0, 7, 15):
        alone = scene.with_({"touch.restitution": float(values[k])})
        half = list(gb.march(alone, h, 0.1, begin))[-1].state
        end = list(gb.march(alone, h, 0.2, half))[-1]
        assert found.q[:, k] == pytest.approx(end.state.q[:, 0], rel=1e-11)


def test_impacts_of_impulses_have_no_duration_and_no_peak_force(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ball that bounces: times, speeds and impulses of free fall; no advice on steps, which would change nothing."""
    monkeypatch.delenv("GAPBEAM_ERRORS")
    ball, e, g, high, h = gb.mass(1.3, name="ball"), 0.8, 9.81, 0.1, 1e-5
    floor = gb.Contact(ball["at"], gb.HalfPlane(0.0), gb.Unilateral(restitution=e), offset=-high, name="floor")
    scene = gb.Scene(ball, contacts=[floor], loads=[gb.weight(ball, g, name="weight")])
    outcome = gb.run(scene, step=h, end=0.8, every=10, output=tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    fall, speed = np.sqrt(2.0 * high / g), np.sqrt(2.0 * g * high) * e ** np.arange(4)
    times = fall + np.append(0.0, np.cumsum(2.0 * e * speed[:-1] / g))
    found = np.loadtxt(tmp_path / "run" / "impacts.csv", delimiter=",", skiprows=1, usecols=range(1, 5))
    wanted = np.column_stack([times, speed, 1.3 * (1.0 + e) * speed, 0.0 * speed])
    assert found == pytest.approx(wanted, rel=1e-3, abs=1e-12)
    summary, history = outcome.summary, gb.open_results(outcome).history
    assert float(history["contact_time"][-1, 0]) == 0.0
    assert float(history["closings"][-1, 0]) == 4.0
    assert summary["peak_contact_force"] == {}
    assert summary["assumptions"] == []
    assert not [words for words in summary["warnings"] if "resolved" in words or "mean force" in words]
    figures = {one["name"]: one for one in summary["errors"]["figures"]}
    assert not [name for name in figures if name.endswith("force")]
    (row,) = [one for one in summary["closing"]["rows"] if one["figure"] == "floor impulse"]
    assert row["verdict"] == "good"
    exact = wanted[:, 2].sum()
    assert abs(figures["floor impulse"]["value"] - exact) <= max(figures["floor impulse"]["error"], 1e-3 * exact)
    (page,) = gb.report(tmp_path / "run", pdf=False)
    assert "the law is impulses, which act at once" in page.read_text(encoding="utf-8")


def test_a_block_at_rest_stays_in_contact(tmp_path: Path) -> None:
    """A weight on a floor without restitution: one contact from its fall on, as long as its load is a weight."""
    block, h = gb.mass(2.0, name="block"), 1e-4
    floor = gb.Contact(block["at"], gb.HalfPlane(1e-3), gb.Unilateral(restitution=0.0), name="floor")
    away = gb.Force(block["at"], lambda t: np.where(np.asarray(t) < 0.5, 20.0, -20.0), name="load")
    outcome = gb.run(gb.Scene(block, contacts=[floor], loads=[away]), step=h, end=0.6, output=tmp_path / "run")
    fall, speed = np.sqrt(2.0 * 1e-3 / 10.0), np.sqrt(2.0 * 1e-3 * 10.0)
    (row,) = np.loadtxt(tmp_path / "run" / "impacts.csv", delimiter=",", skiprows=1, usecols=range(1, 5), ndmin=2)
    assert row == pytest.approx([fall, speed, 10.0, 0.5 - fall], abs=2.0 * h * 20.0)
    assert outcome.summary["contact_episodes"]["episodes"] == 0


CASE: dict[str, Any] = {
    "structure": [
        {"name": "a", "model": {"type": "mass", "mass": 2.0}, "velocity": 1.3},
        {"name": "b", "model": {"type": "mass", "mass": 0.7, "stiffness": 50.0}},
    ],
    "pair": [{"name": "touch", "between": ["a.at", "b.at"], "region": {"type": "half-plane", "clearance": 0.0103},
              "law": {"type": "unilateral", "restitution": 0.5}}],
    "time": {"end": 0.02},
}  # fmt: skip


def test_file_has_exact_contact_and_a_step_that_its_law_does_not_shorten() -> None:
    """The law of a [[pair]] is that of Python."""
    read = read_scene(CASE)
    found = gb.history(read.scene, read.step, 0.02, read.start())
    a, b = gb.mass(2.0, name="a"), gb.mass(0.7, stiffness=50.0, name="b")
    touch = gb.Contact((a["at"], b["at"]), gb.HalfPlane(0.0103), gb.Unilateral(restitution=0.5), name="touch")
    scene = gb.Scene(a, b, contacts=[touch])
    same = gb.history(scene, read.step, 0.02, scene.state(velocity={a: 1.3}))
    assert np.array_equal(found.force["touch"], same.force["touch"])
    assert np.count_nonzero(same.force["touch"]) == 1


def test_faces_of_two_meshes_bear_a_weight(tmp_path: Path) -> None:
    """A sled on a base whose nodes lie elsewhere: impulses and weight make its momentum, and the energy adds up."""
    tables, h = sled(tmp_path), 1e-5
    tables["contact"] = {"law": {"type": "unilateral", "restitution": 0.0}}
    tables["load"].pop()
    del tables["start"]
    scene = read_scene(tables).scene
    found = gb.history(scene, h, 0.02)
    force = -sum(found.force[one.name] for one in scene.contacts)
    weight = 0.1 * 0.02 * 0.1 * 7800.0 * 9.81
    own = slice(0, scene.start[1])
    momentum = scene.load_columns[own, 0] @ found.last.state.v[own, 0]
    assert h * force.sum() == pytest.approx(weight * 0.02 - momentum, rel=1e-9)
    assert force[1000:].mean() == pytest.approx(weight, rel=1e-3)
    assert found.last.energy["law"] > 0.0
    assert abs(found.last.balance) < 1e-9 * found.last.energy["loads"]


def moved(restitution: float = 0.5, motions: int = 1, scheme: Any = None, **given: Any) -> None:
    """Make the contact of a mass with these values, and march it."""
    ball, law = gb.mass(1.0, motions=motions, name="ball"), gb.Unilateral(restitution=restitution)
    stop = gb.Contact(ball["at"], law=law, **{"region": gb.HalfPlane(1e-3), "name": "stop", **given})
    scene = gb.Scene(ball, contacts=[stop])
    gb.history(scene, 1e-3, 1e-2, scheme=scheme or gb.midpoint())


def test_what_impulses_cannot_do_is_refused_by_name() -> None:
    """Restitutions beyond 1, friction, corners, and schemes that have other velocities."""
    square = gb.Polygon([(-1e-3, -1e-3), (1e-3, -1e-3), (1e-3, 1e-3), (-1e-3, 1e-3)])
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("restitution.*0 to 1", {"restitution": 1.2}),
        ("restitution", {"restitution": -0.1}),
        ("friction.*stiff law", {"friction": 0.1, "motions": 2, "region": gb.Disc(1e-3)}),
        ("HalfPlane, Slot or Disc", {"motions": 2, "region": square}),
        ("stop.*midpoint", {"scheme": gb.newmark()}),
        ("stop.*midpoint", {"scheme": gb.midpoint(exact_frequencies=True)}),
    ]
    for words, given in wrong:
        with pytest.raises(gb.UserError, match=words):
            moved(**given)
    point = gb.mass(1.0, ahead=[[1.0]], name="way")
    way = gb.moving_point([point["at"], point["ahead"]], [0.0, 1.0], 1.0)
    with pytest.raises(gb.UserError, match="moves along"):
        gb.Contact((gb.mass(1.0, name="car")["at"], way), gb.HalfPlane(0.0), gb.Unilateral(restitution=0.0))
    flat = {**CASE["pair"][0], "region": {"type": "half-plane", "clearance": 1.0, "normal": [1.0, 0.0]}}
    for key, value, words in (
        ("law", {"type": "unilateral", "restitution": 1.5}, "restitution"),
        ("friction", 0.1, "friction"),
        ("region", {"type": "polygon", "corners": [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]]}, "HalfPlane, Slot or Disc"),
    ):
        bodies = [{"name": name, "model": {"type": "mass", "mass": 1.0, "motions": 2}} for name in "ab"]
        with pytest.raises(gb.CaseError, match=words):
            read_scene({**CASE, "structure": bodies, "pair": [{**flat, key: value}]})


def knocking() -> dict[str, Any]:
    """Return the tables of a mass that strikes another one, and of a third that nothing strikes."""
    return {
        "structure": [
            {"name": "a", "model": {"type": "mass", "mass": 2.0}, "velocity": 1.3},
            {"name": "b", "model": {"type": "mass", "mass": 0.7}},
            {"name": "c", "model": {"type": "mass", "mass": 1.0, "stiffness": 1e3}, "velocity": 1.0},
        ],
        "pair": [{"name": "touch", "between": ["a.at", "b.at"], "region": {"type": "half-plane", "clearance": 0.0103},
                  "law": {"type": "unilateral", "restitution": 0.4}}],
        "time": {"step": 1e-3, "end": 0.04},
    }  # fmt: skip


SIZES = ({"statistic": "maximum"}, {"statistic": "minimum"}, {"statistic": "peak-to-peak"}, {"statistic": "rms"},
         {"statistic": "quantile", "level": 0.9}, {"statistic": "share", "limit": 1.0},
         {"statistic": "value", "time": 0.02})  # fmt: skip


@pytest.mark.parametrize("keys", SIZES, ids=lambda one: one["statistic"])
@pytest.mark.parametrize(
    ("quantity", "place"),
    [("contact_force", "touch"), ("acceleration_relative", "b.at"), ("acceleration_absolute", "a.at")],
)
def test_sizes_that_an_impulse_makes_follow_the_step_are_refused(quantity: str, place: str, keys: Any) -> None:
    """Of the pair and of what it strikes, by run and by file; not of a mass beside, nor of velocities."""
    asked = {"name": "own", "quantity": quantity, "place": place, **keys}
    with pytest.raises(gb.CaseError, match=r"\[\[figure\]\] number 1 .* quantity") as refused:
        read_scene(knocking() | {"figure": [asked]})
    assert "which impulses strike" in str(refused.value)
    scene = gb.scene(knocking())
    with pytest.raises(gb.UserError, match="which impulses strike"):
        gb.run(scene, step=1e-3, end=0.04, figures=[gb.figure(**asked)], output="unused")
    for free in ({"place": "c.at", "quantity": "acceleration_relative"}, {"place": "a.at", "quantity": "velocity"}):
        read_scene(knocking() | {"figure": [asked | free]})


def test_means_that_an_impulse_leaves_do_not_follow_the_step(tmp_path: Path) -> None:
    """The mean force is the impulse over the time, the mean acceleration the change of velocity, at any step."""
    given = knocking() | {"figure": [
        {"name": "push", "quantity": "contact_force", "place": "touch", "statistic": "mean"},
        {"name": "gain", "quantity": "acceleration_relative", "place": "b.at", "statistic": "mean"},
    ]}  # fmt: skip
    impulse = 1.4 * 1.3 * 2.0 * 0.7 / 2.7
    for step in (1e-3, 2.5e-4):
        given["time"] = {"step": step, "end": 0.04}
        found = gb.run(given, output=tmp_path / f"{step}").summary["figures"]
        assert found["push"]["value"] == pytest.approx(impulse / 0.04, rel=1e-9)
        assert found["gain"]["value"] == pytest.approx(impulse / 0.7 / 0.04, rel=1e-9)
    scene = gb.scene(given).with_({"touch.clearance": 0.01})
    with pytest.raises(gb.UserError, match="impulses"):
        gb.ensemble(scene, {"touch.restitution": np.array([0.1, 0.9])}, step=1e-3, end=0.04,
                    figures=[gb.figure("own", "contact_force", "touch")])  # fmt: skip


@pytest.mark.parametrize("seed", range(12))
def test_a_seat_is_the_least_energy_that_walls_allow(seed: int) -> None:
    """Drawn structures on springs against drawn stops: forces of a nonnegative least-squares problem, by SciPy."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(2, 6, 2)
    bodies = []
    for name, n in zip("ab", sizes, strict=True):
        root, spring = rng.standard_normal((2, n, n))
        M, K = root @ root.T + np.eye(n), 10.0 ** rng.uniform(2.0, 6.0) * (spring @ spring.T + 0.1 * np.eye(n))
        bodies.append(gb.Structure(M, K, points={f"p{i}": i for i in range(n)}, name=name))
    a, b = bodies
    scale = 50.0 / max(np.abs(one.K).max() for one in bodies)
    gaps, law = scale * rng.uniform(-0.2, 1.0, 4), gb.Unilateral(rng.uniform(0.0, 1.0))
    ends = [a["p0"], b["p0"], (a["p1"], b["p1"]), (b["p1"], a["p0"])]
    contacts = [gb.Contact(end, gb.HalfPlane(gap), law) for end, gap in zip(ends, gaps, strict=True)]
    f = 50.0 * rng.standard_normal(sum(sizes))
    loads = [gb.Load(a, f[: sizes[0]], 1.0), gb.Load(b, f[sizes[0] :], 1.0)]
    scene = gb.Scene(a, b, contacts=contacts, loads=loads)
    rest = gb.seat(scene)
    N = np.zeros((4, sum(sizes)))
    N[0, 0] = N[1, sizes[0]] = N[2, 1] = N[3, sizes[0] + 1] = 1.0
    N[2, sizes[0] + 1] = N[3, 0] = -1.0
    K = sla.block_diag(a.K, b.K)
    L = np.linalg.cholesky(N @ np.linalg.solve(K, N.T))
    forces, _ = nnls(L.T, np.linalg.solve(L, N @ np.linalg.solve(K, f) - gaps))
    assert np.count_nonzero(forces) > 0
    assert -rest.F[:, 0] == pytest.approx(forces, abs=1e-7 * max(np.abs(forces).max(), 1.0))
    y = scene.places(rest.q, 0.0)[:, 0]
    assert np.all(y - gaps <= 1e-9 * np.abs(y).max())


def test_a_seat_in_slots_and_holes_stays_at_rest_when_it_is_marched() -> None:
    """A beam in slots, a stack of masses and a mass in a hole: closed forms, and motions of round-off at any step."""
    section, steel = gb.section("rectangle", 0.012, 0.02), gb.material(2.1e11, 7850.0)
    beam = gb.beam(0.5, section, steel, {"a": 0.0, "b": 0.06, "c": 0.3, "tip": 0.5}, modes=12, name="beam")
    law = gb.Unilateral(0.4)
    slots = [gb.Contact(beam[name], gb.Slot(1e-4), law, name=name) for name in "abc"]
    rod = gb.Scene(beam, contacts=slots, loads=[gb.weight(beam, -9.81), gb.Force(beam["tip"], -3.0)])
    stack = [gb.mass(value, name=f"m{value:g}") for value in (2.0, 3.0, 5.0)]
    floor = gb.Contact(stack[0]["at"], gb.HalfPlane(1e-3, -1), law)
    pile = [gb.Contact((one["at"], two["at"]), gb.HalfPlane(2e-3), law) for one, two in pairwise(stack)]
    tower = gb.Scene(*stack, contacts=[floor, *pile], loads=[gb.weight(one, -9.81) for one in stack])
    ball = gb.mass(2.0, 2, 100.0)
    hole = gb.Contact(ball["at"], gb.Disc(1e-3), law)
    round_hole = gb.Scene(ball, contacts=[hole], loads=[gb.Force(ball["at"], 5.0, [0.6, 0.8])])
    total = 9.81 * 7850.0 * section.area * 0.5 + 3.0
    rests = [gb.seat(scene) for scene in (rod, tower, round_hole)]
    assert rests[0].F.sum() == pytest.approx(total, rel=1e-9)
    assert rests[1].F[:, 0] == pytest.approx([98.1, -78.48, -49.05], rel=1e-9)
    assert np.linalg.norm(rests[2].F) == pytest.approx(5.0 - 100.0 * 1e-3, rel=1e-9)
    for scene, rest in zip((rod, tower, round_hole), rests, strict=True):
        for step in (1e-3, 1e-5):
            found = gb.history(scene, step, 100 * step, start=rest)
            for one in found.displacement.values():
                assert np.abs(one - one[0]).max() < 1e-9 * np.abs(one).max()
            forces = np.concatenate([one.reshape(len(found.t), -1) for one in found.force.values()], axis=1)
            assert np.abs(forces - rest.F[:, 0]).max() < 1e-6 * np.abs(rest.F).max()
    pulled = gb.Scene(*stack[:1], contacts=[floor], loads=[gb.Force(stack[0]["at"], 1.0)])
    with pytest.raises(gb.NoSeat):
        gb.seat(pulled)


def test_a_file_with_exact_contact_begins_at_its_seat(tmp_path: Path) -> None:
    """Without another load, the run stays there: the impulse is the weight times the time."""
    given = {
        "structure": [{"name": "box", "model": {"type": "mass", "mass": 2.0}}],
        "pair": [{"name": "floor", "between": ["box.at"], "law": {"type": "unilateral", "restitution": 0.5},
                  "region": {"type": "half-plane", "clearance": 1e-3, "normal": -1}}],
        "load": [{"type": "gravity"}],
        "start": {"state": "seat"},
        "time": {"step": 1e-3, "end": 0.1},
    }  # fmt: skip
    outcome = gb.run(given, output=tmp_path / "run")
    assert outcome.exit_status == 0, outcome.message
    assert float(outcome.history.impulse[-1, 0]) == pytest.approx(2.0 * 9.81 * 0.1, rel=1e-9)
