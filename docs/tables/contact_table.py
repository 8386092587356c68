"""Print how contact formulations agree under refinement: python3 docs/tables/contact_table.py, some minutes."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import gapbeam
from docs.tables.narrow_tables import narrow

CASE = Path(__file__).parents[2] / "cases" / "li2013-2d.toml"
PERIOD, RECORD, SMOOTHED = 0.05, 5.0e-4, 5  # s, s, records in 2.5 ms
STEP, CELL = 5.0e-5, 6.25e-3  # s, m
REFERENCE = ("unilateral", 8, 2.5e-5)
FORMULATIONS: dict[str, Mapping[str, object]] = {
    "penalty, auto": {},
    "penalty, 10 E/h": {"share": 10.0},
    "nitsche, theta = 1": {"contact.formulation": {"type": "nitsche", "theta": 1}},
    "nitsche, theta = 0": {"contact.formulation": {"type": "nitsche", "theta": 0}},
    "nitsche, theta = -1": {"contact.formulation": {"type": "nitsche", "theta": -1}},
    "unilateral": {"contact.formulation": "unilateral"},
    "augmented-lagrangian": {"contact.formulation": "augmented-lagrangian"},
}
REFINED = ("penalty, auto", "penalty, 10 E/h", "nitsche, theta = 1", "unilateral")
OF_STEPS = ("penalty, auto", "nitsche, theta = 1", "unilateral")
MODULUS, SHARES = 2.1e11, (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)  # Pa, of E/h


class Figures(NamedTuple):
    """What one run gives.

    Attributes:
        values: Peak force of the base and its impulse per period, peak to peak of the acceleration, harmonics 1 to 3.
        unknowns: Degrees of freedom.
        points: Contact points.
        seconds: Wall time of one step, s.
        iterations: Iterations of one contact solve, mean.
    """

    values: np.ndarray
    unknowns: int
    points: int
    seconds: float
    iterations: float


def run(name: str, level: int, step: float, folder: Path, share: float | None = None) -> Figures:
    """Run two periods with cells of 6.25 mm / level, and a penalty of a share of E/h."""
    cell = CELL / level
    formulation = dict(FORMULATIONS[name])
    share = formulation.pop("share", share)
    stiffness = {} if share is None else {"contact.stiffness": share * MODULUS / cell}
    settings = {
        "load.shaker.ramp": 0.02,
        "mesh.size": 0.02 / level,
        "mesh.support_size": cell,
        "mesh.edge_size": cell,
        "mesh.cells_through_thickness": 2 * level,
        "time.end": 2.0 * PERIOD,
        "time.step": step,
        "time.scheme": "implicit-midpoint",
        "output.history_interval": RECORD,
        "output.fields_interval": PERIOD,
    }
    outcome = gapbeam.run(CASE, settings | formulation | stiffness, folder, overwrite=True)
    if outcome.exit_status != 0:
        raise RuntimeError(outcome.message)
    history, summary = gapbeam.open_results(folder).history, outcome.summary
    impulse = history["impulse"].sel(face="base").values
    acceleration = history["acceleration_relative"].sel(probe="test").values[1:, -1]
    smooth = np.convolve(acceleration, np.full(SMOOTHED, 1.0 / SMOOTHED), mode="valid")
    last = acceleration[-round(PERIOD / RECORD) :]
    harmonics = 2.0 / len(last) * np.abs(np.fft.rfft(last))[1:4]
    values = [np.diff(impulse).max() / RECORD, 0.5 * impulse[-1], np.ptp(smooth), *harmonics]
    model, wall, convergence = summary["model"], summary["wall_time"], summary["convergence"]
    return Figures(
        np.array(values), model["dofs"], model["contact_points"], wall["advance"], convergence["iterations_mean"]
    )


def _row(label: str, found: Figures, exact: np.ndarray) -> str:
    errors = " | ".join(f"{100.0 * error:+.2f}" for error in found.values / exact - 1.0)
    cost = f"{found.unknowns} | {found.points} | {1e3 * found.seconds:.2f} | {found.iterations:.1f}"
    return f"| {label} | {cost} | {errors} |"


def tables() -> str:
    """Return both tables."""
    head = "DOFs | points | ms | iterations | peak force | impulse | peak to peak | 20 Hz | 40 Hz | 60 Hz |"
    line = "|---|" + "---|" * 10
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "run"
        reference = run(*REFERENCE, folder)
        exact = reference.values
        force, impulse, swing, *harmonics = exact
        said = ", ".join(f"{value:.3f}" for value in harmonics)
        lines = [
            f"Reference ({REFERENCE[0]}, cells of {1e3 * CELL / REFERENCE[1]:.2f} mm, step {REFERENCE[2]:g} s): "
            f"peak force {force:.2f} N, impulse {impulse:.4f} N s per period, peak to peak {swing:.3f} m/s^2, "
            f"harmonics {said} m/s^2.",
            "",
            f"Cells refined, step {STEP:g} s; differences from the reference in %:",
            "",
            f"| formulation, cells in the support | {head}",
            line,
        ]
        for label in FORMULATIONS:
            for level in (1, 2, 4) if label in REFINED else (2,):
                lines.append(_row(f"{label}, {1e3 * CELL / level:.3g} mm", run(label, level, STEP, folder), exact))
        lines.append(
            _row("nitsche, theta = 1, 0.781 mm, half the step", run(OF_STEPS[1], *REFERENCE[1:], folder), exact)
        )
        lines += [
            "",
            "Step refined, cells of 3.12 mm; differences likewise:",
            "",
            f"| formulation, step | {head}",
            line,
        ]
        for label in OF_STEPS:
            for step in (2.5e-4, 1.0e-4, 2.5e-5):
                lines.append(_row(f"{label}, {step:g} s", run(label, 2, step, folder), exact))
        lines += [
            "",
            f"Penalty stiffer, cells of 3.12 mm, step {STEP:g} s; differences from `nitsche`, theta = 1, there:",
            "",
        ]
        lines += [f"| stiffness | {head}", line]
        same = run("nitsche, theta = 1", 2, STEP, folder).values
        for share in SHARES:
            lines.append(_row(f"{share:g} E/h", run("penalty, auto", 2, STEP, folder, share), same))
    return narrow("\n".join(lines) + "\n")


if __name__ == "__main__":
    print(tables())
