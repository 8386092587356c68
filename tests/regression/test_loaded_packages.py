"""What a command does not need it does not load: large packages take longer to load than a mistake to find."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.shared.command import DEMO, PROJECT, programmed, settings

FIELDS = {"dolfinx", "gmsh", "mpi4py", "petsc4py"}
PICTURES = {"matplotlib", "plotly", "pyvista", "vtk"}
TABLES = {"pandas", "rich.console", "scipy.signal", "scipy.stats", "xarray"}
OF_OTHERS = {"numpy.f2py.crackfortran", "numpy.testing._private", "yaml.reader"}  # scipy and numba import them
OTHERS = {"gapbeam.solver.periodic.shooting", "gapbeam.studies.engine.workers", "multiprocessing", "scipy.optimize"}
MARCH = {"h5py", "numba", "scipy.linalg", "scipy.optimize", "scipy.sparse"}


@pytest.mark.parametrize(
    ("words", "status", "spared"),
    [
        pytest.param(("check", DEMO, *settings("support.claerance=1e-4")), 2, FIELDS | PICTURES | TABLES | MARCH),
        pytest.param(
            ("check", PROJECT / "cases/scenes/clip.toml", *settings("time.ned=1")), 2, FIELDS | PICTURES | TABLES
        ),
        pytest.param(
            ("run", DEMO, *settings("model.type=beam", "time.end=1e-3", "output.errors=none")),
            0,
            FIELDS | PICTURES | TABLES | OTHERS | OF_OTHERS,
        ),
    ],
    ids=["mistake", "mistake-in-structures", "beam"],
)
def test_what_is_not_needed_is_not_loaded(
    words: tuple[str | Path, ...], status: int, spared: set[str], tmp_path: Path
) -> None:
    """The command ends as it should, and its process has none of the packages."""
    chosen = ("--output", tmp_path / "out") if words[0] == "run" else ()
    done = programmed("tests.programs.loaded_modules", *words, *chosen)
    assert done.returncode == status, done.stderr
    loaded = set(json.loads(done.stdout.splitlines()[-1]))
    assert "numpy" in loaded
    assert not spared & loaded
