"""What goes wrong on one rank ends all of them at once; what all ranks know is told once."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import pytest

from tests.case_texts import spoiled, written
from tests.command import DEMO, alone, on_ranks, programmed, settings

pytestmark = alone

BREAK = """
import sys
from mpi4py import MPI
import {module} as module

def broken(*arguments, **options):
    raise {error}("rank 1 has had enough")

if MPI.COMM_WORLD.rank == 1 or MPI.COMM_WORLD.size == 1:
    {place} = broken
from gapbeam.command_line import main
main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    ("module", "place", "error"),
    [
        ("solver.run", "module.find_seat", "RuntimeError"),
        ("solver.run", "module.build_model", "MemoryError"),
        ("solver.integrators.midpoint", "module.Midpoint.advance", "ZeroDivisionError"),
        ("solver.tally", "module.Tally.see", "SystemExit"),
    ],
    ids=["seat", "mesh", "step", "exit"],
)
def test_error_on_one_rank_ends_all(module: str, place: str, error: str, tmp_path: Path) -> None:
    """An error of rank 1 in mesh, seat or march: the job ends within seconds, not zero, with that rank's trace."""
    program = BREAK.format(module=module, place=place, error=error)
    started = time.perf_counter()
    done = on_ranks(2, "run", DEMO, "--output", tmp_path / "out", program=program, timeout=240.0)
    assert time.perf_counter() - started < 30.0
    assert done.returncode not in (0, 2, 3, 4)
    assert "gapbeam: rank 1 failed; ending all ranks" in done.stderr
    assert f"{error}: rank 1 has had enough" in done.stderr
    assert "Traceback" in done.stderr
    assert "in broken" in done.stderr
    assert "done:" not in done.stdout


def test_error_without_ranks_has_its_trace(tmp_path: Path) -> None:
    """The same error without mpirun: status 1 and the trace, and no word of ranks."""
    program = BREAK.format(module="solver.run", place="module.find_seat", error="RuntimeError")
    done = programmed(program, "run", DEMO, "--output", tmp_path / "out")
    assert done.returncode == 1
    assert "RuntimeError: rank 1 has had enough" in done.stderr
    assert "ending all ranks" not in done.stderr


def test_faulty_case_is_told_once(tmp_path: Path) -> None:
    """A faulty case on two ranks: exit status 2, one message, no trace, nothing written."""
    done = on_ranks(2, "run", DEMO, *settings("beam.length=-1"), "--output", tmp_path / "out", timeout=240.0)
    assert_told_once(done, "has a fault")
    assert not (tmp_path / "out").exists()


def test_faulty_mesh_is_told_once(tmp_path: Path) -> None:
    """A damaged mesh file on two ranks: exit status 2, one message, no trace, nothing written."""
    (tmp_path / "damaged.msh").write_bytes(b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1 1 1\n$EndNodes\n")
    case = written(tmp_path, spoiled("[mesh]\ndimension = 2\n", '[mesh]\nfile = "damaged.msh"\n'))
    done = on_ranks(2, "run", case, "--output", tmp_path / "out", timeout=240.0)
    assert_told_once(done, "damaged.msh")
    assert not (tmp_path / "out").exists()


def assert_told_once(done: subprocess.CompletedProcess[str], told: str) -> None:
    """Check that a fault of the input is one message on stderr."""
    assert done.returncode == 2
    assert done.stderr.count("gapbeam: ") == 1
    assert done.stderr.count(told) == 1
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_results_that_are_there_are_refused_once(tmp_path: Path) -> None:
    """A folder that holds results, on two ranks: status 2, told once, and the file is as it was."""
    (tmp_path / "history.h5").write_bytes(b"precious")
    done = on_ranks(2, "run", DEMO, "--output", tmp_path, timeout=240.0)
    assert done.returncode == 2
    assert done.stderr.count("already holds results") == 1
    assert "Traceback" not in done.stderr
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"history.h5": b"precious"}
