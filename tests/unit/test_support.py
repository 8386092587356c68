"""The support: gaps, sides, area and stiffness of its faces, against hand calculations."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.supports.support import BASE_AND_GLAND, Face, Support

BASE, GLAND = BASE_AND_GLAND
HEIGHTS = np.array([0.0, 2.0e-6, 5.0e-6])


def test_gaps_of_base_and_gland() -> None:
    """The base touches the lowest point, the gland stands the clearance above the highest one."""
    assert BASE.gaps(HEIGHTS, 1.0e-4) == pytest.approx(HEIGHTS, rel=1e-12)
    assert GLAND.gaps(HEIGHTS, 1.0e-4) == pytest.approx([1.05e-4, 1.03e-4, 1.0e-4], rel=1e-12)


def test_an_interference_fit_presses_the_gland_into_the_beam() -> None:
    """A negative clearance gives negative gaps at the gland and none at the base."""
    assert GLAND.gaps(np.zeros(2), -6.0e-6) == pytest.approx([-6.0e-6, -6.0e-6])
    assert BASE.gaps(np.zeros(2), -6.0e-6) == pytest.approx([0.0, 0.0])


def test_clearance_is_shared_out_as_the_faces_say() -> None:
    """Two faces that share the clearance both move when the support opens; the sum is the total play."""
    centered = Support((Face("low", 1.0, 0.5), Face("high", -1.0, 0.5)), area=2.0e-3, clearance=1.0e-4)
    opened, growth = centered.opened_to(3.0e-4)
    assert opened.clearance == 3.0e-4
    assert growth == pytest.approx([1.0e-4, 1.0e-4])
    gaps = [face.gaps(np.zeros(1), 3.0e-4)[0] for face in opened.faces]
    assert sum(gaps) == pytest.approx(3.0e-4)
    assert Support(BASE_AND_GLAND, 1.0, 1.0e-4).opened_to(3.0e-4)[1] == pytest.approx([0.0, 2.0e-4])


def test_stiffness_per_area_of_a_face() -> None:
    """K of a face over the area of one face, whatever the number of faces."""
    support = Support(BASE_AND_GLAND, area=2.0e-3)
    assert support.face_area == pytest.approx(1.0e-3)
    assert support.with_stiffness(5.0e9).stiffness_per_area == pytest.approx(5.0e12)
    assert Support((BASE,), area=2.0e-3).with_stiffness(5.0e9).stiffness_per_area == pytest.approx(2.5e12)
    with pytest.raises(ValueError, match="once its contact law is made"):
        _ = support.stiffness_per_area


def test_faces_that_are_not_known_are_refused() -> None:
    """A face of a mesh that no support has is an error, not a gland."""
    assert Support.named(("base", "gland"), 1.0, 0.0).sides.tolist() == [1.0, -1.0]
    with pytest.raises(ValueError, match=r"unknown contact faces \['side'\]; expected base, gland"):
        Support.named(("base", "side"), 1.0, 0.0)
