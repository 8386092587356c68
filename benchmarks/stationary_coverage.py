"""Coverage of 95 % intervals of rattling against its exact stationary law: systems and cases, many seeds.

environment/run python3 -m benchmarks.stationary_coverage [seeds] [name of a row to run alone]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from mpi4py import MPI

from benchmarks.stationary_cases import StationaryCase, beam, noise_defect, rigid, with_step
from gapbeam import read_case
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.statistics.block_means import missed_share
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.march.simulation import Simulation, Wanted, marched
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.stop_rule import statistics_of
from gapbeam.studies.trials.starts import KeptBody
from tests.shared.rattlers import Rattler, between_stops, in_a_hole, sliding_on_a_stop
from tests.shared.rattlers import marched as rattling

SEEDS, SECONDS = 200, 600.0
HEADS = ("set", "figure", "exact", "mean of all seeds", "held", "held of those judged good", "half width")
Statistics = Callable[[int], RunStatistics]


@dataclass(frozen=True)
class Row:
    """A parameter set.

    Attributes:
        name: Its name.
        exact: Exact figures, by name.
        statistics: Those of a march with a seed.
        missed: Part of the impacts that steps could not see, mean over the faces, of each march so far.
    """

    name: str
    exact: dict[str, float]
    statistics: Statistics
    missed: list[float] = field(default_factory=list)


@dataclass
class CaseMarches:
    """Marches of a case with other seeds, on the same body."""

    case: StationaryCase
    bodies: KeptBody
    missed: list[float] = field(default_factory=list)

    @cached_property
    def model(self) -> Model:
        """Model of the first seed."""
        return self._model(0)

    def statistics(self, seed: int) -> RunStatistics:
        """Return the statistics of a march."""
        model = self._model(seed)
        simulation = Simulation(model)
        start = simulation.start(simulation.seat_or_failure())
        every = round((model.case.output.history_interval or model.step) / model.step)
        recorder = Recorder(model, statistics=statistics_of(model, every))
        accounts = Accounts.opened(model.system, model.law, start, model.step)
        recorder.row(start, accounts)
        for _ in marched(simulation.plan, start, accounts, recorder, Wanted(every), MPI.COMM_SELF):
            pass
        assert recorder.statistics is not None
        self.missed.append(float(np.mean([missed_share(one, model.step) for one in accounts.impacts.ended])))
        return recorder.statistics

    def _model(self, seed: int) -> Model:
        tables: dict[str, Any] = dict(self.case.tables)
        tables["load"] = [{**load, "seed": seed} for load in tables["load"]]
        return self.bodies.model(read_case(tables))


def rows() -> dict[str, Callable[[str], Row]]:
    """Return the function that makes each parameter set, by name."""
    one = {"support": (0.0, 0.1, 2.0e-4)}
    two = {"first": (0.0, 0.05, 2.0e-4), "second": (0.5, 0.55, 3.0e-4)}
    ends = {"middle": (0.27, 0.32, 0.7e-4), "end": (0.55, 0.6, 2.0e-4)}
    return {
        "mass, one stop": lambda name: _system(name, between_stops(1)),
        "mass, two stops": lambda name: _system(name, between_stops(2)),
        "mass, round hole": lambda name: _system(name, in_a_hole()),
        "mass that slides on a stop": lambda name: _system(name, sliding_on_a_stop()),
        "rigid beam, one support": lambda name: _case(rigid(name, one)),
        "rigid beam, two supports": lambda name: _case(rigid(name, two)),
        "elastic beam, two supports": lambda name: _case(beam(name, 2, ends)),
        "elastic beam, twice the step": lambda name: _case(with_step(beam(name, 2, ends), 1.0e-4)),
    }


def _system(name: str, rattler: Rattler) -> Row:
    return Row(name, rattler.exact, lambda seed: rattling(rattler, seed, SECONDS))


def _case(case: StationaryCase) -> Row:
    marches = CaseMarches(case, KeptBody())
    model = marches.model
    print(
        f"<!-- {case.name}: {model.system.operators.size} DOFs, {model.system.contact.size} contact points, forces off "
        f"by {noise_defect(model):.1%} -->",
        flush=True,
    )
    return Row(case.name, case.exact(model), marches.statistics, marches.missed)


def print_coverage(row: Row, seeds: int) -> None:
    """Print the coverage of every figure of a parameter set."""
    started = time.process_time()
    found = [{one.name: one for one in row.statistics(seed).figures()} for seed in range(1, seeds + 1)]
    for name, exact in row.exact.items():
        ones = [one[name] for one in found]
        held = [one.interval.low <= exact <= one.interval.high for one in ones]
        good = [inside for inside, one in zip(held, ones, strict=True) if one.verdict == "good"]
        value, width = (np.mean([getattr(one.interval, what) for one in ones]) for what in ("value", "relative"))
        cells = [
            row.name,
            f"`{name}`",
            f"{exact:.5g}",
            f"{value / exact - 1:+.1%}",
            f"{np.mean(held):.1%}",
            f"{np.mean(good):.1%} of {len(good)}" if good else "none",
            f"{width:.1%}",
        ]
        print(f"| {' | '.join(cells)} |", flush=True)
    missed = f", {np.mean(row.missed):.1%} of the impacts missed" if row.missed else ""
    cost = (time.process_time() - started) / seeds
    print(f"<!-- {row.name}: {cost:.2f} s of processor time a seed{missed} -->", flush=True)


def main(words: Sequence[str]) -> None:
    """Print the table."""
    print("| " + " | ".join(HEADS) + " |\n|" + "---|" * len(HEADS))
    seeds = int(words[0]) if words else SEEDS
    for name, made in rows().items():
        if not words[1:] or words[1] in name:
            print_coverage(made(name), seeds)


if __name__ == "__main__":
    main(sys.argv[1:])
