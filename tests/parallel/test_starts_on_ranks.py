"""Two ranks start a solid where one does: centered, thrown, spinning and in a mode."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel.test_ranks_agree import CLOSE, disagreements
from tests.parallel.test_supports_on_ranks import on_one_and_two
from tests.shared.command import DEMO, alone

pytestmark = [alone, pytest.mark.versions]

KEYS = (
    "mesh.dimension=3",
    "mesh.cell=hexahedron",
    "mesh.size=0.05",
    "mesh.cells_through_thickness=2",
    "mesh.cells_across_width=2",
    "mesh.support_size=0.02",
    "model.type=full",
    "contact.stiffness=2e12",
    "analysis.start=centered",
    "analysis.motion.velocity=[0.01, 0.05, -0.1]",
    "analysis.motion.spin=[1.0, 0.0, 0.2]",
    'analysis.mode={number = 3, amplitude = 1e-5, probe = "tip", phase = 45.0}',
    "time.end=4e-3",
    "time.step=1e-4",
    "output.history_interval=1e-4",
    "output.fields_interval=2e-3",
)


@pytest.mark.slow(minutes=0.4)
def test_a_start_on_two_ranks(tmp_path: Path) -> None:
    """Histories agree, also in the first record, which is the start."""
    results = on_one_and_two(DEMO, KEYS, tmp_path)
    first = [run.history["displacement"].isel(time=0).values for run in results]
    assert np.any(first[0] != 0.0)
    np.testing.assert_allclose(*first, atol=1e-13)
    assert {name: apart for name, apart in disagreements(results).items() if not apart <= 10.0 * CLOSE} == {}
