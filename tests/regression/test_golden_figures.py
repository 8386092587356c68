"""Figures of short runs are those that were stored: no formula changes unnoticed, in either march."""

from __future__ import annotations

import json
from collections.abc import Iterable

import pytest

from tests.regression.golden_figures import RUNS, STORED, Figures, figures_of
from tests.shared.command import alone

ENERGY = ("_energy", "_dissipation", "_work")


def test_every_run_is_stored() -> None:
    """The file holds these runs and no others: one without stored figures would be compared with nothing."""
    assert list(_stored()) == list(RUNS)


@alone
@pytest.mark.parametrize("name", RUNS)
def test_figures_are_those_that_were_stored(name: str) -> None:
    """Histories, seat and size; a change that means to change them writes the file anew: see golden_figures.py."""
    expected, found = _stored()[name], figures_of(RUNS[name])
    assert found.keys() == expected.keys()
    energy = _largest(value for key, values in expected.items() if key.endswith(ENERGY) for value in values)
    apart = {}
    for key, values in expected.items():
        assert len(found[key]) == len(values), key
        scale = energy if key.endswith(ENERGY) else _largest(values)
        difference = _largest(a - b for a, b in zip(found[key], values, strict=True))
        if not difference <= RUNS[name].tolerance * scale:  # not a number neither
            apart[key] = difference / scale if scale else difference
    assert apart == {}, "relative differences from what was stored"


def _stored() -> dict[str, Figures]:
    stored: dict[str, Figures] = json.loads(STORED.read_text(encoding="utf-8"))
    return stored


def _largest(values: Iterable[float]) -> float:
    return max(map(abs, values), default=0.0)
