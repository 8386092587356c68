"""Comparison of the cost that `gapbeam check` predicts with what `gapbeam run` takes, each in its own process.

environment/run python3 -m benchmarks.predictions
environment/run python3 -m benchmarks.predictions --large     the cases in full length
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from mpi4py import MPI

from benchmarks.table import (
    Cell,
    Figures,
    Table,
    gigabytes,
    machine_words,
    measured_apart,
    options,
    print_figures,
    seconds,
)
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.run.run_case import run_case
from gapbeam.studies.trial_prediction import predict

CASES = Path(__file__).parents[1] / "cases"
SHORT = (
    ("demo.toml",),
    ("li2013-2d.toml", "time.end=0.4"),
    ("li2013.toml", "time.end=0.3"),
    ("clamped.toml", "time.end=0.1"),
    ("li2013.toml", "time.end=1.0", "model.type=reduced"),
    ("li2013-2d.toml", "time.end=1.0", "model.type=beam"),
)
WHOLE = (("demo.toml",), ("li2013-2d.toml",), ("clamped.toml",), ("li2013.toml",))
FACTOR = 2.0


def measure(what: str, name: str, overrides: list[str]) -> None:
    """Predict or run a case in this process and report what it takes."""
    case, clock = read_case(CASES / name, overrides), time.perf_counter()
    if what == "check":
        model = build_model(case, MPI.COMM_SELF)
        prediction = predict(Simulation(model), time.perf_counter() - clock, MPI.COMM_SELF)
        took = time.perf_counter() - clock
        alone = prediction.total - prediction.errors
        print_figures({"time": alone, "predicted_memory": prediction.memory, "took": took})
        return
    with tempfile.TemporaryDirectory() as folder:
        outcome = run_case(case, Path(folder), MPI.COMM_SELF, overwrite=True)
    words = outcome.summary
    print_figures({"time": words["wall_time"]["total"], "run_memory": float(sum(words["memory"]["peak_per_rank"]))})


def both(name: str, *overrides: str) -> tuple[Figures, Figures]:
    """Return the figures of a case by check and by run, each in a process of its own."""
    check, run = (
        measured_apart("benchmarks.predictions", "--one", what, name, *overrides) for what in ("check", "run")
    )
    return check, run


def table(cases: tuple[tuple[str, ...], ...]) -> Table:
    """Return the table of verdicts."""
    rows: list[tuple[Cell, ...]] = []
    worst = 1.0
    for name, *overrides in cases:
        check, run = both(name, *overrides)
        ratios = (check["time"] / run["time"], check["predicted_memory"] / run["run_memory"])
        worst = max(worst, *ratios, *(1.0 / ratio for ratio in ratios))
        good = all(1.0 / FACTOR <= ratio <= FACTOR for ratio in ratios)
        rows.append(
            (
                " ".join([name, *(f"--set {override}" for override in overrides)]),
                seconds(check["took"]),
                seconds(check["time"]),
                seconds(run["time"]),
                ratios[0],
                gigabytes(check["predicted_memory"]),
                gigabytes(run["run_memory"]),
                ratios[1],
                "yes" if good else "NO",
            )
        )
    return Table(
        "predictions",
        "What gapbeam check predicts against what gapbeam run takes",
        ("case", "check takes", "predicted", "run", "ratio", "memory predicted", "of the run", "ratio", "within 2"),
        tuple(rows),
        (
            machine_words(),
            f"the worst ratio of all is {worst:.2f}; time and memory are to be within a factor of {FACTOR:g}",
        ),
        {"worst": worst},
    )


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(sys.argv[2], sys.argv[3], sys.argv[4:])
    else:
        chosen = options(__doc__, ("large", "the cases in full length, which takes a quarter of an hour"))
        table(WHOLE if chosen.large else SHORT).write(chosen.output)
