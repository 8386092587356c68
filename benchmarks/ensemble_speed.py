"""Processor time of a member-step of ensembles: 16 modes, two two-sided points, features on, beside the single march.

environment/run python3 -m benchmarks.ensemble_speed [members] [periods] [steps]
"""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import gapbeam as gb
from gapbeam.solver.scene.scene import Scene

MEMBERS, PERIODS, STEPS = 4096, 10, 400
WHOLE = 100_000 * 100 * 400  # member-steps of the study that the figures are extrapolated to
FREQUENCY, ROUNDS = 20.0, 3


def tube(law: Any) -> Scene:
    """Return a tube of 16 modes in two slots, shaken at one end."""
    modes = np.arange(16) + 0.5
    shapes = np.sqrt(2.0) * np.sin(np.outer([0.31, 0.74, 1.0], modes) * np.pi)
    body = gb.from_modes(2 * np.pi * 12 * modes**1.5, 0.01, dict(zip(("left", "right", "tip"), shapes, strict=True)))
    gaps = [gb.Contact(body[name], gb.Slot(2e-4), law, name=name) for name in ("left", "right")]
    push = gb.Force(
        body["tip"], lambda t, size, f: size * np.sin(2 * np.pi * f * t), name="push", size=20.0, f=FREQUENCY
    )
    return gb.Scene(body, contacts=gaps, loads=[push])


def nanoseconds(march: Callable[[], Any], member_steps: int) -> float:
    """Return the processor time of a member-step, of all threads, ns."""
    started = time.process_time()
    march()
    return 1e9 * (time.process_time() - started) / member_steps


def measured(scene: Scene, members: int, periods: int, steps: int, own: bool = False) -> float:
    """Return the processor time of a member-step with features on, ns; `own`: each member has its own frequency."""
    draw = np.random.default_rng(0)
    values = {name: draw.uniform(1e-4, 4e-4, members) for name in ("left.clearance", "right.clearance")}
    values["push.size"] = draw.uniform(10.0, 40.0, members)
    T: Any = 1.0 / FREQUENCY
    if own:
        values["push.f"] = draw.uniform(0.9, 1.1, members) * FREQUENCY
        T = 1.0 / values["push.f"]
    return nanoseconds(
        lambda: gb.ensemble(scene, values, step=T / steps, end=periods * T, settle=T, period=T, harmonics=4, strobes=2),
        members * periods * steps,
    )


def single(scene: Scene, periods: int, steps: int) -> float:
    """Return the processor time of a step of one march with the same features, ns."""
    T = 1.0 / FREQUENCY
    return nanoseconds(
        lambda: gb.ensemble(
            scene, step=T / steps, end=periods * T, settle=T, period=T, harmonics=4, strobes=2, members=1
        ),
        periods * steps,
    )


def main(words: Sequence[str]) -> None:
    """Print the table."""
    members, periods, steps = [*map(int, words[:3]), *(MEMBERS, PERIODS, STEPS)[len(words) :]]
    laws = {
        "Kelvin-Voigt": gb.KelvinVoigt(stiffness=1e6, damping=5.0),
        "Hunt-Crossley": gb.HuntCrossley(1e6, 0.5, 1.5),
    }
    print(f"{members} members, {periods} periods of {steps} steps; median of {ROUNDS} rounds, processor time")
    for name, law in laws.items():
        scene = tube(law)
        few = 64 if name == "Kelvin-Voigt" else 0
        measured(scene, 64, 4, steps)  # compiles
        single(scene, 4, steps)
        rounds = [
            (measured(scene, members, periods, steps), single(scene, 10 * periods, steps),
             measured(scene, few, periods, steps, own=True) if few else np.nan)
            for _ in range(ROUNDS)
        ]  # fmt: skip
        lane, alone, own = np.median(rounds, axis=0)
        text = f"{name}: {lane:.0f} ns a member-step; single march {alone:.0f} ns, {alone / lane:.1f} times as much"
        print(text + (f"; own frequencies {own:.0f} ns, {own / lane:.1f} times as much" if few else ""))
        seconds = WHOLE * lane / 1e9
        cores = len(os.sched_getaffinity(0))
        print(
            f"  extrapolated: 1e5 members of 100 periods of 400 steps take {seconds:.0f} s of processor, "
            f"{seconds / cores:.0f} s on {cores} free cores"
        )
    print(f"largest memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GB")


if __name__ == "__main__":
    main(sys.argv[1:])
