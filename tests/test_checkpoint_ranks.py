"""Runs that go on: on two ranks to the same bits, on two what one began, on one what two began."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gapbeam
from postprocess.results import open_results
from tests.command import DEMO, alone, on_ranks
from tests.interrupted import differing, stopped_after
from tests.test_ranks_agree import REDUCED, SHORT, check_fields, disagreements

pytestmark = alone

CLOSE = 1.0e-10  # of the largest displacement or velocity
# Soon after the beam has gone on: impacts multiply round-off.
SOON = (*SHORT, "time.end=0.0095")
STOP = 77
PROGRAM = """
import sys
import gapbeam
from tests.command import DEMO
from tests.interrupted import stopped_after

folder, stop, *keys = sys.argv[1:]
assert gapbeam.run(DEMO, keys, folder + "/whole").exit_status == 0
for name in ("parts", "begun"):
    with stopped_after(int(stop)):
        assert gapbeam.run(DEMO, keys, f"{folder}/{name}").exit_status == 143
for name in ("parts", "from-one"):
    assert gapbeam.run(DEMO, keys, f"{folder}/{name}", resume=True).exit_status == 0
"""


@pytest.fixture(
    scope="module",
    params=[(SOON, STOP), pytest.param(((*REDUCED, "time.end=0.0095"), 1), marks=pytest.mark.slow)],
    ids=["full", "reduced"],
)
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs on one rank and on two, stopped and resumed on either."""
    keys, stop = request.param
    folder = tmp_path_factory.mktemp("ranks")
    assert gapbeam.run(DEMO, keys, folder / "one").exit_status == 0
    with stopped_after(stop):
        assert gapbeam.run(DEMO, keys, folder / "from-one").exit_status == 143
    done = on_ranks(2, folder, str(stop), *keys, program=PROGRAM)
    assert done.returncode == 0, done.stderr
    assert gapbeam.run(DEMO, keys, folder / "begun", resume=True).exit_status == 0
    return folder


def test_two_ranks_go_on_to_the_same_bits(folder: Path) -> None:
    """Stopped and resumed on two ranks: histories, fields and figures of the uninterrupted run on two."""
    assert differing(folder / "whole", folder / "parts") == []


@pytest.mark.parametrize(("whole", "parts"), [("one", "from-one"), ("whole", "begun")], ids=["1 to 2", "2 to 1"])
def test_other_ranks_go_on_to_round_off(whole: str, parts: str, folder: Path) -> None:
    """Resumed on another number of ranks: the records before are the same, the motion after them is within 1e-10.

    In a reduced basis, which is found anew, the modes agree as well as their solver converged: within 1e-6.
    """
    expected, found = open_results(folder / whole), open_results(folder / parts)
    reduced = expected.summary["model"]["type"] == "reduced"
    before = expected.history["time"].values <= found.summary["resumed"][0]
    for name in ("displacement", "velocity", "contact_force", "load_work"):
        np.testing.assert_array_equal(expected.history[name].values[before], found.history[name].values[before])
    apart = disagreements([expected, found])
    tolerance = 1.0e-6 if reduced else CLOSE
    assert {name: apart[name] for name in ("displacement", "velocity") if not apart[name] <= tolerance} == {}
    assert 0.0 < max(apart.values()) < 1.0e-5
    check_fields([expected, found], tolerance)
