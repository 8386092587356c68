"""The command line in processes of its own, alone and under mpirun, and a rattling beam that is quick to run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from mpi4py import MPI

PROJECT = Path(__file__).parents[1]
DEMO = PROJECT / "cases" / "demo.toml"
GAPBEAM = (sys.executable, "-m", "gapbeam")
MAIN = "import sys; from gapbeam.command_line import main; main(sys.argv[1:])"

SEVERAL = """
import contextlib, io, json, sys, traceback
from gapbeam.command_line import main

told = []
for arguments in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments)
        except SystemExit as leaving:
            status = leaving.code
        except BaseException:
            traceback.print_exc()
            status = 1
    told.append((status, out.getvalue(), err.getvalue()))
print(json.dumps(told))
"""

# A process of its own does not start ranks of MPI beside those that run the tests.
alone = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="starts processes of its own")

# Shaken hard enough to leave and strike both faces at once.
RATTLE = ("load.shaker.amplitude=500.0", "load.shaker.frequency=100.0", "load.shaker.ramp=0.0")


def settings(*overrides: str) -> list[str]:
    """Return overrides as options of the command line."""
    return [word for override in overrides for word in ("--set", override)]


def called(*arguments: str | Path, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Call the command line and return what it said."""
    return _done([*GAPBEAM, *map(str, arguments)], timeout)


def programmed(program: str, *arguments: str | Path, timeout: float = 600.0) -> subprocess.CompletedProcess[str]:
    """Run a Python program, which may change something before it calls the command line."""
    return _done([sys.executable, "-c", program, *map(str, arguments)], timeout)


def called_in_turn(*calls: Sequence[str | Path], timeout: float = 600.0) -> list[subprocess.CompletedProcess[str]]:
    """Call the command line several times in one process, which saves the imports."""
    words = [list(map(str, arguments)) for arguments in calls]
    done = programmed(SEVERAL, json.dumps(words), timeout=timeout)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    return [subprocess.CompletedProcess(arguments, *one) for arguments, one in zip(words, told, strict=True)]


def on_ranks(
    count: int, *arguments: str | Path, program: str = MAIN, timeout: float = 600.0
) -> subprocess.CompletedProcess[str]:
    """Run a Python program, by default the command line, on several ranks."""
    return _done([*ranks(count), sys.executable, "-c", program, *map(str, arguments)], timeout)


def ranks(count: int) -> list[str]:
    """Return the words that start a command on several ranks."""
    return ["mpirun", "--oversubscribe", "-n", str(count)]


def surroundings() -> dict[str, str]:
    """Return the variables of a process: ranks as root and on few cores, plain text however wide."""
    return {
        **os.environ,
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_mpi_yield_when_idle": "1",
        "COLUMNS": "200",
        "NO_COLOR": "1",
    }


def _done(command: list[str], timeout: float) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=PROJECT, env=surroundings(), capture_output=True, text=True, timeout=timeout, check=False
    )
