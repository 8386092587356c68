"""Runs that go on: on two ranks to the same bits, on two what one began, on one what two began."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.results.results import Results, open_results
from gapbeam.solver.schema.record_table import STRESS_FIELDS
from tests.parallel.test_ranks_agree import check_fields, disagreements
from tests.shared.command import DEMO, RATTLE, alone, on_ranks, settings
from tests.shared.interrupted import differing, stopped_after

pytestmark = [alone, pytest.mark.versions]

CLOSE = 1.0e-10  # of the largest magnitude of a variable; of energies, of the largest of them
# The demo, shaken so hard that it leaves and strikes both faces at once.
FULL = (*RATTLE, "time.end=0.05", "output.fields_interval=0.01", "output.stress=true")
JOINT = 'joint=[{name = "end", type = "pinned", point = 0.51}]'
REDUCED = (*RATTLE, "model.type=reduced", "model.modes=8", JOINT, *FULL[len(RATTLE) :])
STOPS = {"full": 100, "reduced": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs on one rank and on two, stopped and resumed on either; on two, what one kept is read to the last bit."""
    folder = tmp_path_factory.mktemp("ranks")
    cases = {"full": (FULL, STOPS["full"]), "reduced": (REDUCED, STOPS["reduced"])}
    for name, (keys, stop) in cases.items():
        assert gapbeam.run(DEMO, keys, folder / name / "one").exit_status == 0
        with stopped_after(stop):
            assert gapbeam.run(DEMO, keys, folder / name / "from-one").exit_status == 143
    done = on_ranks(2, folder, json.dumps(cases), program="tests.programs.resumed_on_ranks")
    assert done.returncode == 0, done.stderr
    for name, (keys, _) in cases.items():
        assert gapbeam.run(DEMO, keys, folder / name / "begun", resume=True).exit_status == 0
    return folder


@pytest.mark.slow(minutes=0.3)
def test_two_ranks_go_on_to_the_same_bits(folder: Path) -> None:
    """Stopped and resumed on two ranks: histories, fields and figures of the uninterrupted run on two."""
    assert differing(folder / "full" / "whole", folder / "full" / "parts") == []


@pytest.mark.slow(minutes=0.4)
@pytest.mark.parametrize(("whole", "parts"), [("one", "from-one"), ("whole", "begun")], ids=["1 to 2", "2 to 1"])
def test_other_ranks_go_on_to_round_off(whole: str, parts: str, folder: Path) -> None:
    """A full model on another number of ranks, over a whole run of many impacts: within 1e-10, and not the same run."""
    expected, found = open_results(folder / "full" / whole), open_results(folder / "full" / parts)
    before = expected.history["time"].values <= found.summary["resumed"][0]
    assert 0.1 < before.mean() < 0.3
    assert expected.summary["contact_episodes"]["episodes"] > 10
    for name in ("displacement", "velocity", "contact_force", "load_work"):
        np.testing.assert_array_equal(expected.history[name].values[before], found.history[name].values[before])
    apart = relative(expected, found)
    assert {name: value for name, value in apart.items() if not value <= CLOSE} == {}
    assert max(apart.values()) > 0.0
    for name in ("displacement", *STRESS_FIELDS):
        check_fields([expected, found], CLOSE, name)


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize(("whole", "parts"), [("one", "from-one"), ("parts", "begun")], ids=["1 to 2", "2 to 1"])
def test_reduced_model_goes_on_to_the_same_bits_on_other_ranks(whole: str, parts: str, folder: Path) -> None:
    """The matrices that were marched go on: no bit of histories and figures differs, fields within round-off."""
    one, other = folder / "reduced" / whole, folder / "reduced" / parts
    assert [name for name in differing(one, other) if " at " not in name] == []
    assert open_results(other).summary["resumed"]
    results = [open_results(one), open_results(other)]
    check_fields(results, 1e-3 * CLOSE)
    for name in STRESS_FIELDS:  # slopes across a cell enlarge the round-off of displacements
        check_fields(results, CLOSE, name)


@pytest.mark.slow
@pytest.mark.parametrize("chaotic", [True, False], ids=["chaotic", "not chaotic"])
def test_round_off_after_a_resume_on_other_ranks(
    chaotic: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The demo, resumed on two ranks: the same motion, until chaos, where it is chaotic, has multiplied the round-off.

    Found elsewhere with two beam codes of their own: exponents of 18 to 84 1/s for stiff rattling under 20 N. A fit to
    few impacts scatters around them: half as much more is allowed.
    """
    keys = ("load.shaker.ramp=0.0",) if chaotic else RATTLE
    keys = (*keys, "output.fields_interval=0.1")
    assert gapbeam.run(DEMO, keys, tmp_path / "one").exit_status == 0
    with stopped_after(200):
        assert gapbeam.run(DEMO, keys, tmp_path / "two").exit_status == 143
    done = on_ranks(2, "run", DEMO, "--output", tmp_path / "two", "--resume", *settings(*keys))
    assert done.returncode == 0, done.stderr
    one, two = (open_results(tmp_path / name).history["displacement"] for name in ("one", "two"))
    time, size = one["time"].values, float(np.abs(one).max())
    apart = np.abs(one.values - two.values).max(axis=(1, 2)) / size
    if not chaotic:
        with capsys.disabled():
            print(f"\n{apart.max():.1e} of the largest displacement within {time[-1]:g} s")
        assert apart.max() < 2e-9
        return
    large = np.flatnonzero(apart > 1e-4)
    end = large[0] if len(large) else len(time)
    grown = (np.arange(len(time)) < end) & (apart > CLOSE)
    rate = float(np.polyfit(time[grown], np.log(apart[grown]), 1)[0])
    with capsys.disabled():
        print(f"\nround-off grows by exp({rate:.3g} t / s), to {apart[:end].max():.1e} of the largest displacement")
    assert apart[(time > 0.02) & (time < 0.05)].max() < 1e-8
    assert apart[grown].max() > 1e4 * CLOSE  # grown by four orders, which is what the rate is fitted to
    assert 18.0 / 1.5 < rate < 1.5 * 84.0


def relative(expected: Results, found: Results) -> dict[str, float]:
    """Return the largest difference of every variable, of its largest magnitude; of energies, of the largest energy."""
    apart, history = disagreements([expected, found]), expected.history
    largest = max(float(np.abs(history[name]).max()) for name in ("kinetic_energy", "strain_energy", "contact_energy"))
    for name in ("kinetic_energy", "strain_energy", "contact_energy", "restraint_energy"):
        apart[name] = float(np.abs(history[name] - found.history[name]).max()) / largest
    return apart
