"""Pictures and a film of the demo cost no more processor time than its run."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest

from tests.shared.command import DEMO, alone, called_anew

ATTEMPTS = 3  # other work on the machine can disturb the one or the other


def spent(*words: str | Path) -> float:
    """Call the command line; return the processor time of it and of all that it starts, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = called_anew(*words)
    assert done.returncode == 0, done.stderr
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


@pytest.mark.timing
@alone
def test_drawing_costs_at_most_the_run(tmp_path: Path) -> None:
    """It took 2.8 times as long while planes were drawn by VTK."""
    ratios = []
    for _ in range(ATTEMPTS):
        run = spent("run", DEMO, "--output", tmp_path / "demo", "--overwrite")
        ratios.append(spent("render", tmp_path / "demo") / run)
        if ratios[-1] <= 1.0:
            return
    raise AssertionError(f"drawing over running: {ratios}")
