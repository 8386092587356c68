"""Threads and cores of ranks: one thread by default, before anything is loaded; ranks that wait leave their core."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.solver.run import rank_threads as threads
from gapbeam.solver.run.rank_threads import THREADS, crowded, is_count, threads_a_rank
from tests.shared.command import DEMO, PROJECT, alone, on_ranks


def variables(**given: str) -> list[str]:
    """Return what the variables are in a process that was started with some of them, without environment/run."""
    plain = {name: value for name, value in os.environ.items() if name not in THREADS}
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.chosen_threads"],
        cwd=PROJECT,
        env=plain | given,
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    return list(found)


@alone
@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({}, ["1", "1", "1"]),
        ({"OMP_NUM_THREADS": "4"}, ["4", "4", "4"]),
        ({"OMP_NUM_THREADS": "abc", "OPENBLAS_NUM_THREADS": "3"}, ["1", "3", "1"]),
        ({"OMP_NUM_THREADS": "-1"}, ["1", "1", "1"]),
    ],
    ids=["nothing", "four", "no number", "negative"],
)
def test_one_thread_unless_reported_otherwise(given: dict[str, str], found: list[str]) -> None:
    """What the user set stays; what is not set, or is no number of threads, becomes 1, or OMP_NUM_THREADS."""
    assert variables(**given) == found


@alone
def test_threads_are_chosen_before_libraries_are_loaded() -> None:
    """`import gapbeam` loads no numerical library: they read the variables when they are loaded."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.loaded_libraries"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "[]"


@alone
@pytest.mark.skipif("Open MPI" not in MPI.Get_library_version(), reason="the option is one of Open MPI")
def test_ranks_that_wait_leave_their_core(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rank that waits on the core of a rank that works takes less than a third of its time: it took as much."""
    monkeypatch.delenv("OMPI_MCA_mpi_yield_when_idle", raising=False)
    done = on_ranks(2, program="tests.programs.waiting_rank")
    assert float(done.stdout) < 1 / 3, done.stderr


@pytest.mark.parametrize(
    ("text", "count"),
    [("1", True), ("4,2", True), (" 8 ", True), ("", False), ("0", False), ("٣", False), ("1e3", False)],
)
def test_numbers_of_threads(text: str, count: bool) -> None:
    """OpenMP takes a number, or one for each level."""
    assert is_count(text) == count


def test_more_threads_than_cores_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two threads a rank on one core: reported; one thread a rank where there are cores for all: not."""
    monkeypatch.setattr(threads.os, "sched_getaffinity", lambda _: {0}, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "2,1")
    assert threads_a_rank() == 2
    words = crowded(MPI.COMM_WORLD)
    assert words is not None
    assert f"{MPI.COMM_WORLD.size} ranks with {2 * MPI.COMM_WORLD.size} threads together share 1 cores" in words
    monkeypatch.setattr(threads.os, "sched_getaffinity", lambda _: set(range(64)), raising=False)
    assert crowded(MPI.COMM_WORLD) is None
    monkeypatch.delenv("OMP_NUM_THREADS")
    assert threads_a_rank() == 64


@alone
def test_threads_are_reported_in_the_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The log says how many ranks and threads there are."""
    with caplog.at_level("DEBUG", logger="gapbeam"):
        gapbeam.run(DEMO, ["time.end=5e-4", "load.shaker.ramp=0", "output.fields_interval=5e-4"], tmp_path / "out")
    assert f"ranks: 1, threads a rank: {threads_a_rank()}" in caplog.text
