"""Two ranks march a beam under the same noise, to the last bit, as one rank does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.parallel.test_ranks_agree import CLOSE, SHORT, disagreements
from tests.parallel.test_supports_on_ranks import on_one_and_two
from tests.shared.command import DEMO, alone

pytestmark = [alone, pytest.mark.versions]

WHITE = '{type = "white", density = 900.0, low = 20.0, high = 400.0}'
FORCE = f'{{type = "random", name = "shaker", point = 0.4, seed = 3, spectrum = {WHITE}}}'
FLOOR = (
    f'{{type = "random", name = "floor", quantity = "acceleration", seed = 3, spectrum = {WHITE}, '
    'cross_spectrum = {load = "shaker", coherence = 0.6, phase = 30.0, delay = 0.002}}'
)
FLOW = (
    f'{{type = "random-line-load", name = "flow", span = [0.1, 0.5], stations = 6, spectrum = {WHITE}, '
    'coherence = {type = "exponential", length = 0.1}}'
)
SWEEP = (
    '{type = "swept-sine", point = 0.4, amplitude = 20.0, start_frequency = 90.0, end_frequency = 30.0, duration = 0.1}'
)
KEYS = (
    *(key for key in SHORT if not key.startswith(("load.", "time.", "output."))),
    f'load=[{{type = "gravity"}}, {FORCE}, {FLOOR}, {FLOW}, {SWEEP}]',
    "mesh.size=0.05",
    "time.step=2e-4",
    "time.end=0.014",
    "output.history_interval=2e-4",
    "output.fields_interval=1e-2",
)


@pytest.mark.slow(minutes=0.3)
def test_noise_on_two_ranks(tmp_path: Path) -> None:
    """Histories and statistics agree to round-off, and what was generated to the last bit."""
    one, two = on_one_and_two(DEMO, KEYS, tmp_path)
    assert one.summary["random_loads"] == two.summary["random_loads"]
    figures, others = (run.summary["statistics"]["figures"] for run in (one, two))
    assert len(figures) > len(one.history["face"])
    for figure, other in zip(figures, others, strict=True):
        assert (figure["name"], figure["verdict"]) == (other["name"], other["verdict"])
        assert [figure[key] for key in ("value", "low", "high")] == pytest.approx(
            [other[key] for key in ("value", "low", "high")], rel=1e-6, abs=1e-12
        ), figure["name"]
    assert np.all(one.history["contact_force"].values.max(axis=0) > 0.0)
    assert {name: apart for name, apart in disagreements([one, two]).items() if not apart <= CLOSE} == {}
