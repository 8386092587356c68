"""Figures of a span of time, and power densities against signals whose densities are known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gapbeam.postprocess.plot import plot
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.shock_spectrum import power_density
from gapbeam.postprocess.signals.signal import SignalError
from gapbeam.solver.schema.record_table import CASE_FILE
from tests.shared.command import alone, called_in_turn
from tests.unit.test_postprocess_synthetic import write_results

INTERVAL, FREQUENCY = 1.0e-3, 62.5


@pytest.fixture(scope="module")
def noisy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return white noise of 2 N on the faces, and a sine that grows with time, 1 mm/s, at the tip."""
    time = INTERVAL * np.arange(16_385)
    noise = 2.0 * np.random.default_rng(3).standard_normal((time.size, 2))
    sine = 1.0e-3 * time * np.sin(2.0 * np.pi * FREQUENCY * time)
    records = {"contact_force": noise, "displacement": sine, "acceleration_absolute": sine, "penetration": 0.0 * time}
    return write_results(tmp_path_factory.mktemp("run") / "noisy", time, records, frequency=None)


def test_density_of_white_noise(noisy: Path) -> None:
    """2 sigma^2 / rate at all frequencies: 95 % of the intervals hold it, and the sum is the variance."""
    found = power_density(open_results(noisy).history, "contact_force", resolution=4.0)
    assert (found.windows, found.resolution) == (130, pytest.approx(4.0))
    expected = 2.0 * 4.0 * INTERVAL
    inside = []
    for label, density in found.densities.items():
        assert found.rms[label] == pytest.approx(2.0, rel=0.02)
        assert np.sum(density) * found.resolution == pytest.approx(found.rms[label] ** 2, rel=0.03)
        inside += [(found.least * density < expected) & (expected < found.most * density)]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.035)


def test_density_of_a_sine(tmp_path: Path) -> None:
    """The power A^2 / 2 lies at the frequency; records that do not change have no density."""
    time = INTERVAL * np.arange(4097)
    sine = 3.0e-3 * np.sin(2.0 * np.pi * FREQUENCY * time)
    history = open_results(write_results(tmp_path, time, {"displacement": sine})).history
    found = power_density(history, "displacement")
    assert list(found.densities) == ["tip y"]  # x does not move
    density = found.densities["tip y"]
    assert found.frequency[np.argmax(density)] == pytest.approx(FREQUENCY, abs=found.resolution)
    assert np.sum(density) * found.resolution == pytest.approx(0.5 * 3.0e-3**2, rel=1e-3)
    with pytest.raises(SignalError, match="no value changes"):
        power_density(history, "velocity")


@pytest.mark.slow(minutes=0.2)
def test_a_span_of_time(noisy: Path, tmp_path: Path) -> None:
    """Peaks, figures and densities are those of the span."""
    names = {path.stem for path in plot(noisy, tmp_path, begin=2.0, end=5.0, psd=("contact_force", "displacement"))}
    assert {"time_history", "contact", "energy", "psd_contact_force", "psd_displacement"} <= names
    text, data = (tmp_path / "tables.txt").read_text(), json.loads((tmp_path / "figures.json").read_text())
    assert "records from t = 2 to 5 s" in text
    assert "Power density of contact_force, (N)^2/Hz: 16 windows" in text
    sine = data["signals"]["displacement"]
    assert sine["maximum"] == pytest.approx(5.0e-3, rel=1e-2)
    assert 4.9 < sine["time_of_maximum"] <= 5.0
    column = data["power_densities"]["displacement"]["columns"]["tip y"]
    assert column["rms"] == pytest.approx(1.0e-3 * np.sqrt((5.0**3 - 2.0**3) / 9.0 / 2.0), rel=1e-3)
    with Image.open(tmp_path / "psd_contact_force.png") as picture:
        assert np.asarray(picture.convert("L"), dtype=float).std() > 2.0
    whole = tmp_path / "whole"
    plot(noisy, whole)
    assert "records from t" not in (whole / "tables.txt").read_text()
    assert "power_densities" not in json.loads((whole / "figures.json").read_text())


def test_what_cannot_be_drawn_is_refused(noisy: Path, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="no record 'contact_forces'; expected one of: contact_force"):
        plot(noisy, tmp_path, psd=("contact_forces",))
    with pytest.raises(OptionError, match=r"no record from 20 s to 30 s; the run has records from 0 to 16.384 s"):
        plot(noisy, tmp_path, begin=20.0, end=30.0)
    with pytest.raises(SignalError, match=r"a resolution of 0.01 Hz takes 100 s, and the record has 16.3"):
        plot(noisy, tmp_path, psd=("contact_force",), resolution=0.01)
    with pytest.raises(SignalError, match="leaves 5 in a window, too few"):
        plot(noisy, tmp_path, psd=("contact_force",), resolution=200.0)
    with pytest.raises(SignalError, match="51 values; too few for a power density"):
        plot(noisy, tmp_path, begin=1.0, end=1.05, psd=("contact_force",))
    time = np.linspace(0.0, 0.05, 501)
    orbit = write_results(tmp_path / "orbit", time, {"displacement": np.sin(125.6 * time)})
    with (orbit / CASE_FILE).open("a", encoding="utf-8") as case:
        case.write('[analysis]\ntype = "periodic"\n')
    with pytest.raises(OptionError, match="one period of its response: no span"):
        plot(orbit, begin=0.01)


@pytest.mark.slow(minutes=0.2)
@alone
def test_the_command(noisy: Path, tmp_path: Path) -> None:
    """Means over an interval are noted; faults end with status 2."""
    words = ("plot", noisy, "--from", "1", "--to", "3", "--psd", "acceleration_absolute", "--output", tmp_path)
    done, faulty = called_in_turn(words, ("plot", noisy, "--psd", "contakt_force", "--output", tmp_path))
    assert done.returncode == 0, done.stderr
    assert "psd_acceleration_absolute.png" in done.stdout
    assert "is the mean over a record interval" in done.stdout
    assert faulty.returncode == 2
    assert "no record 'contakt_force'" in faulty.stderr
    assert "Traceback" not in faulty.stderr
