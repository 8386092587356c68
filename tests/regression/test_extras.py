"""An installation without extras runs structures, and says which extra anything else needs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import gapbeam as gb
from tests.shared.command import PROJECT

CLIP = PROJECT / "cases" / "scenes" / "clip.toml"
BRIEF = "time.end=0.02"


def bare(*words: str | Path, extra: str = "none") -> subprocess.CompletedProcess[str]:
    """Return what a command says where the packages of one extra are installed, by default of none."""
    command = [sys.executable, "-m", "tests.programs.without_extras", extra, *map(str, words)]
    environment = os.environ | {"GAPBEAM_ERRORS": "none"}
    return subprocess.run(
        command, cwd=PROJECT, env=environment, capture_output=True, text=True, timeout=300, check=False
    )


@pytest.mark.slow(minutes=0.1)
def test_structures_need_no_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file with [[structure]] runs; its records have the bits of the whole environment."""
    done = bare("run", CLIP, "--set", BRIEF, "--output", tmp_path / "bare")
    assert done.returncode == 0, done.stderr
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    gb.run(CLIP, [BRIEF], tmp_path / "whole")
    found, expected = (gb.open_results(tmp_path / name).history for name in ("bare", "whole"))
    assert set(found) == set(expected)
    assert len(found["time"]) > 1
    assert all((found[name] == expected[name]).all() for name in expected)


@pytest.mark.parametrize("model", ["beam", pytest.param("rigid", marks=pytest.mark.slow(minutes=0.1))])
def test_beams_and_rigid_bodies_need_no_extra(model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Such a case runs; its records and fields have the bits of the whole environment."""
    chosen = [f'model={{type="{model}"}}', BRIEF]
    options = [word for one in chosen for word in ("--set", one)]
    done = bare("run", "cases/demo.toml", *options, "--output", tmp_path / "bare")
    assert done.returncode == 0, done.stderr
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    gb.run(PROJECT / "cases" / "demo.toml", chosen, tmp_path / "whole")
    found, expected = (gb.open_results(tmp_path / name) for name in ("bare", "whole"))
    assert len(found.history["time"]) > 1
    assert all((found.history[name] == expected.history[name]).all() for name in expected.history)
    fields = [h5py.File(tmp_path / name / "fields.h5")["displacement"] for name in ("bare", "whole")]
    assert all(np.array_equal(fields[0][number], fields[1][number]) for number in fields[1])


@pytest.mark.slow(minutes=0.2)
@pytest.mark.parametrize(
    ("words", "extra"),
    [
        (
            ("sweep", "cases/demo.toml", "load.shaker.amplitude=15,17", "--workers", "1", "--output", "{out}"),
            "analysis",
        ),
        (("check", "cases/demo.toml"), "none"),
        (("view", "cases/demo.toml", "--output", "{out}/view.png"), "analysis"),
        (("modes", "cases/demo.toml", "--output", "{out}"), "analysis"),
    ],
)
def test_commands_on_beams_need_one_extra_at_most(words: tuple[str, ...], extra: str, tmp_path: Path) -> None:
    chosen = ("--set", 'model={type="beam"}', "--set", BRIEF)
    done = bare(*(word.format(out=tmp_path) for word in words), *chosen, extra=extra)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("words", "package", "extra"),
    [
        (("check", "cases/demo.toml"), "(dolfinx|mpi4py)", "fem"),
        (("run", "cases/demo.toml", "--output", "{out}"), "(dolfinx|mpi4py)", "fem"),
        (("plot", "{run}"), "xarray", "analysis"),
        (("report", "{run}"), "plotly", "pictures"),
    ],
)
def test_the_extra_that_a_command_needs_is_named(
    words: tuple[str, ...], package: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line, status 2, and the command that installs it."""
    run = tmp_path / "run"
    monkeypatch.setenv("GAPBEAM_ERRORS", "none")
    if "{run}" in words:
        gb.run(CLIP, [BRIEF], run)
    installed = "analysis" if extra == "pictures" else "none"
    done = bare(*(word.format(run=run, out=tmp_path / "out") for word in words), extra=installed)
    assert done.returncode == 2
    assert re.search(f"{package} is not installed", done.stderr)
    assert f"pip install 'gapbeam[{extra}]'" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_other_importers_find_nothing_as_before() -> None:
    """The advice is for gapbeam alone: `find_spec` of other code returns None, and their import fails plainly."""
    program = (
        "import sys, importlib.util, gapbeam\n"
        "from importlib.machinery import PathFinder\n"
        "sys.meta_path.remove(PathFinder)\n"
        "assert importlib.util.find_spec('plotly') is None\n"
        "try:\n    import plotly\n"
        "except ImportError as error:\n    assert type(error) is ModuleNotFoundError, type(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
