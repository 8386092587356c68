"""A factor on every rank and one between: against whole matrices, and the same bits in every run."""

from __future__ import annotations

import multiprocessing
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.linear_algebra.substructured_factor import smallest_cover
from tests.shared.command import PROJECT, RATTLE, alone, on_ranks, settings
from tests.shared.interrupted import differing

pytestmark = [alone, pytest.mark.versions]


def test_covers_are_smallest() -> None:
    """Small graphs: all edges are covered, and by trial of all smaller sets, none of them would do."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        edges = np.unique(np.column_stack([rng.integers(0, 5, 9), 10 + rng.integers(0, 5, 9)]), axis=0)
        found = set(smallest_cover(edges).tolist())
        assert all(one in found or other in found for one, other in edges.tolist())
        for fewer in combinations(np.unique(edges).tolist(), len(found) - 1):
            assert not all(one in fewer or other in fewer for one, other in edges.tolist())
    assert len(smallest_cover(np.empty((0, 2), dtype=np.int64))) == 0


@pytest.mark.slow(minutes=0.1)
def test_substructured_factor_is_that_of_the_whole_matrix() -> None:
    """Three ranks: chains and rings of nodes, ranks without unknowns, with and without kept columns; faults on all."""
    done = on_ranks(3, program="tests.programs.factors_on_ranks")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("count", "times", "cells"), [(2, 6, 4), (3, 4, 2)])
def test_repeated_runs_are_the_same(count: int, times: int, cells: int, tmp_path: Path) -> None:
    """cases/li2013.toml until it has left and met both faces: no bit differs, whatever else runs.

    29 000 DOFs on two ranks; fewer on three, which wait busily for each other where there are two cores.
    """
    across = (f"mesh.cells_through_thickness={cells}", f"mesh.cells_across_width={cells}")
    keys = (*RATTLE, *across, "time.end=0.012", "output.fields_interval=2e-3")
    for number in range(times):
        load = [multiprocessing.Process(target=_busy, daemon=True) for _ in range(number % 3)]
        for one in load:
            one.start()
        folder = tmp_path / str(number)
        done = on_ranks(count, "run", PROJECT / "cases" / "li2013.toml", "--output", folder, *settings(*keys))
        for one in load:
            one.terminate()
            one.join()
        assert done.returncode == 0, done.stderr
        assert differing(tmp_path / "0", folder) == []


def _busy() -> None:
    while True:
        pass
