"""The cross-spectrum of two random loads, as generated: intervals that cover, and a wrong one that is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gapbeam.postprocess.report.blocks import TableBlock, Words
from gapbeam.postprocess.report.sections.contact_section import random_loads_section
from gapbeam.solver.loads.random_line_load import RandomLineLoad
from gapbeam.solver.loads.random_load import RandomLoad

WHITE = {"type": "white", "density": 2.0, "low": 5.0, "high": 105.0}
TABLE = {"type": "table", "frequencies": [5.0, 30.0, 105.0], "densities": [1.0, 8.0, 0.05]}
SHAPES: dict[str, dict[str, Any]] = {
    "independent": {"coherence": 0.0},
    "constant": {"coherence": 0.6, "phase": 90.0},
    "delayed": {"coherence": 0.8, "delay": 0.4},
    "rows": {"coherence": [0.95, 0.3], "phase": [0.0, 120.0], "frequencies": [20.0, 90.0]},
}


def pair(seed: int, cross: dict[str, Any], spectrum: dict[str, Any] = WHITE) -> tuple[RandomLoad, RandomLoad]:
    """Return a load, and one that names it."""
    tables = {"type": "random", "point": 0.4, "seed": seed, "ramp": 0.1}
    drag = RandomLoad.model_validate(tables | {"name": "drag", "spectrum": WHITE})
    lift = tables | {"name": "lift", "spectrum": spectrum, "cross_spectrum": {"load": "drag", **cross}}
    return drag, RandomLoad.model_validate(lift)


def bands(seed: int, cross: dict[str, Any], end: float, spectrum: dict[str, Any] = WHITE) -> list[dict[str, Any]]:
    """Return what a run of some seconds compares."""
    loads = pair(seed, cross, spectrum)
    found: list[dict[str, Any]] = loads[1].generated(end, loads)["cross_spectrum"]["bands"]
    return found


def inside(found: list[dict[str, Any]]) -> list[bool]:
    """Return which bands lie in their intervals."""
    return [one["low"] <= one["generated"] <= one["high"] for one in found]


@pytest.mark.parametrize("shape", SHAPES)
def test_coherences_lie_in_their_intervals(shape: str) -> None:
    """Over 40 seeds of 8 bands: 91 to 99 %; their mean is what was asked, and the phase is right to a degree."""
    found = [bands(seed, SHAPES[shape], 8.0) for seed in range(40)]
    assert {len(one) for one in found} == {8}
    assert 0.91 <= np.mean([inside(one) for one in found]) <= 0.99
    means = np.mean([[band["generated"] for band in one] for one in found], axis=0)
    asked = [band["asked"] for band in found[0]]
    assert means == pytest.approx(asked, abs=0.03)
    if min(asked) > 0.5:
        errors = np.mean([[band["phase_error"] for band in one] for one in found])
        assert errors == pytest.approx(0.0, abs=1.5)
    else:
        assert any(band["phase_error"] is None for one in found for band in one) == (min(asked) < 0.25)


def test_other_spectra_and_full_coherence() -> None:
    """A load with a steep spectrum of its own that is the other one filtered: coherence 1 to 1e-3 in every band."""
    found = bands(3, {"coherence": 1.0}, 20.0, TABLE)
    assert [band["asked"] for band in found] == pytest.approx([1.0] * 8)
    assert all(band["generated"] > 0.999 for band in found)
    assert all(inside(found))


@pytest.mark.parametrize("wrong", [{"coherence": 0.3, "phase": 90.0}, {"coherence": 0.6, "phase": 30.0}])
def test_another_cross_spectrum_is_seen(wrong: dict[str, Any]) -> None:
    """Half the coherence, and a phase that is 60 degrees off, lie outside in all bands but one at most."""
    drag, lift = pair(1, wrong)
    asked = pair(1, SHAPES["constant"])[1].cross_spectrum
    assert asked is not None
    claims = lift.model_copy(update={"cross_spectrum": asked})
    signal = lift.at_full_amplitude().signal

    class Other(RandomLoad):
        """Claims the one and generates the other."""

        @property
        def signal(self) -> Any:
            return signal

    loads = drag, Other.model_validate(claims.model_dump())
    found = loads[1].generated(40.0, loads)["cross_spectrum"]["bands"]
    assert len(found) == 8
    assert sum(inside(found)) <= 1
    if wrong["phase"] != 90.0:
        assert np.mean([band["phase_error"] for band in found]) == pytest.approx(-60.0, abs=5.0)


def test_the_report_compares_two_loads() -> None:
    """A table of bands; words where the run was too short; nothing of a load that names none."""
    loads = pair(1, SHAPES["constant"])
    assert "cross_spectrum" not in loads[0].generated(8.0, loads)
    found = dict(loads[1].generated(8.0, loads))
    section = random_loads_section({"random_loads": [found]})
    assert section is not None
    table = [block for block in section.blocks if isinstance(block, TableBlock)][-1]
    assert table.caption == "Coherence of `lift` and `drag`"
    assert len(table.rows) == 8
    assert {str(row[-1]) for row in table.rows} <= {"yes", "no"}
    short = dict(loads[1].generated(0.2, loads))
    assert short["cross_spectrum"]["bands"] == []
    section = random_loads_section({"random_loads": [short]})
    assert section is not None
    assert isinstance(section.blocks[-1], Words)
    assert "too short to compare the coherence of `lift` and `drag`" in section.blocks[-1].text


FLOW: dict[str, Any] = {"type": "random-line-load", "span": (0.2, 1.2), "stations": 8, "seed": 5, "ramp": 0.1}
ALONG: dict[str, Any] = FLOW | {"spectrum": WHITE, "coherence": {"type": "exponential", "length": 0.3}}


def drag_and_lift(**others: Any) -> tuple[RandomLineLoad, RandomLineLoad]:
    """Return two loads along the beam, of which the second one names the first."""
    cross = {"load": "drag", "coherence": 0.7, "phase": 30.0}
    lift = ALONG | {"name": "lift", "cross_spectrum": cross} | others
    return RandomLineLoad.model_validate(ALONG | {"name": "drag"}), RandomLineLoad.model_validate(lift)


def test_loads_along_the_beam_share_the_noise_of_each_pattern() -> None:
    """Forces at every station of both have the coherence asked for; those at two stations the product of both."""
    loads = drag_and_lift()
    assert all(inside(loads[1].generated(12.0, loads)["cross_spectrum"]["bands"]))
    times = np.arange(int(200.0 * 260.0)) / 260.0
    forces = []
    for load in loads:
        weights = np.array([pattern.weights for pattern in load.patterns])
        signals = [part.time_function().value(times) for part in load.at_full_amplitude().parts]
        forces.append(weights.T @ np.array(signals))
    drag, lift = forces
    alone = np.corrcoef(drag)[2]
    both = np.corrcoef(np.concatenate([drag, lift]))[2, len(drag) :]
    assert both == pytest.approx(0.7 * np.cos(np.radians(30.0)) * alone, abs=0.03)


def test_loads_along_the_beam_have_the_same_patterns() -> None:
    """A coherence, a span or a number of stations that differ are refused, each with its key."""
    loads = dict(enumerate(drag_and_lift(stations=6, coherence={"type": "exponential", "length": 0.2}), 1))
    found = list(loads[2].faults_among(("load", 2), loads))
    assert [fault.key[-1] for fault in found] == ["coherence", "stations"]
    assert not list(drag_and_lift()[1].faults_among(("load", 2), dict(enumerate(drag_and_lift(), 1))))
