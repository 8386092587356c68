"""Laws, contact solve, schemes and both marches need neither DOLFINx nor PETSc nor MPI."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

PROJECT = Path(__file__).parents[2]


def test_both_marches_where_dolfinx_is_not_installed() -> None:
    """Every module of these rooms can be imported, and a body marches to the same end in contact by both marches."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.march_without_dolfinx"],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for module in (
        "contact.laws.contact_law",
        "contact.solve.contact_solve",
        "integrators.midpoint",
        "march.simulation",
    ):
        assert f"gapbeam.solver.{module}" in found["modules"]
    assert found["reason"] is None
    assert found["impulse"] > 0.0
    assert found["moved"] > 0.0
    assert found["apart"] < 1.0e-9 * found["moved"]
    assert max(found["residuals"]) < 1.0e-9
