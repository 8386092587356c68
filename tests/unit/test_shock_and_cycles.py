"""Shock spectra against the closed form of a half-sine, rainflow counts against ASTM E1049 and a sine."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from gapbeam.postprocess.plot import plot
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.cycle_counts import SNCurve, cycle_counts, cycles_of
from gapbeam.postprocess.signals.shock_spectrum import largest_response, shock_spectrum
from gapbeam.postprocess.signals.signal import SignalError
from tests.unit.test_postprocess_synthetic import write_results

HEIGHT, LENGTH, INTERVAL = 100.0, 0.01, 1.0e-5
PUBLISHED = (-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0)
"""ASTM E1049-85, figure 6: ranges 3, 4, 6, 8, 9 with 0.5, 1.5, 0.5, 1, 0.5 cycles."""


def half_sine(span: float) -> np.ndarray:
    time = INTERVAL * np.arange(round(span / INTERVAL) + 1)
    return np.where(time < LENGTH, HEIGHT * np.sin(np.pi * time / LENGTH), 0.0)


@pytest.mark.parametrize("kind", ["absolute", "pseudo"])
@pytest.mark.parametrize("product", [0.2, 0.6, 0.81, 1.5, 3.3])
def test_half_sine(product: float, kind: str) -> None:
    """The undamped response is A / (1 - r^2) (sin(pi t / T) - r sin(w t)), r = pi / (w T), and free motion after it."""
    frequency = product / LENGTH
    r, time = 0.5 / product, np.linspace(0.0, LENGTH, 20_001)
    during = (np.sin(np.pi * time / LENGTH) - r * np.sin(2.0 * np.pi * frequency * time)) / (1.0 - r * r)
    after = abs(2.0 * r * np.cos(np.pi * product) / (1.0 - r * r))
    expected = HEIGHT * max(np.abs(during).max(), after)
    found = largest_response(half_sine(LENGTH + 1.5 / frequency), INTERVAL, frequency, 0.0, kind)
    assert found == pytest.approx(expected, rel=1e-3)


def test_kinds_agree_without_damping_and_differ_with_it() -> None:
    """With half of critical damping more comes through than the spring carries: the force of the damper."""
    shock = half_sine(0.1)
    one, other = (largest_response(shock, INTERVAL, 80.0, 0.0, kind) for kind in ("absolute", "pseudo"))
    assert one == pytest.approx(other, rel=1e-5)
    damped, spring = (largest_response(shock, INTERVAL, 80.0, 0.5, kind) for kind in ("absolute", "pseudo"))
    assert 1.05 * spring < damped < one


def test_published_rainflow_counts() -> None:
    ranges, _, counts = cycles_of(np.array(PUBLISHED))
    found = {size: float(counts[ranges == size].sum()) for size in np.unique(ranges)}
    assert found == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}


def test_damage_of_a_sine(tmp_path: Path) -> None:
    """N cycles of the range 2 A do N (2 A / R)^m / N_R; other records have no damage."""
    time = 1.0e-3 * np.arange(10_001)
    history = open_results(
        write_results(tmp_path, time, {"displacement": 3.0 * np.sin(2.0 * np.pi * 12.5 * time)})
    ).history
    history["axial_stress"] = ("time", "gauge"), 20e6 * np.sin(2.0 * np.pi * 12.5 * time)[:, None]
    history = history.assign_coords(gauge=["root"])
    history["axial_stress"].attrs["units"] = "Pa"
    found = cycle_counts(history, "axial_stress", SNCurve(3.0, 100e6, 2e6))
    assert found.damage("root") == pytest.approx(125.0 * 0.4**3 / 2e6, rel=5e-3)
    assert found.cycles["root"][2].sum() == pytest.approx(125.0, abs=1.0)
    plain = cycle_counts(history, "displacement")
    assert plain.damage("tip y") is None
    with pytest.raises(OptionError, match="displacement is in m, and an S-N curve is of stresses"):
        cycle_counts(history, "displacement", SNCurve(3.0, 100e6, 2e6))
    with pytest.raises(OptionError, match="exponent = -3; expected a positive number"):
        SNCurve(-3.0, 100e6, 2e6)


@pytest.mark.slow(minutes=0.1)
def test_figures_and_tables(tmp_path: Path) -> None:
    """Both are drawn, and stand in tables and data; what has no meaning is refused."""
    time = 1.0e-3 * np.arange(2001)
    shock = np.where(time < 0.05, 10.0 * np.sin(np.pi * time / 0.05), 0.0)
    run = write_results(tmp_path / "run", time, {"acceleration_absolute": shock, "contact_force": shock[:, None]})
    out = tmp_path / "out"
    names = {
        one.stem
        for one in plot(run, out, shock=("acceleration_absolute", "contact_force"), rainflow=("contact_force",))
    }
    assert {"shock_acceleration_absolute", "shock_contact_force", "cycles_contact_force"} <= names
    text, data = (out / "tables.txt").read_text(), json.loads((out / "figures.json").read_text())
    assert "Shock response of acceleration_absolute, m/s^2: damping ratio 0.05" in text
    assert "Rainflow cycles of contact_force in 2 s, N" in text
    assert set(data["shock_spectra"]["acceleration_absolute"]["responses"]) == {"tip y absolute", "tip y pseudo"}
    assert data["cycle_counts"]["contact_force"]["columns"]
    with pytest.raises(OptionError, match="displacement is in m, and shock spectra are of accelerations"):
        plot(run, out, shock=("displacement",))
    with pytest.raises(OptionError, match=r"damping = 1; expected a ratio"):
        plot(run, out, shock=("contact_force",), damping=1.0)
    with pytest.raises(OptionError, match="no record to count"):
        plot(run, out, sn_curve=(3.0, 1e8, 2e6))
    with pytest.raises(SignalError, match=r"11 values; expected at least 20"):
        shock_spectrum(open_results(run).history.isel(time=slice(0, 12)), "acceleration_absolute")


def columns_of(path: Path) -> dict[str, list[str]]:
    """Return the cells of a CSV file by the heads of their columns."""
    with path.open(encoding="utf-8", newline="") as file:
        heads, *rows = csv.reader(file)
    return {head: list(cells) for head, cells in zip(heads, zip(*rows, strict=True), strict=True)}


def test_shock_spectrum_in_its_file(tmp_path: Path) -> None:
    """The file holds the closed form of an undamped oscillator under a half-sine that ends the shock."""
    length, interval = 0.05, 1.0e-4
    time = interval * np.arange(10_001)
    shock = np.where(time < length, 10.0 * np.sin(np.pi * time / length), 0.0)
    run = write_results(tmp_path / "run", time, {"contact_force": shock[:, None]})
    written = plot(run, tmp_path, shock=("contact_force",), damping=0.0)
    assert tmp_path / "shock_contact_force.csv" in written
    found = columns_of(tmp_path / "shock_contact_force.csv")
    assert list(found) == ["frequency (Hz)", "base pseudo (N)", "gland pseudo (N)"]
    natural = np.array(found["frequency (Hz)"], dtype=float)
    heights = np.array(found["base pseudo (N)"], dtype=float)
    assert np.all(np.diff(natural) > 0.0)
    for wanted in (4.0, 16.0, 33.0, 70.0):
        place = int(np.argmin(np.abs(natural - wanted)))
        product = natural[place] * length
        r, during = 0.5 / product, np.linspace(0.0, length, 20_001)
        motion = np.sin(np.pi * during / length) - r * np.sin(2.0 * np.pi * natural[place] * during)
        after = abs(2.0 * r * np.cos(np.pi * product))
        expected = 10.0 * max(np.abs(motion).max(), after) / abs(1.0 - r * r)
        assert heights[place] == pytest.approx(expected, rel=2e-3), natural[place]


def test_cycles_in_their_file(tmp_path: Path) -> None:
    """The file holds the ranges, means and counts of figure 6 of ASTM E1049-85, for each face."""
    values = np.array(PUBLISHED)
    run = write_results(tmp_path / "run", np.arange(float(values.size)), {"contact_force": values[:, None]})
    assert tmp_path / "cycles_contact_force.csv" in plot(run, tmp_path, rainflow=("contact_force",))
    found = columns_of(tmp_path / "cycles_contact_force.csv")
    assert list(found) == ["column", "range (N)", "mean (N)", "count"]
    cycles = list(zip(*(map(float, found[head]) for head in ("range (N)", "mean (N)", "count")), strict=True))
    mine = sorted(cycle for name, cycle in zip(found["column"], cycles, strict=True) if name == "base")
    # By name of the peaks: A-B, B-C, E-F (the whole cycle), H-I, C-D, G-H, D-G.
    assert mine == [(3.0, -0.5, 0.5), (4.0, -1.0, 0.5), (4.0, 1.0, 1.0), (6.0, 1.0, 0.5), (8.0, 0.0, 0.5),
                    (8.0, 1.0, 0.5), (9.0, 0.5, 0.5)]  # fmt: skip
    assert found["column"].count("gland") == len(mine)


@pytest.mark.slow(minutes=0.1)
def test_power_density_in_its_file(tmp_path: Path) -> None:
    """The file's densities sum to the power A^2 / 2 of a sine."""
    time = 1.0e-3 * np.arange(4097)
    run = write_results(tmp_path / "run", time, {"displacement": 3.0e-3 * np.sin(2.0 * np.pi * 62.5 * time)})
    assert tmp_path / "psd_displacement.csv" in plot(run, tmp_path, psd=("displacement",))
    found = columns_of(tmp_path / "psd_displacement.csv")
    assert list(found) == ["frequency (Hz)", "tip y ((m)^2/Hz)"]
    frequency, density = (np.array(cells, dtype=float) for cells in found.values())
    assert np.sum(density) * frequency[0] == pytest.approx(0.5 * 3.0e-3**2, rel=1e-3)
    assert frequency[np.argmax(density)] == pytest.approx(62.5, abs=frequency[0])
