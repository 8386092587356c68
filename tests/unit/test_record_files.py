"""Files of recorded loads: how they may be written, what is refused and what is reported as a warning."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.checks.periodic_checks import TYPE
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.loads import record_file
from gapbeam.solver.loads.record_file import RecordError, read_record
from gapbeam.solver.loads.recorded_load import MOST_ROWS
from gapbeam.solver.models.time_step import frequency_of_interest
from tests.shared.case_texts import GOOD, assert_says, faults_of, written

RECORDED = GOOD.replace("amplitude = 20.0\nfrequency = 20.0\n", 'file = "signals/push.csv"\n').replace(
    '"harmonic_force"', '"recorded_force"'
)
TIMES = np.arange(0.0, 0.6005, 5.0e-4)
HEAD, COUNT = "time (s),force [N]\n", len(TIMES)


def rows(times: np.ndarray = TIMES, values: np.ndarray | None = None) -> str:
    """Return the rows of a sine of 20 Hz, or of other values."""
    values = np.sin(40.0 * np.pi * times) if values is None else values
    return "".join(f"{time:.9g},{value:.9g}\n" for time, value in zip(times, values, strict=True))


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """A case with a recorded load whose record is without faults."""
    (tmp_path / "signals").mkdir()
    record_of(tmp_path / "case.toml", HEAD + rows())
    return written(tmp_path, RECORDED)


def record_of(case: Path, content: str | bytes) -> Path:
    """Write the record of a case."""
    path = case.parent / "signals" / "push.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


WAYS: dict[str, tuple[str | bytes, tuple[int | str, int | str]]] = {
    "commas": (HEAD + rows(), (1, 2)),
    "names": (HEAD + rows(), ("time (s)", "force")),
    "no header": (rows(), (1, 2)),
    "semicolons": (HEAD + rows().replace(",", ";"), (1, 2)),
    "decimal commas": ("Zeit;Kraft\n" + rows().replace(",", ";").replace(".", ","), ("Zeit", "Kraft")),
    "tabs": ("t\tF\n" + rows().replace(",", "\t"), ("t", "F")),
    "blanks": (rows().replace(",", "   "), (1, 2)),
    "blanks and decimal commas": (rows().replace(",", "  ").replace(".", ","), (1, 2)),
    "comments": ("# by hand\n\n% another\n" + rows().replace("\n", " # said\n\n#\n"), (1, 2)),
    "units below names": ("Logger 12, 3\nt,F\ns,N\n" + rows(), ("t", "F")),
    "more columns": (rows().replace(",", ",ok,7,"), (1, 4)),
    "windows": (("\ufeff" + HEAD + rows()).replace("\n", "\r\n"), ("time", 2)),
    "old macs": ((HEAD + rows()).replace("\n", "\r"), (1, 2)),
    "latin-1": ((HEAD.replace("force", "Kr\xe4fte \xb5") + rows()).encode("latin-1"), (1, 2)),
    "quoted names": ('"time","force"\n' + rows(), ("time", "force")),
    "from the other side": (rows().replace(",", ";0;"), (1, 3)),
}


@pytest.mark.parametrize(("content", "columns"), WAYS.values(), ids=WAYS)
def test_rows_may_be_written_in_many_ways(
    content: str | bytes, columns: tuple[int | str, int | str], tmp_path: Path
) -> None:
    path = tmp_path / "push.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    record = read_record(str(path), *columns)
    assert record.times == pytest.approx(TIMES, abs=1e-9)
    assert record.values == pytest.approx(np.sin(40.0 * np.pi * TIMES), abs=1e-9)


@pytest.mark.parametrize("columns", [(1, 0), (0, 2), (1, -1), (1, 3)])
def test_columns_are_counted_from_1(columns: tuple[int, int], tmp_path: Path) -> None:
    """Also where no schema has looked at them: column 0 was the last one."""
    path = tmp_path / "push.csv"
    path.write_text(rows())
    with pytest.raises(RecordError) as refused:
        read_record(str(path), *columns)
    assert "1 to 2" in f"{refused.value} {vars(refused.value)}"


BAD: dict[str, tuple[str | bytes, dict[str, Any], tuple[str, ...]]] = {
    "empty": ("", {}, ("empty", "a time and a value")),
    "words": ("no numbers\nat all\n", {}, ("without a row of two numbers", "no numbers")),
    "one column": ("1\n2\n3\n4\n", {}, ("without a row", "put the times in front")),
    "binary": (b"\x89HDF\r\n\x1a\n\0\0", {}, ("a binary file", "export it as text")),
    "noise": (bytes(range(1, 256)) * 300, {}, ("without a row",)),
    "utf-16": (rows().encode("utf-16"), {}, ("a binary file", "UTF-8")),
    "ragged": (HEAD + rows().replace("\n0.1,", "\n0.1,0,"), {}, ("3 columns in line 202", "2, as in the first")),
    "cut off": (HEAD + rows() + "0.6", {}, ("1 column in line 1203", "cut off")),
    "a word": (HEAD + rows().replace("\n0.1,", "\n0.1,x"), {}, ("in line 202", "a number")),
    "no value": (HEAD + rows().replace("\n0.1,", "\n,"), {}, ("'' in line 202", "a number")),
    "nan": (HEAD + rows().replace("\n0.1,", "\n0.1,nan#"), {}, ("value nan in row 201", "finite")),
    "infinite": (HEAD + rows().replace("\n0.1,", "\n0.1,-1e999#"), {}, ("value -inf in row 201",)),
    "absurd": (HEAD + rows().replace("\n0.1,", "\n0.1,1e31#"), {}, ("1e+31 in row 201", "1e+30")),
    "back": (HEAD + rows().replace("\n0.1,", "\n0.05,"), {}, ("0.0995 in row 200 and 0.05 in row 201", "increase")),
    "twice": (HEAD + rows().replace("\n0.1,", "\n0.0995,"), {}, ("again in row 201", "too few digits")),
    "few": ("0,0\n", {}, ("1 row\n", "at least 2")),
    "a hole": (
        rows(np.concatenate([TIMES[:20], TIMES[380:]])),
        {},
        ("a hole of 0.1805 s after row 20, from 0.0095 to 0.19 s, 361 median intervals", 'holes = "linear"'),
    ),
    "two holes": (
        rows(np.concatenate([TIMES[:20], TIMES[380:500], TIMES[510:]])),
        {"time_scale": 2.0},
        ("a hole of 0.361 s after row 20, from 0.019 to 0.38 s", "and 1 narrower ones"),
    ),
    "too close": ("0,0\n5e-324,1\n1,0\n2,3\n", {}, ("between rows 1 and 2", "far enough apart")),
    "long line": (rows() + "1," * 9000, {}, ("more than 10000 characters in line 1202",)),
    "no such column": (HEAD + rows(), {"value_column": 3}, ("column 3", "1 to 2")),
    "no such name": (HEAD + rows(), {"value_column": "farce"}, ("farce", "time (s) or force [N]", "did you mean")),
    "no names": (rows(), {"value_column": "force"}, ("no line above the rows", "a number of a column")),
    "one column twice": (rows(), {"value_column": 1}, ("the column of the times", "counted from 1")),
    "another file": (rows(), {"checksum": "0" * 64}, ("SHA-256", "0000, as checksum says", "has changed")),
    "too short": (rows(TIMES[:1000]), {}, ("[time] end", "ends 0.4995 s after the start", "end = 0.4995", '"repeat"')),
    "other units": (rows(1e-3 * TIMES), {}, ("ends 0.0006 s", "another unit than s?")),
    "starts too late": (rows(), {"start": 0.7}, ("sees nothing of the record", "from 0 to 0.6 s")),
    "starts too early": (rows(), {"start": -0.1}, ("before the first row at 0 s", '"zero"')),
    "open round": (rows(TIMES[:1190]), {"beyond": "repeat"}, ("in the first row and", "the first of the next round")),
    "endless rounds": (
        "0,0\n1e-9,1\n2e-9,1\n3e-9,0\n",
        {"beyond": "repeat"},
        ("repeat, of 4 rows", f"at most {MOST_ROWS}"),
    ),
    "scaled away": (rows(), {"scale": 1e30, "offset": 1e30}, ("a peak of 2e+30", "at most 1e+30")),
}


@pytest.mark.parametrize(("content", "keys", "words"), BAD.values(), ids=BAD)
def test_what_cannot_be_used_is_refused(
    content: str | bytes, keys: dict[str, Any], words: tuple[str, ...], case: Path
) -> None:
    """One fault each, with what was found, what was expected and what to try."""
    record_of(case, content)
    (fault,) = faults_of(case, {f"load.shaker.{key}": value for key, value in keys.items()})
    assert_says(fault, words)


def test_places_without_a_record(case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Missing, a folder, a pipe, a device, a NUL, too large, not to be read; none is waited for."""
    record = record_of(case, rows())
    for file, words in (
        ("signals/pushed.csv", ("where there is no file", "did you mean push.csv?")),
        ("signal/push.csv", ("where there is no file", "there is no folder")),
        ("signals", ("a folder",)),
        ("/dev/zero", ("a device or pipe",)),
        ("a\0b", ("where there is no file",)),
    ):
        (fault,) = faults_of(case, {"load.shaker.file": file})
        assert_says(fault, words)
    (fault,) = faults_of(case, {"load.shaker.file": "signals/thrust.csv"})
    assert "did you mean" not in str(fault)  # of a file that has nothing but its suffix in common
    os.mkfifo(tmp_path / "pipe")
    (fault,) = faults_of(case, {"load.shaker.file": "pipe"})
    assert_says(fault, ("a device or pipe",))
    monkeypatch.chdir(record.parent)
    (fault,) = faults_of(case, {"load.shaker.file": "push.csv"})
    assert_says(fault, (f"{record} is a file: give that path",))
    monkeypatch.setattr(record_file, "LARGEST", 1000)
    (fault,) = faults_of(case)
    assert_says(fault, (f"a file of {record.stat().st_size} bytes", "at most 1000 bytes"))


def test_all_faults_are_reported_at_once(case: Path) -> None:
    """Two faults of the numbers, one of another load, one of another table; and the periodic analysis."""
    record_of(case, HEAD + rows().replace("\n0.1,", "\n0.05,").replace("\n0.2,", "\n0.2,nan#"))
    text = case.read_text() + '[[load]]\ntype = "recorded_motion"\nfile = "none.csv"\n'
    faults = faults_of(written(case.parent, text.replace("clearance = 0.107e-3", "clearance = -1.0")))
    message = "\n".join(map(str, faults))
    assert_says(message, ("0.05 in row 201", "value nan in row 401", "none.csv, where", "clearance"))
    record_of(case, rows())
    faults = faults_of(written(case.parent, RECORDED), {"analysis.type": "periodic", "model": "beam"})
    assert [fault.key for fault in faults] == [TYPE]
    assert_says(faults[0], ('the recorded force "shaker"', "no period is sought in a load that never repeats"))


def test_a_monotone_curve_has_no_second_derivative(case: Path) -> None:
    text = RECORDED.replace("recorded_force", "recorded_motion").replace("point = 0.15\n", "")
    path = written(case.parent, text)
    keys = {"load.shaker.interpolation": "monotone", "load.shaker.quantity": "displacement"}
    (fault,) = faults_of(path, keys)
    assert_says(fault, ("monotone, of a displacement", "jumps at every row"))
    assert read_case(path, {**keys, "load.shaker.quantity": "velocity"}).load[1].type == "recorded_motion"


SINE = np.sin(40.0 * np.pi * TIMES)
RANDOM = np.random.default_rng(1)
NOTED: dict[str, tuple[str, dict[str, Any], tuple[str, ...]]] = {
    "nothing": (rows(), {}, ()),
    "noise": (rows(TIMES, RANDOM.normal(size=COUNT)), {}, ("close to half its sampling rate of 2000 Hz", "aliases")),
    "too coarse a step": (rows(), {"time.step": 0.006}, ("6.06", "steps in a period of 27.5 Hz", "50 are good")),
    "rows that steps skip": (
        rows(np.linspace(0.0, 0.6, 60001), RANDOM.normal(size=60001)),
        {},
        ("longer than the 1e-05 s between rows", "above the 5000 Hz that steps can show"),
    ),
    "jumps": (rows(TIMES, 1.0 * (TIMES > 0.3)), {}, ("of its range beyond its rows", "monotone")),
    "jumps, monotone": (rows(TIMES, 1.0 * (TIMES > 0.3)), {"load.shaker.interpolation": "monotone"}, ()),
    "milliseconds": (rows(1e3 * TIMES, SINE), {}, ("lasts 600 s, 1e+03 times the run", "time_scale = 1e-3")),
    "milliseconds, scaled": (rows(1e3 * TIMES, SINE), {"load.shaker.time_scale": 1e-3}, ()),
    "starts at once": (rows(TIMES, 1.0 + TIMES), {}, ("starts with a jump to 1", "a ramp softens it")),
    "comes late": (
        rows(TIMES, 1.0 + TIMES),
        {"load.shaker.start": -0.1, "load.shaker.beyond": "zero"},
        ("starts with a jump to 1 at t = 0.1 s",),
    ),
    "ends at once": (
        rows(TIMES[:1001], TIMES[:1001]),
        {"load.shaker.beyond": "zero"},
        ("ends with a jump from 0.5 to 0 at t = 0.5 s",),
    ),
    "nothing at all": (rows(TIMES, 0.0 * TIMES), {}, ("is 0 all the time",)),
    "a long ramp": (rows(), {"load.shaker.ramp": 0.7}, ("ramp = 0.7 is longer than the run",)),
}


@pytest.mark.parametrize(("content", "keys", "words"), NOTED.values(), ids=NOTED)
def test_what_looks_like_a_slip_is_reported(
    content: str, keys: dict[str, Any], words: tuple[str, ...], case: Path
) -> None:
    record_of(case, content)
    step = keys.get("time.step", 1.0e-4)
    noted = [line for line in warnings(read_case(case, {**keys, "time.step": step})) if "shaker" in line]
    if words:
        assert_says("\n".join(noted), words)
    else:
        assert noted == []


def test_shaking_beyond_all_reason_is_reported(case: Path) -> None:
    text = RECORDED.replace("recorded_force", "recorded_motion").replace("point = 0.15\n", "")
    noted = warnings(read_case(written(case.parent, text), {"load.shaker.scale": 2e4}))
    assert_says("\n".join(noted), ("of the wave speed", "time_scale"))


def test_the_computed_step_follows_the_record(case: Path) -> None:
    """99 % of the power of a chirp up to 400 Hz lie below it, and above the second bending frequency."""
    record_of(case, rows(TIMES, np.sin(2.0 * np.pi * (300.0 + 80.0 * TIMES) * TIMES)))
    frequency, origin = frequency_of_interest(read_case(case, {"time.step": "auto"}))
    assert 350.0 < frequency < 420.0
    assert "99% of the power of the load shaker" in origin


@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize("middle", [0.02, 0.5, 0.97])
@pytest.mark.parametrize("width", [1.5e-3, 5e-3])
def test_a_pulse_counts_wherever_it_lies_and_however_rows_are_spread(
    middle: float, width: float, uneven: bool, case: Path
) -> None:
    """99 % of the power of exp(-(t / s)^2) lie below 2.5758 / (2 pi s), 0.99 being erf(2.5758 / sqrt(2))."""
    near = middle + width * np.linspace(-4.0, 4.0, 81)
    times = np.r_[0.0, near[(near > 0.0) & (near < 1.0)], 1.0] if uneven else np.linspace(0.0, 1.0, 2001)
    record_of(case, rows(times, np.exp(-(((times - middle) / width) ** 2))))
    (load,) = [
        one
        for one in read_case(case, {"load.shaker.holes": "linear", "time.end": 0.5, "time.step": 1e-4}).load
        if one.name == "shaker"
    ]
    assert load.frequency_of_interest is not None
    assert load.frequency_of_interest[0] == pytest.approx(2.5758 / (2.0 * np.pi * width), rel=0.1)
