"""Processes without a home, a cache or a folder, and words that are not UTF-8: put right or reported, never a trace."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.shared.command import DEMO, GAPBEAM, PROJECT, alone
from tests.shared.processes import LONGEST

pytestmark = [alone, pytest.mark.versions]


def found(**variables: str) -> list[object]:
    """Return home, cache and remarks of a process that was started with other variables."""
    plain = {name: value for name, value in os.environ.items() if name not in ("HOME", "XDG_CACHE_HOME")}
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.process_environment"],
        cwd=PROJECT,
        env=plain | variables,
        capture_output=True,
        text=True,
        check=True,
    )
    return list(json.loads(done.stdout))


def test_home_and_cache_of_users(tmp_path: Path) -> None:
    """What can be written stays; without HOME it is the user's own."""
    assert found(HOME=str(tmp_path)) == [str(tmp_path), None, []]
    home, cache, remarks = found(XDG_CACHE_HOME=str(tmp_path))
    assert (Path(str(home)).is_absolute(), cache, remarks) == (True, str(tmp_path), [])


def test_cache_that_cannot_be_written(tmp_path: Path) -> None:
    """Another one is taken and reported, the same for all ranks, but not one that others can write."""
    home, cache, remarks = found(HOME="/proc/nowhere", TMPDIR=str(tmp_path))
    assert (home, cache) == ("/proc/nowhere", str(tmp_path / f"gapbeam-{os.getuid()}"))
    assert "/proc/nowhere/.cache cannot be written" in str(remarks)
    assert found(HOME="/proc/nowhere", TMPDIR=str(tmp_path))[1] == cache
    Path(str(cache)).chmod(0o777)
    assert found(HOME="/proc/nowhere", TMPDIR=str(tmp_path))[1] is None


@pytest.mark.parametrize("words", [["check", b"\xff\xfe.toml"], ["check", DEMO, "--set", b"title=\xff"]])
def test_words_that_are_no_text(words: list[str | bytes]) -> None:
    """Names and values that are not UTF-8: status 2 and a message."""
    done = subprocess.run([*GAPBEAM, *words], cwd=PROJECT, capture_output=True, check=False)
    assert done.returncode == 2
    assert b"found:" in done.stderr
    assert b"Traceback" not in done.stderr


def test_folder_that_is_gone(tmp_path: Path) -> None:
    """Started in a folder that has been removed: status 2 and a message."""
    (tmp_path / "gone").mkdir()
    words = [sys.executable, "-m", "tests.programs.folder_that_goes", str(tmp_path / "gone"), "schema"]
    done = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "is gone" in done.stderr
    assert "Traceback" not in done.stderr


def test_limit_of_addresses(tmp_path: Path) -> None:
    """Where OpenBLAS would try for ever to get its buffer: status 7 and a message, at once."""
    words = [
        "sh",
        "-c",
        'ulimit -v 900000 && exec "$@"',
        "sh",
        *GAPBEAM,
        "run",
        str(DEMO),
        "--output",
        str(tmp_path / "x"),
    ]
    done = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True, check=False, timeout=LONGEST)
    assert (done.returncode, done.stdout) == (7, ""), done.stderr
    assert "this process may use 0.922 GB of addresses" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_versions() -> None:
    """The command and what its results depend on, one a line; nothing else."""
    done = subprocess.run([*GAPBEAM, "--version"], cwd=PROJECT, capture_output=True, text=True, check=False)
    message = dict(line.split(" ", 1) for line in done.stdout.splitlines())
    assert done.returncode == 0, done.stderr
    assert set(message) == {"gapbeam", "python", "dolfinx", "petsc4py", "numpy", "numba", "gmsh", "mpi"}
    assert message["gapbeam"] == version("gapbeam")
