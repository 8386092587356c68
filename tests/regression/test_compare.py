"""Two runs side by side: known differences, shifted cycles, other branches, statistics, and what cannot be compared."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image

from gapbeam.postprocess.comparison_report import as_data
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.run_comparison import ComparisonError, RunComparison, compare
from gapbeam.postprocess.signals.steady_figures import steady
from tests.shared.command import alone, called
from tests.unit.test_postprocess_synthetic import write_results

FREQUENCY = 20.0
STEP = 1e-4


def motion(
    seconds: float = 2.0,
    lines: dict[float, complex] | None = None,
    offset: float = 0.0,
    step: float = STEP,
    noise: int | None = None,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return times and records of a sum of A sin(2 pi n f t + phase), lines being n: A exp(i phase), m.

    The acceleration is the exact mean over the interval that ends at t. With noise every forcing period has an
    amplitude of its own, drawn from a generator with that seed.
    """
    time = np.arange(round(seconds / step) + 1) * step
    shifted = time + offset
    x, v = np.zeros_like(time), np.zeros_like(time)
    for order, amplitude in (lines or {1.0: 1e-3, 2.0: 2e-4j}).items():
        omega = 2 * np.pi * order * FREQUENCY
        x += (amplitude * np.exp(1j * omega * shifted)).imag
        v += (amplitude * 1j * omega * np.exp(1j * omega * shifted)).imag
    if noise is not None:
        factors = 1.0 + 0.3 * np.random.default_rng(noise).standard_normal(round(seconds * FREQUENCY) + 1)
        x = x * factors[np.minimum((time * FREQUENCY + 1e-9).astype(int), len(factors) - 1)]
        v = np.gradient(x, step)
    a = np.concatenate([[0.0], np.diff(v) / step])
    force = 50.0 + 20.0 * np.sin(2 * np.pi * FREQUENCY * shifted)
    impulse = 50.0 * time + 20.0 * (1.0 - np.cos(2 * np.pi * FREQUENCY * shifted)) / (2 * np.pi * FREQUENCY)
    records = {"displacement": x, "velocity": v, "acceleration_absolute": a, "acceleration_relative": a}
    return time, records | {"contact_force": force, "impulse": impulse}


def laid(tmp_path: Path, one: tuple, other: tuple, tolerance: float = 0.01) -> RunComparison:
    """Compare two motions."""
    folders = [write_results(tmp_path / name, *given) for name, given in (("a", one), ("b", other))]
    return compare(open_results(folders[0]), open_results(folders[1]), tolerance)


def test_the_figures_of_a_known_motion(tmp_path: Path) -> None:
    """Amplitudes and phases as put in; peak to peak, force and impulse from their closed forms."""
    lines = {1.0: 1e-3 * np.exp(0.3j), 2.0: 2e-4j, 5.0: 5e-5}
    found = steady(open_results(write_results(tmp_path / "run", *motion(lines=lines))).history, FREQUENCY)
    assert found.cycle.period == 1
    assert (found.periods, found.windows) == (12, 3)
    for order in range(1, 6):
        expected = complex(lines.get(float(order), 0.0))
        assert np.allclose(found.harmonics["tip"][:, order - 1], expected, atol=1e-9)
    assert found.quantities["base largest recorded force"].mean == pytest.approx(70.0, rel=1e-6)
    assert found.quantities["base impulse"].mean == pytest.approx(50.0 / FREQUENCY, rel=1e-9)
    assert found.quantities["tip peak-to-peak displacement"].scatter < 1e-12


def test_smoothed_acceleration_is_the_mean_over_five_samples(tmp_path: Path) -> None:
    """A sine under a mean over 2.5 ms: peak to peak 2 A omega^2 sin(x)/x, x = pi f 2.5 ms."""
    found = steady(open_results(write_results(tmp_path / "run", *motion(lines={1.0: 1e-3}))).history, FREQUENCY)
    omega, x = 2 * np.pi * FREQUENCY, np.pi * FREQUENCY * 2.5e-3
    expected = 2e-3 * omega**2 * np.sin(x) / x
    assert found.quantities["tip peak-to-peak smoothed acceleration"].mean == pytest.approx(expected, rel=1e-3)
    assert found.quantities["tip peak-to-peak acceleration"].mean == pytest.approx(2e-3 * omega**2, rel=1e-3)


def test_the_same_cycle_agrees_however_it_is_sampled_and_wherever_it_begins(tmp_path: Path) -> None:
    """Another output interval, a longer record, a cycle of three periods begun elsewhere: all the same motion."""
    lines = {1.0: 1e-3, 1.0 / 3.0: 4e-4}
    found = laid(tmp_path, motion(3.0, lines), motion(4.0, lines, offset=2 / FREQUENCY, step=5e-5))
    assert found.way == "cycle"
    assert found.agree, found.verdict
    assert "period 3" in found.verdict
    assert max(one.rms for one in found.overlays) < 1e-3


def test_a_motion_whose_frame_is_not_known_is_compared_by_its_displacements(tmp_path: Path) -> None:
    """Absolute accelerations are not in the records of such runs."""
    folders = [write_results(tmp_path / name, *motion()) for name in "ab"]
    with h5py.File(folders[0] / "history.h5", "a") as file:
        del file["acceleration_absolute"]
    found = compare(*map(open_results, folders))
    assert found.agree, found.verdict
    assert [one.name for one in found.overlays] == ["tip displacement"]
    assert any("accelerations" in note for note in found.notes)


def test_a_known_difference_is_found(tmp_path: Path) -> None:
    """The first harmonic 3 % larger and turned by 0.02 rad: 3 % of the amplitude, and the angle."""
    one, other = {1.0: 1e-3, 2.0: 2e-4}, {1.0: 1.03e-3 * np.exp(0.02j), 2.0: 2e-4}
    found = laid(tmp_path, motion(lines=one), motion(lines=other))
    rows = {row.name: row for row in found.rows}
    assert rows["tip harmonic 1"].difference == pytest.approx(0.03 / 1.03, rel=1e-6)
    assert rows["tip harmonic 2"].difference < 1e-9
    assert found.phases["tip"][0] == pytest.approx(-0.02, abs=1e-6)
    assert not found.agree
    assert "differ by" in found.verdict
    assert laid(tmp_path / "wide", motion(lines=one), motion(lines=other), tolerance=0.05).agree


def test_another_cycle_is_another_branch(tmp_path: Path) -> None:
    """Period 1 against period 3, and against a motion that never repeats."""
    three = motion(2.0, {1.0: 1e-3, 1.0 / 3.0: 4e-4})
    found = laid(tmp_path, motion(), three)
    assert (found.way, found.agree) == ("branches", False)
    assert found.verdict == "different branches: period 1 against period 3"
    found = laid(tmp_path / "second", motion(noise=3), three)
    assert found.verdict == "different branches: no cycle against period 3"


def test_motions_without_cycle_are_compared_by_their_means(tmp_path: Path) -> None:
    """Two draws of a random motion agree within their scatter; one twice as large does not; short ones give nothing."""
    one, other = motion(20.0, noise=1, step=5e-4), motion(20.0, noise=2, step=5e-4)
    found = laid(tmp_path, one, other)
    assert found.way == "statistics"
    assert found.agree, found.verdict
    assert found.steady[0].windows >= 16
    larger = other[0], other[1] | {name: 2.0 * other[1][name] for name in ("displacement", "velocity")}
    found = laid(tmp_path / "larger", one, larger)
    assert not found.agree
    assert "standard errors" in found.verdict
    found = laid(tmp_path / "short", motion(1.0, noise=1), motion(1.0, noise=2))
    assert not found.agree
    assert "run longer" in found.verdict


def test_the_same_record_without_cycle_agrees_at_the_same_times(tmp_path: Path) -> None:
    """A chaotic run against itself with another output interval: no statistics are needed."""
    time, records = motion(2.0, noise=5)
    every = {name: values[::2] for name, values in records.items()}
    for name in ("acceleration_absolute", "acceleration_relative"):
        every[name] = np.concatenate([[0.0], 0.5 * (records[name][1::2] + records[name][2::2])])
    found = laid(tmp_path, (time, records), (time[::2], every))
    assert found.way == "same times"
    assert found.agree, found.verdict


def test_what_cannot_be_compared_is_explained(tmp_path: Path) -> None:
    """No forcing, another frequency, no common probe, too short a record: what was found and what is expected."""
    time, records = motion()
    good = write_results(tmp_path / "good", time, records)
    short = records | {name: values[:1501] for name, values in records.items()}
    bad = {
        "no period": write_results(tmp_path / "free", time, records, frequency=None),
        "same frequency": write_results(tmp_path / "other", time, records, frequency=25.0),
        "no common probe": write_results(tmp_path / "probe", time, records, probes=("end",)),
        "run longer": write_results(tmp_path / "short", time[:1501], short),
    }
    for words, folder in bad.items():
        with pytest.raises(ComparisonError, match=words):
            compare(open_results(good), open_results(folder))


@pytest.mark.slow(minutes=0.1)
@alone
def test_the_command_leaves_table_and_picture_and_reports_by_its_status(tmp_path: Path) -> None:
    """0 where runs agree, 5 where not, 2 for what is no results folder or no tolerance."""
    one = write_results(tmp_path / "a", *motion())
    other = write_results(tmp_path / "b", *motion(lines={1.0: 1.1e-3, 2.0: 2e-4j}))
    done = called("compare", one, other, "--output", tmp_path / "out", "--tolerance", "2%")
    assert done.returncode == 5, done.stderr
    assert "differ by 9.1 %" in done.stdout
    message = json.loads((tmp_path / "out" / "comparison.json").read_text(encoding="utf-8"))
    assert message["agree"] is False
    assert {row["name"] for row in message["figures"]} >= {
        "tip peak-to-peak displacement",
        "tip harmonic 5",
        "gland impulse",
    }
    with Image.open(tmp_path / "out" / "comparison.png") as picture:
        assert len(picture.convert("RGB").getcolors(1 << 24) or []) > 50
    assert called("compare", one, one, "--output", tmp_path / "same").returncode == 0
    assert called("compare", one, tmp_path / "nothing").returncode == 2
    assert called("compare", one, other, "--tolerance", "2").returncode == 2


def test_as_data_is_json(tmp_path: Path) -> None:
    """Nothing that JSON cannot hold, also where an amplitude is 0."""
    still = np.zeros(20001)
    found = laid(tmp_path, motion(), (motion()[0], {"displacement": still}))
    json.dumps(as_data(found), allow_nan=False)


def test_a_computed_orbit_is_compared_with_a_march(tmp_path: Path) -> None:
    """One cycle of period 3, as shooting leaves it, against a long record of the same motion: impulse included."""
    lines = {1.0: 1e-3, 1.0 / 3.0: 4e-4}
    one = write_results(tmp_path / "orbit", *motion(3 / FREQUENCY, lines))
    text = (one / "case.toml").read_text(encoding="utf-8")
    (one / "case.toml").write_text(f'{text}\n[analysis]\ntype = "periodic"\n', encoding="utf-8")
    other = write_results(tmp_path / "march", *motion(3.0, lines))
    found = compare(open_results(one), open_results(other), 1e-3)
    assert found.steady[0].cycle.period == 3
    assert found.agree, found.verdict
