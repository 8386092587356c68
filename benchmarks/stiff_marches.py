"""Marches of a mass in a hole or a square by stiffness, step and friction: what converges, and what it keeps of energy.

environment/run python3 -m benchmarks.stiff_marches
environment/run python3 -m benchmarks.stiff_marches --cost      # what friction costs in ten round holes
"""

from __future__ import annotations

import sys
import time
from itertools import product

import numpy as np

import gapbeam as gb

PLAY, STEPS, SPEED = 1e-3, 2000, (0.3, 0.1)
STIFFNESSES = 10.0 ** np.arange(4, 17, 2)  # N/m
TIMES = (1e-6, 1e-5, 1e-4, 1e-3)  # s; in the last one the mass crosses a third of the play
FRICTIONS = ((0.0, 1.0), (0.3, 1e-2), (0.3, 1e-6), (0.3, 0.0))  # coefficient, sliding speed
SQUARE = PLAY * np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])


def march(region: str, stiffness: float, step: float, friction: float, sliding: float) -> float:
    """Return the largest change of the energy balance over the largest energy.

    Raises:
        NotConverged: A step has no forces.
    """
    one = gb.mass(1.0, motions=2)
    place = gb.Disc(PLAY) if region == "hole" else gb.Polygon(SQUARE)
    law = gb.KelvinVoigt(stiffness=stiffness)
    contact = gb.Contact(one["at"], place, law, friction=friction, sliding=sliding, name="hole")
    loads = [gb.Force(one["at"], lambda t: 3.0 * np.sin(50.0 * t), [1.0, 0.3]), gb.Force(one["at"], -9.81, [0.0, 1.0])]
    scene = gb.Scene(one, contacts=[contact], loads=loads)
    begun = 0.5 * float(np.square(SPEED).sum())
    last = gb.history(scene, step, STEPS * step, scene.state(velocity={one: SPEED})).last
    return abs(float(last.balance) - begun) / max(begun, abs(float(last.energy["loads"])))


def holes(friction: float, sliding: float) -> gb.Scene:
    """Return 40 modes in ten round holes, shaken in two directions."""
    number = np.arange(40)
    points = {
        f"hole{i}": np.vstack([np.cos(0.37 * (i + 1) * number), np.sin(0.61 * (i + 1) * number)]) for i in range(10)
    }
    body = gb.from_modes(2.0 * np.pi * np.linspace(10.0, 1500.0, 40), 0.01, points)
    law = gb.KelvinVoigt(stiffness=1e6, damping=20.0)
    contacts = [
        gb.Contact(body[name], gb.Disc(1e-4), law, friction=friction, sliding=sliding, name=name) for name in points
    ]
    loads = [
        gb.Force(body["hole0"], lambda t: 20.0 * np.sin(200.0 * t)),
        gb.Force(body["hole3"], lambda t: 30.0 * np.cos(170.0 * t), [0.3, 1.0]),
    ]
    return gb.Scene(body, contacts=contacts, loads=loads)


def cost(rounds: int = 5, steps: int = 10_000) -> dict[str, float]:
    """Return processor time of a step by friction, s: the best of some rounds in turns."""
    scenes = {"none": holes(0.0, 1.0), "sliding at 1 mm/s": holes(0.3, 1e-3), "Coulomb": holes(0.3, 0.0)}
    best = dict.fromkeys(scenes, np.inf)
    for _ in range(rounds):
        for name, scene in scenes.items():
            clock = time.process_time()
            gb.history(scene, 1e-5, 1e-5 * steps)
            best[name] = min(best[name], (time.process_time() - clock) / steps)
    return best


def main() -> None:
    """Print what did not converge and the largest error of the balance, or what friction costs."""
    if "--cost" in sys.argv:
        for name, seconds in (found := cost()).items():
            print(f"friction {name}: {1e6 * seconds:.2f} us a step, {seconds / found['none']:.2f} times that without")
        return
    errors, refused, clock = [], 0, time.process_time()
    for region, (friction, sliding), stiffness, step in product(("hole", "square"), FRICTIONS, STIFFNESSES, TIMES):
        try:
            errors.append(march(region, float(stiffness), step, friction, sliding))
        except gb.NotConverged as error:
            refused += 1
            print(f"{region}, {stiffness:g} N/m, {step:g} s, friction {friction:g}, sliding {sliding:g} m/s: {error}")
    print(
        f"{len(errors)} marches, {refused} refused, balance moved by at most {max(errors):.1e} of the energy, "
        f"{time.process_time() - clock:.0f} s of processor time"
    )


if __name__ == "__main__":
    main()
