"""Strong scaling: the same beam on one rank and on two, set-up and steps, memory and DOFs of each rank.

The solid beam of cases/li2013.toml, shaken so hard that it rattles, on the mesh of that case and on one with twice the
cells in every direction. Each number of ranks runs in processes of its own, bound to cores; short runs are repeated
in turn and the least time of each part counts, because what else runs on a machine only adds.

    environment/run python3 -m benchmarks.scaling
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from mpi4py import MPI

from benchmarks.apart import json_of
from benchmarks.marching import marched, seated
from benchmarks.messages import on_ranks
from benchmarks.size import SETUP, mesh_overrides
from benchmarks.table import Cell, Table, machine_words, options, seconds
from benchmarks.textbook import shaken
from gapbeam.solver.contact.solve.matrix_free_condensation import condensed_operator
from gapbeam.solver.run.output.run_summary import peak_memory

RUNS = {4: 3, 8: 1}  # how often, by cells across and through the beam
RANKS = (1, 2)
STEPS, MARCHES = 40, 3
TIMES = (*SETUP, "block", "step", "back_substitution")

Printed = dict[str, Any]


def measure(cells: int, comm: MPI.Comm) -> None:
    """Measure one size on these ranks and report it; the slowest rank counts."""
    start = seated(shaken(overrides=mesh_overrides(cells)), comm)
    marches = [marched(start, STEPS) for _ in range(MARCHES)]
    system, memory = start.model.system, peak_memory(comm)
    dropped = condensed_operator(system, *start.plan.scheme.coefficients(system, start.plan.dt), seldom=True)
    interface, operators = system.contact.interface, system.operators
    mine = {name: start.seconds[name] for name in SETUP} | {
        "block": dropped.seconds["delassus"],
        "step": min(done.per_step for done in marches),
        "back_substitution": min(done.back_substitution for done in marches),
    }
    words = {
        **{name: max(comm.allgather(value)) for name, value in mine.items()},
        "dofs": comm.allgather(operators.size),
        "interface": comm.allgather(len(interface.owned)),
        "points": system.contact.size,
        "memory": memory,
    }
    if comm.rank == 0:
        print(json.dumps(words))


def least(runs: Sequence[Printed]) -> Printed:
    """Return the figures of repeated runs: the least time of each part, the most memory of each rank."""
    times = {name: min(run[name] for run in runs) for name in TIMES}
    memory = [max(rank) for rank in zip(*(run["memory"] for run in runs), strict=True)]
    return {**runs[0], **times, "memory": memory, "setup": sum(times[name] for name in SETUP)}


def table(runs: Mapping[int, int] = RUNS, ranks: Sequence[int] = RANKS) -> Table:
    """Return the table over sizes and ranks, the first number of which is what the others are measured against."""
    rows: list[tuple[Cell, ...]] = []
    figures: dict[str, Cell] = {}
    for size, repeats in runs.items():
        words: dict[int, list[Printed]] = {count: [] for count in ranks}
        for _ in range(repeats):
            for count in ranks:
                words[count].append(json_of(on_ranks(count, "-m", "benchmarks.scaling", "--one", str(size))))
        found = {count: least(one) for count, one in words.items()}
        alone = found[ranks[0]]
        for count, one in found.items():
            share = ranks[0] / count
            efficiency = {name: share * alone[name] / one[name] for name in ("setup", "step", "back_substitution")}
            dofs = sum(one["dofs"])
            rows.append(
                (
                    dofs,
                    count,
                    _each(one["dofs"]),
                    _each(one["interface"]),
                    *(seconds(one[name]) for name in SETUP),
                    seconds(one["setup"]),
                    seconds(one["block"]),
                    seconds(one["step"]),
                    seconds(one["back_substitution"]),
                    " + ".join(f"{memory / 1e9:.2f}" for memory in one["memory"]),
                    *(None if count == ranks[0] else f"{100.0 * value:.0f} %" for value in efficiency.values()),
                )
            )
            figures |= {f"{dofs} on {count}: efficiency of {name}": value for name, value in efficiency.items()}
            figures |= {f"{dofs} on {count}: {name}": one[name] for name in (*TIMES, "setup")}
    return Table(
        "scaling",
        "Strong scaling: the condensed way, 3D, degree 2",
        (
            "DOFs",
            "ranks",
            "DOFs of each",
            "interface DOFs of each",
            *SETUP,
            "set-up",
            "delassus without columns",
            "step",
            "back-substitution",
            "peak memory of each (GB)",
            "efficiency of set-up",
            "of steps",
            "of back-substitution",
        ),
        tuple(rows),
        (
            machine_words(),
            f"the least of {' and '.join(map(str, runs.values()))} runs of the sizes for each part of the set-up, and "
            f"of {MARCHES} marches of {STEPS} rattling steps in each run for the mean step; the slowest rank counts",
            f"efficiency: the time on {ranks[0]} rank over ranks times the time on them",
        ),
        figures,
    )


def _each(counts: Sequence[int]) -> str:
    return " + ".join(map(str, counts))


if __name__ == "__main__":
    if "--one" in sys.argv:
        measure(int(sys.argv[-1]), MPI.COMM_WORLD)
    else:
        table().write(options(__doc__).output)
