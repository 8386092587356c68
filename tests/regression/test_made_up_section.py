"""A cross-section is added by one file and the choice of sections, and is there for mesh, models, checks and schema."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.sections import section_choice
from tests.shared.command import PROJECT, alone, process_environment

LENGTH, HIGH, WIDE, BAR = 0.6, 0.04, 0.03, 0.005  # m
YOUNG, POISSON, DENSITY, GRAVITY = 2.1e11, 0.3, 7919.0, 9.81
CASE = f"""\
title = "a cantilever with a cross as its section hangs down by its weight"
model = {{ type = "beam", elements = 12 }}

[beam]
length = {LENGTH}
thickness = {HIGH}
width = {WIDE}
section = {{ type = "cross", bar = {BAR} }}

[material]
young_modulus = {YOUNG}
poisson_ratio = {POISSON}
density = {DENSITY}

[[support]]
name = "far"
from = 0.54
to = 0.57
clearance = 9.0e-3

[[joint]]
name = "root"
type = "clamped"
point = 0.0

[restraint]
axial = 1.0e-6
lateral = 1.0e-6

[mesh]
dimension = 3
size = 0.06
support_size = 0.025
cells_through_thickness = 2
cells_across_width = 2

[[load]]
type = "gravity"
acceleration = {GRAVITY}

[[probe]]
name = "tip"
point = {LENGTH}

[output]
errors = "none"

[time]
end = 0.01
step = 1.0e-4
"""
IMPORT = "from gapbeam.solver.sections.polygon_section import PolygonSection\n"
# by hand: the upright bar, and the arms beside it
AREA = HIGH * BAR + (WIDE - BAR) * BAR
SECOND = BAR * HIGH**3 / 12.0 + 2.0 * (0.5 * (WIDE - BAR) * BAR**3) / 12.0
SHEARED = 13.0 / 15.3 * HIGH * BAR  # kappa A, m^2
SHEAR = YOUNG / (2.0 * (1.0 + POISSON))
WEIGHT = DENSITY * AREA * GRAVITY  # N/m


def listed() -> str:
    """Return the choice of sections with the made-up one: one line, and one more name in the union."""
    text = Path(section_choice.__file__).read_text(encoding="utf-8")
    text = text.replace(IMPORT, IMPORT + "from gapbeam.solver.sections.made_up_section import CrossSection\n", 1)
    return text.replace(" RoundSection | TubeSection", " RoundSection | TubeSection | CrossSection", 1)


@pytest.mark.slow(minutes=0.3)
@alone
def test_a_made_up_section_is_meshed_run_and_checked(tmp_path: Path) -> None:
    """Two files: beam elements and solid hang as deep as beam theory says, w L^4 / (8 E I) + w L^2 / (2 kappa G A)."""
    room = tmp_path / "overlay" / "gapbeam" / "solver" / "sections"
    room.mkdir(parents=True)
    shutil.copy(PROJECT / "tests" / "programs" / "made_up_section.py", room)
    (room / "section_choice.py").write_text(listed(), encoding="utf-8")
    assert len([path for path in (tmp_path / "overlay").rglob("*") if path.is_file()]) == 2
    case = tmp_path / "case.toml"
    case.write_text(CASE, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.use_made_up_section", tmp_path / "overlay", case, tmp_path],
        cwd=PROJECT,
        env=process_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    reported = json.loads(done.stdout.splitlines()[-1])
    assert "CrossSection" in reported["schema"]
    assert reported["mesh"] == pytest.approx([AREA, SECOND], rel=1e-12)
    assert reported["touched"] == pytest.approx([0.03 * BAR, 0.03 * BAR]), "the ends of the upright bar"
    beam, solid = (np.array(reported[name]["tip"]) for name in ("beam", "solid"))
    assert [reported[name]["status"] for name in ("beam", "solid")] == [0, 0]
    assert reported["beam"]["loop"] == reported["solid"]["loop"] == "compiled"
    bent, sheared = WEIGHT * LENGTH**4 / (8.0 * YOUNG * SECOND), WEIGHT * LENGTH**2 / (2.0 * SHEAR * SHEARED)
    assert beam == pytest.approx(-(bent + sheared), rel=1e-6), "the beam rests"
    assert solid == pytest.approx(-(bent + sheared), rel=0.01)
    for name in ("check", "on an arm"):
        assert reported[name][0] == 0, reported[name][1]
    for name, expected in {
        "thick": ("0.05 m", "less than 0.03 m", "the smaller one of thickness and width"),
        "misspelled": ("`bars`", "did you mean `bar`?"),
        "beside": ("not in the material", 'section "cross"'),
        "slice": ('2, with the section "cross"', "dimension = 3"),
    }.items():
        status, words = reported[name]
        assert status == 2, words
        assert all(word in words for word in expected), words
