"""Processor time of a step of a tube with forces of a flow on two spans, over the step without flow.

    environment/run python3 -m benchmarks.flow_step

Forty modes, two supports with play, 23 watched points. The flow acts on the mean motion of each span (one direction,
two states), or on the four lowest modes of the tube (four directions, eight states). Blocks of steps of all tubes take
turns on one thread; a ratio is the median over the turns.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import gapbeam as gb
from benchmarks.table import Table, machine_words, options, seconds
from gapbeam.solver.scene.marcher import Marcher

STEP, BLOCK, TURNS = 1e-5, 4000, 60
BARE = "no flow"


def scenes() -> dict[str, gb.Scene]:
    """Return the tube without flow, and with two flows of two kinds."""
    places = np.linspace(0.0, 1.0, 21)
    numbers = np.arange(1, 41)
    shapes = {f"x{i}": np.sqrt(2.0) * np.sin(np.pi * numbers * x) for i, x in enumerate(places)}
    half = np.sqrt(2.0) / (np.pi * numbers) * (1.0 - np.cos(0.5 * np.pi * numbers)) / 0.5
    means = {"near": half, "far": half * (-1.0) ** (numbers + 1)}
    tube = gb.from_modes(60.0 * numbers**2, 0.01, shapes | means)
    law = gb.KelvinVoigt(stiffness=1e6, damping=5.0)
    stops = [gb.Contact(tube[name], gb.Slot(1e-4), law, name=name) for name in ("x6", "x13")]
    push = gb.Force(tube["x10"], lambda t: 20.0 * np.sin(300.0 * t))

    def unsteady(where: Any, name: str, modes: int | None = None) -> gb.Feedback:
        return gb.unsteady(
            where, velocity=2.0, density=100.0, diameter=0.02, stiffness=-1.0, damping=1.0, amplitudes=[0.3, 0.4],
            rates=[0.1, 0.5], modes=modes, name=name,
        )  # fmt: skip

    lines = [{f"x{i}": places[i] for i in some} for some in (range(11), range(10, 21))]
    flows = {
        BARE: [],
        "one direction each": [unsteady(tube[name], name) for name in means],
        "four modes each": [unsteady(gb.span(tube, line), f"flow {k}", 4) for k, line in enumerate(lines)],
    }
    return {name: gb.Scene(tube, contacts=stops, loads=[push], feedbacks=some) for name, some in flows.items()}


def flow_table(turns: int = TURNS) -> Table:
    """Return the table of all tubes."""
    marchers = {name: Marcher(scene, STEP) for name, scene in scenes().items()}
    taken = {name: np.zeros(turns) for name in marchers}
    for turn in range(-1, turns):  # the first turn warms up
        for name, marcher in marchers.items():
            began = time.process_time()
            marcher.advance(BLOCK)
            taken[name][turn] = (time.process_time() - began) / BLOCK
    over = {name: np.quantile(one / taken[BARE], [0.5, 0.25, 0.75]) for name, one in taken.items()}
    return Table(
        "flow_step",
        "A step with forces of a flow on two spans",
        ("flow", "states", "a step", "over no flow", "middle half of the turns"),
        tuple(
            (name, len(marchers[name].z), seconds(float(np.median(one))), f"{over[name][0]:.2f}",
             f"{over[name][1]:.2f} to {over[name][2]:.2f}")
            for name, one in taken.items()
        ),
        (machine_words(), f"{turns} turns of {BLOCK} steps"),
        {name: float(one[0]) for name, one in over.items()},
    )  # fmt: skip


if __name__ == "__main__":
    flow_table().write(options(__doc__).output)
