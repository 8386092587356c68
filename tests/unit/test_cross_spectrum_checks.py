"""Cross-spectra of random loads that are refused: every message says what to change."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import CaseError
from tests.shared.case_texts import assert_says
from tests.unit.test_random_line_load_checks import FLOW, NEAR, SPAN
from tests.unit.test_random_load_checks import NOISE, POINT, WHITE, written

DRAG = NOISE + POINT + WHITE + 'name = "drag"\nseed = 4\n'
LIFT = NOISE + POINT + WHITE + 'name = "lift"\nseed = 4\n'


def cross(keys: str, load: str = "drag") -> str:
    """Return the key of a cross-spectrum with a load."""
    return f'cross_spectrum = {{ load = "{load}", {keys} }}\n'


HALF = cross("coherence = 0.5")
BAD = {
    "above 1": (
        cross("coherence = 1.2"),
        ["cross_spectrum coherence", "1.2", "from 0 (nothing in common) to 1", "coherence = 1"],
    ),
    "in percent": (cross("coherence = 60"), ["coherence", "60", "coherence = 0.6, if it is in %"]),
    "negative": (cross("coherence = -0.6"), ["coherence", "-0.6", "coherence = 0.6 with phase = 180"]),
    "text": (cross('coherence = "all"'), ["coherence", '"all"', "a number"]),
    "missing coherence": (cross("phase = 10.0"), ["coherence", "missing", "coherence = 0.6"]),
    "misspelled": (cross("coherence = 0.5, phse = 10.0"), ["`phse`", "`phase`"]),
    "nobody": (cross("coherence = 0.5", "dragg"), ['"dragg", which no load is called', 'load = "drag"']),
    "itself": (cross("coherence = 0.5", "lift"), ['"lift", the load itself', 'load = "drag"']),
    "not random": (
        cross("coherence = 0.5", "shaker"),
        ['"shaker", a load of type "harmonic_force"', "a load of type random", 'load = "drag"'],
    ),
    "rows without frequencies": (
        cross("coherence = [0.5, 0.2]"),
        ["coherence", "2 values without frequencies", "frequencies = [...]"],
    ),
    "rows that do not pair": (
        cross("coherence = [0.5, 0.2], frequencies = [20, 50, 90]"),
        ["coherence", "2 for 3 frequencies"],
    ),
    "rows that do not ascend": (
        cross("coherence = [0.5, 0.2], frequencies = [50, 20]"),
        ["frequencies", "20 Hz after 50 Hz", "sort the rows"],
    ),
    "rows that are too close": (
        cross("coherence = [0.5, 0.2], frequencies = [50, 50.1]"),
        ["frequencies", "50 and 50.1 Hz, 0.1 Hz apart", "rows at least 0.585938 Hz apart"],
    ),
    "phase that turns too fast": (
        cross("coherence = 0.5, phase = [0, -3600], frequencies = [20, 120]"),
        ["phase", "-3600 degrees at 120 Hz", "at most 9.6 degrees per Hz", "delay = 0.1"],
    ),
    "endless delay": (
        cross("coherence = 0.5, delay = -1e9"),
        ["delay", "-1e+09 s", "at most 4.5813e+08 s", "2^40 samples of noise at 2400 Hz"],
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_cross_spectra_are_explained(name: str, tmp_path: Path) -> None:
    keys, words = BAD[name]
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, DRAG + LIFT + keys))
    assert_says(caught.value, words)
    assert len(caught.value.faults) == 1


OTHERS = {
    "another seed": (
        DRAG.replace("seed = 4", "seed = 5") + LIFT + HALF,
        ["seed", "4, with seed = 5 of drag", "seed = 5"],
    ),
    "another rate": (
        DRAG.replace("300.0", "250.0") + LIFT + HALF,
        ["spectrum", "up to 300 Hz, with drag up to 250 Hz", "both up to 300 Hz"],
    ),
    "other details": (
        DRAG.replace("10.0", "1.0") + LIFT + HALF,
        ["4096 samples to show, with 65536 of drag", "the same lowest frequency"],
    ),
    "circle": (
        DRAG + cross("coherence = 0.5", "lift") + LIFT + HALF,
        ['"lift", which has a cross_spectrum with "drag" itself', "leave the cross_spectrum of drag or of lift out"],
    ),
    "chain": (
        DRAG + LIFT + HALF + LIFT.replace('"lift"', '"side"') + cross("coherence = 0.5", "lift"),
        ['"lift", which has a cross_spectrum with "drag" itself', 'load = "drag"', "product of theirs"],
    ),
    "along the beam": (
        FLOW + SPAN + NEAR + WHITE + "seed = 4\n" + LIFT + cross("coherence = 0.5", "flow"),
        ['"flow", a load of type "random-line-load"', "add another [[load]]"],
    ),
}


@pytest.mark.parametrize("name", OTHERS)
def test_loads_that_cannot_share_noise_are_explained(name: str, tmp_path: Path) -> None:
    loads, words = OTHERS[name]
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, loads))
    assert_says(caught.value, words)


def test_a_partner_with_a_fault_of_its_own_is_not_missing(tmp_path: Path) -> None:
    """The only fault belongs to the other load: not that there is none."""
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, DRAG.replace("seed = 4", "seed = -4") + LIFT + HALF))
    assert len(caught.value.faults) == 1
    assert_says(caught.value, ["seed", "-4"])


def test_the_case_comes_back_and_check_names_the_coherence(tmp_path: Path) -> None:
    """Before or behind its partner, with rows, written and read again; the words of `gapbeam check` name it."""
    rows = cross("coherence = [0.9, 0.2], phase = [0, 90], frequencies = [20.0, 200.0], delay = 0.01")
    for loads, place in ((DRAG + LIFT + rows, 3), (LIFT + rows + DRAG, 2)):
        case = read_case(written(tmp_path, loads))
        (tmp_path / "again.toml").write_text(case_to_toml(case), encoding="utf-8")
        assert read_case(tmp_path / "again.toml") == case
        found = case.load[place].frequency_words(1e-4)
        assert found is not None
        assert found[1].endswith("seed 4, coherence 0.2 to 0.9 with drag")


def test_a_delay_beyond_the_run_is_warned_of(tmp_path: Path) -> None:
    case = read_case(written(tmp_path, DRAG + LIFT + cross("coherence = 0.5, delay = 12.0")))
    (found,) = (line for line in warnings(case) if "delay" in line)
    assert '(name "lift") has a delay of 12 s to drag, longer than the run of 0.6 s' in found
