"""The command line in processes of its own, alone and under mpirun, and a rattling beam that is quick to run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import pytest
from mpi4py import MPI

from gapbeam.command_line import main
from tests.shared.processes import LONGEST, beside, ended

PROJECT = Path(__file__).parents[2]
CASE_FOLDER = PROJECT / "cases"
DEMO = PROJECT / "tests" / "shared" / "demo.toml"
"""A beam that rattles, which no change of the demo changes."""
GAPBEAM = (sys.executable, "-m", "gapbeam")
FORKED = ("run", "check", "modes", "compare", "schema", "life")
"""Commands that start no processes of their own and draw nothing in three dimensions."""
SEVERAL = "tests.programs.several_calls"

# mpirun names a folder there after its number, and refuses one that a killed mpirun of that number has left.
SESSIONS = tempfile.TemporaryDirectory(prefix="ranks-")

# A process of its own does not start ranks of MPI beside those that run the tests.
alone = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="starts processes of its own")

# Shaken hard enough to leave and strike both faces at once.
RATTLE = ("load.shaker.amplitude=500.0", "load.shaker.frequency=100.0", "load.shaker.ramp=0.0")


def settings(*overrides: str) -> list[str]:
    """Return overrides as options of the command line."""
    return [word for override in overrides for word in ("--set", override)]


def called(*arguments: str | Path, timeout: float = LONGEST) -> subprocess.CompletedProcess[str]:
    """Call the command line and return what it said; in a fork of this process where that is enough."""
    if arguments and arguments[0] in FORKED:
        return _forked(list(map(str, arguments)), timeout)
    return called_anew(*arguments, timeout=timeout)


def called_anew(*arguments: str | Path, timeout: float = LONGEST) -> subprocess.CompletedProcess[str]:
    """Call the command line in a process of its own, as a user does, and return what it said."""
    return _done([*GAPBEAM, *map(str, arguments)], timeout)


def programmed(program: str, *arguments: str | Path, timeout: float = LONGEST) -> subprocess.CompletedProcess[str]:
    """Run a module, which may change something before it calls the command line."""
    return _done([sys.executable, "-m", program, *map(str, arguments)], timeout)


def called_in_turn(*calls: Sequence[str | Path], timeout: float = LONGEST) -> list[subprocess.CompletedProcess[str]]:
    """Call the command line several times, in forks of this process or all in one other, which saves the imports."""
    if all(arguments[0] in FORKED for arguments in calls):
        return [called(*arguments, timeout=timeout) for arguments in calls]
    words = [list(map(str, arguments)) for arguments in calls]
    done = programmed(SEVERAL, json.dumps(words), timeout=timeout)
    assert done.returncode == 0, done.stderr
    message = json.loads(done.stdout)
    return [subprocess.CompletedProcess(arguments, *one) for arguments, one in zip(words, message, strict=True)]


def on_ranks(
    count: int, *arguments: str | Path, program: str = "gapbeam", timeout: float = LONGEST
) -> subprocess.CompletedProcess[str]:
    """Run a module, by default the command line, on several ranks."""
    return _done([*ranks(count), sys.executable, "-m", program, *map(str, arguments)], timeout)


def on_ranks_in_turn(
    count: int, *calls: Sequence[str | Path], timeout: float = LONGEST
) -> list[subprocess.CompletedProcess[str]]:
    """Call the command line several times on the same ranks, which saves the imports; reports what rank 0 said."""
    words = [list(map(str, arguments)) for arguments in calls]
    done = on_ranks(count, json.dumps(words), program=SEVERAL, timeout=timeout)
    assert done.returncode == 0, done.stderr
    message = json.loads(done.stdout)
    return [subprocess.CompletedProcess(arguments, *one) for arguments, one in zip(words, message, strict=True)]


def ranks(count: int) -> list[str]:
    """Return the words that start a command on several ranks."""
    options = ["--oversubscribe"] if "Open MPI" in MPI.Get_library_version() else []
    return ["mpirun", *options, "-n", str(count)]


def process_environment() -> dict[str, str]:
    """Return the variables of a process: ranks as root and on few cores, plain text however wide."""
    return {
        **os.environ,
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "TMPDIR": SESSIONS.name,
        "COLUMNS": "200",
        "NO_COLOR": "1",
    }


def _forked(arguments: list[str], timeout: float) -> subprocess.CompletedProcess[str]:
    with tempfile.TemporaryDirectory() as folder:
        out, err = Path(folder) / "out", Path(folder) / "err"

        def work() -> int:
            os.environ.update(process_environment())
            os.chdir(PROJECT)
            with out.open("w", encoding="utf-8") as said:
                os.dup2(said.fileno(), 1)
                sys.stdout = said
                try:
                    main(arguments)
                except SystemExit as leaving:
                    return int(leaving.code or 0)

        status = ended(beside(work, err), timeout)
        return subprocess.CompletedProcess(arguments, status, out.read_text("utf-8"), err.read_text("utf-8"))


def _done(command: list[str], timeout: float) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=PROJECT, env=process_environment(), capture_output=True, text=True, timeout=timeout, check=False
    )
