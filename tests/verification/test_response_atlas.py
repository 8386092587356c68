"""The atlas of the bilinear oscillator against exact flights: responses, shares, multipliers; and what it refuses."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, root

import gapbeam as gb
from gapbeam.solver.scene.linear_scheme import MIDPOINT
from gapbeam.solver.scene.scene import Scene
from gapbeam.studies.atlas.response_atlas import Atlas, Response
from gapbeam.studies.atlas.response_search import StrobeMap, shoot
from tests.shared.bilinear_flights import attractors, flights

Z, K, G = 0.04, 30.0, 0.5


def oscillator() -> Scene:
    body = gb.mass(1.0, stiffness=1.0, damping=2 * Z, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(G), gb.KelvinVoigt(stiffness=K), name="stop")
    push = gb.Force(body["at"], lambda t, F, W: F * np.cos(W * t), name="push", F=0.1, W=1.0)
    return gb.Scene(body, contacts=[stop], loads=[push])


def force(W: float, part: float) -> float:
    """Return a part of the force up to which a motion without contact exists."""
    return float(part * G * np.sqrt((1 - W * W) ** 2 + (2 * Z * W) ** 2))


def found_at(W: float, part: float, starts: int, steps: int = 400, seed: int = 1) -> tuple[Atlas, float]:
    scene, F = oscillator().with_({"push.F": force(W, part), "push.W": W}), force(W, part)
    drawn = gb.drawn_starts(scene, starts, {"at": (-1.0, 0.6)}, {"at": (-1.0, 1.0)}, seed)
    return gb.atlas(scene, period=2 * np.pi / W, starts=drawn, steps=steps), F


def exact_orbit(one: Response, F: float, W: float) -> tuple[Any, Any]:
    """Return the state and multipliers of the exact orbit near a response, by SciPy's root finder on exact flights."""

    def after(x: Any) -> Any:
        return flights(x[0], x[1], Z, K, G, F, W, one.order, 400)[-1]

    x = root(lambda x: after(x) - x, one.strobes[0], tol=1e-12).x
    P = np.column_stack([(after(x + e) - after(x - e)) / 2e-6 for e in 1e-6 * np.eye(2)])
    return x, np.linalg.eigvals(P)


def compare(W: float, part: float, starts: int) -> list[float]:
    """Compare an atlas with exact flights from other starts; return differences of shares in standard errors."""
    found, F = found_at(W, part, starts)
    draw = np.random.default_rng(77).uniform([-1.0, -1.0], [0.6, 1.0], (starts, 2))
    exact, which = attractors(draw, Z, K, G, F, W)
    (point,) = found.points
    off = []
    assert len({tuple(one.strobes[0]) for one in point.responses}) == len(point.responses)
    for one in point.responses:
        x, multipliers = exact_orbit(one, F, W)
        assert np.abs(x - one.strobes[0]).max() < 5e-3
        match = [i for i, orbit in enumerate(exact) if len(orbit) == one.order
                 and np.abs(orbit - x).max(axis=1).min() < 1e-5]  # fmt: skip
        rare = one.count <= 3 and not match  # may have no exact flight among as many others
        assert rare or len(match) == 1, (W, part, one.order, one.share)
        p = float(np.mean(which == match[0])) if match else 0.0
        mean = 0.5 * (p + one.share)
        off.append(abs(p - one.share) / np.sqrt(2.0 * mean * (1.0 - mean) / starts + 1e-12))
        assert one.interval[0] <= one.share <= one.interval[1]
        fine = StrobeMap(
            oscillator().with_({"push.F": F, "push.W": W}), {}, np.array([2 * np.pi / W]), 12800, MIDPOINT, 0.0
        )
        (orbit,) = shoot(fine, np.array([0]), x[:, None], one.order)
        assert orbit is not None
        assert np.abs(orbit.x - x).max() < 1e-4
        assert np.allclose(np.sort_complex(orbit.multipliers), np.sort_complex(multipliers), atol=1e-3)
        product = np.exp(-2 * Z * one.order * point.period)
        assert orbit.multipliers.prod().real == pytest.approx(product, abs=1e-6)
    shares = [np.mean(which == i) for i in range(len(exact))]
    orders = [one.order for one in point.responses]
    for orbit, share in zip(exact, shares, strict=True):
        assert share < 4.0 / starts or len(orbit) in orders, (W, part, len(orbit), share)
    assert max(off) < 3.5, (W, part, off)
    return off


def test_flights_are_exact() -> None:
    """Closed forms between contacts against SciPy's integrator with short steps."""
    late = flights(0.3, -0.2, Z, K, G, 0.4, 0.9, 2, 96)[-1]
    same = solve_ivp(
        lambda t, y: [y[1], 0.4 * np.cos(0.9 * t) - 2 * Z * y[1] - y[0] - K * max(y[0] - G, 0.0)],
        (0.0, 4 * np.pi / 0.9), [0.3, -0.2], method="DOP853", rtol=1e-11, atol=1e-12, max_step=0.1,
    ).y[:, -1]  # fmt: skip
    assert np.abs(late - same).max() < 1e-7


def test_three_responses_coexist() -> None:
    """Orders 1, 2 and 6 at W = 2.6: each found once, with its share, and nothing else."""
    compare(2.6, 0.6, 96)


@pytest.mark.slow(minutes=0.5)
def test_all_responses_of_many_forces_and_frequencies() -> None:
    """Twelve pairs with one to three responses of order 1 to 6."""
    pairs = [(0.5, 1.3), (0.8, 1.3), (1.0, 0.95), (1.2, 0.6), (1.35, 0.6), (1.5, 0.6), (1.5, 0.95), (1.7, 0.6),
             (2.6, 0.6), (2.6, 1.3), (3.0, 0.6), (3.0, 1.3)]  # fmt: skip
    off = [one for W, part in pairs for one in compare(W, part, 300)]
    assert len(off) >= 18
    assert np.mean(np.array(off) < 2.0) >= 0.9, off


@pytest.mark.slow(minutes=0.2)
def test_chaos_has_the_exponent_of_exact_flights() -> None:
    """W = 4: most starts move chaotically for long; the exponent agrees with that of exact flights."""
    found, F = found_at(4.0, 0.95, 40, steps=200)
    (point,) = found.points
    assert point.chaotic > 0.6
    assert sum(one.share for one in point.responses) + point.chaotic + point.unsettled == pytest.approx(1.0)
    rates = []
    for i in np.flatnonzero(found.which[0] == -1)[:6]:
        x, away = np.array([found.starts.q[0, i], found.starts.v[0, i]]), np.array([1e-7, 0.0])
        x = flights(*x, Z, K, G, F, 4.0, 100, 96)[-1]
        for k in range(300):
            y, w = (flights(*one, Z, K, G, F, 4.0, 1, 96)[-1] for one in (x, x + away))
            grown = np.linalg.norm(w - y) / 1e-7
            x, away = y, (w - y) / grown
            rates.append(np.log(grown) * 4.0 / (2 * np.pi) if k > 30 else np.nan)
    assert point.exponent == pytest.approx(np.nanmean(rates), rel=0.25)


def test_responses_over_a_frequency() -> None:
    """Two parameters give all their combinations; a frequency has its own period; at rest at zero force."""
    scene = oscillator()
    starts = gb.gridded_starts(scene, {"at": [-0.5, 0.1]}, {"at": [-0.5, 0.0, 0.5]})
    assert starts.q[0].tolist() == [-0.5, -0.5, -0.5, 0.1, 0.1, 0.1]
    found = gb.atlas(
        scene, period=lambda at: 2 * np.pi / at["push.W"], starts=starts, steps=100,
        over={"push.W": [0.6, 1.2], "push.F": [0.0, 0.1]}, figures=[gb.figure("speed", "velocity", "at")],
    )  # fmt: skip
    assert [one.values for one in found.points] == [{"push.W": W, "push.F": F} for W in (0.6, 1.2) for F in (0.0, 0.1)]
    assert found.is_complete
    assert found.which.shape == (4, 6)
    for one in found.points:
        W, F = one.values["push.W"], one.values["push.F"]
        linear = F / np.sqrt((1 - W * W) ** 2 + (2 * Z * W) ** 2)
        free = [response for response in one.responses if not response.impacts["stop"]]
        assert len(free) == 1
        assert free[0].peak["at"] == pytest.approx(linear, rel=2e-3, abs=1e-9)
        assert free[0].figures["speed"] == pytest.approx(W * linear, rel=2e-3, abs=1e-9)
        assert one.period == pytest.approx(2 * np.pi / W)
    assert found.strobes["at"].shape[:2] == (4, 6)
    counts = gb.draw_responses(found, "at").axes[0].collections[0].get_array()
    assert np.ravel(counts).sum() == sum(len(one.responses) for one in found.points)
    basins = gb.draw_basins(found, ("at", "displacement"), ("at", "velocity"), scene, at=3)
    drawn = np.ravel(basins.axes[0].collections[0].get_array())
    assert drawn.tolist() == found.which[3].reshape(2, 3).T.ravel().tolist()
    for wrong in (
        lambda: gb.draw_responses(found, "tip"),
        lambda: gb.draw_basins(found, ("at", "x"), ("at", "y"), scene),
    ):
        with pytest.raises(gb.UserError, match="expected"):
            wrong()
    line = gb.atlas(scene, period=2 * np.pi, starts=starts, over={"push.F": np.linspace(0.02, 0.3, 8)}, steps=100)
    strobes = gb.draw_responses(line, "at").axes[0].lines
    assert sum(len(one.get_xdata()) for one in strobes) == 8 * 6 * 17


@pytest.mark.slow(minutes=0.3)
def test_followed_responses_end_where_exact_ones_do() -> None:
    """The motion without contact up to where it grazes; others to where multipliers of exact flights pass -1."""
    W = 2.6
    scene, over = oscillator().with_({"push.W": W}), np.linspace(force(W, 0.5), force(W, 1.1), 7)
    starts = gb.drawn_starts(scene, 16, {"at": (-1.0, 0.6)}, {"at": (-1.0, 1.0)}, 3)
    found = gb.atlas(scene, period=2 * np.pi / W, starts=starts, over={"push.F": over}, steps=200)
    branches = gb.follow(scene, found, period=2 * np.pi / W, steps=200)
    met = [(i, k) for one in branches for i, k in zip(np.searchsorted(over, one.values), one.numbers, strict=True)]
    kept = [(i, k) for i, k in met if k is not None]
    repeat = [(i, k) for i, one in enumerate(found.points) for k, each in enumerate(one.responses) if each.order >= 1]
    assert sorted(kept) == repeat  # beyond the last doubling round-off decides whether a start is found chaotic
    step = (over[1] - over[0]) / 64.0
    free = branches[0]
    assert free.ends[0] == "end of range"
    assert len(free.values) == 6
    assert free.limits[1] - 2.0 * step <= force(W, 1.0) <= free.limits[1] + step
    doubled = 0
    for one in branches[1:]:
        if one.ends[1] != "period doubling" or one.order > 6:  # those live on less than 200 steps move them by
            continue
        x, least = one.states[-1], list[float]()
        for F in np.linspace(one.values[-1], one.limits[1] + 0.01, 12):
            near: Any = SimpleNamespace(order=one.order, strobes=[x])
            x, multipliers = exact_orbit(near, F, W)
            least.append(float(multipliers.real.min()))
        assert least[0] > -1.0 > least[-1], (one.order, least)
        doubled += 1
    assert doubled >= 3
    with pytest.raises(gb.UserError, match="over one parameter"):
        gb.follow(scene, gb.atlas(scene, period=2 * np.pi / W, starts=starts, steps=50, settle=1, rounds=1), period=1.0)


def folds(c: float, k: float, g: float, F: float) -> tuple[float, float]:
    """Return both frequencies W at which x'' + c x' + x + k max(0, x - g) = F sin(W t) has a fold.

    Orbits with one contact of each duration D: from x = g at t back to it after D, and to the start after a period.
    """

    def moved(stiffness: float, W: float, t: float, y: Any, d: float) -> Any:
        A = np.array([[0.0, 1.0], [-stiffness, -c]])
        X, rest = F / (stiffness - W * W + 1j * c * W), (stiffness - 1.0) * g / stiffness
        forced = [np.array([(z.imag + rest), (1j * W * z).imag]) for z in X * np.exp(1j * W * np.array([t, t + d]))]
        return forced[1] + expm(A * d) @ (y - forced[0])

    def orbit(p: Any, D: float) -> Any:
        t, v, W = p
        out = moved(1.0 + k, W, t, np.array([g, v]), D)
        back = moved(1.0, W, t + D, out, 2.0 * np.pi / W - D)
        return [out[0] / g - 1.0, back[0] / g - 1.0, (back[1] - v) / g]

    W = brentq(lambda W: F / abs(1.0 - W * W + 1j * c * W) - g, 1.0, 5.0)
    X = F / (1.0 - W * W + 1j * c * W)
    found, p = [], np.array([(np.pi / 2 - np.angle(X)) / W - 0.02, 0.02 * g * W * W, W])
    for D in np.linspace(0.04, 2.5, 800):
        p = root(orbit, p, args=(D,), tol=1e-12).x
        found.append(p[2])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(found)))) + 1  # down from grazing, up, and down again
    return found[turns[0]], found[turns[1]]


@pytest.mark.parametrize("seed", range(4))
def test_followed_responses_do_not_cross_folds(seed: int) -> None:
    """Between two values, one on each side of the folds of a resonance, both responses end at their fold."""
    rng = np.random.default_rng(seed)
    c, k, g = rng.uniform(0.02, 0.05), rng.uniform(0.5, 2.0), 10.0 ** rng.uniform(-4.0, 0.0)
    F = g * rng.uniform(0.2, 0.4)
    low, high = folds(c, k, g, F)
    body = gb.mass(1.0, stiffness=1.0, damping=c)
    stop = gb.Contact(body["at"], gb.HalfPlane(g), gb.KelvinVoigt(stiffness=k), name="stop")
    push = gb.Force(body["at"], lambda t, W: F * np.sin(W * t), name="push", W=1.0)
    over = {"push.W": np.array([low - rng.uniform(0.02, 0.3), high + rng.uniform(0.02, 1.0)])}
    scene, asked = gb.Scene(body, contacts=[stop], loads=[push]), {"period": lambda at: 2.0 * np.pi / at["push.W"]}
    found = gb.atlas(scene, starts=scene.state(), steps=400, over=over, **asked)
    upper, lower = gb.follow(scene, found, steps=400, **asked)
    assert (upper.ends, lower.ends) == (("end of range", "fold"), ("fold", "end of range"))
    assert upper.limits[1] == pytest.approx(high, rel=5e-4)
    assert lower.limits[0] == pytest.approx(low, rel=5e-4)


@pytest.mark.parametrize("steps", [50, 100, 400])
def test_responses_are_followed_with_the_steps_of_their_atlas(steps: int) -> None:
    """Other steps have other orbits: each response was a branch of its own, met by no start elsewhere."""
    scene = oscillator().with_({"push.W": 2.6})
    asked: dict[str, Any] = {"period": 2 * np.pi / 2.6, "over": {"push.F": np.linspace(0.02, 0.1, 4)}}
    found = gb.atlas(scene, starts=scene.state(), steps=steps, **asked)
    (one,) = gb.follow(scene, found, period=asked["period"], steps=steps)
    assert one.numbers == (0, 0, 0, 0)
    assert [type(each.peak["at"]) for point in found.points for each in point.responses] == 4 * [np.float64]
    with pytest.raises(gb.UserError, match="expected period, steps and scheme of the atlas"):
        gb.follow(scene, found, period=asked["period"], steps=2 * steps)


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        ({"starts": 3}, "expected a state"),
        ({"figures": ["peak"]}, "expected a list, each of it a figure"),
        ({"over": {"push.F": []}}, "found no values"),
        ({"period": 3.0}, "does not repeat after 3 s"),
        ({"period": -1.0}, "expected one above 0"),
        ({"steps": 0}, "from 1 on"),
        ({"scheme": gb.newmark()}, "accelerations as states"),
        ({"over": {"push.G": [1.0]}}, "has no 'G'"),
        ({"figures": [gb.figure("a", "velocity", "at", start=1.0)]}, "figure a: it has a time"),
        ({"over": {"push.F": [1.0], "push.W": [1.0], "stop.clearance": [1.0]}}, "at most 2"),
    ],
)
def test_nonsense_is_refused(asked: dict[str, Any], says: str) -> None:
    """Messages name what was found."""
    scene = oscillator()
    starts = gb.drawn_starts(scene, 2, {"at": (-0.1, 0.1)})
    with pytest.raises(gb.UserError, match=says):
        gb.atlas(scene, **({"period": 2 * np.pi, "starts": starts} | asked))
    with pytest.raises(gb.UserError, match=r"expected \(lowest, highest\)"):
        gb.drawn_starts(scene, 2, {"at": (0.2, 0.1)})
    with pytest.raises(gb.UserError, match="no points are called 'tip'"):
        gb.drawn_starts(scene, 2, {"tip": (0.0, 0.1)})
    with pytest.raises(gb.UserError, match="values of one point"):
        gb.gridded_starts(scene)


@pytest.mark.parametrize("steps", [100, 200, 295, 400])
def test_ends_of_steps_make_no_chaos(steps: int) -> None:
    """Two masses meet once in a period; where contact opens at the end of a step, the rest of the steps is irregular.

    An adaptive integration of where it was found repeats to 1e-6 of the motion.
    """
    one = gb.mass(1.0, stiffness=400.0, damping=2.0, name="one")
    two = gb.mass(2.0, stiffness=900.0, damping=3.0, name="two")
    hit = gb.Contact((one["at"], two["at"]), gb.HalfPlane(4e-3), gb.KelvinVoigt(4e4, 20.0), name="hit")
    push = gb.Force(one["at"], lambda t, size: size * np.sin(6.8 * np.pi * t), name="push", size=3.0)
    scene = gb.Scene(one, two, contacts=[hit], loads=[push])
    over = {"push.size": np.linspace(2.6, 2.95, 64)}
    found = gb.atlas(scene, period=1 / 3.4, starts=scene.state(), steps=steps, settle=60, rounds=2, over=over)
    assert sum(point.chaotic for point in found.points) == 0.0
    assert sum(point.unsettled for point in found.points) <= 2.0
    strobes = found.strobes["one.at"]
    assert np.abs(np.diff(strobes[..., -8:], axis=-1)).max() < 1e-3 * np.abs(strobes).max()
