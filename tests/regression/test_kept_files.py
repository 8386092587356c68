"""Reduced bodies and bases that an earlier process kept: the bits of what was found, for what it follows from alone."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.models import kept_files
from gapbeam.solver.models import model as models
from gapbeam.solver.models.model import Model
from gapbeam.solver.models.reduction import reduced_body
from tests.shared.command import DEMO, PROJECT, alone, on_ranks, programmed, settings

STABILITY, TUBE = PROJECT / "cases" / "stability.toml", PROJECT / "cases" / "tube-holes.toml"
REDUCED: dict[str, Any] = {"model": {"type": "reduced", "modes": 8}}
RIGID: dict[str, Any] = {"model": {"type": "reduced", "modes": 4, "sections": "rigid", "stations": 1}}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keep bases, however small, in a folder of their own; machine code and forms stay where they are."""
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    monkeypatch.setenv("NUMBA_CACHE_DIR", os.environ.get("NUMBA_CACHE_DIR") or str(usual / "gapbeam" / "compiled"))
    (usual / "fenics").mkdir(exist_ok=True)
    (tmp_path / "fenics").symlink_to(usual / "fenics")
    monkeypatch.delenv("GAPBEAM_KEEP")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(kept_files, "WORTH", 0.0)
    return tmp_path / "gapbeam" / "bases"


def model(case: Path, overrides: dict[str, Any]) -> Model:
    return gapbeam.model(case, overrides).model


def arrays(one: Model) -> list[Any]:
    """Return what marches of a model follow from, and what expands them."""
    operators, contact = one.system.operators, one.system.contact
    expanded = one.expand(np.eye(operators.size)[0])
    return [operators.mass, operators.stiffness, contact.gap_matrix.toarray(), *one.body.patterns, expanded]  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("case", "overrides"),
    [(STABILITY, REDUCED), pytest.param(TUBE, RIGID, marks=pytest.mark.slow(minutes=0.2))],
    ids=["slice", "tube"],
)
def test_a_body_or_basis_that_is_read_has_the_bits_of_the_one_that_was_found(
    case: Path, overrides: dict[str, Any], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A body is read without a mesh, a basis without a search for modes."""
    found = model(case, overrides)
    basis, body = sorted(folder.iterdir(), key=lambda one: one.stat().st_mtime_ns)

    def never(*_: Any) -> None:
        raise AssertionError("a mesh was made, or modes were searched for")

    for lacking, place, name in ((basis, models, "mesh_beam"), (body, reduced_body, "lowest_modes")):
        with monkeypatch.context() as patch:
            patch.setattr(place, name, never)
            lacking.rename(lacking.with_suffix(".aside"))
            read = model(case, overrides)
            lacking.with_suffix(".aside").rename(lacking)
        assert read.body.basis == found.body.basis
        assert all(np.array_equal(a, b) for a, b in zip(arrays(read), arrays(found), strict=True))


SAME = {
    "clearance": {"support.clearance": 0.3e-3},
    "law": {"contact.stiffness": 1e12, "contact.damping": 1e3},
    "damping": {"damping.ratios": [0.02, 0.05]},
    "amplitude": {"load.shaker.amplitude": 10.0, "load.shaker.frequency": 33.0},
    "time": {"time.end": 0.01},
}
OTHER = {
    "modulus": {"material.young_modulus": 2.2e11},
    "density": {"material.density": 7900.0},
    "place of a load": {"load.shaker.point": 0.2},
    "mesh": {"mesh.cells_through_thickness": 3},
    "support": {"support.length": 0.06},
    "modes": {"model.modes": 9},
    "interface": {"model.interface": "fixed"},
    "shapes": {"model.shapes": 7},
    "restraint": {"restraint.axial": 2.0e3},
    "solver": {"solver.effective": "iterative"},
}


@pytest.mark.parametrize("name", [*SAME, *OTHER])
def test_what_a_basis_follows_from_names_it(name: str, folder: Path) -> None:
    """No new files for what is cheap to change, a new body for other gaps, a basis as well for all else.

    The model is the one of an empty folder.
    """
    model(STABILITY, REDUCED)
    changed = REDUCED | (SAME.get(name) or OTHER[name])
    mine = arrays(model(STABILITY, changed))
    assert len(list(folder.iterdir())) == (3 if name == "clearance" else 2 if name in SAME else 4)
    for file in folder.iterdir():
        file.unlink()
    assert all(np.array_equal(a, b) for a, b in zip(mine, arrays(model(STABILITY, changed)), strict=True))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_damaged_file_is_found_anew(share: float, folder: Path) -> None:
    found = arrays(model(STABILITY, REDUCED))
    whole = {file: file.read_bytes() for file in folder.iterdir()}
    for file, content in whole.items():
        file.write_bytes(content[: int(share * len(content))])
    assert all(np.array_equal(a, b) for a, b in zip(found, arrays(model(STABILITY, REDUCED)), strict=True))
    assert {file: file.stat().st_size for file in folder.iterdir()} == {file: len(whole[file]) for file in whole}


def test_the_bases_that_were_used_longest_ago_make_room(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model(STABILITY, REDUCED)
    first = set(folder.iterdir())
    free = kept_files.shutil.disk_usage(folder).free
    monkeypatch.setattr(kept_files, "SHARE", 1.2 * sum(one.stat().st_size for one in first) / free)
    model(STABILITY, REDUCED | {"model.modes": 7})
    second = set(folder.iterdir())
    assert len(second) == 2
    assert not first & second
    monkeypatch.setattr(kept_files, "SHARE", 0.0)
    model(STABILITY, REDUCED | {"model.modes": 6})
    assert set(folder.iterdir()) == second


def test_nothing_is_kept_where_that_was_asked_for(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAPBEAM_KEEP", "none")
    model(STABILITY, REDUCED)
    assert not folder.exists()


def test_a_folder_that_cannot_be_made_is_done_without(folder: Path) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.write_text("a file is in the way")
    assert model(STABILITY, REDUCED).body.basis is not None


@alone
@pytest.mark.slow(minutes=0.5)
def test_ranks_keep_and_read_their_parts(folder: Path, tmp_path: Path) -> None:
    """Two ranks write a file each, the second job reads both, and histories are equal to the last bit."""
    words = settings("time.end=0.004", "model.type=reduced")
    said = []
    for name in ("first", "second"):
        done = on_ranks(2, "run", STABILITY, *words, "--output", tmp_path / name)
        assert done.returncode == 0, done.stderr
        said.append((tmp_path / name / "run.log").read_text("utf-8"))
    assert len(list(folder.iterdir())) == 2
    assert "kept by an earlier run" not in said[0]
    assert "kept by an earlier run" in said[1]
    first, second = (gapbeam.open_results(tmp_path / name).history for name in ("first", "second"))
    assert np.array_equal(first["displacement"].to_numpy(), second["displacement"].to_numpy())


@alone
@pytest.mark.slow(minutes=0.3)
def test_a_later_run_loads_no_library_for_meshes(tmp_path: Path) -> None:
    """Nor one for tables, with its error estimate: whose companions are kept as well."""
    words = ("run", DEMO, *settings("model.type=reduced", "time.end=0.05", "output.errors=companions"))
    done = [programmed("tests.programs.loaded_modules", *words, "--output", tmp_path / name) for name in "ab"]
    assert [one.returncode for one in done] == [0, 0], done[1].stderr
    first, second = (set(json.loads(one.stdout.splitlines()[-1])) for one in done)
    assert {"dolfinx", "petsc4py"} <= first
    spared = {"dolfinx", "petsc4py", "mpi4py", "gmsh", "xarray", "pandas", "rich.console", "scipy.optimize"}
    assert not (spared | {"numpy.f2py.crackfortran", "numpy.testing._private", "yaml.reader"}) & second
