"""Runs that go on: on two ranks to the same bits, on two what one began, on one what two began."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.results.results import Results, open_results
from gapbeam.solver.record_table import STRESS_FIELDS
from tests.parallel.test_ranks_agree import check_fields, disagreements
from tests.shared.command import DEMO, RATTLE, alone, on_ranks
from tests.shared.interrupted import differing, stopped_after

pytestmark = [alone, pytest.mark.versions]

CLOSE = 1.0e-7  # of the largest magnitude of a variable; of energies, of the largest of them
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
    """A full model on another number of ranks, over a whole run of many impacts: within 1e-7, and not the same run."""
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
    check_fields(results, 1e-13)
    for name in STRESS_FIELDS:  # slopes across a cell enlarge the round-off of displacements
        check_fields(results, 1e-10, name)


def relative(expected: Results, found: Results) -> dict[str, float]:
    """Return the largest difference of every variable, of its largest magnitude; of energies, of the largest energy."""
    apart, history = disagreements([expected, found]), expected.history
    largest = max(float(np.abs(history[name]).max()) for name in ("kinetic_energy", "strain_energy", "contact_energy"))
    for name in ("kinetic_energy", "strain_energy", "contact_energy", "restraint_energy"):
        apart[name] = float(np.abs(history[name] - found.history[name]).max()) / largest
    return apart
