"""Random loads against what statistics says of Gaussian noise, and against closed forms of a linear oscillator."""

from __future__ import annotations

from itertools import pairwise
from math import cos, log, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scipy.integrate import quad
from scipy.stats import chi2, kstest

import gapbeam
from gapbeam.postprocess.report.blocks import TableBlock, Words
from gapbeam.postprocess.report.sections.contact_section import random_loads_section
from gapbeam.solver.loads.random_function import (
    RandomSignal,
    _responses,
    filter_length,
    noise_key,
    normal_block,
    sample_rate,
)
from gapbeam.solver.loads.random_load import RandomLoad
from gapbeam.solver.models.body import body_key
from gapbeam.solver.run.run_case import run_case
from tests.regression.test_compiled_run import run_both, same_history
from tests.shared.command import DEMO
from tests.shared.interrupted import differing, run_in_parts
from tests.shared.models import COARSE, GRAVITY, beam_case
from tests.verification.test_joints_and_masses import AREA, DENSITY, LENGTH, ROOT, TIP, joint, tables

SURE = 1.0e-4  # share of seeds that a bound would refuse; the seeds are fixed
PROFILE = ((20.0, 80.0, 350.0, 2000.0), (0.01, 0.04, 0.04, 0.007))
WHITE = {"type": "white", "density": 0.4, "low": 5.0, "high": 200.0}
TABLE = {"type": "table", "frequencies": list(PROFILE[0]), "densities": list(PROFILE[1])}
FLOW = {"type": "turbulence", "velocity": 2.0, "length": 0.02}


def load(spectrum: dict[str, Any] | None = None, **keys: Any) -> RandomLoad:
    """Return a random force, of white noise unless a spectrum is given."""
    return RandomLoad.model_validate({"type": "random", "point": 0.15, "spectrum": spectrum or WHITE, **keys})


def asked(spectrum: dict[str, Any], f: float) -> float:
    """Return the one-sided density at a frequency by the formulas of the docs."""
    if spectrum["type"] == "white":
        return float(spectrum["density"]) if spectrum["low"] <= f <= spectrum["high"] else 0.0
    if spectrum["type"] == "table":
        return float(np.exp(np.interp(np.log(f), np.log(PROFILE[0]), np.log(PROFILE[1]))))
    reduced = f * 0.02 / 2.0
    return 5.0e-3 * reduced**-0.5 if reduced <= 0.2 else 4.0e-5 * reduced**-3.5


def integral(spectrum: dict[str, Any], low: float, high: float, power: int = 1) -> float:
    """Return the integral of a power of the density over a band, by quadrature."""
    corners = sorted({low, high, *(f for f in (20.0, 80.0, 350.0) if low < f < high)})
    parts = [quad(lambda f: asked(spectrum, f) ** power, *pair, epsrel=1e-10)[0] for pair in pairwise(corners)]
    return float(sum(parts))


@pytest.mark.parametrize(
    ("spectrum", "edges"),
    [
        (WHITE, (6.0, 20.0, 60.0, 120.0, 198.0)),
        (TABLE, (21.0, 60.0, 200.0, 600.0, 1950.0)),
        (FLOW, (1.2, 5.0, 20.0, 50.0, 190.0)),
    ],
    ids=("white", "table", "turbulence"),
)
def test_power_in_bands(spectrum: dict[str, Any], edges: tuple[float, ...]) -> None:
    """The power in bands of a long signal equals the integral, within the chi-squared bounds of its lines.

    It is sampled at a rate that has nothing to do with the noise's own. Neighboring lines under Hann's window are
    correlated, which leaves 18/35 of the degrees of freedom.
    """
    for seed in (1, 2):
        signal = load(spectrum, seed=seed).signal
        rate, count = 5.3 * signal.spectrum.high, 2**17
        values = signal.value(np.arange(count) / rate)
        window = np.hanning(count)
        lines = np.abs(np.fft.rfft(values * window)) ** 2 * 2.0 / (rate * float(window @ window))
        width = rate / count
        for low, high in pairwise(edges):
            first, last = round(low / width), round(high / width)
            expected = integral(spectrum, (first - 0.5) * width, (last + 0.5) * width)
            squares = integral(spectrum, low, high, 2)
            freedom = 2.0 * expected**2 / (squares * width) * 18.0 / 35.0
            ratio = float(np.sum(lines[first : last + 1])) * width / expected
            bounds = chi2.ppf((0.5 * SURE, 1.0 - 0.5 * SURE), freedom) / freedom
            assert bounds[0] < ratio < bounds[1], (seed, low, high, ratio, bounds)


@pytest.mark.parametrize("spectrum", [WHITE, TABLE, FLOW], ids=lambda spectrum: spectrum["type"])
def test_the_filter_has_the_spectrum(spectrum: dict[str, Any]) -> None:
    """Its taps, Fourier transformed 16 times as finely, times those of the spline: the density within 1 %."""
    one = load(spectrum).signal.spectrum
    taps = np.fft.irfft(_responses(one, None)[0])[: filter_length(one)]
    count, rate = 16 * len(taps), sample_rate(one)
    lines = np.fft.rfftfreq(count, 1.0 / rate)
    densities = 2.0 / rate * np.abs(np.fft.rfft(taps, count)) ** 2 * np.sinc(lines / rate) ** 8
    inside = np.flatnonzero((lines > 1.25 * one.low) & (lines < 0.98 * one.high))[:: len(lines) // 4000]
    expected = [asked(spectrum, float(f)) for f in lines[inside]]
    np.testing.assert_allclose(densities[inside], expected, rtol=0.011)
    power = integral(spectrum, one.low, one.high)
    assert np.sum(densities) * rate / count == pytest.approx(power, rel=2e-4)
    assert np.sum(densities[(lines < one.low) | (lines > one.high)]) * rate / count < 0.005 * power


@pytest.mark.parametrize("spectrum", [WHITE, TABLE, FLOW], ids=lambda spectrum: spectrum["type"])
def test_mean_square_and_distribution(spectrum: dict[str, Any]) -> None:
    """The mean square over many seeds is the integral of the density; samples far apart are normal."""
    one = load(spectrum).signal.spectrum
    duration = 300.0 / one.high
    power, squares = (integral(spectrum, one.low, one.high, k) for k in (1, 2))
    assert one.total == pytest.approx(power, rel=1e-9)
    times = np.linspace(0.0, duration, 3000)
    signals = np.array([load(spectrum, seed=seed).signal.value(times) for seed in range(60)])
    spread = np.sqrt(squares / duration / len(signals)) / power
    assert spread < 0.06
    assert np.mean(signals**2) / power == pytest.approx(1.0, abs=4.0 * spread)
    assert kstest(signals[:, ::1499].ravel() / np.sqrt(power), "norm").pvalue > SURE


def test_densities_of_two_sides_and_in_other_units() -> None:
    """A density over both sides is half as high; a scale turns g^2/Hz into (m/s^2)^2/Hz."""
    base = load().signal.spectrum
    both = load({**WHITE, "density": 0.2, "sides": "two"}).signal.spectrum
    in_g = load({**WHITE, "density": 0.4 / 9.81**2, "scale": 9.81**2}).signal.spectrum
    assert both == base
    assert in_g.total == pytest.approx(base.total, rel=1e-12)
    assert base.total == pytest.approx(0.4 * 195.0, rel=1e-12)
    assert load().peak == pytest.approx(3.0 * np.sqrt(0.4 * 195.0))


def test_seeds_and_names_are_independent() -> None:
    """Correlations of the signals of other seeds and names are as small as chance leaves them."""
    times = np.arange(2**15) / 1000.0
    keys = [{"seed": 1}, {"seed": 2}, {"seed": 1, "name": "other"}, {"seed": 12}]
    signals = np.array([load(**key).signal.value(times) for key in keys])
    correlation = np.corrcoef(signals) - np.eye(len(keys))
    independent = 2.0 * 195.0 * times[-1]
    assert np.abs(correlation).max() < 4.0 / np.sqrt(independent)


def test_a_value_depends_on_seed_and_time_alone() -> None:
    """One by one, in any order, among others, of a signal made anew: the same bits; also before t = 0."""
    times = np.concatenate([np.linspace(-2.0, 40.0, 3001), [0.0, 1.0e4, 3.0e5]])
    whole = load(seed=5).signal.value(times)
    order = np.random.default_rng(0).permutation(len(times))
    shuffled = load(seed=5).signal.value(times[order])
    assert np.array_equal(shuffled, whole[order])
    picked = order[:50]
    assert [load(seed=5).signal.value(float(times[k])) for k in picked] == whole[picked].tolist()
    assert np.ptp(whole) > 4.0


def test_the_signal_is_smooth_and_its_mean_is_exact() -> None:
    """Twice continuously differentiable; the mean over intervals is that of a fine quadrature, ramp included."""
    signal = RandomSignal(load().signal.spectrum, 3, "noise", 0.03)
    step = 1.0e-2 / signal.rate
    times = 0.1 + step * np.arange(4000)
    second = np.diff(signal.value(times), 2) / step**2
    assert np.abs(np.diff(second)).max() < 0.05 * np.abs(second).max()  # linear in a hundred pieces between samples
    edges = np.array([0.0, 0.013, 0.0131, 0.05, 0.2])
    means = signal.mean(edges[:-1], edges[1:])
    for mean, (start, end) in zip(means, pairwise(edges), strict=True):
        fine = start + (end - start) * (np.arange(200_000) + 0.5) / 200_000
        assert mean == pytest.approx(float(np.mean(signal.value(fine))), abs=1e-8)
    assert signal.mean(edges[1:2], edges[1:2])[0] == signal.value(float(edges[1]))


STIFFNESS, DAMPING, STEP, DURATION, DENSITY_OF_FORCE = 4.0e4, 40.0, 4.0e-4, 40.0, 2.0
MASS = DENSITY * AREA * LENGTH
BAND = {"type": "white", "density": DENSITY_OF_FORCE, "high": 400.0}


def oscillator(end: float, **random: Any) -> dict[str, Any]:
    """Return a rigid beam on two equal joints, far from its support, under noise: heave of one DOF."""
    halves = {"stiffness": {"vertical": STIFFNESS / 2.0}, "damping": {"vertical": DAMPING / 2.0}}
    return tables(
        {"type": "rigid"},
        joint=[joint(place, "elastic", **halves) for place in (ROOT, TIP)],
        load=[{"type": "random", **random}],
        analysis={"type": "transient", "start": "undeformed"},
        time={"end": end, "step": STEP},
        output={"errors": "none"},
    )


def heave(folder: Path, end: float = DURATION, **random: Any) -> tuple[np.ndarray, dict[str, Any]]:
    """Return the motion of the tip under noise, m, and the summary."""
    outcome = run_case(gapbeam.read_case(oscillator(end, **random)), folder, MPI.COMM_SELF)
    assert outcome.exit_status == 0, outcome.message
    assert outcome.summary["loop"] == "compiled"
    tip = gapbeam.open_results(folder).history["displacement"].sel(probe="tip")
    return np.asarray(tip[:, -1].values), outcome.summary


def response(f: float) -> float:
    """Return the density of heave: of the discrete-gradient midpoint rule, whose stage samples the force.

    x / F = 1 / (cos(w h / 2) (k - m W^2 + i c W)), W = 2 tan(w h / 2) / h.
    """
    half = np.pi * f * STEP
    warped = 2.0 * np.tan(half) / STEP
    factor = abs(np.cos(half) * (STIFFNESS - MASS * warped**2 + 1j * DAMPING * warped))
    return float(DENSITY_OF_FORCE / factor**2)


@pytest.mark.slow(minutes=0.1)
def test_stationary_response_of_an_oscillator(tmp_path: Path) -> None:
    """The mean square follows the discrete scheme, within its scatter, and is nearly S0 / (4 k c) of white noise.

    The same noise as an acceleration of the base gives the same motion times -m. The summary compares eight bands of
    equal power, whose mean squares add up to that asked for.
    """
    x, summary = heave(tmp_path / "force", point=LENGTH / 2.0, seed=4, spectrum=BAND)
    resonance = float(np.sqrt(STIFFNESS / MASS) / (2.0 * np.pi))
    corners = [0.0, *(resonance * np.array([0.8, 0.95, 1.0, 1.05, 1.2])), 400.0]
    power = sum(quad(response, *pair, epsrel=1e-9, limit=200)[0] for pair in pairwise(corners))
    squares = sum(quad(lambda f: response(f) ** 2, *pair, epsrel=1e-9, limit=200)[0] for pair in pairwise(corners))
    assert power == pytest.approx(DENSITY_OF_FORCE / (4.0 * STIFFNESS * DAMPING), rel=0.01)
    settled = x[round(2.0 / STEP) :]
    spread = np.sqrt(squares / DURATION) / power
    assert spread < 0.05
    assert np.mean(settled**2) / power == pytest.approx(1.0, abs=3.5 * spread)
    shaken, _ = heave(tmp_path / "base", 4.0, quantity="acceleration", seed=4, spectrum=BAND)
    np.testing.assert_allclose(shaken, -MASS * x[: len(shaken)], atol=1e-6 * MASS * np.abs(x).max())
    (found,) = summary["random_loads"]
    bands = found["bands"]
    inside = [band["least_ratio"] < band["generated"] / band["asked"] < band["most_ratio"] for band in bands]
    assert len(bands) == 8
    assert sum(inside) >= 6
    assert found["rms"] == pytest.approx(np.sqrt(800.0))
    assert sum(band["asked"] for band in bands) == pytest.approx(800.0, rel=2e-3)


@pytest.mark.slow(minutes=0.1)
def test_intervals_of_the_comparison_cover() -> None:
    """Over many seeds, 95 % of the ratios lie in their intervals, for spectra of all kinds."""
    for spectrum, end in ((WHITE, 10.0), (TABLE, 1.5), (FLOW, 45.0)):
        found = [band for seed in range(45) for band in load(spectrum, seed=seed).generated(end)["bands"]]
        inside = [band["least_ratio"] < band["generated"] / band["asked"] < band["most_ratio"] for band in found]
        assert len(found) >= 180
        assert 0.905 < np.mean(inside) < 0.985, (spectrum["type"], np.mean(inside))
        ratios = np.array([band["generated"] / band["asked"] for band in found])
        assert np.mean(ratios) == pytest.approx(1.0, abs=4.0 * np.std(ratios) / np.sqrt(len(ratios)))


SHAKEN = {"type": "random", "name": "shaker", "point": 0.4, "seed": 9, "spectrum": {**WHITE, "density": 300.0}}
FLOOR = {"type": "random", "name": "floor", "quantity": "acceleration", "ramp": 2e-3, "spectrum": WHITE}


@pytest.mark.slow(minutes=0.1)
def test_compiled_and_step_by_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both time loops take the same noise."""
    model = {"type": "reduced", "modes": 8, "shapes": 4}
    changes = {"mesh": COARSE, "model": model, "time": {"end": 0.02, "step": 5e-5}}
    case = beam_case(changes, (GRAVITY, SHAKEN, FLOOR), {"tip": 0.51})
    compiled, steps = run_both(case, tmp_path, monkeypatch)
    assert (compiled.exit_status, steps.exit_status) == (0, 0)
    assert compiled.summary["gates"]["impacts"] > 0
    assert compiled.summary["random_loads"] == steps.summary["random_loads"]
    same_history(tmp_path / "compiled", tmp_path / "steps", 1.0e-6)


RANDOM = '[[load]]\ntype = "random"\npoint = 0.4\nspectrum = { type = "white", density = 300.0, high = 300.0 }\n'
FLOWING = (
    '[[load]]\ntype = "random-line-load"\nspan = [0.1, 0.5]\ncoherence = { type = "gaussian", length = 0.1 }\n'
    'spectrum = { type = "white", density = 900.0, high = 300.0 }\n'
)


SHARING = (
    f'{RANDOM}name = "drag"\n'
    f'{RANDOM}name = "lift"\ncross_spectrum = {{ load = "drag", coherence = 0.6, phase = 30.0, delay = 0.01 }}\n'
)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("noise", [RANDOM, FLOWING, SHARING], ids=["at a point", "along the beam", "coherent"])
def test_a_run_continues_under_the_same_noise(noise: str, tmp_path: Path) -> None:
    """A run in parts has the bits of a run without a stop, and records do not change the noise."""
    text = DEMO.read_text(encoding="utf-8")
    case = tmp_path / "case.toml"
    case.write_text(text.replace("[[probe]]", f"{noise}\n[[probe]]", 1), encoding="utf-8")
    brief = ("mesh.size=0.05", "time.end=0.02", "output.errors=none")
    whole = gapbeam.run(case, brief, tmp_path / "whole")
    parts = run_in_parts(case, brief, tmp_path / "parts", (1,))
    assert whole.exit_status == parts.exit_status == 0
    assert not differing(tmp_path / "whole", tmp_path / "parts")
    coarse = gapbeam.run(case, (*brief, "output.history_interval=1e-3"), tmp_path / "coarse")
    every = gapbeam.open_results(tmp_path / "whole").history["displacement"]
    tenth = gapbeam.open_results(tmp_path / "coarse").history["displacement"]
    assert coarse.exit_status == 0
    assert np.array_equal(tenth.values, every.sel(time=tenth["time"], method="nearest").values)


def test_seed_and_spectrum_are_cheap_to_change() -> None:
    """Sweeps over seeds and densities share a model; another place is another model."""
    one = beam_case({"mesh": COARSE}, (GRAVITY, SHAKEN))
    other = beam_case({"mesh": COARSE}, (GRAVITY, {**SHAKEN, "seed": 1, "ramp": 0.1, "spectrum": FLOW}))
    moved = beam_case({"mesh": COARSE}, (GRAVITY, {**SHAKEN, "point": 0.3}))
    assert body_key(one) == body_key(other)
    assert body_key(one) != body_key(moved)


def test_the_report_compares_spectra() -> None:
    """A table for each load, with the bands that lie outside; words where the run was too short."""
    band = {"from": 10.0, "to": 20.0, "asked": 4.0, "generated": 3.0, "least_ratio": 0.8, "most_ratio": 1.2}
    load = {"name": "floor", "unit": "m/s^2", "seed": 3, "rms": 2.0, "seconds": 5.0}
    section = random_loads_section({"random_loads": [{**load, "bands": [band, {**band, "generated": 4.4}]}]})
    assert section is not None
    words, table = section.blocks
    assert isinstance(words, Words)
    assert isinstance(table, TableBlock)
    assert "1 of 2 bands" in words.text
    assert [row[-1] for row in table.rows] == ["no", "yes"]
    short = random_loads_section({"random_loads": [{**load, "bands": []}]})
    assert short is not None
    assert "too short" in str(short.blocks[0])
    assert random_loads_section({}) is None


def test_the_generator_is_the_published_one() -> None:
    """Philox4x64-10 gives the known answer of Random123 for key and counter 0; pairs of its words are normal pairs."""
    words = np.random.Philox(key=0, counter=2**256 - 1).random_raw(4)  # NumPy counts up before it draws
    published = "16554d9eca36314c db20fe9d672d0fdc d7e772cee186176b 7e68b68aec7ba23b"
    assert " ".join(f"{word:x}" for word in words) == published
    key = noise_key(5, "shaker")
    one, other = (int(word) >> 11 for word in np.random.Philox(key=key, counter=2**62 - 2).random_raw(2))
    radius, angle = sqrt(-2.0 * log((one + 1) * 2.0**-53)), 2.0 * pi * other * 2.0**-53
    first = normal_block(key, -1, 8)[:2]
    assert first == pytest.approx([radius * cos(angle), radius * sin(angle)], rel=1e-12)
