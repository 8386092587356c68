"""Two ranks compute the same motion of a beam in several supports, with a joint, a mass and a fluid, as one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.postprocess.results.results import Results
from gapbeam.solver.schema.record_table import STRESS_FIELDS
from tests.parallel.test_ranks_agree import CLOSE, check_fields, disagreements
from tests.shared.command import CASE_FOLDER, DEMO, RATTLE, alone, on_ranks, settings

pytestmark = [alone, pytest.mark.versions]

TUBE, BLOCKS = CASE_FOLDER / "tube-holes.toml", CASE_FOLDER / "bar-vblocks.toml"
LEFT = '{name = "left", from = 0.0, to = 0.02, clearance = 1e-4}'
STOP = '{name = "stop", from = 0.25, to = 0.27, clearance = 5e-5, region = {type = "stop", side = "above"}}'
RIGHT = '{name = "right", from = 0.45, to = 0.48, clearance = 1e-4, offset = 2e-5, stiffness = 5e11, damping = 1e6}'
KEYS = (
    *RATTLE,
    f"support=[{LEFT}, {STOP}, {RIGHT}]",
    'joint=[{name = "pin", type = "pinned", point = 0.36}]',
    'mass=[{name = "head", point = 0.505, mass = 0.05, rotary_inertia = 1e-5}]',
    'fluid=[{name = "water", from = 0.1, to = 0.4, added_mass = 0.3, displaced_mass = 0.1, damping = 1.0}]',
    'probe=[{name = "tip", point = 0.505}, {name = "root", point = [0.2, 0.002], stress = true}]',
    "mesh.cell=triangle",
    "damping.ratios=[0.1, 0.1]",
    "contact.stiffness=2e12",
    "load.shaker.amplitude=400.0",
    "time.end=0.012",
    "output.fields_interval=4e-3",
    "output.stress=true",
)


def on_one_and_two(case: Path, keys: tuple[str, ...], folder: Path) -> list[Results]:
    """Run a case on one rank and on two; both have to pass."""
    assert gapbeam.run(case, keys, folder / "1").exit_status == 0
    done = on_ranks(2, "run", case, "--output", folder / "2", *settings(*keys))
    assert done.returncode == 0, done.stderr
    return [gapbeam.open_results(folder / name) for name in ("1", "2")]


def check_stress_fields(results: list[Results]) -> None:
    """Corners at which cells of two ranks meet have the stress that they have on one rank."""
    for name in STRESS_FIELDS:
        check_fields(results, CLOSE, name)


@pytest.mark.slow(minutes=0.3)
def test_three_supports_on_two_ranks(tmp_path: Path) -> None:
    """Every face of every support closes, and histories agree as those of base and gland do."""
    results = on_one_and_two(DEMO, KEYS, tmp_path)
    forces = results[0].history["contact_force"]
    assert forces["face"].values.tolist() == ["left_below", "left_above", "stop_above", "right_below", "right_above"]
    assert np.all(forces.values.max(axis=0) > 0.0)
    assert {name: apart for name, apart in disagreements(results).items() if not apart <= CLOSE} == {}
    check_stress_fields(results)


HOLES = (
    "model.type=full",
    "mesh.cells_through_thickness=2",
    "mesh.cells_across_width=2",
    "mesh.support_size=0.01",
    "mesh.size=0.05",
    "contact.stiffness=1e13",
    "load.shaker.amplitude=3000.0",
    "time.end=0.004",
    "output.fields_interval=1e-3",
    "output.errors=none",
    "output.stress=true",
)


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize(("case", "direction"), [(TUBE, "[0, 1, 0.3]"), (BLOCKS, "[0, 0.3, -1]")])
def test_a_round_beam_in_supports_around_it_on_two_ranks(case: Path, direction: str, tmp_path: Path) -> None:
    """Curved cells, mean motions of hollow sections, contact all around: the histories of a struck beam agree."""
    results = on_one_and_two(case, (*HOLES, f"load.shaker.direction={direction}"), tmp_path)
    assert "contact_resultant" in results[0].history
    forces = results[0].history["contact_force"].values
    assert np.all(forces.max(axis=0) > 3.0 * forces[0])
    assert {name: apart for name, apart in disagreements(results).items() if not apart <= CLOSE} == {}
    check_stress_fields(results)


RINGS = (
    *HOLES[1:5],
    "model.type=reduced",
    "model.sections=rigid",
    "model.modes=12",
    "contact.stiffness=3e14",
    "load.shaker.ramp=0.0",
    "time.end=0.0025",
    "output.errors=none",
)


@pytest.mark.slow(minutes=0.4)
def test_rigid_sections_on_two_ranks(tmp_path: Path) -> None:
    """The mean motions of the surface are sums over both ranks: a shaken tube moves alike, in a basis found anew.

    The bases agree as closely as searches for modes end, and stiff contact multiplies what is left.
    """
    results = on_one_and_two(TUBE, RINGS, tmp_path)
    assert results[0].history["contact_force"].values.max() > 5.0
    apart = disagreements(results)
    assert apart["displacement"] <= 1e-4
    assert apart["impulse"] <= 2e-3
    assert apart["contact_force"] <= 1e-2
    assert results[0].summary["model"]["basis"]["section_flexibility"] > 0.0
