"""Short runs whose figures are kept: what is run, what is kept of it, and the command that makes the file anew.

Each run covers several choices at once: law, formulation, scheme, load, model, and which of the two marches it takes.
They are short, so that round-off has no time to grow through impacts: what differs on another machine stays below 1e-9.

    environment/run python3 -m tests.regression.golden_figures

writes golden_figures.json beside this file. Do that only after a change that is meant to change figures, and say so in
the commit.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gapbeam

CASES = Path(__file__).parents[2] / "cases"
STORED = Path(__file__).with_suffix(".json")
RECORDS = 6  # of a history that are kept, evenly spaced, the last among them
AT_ROUND_OFF = ("iterations", "energy_residual", "algorithmic_dissipation", "active_points", "contact_area")
"""Histories that round-off decides: a point whose pressure is all but zero counts as active, or does not."""

Figures = dict[str, list[float]]


@dataclass(frozen=True)
class Run:
    """A short run of a case.

    Attributes:
        case: Name of the file in cases/.
        overrides: Keys that it replaces.
        compiled: Whether the compiled march takes it.
        tolerance: Relative to the largest of a history, for energies of all of them; 1.6e-9 between two processors.
    """

    case: str
    overrides: tuple[str, ...]
    compiled: bool = False
    tolerance: float = 1.0e-8


GRAVITY = '{type="gravity"}'
HARD = ("load.shaker.amplitude=500", "load.shaker.frequency=100", "time.end=0.01")
IMPACT = 'contact.law={type="adams-impact",exponent=1.5,damping=1e6,full_depth=1e-5}'
BEAM = 'model={type="beam",elements=12}'
UNDER_STIFF_CONTACT = "gates.accept_energy_growth=true"

RUNS: dict[str, Run] = {
    "full, discrete gradient, Hunt-Crossley, friction": Run(
        "stability",
        (*HARD, 'contact.law={type="hunt-crossley",restitution=0.6}', "contact.friction={coefficient=0.3}"),
    ),
    "full, generalized-alpha, ADAMS's IMPACT, adaptive steps": Run(
        "stability",
        (
            *HARD,
            IMPACT,
            'time.scheme={type="generalized-alpha",rho_inf=0.8}',
            "time.adaptive=true",
            "contact.stiffness=1e13",
        ),
    ),
    "full, Nitsche, implicit midpoint": Run(
        "stability", (*HARD, 'contact.formulation={type="nitsche",theta=-1}', "time.scheme=implicit-midpoint")
    ),
    "full, augmented Lagrangian, base motion": Run(
        "stability",
        (
            "contact.formulation=augmented-lagrangian",
            "time.scheme=implicit-midpoint",
            f'load=[{GRAVITY},{{type="base_motion",quantity="velocity",amplitude=0.2,frequency=100.0}}]',
            "time.end=0.01",
        ),
    ),
    "full, unilateral, Moreau-Jean": Run(
        "stability",
        (
            *HARD,
            "contact.formulation=unilateral",
            'time.scheme={type="moreau-jean",theta=0.6,restitution=0.4}',
            UNDER_STIFF_CONTACT,
        ),
    ),
    "full, central difference on massless contact nodes, Kelvin-Voigt": Run(
        "stability",
        (
            "time.scheme=central-difference",
            "contact.mass=redistributed",
            "contact.damping=2e6",
            "damping={mass=4.0,stiffness=0.0}",
            "mesh.degree=1",
            "mesh.cells_through_thickness=4",
            "time.step=4e-7",
            "time.end=2e-4",
            "load.shaker.amplitude=5000",
            "load.shaker.frequency=2000",
            "load.shaker.ramp=0",
            UNDER_STIFF_CONTACT,
        ),
    ),
    "reduced, discrete gradient, Kelvin-Voigt": Run(
        "stability",
        (
            *HARD,
            'model={type="reduced",interface="fixed",modes=8}',
            "contact.stiffness=1e11",
            "contact.damping=2e6",
            "time.end=0.005",
        ),
        compiled=True,
    ),
    "beam, implicit midpoint, ADAMS's IMPACT, exciter": Run(
        "stability",
        (
            BEAM,
            IMPACT,
            "contact.stiffness=1e13",
            "time.scheme=implicit-midpoint",
            f'load=[{GRAVITY},{{type="exciter",point=0.15,amplitude=500.0,frequency=100.0,mass=0.3,stiffness=1e4,'
            "damping=20.0,preload=3.0}]",
            "time.end=0.01",
        ),
        compiled=True,
    ),
    "beam, HHT-alpha, Lankarani and Nikravesh, recorded motion": Run(
        "stability",
        (
            BEAM,
            'contact.law={type="lankarani-nikravesh",exponent=1.5,restitution=0.6}',
            "contact.stiffness=1e13",
            'time.scheme={type="hht-alpha",alpha=0.1}',
            f'load=[{GRAVITY},{{type="recorded_motion",file="signals/transport.csv",value_column="acceleration",'
            'scale=98.1,start=0.3,beyond="zero"}]',
            "time.end=0.01",
            UNDER_STIFF_CONTACT,
        ),
        compiled=True,
    ),
    "beam, Newmark, Kelvin-Voigt by its restitution": Run(
        "stability",
        (
            *HARD,
            BEAM,
            'contact.law={type="kelvin-voigt",restitution=0.6}',
            "contact.stiffness=1e11",
            "time.scheme=newmark",
        ),
        compiled=True,
    ),
    "rigid, discrete gradient, Hunt-Crossley at points": Run(
        "stability",
        (
            *HARD,
            "model.type=rigid",
            "damping={mass=4.0,stiffness=0.0}",
            "contact.points=[0.0,0.05]",
            'contact.law={type="hunt-crossley",exponent=1.5,restitution=0.6}',
            "contact.stiffness=1e10",
        ),
        compiled=True,
    ),
    "periodic response of a beam by shooting": Run(
        "periodic", (BEAM, "time.step=5e-4", "time.end=0.1"), compiled=True, tolerance=2.0e-7
    ),  # the last bit of a length moves its accelerations by 3.5e-8
}


def figures_of(run: Run) -> Figures:
    """Run it, and return some records of every history and the figures of its ledger.

    Raises:
        RuntimeError: The run did not pass, or the other march took it.
    """
    with tempfile.TemporaryDirectory() as folder:
        outcome = gapbeam.run(CASES / f"{run.case}.toml", run.overrides, output=Path(folder) / "results")
        summary = outcome.summary
        if outcome.exit_status != 0:
            raise RuntimeError(f"exit status {outcome.exit_status}: {outcome.message}")
        if "loop" in summary and summary["loop"].startswith("compiled") != run.compiled:
            raise RuntimeError(f"marched by the other loop: {summary['loop']}")
        history = gapbeam.open_results(outcome.folder).history.load()
    found = {f"model/{key}": [float(summary["model"][key])] for key in ("dofs", "contact_points")}
    found |= {f"seat/{key}": [summary["seat"][key]] for key in ("base_force", "gland_force")}
    if "periodic" in summary:
        found["periodic/largest_multiplier"] = [summary["periodic"]["largest_multiplier"]]
    return found | {str(name): _some(data.values) for name, data in history.items() if name not in AT_ROUND_OFF}


def _some(values: NDArray[np.float64]) -> list[float]:
    """Return some records of a history, and the largest of each of its columns."""
    rows = np.linspace(0, len(values) - 1, RECORDS + 1).round().astype(int)[1:]
    table = values.reshape(len(values), -1)
    return [float(value) for value in (*table[rows].ravel(), *np.abs(table).max(axis=0))]


def main() -> None:
    """Run all of them and write the file."""
    stored = {name: figures_of(run) for name, run in RUNS.items()}
    runs = ",\n".join(f"{json.dumps(name)}: {_lines(figures)}" for name, figures in stored.items())
    STORED.write_text(f"{{\n{runs}\n}}\n", encoding="utf-8")
    print(f"{len(stored)} runs: {STORED}")


def _lines(figures: Figures) -> str:
    """Return figures as JSON with one line for each, so that a difference of versions shows which ones changed."""
    return "{\n" + ",\n".join(f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in figures.items()) + "\n}"


if __name__ == "__main__":
    main()
