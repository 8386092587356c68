"""Random loads along the beam that are refused, or probably not meant: every message says what to change."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import CaseError
from tests.shared.case_texts import assert_says
from tests.unit.test_random_load_checks import WHITE, written

FLOW = '[[load]]\ntype = "random-line-load"\nname = "flow"\n'
SPAN = "span = [0.1, 0.5]\n"
NEAR = 'coherence = { type = "exponential", length = 0.05 }\n'
PROFILE = "velocity_profile = { places = [0.0, 0.2, 0.5], values = [0.5, 1.0, 1.0] }\n"
TABLE = 'coherence = { type = "table", distances = [0.0, 0.1, 0.2], values = [1.0, 0.4, 0.0] }\n'

BAD = {
    "no span": (FLOW + WHITE + NEAR, ["span", "missing"]),
    "no coherence": (FLOW + SPAN + WHITE, ["coherence", "missing"]),
    "reversed": (FLOW + SPAN.replace("0.1", "0.6") + WHITE + NEAR, ["from 0.6 to 0.5 m", "span = [0.5, 0.6]"]),
    "outside": (FLOW + SPAN.replace("0.5", "0.9") + WHITE + NEAR, ["span", "x = 0.9 m, outside the beam"]),
    "unknown coherence": (FLOW + SPAN + WHITE + 'coherence = { type = "linear" }\n', ['"exponential"', '"gaussian"']),
    "negative length": (FLOW + SPAN + WHITE + NEAR.replace("0.05", "-0.05"), ["length", "greater than 0"]),
    "short length": (
        FLOW + SPAN + WHITE + NEAR.replace("0.05", "0.001"),
        ["0.001 m, on a load of 0.4 m", "length = 0.008, with densities times 0.125"],
    ),
    "too many stations": (FLOW + SPAN + WHITE + NEAR + "stations = 60\n", ["stations", "48"]),
    "profile elsewhere": (
        FLOW + SPAN + WHITE + NEAR + PROFILE.replace("0.5]", "0.4]", 1),
        ["places", "from 0 to 0.4 m, for a load from 0.1 to 0.5 m", "rows at both ends"],
    ),
    "profile that does not pair": (
        FLOW + SPAN + WHITE + NEAR + PROFILE.replace("[0.5, 1.0, 1.0]", "[0.5, 1.0]"),
        ["values", "2 for 3 places"],
    ),
    "profile that does not ascend": (
        FLOW + SPAN + WHITE + NEAR + PROFILE.replace("0.2", "0.6"),
        ["places that ascend", "sort the rows"],
    ),
    "no flow": (
        FLOW + SPAN + WHITE + NEAR + PROFILE.replace("[0.5, 1.0, 1.0]", "[0.0, 0.0, 0.0]"),
        ["0 along the whole load", "leave the load out"],
    ),
    "negative velocity": (
        FLOW + SPAN + WHITE + NEAR + PROFILE.replace("[0.5", "[-0.5"),
        ["values", "a list of 2 to 200 numbers"],
    ),
    "coherence above 1": (
        FLOW + SPAN + WHITE + TABLE.replace("[1.0, 0.4, 0.0]", "[1.0, 1.4, 0.0]"),
        ["up to 1.4", "values from -1 to 1"],
    ),
    "coherence that is none": (
        FLOW + SPAN + WHITE + TABLE.replace("[1.0, 0.4, 0.0]", "[1.0, 1.0, 1.0]"),
        ["a curve that is no coherence", "positive semidefinite"],
    ),
    "coherence that does not pair": (
        FLOW + SPAN + WHITE + TABLE.replace("[1.0, 0.4, 0.0]", "[1.0, 0.4]"),
        ["2 for 3 distances"],
    ),
    "coherence from afar": (
        FLOW + SPAN + WHITE + TABLE.replace("[0.0, 0.1", "[0.05, 0.1"),
        ["0 first, and distances that ascend"],
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_loads_are_explained(name: str, tmp_path: Path) -> None:
    loads, words = BAD[name]
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, loads))
    assert_says(caught.value, words)


def test_short_bending_waves_are_warned_of(tmp_path: Path) -> None:
    """Few stations are named with how many would do; 16 are enough for the frequencies of the case."""
    few = read_case(written(tmp_path, FLOW + SPAN + WHITE + NEAR + "stations = 3\n"))
    assert any("has 3 stations for" in line and "stations = " in line for line in warnings(few))
    enough = read_case(written(tmp_path, FLOW + SPAN + WHITE + NEAR))
    assert not any("stations" in line for line in warnings(enough))
