"""The length of a step where its slope crosses zero, against SciPy's."""

import numpy as np
import pytest
from scipy.optimize import brentq

from gapbeam.solver.contact.solve.step_length import root_of_slope


@pytest.mark.parametrize("place", [1e-9, 0.1, 0.37, 0.9])
@pytest.mark.parametrize("stiffening", [0.0, 1.0, 1e6, 1e12])
def test_slopes_with_a_kink_have_the_root_of_scipy(place, stiffening):
    def slope(length):
        return (length - place) + stiffening * max(length - place, 0.0) ** 1.5 - 0.1 * place * (stiffening > 1.0)

    calls = []
    found = root_of_slope(lambda length: calls.append(length) or slope(length))
    np.testing.assert_allclose(found, brentq(slope, 0.0, 1.0, xtol=1e-15), atol=1.1e-12)
    assert len(calls) < 80


def test_contact_that_begins_within_a_step_takes_few_looks():
    calls = []
    found = root_of_slope(lambda length: calls.append(length) or length - 0.5 + 1e3 * max(length - 0.4, 0.0))
    np.testing.assert_allclose(found, (0.5 + 400.0) / 1001.0, rtol=1e-12)
    assert len(calls) < 25


def test_a_root_that_is_met_ends_the_search():
    calls = []
    assert root_of_slope(lambda length: calls.append(length) or length - 0.5) == 0.5
    assert len(calls) == 3


@pytest.mark.parametrize("value", [1.0, -1.0, np.nan])
def test_slopes_without_a_root_are_refused(value):
    with pytest.raises(ValueError, match="no root"):
        root_of_slope(lambda _: value)
