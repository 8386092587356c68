"""Marches of a mass in a hole or a square by stiffness, step and friction: what converges, and what it keeps of energy.

environment/run python3 -m benchmarks.stiff_marches
"""

from __future__ import annotations

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
    """Return how far the energy balance moves over the largest energy that is met.

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


def main() -> None:
    """Print what did not converge, and the largest error of the balance."""
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
