"""Sections 2 and 3 of Li et al. (2013), computed again: printed roots, and the fall that the simulation starts with.

environment/run python3 -m benchmarks.li2013             # both sections: a few minutes
environment/run python3 -m benchmarks.li2013 roots       # section 2 alone: a second
environment/run python3 -m benchmarks.li2013 simulation  # section 3 alone
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from itertools import product
from math import inf
from pathlib import Path

import numpy as np

from gapbeam.postprocess.results.columns_of_run import as_history
from gapbeam.postprocess.signals.figure_names import ACCELERATION, SMOOTHED_ACCELERATION
from gapbeam.postprocess.signals.signal import probe_signal
from gapbeam.postprocess.signals.steady_figures import steady
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.schema.record_table import STANDARD_GRAVITY as G
from gapbeam.studies.modes.beam_theory import SpringBeam
from gapbeam.studies.trials.response import respond
from gapbeam.studies.trials.starts import KeptBody, seated

BEAM = SpringBeam(length=0.510, bending=2.1e11 * 0.02 * 0.012**3 / 12.0, mass=7919.0 * 0.02 * 0.012)
PLATEAUS = (  # mode, printed root, printed thresholds of k1 (N/m) and k2 (N m/rad), the limits that these belong to
    (1, 1.875, (1e6, 1e5), (inf, inf)),
    (2, 2.365, (1e3, 1e5), (0.0, inf)),
    (3, 5.497, (1e4, 1e5), (0.0, inf)),
    (2, 2.365, (1e6, 1e2), (inf, 0.0)),
    (3, 5.497, (1e7, 1e2), (inf, 0.0)),
)
CASE = Path("cases/li2013-adams.toml")
CLEARANCES = (0.107e-3, 0.143e-3, 0.184e-3, 0.243e-3)  # m, Table 1
MEASURED = (0.481, 0.542, 0.599, 0.751)  # g, Table 4
DEPTHS = (1e-5, 1e-6)  # m of penetration at full damping, by the text and by Table 2
BEGIN = 0.2  # s, four forcing periods
FREQUENCY = 20.0  # Hz
ELASTIC = {
    "model": {"type": "beam", "elements": 51},
    "damping": {"frequencies": [40.0, 300.0], "ratios": [0.01, 0.01]},
}
SUSPENDED = {"load.shaker.mass": 0.1, "load.shaker.stiffness": 1.0e4, "load.shaker.damping": 5.0}
BODIES = (KeptBody(), KeptBody())


def plateaus() -> list[tuple[float, float, float]]:
    """Return each printed root, the root in its limit, and the root at the printed thresholds of the springs."""
    return [
        (printed, float(BEAM.roots(mode, *limits)), float(BEAM.roots(mode, *springs)))
        for mode, printed, springs, limits in PLATEAUS
    ]


def peaks(changes: Mapping[str, object], elastic: bool = False) -> tuple[float, float, float]:
    """Return peaks to peaks of the acceleration at 370 mm, in g: at the start, settled, settled and smoothed.

    Args:
        changes: Keys of `cases/li2013-adams.toml` to replace.
        elastic: Timoshenko beam elements instead of a rigid body.

    Raises:
        RuntimeError: The run did not pass.
    """
    case = read_case(CASE, {**(ELASTIC if elastic else {}), **changes})
    model = BODIES[elastic].model(case)
    response = respond(model, seated(model).state, round(case.time.end / model.step), case.output.history_interval)
    if response.verdict != "passed":
        raise RuntimeError(f"{response.verdict}: {response.message}")
    history = as_history(response.history, response.labels)
    acceleration = probe_signal(history, "acceleration_absolute", "test")
    settled = steady(history, FREQUENCY).quantities
    start = float(np.ptp(acceleration.values[acceleration.time < BEGIN]))
    return tuple(  # type: ignore[return-value]
        value / G
        for value in (start, settled[f"test {ACCELERATION}"].mean, settled[f"test {SMOOTHED_ACCELERATION}"].mean)
    )


def simulation() -> None:
    """Print geometric means of the four clearances from the published simulation to the experiment."""
    print("geometric means of peaks to peaks at 370 mm, g: start, settled, settled and smoothed")
    for depth, elastic, suspended in product(DEPTHS, (False, True), (False, True)):
        changes = {"contact.law.full_depth": depth, "time.end": 2.0} | (SUSPENDED if suspended else {})
        rows = [peaks(changes | {"support.clearance": clearance}, elastic) for clearance in CLEARANCES]
        means = np.exp(np.mean(np.log(rows), axis=0))
        name = f"{'elastic' if elastic else 'rigid'}, {'suspended exciter' if suspended else 'bare force'}"
        print(f"  full damping at {depth:g} m, {name:28}", *(f"{value:8.3g}" for value in means))
    print(f"  the experiment, Table 4: {np.exp(np.mean(np.log(MEASURED))):.3g}")


def roots() -> None:
    """Print each printed root with the correct one."""
    print("printed root, root in the limit of the springs, root at the printed thresholds (l = 510 mm)")
    for printed, limit, threshold in plateaus():
        print(f"  {printed:6.3f} {limit:10.6f} {threshold:8.3f}")
    print("  k1 and k2 to 0:", *(f"{root:.4g}" for root in BEAM.roots(np.arange(1, 5), 0.0, 0.0)))


if __name__ == "__main__":
    for section in sys.argv[1:] or ("roots", "simulation"):
        {"roots": roots, "simulation": simulation}[section]()
