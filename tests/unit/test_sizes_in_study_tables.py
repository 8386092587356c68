"""Tables of atlases and of figures of one's own: readable numbers with units at any size, from MEMS to bridges."""

from __future__ import annotations

from typing import Any

import pytest

from gapbeam.postprocess.display_units import POWERS
from gapbeam.postprocess.report.sections.atlas_section import shown_responses
from gapbeam.postprocess.report.sections.verdict_section import own_table

POWERS_OF_TEN = (-8, -6, -3, 0, 2)


def si_of(text: str, unit: str) -> float:
    """Return the factor to SI of a unit with a prefix."""
    assert text.endswith(unit)
    return 1.0 / POWERS[text.removesuffix(unit)]


def record(size: float) -> dict[str, Any]:
    """Return a point of an atlas whose lengths and forces are of one size."""
    response = {
        "order": 1, "starts": 4, "share": 1.0, "interval": [0.5, 1.0], "largest_multiplier": 0.6, "peak": {"at": size},
        "impacts": {"stop": 1.0}, "peak_force": {"stop": 3.0 * size}, "period": None, "figures": {"knock": 2.0 * size},
        "frequencies": [],
    }  # fmt: skip
    return {
        "values": {"drive.frequency": 2.0e5, "stop.clearance": 0.5 * size}, "responses": [response], "chaotic": 0.0,
        "exponent": None, "unsettled": 0.0, "failed": 0.0, "turning": [],
        "units": {"drive.frequency": "Hz", "stop.clearance": "m", "knock": "N"},
    }  # fmt: skip


@pytest.mark.parametrize("power", POWERS_OF_TEN)
def test_columns_of_an_atlas_have_the_unit_of_their_size(power: int) -> None:
    """Keys, forces, peaks and figures: the number times its unit is the value, and takes at most six places."""
    size = 10.0**power
    heads, [row] = shown_responses([record(size)])
    cells = dict(zip(heads, row, strict=True))
    assert cells["drive.frequency (Hz)"] == 2.0e5
    for name, unit, value in (
        ("stop.clearance", "m", 0.5), ("force", "N", 3.0), ("at: peak", "m", 1.0), ("knock", "N", 2.0),
    ):  # fmt: skip
        [head] = [one for one in heads if one.startswith(f"{name} (")]
        assert cells[head] * si_of(head[len(name) + 2 : -1], unit) == pytest.approx(value * size, rel=1e-12)
        assert 1e-3 < cells[head] < 1e5


def test_an_atlas_of_former_versions_is_read() -> None:
    """Its records have no units of keys."""
    former = {key: value for key, value in record(1.0).items() if key != "units"}
    assert shown_responses([former])[0][0] == "drive.frequency"


@pytest.mark.parametrize("power", POWERS_OF_TEN)
def test_figures_of_ones_own_have_the_unit_of_their_size(power: int) -> None:
    """A force with an error, a length with an interval, a share without a unit."""
    size = 10.0**power
    summary = {
        "figures": {
            "knock": {"name": "knock", "unit": "N", "value": 3.0 * size},
            "reach": {"name": "reach", "unit": "m", "value": 0.5 * size},
            "late": {"name": "late", "unit": "1", "value": 0.25},
        },
        "errors": {"figures": [{"name": "knock", "error": 0.5 * size}]},
        "statistics": {"figures": [{"name": "reach", "low": 0.25 * size, "high": size}]},
    }
    table = own_table(summary)
    assert table is not None
    (_, force, newton, error), (_, length, meter, ends), (_, share, none, _) = table.rows
    assert force * si_of(newton, "N") == pytest.approx(3.0 * size)
    assert float(error.removeprefix("± ").replace(" ", "")) * si_of(newton, "N") == pytest.approx(0.5 * size)
    low, high = ends.removesuffix(" (95 %)").split(" to ")
    assert float(low.replace("\u202f", "")) * si_of(meter, "m") == pytest.approx(0.25 * size)
    assert float(high.replace("\u202f", "")) * si_of(meter, "m") == pytest.approx(size)
    assert length * si_of(meter, "m") == pytest.approx(0.5 * size)
    assert (share, none) == (0.25, "")
