"""Clearances from recordings of an independent march: errors, intervals, membership, wear; faults of recordings."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.io import wavfile

import gapbeam as gb
from gapbeam.interface.case_atlas import repeating_scene
from gapbeam.postprocess.report.sections.atlas_section import library_sections
from gapbeam.studies.library.library_file import read_library_study
from gapbeam.studies.uncertain.probability import IntervalEstimate
from gapbeam.studies.uncertain.uncertain_file import settings_of_study
from tests.shared.case_texts import assert_refused
from tests.shared.command import PROJECT, alone, called_anew

FREQUENCY, FORCE = 0.8 / (2.0 * np.pi), 1.0
PERIOD = 1.0 / FREQUENCY
RANGES = {"stop.clearance": (0.5, 2.0), "stop.stiffness": (5.0, 80.0), "stop.damping": (0.05, 1.0)}


def marched(
    values: np.ndarray, seed: int, periods: int = 44, stiffness: float = 1.0, noise: float = 0.02,
    forces: list[np.ndarray] | None = None, damping: np.ndarray | float = 0.02,
) -> np.ndarray:  # fmt: skip
    """Return velocities (64 a period) of oscillators above a stop, by the textbook's Runge-Kutta march, with noise.

    m x'' + c x' + k x + max(0, K (x - g) + C x') [x > g] = F cos(w t), values: (members, 3) g, K, C; begun anywhere.
    `forces` takes the rms of the contact force about its mean over these periods, (members,).
    """
    g, K, C = values.T
    draw, count, n = np.random.default_rng(seed), len(values), 512
    h, first = PERIOD / n, int(draw.integers(n))

    def rate(t: float, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        touch = np.where(x > g, np.maximum(K * (x - g) + C * v, 0.0), 0.0)
        return FORCE * np.cos(0.8 * t) - damping * v - stiffness * x - touch

    x, v, kept = np.zeros(count), np.zeros(count), []
    square, mean = np.zeros(count), np.zeros(count)
    for i in range((20 + periods) * n):
        t = i * h
        if forces is not None and i >= 20 * n:
            pressed = np.where(x > g, np.maximum(K * (x - g) + C * v, 0.0), 0.0) / (periods * n)
            square, mean = square + pressed**2 * periods * n, mean + pressed
        a1 = rate(t, x, v)
        a2 = rate(t + h / 2, x + h / 2 * v, v + h / 2 * a1)
        a3 = rate(t + h / 2, x + h / 2 * v + h * h / 4 * a1, v + h / 2 * a2)
        a4 = rate(t + h, x + h * v + h * h / 2 * a2, v + h * a3)
        x = x + h * v + h * h / 6 * (a1 + a2 + a3)
        v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        if i >= 20 * n + first and (i - first) % 8 == 0:
            kept.append(v)
    y = np.array(kept).T
    if forces is not None:
        forces.append(np.sqrt(square - mean**2))
    return y + noise * np.sqrt((y**2).mean(axis=1, keepdims=True)) * draw.standard_normal(y.shape)


def recordings(y: np.ndarray) -> list[gb.Recording]:
    """Return velocities as recordings."""
    return [gb.Recording(np.arange(len(one)) * PERIOD / 64, one, "velocity", f"r{i}") for i, one in enumerate(y)]


def marched_library(members: int, **others: Any) -> gb.Library:
    """Return a library of an oscillator above a stop."""
    body = gb.mass(1.0, stiffness=1.0, damping=0.02, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(1.0), gb.KelvinVoigt(stiffness=20.0, damping=0.5), name="stop")
    shaker = gb.Force(body["at"], lambda t: FORCE * np.cos(0.8 * t), name="shaker")
    return gb.library(
        gb.Scene(body, contacts=[stop], loads=[shaker]), {path: stats.loguniform(*one) for path, one in RANGES.items()},
        point="at", quantity="velocity", period=PERIOD, members=members, periods=40, harmonics=8, settle=20,
        **{"steps": 256} | others,
    )  # fmt: skip


@pytest.fixture(scope="module")
def found() -> gb.Library:
    """Return a library that estimates well."""
    return marched_library(1024)


@pytest.fixture(scope="module")
def small() -> gb.Library:
    """Return a library that is quick to make."""
    return marched_library(256)


def drawn(count: int, seed: int) -> np.ndarray:
    """Return values inside the ranges, evenly in their logarithms."""
    ends = np.log(np.array(list(RANGES.values())))
    return np.exp(np.random.default_rng(seed).uniform(ends[:, 0], ends[:, 1], (count, 3)))


@pytest.mark.parametrize("settle", [5, 20, 40, 80])
def test_members_that_have_not_settled_are_named(settle: int, tmp_path: Path, caplog: Any) -> None:
    """A linear oscillator from rest in closed form: its transient changes the harmonics by more than noise, or less."""
    body = gb.mass(1.0, stiffness=1.0, damping=0.02, name="body")
    far = gb.Contact(body["at"], gb.HalfPlane(1e3), gb.KelvinVoigt(stiffness=20.0), name="stop")
    scene = gb.Scene(body, contacts=[far], loads=[gb.Force(body["at"], lambda t: np.cos(0.8 * t), name="shaker")])
    found = gb.library(
        scene, {"stop.stiffness": stats.loguniform(5, 80)}, point="at", quantity="velocity", period=PERIOD,
        members=256, periods=40, harmonics=8, settle=settle, steps=256, output=tmp_path,
    )  # fmt: skip
    t, X, rate = (settle + np.arange(40 * 64) / 64) * PERIOD, 1.0 / (0.36 + 0.016j), np.sqrt(1.0 - 1e-4)
    free = -X.real * np.cos(rate * t) + ((-0.8j * X).real - 0.01 * X.real) / rate * np.sin(rate * t)
    x = (X * np.exp(0.8j * t)).real + np.exp(-0.01 * t) * free
    first, second = (2.0 * np.fft.rfft(half)[::20][1:9] / len(half) for half in np.split(x, 2))
    change = np.linalg.norm(second - first) / abs(X)
    noise = np.random.default_rng(1).normal(0.0, 0.02 * abs(X) / np.sqrt(2.0), (400, 2, 20 * 64))
    lines = 2.0 * np.fft.rfft(noise)[..., 20:180:20] / (20 * 64)
    limit = np.sqrt(np.mean(np.sum(np.abs(lines[:, 1] - lines[:, 0]) ** 2, axis=1))) / abs(X)
    assert not 0.7 < change / limit < 1.3
    assert found.changing == float(change > limit)
    assert ("have not settled" in found.headline()) == (change > limit)
    assert gb.read_library(tmp_path).changing == found.changing
    assert ("have not settled" in caplog.text) == (change > limit)


@pytest.mark.slow(minutes=0.5)
def test_values_of_an_independent_march_are_found(found: gb.Library) -> None:
    """48 recordings with 2 % noise: the clearance to 1 %; intervals hold as often as a binomial of 95 % allows."""
    true = drawn(48, 7)
    estimates = [gb.estimate(found, one) for one in recordings(marched(true, 1))]
    table = np.array([[(x.value, x.low, x.high) for x in one.values.values()] for one in estimates])
    error = np.abs(table[..., 0] / true - 1.0)
    assert np.median(error[:, 0]) < 0.01
    stated = [row[3] for row in found.rows()]
    assert found.units == {"stop.clearance": "m", "stop.stiffness": "N/m", "stop.damping": "N s/m"}
    assert np.all(np.median(error, axis=0) < 2.0 * np.array(stated))
    inside = ((table[..., 1] <= true) & (true <= table[..., 2])).sum(axis=0)
    assert np.all(inside >= stats.binom(48, 0.95).ppf(1e-3))
    assert np.median(table[:, 0, 2] / table[:, 0, 1] - 1.0) < 0.1
    assert sum(one.is_outside for one in estimates) <= stats.binom(48, 0.01).ppf(0.999)
    again = gb.estimate(found, recordings(marched(true[:1], 1))[0])
    assert again.values == gb.estimate(found, recordings(marched(true[:1], 1))[0]).values


@pytest.mark.slow(minutes=0.5)
def test_the_error_of_a_coarse_step_is_removed() -> None:
    """With 64 steps in a period, intervals hold values and the rms force of fine marches, none of them outside."""
    force = gb.figure("rms-force", "contact_force", "stop", statistic="rms")
    coarse, values, forces = marched_library(1024, steps=64, figures=[force]), drawn(64, 17), list[np.ndarray]()
    estimates = [gb.estimate(coarse, one) for one in recordings(marched(values, 5, forces=forces))]
    true = np.column_stack([values, *forces])
    table = np.array([[(x.value, x.low, x.high) for x in one.values.values()] for one in estimates])
    inside = ((table[..., 1] <= true) & (true <= table[..., 2])).sum(axis=0)
    assert np.all(inside >= stats.binom(64, 0.95).ppf(1e-3))
    error = np.median(np.abs(table[..., 0] / true - 1.0), axis=0)
    assert error[0] < 0.01
    assert error[3] < 0.02
    assert sum(one.is_outside for one in estimates) <= stats.binom(64, 0.01).ppf(0.999)


@pytest.mark.slow(minutes=0.5)
def test_another_structure_is_outside(found: gb.Library) -> None:
    """Recordings of a structure of 1.5 times the stiffness, and in another unit, are said to be outside."""
    true = drawn(12, 8)
    other = [gb.estimate(found, one) for one in recordings(marched(true, 2, stiffness=1.5))]
    assert sum(one.is_outside for one in other) >= 10
    assert all(one.exit_status == 5 and "outside of the library" in one.headline() for one in other if one.is_outside)
    y = marched(true[:4], 2) * 1e3
    assert all(gb.estimate(found, one).is_outside for one in recordings(y))


@pytest.mark.slow(minutes=0.5)
def test_wear_is_seen_when_its_interval_says(found: gb.Library) -> None:
    """A clearance that grows by 1 % a week from 1: rate, time to 1.5 and the week of detection agree with intervals."""
    weeks = np.arange(26)
    true = np.column_stack([1.0 + 0.01 * weeks, np.full(26, 20.0), np.full(26, 0.3)])
    estimates = [gb.estimate(found, one) for one in recordings(marched(true, 3))]
    path = "stop.clearance"
    whole = gb.series(estimates, weeks, {path: 1.5}).trends[path]
    assert whole.is_seen
    assert whole.rate.low < 0.01 < whole.rate.high
    assert whole.reached is not None
    assert whole.reached.low < 50.0 < whole.reached.high
    error = np.median([(one.values[path].high - one.values[path].low) / 3.92 for one in estimates])
    spread = np.array([np.sqrt(((weeks[:n] - weeks[:n].mean()) ** 2).sum()) for n in range(3, 27)])
    expected = 3 + int(np.argmax(0.01 * spread > 1.96 * error))
    seen = next(n for n in range(3, 27) if gb.series(estimates[:n], weeks[:n]).trends[path].is_seen)
    assert seen <= 2 * expected
    steady = gb.series(estimates[:1] * 6, None, {path: 1.5}).trends[path]
    assert not steady.is_seen
    assert steady.reached is not None
    assert steady.reached.high == np.inf


def test_trend_is_least_squares_with_fieller_ends() -> None:
    """Rates cover the truth in 95 % of 2000 drawn series, and so do times to a limit."""
    draw, t, hits, reached = np.random.default_rng(4), np.arange(8.0), 0, 0
    for y in 1.0 + 0.1 * t + 0.05 * draw.standard_normal((2000, 8)):
        some = [gb.EstimatedValues("r", {"g": IntervalEstimate(v, v - 0.098, v + 0.098, 1)}, 1.0, ()) for v in y]
        one = gb.series(some, t, {"g": 2.5}).trends["g"]
        assert one.rate.value == pytest.approx(np.polyfit(t, y, 1)[0])
        hits += one.rate.low <= 0.1 <= one.rate.high
        assert one.reached is not None
        reached += one.reached.low <= 15.0 <= one.reached.high
    assert 0.94 < hits / 2000 <= 0.985
    assert 0.94 < reached / 2000 <= 0.985


@pytest.mark.parametrize("outside", [0, 1, 3])
@pytest.mark.parametrize("inside", [1, 2])
def test_series_without_a_trend_say_so(inside: int, outside: int) -> None:
    """With fewer than three recordings inside there are no rates: the time to a limit was left out without a word."""
    rarities = [1.0] * inside + [0.0] * outside
    some = [gb.EstimatedValues("r", {"g": IntervalEstimate(1.0, 0.9, 1.1, 1)}, rarity, ()) for rarity in rarities]
    one = gb.series(some, None, {"g": 2.5})
    assert not one.trends
    assert "no rates, no times to limits" in one.headline()


def test_library_is_read_back_and_continued(tmp_path: Path) -> None:
    """The folder gives the same estimates; another library in it, and damage, are refused."""
    body = gb.mass(1.0, stiffness=1.0, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(1.0), gb.KelvinVoigt(stiffness=9.0), name="stop")
    scene = gb.Scene(body, contacts=[stop], loads=[gb.Force(body["at"], np.cos)])
    given: dict[str, Any] = {
        "point": "at", "quantity": "velocity", "period": 2 * np.pi, "members": 256, "periods": 8, "harmonics": 3,
        "settle": 1, "steps": 24, "output": tmp_path / "a",
    }  # fmt: skip
    ranges = {"stop.clearance": stats.uniform(0.5, 0.5), "body.damping_factor": stats.uniform(0.5, 1.0)}
    first = gb.library(scene, ranges, **given)
    shutil.rmtree(tmp_path / "a" / "held")
    again = gb.library(scene, ranges, **given)
    read = gb.read_library(tmp_path / "a")
    headline, errors, words = library_sections(tmp_path / "a", "").pop().blocks
    assert headline.text == read.headline()
    assert [row[1:] for row in errors.rows] == [row[1:] for row in read.rows()]
    assert "velocity at `at` over 8 periods of 6.283 s" in words.text
    t = np.linspace(0.0, 60.0, 2000)
    one = gb.Recording(t, np.sin(t) + 0.3 * np.sin(2.0 * t), "velocity")
    for other in (again, read):
        assert np.array_equal(other.regression.weights, first.regression.weights)
        assert gb.estimate(other, one) == gb.estimate(first, one)
    later = gb.Recording(t[50:], np.asarray(one.values)[50:], "velocity")
    assert gb.estimate(read, later).values["stop.clearance"].value == pytest.approx(
        gb.estimate(read, one).values["stop.clearance"].value, rel=1e-3
    )
    with pytest.raises(gb.UserError, match="another"):
        gb.library(scene, ranges, **{**given, "settle": 2})
    whole = (tmp_path / "a" / "library.npz").read_bytes()
    for damaged in (b"none", b"", whole[:300], whole[: len(whole) // 2], whole[:80] + b"x" * 80 + whole[160:]):
        (tmp_path / "a" / "library.npz").write_bytes(damaged)
        with pytest.raises(gb.UserError, match="damaged"):
            gb.read_library(tmp_path / "a")
    with pytest.raises(gb.UserError, match="expected the folder of a library"):
        gb.read_library(tmp_path)
    for wrong, says in (
        ({"point": "tip"}, "point"), ({"quantity": "speed"}, "quantity"), ({"members": 300}, "power of two"),
        ({"figures": [gb.figure("late", "displacement", "at", start=1.0)]}, "figure late: it has a time"),
        (
            {"figures": [gb.figure("none", "contact_force", "stop", statistic="minimum")], "output": None},
            "figure none: 1 distinct",
        ),
        ({"noise": 0.0}, "noise"), ({"periods": 9}, "even number of periods"), ({"period": -1.0}, "period"),
    ):  # fmt: skip
        with pytest.raises(gb.UserError, match=says):
            gb.library(scene, ranges, **{**given, **wrong})
    with pytest.raises(gb.UserError, match="a path is unknown"):
        gb.library(scene, {"gap.clearance": stats.uniform(0.5, 0.5)}, **{**given, "output": None})
    with pytest.raises(gb.UserError, match="expected one of"):
        gb.series([gb.estimate(first, one)], None, {"x": 1.0})
    with pytest.raises(gb.UserError, match="one for each recording"):
        gb.series([gb.estimate(first, one)], [0.0, 1.0])
    with pytest.raises(gb.UserError, match="its range leaves"):
        gb.library(scene, {"stop.stiffness": stats.uniform(-1.0, 2.0)}, **{**given, "output": None})


T = np.arange(3000) * PERIOD / 64
Y = np.sin(0.8 * T) + 0.2 * np.cos(1.6 * T) + 0.1 * np.sin(2.4 * T)


@pytest.mark.parametrize(
    ("times", "values", "quantity", "says"),
    [
        (T[:2000], Y[:2000], "velocity", "40 periods of the load"),
        (T[::4], Y[::4], "velocity", "a period of harmonic 8"),
        (T * 1e3, Y, "velocity", "are the times in seconds"),
        (T, np.where(np.arange(3000) == 7, np.nan, Y), "velocity", "sample 8 is nan"),
        (T[::-1], Y, "velocity", "do not increase"),
        (np.delete(T, 9), np.delete(Y, 9), "velocity", "samples are missing"),
        (T, Y[:-1], "velocity", "one value for each time"),
        (T, Y, "acceleration", "expected velocity"),
        (T, Y, "speed", "expected displacement, velocity or acceleration"),
        (T, np.ones(3000), "velocity", "do not change"),
    ],
)
def test_recordings_that_cannot_be_used_are_refused(
    small: gb.Library, times: np.ndarray, values: np.ndarray, quantity: str, says: str
) -> None:
    """Each fault says what was found, and what was expected."""
    with pytest.raises(gb.UserError, match=says):
        gb.estimate(small, gb.Recording(times, values, quantity))  # type: ignore[arg-type]


def test_files_of_recordings(small: gb.Library, tmp_path: Path) -> None:
    """A CSV and a WAV file give the estimates of their numbers; units, columns and channels are checked."""
    y = Y
    whole = gb.estimate(small, gb.Recording(T, y, "velocity")).values["stop.clearance"]
    file = tmp_path / "a.csv"
    np.savetxt(file, np.column_stack([np.arange(len(y)) * PERIOD / 64, y * 1e3]), delimiter=",", header="time,tip",
               comments="", fmt="%.12g")  # fmt: skip
    read = gb.read_recording(file, "mm/s", column="tip", time_column="time")
    assert gb.estimate(small, read).values["stop.clearance"].value == pytest.approx(whole.value, rel=1e-6)
    rate = 10  # Hz: a WAV file has a whole number
    slow = np.interp(np.arange(int(len(y) * PERIOD / 64 * rate)) / rate, np.arange(len(y)) * PERIOD / 64, y)
    wavfile.write(tmp_path / "a.wav", rate, np.column_stack([slow, slow / 4.0 * 32767]).astype(np.int16))
    heard = gb.read_recording(tmp_path / "a.wav", "m/s", channel=2, full_scale=4.0)
    assert gb.estimate(small, heard).values["stop.clearance"].value == pytest.approx(whole.value, rel=5e-3)
    for arguments, says in (
        ({"unit": "mm/h"}, "unit: found 'mm/h'"), ({"unit": "m/s", "column": "top"}, "column"),
        ({"unit": "m/s", "column": 3}, "1 to 2"), ({"unit": "m/s", "full_scale": 1.0}, "full scale"),
        ({"unit": "m/s", "time_column": "t"}, "time column"),
    ):  # fmt: skip
        with pytest.raises(gb.UserError, match=says):
            gb.read_recording(file, **arguments)
    with pytest.raises(gb.UserError, match="there is no file"):
        gb.read_recording(tmp_path / "b.csv", "m/s")
    with pytest.raises(gb.UserError, match="channel: found 3, expected 1 to 2"):
        gb.read_recording(tmp_path / "a.wav", "m/s", channel=3, full_scale=1.0)
    with pytest.raises(gb.UserError, match="full scale: found none"):
        gb.read_recording(tmp_path / "a.wav", "m/s")
    with pytest.raises(gb.UserError, match="half a line"):
        gb.estimate(small, read, period=1.02 * PERIOD)


UNIVERSAL = """\
    -1
   164
         1  SI: Meter (newton)         2
  1.0000000000000000E+00  1.0000000000000000E+00  1.0000000000000000E+00
  2.7314999999999998E+02
    -1
    -1
    58
tube at the middle
NONE
27-Nov-26 10:00:00
NONE
NONE
    1         0    0         0       TUBE         7   2       NONE         0   0
         2        14         1  5.00000E-01  2.50000E-01  0.00000E+00
        17    0    0    0                 Time                    s
        11    0    0    0             Velocity                 mm/s
         0    0    0    0                 NONE                 NONE
         0    0    0    0                 NONE                 NONE
  1.00000E+00 -2.00000E+00-3.00000E-100  4.00000E+00  5.00000E+00 -6.00000E+00
  7.00000E+00  8.00000E+00  9.00000E+00  1.00000E+01  1.10000E+01  1.20000E+01
  1.30000E+01  1.40000D+01
    -1
    -1
    58
the same in double precision
NONE
NONE
NONE
NONE
    0         0    0         0       TUBE         7   2       NONE         0   0
         4         6         1  0.00000E+00  1.00000E-01  0.00000E+00
         0    0    0    0                 NONE                 NONE
         0    0    0    0                 NONE                 NONE
         0    0    0    0                 NONE                 NONE
         0    0    0    0                 NONE                 NONE
 1.2345678901234E+00-2.0000000000001E-03 3.0000000000000E+00 4.0000000000000E+00
 5.0000000000000E+00 6.0000000000000E+00
    -1
"""


def test_universal_files_hold_their_numbers(tmp_path: Path) -> None:
    """Two data sets 58 written by hand: columns without blanks, exponents of three digits, both precisions."""
    file = tmp_path / "tube.uff"
    file.write_text(UNIVERSAL)
    one = gb.read_recording(file, "mm/s")
    assert np.asarray(one.times).tolist() == [0.5 + 0.25 * i for i in range(14)]
    assert np.asarray(one.values).tolist() == [1e-3 * x for x in (1, -2, -3e-100, 4, 5, -6, *range(7, 15))]
    other = gb.read_recording(file, "m", channel=2)
    assert np.asarray(other.values).tolist() == [1.2345678901234, -2.0000000000001e-3, 3.0, 4.0, 5.0, 6.0]
    for unit, channel, said in (
        ("m", 1, "found velocity; expected displacement"), ("mm/s", 3, "channel: found 3, expected 1 to 2"),
    ):  # fmt: skip
        with pytest.raises(gb.UserError, match=said):
            gb.read_recording(file, unit, channel=channel)
    with pytest.raises(gb.UserError, match="full scale is of WAV files"):
        gb.read_recording(file, "mm/s", full_scale=1.0)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("    58\n", "   151\n", "found data sets 151, 164, expected a data set 58"),
        ("    58\n", "    58b     1     2\n", "binary data set 58b in line 8"),
        ("    1         0    0 ", "    4         0    0 ", "found a frequency response function; expected a time resp"),
        ("         2        14", "         5        14", "found complex values"),
        ("        14         1", "        14         0", "not evenly spaced"),
        ("2.50000E-01", "0.00000E+00", "an interval of 0 s"),
        ("        17    0", "        18    0", "an abscissa of type 18"),
        ("        11    0", "        13    0", "found excitation force; expected velocity"),
        ("  1.30000E+01  1.40000D+01\n", "", "2 lines of values; expected 3"),
        ("  4.00000E+00", "  4.00000E+OO", "'4.00000E.OO' in line 20, column 40; expected a number"),
        ("    -1\n    -1\n    58\nthe same", "the same", "lines of values; expected 3"),
        (" 5.0000000000000E+00 6.0000000000000E+00\n    -1\n", "", "has no end, -1"),
        (UNIVERSAL, "time,value\n", "no data set between lines of -1"),
        ("NONE\nNONE\n    1  ", "    -1\n", "found 3 lines; expected 11"),
    ],
)
def test_universal_files_that_cannot_be_used_are_refused(tmp_path: Path, old: str, new: str, says: str) -> None:
    """By name, with the data set or the line."""
    assert old in UNIVERSAL
    (tmp_path / "tube.unv").write_text(UNIVERSAL.replace(old, new))
    with pytest.raises(gb.UserError, match=says):
        gb.read_recording(tmp_path / "tube.unv", "mm/s")


HEAD = f'case = "{PROJECT / "cases" / "cantilever-stop.toml"}"\n[recorded]\npoint = "tip"\nquantity = "velocity"\n'
RANGE = '[[variable]]\npath = "stop*.clearance"\ndistribution = "uniform"\nparameters = {loc = 8e-4, scale = 1e-4}\n'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD, "no [[variable]]"),
        (RANGE, "recorded"),
        ("members = 300\n" + HEAD + RANGE, "a power of two from 256 to 16384"),
        (HEAD.replace("velocity", "speed") + RANGE, "quantity"),
        (HEAD + "periods = 9\n" + RANGE, "periods"),
        (HEAD + RANGE + RANGE, "every path once"),
    ],
)
def test_faults_of_the_file_are_at_their_keys(tmp_path: Path, text: str, says: str) -> None:
    """Each fault names what was found and what was expected."""
    assert_refused(read_library_study, tmp_path / "study.toml", text, says)


@alone
@pytest.mark.slow(minutes=0.5)
def test_commands(tmp_path: Path) -> None:
    """A library of a case, and an estimate from a run of the case with another clearance."""
    study = (PROJECT / "cases" / "studies" / "library-stop.toml").read_text()
    (tmp_path / "study.toml").write_text(study.replace("../", f"{PROJECT / 'cases'}/").replace("= 60", "= 20"))
    done = called_anew("library", tmp_path / "study.toml", "--output", tmp_path / "found")
    assert done.returncode == 0, done.stderr
    assert "512 members; median relative error" in done.stdout
    read = read_library_study(tmp_path / "study.toml")
    one = repeating_scene(Path(read.case), settings_of_study(tmp_path, read.set, []))
    step = one.period / 2048
    run = gb.history(one.scene.with_({"stop*.clearance": 7e-4}), step=step, end=55 * one.period)
    rows = np.column_stack([run.t, np.gradient(run.displacement["tip"], step) * 1e3])[30 * 2048 :: 8]
    np.savetxt(tmp_path / "tip.csv", rows, delimiter=",", header="time,tip", comments="", fmt="%.12g")
    head = UNIVERSAL.splitlines()[6:19]
    head[8] = f"         2{len(rows):10d}         1{rows[0, 0]:13.5e}{8 * step:13.5e}  0.00000E+00"
    lines = ["".join(f"{x:13.5e}" for x in rows[i : i + 6, 1]) for i in range(0, len(rows), 6)]
    (tmp_path / "tip.uff").write_text("\n".join([*head, *lines, "    -1", ""]))
    files = [tmp_path / "tip.csv", tmp_path / "tip.csv", tmp_path / "tip.uff"]
    given: tuple[Any, ...] = ("estimate", tmp_path / "found", *files)
    done = called_anew(*given, "--unit", "mm/s", "--at", "0,1,2", "--limit", "stop*.clearance=1e-3", "--output",
                       tmp_path / "new" / "folder" / "estimates.csv")  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    table = list(csv.DictReader((tmp_path / "new" / "folder" / "estimates.csv").open()))
    assert float(table[0]["estimate"]) == pytest.approx(7e-4, rel=0.03)
    assert float(table[0]["from"]) <= 7e-4 <= float(table[0]["to"])
    by_file = {row["recording"]: float(row["estimate"]) for row in table if row["value"] == "stop*.clearance"}
    by_value = {row["value"]: row for row in table}
    assert by_file["tip.uff"] == pytest.approx(by_file["tip.csv"], rel=1e-3)
    assert "no change seen" in done.stdout
    done = called_anew(*given[:3], "--unit", "mm/s", "--samples", tmp_path / "samples.csv")
    assert done.returncode == 0, done.stdout + done.stderr
    rows = list(csv.DictReader((tmp_path / "samples.csv").open()))
    assert [len(rows), list(rows[0])] == [4000, ["recording", *by_value]]
    low, high = np.quantile([float(row["stop*.clearance"]) for row in rows], [0.005, 0.995])
    assert low < 7e-4 < high < 1.3 * low
    assert "independent: stop*.clearance" in " ".join(done.stdout.split())
    outside = called_anew(*given[:3], "--unit", "m/s")
    assert outside.returncode == 5
    assert "outside of the library" in outside.stdout
    refused = called_anew(*given[:3], "--unit", "m/s", "--samples", tmp_path / "no.csv")
    assert refused.returncode == 2
    assert "so that there are no samples" in " ".join(refused.stderr.split())
    assert not (tmp_path / "no.csv").exists()
    for wrong, says in (
        (("--unit", "mm"), "expected velocity"), (("--unit", "mm/s", "--limit", "x"), "PATH=VALUE"),
        (("--unit", "mm/s", "--frequency", "25"), "half a line"),
    ):  # fmt: skip
        refused = called_anew(*given, *wrong)
        assert refused.returncode == 2
        assert says in " ".join(refused.stderr.split())
