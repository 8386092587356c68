"""Processor time of a step of a tube with forces of a flow on two spans, relative to the same tube without flow.

    environment/run python3 -m benchmarks.flow_speed [steps]

Forty modes, two supports with play; the flow acts on the mean motion of each span (one direction, two states), or on
the four lowest modes of the tube. The least of seven marches each, in turns, on one thread.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

import numpy as np

import gapbeam as gb
from gapbeam.solver.scene.scene_march import Marcher

STEPS, REPEATS, STEP = 40_000, 7, 1e-5


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

    def unsteady(where: object, name: str, modes: int | None = None) -> gb.Feedback:
        return gb.unsteady(
            where, velocity=2.0, density=100.0, diameter=0.02, stiffness=-1.0, damping=1.0,  # type: ignore[arg-type]
            amplitudes=[0.3, 0.4], rates=[0.1, 0.5], modes=modes, name=name,
        )  # fmt: skip

    lines = [{f"x{i}": places[i] for i in some} for some in (range(11), range(10, 21))]
    flows = {
        "no flow": [],
        "one direction each": [unsteady(tube[name], name) for name in means],
        "four modes each": [unsteady(gb.span(tube, line), f"flow {k}", 4) for k, line in enumerate(lines)],
    }
    return {name: gb.Scene(tube, contacts=stops, loads=[push], feedbacks=some) for name, some in flows.items()}


def main(words: Sequence[str]) -> None:
    """Print the table."""
    steps = int(words[0]) if words else STEPS
    marchers = {name: Marcher(scene, STEP) for name, scene in scenes().items()}
    least = dict.fromkeys(marchers, float("inf"))
    for _ in range(REPEATS):
        for name, marcher in marchers.items():
            marcher.advance(100)
            began = time.process_time()
            marcher.advance(steps)
            least[name] = min(least[name], 1e6 * (time.process_time() - began) / steps)
    print("| flow | us a step | over no flow |\n|---|---|---|")
    for name, one in least.items():
        print(f"| {name} | {one:.3f} | {one / least['no flow']:.2f} |")


if __name__ == "__main__":
    main(sys.argv[1:])
