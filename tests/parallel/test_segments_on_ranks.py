"""Two ranks compute the same motion of a beam with a step and a part of another material as one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel.test_ranks_agree import CLOSE, disagreements
from tests.parallel.test_supports_on_ranks import on_one_and_two
from tests.shared.command import DEMO, RATTLE, alone

pytestmark = [alone, pytest.mark.versions]

KEYS = (
    *RATTLE,
    'segment=[{name = "hub", from = 0.1, to = 0.2, thickness = 0.018}, '
    '{name = "end", from = 0.4, to = 0.51, young_modulus = 7e10, density = 2700.0, yield_stress = 1e6}]',
    'probe=[{name = "tip", point = 0.51}, {name = "hub", point = [0.15, 0.009], stress = true}]',
    "model.type=full",
    "damping.ratios=[0.1, 0.1]",
    "contact.stiffness=2e12",
    "load.shaker.amplitude=400.0",
    "time.end=0.012",
    "output.fields_interval=4e-3",
)


@pytest.mark.slow(minutes=0.3)
def test_segments_on_two_ranks(tmp_path: Path) -> None:
    """Histories agree as those of a prismatic beam do; both report the same stress over the yield stress there."""
    results = on_one_and_two(DEMO, KEYS, tmp_path)
    assert np.all(results[0].history["contact_force"].values.max(axis=0) > 0.0)
    assert {name: apart for name, apart in disagreements(results).items() if not apart <= CLOSE} == {}
    yields = [next(one for one in run.summary["assumptions"] if "yield" in one["name"])["closest"] for run in results]
    assert yields[0] == pytest.approx(yields[1], rel=1e-6)
    assert yields[0] > 1.0
