"""A time scheme is added by one file and the list of schemes, and is there for everything that asks for schemes."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gapbeam.solver.integrators import scheme_choice
from tests.shared.command import PROJECT, alone, process_environment

CASE = """\
title = "a beam of few elements rattles"
model = { type = "beam", elements = 12 }
contact = { stiffness = 1.0e11 }

[beam]
length = 0.510
thickness = 0.012
width = 0.020

[material]
young_modulus = 2.1e11
poisson_ratio = 0.3
density = 7919.0

[damping]
frequencies = [40.0, 300.0]
ratios = [0.05, 0.05]

[support]
length = 0.050
clearance = 0.107e-3

[mesh]
dimension = 2
degree = 1
size = 0.060
support_size = 12.5e-3

[[load]]
type = "gravity"

[[load]]
type = "harmonic_force"
name = "shaker"
point = 0.15
amplitude = 60.0
frequency = 50.0

[[probe]]
name = "tip"
point = 0.510

[gates]
accept_energy_growth = false
total_growth = 10.0
impact_growth = 10.0
impact_loss = 10.0

[time]
end = 0.04
step = 2.0e-4
"""


def listed() -> str:
    """Return the list of schemes with the made-up ones: one line, and one more name in the union for each."""
    text = Path(scheme_choice.__file__).read_text(encoding="utf-8")
    text = text.replace("from gapbeam.solver.integrators.midpoint", ADDED, 1)
    return text.replace(
        "MoreauJean | CentralDifference", "MoreauJean | CentralDifference | Bossak | CautiousMidpoint", 1
    )


ADDED = """\
from gapbeam.solver.integrators.made_up_schemes import Bossak, CautiousMidpoint
from gapbeam.solver.integrators.midpoint"""


@pytest.mark.slow(minutes=0.3)
@alone
def test_made_up_schemes_are_checked_run_judged_and_swept(tmp_path: Path) -> None:
    """Two files: one scheme that a kernel marches, and one that is marched step by step, which the summary says.

    The first is Newmark's rule where its weight is 0, and the second the usual scheme, so that their motions are known.
    """
    room = tmp_path / "overlay" / "gapbeam" / "solver" / "integrators"
    room.mkdir(parents=True)
    shutil.copy(PROJECT / "tests" / "programs" / "made_up_schemes.py", room)
    (room / "scheme_choice.py").write_text(listed(), encoding="utf-8")
    case = tmp_path / "case.toml"
    case.write_text(CASE, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.use_made_up_schemes", tmp_path / "overlay", case, tmp_path],
        cwd=PROJECT,
        env=process_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    message = json.loads(done.stdout.splitlines()[-1])
    assert message["names"] == [*scheme_choice.scheme_names(), "bossak", "cautious-midpoint"]
    assert message["apart"] < 1.0e-7
    status, words = message["check"]
    assert (status, "bossak creates energy at impacts" in words) == (0, True), words
    status, words = message["out of range"]
    assert (status, "time.scheme.alpha" in words, "a number from 0 to 0.3" in words) == (2, True, True), words
    status, words = message["stiff"]
    assert (status, "bossak on a contact" in words, "known to create energy" in words) == (2, True, True), words
    assert [message[name]["status"] for name in ("bossak", "newmark", "cautious")] == [0, 0, 0]
    assert message["bossak"]["loop"] == message["newmark"]["loop"] == "compiled"
    assert message["cautious"]["loop"] == "step by step: no kernel marches the scheme cautious-midpoint"
    assert message["trapezoidal"]["last"] == message["newmark"]["last"] != message["bossak"]["last"]
    assert message["cautious"]["last"] == pytest.approx(message["discrete-gradient"]["last"], rel=1.0e-6)
    status, words = message["sweep"]
    assert (status, "2 of 2 responses passed" in words) == (0, True), words
