"""Points that are rotations, rad, with moments on them, N m: in files and in Python, also where modes are left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import mmwrite

import gapbeam as gb


def shaft(folder: Path) -> dict[str, Any]:
    """Return a file of two discs on a shaft, of which the last has a backlash, by its matrices in N m and kg m^2."""
    for name, matrix in (("k", [[300.0, -100.0], [-100.0, 100.0]]), ("m", [[2.0, 0.0], [0.0, 1.0]])):
        mmwrite(folder / f"{name}.mtx", np.array(matrix))
    files = {"stiffness": str(folder / "k.mtx"), "mass": str(folder / "m.mtx")}
    return {
        "structure": [{"name": "shaft", "model": {"type": "matrices", **files, "units": "m-kg-s"}}],
        "point": [{"name": "end", "structure": "shaft", "dof": "1", "rotation": True}],
        "pair": [
            {"name": "gap", "between": ["shaft.end"], "region": {"type": "slot", "clearance": 0.02},
             "law": {"type": "kelvin-voigt", "stiffness": 500.0, "damping": 1.0}},
        ],
        "load": [{"type": "harmonic_force", "point": "shaft.end", "amplitude": 5.0, "frequency": 1.0}],
        "time": {"step": 2e-3, "end": 4.0},
    }  # fmt: skip


@pytest.mark.parametrize("reduce", [None, {"modes": 1}])
def test_a_rotation_of_a_row_has_its_units(tmp_path: Path, reduce: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the point, of the contact on it, and of the errors of both; without the key they are m and N."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    tables = shaft(tmp_path)
    if reduce is not None:
        tables["structure"][0]["reduce"] = reduce
    for turns, moved, force in ((True, "rad", "N m"), (False, "m", "N")):
        tables["point"][0]["rotation"] = turns
        outcome = gb.run(tables, output=tmp_path / "run", overwrite=True)
        units = {one["name"]: one["unit"] for one in outcome.summary["errors"]["figures"]}
        assert units["end peak-to-peak displacement"] == moved
        assert {unit for name, unit in units.items() if name.startswith("gap ") and "force" in name} == {force}


def test_rotations_of_a_structure_from_python() -> None:
    """They stay with the point where modes, masses and reductions make other structures; other names are refused."""
    K, M = np.array([[300.0, -100.0], [-100.0, 100.0]]), np.diag([2.0, 1.0])
    whole = gb.Structure(M, K, points={"end": [0.0, 1.0], "foot": [1.0, 0.0]}, rotations=["end"], name="shaft")
    for one in (whole, whole.reduced(1), gb.reduced_at_points(whole, 1)):
        assert one["end"].turns
        assert not one["foot"].turns
    with pytest.raises(gb.UserError, match="rotations: found tip, expected some of its points: end"):
        gb.Structure(M, K, points={"end": [0.0, 1.0]}, rotations=["tip"])


def test_a_rotation_without_a_row_is_refused(tmp_path: Path) -> None:
    tables = shaft(tmp_path)
    tables["point"][0] = {"name": "end", "structure": "shaft", "node": 2, "direction": [0, 0, 1], "rotation": True}
    with pytest.raises(gb.CaseError, match=r"rotation\n.*a rotation without dof"):
        gb.scene(tables)
