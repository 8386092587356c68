"""Processor time of a member-step of ensembles, beside a march of one member with the same features.

A tube of 16 modes is shaken at its tip and rattles in two supports; amplitude and clearances differ between members.

    environment/run python3 -m benchmarks.ensemble_speed
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

import gapbeam as gb
from benchmarks.table import machine_words

MEMBERS, PERIODS, STEPS, ROUNDS = 1024, 10, 400, 3
STUDY = 100_000 * 100 * 400  # member-steps of the study whose time is extrapolated
FREQUENCY = 20.0  # Hz
SUPPORTS, STATIONS = (0.31, 0.74), 12
LINEAR, POWER = gb.KelvinVoigt(stiffness=1e6, damping=5.0), gb.HuntCrossley(1e6, 0.5, 1.5)


@gb.region
def own_hole(x: Any, y: Any, clearance: Any) -> Any:
    """Return the distance beyond a round hole, m."""
    return np.sqrt(x * x + y * y + 1e-300) - clearance


def tube(region: Any, law: Any, motions: int = 1, stations: int = 1, friction: float = 0.0) -> gb.Scene:
    """Return the tube, with motions in one plane or two, and stations of a rigid section in each support."""
    modes = np.arange(16) + 0.5
    along = np.linspace(-0.01, 0.01, stations) if stations > 1 else np.zeros(1)
    at, root = np.outer(SUPPORTS, modes * np.pi), np.sqrt(2.0)
    lines = root * np.concatenate([np.sin(x) + np.outer(along, modes * np.pi * np.cos(x)) for x in at])
    names = [f"s{k}" for k in range(len(lines))]
    rows = [np.kron(np.eye(motions), shape) for shape in [*lines, root * np.sin(modes * np.pi)]]
    frequencies = np.tile(2 * np.pi * 12 * modes**1.5, motions)
    body = gb.from_modes(frequencies, 0.01, dict(zip([*names, "tip"], rows, strict=True)))
    gaps = [gb.Contact(body[name], region, law, name=name, friction=friction) for name in names]

    def push(t: Any, size: Any, f: Any) -> Any:
        return size * np.sin(2 * np.pi * f * t)

    return gb.Scene(body, contacts=gaps, loads=[gb.Force(body["tip"], push, name="push", size=20.0, f=FREQUENCY)])


SCENES: Mapping[str, Callable[[], gb.Scene]] = {
    "Kelvin-Voigt, slots": lambda: tube(gb.Slot(2e-4), LINEAR),
    "Hunt-Crossley, slots": lambda: tube(gb.Slot(2e-4), POWER),
    "Kelvin-Voigt, round holes": lambda: tube(gb.Disc(2e-4), LINEAR, 2),
    "Hunt-Crossley, round holes, friction": lambda: tube(gb.Disc(2e-4), POWER, 2, friction=0.2),
    "Kelvin-Voigt, own region": lambda: tube(own_hole(clearance=2e-4), LINEAR, 2),
    f"Kelvin-Voigt, {STATIONS} stations in each slot": lambda: tube(gb.Slot(2e-4), LINEAR, stations=STATIONS),
}


def nanoseconds(march: Callable[[], Any], member_steps: int) -> float:
    """Return the processor time of a member-step, ns, all threads together."""
    started = time.process_time()
    march()
    return 1e9 * (time.process_time() - started) / member_steps


def measured(scene: gb.Scene, members: int, periods: int = PERIODS, own: bool = False) -> float:
    """Return the processor time of a member-step with features, ns; `own`: each member has its own frequency."""
    draw = np.random.default_rng(0)
    values: dict[str, Any] = {f"{one.name}.clearance": draw.uniform(1e-4, 4e-4, members) for one in scene.contacts}
    values["push.size"] = draw.uniform(10.0, 40.0, members)
    if own:
        values["push.f"] = draw.uniform(0.9, 1.1, members) * FREQUENCY
    T = 1.0 / (values["push.f"] if own else FREQUENCY)
    return nanoseconds(
        lambda: gb.ensemble(scene, values, step=T / STEPS, end=periods * T, settle=T, period=T, harmonics=4, strobes=2),
        members * periods * STEPS,
    )


def main() -> None:
    """Print the table."""
    print(machine_words())
    for name, make in SCENES.items():
        scene = make()
        measured(scene, 1, 3), measured(scene, 64, 3)  # compile
        rounds = [(measured(scene, MEMBERS), measured(scene, 1, 20 * PERIODS)) for _ in range(ROUNDS)]
        lanes, alone = np.median(rounds, axis=0)
        print(f"{name}: {lanes:.0f} ns a member-step, {alone / lanes:.1f} times as much alone")
        if scene.contacts[0].law is LINEAR and len(scene.contacts) == len(SUPPORTS):
            own, cores = measured(scene, 64, own=True), len(os.sched_getaffinity(0))
            print(f"  own frequencies: {own:.0f} ns; 1e5 members of 100 periods: {STUDY * lanes / cores / 1e9:.0f} s")


if __name__ == "__main__":
    main()
