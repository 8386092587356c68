"""Products whose bits do not depend on how many rows there are, or on where a row stands."""

from __future__ import annotations

import numpy as np
import pytest

import gapbeam
from gapbeam.solver.system.operators import row_product
from gapbeam.studies.trials.response import respond
from tests.shared.command import PROJECT

RANDOM = np.random.default_rng(7)


@pytest.mark.parametrize("columns", [1, 2, 3, 68, 129, 4900])
@pytest.mark.parametrize("size", [3, 12, 59, 68, 129])
def test_a_row_has_the_same_bits_in_any_company(size: int, columns: int) -> None:
    """At any place among one to seventy rows, with a matrix by rows and by columns."""
    matrix, row = RANDOM.standard_normal((size, columns)), RANDOM.standard_normal(size)
    for table in (matrix, np.asfortranarray(matrix)):
        alone = row_product(row[None], table)[0]
        assert np.allclose(alone, row @ matrix, rtol=1.0e-12, atol=1.0e-12)
        for count, place in ((2, 1), (7, 3), (8, 7), (9, 8), (13, 5), (64, 50), (64, 63), (70, 66)):
            rows = RANDOM.standard_normal((count, size))
            rows[place] = row
            assert np.array_equal(row_product(rows, table)[place], alone), (count, place)


def test_no_rows_give_none() -> None:
    assert row_product(np.zeros((0, 4)), np.zeros((4, 3))).shape == (0, 3)


def test_no_columns_give_none() -> None:
    assert row_product(np.zeros((9, 4)), np.zeros((4, 0))).shape == (9, 0)
    assert np.array_equal(row_product(np.zeros((9, 0)), np.zeros((0, 2))), np.zeros((9, 2)))


def test_a_seat_has_the_same_bits_after_a_march() -> None:
    """Nothing that a march asks of a model changes the order in which its gaps are summed."""
    changes = {
        "model": {"type": "beam", "elements": 8},
        "contact.points": [0.0, 0.05],
        "contact.stiffness": 2.2e6,
        "time.end": 0.05,
    }
    simulation = gapbeam.model(PROJECT / "cases" / "li2013-2d.toml", changes)
    before = simulation.seat().state.u
    model = simulation.model
    respond(model, simulation.start(simulation.seat()), 100, model.step)
    assert np.array_equal(simulation.seat().state.u, before)
