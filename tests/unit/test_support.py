"""The faces of supports: gaps, sides, area and stiffness, against hand calculations."""

from __future__ import annotations

import numpy as np
import pytest

from gapbeam.solver.case.case import PlacedSupport
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.regions.region import Placement, Slot, Stop
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.supports.support_tables import BaseAndGland

HEIGHTS = np.array([0.0, 2.0e-6, 5.0e-6])


def paper(clearance: float) -> tuple[Face, ...]:
    """Return base and gland with a clearance."""
    return BaseAndGland(length=0.05, clearance=clearance).faces


def placed(start: float, end: float, clearance: float, **keys: object) -> object:
    """Return a support along the beam."""
    return PlacedSupport.model_validate({"name": "baffle", "from": start, "to": end, "clearance": clearance, **keys})


def test_gaps_of_base_and_gland() -> None:
    """The base touches the lowest point, the gland stands the clearance above the highest one."""
    base, gland = paper(1.0e-4)
    assert (base.name, gland.name) == ("base", "gland")
    assert base.gaps(HEIGHTS[:, None]) == pytest.approx(HEIGHTS, rel=1e-12)
    assert gland.gaps(HEIGHTS[:, None]) == pytest.approx([1.05e-4, 1.03e-4, 1.0e-4], rel=1e-12)


def test_an_interference_fit_presses_the_gland_into_the_beam() -> None:
    """A negative clearance gives negative gaps at the gland and none at the base."""
    base, gland = paper(-6.0e-6)
    assert gland.gaps(np.zeros((2, 1))) == pytest.approx([-6.0e-6, -6.0e-6])
    assert base.gaps(np.zeros((2, 1))) == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize("offset", [0.0, 3.0e-5, -8.0e-5])
def test_a_slot_keeps_its_clearance_wherever_it_stands(offset: float) -> None:
    """Both gaps together are the clearance; a slot that is moved upward is nearer below by the offset."""
    below, above = Slot(type="slot").faces("s", Placement(1.0e-4, offset))
    assert below.gap + above.gap == pytest.approx(1.0e-4)
    assert (below.side, above.side) == (1.0, -1.0)
    assert above.gap - below.gap == pytest.approx(2.0 * offset)


@pytest.mark.parametrize(("side", "gap"), [("below", 0.8e-4), ("above", 1.2e-4)])
def test_a_stop_has_one_plane(side: str, gap: float) -> None:
    """A stop that is moved upward comes nearer from below and goes away from above."""
    (plane,) = Stop.model_validate({"type": "stop", "side": side}).faces("s", Placement(1.0e-4, 0.2e-4))
    assert plane.gap == pytest.approx(gap)
    assert plane.side == (1.0 if side == "below" else -1.0)


def test_faces_move_as_their_supports_do() -> None:
    """Other gaps open each face by what its own gap grew; other faces are an error."""
    support = Support(paper(1.0e-4), area=2.0e-3)
    opened, growth = support.with_gaps_of(paper(3.0e-4), np.array([0, 1]), np.zeros((2, 3)))
    assert [face.gap for face in opened.faces] == [0.0, 3.0e-4]
    assert growth == pytest.approx([0.0, 2.0e-4])
    with pytest.raises(ValueError, match=r"the faces \['stop'\]; expected \['base', 'gland'\]"):
        support.with_gaps_of((Face("stop", 1.0),), np.array([0]), np.zeros((1, 3)))


def test_stiffness_per_area_of_a_face() -> None:
    """K of a face over the area of one face, whatever the number of faces."""
    support = Support(paper(0.0), area=2.0e-3)
    assert support.face_area == pytest.approx(1.0e-3)
    assert support.with_stiffness(5.0e9).stiffness_per_area == pytest.approx(5.0e12)
    assert Support(paper(0.0)[:1], area=2.0e-3).with_stiffness(5.0e9).stiffness_per_area == pytest.approx(2.5e12)
    with pytest.raises(ValueError, match="once its contact law is made"):
        _ = support.stiffness_per_area


def test_layout_of_several_supports() -> None:
    """Lengths, spans, overhangs and clearances by hand: two slots, and a stop above the beam between them."""
    layout = Layout.of(
        (
            placed(0.5, 0.53, 4.0e-4),
            placed(0.1, 0.12, 0.0),
            placed(0.3, 0.31, 1.0e-4, region={"type": "stop", "side": "above"}),
        )
    )
    assert [one.start for one in layout.supports] == [0.1, 0.3, 0.5]
    assert (layout.start, layout.end, layout.reach) == (0.1, 0.53, pytest.approx(0.43))
    assert (layout.length, layout.shortest) == (pytest.approx(0.06), pytest.approx(0.01))
    assert (layout.clearance, layout.widest, layout.interference) == (1.0e-4, 4.0e-4, 0.0)
    assert [length for _, length in layout.spans()] == pytest.approx([0.38]), "a beam does not rest on a stop above it"
    assert [length for _, length in layout.overhangs(0.7)] == pytest.approx([0.17, 0.1])
    assert [layout.arm(x) for x in (0.1, 0.53, 0.7)] == pytest.approx([0.43, 0.43, 0.6])


def test_layout_of_base_and_gland() -> None:
    """One support from x = 0: no span, one overhang, moments about the edge of the base."""
    layout = Layout.of(BaseAndGland(length=0.05, clearance=-6.0e-6))
    assert (list(layout.spans()), list(layout.overhangs(0.51))) == ([], [(0.05, pytest.approx(0.46))])
    assert [layout.arm(x) for x in (0.0, 0.05, 0.3)] == pytest.approx([0.05, 0.0, 0.25])
    assert (layout.clearance, layout.widest, layout.interference) == (-6.0e-6, 0.0, 6.0e-6)
