"""Random loads and swept sines that are refused, or probably not meant: every message says what to change."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import CaseError
from tests.shared.case_texts import GOOD, assert_says

POINT = "point = 0.15\n"
NOISE = '[[load]]\ntype = "random"\n'
WHITE = 'spectrum = { type = "white", density = 0.1, low = 10.0, high = 300.0 }\n'
SWEEP = '[[load]]\ntype = "swept-sine"\namplitude = 5.0\n'
BAND = "start_frequency = 5.0\nend_frequency = 60.0\nduration = 0.5\n"

BAD = {
    "force at no point": (NOISE + WHITE, ["[[load]] number 3", "point", "missing, of a force", 'quantity = "accel']),
    "acceleration at a point": (
        NOISE + POINT + 'quantity = "acceleration"\n' + WHITE,
        ["point", "of an acceleration", "leave point out"],
    ),
    "outside": (NOISE + "point = 0.7\n" + WHITE, ["x = 0.7 m, outside the beam"]),
    "no spectrum": (
        NOISE + POINT,
        ["spectrum", "missing", 'spectrum = { type = "white", density = 0.01, high = 500.0 }'],
    ),
    "unknown spectrum": (
        NOISE + POINT + 'spectrum = { type = "pink", high = 3.0 }\n',
        ['"white", "table", "file" or "turbulence"'],
    ),
    "misspelled": (
        NOISE + POINT + 'spectrum = { type = "white", densty = 1.0, high = 100.0 }\n',
        ["`densty`", "`density`"],
    ),
    "no band": (
        NOISE + POINT + 'spectrum = { type = "white", density = 1.0, low = 300.0, high = 100.0 }\n',
        ["low", "300 Hz, with high = 100 Hz", "low = 100 and high = 300"],
    ),
    "negative density": (
        NOISE + POINT + 'spectrum = { type = "white", density = -1.0, high = 100.0 }\n',
        ["density", "greater than 0"],
    ),
    "rows that do not pair": (
        NOISE + POINT + 'spectrum = { type = "table", frequencies = [1, 2, 3], densities = [1, 2] }\n',
        ["densities", "2 for 3 frequencies"],
    ),
    "rows that do not ascend": (
        NOISE + POINT + 'spectrum = { type = "table", frequencies = [10, 30, 20], densities = [1, 2, 3] }\n',
        ["frequencies", "20 Hz after 30 Hz", "sort the rows"],
    ),
    "rows that coincide": (
        NOISE + POINT + 'spectrum = { type = "table", frequencies = [10, 20, 20], densities = [1, 2, 3] }\n',
        ["20 Hz after 20 Hz", "20 and 20.02"],
    ),
    "row of zero": (
        NOISE + POINT + 'spectrum = { type = "table", frequencies = [0, 20], densities = [1, 2] }\n',
        ["frequencies", "[0, 20]", "ascending frequencies above 0, Hz"],
    ),
    "flow without a band": (
        NOISE + POINT + 'spectrum = { type = "turbulence", velocity = 2.0, length = 0.02, low = 500.0 }\n',
        ["from 500 to 200 Hz", "0.01 to 2 times velocity / length"],
    ),
    "densities beyond numbers": (
        NOISE + POINT + 'spectrum = { type = "white", density = 1e70, high = 100.0 }\n',
        ["1e+70", "at most 1e+30"],
    ),
    "too wide": (
        NOISE + POINT + 'spectrum = { type = "white", density = 1.0, low = 1e-3, high = 500.0 }\n',
        ["from 0.001 to 500 Hz", "a higher lowest frequency"],
    ),
    "step beyond the band": (
        NOISE + POINT + 'spectrum = { type = "white", density = 1.0, high = 9000.0 }\n',
        ["[time] step", "0.0001 s, with noise of which 99% lie below 8910 Hz", "step = "],
    ),
    "negative seed": (NOISE + POINT + "seed = -1\n" + WHITE, ["seed", "-1", "not less than 0"]),
    "seed that is no whole number": (NOISE + POINT + "seed = 1.5\n" + WHITE, ["seed", "whole number"]),
    "two of one name": (NOISE + POINT + WHITE + NOISE + POINT + WHITE, ["name", "noise", "different"]),
    "sweep at no point": (SWEEP + BAND, ["point", "missing, of a force"]),
    "sweep that goes nowhere": (
        SWEEP + POINT + BAND.replace("60.0", "5.0"),
        ["end_frequency", "5 Hz, as start_frequency", "harmonic_force"],
    ),
    "sweep beyond the step": (
        SWEEP + POINT + BAND.replace("60.0", "6000.0"),
        ["[time] step", "with a sine of up to 6000 Hz", "step = 3.33e-06"],
    ),
    "ramps that overlap": (
        SWEEP + POINT + BAND + 'after = "stop"\nramp = 0.3\n',
        ["ramp", "at both ends of a sweep", "at most half the sweep, 0.25 s", "ramp = 0.05"],
    ),
}


def written(folder: Path, loads: str) -> Path:
    """Write a case with more loads and return its path."""
    path = folder / "case.toml"
    path.write_text(GOOD.replace("[[probe]]", f"{loads}\n[[probe]]", 1), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", BAD)
def test_bad_loads_are_explained(name: str, tmp_path: Path) -> None:
    loads, words = BAD[name]
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, loads))
    assert_says(caught.value, words)


def test_all_faults_are_reported_together(tmp_path: Path) -> None:
    loads = NOISE + WHITE.replace("low = 10.0", "low = 400.0") + SWEEP + BAND.replace("60.0", "5.0")
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, loads))
    assert len(caught.value.faults) == 4


@pytest.mark.parametrize("loads", [NOISE + POINT + WHITE, SWEEP + POINT + BAND], ids=("random", "swept"))
def test_no_period_is_sought(loads: str, tmp_path: Path) -> None:
    keys: dict[str, Any] = {"analysis.type": "periodic", "model.type": "reduced"}
    with pytest.raises(CaseError, match="a load that never repeats"):
        read_case(written(tmp_path, loads), keys)


ODD = {
    "few periods": (NOISE + POINT + WHITE, ["6 periods of its lowest frequency, 10 Hz"]),
    "coarse step": (NOISE + POINT + WHITE.replace("300.0", "900.0"), ["11.2 steps in a period of 891.1 Hz"]),
    "late ramp": (NOISE + POINT + "ramp = 2.0\n" + WHITE, ["ramp = 2 is longer than the run"]),
    "hard": (
        NOISE + 'quantity = "acceleration"\n' + WHITE.replace("0.1,", "1e6,"),
        ["% of the wave speed of the material; are its values in SI units?"],
    ),
    "coarse records": (
        NOISE + POINT + WHITE,
        ["history_interval = 0.001 keeps 3.37 records in a period of 297.1 Hz"],
    ),
    "sweep cut off": (
        SWEEP + POINT + BAND.replace("0.5", "1.2"),
        ["takes 1.2 s, longer than the run of 0.6 s, which ends at 17.32 Hz", "time.end = 1.2"],
    ),
    "few cycles": (SWEEP + POINT + BAND.replace("0.5", "0.2"), ["6.5 cycles on its way"]),
    "jump at the end": (SWEEP + POINT + BAND + 'after = "stop"\n', ["the load ends with a jump"]),
    "nothing": (SWEEP.replace("5.0", "0.0") + POINT + BAND, ["amplitude = 0: it does nothing"]),
    "coarse sweep": (SWEEP + POINT + BAND.replace("60.0", "800.0"), ["12.5 steps in a period of 800 Hz"]),
    "coarse records of a sweep": (SWEEP + POINT + BAND.replace("60.0", "200.0"), ["keeps 5 records in a period"]),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_loads_are_warned_of(name: str, tmp_path: Path) -> None:
    loads, words = ODD[name]
    case = read_case(written(tmp_path, loads), {"output.history_interval": 1e-3})
    found = "\n".join(warnings(case))
    for word in words:
        assert word in found


FILE = NOISE + POINT + 'spectrum = { type = "file", file = "profile.csv" }\n'
BAD_FILES = {
    "no file": (None, ["spectrum file", "where there is no file", "a frequency and a density in each row"]),
    "zero": ("0,1\n10,1\n20,2\n", ["frequency_column", "the frequency 0 in row 1", "above 0"]),
    "negative": ("10,1\n20,-2\n", ["density_column", "the density -2 in row 2", "leave such rows out"]),
    "disorder": ("10,1\n30,2\n20,3\n", ["frequency_column", "frequencies that increase", "column of the frequencies?"]),
    "words": ("10,1\n20,many\n", ["'many' in line 2", "a number"]),
    "one row": ("10,1\n", ["1 row\n", "at least 2"]),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_explained(name: str, tmp_path: Path) -> None:
    rows, words = BAD_FILES[name]
    if rows is not None:
        (tmp_path / "profile.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, FILE))
    assert_says(caught.value, words)


def test_a_file_is_the_table_of_its_rows(tmp_path: Path) -> None:
    """By number or name of its columns, in other units; a file that has changed since is refused."""
    (tmp_path / "profile.csv").write_text("S (g^2/Hz); f (Hz)\n0.5; 10\n2.0; 40\n1.0; 300\n", encoding="utf-8")
    columns = FILE.replace('.csv"', '.csv", frequency_column = "f", density_column = 1, scale = 96.17')
    case = read_case(written(tmp_path, columns))
    rows = "frequencies = [10, 40, 300], densities = [0.5, 2.0, 1.0], scale = 96.17"
    table = read_case(written(tmp_path, NOISE + POINT + f'spectrum = {{ type = "table", {rows} }}\n'))
    times = np.linspace(0.0, 1.0, 50)
    by_file, by_table = (one.load[2].time_function().value(times) for one in (case, table))
    assert np.array_equal(by_file, by_table)
    assert case.load[2].spectrum.checksum == hashlib.sha256((tmp_path / "profile.csv").read_bytes()).hexdigest()
    (tmp_path / "again.toml").write_text(case_to_toml(case), encoding="utf-8")
    assert read_case(tmp_path / "again.toml") == case
    with (tmp_path / "profile.csv").open("a", encoding="utf-8") as file:
        file.write("1.0; 400\n")
    with pytest.raises(CaseError, match="has changed since"):
        read_case(tmp_path / "again.toml")
