"""Runs that were stopped with two checkpoints, of every kind of march, and the same runs without interruption."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

PROJECT = Path(__file__).parents[2]
DEMO = PROJECT / "cases" / "demo.toml"
RATTLE = (
    "mesh.size=0.06", "load.shaker.amplitude=500.0", "load.shaker.frequency=100.0", "load.shaker.ramp=0.0",
    "time.end=0.012", "output.fields_interval=2e-3",
)  # fmt: skip
STOP = """
import sys
import gapbeam
from gapbeam.solver.run.interruption import Interruption, Wish

case, whole, folder, stops, *overrides = sys.argv[1:]
assert gapbeam.run(case, overrides, whole).exit_status == 0
for number, stop in enumerate(map(int, stops.split(","))):
    passed = []
    def agreed(self, own=Wish.NONE):
        passed.append(own)
        return Wish.TERMINATE if len(passed) >= stop else own
    Interruption.agreed = agreed
    assert gapbeam.run(case, overrides, folder, resume=number > 0).exit_status == 143
"""


@dataclass(frozen=True)
class Stopped:
    """A run that was stopped twice.

    Attributes:
        name: Of its folder; the uninterrupted run is in the one with "-whole" behind.
        keys: Overrides of the demo.
        stops: Step blocks after which it was stopped, separated by commas.
    """

    name: str
    keys: tuple[str, ...]
    stops: str


STOPPED = (
    Stopped("stopped-full", RATTLE, "40,40"),
    Stopped(
        "stopped-friction",
        (*RATTLE, "contact.friction.coefficient=0.3", "contact.friction.slip_velocity=1e-3", "time.adaptive=true"),
        "40,40",
    ),
    Stopped("stopped-beam", (*RATTLE, "model=beam", "time.end=0.05"), "3,3"),
    Stopped(
        "stopped-reduced",
        (*RATTLE, "model.type=reduced", "model.modes=8", "model.shapes=5", "time.end=0.05",
         "contact.law={type='hunt-crossley', restitution=0.6}"),
        "3,3",
    ),
)  # fmt: skip


def make_stopped(folder: Path) -> None:
    """Make the runs as far as they are not there.

    Args:
        folder: Where they go.
    """
    for run in STOPPED:
        if not (folder / run.name).exists():
            words = [str(DEMO), str(folder / f"{run.name}-whole"), str(folder / run.name), run.stops, *run.keys]
            done = subprocess.run([sys.executable, "-c", STOP, *words], cwd=PROJECT, capture_output=True, text=True)
            if done.returncode:
                raise SystemExit(f"{run.name} could not be made:\n{done.stderr}")
            print(f"seed {run.name}: stopped twice", flush=True)
