"""The fidelity levels of [model] on the same case: cost of a step, and difference of the answers from the full model.

The solid beam of cases/li2013.toml on a softer contact and with more damping than there, so that its response is
periodic: chaotic ones can be compared by statistics only. Every level is run by `gapbeam run`, and compared with the
full model as `gapbeam compare` does.

    environment/run python3 -m benchmarks.fidelity_levels
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from benchmarks.table import Cell, Table, machine_words, options, seconds
from benchmarks.textbook import CASE, TextbookBeam, seated
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.run_comparison import RunComparison, compare
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.run.run_case import run_case

Level = tuple[Path, Sequence[str]]  # a case file and overrides

PERIODIC = (
    "contact.stiffness=1e12",
    "load.shaker.amplitude=150.0",
    "load.shaker.ramp=0.05",
    "damping.ratios=[0.05, 0.05]",
    "time.scheme=implicit-midpoint",
    "output.fields_interval=0.1",
)
SLICE = CASE.with_name("li2013-2d.toml")
REDUCED = ("model.type=reduced",)
LEVELS: dict[str, Level] = {
    "full": (CASE, ()),
    "reduced, all contact DOFs": (
        CASE,
        (*REDUCED, "model.contact=all", "model.points_across=all", "model.modes=30"),
    ),
    "reduced": (CASE, REDUCED),
    "2D, full": (SLICE, ()),
    "2D, reduced": (SLICE, REDUCED),
    "beam": (SLICE, ("model.type=beam",)),
}

END, BRIEF = "time.end=0.6", "time.end=0.1"
SECOND = ("time.step=1e-5", "time.end=0.1", "output.history_interval=1e-4")
SECONDS_WANTED = {"reduced": 3.0, "2D, reduced": 1.0}  # wall time of a simulated second at steps of 1e-5 s
TEXTBOOK_STEPS = 6
QUANTITIES = ("smoothed acceleration", "harmonic", LARGEST_FORCE, "impulse", "displacement")
FASTER = "times faster than the textbook, alone"
HEADINGS = ("peak to peak of the 2.5 ms mean acceleration", "harmonics 1-5", LARGEST_FORCE, "impulse", "displacement")


def table(levels: dict[str, Level] = LEVELS, end: str = END) -> Table:
    """Return the table of some fidelity levels, the first of which is what the others are compared with."""
    textbook = _textbook(next(iter(levels.values()))[0])
    rows: list[tuple[Cell, ...]] = []
    notes: list[str] = []
    figures: dict[str, Cell] = {"textbook_per_step": textbook}
    with tempfile.TemporaryDirectory() as folder:
        first = Path(folder) / "full"
        for name, (path, overrides) in levels.items():
            place = first if not rows else Path(folder) / name
            if place != first:
                _run(path, [*PERIODIC, BRIEF, *overrides], place)  # what is compiled when first needed is then at hand
            summary = _run(path, [*PERIODIC, end, *overrides], place)
            spent = summary["wall_time"]
            cost, alone = spent["per_step"], spent["advance"]
            setup = spent["total"] - spent["march"]
            errors: list[Cell] = [None] * (len(QUANTITIES) + 1)
            if place != first:
                compared = compare(open_results(first), open_results(place))
                errors = [*(_largest(compared, quantity) for quantity in QUANTITIES), _apart(first, place)]
                figures[f"{name}: at the same times"] = errors[-1]
                if compared.way != "cycle":
                    notes.append(f"{name}: compared by {compared.way}: {compared.verdict}")
            figures |= {f"{name}: per step": cost, f"{name}: step alone": alone}
            rows.append(
                (
                    name,
                    int(summary["model"]["dofs"]),
                    seconds(setup),
                    seconds(cost),
                    seconds(alone),
                    textbook / alone,
                    *errors,
                )
            )
    for name, wanted in SECONDS_WANTED.items():
        if name in levels:
            taken = _second(*levels[name])
            figures[f"{name}: a simulated second"] = taken
            verdict = "met" if taken <= wanted else "NOT met"
            notes.append(f"{name}: a simulated second at 1e-5 s takes {taken:.2f} s, wanted {wanted:g} s: {verdict}")
    return Table(
        "fidelity_levels",
        "The fidelity levels of [model] against the full model, periodic response",
        (
            "model",
            "DOFs marched",
            "set-up",
            "per step",
            "step alone",
            FASTER,
            *HEADINGS,
            "at the same times",
        ),
        tuple(rows),
        (
            machine_words(),
            f"the textbook takes {seconds(textbook)} per step here, over {TEXTBOOK_STEPS} steps from the seat under "
            "the full load; per step: the whole march with its output over its steps; step alone: without output, as "
            "the textbook's",
            "errors are relative to the full model (harmonics: to the largest of the probe), the largest over probes "
            "and faces; at the same times: largest difference of a displacement over the whole record",
            *notes,
        ),
        figures,
    )


def _run(path: Path, overrides: Sequence[str], folder: Path) -> dict[str, Any]:
    outcome = run_case(read_case(path, list(overrides)), folder, MPI.COMM_SELF, overwrite=True)
    if outcome.exit_status != 0:
        raise RuntimeError(f"{' '.join(overrides)}: {outcome.message}")
    return outcome.summary


def _textbook(path: Path) -> float:
    """Return the mean time of some steps of the textbook, s."""
    case = read_case(path, [*PERIODIC, "load.shaker.ramp=0.0"])
    start = seated(case)
    beam = TextbookBeam(case, start.model, start.start)
    clock = time.perf_counter()
    for _ in range(TEXTBOOK_STEPS):
        beam.advance()
    return (time.perf_counter() - clock) / TEXTBOOK_STEPS


def _second(path: Path, overrides: Sequence[str]) -> float:
    """Return the wall time of a simulated second at steps of 1e-5 s, without set-up, s."""
    with tempfile.TemporaryDirectory() as folder:
        summary = _run(path, [*PERIODIC, *SECOND, *overrides], Path(folder))
    return float(summary["wall_time"]["march"]) / 0.1


def _largest(compared: RunComparison, quantity: str) -> float | None:
    found = [row.difference for row in compared.rows if quantity in row.name]
    return float(max(found)) if found else None


def _apart(one: Path, other: Path) -> float:
    """Return the largest difference of the probes' displacements at the same times, relative to the largest."""
    first, second = (open_results(folder).history["displacement"].values[..., -1] for folder in (one, other))
    return float(np.max(np.abs(first - second)) / np.max(np.abs(first)))


if __name__ == "__main__":
    chosen = options(__doc__)
    table().write(chosen.output)
