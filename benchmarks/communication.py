"""Communication of a step: messages and bytes between ranks, part by part, and their time on this machine.

The solid beam of cases/li2013.toml, shaken so hard that it rattles, on 1, 2 and 4 ranks. Messages and bytes are counted
by MPI's profiling interface (benchmarks.messages), those of MUMPS among them. On more ranks than cores only the
counts mean something. Up to some thousand unknowns between slices every rank has factors of its own; beyond, MUMPS
solves on all ranks together. Both are counted.

    environment/run python3 -m benchmarks.communication
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from mpi4py import MPI

import gapbeam.solver.linear_algebra.substructuring.substructured_factor as substructured_factor
from benchmarks.apart import json_of
from benchmarks.marching import Seated, marched, seated
from benchmarks.messages import counter, on_ranks
from benchmarks.parts import Account, Watched
from benchmarks.size import mesh_overrides
from benchmarks.table import Cell, Table, machine_words, options, seconds
from benchmarks.textbook import shaken
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.integrators import midpoint
from gapbeam.solver.march.paused_march import Paused
from gapbeam.solver.run.checkpoint.dof_layout import layout_of
from gapbeam.solver.run.checkpoint.state_arrays import stored
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.run.output.parallel_tables import Pieces, on_rank_zero_with
from gapbeam.solver.system.semi_discrete import Snapshots

CELLS, RANKS = (4, 8), (1, 2, 4)
STEPS = 40
REST, RECORD, FIELDS, CHECKPOINT = "the rest", "a record", "a field", "a checkpoint"
APART = (RECORD, FIELDS, CHECKPOINT)  # not in every step
SIZES = (8, 256, 4_096, 65_536, 1_048_576, 16_777_216)  # bytes
STREAM, SQUARE = 20_000_000, 1_500  # numbers that are read; rows of matrices that are multiplied

Printed = dict[str, Any]


def watched(start: Seated) -> Watched:
    """Return the parts of a step."""
    operators = type(start.model.system.operators)
    products = ("apply_mass", "apply_stiffness", "apply_restraint")
    return {
        "back-substitution": ((CondensedOperator, "solve_free"),),
        "correction": ((CondensedOperator, "correct"),),
        "contact solve": ((midpoint, "solve_contact_and_friction"),),
        "products": tuple((operators, name) for name in products),
        "sums": ((operators, "sum"),),
    }


def measure(cells: int, comm: MPI.Comm) -> None:
    """Count and time the steps of one size on these ranks and report it, rank by rank. Collective."""
    start = seated(shaken(overrides=mesh_overrides(cells)), comm)
    marched(start, 2)
    account, model = Account(), start.model
    with account.watching(watched(start)), account.part(REST):
        marched(start, STEPS)
    recorder, opened = Recorder(model), Accounts.opened(model.system, model.law, start.start, start.plan.dt)
    with account.part(RECORD):
        recorder.row(start.start, opened)
    folders = TemporaryDirectory() if comm.rank == 0 else None
    fields = FieldWriter(Path(comm.bcast(folders.name if folders else "")), model)
    with account.part(FIELDS):
        fields.write(Snapshots.of_states([start.start]), model)
    layout = layout_of(model, comm)
    with account.part(CHECKPOINT):
        arrays = stored(Paused(start.start, 0), layout)
        tables = {name: array for name, array in arrays.items() if not isinstance(array, np.ndarray)}

        def taken(pieces: Pieces) -> None:
            for name in tables:
                for _ in pieces(name):
                    pass

        on_rank_zero_with(comm, tables, taken)
    text = {
        "dofs": comm.allgather(model.system.operators.size),
        "points": model.system.contact.size,
        "interface": model.system.contact.interface.size,
        "parts": comm.allgather(account.figures()),
    }
    if comm.rank == 0:
        print(json.dumps(text))
    comm.Barrier()
    if folders is not None:
        folders.cleanup()


def least(comm: MPI.Comm, work: Callable[[], object], repeats: int = 20, inner: int = 1) -> float:
    """Return the least wall time of some work on these ranks, begun together, s. Collective."""
    found = []
    for _ in range(repeats):
        comm.Barrier()
        clock = time.perf_counter()
        for _ in range(inner):
            work()
        found.append((time.perf_counter() - clock) / inner)
    return float(max(comm.allgather(min(found))))


def wire(comm: MPI.Comm) -> None:
    """Measure what a message between the first two ranks takes, what a sum over all, and what each core does.

    Collective. Reports, all ranks at work at once, seconds by bytes for half of a ping-pong and for Reduce with Bcast,
    and for each core the bytes it reads and the floating-point operations it does in a second.
    """
    half, total = {}, {}
    for size in SIZES:
        data, into, inner = np.zeros(size // 8), np.zeros(size // 8), 50 if size < 100_000 else 2

        def ping(data: Any = data) -> None:
            if comm.rank == 0 and comm.size > 1:
                comm.Send(data, 1)
                comm.Recv(data, 1)
            elif comm.rank == 1:
                comm.Recv(data, 0)
                comm.Send(data, 0)

        def add(data: Any = data, into: Any = into) -> None:
            comm.Reduce(data, into)
            comm.Bcast(into)

        half[size] = 0.5 * least(comm, ping, inner=inner)
        total[size] = least(comm, add, inner=inner)
    one, other = np.ones(STREAM), np.ones(STREAM)
    square = np.ones((SQUARE, SQUARE))
    text = {
        "half": half,
        "sum": total,
        "read": 16.0 * STREAM / least(comm, lambda: one @ other, 8),
        "multiply": 2.0 * SQUARE**3 / least(comm, lambda: square @ square, 4),
    }
    if comm.rank == 0:
        print(json.dumps(text))


def busiest(text: Printed, part: str, what: str) -> float:
    """Return a figure of a part on the rank where it is largest: per step, or once for what is not in every step."""
    every = 1 if part in APART else STEPS
    return max(float(rank[part][what]) for rank in text["parts"]) / every


def counted(cells: int, ranks: int, counting: Path, together: bool) -> Printed:
    """Return what `measure` reports in processes of its own."""
    way = ("--together",) if together else ()
    words = on_ranks(ranks, "-m", "benchmarks.communication", "--one", *way, str(cells), counting=counting)
    text: Printed = json_of(words)
    return text


def step_table(cells: Sequence[int] = CELLS, ranks: Sequence[int] = RANKS, together: bool = False) -> Table:
    """Return the table of what parts send and take, with factors of the ranks or with MUMPS on all together."""
    rows: list[tuple[Cell, ...]] = []
    figures: dict[str, Cell] = {}
    with counter() as counting:
        for size in cells:
            for count in ranks:
                text = counted(size, count, counting, together)
                dofs = sum(text["dofs"])
                timed = count <= (os.cpu_count() or 1)
                figures |= {f"{dofs}: {name}": text[name] for name in ("points", "interface")}
                for part in text["parts"][0]:
                    what = {name: busiest(text, part, name) for name in text["parts"][0][part]}
                    figures |= {f"{dofs} on {count}: {part}: {name}": value for name, value in what.items()}
                    if not timed and what["messages"] + what["collectives"] == 0.0:
                        continue
                    rows.append(
                        (
                            dofs,
                            count,
                            part,
                            round(what["messages"], 1),
                            kilobytes(what["message_bytes"]),
                            round(what["collectives"], 1),
                            kilobytes(what["collective_bytes"]),
                            seconds(what["seconds"]) if timed else None,
                            seconds(what["in_mpi"]) if timed else None,
                        )
                    )
    return Table(
        "together" if together else "communication",
        "What a step sends, part by part" + (", MUMPS on all ranks together" if together else ""),
        ("DOFs", "ranks", "part", "messages", "bytes", "collective", "bytes", "time", "in MPI"),
        tuple(rows),
        (
            machine_words(),
            f"means over {STEPS} rattling steps of the busiest rank; a record, a field and a checkpoint: of one",
            "times are for the part alone; in MPI: including the wait for other ranks",
        ),
        figures,
    )


def wire_table() -> Table:
    """Return what messages, sums, reading and multiplying take on one rank and on two at once."""
    found = {count: json_of(on_ranks(count, "-m", "benchmarks.communication", "--wire")) for count in (1, 2)}
    two = found[2]
    rows: list[tuple[Cell, ...]] = [
        (kilobytes(float(size)), seconds(two["half"][str(size)]), seconds(two["sum"][str(size)])) for size in SIZES
    ]
    figures: dict[str, Cell] = {f"half {size}": two["half"][str(size)] for size in SIZES}
    figures |= {f"sum {size}": two["sum"][str(size)] for size in SIZES}
    figures |= {f"{name} on {count}": one[name] for count, one in found.items() for name in ("read", "multiply")}
    return Table(
        "wire",
        "What it takes to send, on two ranks of this machine",
        ("message", "one way", "Reduce and Bcast"),
        tuple(rows),
        (
            machine_words(),
            "each rank reads {:.3g} GB/s alone and {:.3g} GB/s where both do, and multiplies matrices with "
            "{:.3g} and {:.3g} Gflop/s".format(
                *(found[count][name] / 1e9 for name in ("read", "multiply") for count in (1, 2))
            ),
        ),
        figures,
    )


def kilobytes(amount: float) -> str:
    """Return an amount of data with a unit and three digits."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if amount >= size:
            return f"{amount / size:.3g} {unit}"
    return f"{amount:.3g} B"


if __name__ == "__main__":
    if "--one" in sys.argv:
        if "--together" in sys.argv:
            substructured_factor.MOST_INTERFACE = -1
        measure(int(sys.argv[-1]), MPI.COMM_WORLD)
    elif "--wire" in sys.argv:
        wire(MPI.COMM_WORLD)
    else:
        chosen = options(__doc__)
        for one in (step_table(), step_table(together=True), wire_table()):
            one.write(chosen.output)
