"""Records made for a response spectrum: their spectrum by a state-space integration of SciPy, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim, lfilter

import gapbeam as gb

CORNERS, LEVELS = [0.4, 1.0, 2.0, 6.5, 20.0], [1.2, 4.0, 9.0, 9.0, 3.6]  # Hz and m/s^2, as a design spectrum


def pseudo(record: Any, frequency: float, damping: float = 0.05) -> float:
    """Return w^2 max|z| of z'' + 2 zeta w z' + w^2 z = -a, exact for lines between the values."""
    w, h = 2.0 * np.pi * frequency, record.time[1]
    system = (
        np.array([[0.0, 1.0], [-(w**2), -2.0 * damping * w]]),
        np.array([[0.0], [-1.0]]),
        np.eye(2),
        np.zeros((2, 1)),
    )
    step = cont2discrete(system, h, method="foh")
    _, z, _ = dlsim(step, record.acceleration)
    return float(w**2 * np.abs(z[:, 0]).max())


@pytest.fixture(scope="module")
def record() -> Any:
    """Return a record of 20 s."""
    return gb.fitted_record(CORNERS, LEVELS, duration=20.0)


def test_the_spectrum_of_a_record_is_the_given_one(record: Any) -> None:
    """At the frequencies that the misfit is of, between them, and at the corners; it starts and ends at rest."""
    worst = int(np.argmax(np.abs(record.spectrum / record.wanted - 1.0)))
    some = [worst, *range(0, len(record.frequency), 6)]
    found = np.array([pseudo(record, f) for f in record.frequency[some]])
    assert record.misfit < 0.08
    assert np.abs(found / record.wanted[some] - 1.0).max() == pytest.approx(record.misfit, abs=1e-6)
    assert found == pytest.approx(record.spectrum[some], rel=1e-6)
    between = np.sqrt(record.frequency[1:] * record.frequency[:-1])[::6]
    wanted = np.exp(np.interp(np.log(between), np.log(CORNERS), np.log(LEVELS)))
    beside = np.array([pseudo(record, f) for f in between]) / wanted - 1.0
    assert np.abs(beside).max() < record.misfit + 0.02
    velocity = np.cumsum(record.acceleration) * record.time[1]
    assert record.acceleration[0] == record.acceleration[-1] == 0.0
    assert abs(velocity[-1]) < 1e-4 * np.abs(velocity).max()
    moved = np.cumsum(velocity) * record.time[1]
    assert abs(moved[-1]) < 1e-3 * np.abs(moved).max()


@pytest.mark.parametrize(("damping", "seed"), [(0.05, 5), (0.03, 3), (0.02, 0), (0.01, 1)])
def test_the_misfit_holds_between_the_frequencies_that_passes_correct(damping: float, seed: int) -> None:
    """The spectrum at 900 frequencies, by filters that SciPy makes of the oscillators, for any damping."""
    record = gb.fitted_record([2.0, 4.0, 8.0], [4.0, 9.0, 9.0], duration=8.0, damping=damping, seed=seed, tolerance=0.2)
    tones = np.geomspace(2.0, 8.0, 900)
    wanted = np.exp(np.interp(np.log(tones), np.log([2.0, 4.0, 8.0]), np.log([4.0, 9.0, 9.0])))
    found = np.zeros(len(tones))
    for place, w in enumerate(2.0 * np.pi * tones):
        rows, back, _ = cont2discrete(([-w * w], [1.0, 2.0 * damping * w, w * w]), record.time[1], method="foh")
        found[place] = np.abs(lfilter(np.ravel(rows), back, record.acceleration)).max()
    assert np.abs(found / wanted - 1.0).max() < record.misfit + 0.02


def test_seeds_give_other_records_and_the_same_one_again(record: Any) -> None:
    """The same seed, the same bits."""
    again, other = (gb.fitted_record(CORNERS, LEVELS, duration=20.0, seed=seed) for seed in (0, 1))
    assert np.array_equal(again.acceleration, record.acceleration)
    assert abs(np.corrcoef(other.acceleration, record.acceleration)[0, 1]) < 0.3


def test_an_oscillator_under_the_record_moves_by_its_spectrum(record: Any, tmp_path: Path) -> None:
    """The file as the load of a structure of 3 Hz with 5 % of damping: its largest w^2 z is 9 m/s^2."""
    w = 2.0 * np.pi * 3.0
    tables = {
        "structure": [{"name": "box", "model": {"type": "mass", "mass": 2.0, "stiffness": 2.0 * w**2,
                                                "damping": 2.0 * 2.0 * 0.05 * w}}],
        "load": [{"type": "recorded_motion", "file": str(record.write(tmp_path / "ground.csv")), "beyond": "zero"}],
        "time": {"step": 1e-3, "end": 20.0},
    }  # fmt: skip
    found = gb.history(gb.scene(tables), 1e-3, 20.0)
    assert w**2 * np.abs(found.displacement["at"]).max() == pytest.approx(9.0, rel=0.1)


def measured(kind: str) -> tuple[Any, Any]:
    """Return times from 3 s on, and a motion of 18 s: a chirp that dies out, two shocks, or noise of another unit."""
    t = np.arange(0.0, 18.0, 0.01)
    noise = np.random.default_rng(7).standard_normal(len(t))
    forms = {
        "a chirp": np.sin(2.0 * np.pi * (0.5 + 0.4 * t) * t) * np.exp(-t / 6.0) + 0.05 * noise,
        "two shocks": noise * (np.exp(-(((t - 4.0) / 1.5) ** 2)) + 0.5 * np.exp(-(((t - 12.0) / 2.0) ** 2))),
        "noise in g": 1e-3 * noise + 0.5,
    }
    return t + 3.0, forms[kind]


@pytest.mark.parametrize("kind", ["a chirp", "two shocks", "noise in g"])
def test_a_recorded_motion_is_changed_to_the_spectrum_and_stays_alike(kind: str) -> None:
    """The spectrum by SciPy's integration; in each band of an octave the record moves as the recorded motion did."""
    t, motion = measured(kind)
    found = gb.fitted_record(CORNERS, LEVELS, start=(t, motion), tolerance=0.15)
    assert found.time[0] == 0.0
    assert found.time[-1] == pytest.approx(t[-1] - t[0], abs=found.time[1])
    some = found.frequency[::8]
    wanted = found.wanted[::8]
    assert np.abs(np.array([pseudo(found, f) for f in some]) / wanted - 1.0).max() < 0.15
    before = np.interp(found.time, t - t[0], motion - motion.mean())
    lines, alike = np.fft.rfftfreq(len(before), found.time[1]), []
    for low in (1.0, 2.0, 4.0, 8.0):
        band = (lines >= low) & (lines < 2.0 * low)
        one, two = (np.fft.irfft(np.fft.rfft(x) * band, len(x)) for x in (before, found.acceleration))
        alike.append(np.corrcoef(one, two)[0, 1])
    assert min(alike) > 0.6, alike
    velocity = np.cumsum(found.acceleration) * found.time[1]
    assert abs(velocity[-1]) < 1e-4 * np.abs(velocity).max()


def test_a_record_that_fits_stays(record: Any) -> None:
    """Made from itself, a record keeps its motion; made from a part of it, it has the duration that is asked for."""
    again = gb.fitted_record(CORNERS, LEVELS, start=(record.time, record.acceleration))
    assert np.corrcoef(again.acceleration, record.acceleration)[0, 1] > 0.98
    part = gb.fitted_record(CORNERS, LEVELS, start=(record.time, record.acceleration), duration=12.0, tolerance=0.2)
    assert part.time[-1] == pytest.approx(12.0, abs=part.time[1])


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "another number of levels": ({"acceleration": [1.0, 2.0]}, "5 frequencies and 2 accelerations"),
    "periods": ({"frequency": CORNERS[::-1]}, "ascend.*periods"),
    "a level of 0": ({"acceleration": [0.0, *LEVELS[1:]]}, "above 0"),
    "a level that is none": ({"acceleration": [float("nan"), *LEVELS[1:]]}, "acceleration"),
    "a short record": ({"duration": 1.0}, "at least 7.5 s"),
    "a coarse step": ({"step": 0.02}, "at most 0.005 s"),
    "a long record": ({"duration": 1e5}, "50000 steps"),
    "no damping, no tolerance": ({"damping": 0.0, "tolerance": 0.0}, "damping 0.*tolerance 0"),
    "a tolerance that is not met": ({"tolerance": 1e-4}, "misfit of .* Hz, expected at most 0.01 %; try another seed"),
    "a text": ({"duration": "long"}, "duration.*a number"),
    "neither duration nor start": ({"duration": None}, "neither duration nor start"),
    "a start without times": ({"start": np.ones(9)}, "expected .times, accelerations."),
    "a start of two lengths": ({"start": (np.arange(9.0), np.ones(8))}, "as many of both"),
    "a start that goes back": ({"start": (np.arange(9.0)[::-1], np.ones(9))}, "do not ascend"),
    "a start at rest": ({"start": (np.arange(99.0), np.full(99, 9.81))}, "9.81 at all times"),
    "a start that is none": ({"start": (np.arange(9.0), [1.0, float("nan")] * 4 + [1.0])}, "start"),
    "a short start": ({"start": (np.arange(9.0), np.arange(9.0))}, "at most that of start, 8 s"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_spectra_are_refused(name: str) -> None:
    """What was found, what was expected, and what to try."""
    given, words = WRONG[name]
    with pytest.raises(gb.UserError, match=words):
        gb.fitted_record(**{"frequency": CORNERS, "acceleration": LEVELS, "duration": 10.0} | given)
