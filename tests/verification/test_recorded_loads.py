"""Recorded loads against what their signals were made of: sines, pulses, random motion; SciPy integrates for us."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import exp, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import quad
from scipy.interpolate import make_interp_spline
from scipy.signal import lsim

import gapbeam
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.loads.point_load import RecordedForce
from gapbeam.solver.loads.recorded_function import RecordedSignal, signal_of
from gapbeam.solver.loads.support_motion import RecordedMotion
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.solver.models.body import body_key
from gapbeam.solver.models.model import Model, build_model
from gapbeam.solver.run.run_case import run_case
from gapbeam.solver.system.semi_discrete import VALUE, imaged
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import kicked
from tests.regression.test_compiled_run import same_history
from tests.shared.command import CASE_FOLDER, DEMO
from tests.shared.interrupted import differing, run_in_parts
from tests.shared.models import COARSE, GRAVITY, beam_case, beam_model, out_of_reach
from tests.shared.passages import followed
from tests.shared.toys import SCHEMES, start, steps_of, stopped_oscillator
from tests.verification.test_exciter import floating, lifted

FREQUENCY, OMEGA = 20.0, 40.0 * pi


def recorded(path: Path, times: np.ndarray, values: np.ndarray) -> str:
    """Write a record, and return its path."""
    np.savetxt(path, np.column_stack([times, values]), delimiter=",", header="time,value", fmt="%.17g")
    return str(path)


def force(file: str, **keys: Any) -> RecordedForce:
    """Return a recorded force."""
    return RecordedForce.model_validate({"type": "recorded_force", "point": 0.15, "file": file, **keys})


def motion(file: str, **keys: Any) -> RecordedMotion:
    """Return a recorded motion of the support."""
    return RecordedMotion.model_validate({"type": "recorded_motion", "file": file, **keys})


def sine_signal(folder: Path, interval: float, **keys: Any) -> RecordedSignal:
    """Return the signal of a recorded sine of 20 Hz that starts between its rows."""
    times = np.arange(-0.1, 0.3, interval)
    file = recorded(folder / "sine.csv", times, np.sin(OMEGA * times))
    return signal_of(force(file, start=0.0, **keys))


def order(error: Callable[[float], float], interval: float) -> float:
    """Return the order at which an error falls with an interval that becomes 16 times shorter."""
    return float(np.log2(error(interval) / error(interval / 16.0))) / 4.0


@pytest.mark.parametrize(("interpolation", "expected"), [("cubic", 4.0), ("monotone", 2.0)])
def test_the_curve_goes_to_the_sine(interpolation: str, expected: float, tmp_path: Path) -> None:
    """The spline is of order 4; piecewise monotone cubics are flat at the rows beside a peak, of order 2."""
    times = np.linspace(0.0, 0.1, 3001)

    def error(interval: float) -> float:
        signal = sine_signal(tmp_path, interval, interpolation=interpolation)
        return float(np.abs(signal.value(times) - np.sin(OMEGA * times)).max())

    assert order(error, 1.0 / 900.0) == pytest.approx(expected, abs=0.4)


def test_the_mean_over_no_time_is_the_value(tmp_path: Path) -> None:
    """At the start of a run the first record asks for means over nothing; with a ramp that ended in a trace."""
    signal, starts = sine_signal(tmp_path, 1.0e-3, ramp=0.05), np.array([0.0, 0.02])
    for one in (starts[:1], starts[1:], starts):
        assert signal.mean(one, one) == pytest.approx(signal.value(one), rel=1e-14)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_recorded_sine_marches_as_the_harmonic_one(name: str, tmp_path: Path) -> None:
    """An oscillator in contact under both, with every scheme: apart by the error of the curve, of order 4."""
    scheme, law = SCHEMES[name], kelvin_voigt(4.0e4)

    def end(consumers: Callable[[float], float]) -> float:
        system = stopped_oscillator(1.0, 1.0e4, 5.0e-5, 0.05, consumers)
        return float(steps_of(system, law, scheme, start(system), 5.0e-4, 200)[-1].new.u[0, 0])

    exact = end(lambda time: sin(OMEGA * time))

    def error(interval: float) -> float:
        return abs(end(sine_signal(tmp_path, interval).value) - exact)

    assert error(1.0 / 2000.0) < 1.0e-5 * abs(exact)
    assert order(error, 1.0 / 200.0) == pytest.approx(4.0, abs=0.5)


def test_a_pulse_is_answered_as_duhamel_says(tmp_path: Path) -> None:
    """A half sine of 8 ms, recorded with rows that grow apart behind it, on an oscillator of 15 Hz without contact."""
    length, omega, ratio = 8.0e-3, 2.0 * pi * 15.0, 0.03
    damped = omega * sqrt(1.0 - ratio**2)

    def pulse(time: float) -> float:
        return sin(pi * time / length) if 0.0 <= time <= length else 0.0

    times = np.concatenate([np.linspace(0.0, length, 61), length + np.geomspace(2.0e-5, 0.2, 80)])
    file = recorded(tmp_path / "pulse.csv", times, np.array([3.0 * pulse(time) for time in times]))
    signal = signal_of(force(file, scale=1.0 / 3.0, interpolation="monotone", holes="spline"))
    system = stopped_oscillator(1.0, omega**2, 1.0, ratio, signal.value)
    steps = steps_of(system, kelvin_voigt(1.0), SCHEMES["newmark"], start(system), 5.0e-5, 1600)
    for step in steps[99::300]:
        time = step.new.time

        def kernel(past: float, now: float = time) -> float:
            return pulse(past) * exp(-ratio * omega * (now - past)) * sin(damped * (now - past)) / damped

        expected = quad(kernel, 0.0, min(time, length), epsabs=1e-14)[0]
        assert step.new.u[0, 0] == pytest.approx(expected, abs=2.0e-7)
    assert max(abs(step.new.u[0, 0]) for step in steps) > 4.0e-5


COURSES: tuple[dict[str, Any], ...] = (
    {},
    {"ramp": 0.013},
    {"quantity": "velocity", "ramp": 0.013},
    {"quantity": "displacement", "beyond": "zero", "start": -0.01},
    {"beyond": "repeat", "ramp": 0.12, "remove_mean": True},
    {"interpolation": "monotone", "beyond": "zero", "start": 0.02, "offset": 2.0, "scale": -3.0},
)


def random_record(path: Path) -> str:
    """Write a record of 40 random rows at random times over 50 ms, the last like the first."""
    rng = np.random.default_rng(3)
    times = np.sort(rng.uniform(0.0, 0.05, 40))
    values = rng.normal(size=40)
    values[-1] = values[0]
    return recorded(path, times, values)


@pytest.mark.parametrize("keys", COURSES)
def test_means_over_intervals_are_exact(keys: dict[str, Any], tmp_path: Path) -> None:
    """Against quadrature between the rows, on intervals shorter and longer than theirs."""
    signal = signal_of(motion(random_record(tmp_path / "random.csv"), holes="spline", **keys))
    far = 0.14 if "beyond" in keys else 0.95 * signal.last
    edges = np.sort(np.random.default_rng(4).uniform(0.0, far, 25))
    found = signal.mean(edges[:-1], edges[1:])
    rounds = np.arange(4)[:, None] * signal.curve.span if signal.beyond == "repeat" else 0.0
    breaks = np.unique(np.append(signal.curve.knots - signal.shift + rounds, signal.ramp))
    for begin, end, mean in zip(edges, edges[1:], found, strict=False):
        inner = breaks[(breaks > begin) & (breaks < end)]
        places = [begin, *inner, end]
        parts = [quad(signal.value, a, b, epsabs=1e-13)[0] for a, b in pairwise(places)]
        assert mean == pytest.approx(sum(parts) / (end - begin), rel=1e-9, abs=1e-9 * signal.peak)
    assert signal.mean(edges, edges) == pytest.approx(signal.value(edges))
    assert signal.mean(edges[8:9], edges[9:10])[0] == found[8], "not the same bits in another batch"


def test_derivatives_of_a_recorded_motion(tmp_path: Path) -> None:
    """The acceleration of the support from a recorded displacement or velocity, by the product rule with the ramp."""
    times = np.arange(0.0, 0.3, 5.0e-4)
    file = recorded(tmp_path / "sine.csv", times, np.sin(OMEGA * times))
    inner = np.linspace(0.06, 0.25, 200)
    for quantity, expected, size in (
        ("acceleration", np.sin(OMEGA * inner), 1.0),
        ("velocity", OMEGA * np.cos(OMEGA * inner), OMEGA),
        ("displacement", -(OMEGA**2) * np.sin(OMEGA * inner), OMEGA**2),
    ):
        signal = signal_of(motion(file, quantity=quantity, ramp=0.05))
        assert np.abs(signal.value(inner) - expected).max() < 4.0e-4 * size
        assert signal.peak == pytest.approx(size, rel=1e-3)
    signal = signal_of(motion(file, quantity="displacement", ramp=0.05))
    place = signal_of(motion(file, ramp=0.05)).value
    step, early = 1.0e-5, np.linspace(0.003, 0.047, 12)
    differences = (place(early + step) - 2.0 * place(early) + place(early - step)) / step**2
    assert signal.value(early) == pytest.approx(differences, rel=1e-2, abs=0.05)


def test_what_acts_beyond_the_record(tmp_path: Path) -> None:
    """Zero, the record again, or a refusal; a start in the record or before it."""
    times = np.linspace(2.0, 2.1, 201)
    file = recorded(tmp_path / "late.csv", times, 5.0 + np.sin(OMEGA * times))
    expected = {0.03: 5.0 + sin(OMEGA * 2.03), 0.13: 5.0 + sin(OMEGA * 2.03)}
    repeated = signal_of(force(file, beyond="repeat"))
    assert [repeated.value(time) for time in expected] == pytest.approx(list(expected.values()), abs=1e-5)
    assert repeated.value(7.13) == pytest.approx(expected[0.13], abs=1e-5)
    shifted = signal_of(force(file, beyond="zero", start=1.9, remove_mean=True, scale=2.0, offset=1.0))
    assert shifted.value(np.array([0.05, 0.25])) == pytest.approx([0.0, 0.0])
    assert shifted.value(0.13) == pytest.approx(1.0 + 2.0 * sin(OMEGA * 2.03), abs=1e-5)
    with pytest.raises(UserError, match=r"t = 0\.2 s was asked for"):
        signal_of(force(file)).value(np.array([0.05, 0.2]))


def test_a_floating_beam_stays_where_it_is(tmp_path: Path) -> None:
    """The support moves by a recorded displacement: the free beam goes against it, and has no absolute acceleration."""
    times, dt = np.arange(0.0, 0.05, 2.0e-4), 1.0e-4
    places = 1.0e-3 * np.sin(OMEGA * times) ** 3
    load = motion(recorded(tmp_path / "place.csv", times, places), quantity="displacement").model_dump()
    model = floating((load,), "beam")
    response = respond(model, lifted(model, 0.0), 400, dt)
    assert response.exit_status == 0, response.message
    time, place = response.history["time"], response.history["displacement"][:, 0, -1]
    absolute, relative = (response.history[f"acceleration_{name}"][:, 0, -1] for name in ("absolute", "relative"))
    assert place - place[0] == pytest.approx(-1.0e-3 * np.sin(OMEGA * time) ** 3, abs=3e-6)
    assert np.abs(relative).max() > 15.0
    assert np.abs(absolute).max() < 5e-3 * np.abs(relative).max()


def test_an_earthquake_on_a_beam_is_what_lsim_finds(tmp_path: Path) -> None:
    """A random record of base motion on beam elements on a suspension, without contact; compiled and step by step."""
    rng, dt, count = np.random.default_rng(7), 1.0e-4, 2000
    rows = np.arange(0.0, 0.2201, 2.0e-3)
    values = rng.normal(size=len(rows)) * np.sin(pi * rows / rows[-1])
    load = motion(recorded(tmp_path / "quake.tsv", rows, values), scale=9.81).model_dump()
    held = {"type": "exciter", "point": 0.3, "amplitude": 0.0, "frequency": 20.0, "stiffness": 5.0e4, "damping": 20.0}
    changes: dict[str, Any] = {
        "model": {"type": "beam", "elements": 8},
        "damping": {"mass": 5.0, "stiffness": 1.0e-5},
        "time": {"step": dt, "end": count * dt},
    }
    model = beam_model(changes, (load, held), {"tip": 0.51})
    model = replace(model, system=out_of_reach(model.system))
    plan, begin = march_of_model(model, SCHEMES["discrete-gradient"]), lifted(model, 0.0)
    taken = steps_of(plan.system, plan.law, plan.scheme, begin, dt, count)
    probe = model.probes["tip"]
    found = np.array([probe.evaluate(step.new.u[VALUE], model.system.operators)[-1] for step in taken])
    expected = _lsim(model, rows, 9.81 * values, dt, count)
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()
    compiled = followed(CompiledLoop(plan), begin, count, _read(model)).probes[:, 0]
    assert compiled == pytest.approx(found, abs=1e-9 * np.abs(found).max())


def _read(model: Model) -> np.ndarray:
    """The row that takes the motion of the tip from the DOFs, (1, n)."""
    operators = model.system.operators
    read = model.probes["tip"].evaluate
    return np.array([[read(column, operators)[-1] for column in np.eye(operators.size)]])


def _lsim(model: Model, rows: np.ndarray, values: np.ndarray, dt: float, count: int) -> np.ndarray:
    """The motion of the tip by the state-space march of SciPy, with the record by its own spline."""
    operators, size = model.system.operators, model.system.operators.size
    unit = np.eye(size)
    mass = np.column_stack([operators.apply_mass(column) for column in unit])
    stiffness = np.column_stack([operators.apply_stiffness(column) for column in unit])
    damping = np.column_stack([model.system.damping_force(imaged(operators, column)) for column in unit])
    inverse = np.linalg.inv(mass)
    a = np.block([[np.zeros((size, size)), unit], [-inverse @ stiffness, -inverse @ damping]])
    b = np.concatenate([np.zeros(size), inverse @ model.system.loads[0].pattern])[:, None]
    c = np.concatenate([_read(model)[0], np.zeros(size)])[None]
    fine = np.linspace(0.0, count * dt, 4 * count + 1)
    consumers = make_interp_spline(rows, values)(fine)
    _, found, _ = lsim((a, b, c, np.zeros((1, 1))), consumers, fine)
    return np.asarray(found)[4::4]


SHAKER = {"type": "harmonic_force", "name": "shaker", "point": 0.4, "amplitude": 300.0, "frequency": 80.0}
ROWS = np.linspace(0.0, 0.01, 201)


def _case(load: dict[str, Any], **tables: Any) -> Case:
    changes: dict[str, Any] = {"mesh": COARSE, "time": {"end": 0.01, "step": 5.0e-5}, **tables}
    return beam_case(changes, (GRAVITY, load), {"tip": 0.51})


@pytest.mark.parametrize(
    "tables",
    [
        {"contact": {"stiffness": 1e12}},
        {"model": {"type": "reduced", "modes": 8, "shapes": 4}},
        {"model": {"type": "beam"}},
        {"model": {"type": "rigid"}},
    ],
    ids=["full", "reduced", "beam", "rigid"],
)
def test_every_model_takes_records(tables: dict[str, Any], tmp_path: Path) -> None:
    """A rattling beam under a recorded sine leaves the history of the harmonic load, contact and energy included."""
    file = recorded(tmp_path / "sine.csv", ROWS, 30.0 * np.sin(160.0 * pi * ROWS))
    same = {"type": "recorded_force", "name": "shaker", "point": 0.4, "file": file, "scale": 10.0}
    stiff = {"contact": {"stiffness": 1e12}}
    for name, load in (("harmonic", SHAKER), ("recorded", same)):
        outcome = run_case(_case(load, **{**stiff, **tables}), tmp_path / name, MPI.COMM_SELF)
        assert outcome.exit_status == 0, outcome.message
    same_history(tmp_path / "recorded", tmp_path / "harmonic", 1.0e-5)


def _recorded_case(folder: Path) -> Path:
    """Write the demo under a recorded sine that makes it rattle, beside its record, and return its path."""
    recorded(folder / "sine.csv", ROWS, 30.0 * np.sin(160.0 * pi * ROWS))
    text = DEMO.read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith(("amplitude", "frequency ", "ramp"))]
    text = "\n".join(kept).replace('"harmonic_force"', '"recorded_force"\nfile = "sine.csv"\nscale = 10.0')
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder / "case.toml"


BRIEF = ("time.end=0.01", "output.fields_interval=2e-3", "model=rigid", "mesh.size=0.06")


def test_a_run_can_be_run_again_from_its_results(tmp_path: Path) -> None:
    """Their case names the record and its checksum; a record that has changed since is refused."""
    case = _recorded_case(tmp_path)
    first = gapbeam.run(case, BRIEF, tmp_path / "first")
    again = gapbeam.run(tmp_path / "first" / "case.toml", (), tmp_path / "again")
    assert first.exit_status == again.exit_status == 0
    assert not differing(tmp_path / "first", tmp_path / "again")
    recorded(tmp_path / "sine.csv", ROWS, 31.0 * np.sin(160.0 * pi * ROWS))
    with pytest.raises(CaseError, match="has changed since"):
        gapbeam.run(tmp_path / "first" / "case.toml", (), tmp_path / "third")
    assert gapbeam.run(case, BRIEF, tmp_path / "third").exit_status == 0


def test_a_run_goes_on_with_the_same_record_only(tmp_path: Path) -> None:
    """Resumed to the same bits, also from another place; refused with another record."""
    case = _recorded_case(tmp_path)
    whole = gapbeam.run(case, BRIEF, tmp_path / "whole")
    parts = run_in_parts(case, BRIEF, tmp_path / "parts", (1,))
    assert whole.exit_status == parts.exit_status == 0
    assert not differing(tmp_path / "whole", tmp_path / "parts")
    moved = tmp_path / "moved"
    moved.mkdir()
    recorded(moved / "sine.csv", ROWS, 31.0 * np.sin(160.0 * pi * ROWS))
    shutil.copy(case, moved)
    with pytest.raises(UserError, match=r"load\.shaker\.checksum"):
        gapbeam.run(moved / "case.toml", BRIEF, tmp_path / "parts", resume=True)
    shutil.copy(tmp_path / "sine.csv", moved)
    assert gapbeam.run(moved / "case.toml", BRIEF, tmp_path / "parts", resume=True).message.startswith(
        "was done before"
    )


def test_records_are_cheap_to_vary(tmp_path: Path) -> None:
    """Cases that differ in how a record is read share a body; kicks start with the record, not behind its end."""
    case = _recorded_case(tmp_path)
    recorded(tmp_path / "other.csv", ROWS, ROWS)
    variants = (
        "load.shaker.scale=2.0",
        "load.shaker.file=other.csv",
        "load.shaker.beyond=zero",
        "load.shaker.ramp=0.01",
    )
    keys = [body_key(read_case(case, (*BRIEF, variant))) for variant in variants]
    assert all(key == keys[0] for key in keys)
    assert keys[0] != body_key(read_case(case, (*BRIEF, "load.shaker.point=0.2")))
    read = read_case(case, BRIEF)
    start = kicked(build_model(read, MPI.COMM_SELF), read.load, 1, 5)
    assert start.state.time == 0.0
    assert np.all(np.isfinite(start.state.v))
    assert np.any(start.state.v != 0.0)


def test_what_check_says_of_a_record(tmp_path: Path) -> None:
    read = read_case(_recorded_case(tmp_path), BRIEF)
    frequency, words = read.load[1].frequency_words(read.time.step)
    assert "201 rows over 0.01 s, every 5e-05 s; peak 300" in words
    assert float(frequency.removesuffix(" Hz")) == pytest.approx(80.0, abs=160.0)  # less than a period


def test_the_case_with_a_record_has_nothing_to_reports() -> None:
    """The record of cases/recorded.toml is what its formula makes, in g, and raises no warning."""
    case = read_case(CASE_FOLDER / "recorded.toml")
    assert warnings(case) == []
    signal, times = signal_of(case.load[1]), np.linspace(0.0, 0.5, 777)
    swing = 2.0 * np.exp(-(((times - 0.14) / 0.05) ** 2)) * np.sin(46.0 * pi * times)
    shock = np.where((times > 0.3) & (times < 0.311), 6.0 * np.sin(pi * (times - 0.3) / 0.011) ** 2, 0.0)
    assert signal.value(times) == pytest.approx(9.81 * (swing + shock), abs=0.5)
    assert signal.peak == pytest.approx(58.86, rel=1e-2)
    assert signal.value(0.55) == 0.0


HOLED = np.concatenate([np.arange(0.0, 9.5e-3, 1.0e-3), np.arange(0.19, 0.1995, 1.0e-3)])  # s


@pytest.mark.parametrize("interpolation", ["cubic", "monotone"])
@pytest.mark.parametrize("beyond", ["zero", "repeat"])
@pytest.mark.parametrize(("holes", "filled"), [("linear", 0.5 * (0.081 + 0.36)), ("zero", 0.0)])
def test_a_hole_is_filled_as_the_case_says(
    holes: str, filled: float, beyond: str, interpolation: str, tmp_path: Path
) -> None:
    """In the middle of a hole acts the mean of the rows beside it, or 0; between rows the curve of its part."""
    values = np.where(HOLED < 0.1, (30.0 * HOLED) ** 2, 0.36 * (1.0 - (HOLED - 0.19) / 0.009))
    values[9], values[10] = 0.081, 0.36
    path = recorded(tmp_path / "hole.csv", HOLED, values)
    signal = signal_of(force(path, holes=holes, beyond=beyond, interpolation=interpolation))
    assert signal.value(0.0995) == pytest.approx(filled, rel=1e-9, abs=1e-12)
    assert signal.value(0.1945) == pytest.approx(0.18, rel=1e-6)
    mean = signal.mean(np.array([0.0095]), np.array([0.1895]))
    assert mean[0] == pytest.approx(filled, rel=1e-2, abs=1e-12)


def test_a_hole_is_splined_where_the_case_says(tmp_path: Path) -> None:
    """A parabola is its own spline."""
    path = recorded(tmp_path / "hole.csv", HOLED, HOLED**2)
    assert signal_of(force(path, holes="spline")).value(0.1) == pytest.approx(0.01, rel=1e-9)


@pytest.mark.parametrize(
    ("table", "keys", "allowed"),
    [
        ("recorded_force", {"point": 0.15}, {"linear", "spline", "zero"}),
        ("recorded_motion", {"quantity": "acceleration"}, {"linear", "spline", "zero"}),
        ("recorded_motion", {"quantity": "velocity"}, {"linear", "spline"}),
        ("recorded_motion", {"quantity": "displacement"}, {"spline"}),
        ("recorded_support_motion", {"support": "base"}, {"linear", "spline"}),
    ],
)
def test_what_fills_a_hole_is_as_smooth_as_the_load(
    table: str, keys: dict[str, Any], allowed: set[str], tmp_path: Path
) -> None:
    """A motion whose derivative acts neither jumps nor bends in its record; without `holes` all are refused."""
    path = recorded(tmp_path / "hole.csv", HOLED, HOLED**2)
    for holes in ("refuse", "linear", "spline", "zero"):
        tables = holed({"type": table, "file": path, "holes": holes, **keys})
        if holes in allowed:
            gapbeam.read_case(tables)
            continue
        words = "a hole of 0.181 s after row 10" if holes == "refuse" else 'holes = "'
        with pytest.raises(CaseError, match=words):
            gapbeam.read_case(tables)


def holed(load: dict[str, Any]) -> dict[str, Any]:
    """Return a beam under a load."""
    return {
        "beam": {"length": 0.5, "thickness": 0.01, "width": 0.02},
        "material": {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0},
        "support": [{"name": "base", "from": 0.0, "to": 0.05, "clearance": 1.0e-4}],
        "damping": {"frequencies": [40.0, 300.0], "ratios": [0.01, 0.01]},
        "model": {"type": "beam", "elements": 20},
        "load": [{"type": "gravity"}, load],
        "time": {"end": 0.05, "step": 1.0e-4},
    }


@pytest.mark.parametrize("interpolation", ["cubic", "monotone"])
@pytest.mark.parametrize("rows", [2, 3])
def test_few_rows_are_a_record(rows: int, interpolation: str, tmp_path: Path) -> None:
    """Two rows are a straight line, three on a line as well; a case with them is accepted."""
    times = np.linspace(0.0, 0.1, rows)
    path = recorded(tmp_path / "ramp.csv", times, 3.0 * times)
    signal = signal_of(force(path, interpolation=interpolation))
    assert signal.value(0.04) == pytest.approx(0.12, rel=1e-12)
    assert signal.peak == pytest.approx(0.3, rel=1e-12)
    load = {"type": "recorded_force", "point": 0.15, "file": path, "interpolation": interpolation}
    warnings(gapbeam.read_case(holed(load)))
