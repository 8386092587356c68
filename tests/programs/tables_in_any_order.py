"""Tables on three ranks, written and read piece by piece and in another order, into the folder of argument 1."""

from __future__ import annotations

import json
import sys
import tracemalloc
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from mpi4py import MPI

import gapbeam.solver.run.checkpoint.checkpoint_files as files
import gapbeam.solver.run.output.parallel_tables as spread
from gapbeam.solver.run.output.parallel_tables import ParallelTable, found_rows, on_rank_zero_with, rank_by_rank, taken

comm, folder = MPI.COMM_WORLD, Path(sys.argv[1])
large = {"u": ParallelTable(rank_by_rank(comm, 70_000), np.zeros((3, 70_000, 3)), layered=True)}
(folder / "large").mkdir(exist_ok=True)
tracemalloc.start()
path = on_rank_zero_with(comm, large, lambda pieces: files.write_checkpoint(folder / "large", 3, {}, large, pieces))
contents = files.read_checkpoint(path)
back = taken(large["u"].rows, contents.shapes["u"], lambda: contents.pieces("u", True), True)
peak = tracemalloc.get_traced_memory()[1] - back.nbytes
tracemalloc.stop()
if comm.rank == 0:
    print(json.dumps([peak, contents.array("u").nbytes]))
for module in (files, spread):
    setattr(module, "PIECE", 7)  # noqa: B010 - so that there are many
rng = np.random.default_rng(2)  # the same on all ranks
count = 60
places, u, w = rng.standard_normal((count, 3)), rng.standard_normal((3, count, 2)), rng.standard_normal((count, 2))
owner = np.sort(rng.integers(0, comm.size - 1, count))  # the last rank has nothing
mine = np.flatnonzero(owner == comm.rank)
natural = rank_by_rank(comm, len(mine))
assert natural.in_order
assert natural.count == count
tables = {
    "nodes": ParallelTable(natural, places[mine]),
    "u": ParallelTable(natural, u[:, mine], layered=True),
    "lagged": ParallelTable(natural, w[mine]),
}
arrays: dict[str, Any] = {**tables, "few": np.arange(5.0)}
path = on_rank_zero_with(comm, tables, lambda pieces: files.write_checkpoint(folder, 3, {"a": 1}, arrays, pieces))
contents = files.read_checkpoint(path)
assert contents.header == {"a": 1}
for name, whole in {"nodes": places, "u": u, "lagged": w, "few": np.arange(5.0)}.items():
    np.testing.assert_array_equal(contents.array(name), whole)

other = np.flatnonzero(rng.permutation(owner) == comm.rank)
other = other[np.argsort(rng.random((comm.size, count))[comm.rank, : len(other)])]  # other ranks, another order
near = places[other] + 1e-12
rows = found_rows(comm, near, lambda: contents.pieces("nodes"))
np.testing.assert_array_equal(rows.places, other)
assert not rows.in_order
np.testing.assert_array_equal(taken(rows, u.shape, lambda: contents.pieces("u", True), True), u[:, other])
np.testing.assert_array_equal(taken(rows, w.shape, lambda: contents.pieces("lagged")), w[other])
stored = {"w": ParallelTable(rows, w[other])}
whole = on_rank_zero_with(comm, stored, lambda pieces: np.concatenate(list(pieces("w"))))
np.testing.assert_array_equal(whole, w)


def stops(pieces: Any) -> NoReturn:
    """Take one piece, then fail."""
    next(pieces("w"))
    raise OSError("no room")


for work, words in (
    (lambda: on_rank_zero_with(comm, stored, stops), "no room"),
    (lambda: found_rows(comm, near + 1e-3, lambda: contents.pieces("nodes")), "other places"),
    (lambda: found_rows(comm, near, lambda: iter([places[:50]])), "50 places, expected 60"),
    (lambda: found_rows(comm, near, lambda: iter([places[:-1], places[:1]])), "places that are there twice"),
    (lambda: taken(rows, w.shape, lambda: iter([np.full((count, 2), np.nan)])), "other things than finite"),
    (lambda: taken(rows, w.shape, lambda: contents.pieces("none")), "none"),
):
    try:
        work()
    except (OSError, ValueError, KeyError) as error:
        assert words in str(error), (words, error)
    else:
        raise SystemExit(words)
