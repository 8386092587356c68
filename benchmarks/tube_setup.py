"""Set-up of long tubes in many supports, from the case to the first steps of its march.

    environment/run python3 -m benchmarks.tube_setup 20                       # 20 drawn tubes
    environment/run python3 -m benchmarks.tube_setup 20 --run                 # from file to results, 5000 steps
    environment/run python3 -m benchmarks.tube_setup 1 --first 17 --rigid     # one as a solid, with rigid sections
    environment/run python3 -m benchmarks.tube_setup 0 --circles 50 100 200   # supports that are met as circles

Process time (user and system, all threads) stands beside wall time, which other work on the machine makes longer.
What starting Python and reading compiled code take, some 3 s, is not in it.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from typing import Any

import numpy as np
from mpi4py import MPI

import gapbeam
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.simulation import Simulation

SEED = 20
STEPS = 10
GIGABYTE = 1.0e6  # of the kilobytes that the system counts in


def drawn_tube(random: np.random.Generator) -> dict[str, Any]:
    """Return the tables of a tube of 3 to 12 m in 4 to 12 supports of 10 to 50 mm with 2 to 6 walls each.

    One to three of its spans are in cross flow, which lifts and drags the tube.
    """
    length, count = float(random.uniform(3.0, 12.0)), int(random.integers(4, 13))
    thickness = float(random.uniform(0.012, 0.025))
    pitch = length / (count + 1)
    supports = []
    for number in range(count):
        walls, width = int(random.integers(2, 7)), float(random.uniform(0.01, 0.05))
        middle = pitch * (number + 1) + float(random.uniform(-0.2, 0.2)) * pitch
        angles = [-90.0 + 360.0 * wall / walls for wall in range(walls)]
        supports.append({
            "name": f"plate{number}", "from": middle - 0.5 * width, "to": middle + 0.5 * width,
            "clearance": float(random.uniform(0.05e-3, 0.3e-3)),
            "region": {"type": "polygon", "walls": [((angle + 180.0) % 360.0) - 180.0 for angle in angles]},
        })  # fmt: skip
    places = random.choice(count + 1, int(random.integers(1, 4)), replace=False)
    loads = [
        {
            "type": "random-line-load", "name": f"{name}{place}", "direction": list(direction), "seed": 1, "ramp": 0.1,
            "span": [pitch * float(place), pitch * float(place + 1)],
            "spectrum": {"type": "turbulence", "velocity": 3.0, "length": thickness, "low": 5.0, "scale": 7.0},
            "coherence": {"type": "exponential", "length": 3.0 * thickness},
        }
        for place in places
        for name, direction in (("lift", (0.0, 0.0, 1.0)), ("drag", (0.0, 1.0, 0.0)))
    ]  # fmt: skip
    tables = tube(length, thickness, supports)
    tables["load"] += loads
    tables["wear"] = {"coefficient": 2.0e-14, "area": 1.2e-4}
    return tables


def tube_in_circles(count: int) -> dict[str, Any]:
    """Return the tables of a tube in holes that are met as circles, every 0.4 m."""
    supports = [
        {
            "name": f"hole{number}", "from": 0.4 * (number + 1) - 0.01, "to": 0.4 * (number + 1) + 0.01,
            "clearance": 1.0e-4, "region": {"type": "hole", "contact": "circle"},
        }
        for number in range(count)
    ]  # fmt: skip
    return tube(0.4 * (count + 1), 0.019, supports)


def tube(length: float, thickness: float, supports: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the tables of a steel tube between a clamp and a pin, whose model is chosen when it is read."""
    return {
        "beam": {
            "length": length, "thickness": thickness, "width": thickness,
            "section": {"type": "tube", "wall": 0.06 * thickness},
        },
        "material": {"young_modulus": 2.0e11, "poisson_ratio": 0.3, "density": 8000.0},
        "damping": {"ratio": 0.02},
        "joint": [
            {"name": "tubesheet", "type": "clamped", "point": 0.0},
            {"name": "top", "type": "pinned", "point": length},
        ],
        "support": supports,
        "model": "auto",
        "mesh": {"dimension": 3},
        "contact": {"stiffness": 2.0e11},
        "load": [{"type": "gravity", "direction": [0.0, 0.0, -1.0]}],
        "probe": [{"name": "first", "point": 0.2}],
        "time": {"end": 1.0, "step": 2.0e-5},
    }  # fmt: skip


def set_up(tables: dict[str, Any]) -> str:
    """Read, mesh, assemble, seat and factor a case and march its first steps; return what that took, in words."""
    wall, process = time.perf_counter(), time.process_time()
    simulation = Simulation.of_case(gapbeam.read_case(tables), MPI.COMM_WORLD)
    start = simulation.start(simulation.seat())
    for _ in CompiledLoop(simulation.plan).blocks(start, STEPS, steps=STEPS):
        pass
    wall, process = time.perf_counter() - wall, time.process_time() - process
    model = simulation.model
    basis = model.body.basis
    error = "" if basis is None else f", basis error {100.0 * basis.neglected:.1e} %"
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / GIGABYTE
    return (
        f"{process:7.1f} s process, {wall:7.1f} s wall; {model.dofs} DOFs, {model.system.contact.size} contact points, "
        f"{model.mesh_dofs} DOFs of the mesh{error}; peak {memory:.2f} GB so far"
    )


def run(tables: dict[str, Any]) -> str:
    """Run a case for 5000 steps without error estimates; return what that took from case to results, in words."""
    wall, process = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        overrides = {"time.end": 5000 * tables["time"]["step"], "output.errors": "none"}
        outcome = gapbeam.run(gapbeam.read_case(tables, overrides), output=f"{folder}/run")
    wall, process = time.perf_counter() - wall, time.process_time() - process
    times, points = outcome.summary["wall_time"], outcome.summary["model"]["contact_points"]
    return (
        f"{process:7.1f} s process, {wall:7.1f} s wall; {points} contact points, march {times['march']:.2f} s, "
        f"{1.0e6 * times['per_step']:.0f} us a step, status {outcome.exit_status}"
    )


def main() -> None:
    """Print the set-up of drawn tubes and, if asked for, of tubes in circles."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, nargs="?", default=20, help="tubes (default 20)")
    parser.add_argument("--first", type=int, default=0, help="number of the first tube")
    parser.add_argument("--rigid", action="store_true", help="as a solid in a basis, with rigid sections")
    parser.add_argument("--run", action="store_true", help="run 5000 steps, with files")
    parser.add_argument("--circles", type=int, nargs="*", default=(), help="tubes in so many circles as well")
    options = parser.parse_args()
    random = np.random.default_rng(SEED)
    set_up(tube_in_circles(2))  # loads and compiles code
    for number in range(options.first + options.count):
        tables = drawn_tube(random)
        if number < options.first:
            continue
        if options.rigid:
            tables["model"] = {"type": "reduced", "sections": "rigid"}
        supports = tables["support"]
        words = f"{tables['beam']['length']:5.2f} m in {len(supports):2d} supports"
        print(f"tube {number:2d}, {words}: {run(tables) if options.run else set_up(tables)}", flush=True)
    for count in options.circles:
        print(f"{count:3d} circles: {set_up(tube_in_circles(count))}", flush=True)


if __name__ == "__main__":
    main()
