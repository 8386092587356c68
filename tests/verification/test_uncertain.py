"""Uncertain values: probabilities and Sobol indices against closed forms, responses against exact flights."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import gapbeam as gb
from gapbeam.solver.scene.scene import Scene
from gapbeam.studies.uncertain.member_responses import OTHER_WORK, WORK, KeptAnswers, members_of_block
from gapbeam.studies.uncertain.probability import (
    indices_of,
    inputs_of,
    mean_of,
    normal_points,
    probability,
    subset_simulation,
)
from tests.shared.bilinear_flights import flights
from tests.shared.reports import report_on

Z, K, G = 0.04, 30.0, 0.5


def oscillator(stop: bool = True, damping: float = 2 * Z) -> Scene:
    body = gb.mass(1.0, stiffness=1.0, damping=damping, name="body")
    contacts = [gb.Contact(body["at"], gb.HalfPlane(G), gb.KelvinVoigt(stiffness=K), name="stop")] if stop else []
    push = gb.Force(body["at"], lambda t, F, W: F * np.cos(W * t), name="push", F=0.1, W=1.0)
    return gb.Scene(body, contacts=contacts, loads=[push])


def ishigami(x: dict[str, Any]) -> dict[str, Any]:
    a, b, c = x.values()
    return {"y": np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)}


def covered(found: Any, exact: float) -> bool:
    return bool(found.low <= exact <= found.high)


def test_correlated_values_have_their_distributions_and_ranks() -> None:
    """Quantiles and rank correlations of three inputs; far tails keep their digits."""
    given = {"a": stats.norm(1.0, 0.1), "b": stats.lognorm(0.5), "c": stats.uniform(2.0, 3.0)}
    inputs = inputs_of(given, {("a", "b"): 0.6, ("b", "c"): -0.4})
    normal = normal_points("sobol", 2**14, 8, 3, 1)
    assert normal.shape == (8, 2048, 3)
    values = inputs.values(normal.reshape(-1, 3))
    for path, one in given.items():
        assert stats.kstest(values[path], one.cdf).statistic < 0.005
    for pair, rank in {("a", "b"): 0.6, ("b", "c"): -0.4, ("a", "c"): 0.0}.items():
        assert stats.spearmanr(values[pair[0]], values[pair[1]]).statistic == pytest.approx(rank, abs=0.01)
    far = inputs_of({"a": stats.expon()}).values(np.array([[9.0], [-9.0]]))["a"]
    assert far == pytest.approx([-stats.norm.logsf(9.0), stats.norm.cdf(-9.0)], rel=1e-9)


def test_indices_of_ishigami_lie_in_their_intervals() -> None:
    """First and total indices of the function of Ishigami and Homma (1990), by their closed forms."""
    angle = stats.uniform(-np.pi, 2 * np.pi)
    found = gb.uncertain(ishigami, {"a": angle, "b": angle, "c": angle}, members=64, sensitivity=2048)
    one, v1 = found.indices["y"], 0.5 * (1 + 0.1 * np.pi**4 / 5) ** 2
    v2, v13 = 49.0 / 8.0, 0.01 * np.pi**8 * (1 / 18 - 1 / 50)
    first, total = np.array([v1, v2, 0.0]), np.array([v1 + v13, v2, v13])
    for value, interval in ((first, one.first_interval), (total, one.total_interval)):
        share = value / (v1 + v2 + v13)
        assert np.all(interval[:, 0] - 1e-3 <= share)
        assert np.all(share <= interval[:, 1] + 1e-3)
    assert np.ptp(one.first_interval, axis=1).max() < 0.15
    assert np.abs(one.half_total - one.total).max() < 0.1
    assert not one.missing


@pytest.mark.parametrize("shares", [(1.0,), (0.7, 0.3), (0.5, 0.3, 0.2)])
def test_indices_of_any_number_of_inputs(shares: tuple[float, ...]) -> None:
    """Of a sum with these shares of the variance; a single input, which has all of it, ended in a traceback."""
    one = indices_of(lambda u: {"y": u @ np.sqrt(shares)}, len(shares), 4096, 1)["y"]
    for value, interval in ((one.first, one.first_interval), (one.total, one.total_interval)):
        assert value == pytest.approx(shares, abs=0.03)
        assert np.all((interval[:, 0] <= value) & (value <= interval[:, 1]))


@pytest.mark.parametrize("missing", [1, 40, 150])
def test_indices_have_any_number_of_points_without_a_figure(missing: int) -> None:
    """Of the sum of two equal inputs each has half of the variance, whichever points have no figure."""

    def summed(u: np.ndarray) -> dict[str, np.ndarray]:
        y = u.sum(axis=1)
        y[np.random.default_rng(missing).choice(256, missing, replace=False)] = np.nan
        return {"y": y}

    one = indices_of(summed, 2, 256, 1)["y"]
    assert one.missing == pytest.approx(missing / 256)
    assert np.all((one.first_interval[:, 0] <= 0.5) & (one.first_interval[:, 1] >= 0.5))
    assert one.total == pytest.approx([0.5, 0.5], abs=0.15)


def test_intervals_of_independent_members_cover() -> None:
    """1000 repetitions: 93 to 97 % of the intervals hold the probability, and the mean."""
    draw = np.random.default_rng(3)
    hits = means = 0
    for _ in range(1000):
        y = draw.standard_normal((4, 250))
        everything = np.ones(y.shape, dtype=bool)
        hits += covered(probability(y > 1.0, everything, True), float(stats.norm.sf(1.0)))
        means += covered(mean_of(y, y > 1.0, True), float(stats.norm.pdf(1.0) / stats.norm.sf(1.0)))
    assert 930 <= hits <= 970
    assert 930 <= means <= 970


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("sampling", ["sobol", "latin"])
def test_intervals_of_replicates_cover(sampling: Any) -> None:
    """1000 repetitions of 16 replicates: 93 to 97 %; and they are narrower than those of independent members."""
    hits = means = 0
    width = 0.0
    for seed in range(1000):
        x = normal_points(sampling, 512, 16, 2, seed).sum(axis=2) / np.sqrt(2.0)
        everything = np.ones(x.shape, dtype=bool)
        one = probability(x > 1.0, everything, False)
        hits += covered(one, float(stats.norm.sf(1.0)))
        means += covered(mean_of(x, x > 1.0, False), float(stats.norm.pdf(1.0) / stats.norm.sf(1.0)))
        width += (one.high - one.low) / 1000
    assert 930 <= hits <= 970
    assert 930 <= means <= 970
    assert width < 2 * 1.96 * np.sqrt(0.1587 * 0.8413 / 512)


@pytest.mark.parametrize("inputs", [1, 2, 4])
@pytest.mark.parametrize(("replicates", "members"), [(2, 64), (4, 64), (8, 128)])
def test_intervals_of_few_replicates_cover(inputs: int, replicates: int, members: int) -> None:
    """At least 93 % of the intervals hold the probability, though replicates often have the same number of members."""
    draw, hits = np.random.default_rng(5), 0
    for seed in range(300):
        share = draw.uniform(0.25, 0.75)
        x = normal_points("sobol", members, replicates, inputs, seed).sum(axis=2) / np.sqrt(inputs)
        hits += covered(probability(x > stats.norm.isf(share), np.ones(x.shape, dtype=bool), False), share)
    assert hits >= 279


@pytest.mark.slow(minutes=0.5)
def test_intervals_of_subset_simulation_cover() -> None:
    """1000 repetitions at a probability of 1e-4: 93 to 97 %, and their mean is off by less than 2 %."""
    limit, found = float(stats.norm.isf(1e-4)), []
    for seed in range(1000):
        found.append(subset_simulation(lambda u: u.sum(axis=1) / np.sqrt(2.0), 2, limit, 500, 20, seed))
    assert 930 <= sum(covered(one, 1e-4) for one in found) <= 970
    values = np.array([one.value for one in found])
    assert values.mean() == pytest.approx(1e-4, rel=0.02)


def test_rare_event_of_a_plateau_is_not_invented() -> None:
    """Figures that are equal, such as no force, are no threshold; a limit that nothing comes to is said."""
    flat = subset_simulation(lambda u: np.maximum(u[:, 0] - 2.0, 0.0), 1, 1.5, 400, 10, 0)
    assert covered(flat, float(stats.norm.sf(3.5)))
    assert flat.complete
    never = subset_simulation(lambda u: np.minimum(u[:, 0], 1.0), 1, 2.0, 200, 4, 0)
    assert never.value == 0.0
    assert not never.complete


@pytest.mark.slow(minutes=0.5)
def test_exceedance_of_a_linear_oscillator() -> None:
    """Peak |F| / |H|, F normal: its probability beyond limits down to 1e-4, by members and by subset simulation."""
    W, damping, one = 0.6, 0.5, oscillator(stop=False, damping=0.5).with_({"push.W": 0.6})
    size = 1.0 / np.hypot(1 - W * W, damping * W)
    steps = 100
    limit = float(size * stats.norm.isf(0.5e-4))
    found = gb.uncertain(
        one, {"push.F": stats.norm(0.0, 1.0)}, limits={"peak/at": limit}, rare=True, rare_members=200, members=512,
        period=2 * np.pi / W, steps=steps, settle=8, orders=1, measure=1, rounds=2,
        scheme=gb.midpoint(exact_frequencies=True),
    )  # fmt: skip
    assert list(found.responses) == ["order 1: no contact"]
    assert covered(found.rare["peak/at"], 1e-4)
    assert found.rare["peak/at"].high < 3e-4
    assert covered(found.exceeded["peak/at"], 1e-4)
    spread = found.distributions["order 1: no contact", "peak/at"]
    assert spread.mean.low <= size * np.sqrt(2 / np.pi) * 1.001
    assert spread.mean.high >= size * np.sqrt(2 / np.pi) * 0.999
    assert spread.quantiles[0.5] == pytest.approx(size * stats.halfnorm.median(), rel=0.01)


@pytest.mark.slow(minutes=0.5)
def test_responses_are_those_of_exact_flights(tmp_path: Path) -> None:
    """Orders 1, 2 and 6 coexist: each member's response is that of event-driven flights; files and report agree."""
    W, F = 2.6, 0.6 * G * np.hypot(1 - 2.6**2, 2 * Z * 2.6)
    scene = oscillator().with_({"push.W": W})
    starts = gb.drawn_starts(scene, 64, {"at": (-1.0, 0.6)}, {"at": (-1.0, 1.0)}, 1)
    asked: dict[str, Any] = {
        "members": 64, "replicates": 4, "sampling": "latin", "period": 2 * np.pi / W, "starts": starts,
        "limits": {"peak/at": 0.52}, "output": tmp_path / "found", "measure": 12,
    }  # fmt: skip
    given = {"push.F": stats.uniform(F, 1e-3)}
    calls: list[int] = []
    found = gb.uncertain(scene, given, progress=calls.append, **asked)
    assert found.exit_status == 0
    assert sum(one.value for one in found.responses.values()) == pytest.approx(1.0)
    assert len(np.unique(found.values["start"])) > 30
    same = 0
    for i in range(64):
        x = starts.q[0, int(found.values["start"][i])], starts.v[0, int(found.values["start"][i])]
        late = flights(*x, Z, K, G, found.values["push.F"][i], W, 160, 96)
        order = next((n for n in range(1, 9) if np.abs(late[-1] - late[-1 - n]).max() < 1e-4), 0)
        same += found.response[i].startswith(f"order {order}:")
    assert same >= 62
    rows = list(csv.DictReader((tmp_path / "found" / "members.csv").open()))
    assert [row["response"] for row in rows] == found.response.tolist()
    (record,) = json.loads((tmp_path / "found" / "uncertain.json").read_text())
    assert record["responses"] == len(found.responses)
    assert [one.title for one in report_on([tmp_path / "found"], "gapbeam report").sections] == ["Summary", "Picture"]
    again = gb.uncertain(scene, given, **asked)
    assert again.figures["peak/at"].tolist() == found.figures["peak/at"].tolist()
    with pytest.raises(gb.UserError, match="another ensemble"):
        gb.uncertain(scene, given, **(asked | {"steps": 200}))


CUT: list[Callable[[bytes], bytes]] = [
    lambda whole: whole[:0],
    lambda whole: whole[: len(whole) // 2],
    lambda whole: whole[:200] + b"x" * 60 + whole[260:],
]
"""Damage of a file of arrays: empty, cut, and overwritten."""


def test_a_study_that_was_killed_continues(tmp_path: Path) -> None:
    """Blocks that are done are not computed again; members that fail are said."""
    calls = tmp_path / "calls"

    def square(x: dict[str, Any]) -> dict[str, Any]:
        with calls.open("ab") as file:
            file.write(b".")
        return {"y": np.where(x["a"] > 3.0, np.nan, x["a"] ** 2)}

    def killed(done: int) -> None:
        if done > 2000:
            raise KeyboardInterrupt

    asked: dict[str, Any] = {"members": 4096, "limits": {"y": 1.0}, "output": tmp_path / "x"}
    with pytest.raises(KeyboardInterrupt):
        gb.uncertain(square, {"a": stats.norm()}, progress=killed, **asked)
    assert calls.stat().st_size == 2
    found = gb.uncertain(square, {"a": stats.norm()}, **asked)
    assert calls.stat().st_size == 4
    for number, (path, content) in enumerate(zip((tmp_path / "x" / "kept").glob("*.npz"), CUT, strict=False)):
        path.write_bytes(content(path.read_bytes()))
        again = gb.uncertain(square, {"a": stats.norm()}, **asked)
        assert calls.stat().st_size == 5 + number
        assert np.array_equal(again.figures["y"], found.figures["y"], equal_nan=True)
    assert found.exit_status == 5
    assert found.unknown == pytest.approx(stats.norm.sf(3.0), abs=2e-4)
    exact = 2 * stats.norm.sf(1.0)
    assert found.exceeded["y"].low <= exact - stats.norm.sf(3.0)
    assert found.exceeded["y"].high >= exact


NORMAL = {"push.F": stats.norm(0.1, 0.01)}


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"distributions": {}}, "one distribution or more"),
        ({"distributions": {"push.F": stats.norm}}, "with its parameters"),
        ({"distributions": {"push.F": 3.0}}, "with its parameters"),
        ({"distributions": {"push.F": stats.norm(0.0, -1.0)}}, "no finite quantiles"),
        ({"distributions": {"push.G": stats.norm()}}, "has no 'G'"),
        ({"distributions": {"stop.stiffness": stats.norm(1.0, 1.0)}}, "truncnorm"),
        ({"distributions": NORMAL | {"start": stats.norm()}}, "the input of several starts"),
        ({"correlation": {("push.F", "push.G"): 0.5}}, "expected a pair"),
        ({"correlation": {("push.F", "stop.clearance"): 1.0}}, "between -1 and 1"),
        ({"limits": {"peak/tip": 1.0}}, "no figure 'peak/tip'; did you mean peak/at"),
        ({"limits": {"peak/at": float("nan")}}, "finite"),
        ({"members": 1000}, "expected as many in each, 2 at least; take 1024 members"),
        ({"members": 1000, "sampling": "random"}, "take 992 members"),
        ({"members": 96}, "power of two"),
        ({"replicates": 1}, "their scatter gives the error"),
        ({"sampling": "grid"}, 'expected "sobol"'),
        ({"sensitivity": 100}, "power of two"),
        ({"rare_members": 5}, "100 rare_members"),
        ({"period": None}, "needs the period"),
        ({"period": 3.0}, "does not repeat"),
        ({"period": -1.0}, "above 0"),
        ({"measure": 0}, "from 1 on"),
        ({"scheme": gb.newmark()}, "accelerations as states"),
        ({"model": 3.0}, "a scene or a function"),
        ({"model": lambda x: x["push.F"], "period": None}, "figures by name"),
        ({"model": lambda _: {"y": 1.0}, "period": None}, "one number for each"),
        ({"model": lambda x: {"y": x["push.F"]}}, "no period, starts or own figures"),
    ],
)
def test_nonsense_is_refused(asked: dict[str, Any], says: str) -> None:
    """Messages name what was found, and what was expected."""
    two = {"push.F": stats.norm(0.1, 0.01), "stop.clearance": stats.norm(0.5, 0.01)}
    given: dict[str, Any] = {
        "model": oscillator(), "distributions": two, "period": 2 * np.pi, "members": 32, "steps": 20, "settle": 1,
        "orders": 1, "rounds": 1, "measure": 1, "exponents": 50,
    }  # fmt: skip
    with pytest.raises(gb.UserError, match=says):
        gb.uncertain(**(given | asked))


def test_correlations_that_contradict_each_other_are_refused() -> None:
    """Three pairs cannot all be opposed; Sobol indices need independent inputs."""
    given = {name: stats.norm() for name in "abc"}
    with pytest.raises(gb.UserError, match="contradict each other"):
        gb.uncertain(ishigami, given, correlation=dict.fromkeys((("a", "b"), ("b", "c"), ("a", "c")), -0.9))
    with pytest.raises(gb.UserError, match="independent inputs"):
        gb.uncertain(ishigami, given, correlation={("a", "b"): 0.5}, sensitivity=64)


def test_a_misspelled_limit_is_refused_before_members_march(monkeypatch: pytest.MonkeyPatch) -> None:
    """All figures of members have a name and a unit that are known beforehand."""
    body, law = gb.mass(1.0, stiffness=1.0, damping=0.08, name="body"), gb.KelvinVoigt(stiffness=30.0)
    stops = [gb.Contact(body["at"], gb.HalfPlane(0.5), law, name=f"stop {i}") for i in (1, 2)]
    shaker = gb.Force(body["at"], lambda t, size: size * np.cos(2.6 * t), name="shaker", size=1.7)

    def beside(damping: float) -> gb.Scene:
        other = gb.mass(1.0, stiffness=2.0, damping=damping, motions=2, name="other")
        return gb.Scene(body, other, contacts=stops, loads=[shaker])

    asked: dict[str, Any] = {"members": 32, "period": 2 * np.pi / 2.6, "steps": 60, "settle": 20, "measure": 2}
    given, limits = {"shaker.size": stats.uniform(1.6, 0.2)}, {"peak_force/stop": 1.0}
    never = gb.uncertain(beside(0.0), given, limits=limits, **asked)
    assert (never.unknown, never.exit_status) == (1.0, 5)
    assert (never.exceeded["peak_force/stop"].low, never.exceeded["peak_force/stop"].high) == (0.0, 1.0)
    twin = beside(0.5)
    found = gb.uncertain(twin, given, limits=limits, **asked)
    assert list(found.units) == list(found.figures)
    assert set(found.units.values()) == {"m", "N", "1/s", "W", ""}
    assert found.probability_rows()[1][-1][0] == "peak_force/stop > 1 N"
    monkeypatch.setattr(KeptAnswers, "__call__", None)
    with pytest.raises(gb.UserError, match=r"no figure 'peak_force/stopp'; did you mean peak_force/stop\?"):
        gb.uncertain(twin, given, limits={"peak_force/stopp": 1.0}, **asked)


@pytest.mark.parametrize("seed", range(4))
def test_blocks_of_slow_members_are_smaller(seed: int) -> None:
    """A block takes no more than `WORK`, unless it is the least, and no less than half of it, unless it is all."""
    random = np.random.default_rng(seed)
    masses = [gb.mass(1.0, stiffness=1.0, name=f"m{i}") for i in range(int(random.integers(1, 12)))]
    contacts = [gb.Contact(one["at"], gb.HalfPlane(0.5), gb.KelvinVoigt(stiffness=3.0)) for one in masses]
    scene = gb.Scene(*masses, contacts=contacts)
    for steps in np.geomspace(1e3, 1e9, 13).astype(int):
        size, each = members_of_block(scene, int(steps)), int(steps) * (OTHER_WORK + len(masses) ** 2)
        assert size * each <= WORK or size == 64
        assert 2 * size * each > WORK or size == 1024
        assert size in (64, 128, 256, 512, 1024)


def test_a_folder_without_blocks_takes_another_study(tmp_path: Path) -> None:
    """A study that was stopped before its first block leaves nothing that could be mistaken."""
    asked: dict[str, Any] = {"members": 64, "output": tmp_path / "x"}

    def stopped(_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gb.uncertain(lambda x: {"y": x["a"]}, {"a": stats.norm()}, progress=stopped, **asked)
    found = gb.uncertain(lambda x: {"y": 2.0 * x["a"]}, {"a": stats.norm()}, **asked)
    assert np.allclose(found.figures["y"], 2.0 * found.values["a"])
    with pytest.raises(gb.UserError, match="another ensemble"):
        gb.uncertain(lambda x: {"y": 3.0 * x["a"]}, {"a": stats.norm()}, **asked)
