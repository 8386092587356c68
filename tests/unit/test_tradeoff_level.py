"""A level of a trade-off with another step keeps the records and fields of its case on whole steps."""

from __future__ import annotations

from typing import Any

import pytest

import gapbeam
from gapbeam.studies.tradeoff.run_tradeoff import whole_intervals
from tests.shared.command import DEMO


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, {}),
        ({"time.step": 5.0e-5}, {}),
        ({"time.step": 2.0e-4, "output.history_interval": None}, {"output.fields_interval": 2.4e-3}),
        ({"time.step": 2.0e-4}, {"output.history_interval": 2.0e-4, "output.fields_interval": 2.4e-3}),
    ],
)
def test_intervals_are_whole_numbers_of_the_steps_of_a_level(
    changes: dict[str, Any], expected: dict[str, float]
) -> None:
    """Fields every 2.5 ms do not fall on steps of 0.2 ms: `run --tolerance` refused the step that it had chosen."""
    case = gapbeam.read_case(DEMO, {"output.fields_interval": 2.5e-3, "output.history_interval": 1.0e-4})
    found = whole_intervals(case.output, changes)
    assert found == pytest.approx(expected)
    assert gapbeam.read_case(DEMO, {"output.fields_interval": 2.5e-3} | changes | found).time.step == changes.get(
        "time.step", case.time.step
    )
