"""Rows of whole lanes: their lengths, products with them, and that coordinates which never move change nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.march.compiled import kernel_tables as lanes
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.march.compiled.ledger_kernel import IMPULSE
from gapbeam.solver.march.compiled.point_motions import set_products
from gapbeam.solver.march.stepwise_march import begun

CASE = Path(__file__).parents[2] / "cases" / "random-vibration.toml"


@pytest.mark.parametrize(("size", "expected"), [(6, 6), (13, 13), (14, 16), (59, 64), (64, 64), (67, 80), (206, 208)])
def test_rows_end_with_a_lane_where_that_is_little_more(size: int, expected: int) -> None:
    """A multiple of 16 that is at most a fifth more."""
    assert lanes.lanes_for(size) == expected
    rows = np.ones((3, size))
    wide = lanes.widened(rows)
    assert wide.shape == (3, expected)
    assert np.array_equal(wide[:, :size], rows)
    assert not wide[:, size:].any()


@pytest.mark.parametrize("rows", [0, 1, 3, 4, 9, 33])
@pytest.mark.parametrize("size", [1, 6, 59, 64])
def test_products_of_rows(rows: int, size: int) -> None:
    """As numpy has them, whatever is left of four rows."""
    draw = np.random.default_rng(rows + size)
    matrix, x, found = draw.standard_normal((rows, size)), draw.standard_normal(size), np.full(rows, np.nan)
    set_products(matrix, x, found)
    assert found == pytest.approx(matrix @ x, rel=1e-12, abs=1e-13)


def test_coordinates_that_never_move_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A beam that rattles for 300 steps, 28 unknowns in rows of 28 and of 32: places to 1e-9 of the largest."""
    keys = ("model.elements=13", "time.step=2e-4", "time.end=0.06", "output.errors=none")
    simulation = gapbeam.model(gapbeam.read_case(CASE, keys))
    start, found = begun(simulation.plan, simulation.seat().state), []
    for lane in (1, 16):
        monkeypatch.setattr(lanes, "LANES", lane)
        *_, last = CompiledLoop(simulation.plan).blocks(start)
        assert last.records.over_time[-1, IMPULSE].max() > 0.0
        found.append(last.end)
    one, other = found
    assert lanes.lanes_for(len(one.u[0])) > len(one.u[0])
    assert np.abs(other.u[0] - one.u[0]).max() < 1e-9 * np.abs(one.u[0]).max()
