"""Error estimates of runs of scenes, against converged runs and an exact answer."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gapbeam as gb
from gapbeam.studies.error_estimate.force_peaks import Averages, Span, key_figures
from gapbeam.studies.error_estimate.motion_record import MotionRecord, harmonics, lost_between_records, window_means


@pytest.fixture(autouse=True)
def _estimated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Estimate errors, which tests leave out elsewhere."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")


def oscillator(amplitude: float = 0.5, frequency: float = 0.7, sides: int = 1) -> gb.Scene:
    """Return a bilinear oscillator, or one between two stops."""
    block = gb.mass(1.0, stiffness=1.0, damping=0.02, name="block")
    law = gb.KelvinVoigt(stiffness=100.0)
    region = gb.HalfPlane(0.5) if sides == 1 else gb.Slot(1.0)
    stop = gb.Contact(block["at"], region, law, name="stop")
    push = gb.Force(block["at"], lambda t: amplitude * np.cos(frequency * t), name="push")
    return gb.Scene(block, contacts=[stop], loads=[push])


def figures(outcome: Any) -> dict[str, tuple[float, float]]:
    """Return value and error by name."""
    return {one["name"]: (one["value"], one["error"]) for one in outcome.summary["errors"]["figures"]}


@pytest.mark.parametrize("step", [0.08, 0.04, 0.02, 0.01])
def test_errors_cover_the_true_error(tmp_path: Path, step: float) -> None:
    """Against the run of a step of 1/800, which is converged itself; and are no more than ten times the true error."""
    scene = oscillator()
    converged = gb.run(scene, step=1 / 800, end=40.0, every=8, output=tmp_path / "true")
    outcome = gb.run(scene, step=step, end=40.0, output=tmp_path / "run")
    true, mine = figures(converged), figures(outcome)
    low, high = outcome.summary["errors"]["impact_rates"]["stop"]
    assert low <= converged.summary["impacts"]["stop"]["rate"] <= high
    name = "at peak-to-peak displacement"
    for figure in (name, "stop impulse"):
        value, error = mine[figure]
        assert abs(value - true[figure][0]) <= error + true[figure][1]
    assert mine[name][1] <= 10.0 * abs(mine[name][0] - true[name][0])


def test_a_motion_that_parts_has_a_horizon(tmp_path: Path) -> None:
    """A chaotic rattle: up to the horizon a run of a quarter of the step agrees, later it does not."""
    scene = oscillator(amplitude=8.0, frequency=2.8, sides=2)
    outcome = gb.run(scene, step=2e-3, end=150.0, every=5, output=tmp_path / "a")
    horizon = outcome.summary["errors"]["horizon"]
    assert horizon is not None
    assert any("can be predicted up to" in one for one in outcome.summary["warnings"])
    finer = gb.run(scene, step=5e-4, end=150.0, every=20, output=tmp_path / "b", errors=False)
    one, other = (gb.open_results(x).history["displacement"].values[:, 0, 0] for x in (outcome, finer))
    times = gb.open_results(outcome).history["time"].values
    apart = np.abs(one - other) / np.ptp(one)
    assert apart[times < 0.8 * horizon].max() < 0.05
    assert apart[times > horizon].max() > 0.3


@pytest.mark.parametrize("speed", [10.0, 1e3, 1e5])
@pytest.mark.parametrize("motions", [1, 2])
def test_bodies_that_drift_together_have_the_horizon_of_those_that_do_not(
    tmp_path: Path, speed: float, motions: int
) -> None:
    """A ball rattles in a cage that flies: laws are the same in all inertial frames, and so is chaos.

    The horizon counted in shares of the flight: there was none.
    """
    cage, ball = gb.mass(1.0, motions=motions, name="cage"), gb.mass(0.3, motions=motions, name="ball")
    region = gb.Slot(1.0) if motions == 1 else gb.Disc(0.5)
    play = gb.Contact((ball["at"], cage["at"]), region, gb.KelvinVoigt(stiffness=300.0), name="play")
    way = [1.0] if motions == 1 else [0.8, 0.6]
    scene = gb.Scene(cage, ball, contacts=[play], loads=[
        gb.Force(cage["at"], lambda t: 4.0 * np.cos(2.8 * t), direction=way, name="push"),
        gb.Force(ball["at"], lambda t: 0.3 * np.cos(1.1 * t), direction=way[::-1], name="other"),
    ])  # fmt: skip
    horizons = []
    for fast in (0.0, speed):
        start = scene.state(velocity={"cage": fast, "ball": fast})
        outcome = gb.run(scene, step=5e-3, end=60.0, start=start, output=tmp_path / f"{fast}")
        horizons.append(outcome.summary["errors"]["horizon"])
    assert horizons[1] == pytest.approx(horizons[0], rel=0.3)


def test_errors_of_a_penalty_cover_rigid_contact(tmp_path: Path) -> None:
    """A ball on a floor that stands for a rigid one: impulse 2 m v, and no motion below the floor."""
    body = gb.mass(1.0, name="ball")
    floor = gb.Contact(body["at"], gb.HalfPlane(0.0), gb.KelvinVoigt(stiffness=1e6), offset=-0.1, name="floor")
    scene = gb.Scene(body, contacts=[floor], loads=[gb.weight(body, 9.81)])
    outcome = gb.run(scene, step=1e-5, end=0.25, output=tmp_path / "a", penalty=["fl*"])
    value, error = figures(outcome)["floor impulse"]
    assert abs(value - 2.0 * np.sqrt(2 * 9.81 * 0.1)) <= error <= 0.05 * value
    value, error = figures(outcome)["at peak-to-peak displacement"]
    assert abs(value - 0.1) <= error <= 0.05 * value
    with pytest.raises(gb.UserError, match=r"penalty 'wall': expected contacts .* its contacts: floor"):
        gb.run(scene, step=1e-5, end=0.25, output=tmp_path / "b", penalty=["wall"])


def test_no_errors_where_a_run_cannot_be_repeated(tmp_path: Path) -> None:
    """Observers may set loads: the summary says why there are no errors; and none where nobody asks."""
    outcome = gb.run(oscillator(), step=0.05, end=5.0, observers=[lambda _: None], output=tmp_path / "a")
    assert "observers may set loads" in outcome.summary["errors"]["reason"]
    assert outcome.exit_status == 0
    assert "errors" not in gb.run(oscillator(), step=0.05, end=5.0, errors=False, output=tmp_path / "b").summary


def test_each_motion_of_a_plane_has_its_own_figure(tmp_path: Path) -> None:
    """Steps of 1 N and 3 N on equal springs without damping: ranges of 2 F / k, along z and across."""
    block = gb.mass(1.0, motions=2, stiffness=100.0, name="block")
    pushes = [gb.Force(block["at"], force, direction=way) for force, way in ((1.0, [1.0, 0.0]), (3.0, [0.0, 1.0]))]
    ring = gb.Contact(block["at"], gb.Disc(1.0), gb.KelvinVoigt(stiffness=1e4), name="ring")
    outcome = gb.run(gb.Scene(block, contacts=[ring], loads=pushes), step=2e-3, end=2.0, output=tmp_path / "a")
    found = figures(outcome)
    assert found["at peak-to-peak displacement"][0] == pytest.approx(0.06, rel=1e-3)
    assert found["at lateral peak-to-peak displacement"][0] == pytest.approx(0.02, rel=1e-3)


@pytest.mark.parametrize("period", [None, 2.0 * np.pi / 0.7])
@pytest.mark.parametrize("end", [0.2, 40.0])
def test_smoothed_accelerations_have_the_window_of_their_run(tmp_path: Path, period: float | None, end: float) -> None:
    """The range of means over the window that the summary names, from velocities; none over a part that is shorter."""
    scene, h = oscillator(), 1e-2
    outcome = gb.run(scene, step=h, end=end, period=period, output=tmp_path / "run")
    found = [one for one in outcome.figures if one["name"].endswith("smoothed acceleration")]
    window = outcome.summary["smoothing"]["window"]
    assert window == pytest.approx(0.05 * min(end, period or 2.0 * np.pi))
    v = np.concatenate([[0.0], gb.history(scene, h, end).velocity["at"]])
    t = h * np.arange(len(v))
    begins = t[t + window <= t[-1]]
    means = (np.interp(begins + window, t, v) - np.interp(begins, t, v)) / window
    assert len(found) > 0
    assert [one["window"] for one in found] == pytest.approx(len(found) * [window])
    whole = [one["value"] for one in found if one["span"] == "whole run"]
    assert len(whole) > 0 or period is not None
    assert whole == pytest.approx(len(whole) * [np.ptp(means)], rel=1e-6)


def test_a_part_shorter_than_a_mean_has_no_smoothed_acceleration() -> None:
    """Its range was that of one mean: 0, with an error of 0."""
    t = np.linspace(0.0, 0.1, 101)
    motion = MotionRecord(
        times=t, displacement=t[:, None] ** 3, velocity_gained=3.0 * t[:, None] ** 2, force=np.zeros((101, 0)),
        impulse=np.zeros((101, 0)), probes=("tip",), faces=(),
    )  # fmt: skip
    for window, ranges in ((0.01, 1), (0.05, 1), (0.1, 0), (0.5, 0)):
        names = key_figures(motion, Span("whole", 0.0, 0.1, 1), Averages(window))
        assert sum("acceleration" in name for name in names) == ranges


@pytest.mark.parametrize(("law", "power"), [("hunt-crossley", 1.5), ("hunt-crossley", 2.0), ("kelvin-voigt", 1.0)])
def test_the_peak_of_a_blow_lies_within_its_error(tmp_path: Path, law: str, power: float) -> None:
    """A mass strikes a spring F = k x^n: m v^2 / 2 = k x^(n+1) / (n+1); records pick its peak by chance.

    The figure of one's own, too. Every fourth blow was off by more than E.
    """
    rng, found = np.random.default_rng(3), []
    for _ in range(8):
        m, k = 10.0 ** rng.uniform([-3.0, 3.0], [2.0, 9.0])
        speed, apart = rng.uniform(0.3, 4.0), 10.0 ** rng.uniform(-5.0, -2.0)
        deep = (0.5 * (power + 1.0) * m * speed**2 / k) ** (1.0 / (power + 1.0))
        table = {"type": law, "stiffness": float(k)} | ({"exponent": power, "chi": 0.0} if power > 1.0 else {})
        end = (apart + 5.0 * deep) / speed
        case = {
            "structure": [{"name": "ball", "model": {"type": "mass", "mass": float(m)}, "velocity": speed}],
            "pair": [{"name": "plate", "between": ["ball.at"], "law": table,
                      "region": {"type": "half-plane", "clearance": apart}}],
            "figure": [{"name": "own", "quantity": "contact_force", "place": "plate"}],
            "time": {"end": end, "step": deep / speed * rng.uniform(0.05, 0.25)},
        }  # fmt: skip
        values = figures(gb.run(case, output=tmp_path / "run", overwrite=True))
        for name in ("plate largest recorded force", "own"):
            value, error = values[name]
            found.append(((k * deep**power - value) / value, error / value))
    missed, errors = np.array(found).T
    assert np.mean(np.abs(missed) <= errors) >= 0.95
    assert np.median(errors) <= 5.0 * np.median(np.abs(missed))


@pytest.mark.parametrize("records", [20.0, 47.3])
@pytest.mark.parametrize("wide", [1.5, 2.5, 3.3, 4.49])
def test_a_smoothed_acceleration_is_a_mean_over_the_time_that_is_stated(records: float, wide: float) -> None:
    """Of x = sin t: the range is 2 sin(W / 2) / (W / 2). Windows were rounded to records, unlike the stated width."""
    h = 2.0 * np.pi / records
    t = h * np.arange(60 * round(records))
    means = window_means(np.cos(t)[:, None], h, wide * h)
    assert np.ptp(means) == pytest.approx(2.0 * np.sinc(0.5 * wide * h / np.pi), rel=1.05 * h**2 / 8.0)


@pytest.mark.parametrize("every", [1, 8])
def test_figures_cover_what_records_miss(tmp_path: Path, every: int) -> None:
    """Free vibration from a speed, x = sin(w t): few records in a period, which the run of half the step has, too."""
    rng, missed = np.random.default_rng(1), dict[str, list[float]]()
    for _ in range(16):
        w, steps = 10.0 ** rng.uniform(-4.0, 6.0), every * rng.uniform(20.0, 60.0)
        body = gb.mass(1.0, stiffness=w**2, name="block")
        stop = gb.Contact(body["at"], gb.HalfPlane(9.0), gb.KelvinVoigt(stiffness=1.0), name="stop")
        scene = gb.Scene(body, contacts=[stop])
        own = [gb.figure(one, "displacement", "at", statistic=one, end=7.0 / w) for one in ("maximum", "peak-to-peak")]
        outcome = gb.run(
            scene, step=2.0 * np.pi / w / steps, end=9.0 / w, start=scene.state(velocity={"block": w}), every=every,
            figures=own, output=tmp_path / "a", overwrite=True,
        )  # fmt: skip
        mean = 2.0 * w**2 * np.sinc(0.5 * w * outcome.summary["smoothing"]["window"] / np.pi)
        true = {"maximum": 1.0, "peak-to-peak": 2.0, "at peak-to-peak displacement": 2.0,
                "at peak-to-peak smoothed acceleration": mean}  # fmt: skip
        for name, (value, error) in figures(outcome).items():
            if name in true:
                missed.setdefault(name, []).append(abs(value - true[name]) / error)
    assert len(missed) == 4
    assert all(np.mean(np.array(one) <= 1.0) >= 0.9 for one in missed.values()), missed


@pytest.mark.parametrize("records", [20.0, 24.37, 41.5])
@pytest.mark.parametrize("decay", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("periods", [1, 3])
def test_harmonics_are_those_of_whole_periods(records: float, decay: float, periods: int) -> None:
    """Of 2 + cos t + 0.01 cos 3 t + e^(-decay t): those of the exponential are (1 - e^(-d T)) / (T (d + i n)).

    A rule that takes all motions for periodic, or windows for whole records, was off by up to the amplitude itself.
    """
    T, h = 2.0 * np.pi * periods, 2.0 * np.pi / records
    t = h * np.arange(round(T / h) + 1)
    orders = np.arange(1, 4)
    x = 2.0 + np.cos(t) + 0.01 * np.cos(3.0 * t) + np.exp(-decay * t)
    exact = np.array([0.5, 0.0, 0.005]) + (1.0 - np.exp(-decay * T)) / (T * (decay + 1j * orders))
    found = harmonics(t, x, 0.5 / np.pi, 3)
    assert found == pytest.approx(2.0 * np.abs(exact), abs=2e-3)


@pytest.mark.parametrize("steps", [100, 300, 3000])
@pytest.mark.parametrize("periods", [0.6, 1.6, 3.6])
def test_errors_of_a_damping_scheme_cover_what_it_damps(tmp_path: Path, steps: int, periods: float) -> None:
    """Euler's rule in free vibration about F / k, whose range is 2 F / k: twice the change by half the step is less."""
    body = gb.mass(1.0, stiffness=1.0, name="block")
    stop = gb.Contact(body["at"], gb.HalfPlane(9.0), gb.KelvinVoigt(stiffness=1.0), name="stop")
    scene = gb.Scene(body, contacts=[stop], loads=[gb.Force(body["at"], 1.0, name="push")])
    T = 2.0 * np.pi
    outcome = gb.run(
        scene, step=T / steps, end=periods * T, scheme=gb.euler(), output=tmp_path / "a",
        gates={"accept_energy_loss": True},
    )  # fmt: skip
    value, error = figures(outcome)["at peak-to-peak displacement"]
    assert abs(value - 2.0) <= error <= 10.0 * abs(value - 2.0)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_errors_of_ranges_cover_impulses_between_records(tmp_path: Path, restitution: float) -> None:
    """A ball flies to a wall at g and comes back half the way at most: its range is g, whatever the records see."""
    rng, missed = np.random.default_rng(5), []
    for _ in range(20):
        g, v = 10.0 ** rng.uniform([-6.0, -3.0], [3.0, 3.0])
        body = gb.mass(1.0, name="ball")
        wall = gb.Contact(body["at"], gb.HalfPlane(g), gb.Unilateral(restitution=restitution), name="wall")
        scene = gb.Scene(body, contacts=[wall])
        outcome = gb.run(
            scene, step=g / v / rng.uniform(40.0, 200.0), end=1.5 * g / v, start=scene.state(velocity={"ball": v}),
            output=tmp_path / "a", overwrite=True,
        )  # fmt: skip
        value, error = figures(outcome)["at peak-to-peak displacement"]
        missed.append(abs(value / g - 1.0) / (error / g + 1e-12))
        assert error <= 0.11 * g
    assert np.mean(np.array(missed) <= 1.0) >= 0.9


def test_means_cover_jumps_of_accelerations_between_records() -> None:
    """Of a saw from -1/2 to 1/2, as friction makes: the range of means over W is 1 - W, at kinks."""
    rng, missed = np.random.default_rng(2), []
    for _ in range(40):
        h, wide, phase = 1.0 / rng.uniform(15.0, 60.0), rng.uniform(0.1, 0.3), rng.uniform()
        t = h * np.arange(int(2.5 / h))
        saw = (t + phase) % 1.0
        gained = 0.5 * saw**2 - 0.5 * saw  # both ends of a tooth are 0
        none = np.zeros((len(t), 0))
        motion = MotionRecord(
            times=t, probes=("tip",), displacement=0.0 * gained[:, None], velocity_gained=gained[:, None], faces=(),
            force=none, impulse=none,
        )  # fmt: skip
        found = np.ptp(window_means(motion.velocity_gained, h, wide))
        missed.append(
            (1.0 - wide - found) / lost_between_records(motion, wide)["tip peak-to-peak smoothed acceleration"]
        )
    assert np.mean(np.array(missed) <= 1.0) >= 0.9
    assert np.median(missed) >= 0.1


@pytest.mark.parametrize("step", [0.05, 2.0])
def test_a_wall_that_nothing_touches_changes_no_figure(tmp_path: Path, step: float) -> None:
    """The table of a block is the same however far the wall is: a gap is no motion, beside which others were none."""
    closed = []
    for number, clearance in enumerate((1e2, 1e6, 1e10)):
        block = gb.mass(1.0, stiffness=1.0, damping=0.02, name="block")
        stop = gb.Contact(block["at"], gb.HalfPlane(clearance), gb.KelvinVoigt(stiffness=100.0), name="stop")
        push = gb.Force(block["at"], lambda t: 0.5 * np.cos(0.7 * t), name="push")
        outcome = gb.run(
            gb.Scene(block, contacts=[stop], loads=[push]), step=step, end=40.0, output=tmp_path / str(number)
        )
        closed.append(outcome.summary["closing"]["rows"])
    assert closed[0] == closed[1] == closed[2]
    assert "round-off" not in str(closed)


def flights(ratio: float, push: float, frequency: float, gap: float, restitution: float, end: float) -> float:
    """Return the sum of impulses of a unit oscillator that hits a wall, by flights of an adaptive method."""

    def rate(t: float, x: Any) -> list[float]:
        return [x[1], push * np.sin(frequency * t) - 2.0 * ratio * x[1] - x[0]]

    def hit(t: float, x: Any) -> float:  # noqa: ARG001
        return float(x[0] - gap)

    hit.terminal, hit.direction = True, 1.0  # type: ignore[attr-defined]
    t, x, total = 0.0, np.zeros(2), 0.0
    while t < end:
        flight = solve_ivp(rate, (t, end), x, "DOP853", events=hit, rtol=1e-11, atol=1e-13)
        t, x = float(flight.t[-1]), flight.y[:, -1]
        if flight.status == 1:
            total += (1.0 + restitution) * x[1]
            x = np.array([gap * (1.0 - 1e-12), -restitution * x[1]])
    return total


@pytest.mark.parametrize("size", [1e-5, 1.0, 1e3])
def test_errors_of_impulses_do_not_agree_by_chance(tmp_path: Path, size: float) -> None:
    """Sums of impulses of a step and of half of the step agree at some times by chance, not all the time."""
    rng, missed = np.random.default_rng(125), []
    for _ in range(24):
        ratio, push, w = rng.uniform(0.02, 0.1), rng.uniform(0.5, 2.0), rng.uniform(0.5, 3.0)
        gap, restitution = rng.uniform(0.05, 0.8) * push, rng.choice([0.6, 0.8, 0.95])
        end = 2.0 * np.pi / w * 6.0
        body = gb.mass(1.0, stiffness=1.0 / size**2, damping=2.0 * ratio / size, name="body")
        wall = gb.Contact(body["at"], gb.HalfPlane(gap), gb.Unilateral(restitution=restitution), name="wall")
        load = gb.Force(body["at"], gb.sine, name="load", amplitude=push / size**2, frequency=w / 2.0 / np.pi / size)
        step = size * 2.0 * np.pi / w / rng.integers(60, 200)
        outcome = gb.run(
            gb.Scene(body, contacts=[wall], loads=[load]), step=step, end=size * end, output=tmp_path / "a",
            overwrite=True,
        )  # fmt: skip
        errors = outcome.summary["errors"]
        if errors["horizon"] is None and (exact := flights(ratio, push, w, gap, restitution, end)) > 0.0:
            value, error = figures(outcome)["wall impulse"]
            missed.append(abs(value * size - exact) / (error * size))
    assert len(missed) >= 8
    assert max(missed) < 2.0


@pytest.mark.parametrize("periods", [191.0, 205.3, 230.7])
@pytest.mark.parametrize("frequency", [15.9, 159.0])
def test_figures_of_the_settled_part_have_errors_from_the_time_that_the_warning_has(
    periods: float, frequency: float, tmp_path: Path
) -> None:
    """An impact damper is not predictable before it repeats: figures of one's own may begin no earlier."""
    pace, h = frequency / 15.9, 1e-4 * 15.9 / frequency
    main, ball = gb.mass(1.0, stiffness=1e4 * pace**2, damping=2.0 * pace, name="main"), gb.mass(0.1, name="ball")
    box = gb.Contact((ball["at"], main["at"]), gb.Slot(10e-3), gb.Unilateral(0.6), name="box")
    size, w = 5.0 * pace**2, 2.0 * np.pi * frequency
    scene = gb.Scene(main, ball, contacts=[box], loads=[gb.Force(main["at"], lambda t: size * np.cos(w * t))])

    def run(*starts: float) -> Any:
        figures = [
            gb.figure(f"rms-{i}", "displacement", "main.at", statistic="rms", start=one) for i, one in enumerate(starts)
        ]
        return gb.run(
            scene, step=h, end=round(periods / frequency / h) * h, period=1.0 / frequency, figures=figures,
            overwrite=True, output=tmp_path / "run",
        )  # fmt: skip

    (words,) = (one for one in run().summary["warnings"] if "settled part repeats" in one)
    found = re.search(r"figures from t = (\S+) s on", words)
    assert found is not None
    start = float(found[1])
    late, early = (one for one in run(start, 0.98 * start).figures if one["name"].startswith("rms"))
    assert late["error"] is not None
    assert early["error"] is None


@pytest.mark.parametrize("masses", [(0.2, 0.2, 0.2), (1.0, 0.3, 2.0), (5.0, 0.1, 0.1, 0.1)])
@pytest.mark.parametrize(("restitution", "step"), [(1.0, 1e-5), (0.4, 1e-6), (0.0, 3e-6)])
def test_bodies_that_stay_together_have_no_horizon(
    tmp_path: Path, masses: tuple[float, ...], restitution: float, step: float
) -> None:
    """A body strikes a row that touches, which leaves with (1 + e) m v / M: its gaps of 1e-20 m differed by 3 %."""
    bodies = [gb.mass(one, name=f"m{number}") for number, one in enumerate(masses)]
    contacts = [
        gb.Contact((a["at"], b["at"]), gb.HalfPlane(1e-3 if a is bodies[0] else 0.0), gb.Unilateral(restitution))
        for a, b in pairwise(bodies)
    ]
    scene = gb.Scene(*bodies, contacts=contacts)
    own = [gb.figure(f"v{k}", "velocity", f"m{k}.at", statistic="value", time=0.004) for k in range(1, len(masses))]
    start = scene.state(velocity={"m0": 1.0})
    found = gb.run(scene, step=step, end=0.004, start=start, figures=own, output=tmp_path / "row").summary["errors"]
    assert found["horizon"] is None
    exact = (1.0 + restitution) * masses[0] / sum(masses)
    for one in found["figures"]:
        if one["unit"] == "m/s":
            assert abs(one["value"] - exact) <= one["error"] + 1e-9
