"""Runs with a chosen start: stopped and continued, swept, with errors by companions, and as the user types them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.studies.error_estimate.companion_marches import companion_motions
from gapbeam.studies.error_estimate.companions import COARSER, HALF_STEP, Companion
from gapbeam.studies.trials.starts import KeptBody, seated
from tests.shared.case_texts import assert_says
from tests.shared.command import alone, called
from tests.shared.interrupted import differing, run_in_parts

BLOCK = """
title = "a bar thrown in its hole"
beam = { length = 0.3, thickness = 0.01, width = 0.01, section = "round" }
material = { young_modulus = 2.1e11, poisson_ratio = 0.3, density = 7850.0 }
mesh = { dimension = 3, size = 0.05, support_size = 0.02, cells_through_thickness = 2 }
model = { type = "beam", elements = 12 }
contact = { stiffness = 1e11 }
load = [{ type = "gravity" }]
time = { end = 0.01, step = 2e-5 }
output = { fields_interval = 2e-3, checkpoint_interval = 0.0 }
[[support]]
name = "hole"
from = 0.1
to = 0.14
clearance = 1e-4
lateral = 2e-5
region = "hole"
[[probe]]
name = "tip"
point = 0.3
[analysis]
type = "transient"
start = "centered"
motion = { velocity = [0.0, 0.1, 0.02], spin = [0.0, 0.0, 0.3] }
mode = { number = 3, amplitude = 1e-5, probe = "tip", phase = 30.0 }
"""


@pytest.fixture
def block(tmp_path: Path) -> Path:
    """Return the case file."""
    path = tmp_path / "block.toml"
    path.write_text(BLOCK, encoding="utf-8")
    return path


@pytest.mark.slow(minutes=0.1)
@alone
def test_the_commands_that_a_user_types(block: Path) -> None:
    """`check` says how the run starts, `run` ends well, and a start within a wall ends with status 2."""
    checked = called("check", block)
    assert checked.returncode == 0, checked.stderr
    assert_says(
        " ".join(checked.stdout.split()),
        ["centered", "both ends of the axis moved by (0.02, 0) mm sideways", "velocity lateral", "bending mode 3"],
    )
    folder = block.with_name("run")
    ran = called("run", block, "--output", folder)
    assert ran.returncode == 0, ran.stderr
    log = (folder / "run.log").read_text(encoding="utf-8")
    assert "starts in bending mode 3" in log
    history = gapbeam.open_results(folder).history
    first = history["displacement"].sel(probe="tip").isel(time=0).values
    np.testing.assert_allclose(first, [0.0, 2e-5, 1e-5 * np.cos(np.radians(30.0))], rtol=1e-9, atol=1e-15)
    assert float(np.max(history["contact_force"].values)) > 0.0
    refused = called("run", block, "--output", folder / "no", "--set", "analysis.motion.displacement=[0.0,3e-4,0.0]")
    assert refused.returncode == 2
    assert_says(refused.stderr, ["[analysis.motion]", "into hole_hole", "expected a start between the faces"])


@pytest.mark.slow(minutes=0.1)
def test_a_run_that_stops_and_continues_has_the_same_bits(block: Path) -> None:
    """The start plays no part in what continues from a checkpoint."""
    whole = gapbeam.run(block, output=block.with_name("whole"))
    parts = run_in_parts(block, (), block.with_name("parts"), [1])
    assert whole.exit_status == parts.exit_status == 0
    assert differing(block.with_name("whole"), block.with_name("parts")) == []


@pytest.mark.slow(minutes=0.1)
def test_a_sweep_over_start_values(block: Path) -> None:
    """The responses pass, two of one point, and every one starts with its own vector, on one body."""
    keys = ["analysis.mode.amplitude=0.0", "load=[]", "analysis.motion.spin=0.0", "time.end=2e-3"]
    velocities = [[0.0, 0.1, 0.0], [0.0, 0.2, 0.05]]
    result = gapbeam.sweep(
        block, {"analysis.motion.velocity": velocities}, keys, output=block.with_name("sweep"), workers=1
    )
    assert result.exit_status == 0
    assert [len(point.branches) for point in result.points] == [2]
    kept, bodies = KeptBody(), list[object]()
    for velocity in velocities:
        model = kept.model(gapbeam.read_case(block, [*keys, f"analysis.motion.velocity={velocity}"]))
        found = seated(model)
        moved = model.probes["tip"].evaluate(found.state.v[0], model.system.operators)
        np.testing.assert_allclose(moved, velocity, atol=1e-12)
        assert found.word == "centered"
        bodies.append(model.body)
    assert bodies[0] is bodies[1]


def test_companions_start_from_the_same_pose(block: Path) -> None:
    """Half the step and a coarser mesh: the tip begins where it does in the run, with the same velocity."""
    case = gapbeam.read_case(block)
    companions = [
        Companion(HALF_STEP, {"time.step": 1e-5}),
        Companion(COARSER, {"mesh.support_size": 0.04, "model.elements": 6}),
    ]
    starts = [motion.motion for motion in companion_motions(case, companions, 2e-3, 2e-5)]
    assert len(starts) == 2
    for motion in starts:
        assert motion is not None
        first = dict(zip(motion.probes, motion.displacement[0], strict=True))
        assert first["tip"] == pytest.approx(1e-5 * np.cos(np.radians(30.0)), rel=1e-9)
        assert first["tip lateral"] == pytest.approx(2e-5, rel=1e-9)
