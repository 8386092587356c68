"""Pictures of contacts that adhere: their pull is seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.postprocess.figures.motion_figures import draw_contact


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e3])
@pytest.mark.parametrize("law", ["glue", "press"])
def test_the_axis_of_forces_holds_the_largest_pull(scale: float, law: str, tmp_path: Path) -> None:
    body, w = gb.mass(scale, stiffness=100.0 * scale, damping=scale, name="body"), 9.0
    laws: dict[str, Any] = {
        "glue": gb.Adhesive(stiffness=1e4 * scale, pull=2.0 * scale, reach=2e-3),
        "press": gb.KelvinVoigt(stiffness=1e4 * scale),
    }
    stop = gb.Contact(body["at"], gb.HalfPlane(0.01), laws[law], name="stop")
    shaker = gb.Force(body["at"], lambda t: 2.2 * scale * np.sin(w * t))
    outcome = gb.run(
        gb.Scene(body, contacts=[stop], loads=[shaker]), step=1e-4, end=4.0, errors=False, output=tmp_path / "run"
    )
    force = outcome.history["contact_force"].values
    panel = draw_contact(outcome.history, None).axes[0]
    low, high = panel.get_ylim()
    shown = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in panel.get_lines()])
    assert low <= shown.min()
    assert high >= shown.max()
    assert (low < 0.0) == (force.min() < 0.0) == (law == "glue")
