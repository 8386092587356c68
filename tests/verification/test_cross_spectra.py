"""Random loads that share noise: coherence and phase against the exact distributions of their estimates, and bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import coherence, csd, welch
from scipy.stats import chi2
from scipy.stats import f as fisher

from gapbeam.solver.loads.random_load import RandomLoad

SURE = 1.0e-4  # share of seeds that a bound would refuse; the seeds are fixed
RATE, LINES, WINDOWS = 1000.0, 4096, 64
TIMES = np.arange(LINES * WINDOWS) / RATE
FLAT = {"type": "white", "density": 0.4, "low": 5.0, "high": 200.0}
FALLING = {"type": "table", "frequencies": [5.0, 50.0, 200.0], "densities": [0.9, 0.9, 0.1]}
FROM_ZERO = {"type": "white", "density": 0.4, "high": 200.0}
ROWS = [20.0, 60.0, 150.0]


def signal(name: str, seed: int = 3, spectrum: dict[str, Any] = FLAT, **cross: Any) -> Any:
    """Return the signal of a random load, with a cross-spectrum where keys of one are given."""
    keys: dict[str, Any] = {"type": "random", "name": name, "point": 0.1, "seed": seed, "spectrum": spectrum}
    if cross:
        keys["cross_spectrum"] = {"load": "drag", **cross}
    return RandomLoad.model_validate(keys).signal


def density(spectrum: dict[str, Any], f: np.ndarray) -> np.ndarray:
    """Return the one-sided density within the band by the formulas of the docs."""
    if spectrum["type"] == "white":
        return np.full(len(f), float(spectrum["density"]))
    return np.asarray(np.exp(np.interp(np.log(f), np.log(spectrum["frequencies"]), np.log(spectrum["densities"]))))


def asked(cross: dict[str, Any], f: np.ndarray) -> np.ndarray:
    """Return the complex coherence that was asked for, from the load that is named to the one that names it."""
    rows = cross.get("frequencies", [1.0])
    gamma, phase = (
        np.interp(f, rows, np.broadcast_to(cross.get(key, 0.0), len(rows))) for key in ("coherence", "phase")
    )
    return np.asarray(gamma * np.exp(1j * np.radians(phase) - 2j * np.pi * f * cross.get("delay", 0.0)))


@pytest.mark.parametrize(
    ("cross", "spectrum"),
    [
        ({"coherence": 0.0}, FLAT),
        ({"coherence": 0.6}, FLAT),
        ({"coherence": 0.9, "phase": 90.0}, FALLING),
        ({"coherence": 0.5, "phase": -60.0}, FROM_ZERO),
        ({"coherence": 0.8, "delay": 0.0123}, FLAT),
        ({"coherence": 0.8, "delay": -0.02, "phase": 30.0}, FALLING),
        ({"coherence": [0.95, 0.7, 0.1], "phase": [0.0, 90.0, -200.0], "frequencies": ROWS}, FLAT),
    ],
    ids=("nothing", "number", "quadrature", "from 0 Hz", "delay", "ahead", "rows"),
)
def test_estimates_have_their_distributions(cross: dict[str, Any], spectrum: dict[str, Any]) -> None:
    """The transfer estimated from windows apart is off by what F allows, and the power left by what chi-squared does.

    Of K windows, |H_found - H|^2 Pxx over the power left Pyy (1 - C), times K - 1, is F with 2 and 2 K - 2 degrees of
    freedom; 2 K Pyy (1 - C) over the density S2 (1 - gamma^2) is chi-squared with 2 K - 2. The errors H_found - H times
    (K Pxx / S2 (1 - gamma^2))^(1/2) are complex normal, of variance 1: their mean over lines, turned by the phase,
    finds what all lines have in common, such as a coherence that is off by 0.03 or a phase by 3 degrees. Every third
    line is independent.
    """
    base = FROM_ZERO if spectrum is FROM_ZERO else FLAT
    x = signal("drag", spectrum=base).value(TIMES)
    y = signal("lift", spectrum=spectrum, **cross).value(TIMES)
    keys: dict[str, Any] = {"fs": RATE, "nperseg": LINES, "noverlap": 0, "detrend": False}
    lines, pxx = welch(x, **keys)
    pyy, pxy = welch(y, **keys)[1], csd(x, y, **keys)[1]
    left = pyy * (1.0 - coherence(x, y, **keys)[1])
    for low, high in ((8.0, 40.0), (40.0, 90.0), (90.0, 195.0), (8.0, 195.0)):
        band = np.flatnonzero((lines > low) & (lines < high))[::3]
        f = lines[band]
        wanted, s2 = asked(cross, f), density(spectrum, f)
        transfer = wanted * np.sqrt(s2 / density(base, f))
        errors = (pxy[band] / pxx[band] - transfer) * np.sqrt(pxx[band] / s2)
        off = np.abs(errors) ** 2
        ratio = float(np.sum(off) / np.sum(left[band] / s2) * (WINDOWS - 1))
        if not isinstance(cross["coherence"], list):  # the powers left of lines are alike
            freedom = 2 * len(f), 2 * (WINDOWS - 1) * len(f)
            assert ratio < fisher.ppf(1.0 - SURE, *freedom), (low, ratio)
        power = 2.0 * WINDOWS * float(np.sum(left[band] / (s2 * (1.0 - np.abs(wanted) ** 2))))
        bounds = chi2.ppf((0.5 * SURE, 1.0 - 0.5 * SURE), 2 * (WINDOWS - 1) * len(f))
        assert bounds[0] < power < bounds[1], (low, power, bounds)
        turned = errors * np.exp(-1j * np.angle(wanted)) / np.sqrt(1.0 - np.abs(wanted) ** 2)
        assert 2.0 * WINDOWS * float(np.sum(np.abs(turned) ** 2)) < chi2.ppf(1.0 - SURE, 2 * len(f)), low
        assert 2.0 * WINDOWS * abs(np.sum(turned)) ** 2 / len(f) < chi2.ppf(1.0 - SURE, 2), low
        own = 2.0 * WINDOWS * float(np.sum(pyy[band] / s2))
        bounds = chi2.ppf((0.5 * SURE, 1.0 - 0.5 * SURE), 2 * WINDOWS * len(f))
        assert bounds[0] < own < bounds[1], (low, own, bounds)


def test_the_ends_are_the_same_signal_and_another_one() -> None:
    """Coherence 0 has the bits of a load without a cross-spectrum; 1 is the other signal, scaled, turned or later."""
    times = np.linspace(-1.0, 30.0, 7001)
    drag = signal("drag").value(times)
    assert np.array_equal(
        signal("lift", coherence=0.0, phase=50.0, delay=0.1).value(times), signal("lift").value(times)
    )
    strong = {**FLAT, "density": 0.4 * 9.0}
    largest = float(np.abs(drag).max())
    np.testing.assert_allclose(signal("lift", coherence=1.0).value(times), drag, atol=1e-13 * largest)
    np.testing.assert_allclose(
        signal("lift", spectrum=strong, coherence=1.0).value(times), 3.0 * drag, atol=1e-12 * largest
    )
    np.testing.assert_allclose(signal("lift", coherence=1.0, phase=180.0).value(times), -drag, atol=1e-12 * largest)
    for delay in (0.0257, -0.4, 11.3):  # the spline between samples is off by 5e-4 of the rms
        later = signal("lift", coherence=1.0, delay=delay).value(times + delay)
        np.testing.assert_allclose(later, drag, atol=1e-3 * largest)


def test_a_value_depends_on_seed_and_time_alone() -> None:
    """One by one, in any order, before t = 0 and late, of a signal made anew: the same bits."""
    cross: dict[str, Any] = {"coherence": 0.6, "phase": 30.0, "delay": 7.7}
    times = np.concatenate([np.linspace(-2.0, 40.0, 2001), [0.0, 1.0e4, 3.0e5]])
    whole = signal("lift", **cross).value(times)
    order = np.random.default_rng(0).permutation(len(times))
    assert np.array_equal(signal("lift", **cross).value(times[order]), whole[order])
    assert [signal("lift", **cross).value(float(times[k])) for k in order[:30]] == whole[order[:30]].tolist()


def test_three_loads_and_other_draws() -> None:
    """Two loads that share noise with a third one have the product of their coherences; other noise keeps coherence."""
    lift, side = (signal(name, coherence=0.8).value(TIMES[::4]) for name in ("lift", "side"))
    spread = np.sqrt(1.2 / len(TIMES[::4]))  # 1.2: sum of the squared correlations of samples 4 ms apart
    assert np.corrcoef(lift, side)[0, 1] == pytest.approx(0.64, abs=4.0 * spread)
    keys: dict[str, Any] = {"type": "random", "point": 0.1, "seed": 3, "spectrum": FLAT}
    drag = RandomLoad.model_validate({**keys, "name": "drag"})
    lifting = RandomLoad.model_validate({**keys, "name": "lift", "cross_spectrum": {"load": "drag", "coherence": 0.8}})
    one, other = (load.with_other_noise(2).signal.value(TIMES[::4]) for load in (drag, lifting))
    assert np.corrcoef(one, other)[0, 1] == pytest.approx(0.8, abs=4.0 * spread)
    assert abs(np.corrcoef(one, drag.signal.value(TIMES[::4]))[0, 1]) < 4.0 * spread
