"""The coherence of random loads along the beam, as generated: intervals that cover, and a wrong one that is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gapbeam.postprocess.report.blocks import TableBlock, Words
from gapbeam.postprocess.report.sections.contact_section import random_loads_section
from gapbeam.solver.loads.coherence_table import GaussianCoherence
from gapbeam.solver.loads.random_line_load import RandomLineLoad, bandwidth, compared_coherence

WHITE = {"type": "white", "density": 2.0, "low": 5.0, "high": 105.0}
FLOW = {"type": "turbulence", "velocity": 4.0, "length": 0.1, "scale": 10.0}


def load(seed: int, coherence: dict[str, Any], spectrum: dict[str, Any] = WHITE, **others: Any) -> RandomLineLoad:
    tables = {"type": "random-line-load", "span": (0.2, 1.2), "stations": 8, "seed": seed, "name": "lift", "ramp": 0.1}
    return RandomLineLoad.model_validate(tables | {"coherence": coherence, "spectrum": spectrum} | others)


def test_correlations_lie_in_their_intervals() -> None:
    """Most of those of 6 seeds."""
    found = [load(seed, {"type": "exponential", "length": 0.3}).generated(4.0)["coherence"] for seed in range(6)]
    inside = [one["low"] <= one["generated"] <= one["high"] for places in found for one in places["places"]]
    assert len(inside) == 42
    assert np.mean(inside) > 0.8
    assert [places["independent"] for places in found] == pytest.approx([800.0] * 6, rel=0.01)


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("kind", ["white", "turbulence", "profile"])
def test_intervals_of_the_coherence_cover(kind: str) -> None:
    """Over 200 seeds, 92 to 98 % of the correlations lie in their intervals.

    The factor of a coherence, and with it what a seed makes of it, depends on the processor.
    """
    profile = {"velocity_profile": {"places": [0.2, 0.7, 1.2], "values": [0.0, 1.0, 0.5]}} if kind == "profile" else {}
    spectrum = FLOW if kind == "turbulence" else WHITE
    coherence = {"type": "exponential", "length": 0.3}
    found = [load(seed, coherence, spectrum, **profile).generated(6.0)["coherence"]["places"] for seed in range(200)]
    assert {len(places) for places in found} <= {6, 7}, "a station where nothing flows says nothing"
    inside = np.mean([one["low"] <= one["generated"] <= one["high"] for places in found for one in places])
    assert 0.92 <= inside <= 0.98
    means = np.mean([[one["generated"] for one in places] for places in found], axis=0)
    assert means == pytest.approx([one["asked"] for one in found[0]], abs=0.02)


def test_smooth_coherences_are_those_of_the_curve() -> None:
    """Of stations that are close beside the coherence length, within 1 %."""
    found = load(1, {"type": "gaussian", "length": 0.8}).generated(6.0)["coherence"]
    assert found["from"] == pytest.approx(0.7, abs=0.1)
    assert [one["asked"] for one in found["places"]] == pytest.approx(
        [one["curve"] for one in found["places"]], abs=0.01
    )
    full = load(1, {"type": "full"}).generated(6.0)["coherence"]["places"]
    assert all(one["low"] <= one["generated"] <= one["high"] for one in full)
    assert full[0]["generated"] == pytest.approx(1.0, abs=1e-6)


def test_another_coherence_is_seen() -> None:
    """Forces of half the coherence length lie far outside."""
    wrong = load(1, {"type": "gaussian", "length": 0.15})
    signals = [wrong.at_full_amplitude()._signal(number) for number in range(1, len(wrong.patterns) + 1)]
    weights = np.array([pattern.weights for pattern in wrong.patterns])
    asked = GaussianCoherence(type="gaussian", length=0.3)
    found = compared_coherence(signals, weights, asked, wrong.span, None, 6.0)["places"]
    assert sum(one["low"] <= one["generated"] <= one["high"] for one in found) <= len(found) - 3


def test_bandwidths() -> None:
    """A flat band has its own width; a short run has no comparison."""
    signal = load(1, {"type": "full"}).signal
    assert bandwidth(signal.spectrum) == pytest.approx(100.0, rel=1e-6)
    assert load(1, {"type": "full"}).generated(0.1)["coherence"]["places"] == []


def test_the_report_compares_the_coherence() -> None:
    """A table of stations; words where the run was too short; the square of a force per length has its unit."""
    found = dict(load(1, {"type": "exponential", "length": 0.3}).generated(6.0))
    section = random_loads_section({"random_loads": [found]})
    assert section is not None
    spectrum, table = [block for block in section.blocks if isinstance(block, TableBlock)]
    assert "(N/m)²" in spectrum.caption
    assert len(table.rows) == 7
    assert {str(row[-1]) for row in table.rows} <= {"yes", "no"}
    short = random_loads_section({"random_loads": [found | {"coherence": {"places": []}}]})
    assert short is not None
    assert isinstance(short.blocks[-1], Words)
    assert "too short to compare the coherence" in short.blocks[-1].text
