"""Figures of cross-sections from their patches: a T that gives none, shipped ones, and those that disagree."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from pydantic import TypeAdapter

import gapbeam
from gapbeam.meshes.sections.section_patches import SectionPatches, grid_patches
from gapbeam.solver.case.checks.beam_checks import section_fits_the_beam
from gapbeam.solver.sections.polygon_section import PolygonSection
from gapbeam.solver.sections.section_choice import SectionChoice
from gapbeam.solver.sections.section_table import SectionTable, SymmetricSection
from tests.programs.made_up_tee import TeeSection

HIGH, WIDE = 0.03, 0.024  # m
SHIPPED: dict[str, tuple[Any, float]] = {
    "rectangle": ("rectangle", WIDE),
    "box": ({"type": "box", "wall": 0.002}, WIDE),
    "i": ({"type": "i", "web": 0.003, "flange": 0.004}, WIDE),
    "round": ("round", HIGH),
    "tube": ({"type": "tube", "wall": 0.002}, HIGH),
}
SIZES = some.floats(0.1, 0.45)


def shipped(name: str) -> tuple[SectionTable, float]:
    """Return a section and the width of its beam."""
    section, width = SHIPPED[name]
    table = {"type": section} if isinstance(section, str) else section
    return TypeAdapter(SectionChoice).validate_python(table), width


def tee(web: float, flange: float) -> TeeSection:
    """Return a T of shares of the width and of the thickness."""
    return TeeSection(type="tee", web=web * WIDE, flange=flange * HIGH)


@settings(max_examples=20, deadline=None)
@given(SIZES, SIZES)
def test_figures_of_a_tee_by_hand(web: float, flange: float) -> None:
    """Area, moments about the centroid and the centroid of two rectangles (parallel axes)."""
    section = tee(web, flange)
    t, f = section.web, section.flange
    parts = ((t * (HIGH - f), -0.5 * f, t, HIGH - f), (WIDE * f, 0.5 * (HIGH - f), WIDE, f))
    area = sum(part for part, *_ in parts)
    z = sum(part * place for part, place, *_ in parts) / area
    second = sum(b * h**3 / 12.0 + part * (place - z) ** 2 for part, place, b, h in parts)
    lateral = sum(h * b**3 / 12.0 for _, _, b, h in parts)
    sizes = HIGH, WIDE
    assert section.area(*sizes) == pytest.approx(area, rel=1e-12)
    assert section.second_moment(*sizes) == pytest.approx(second, rel=1e-12)
    assert section.lateral_moment(*sizes) == pytest.approx(lateral, rel=1e-12)
    assert section.polar_moment(*sizes) == pytest.approx(second + lateral, rel=1e-12)
    assert section.centroid(*sizes) == pytest.approx((0.0, z), abs=1e-15)
    assert list(section.disagreements(*sizes)) == []


def test_a_tee_is_the_polygon_of_the_same_shape() -> None:
    """Torsion constant, shear coefficients and coupling are those of the polygon with the same corners."""
    section = tee(0.2, 0.2)
    half, edge = 0.5 * section.web, 0.5 * HIGH - section.flange
    y, z = 0.5 * WIDE, 0.5 * HIGH
    corners = ((-half, -z), (half, -z), (half, edge), (y, edge), (y, z), (-y, z), (-y, edge), (-half, edge))
    polygon = PolygonSection(type="polygon", points=corners)
    for nu in (0.0, 0.3):
        for name in ("shear_coefficient", "lateral_shear_coefficient"):
            mine, other = (getattr(one, name)(HIGH, WIDE, nu) for one in (section, polygon))
            assert mine == pytest.approx(other, rel=2e-4)
    assert section.torsion_constant(HIGH, WIDE) == pytest.approx(polygon.torsion_constant(HIGH, WIDE), rel=2e-4)
    assert section.coupling(in_space=True, thickness=HIGH, width=WIDE).startswith("its centroid is")
    assert section.coupling(in_space=False, thickness=HIGH, width=WIDE) == ""


@pytest.mark.parametrize("name", SHIPPED)
def test_formulas_of_shipped_sections_agree_with_their_patches(name: str) -> None:
    """Closed forms of areas and second moments, and torsion constants, against the outline of the patches."""
    section, width = shipped(name)
    assert list(section.disagreements(HIGH, width)) == []
    found = section.saint_venant(HIGH, width).torsion_constant
    assert section.torsion_constant(HIGH, width) == pytest.approx(found, rel=2e-3)


class TurnedTee(SymmetricSection):
    """A T that takes the lateral figures of a symmetric section: an error of 84 % that was not seen."""

    type: str = "tee"

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:
        """Return those of the T."""
        return tee(0.2, 0.2).patches(thickness, width, through, across)

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in the T."""
        return tee(0.2, 0.2).contains(y, z, thickness, width)


class Angle(TurnedTee):
    """An L, which is not symmetric about the bending plane."""

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:
        """Return an upright and a level leg."""
        y, z = 0.5 * width, 0.5 * thickness
        lines = (-y, -0.5 * y, y), (-z, -0.5 * z, z)
        return grid_patches(lines, ((1, through), (1, across)), ((True, True), (True, False)))


def faults_of(section: SectionTable) -> Iterator[str]:
    """Yield what check says of a section."""
    beam = gapbeam.read_case("cases/demo.toml").beam
    for fault in section_fits_the_beam(beam.model_copy(update={"section": section, "thickness": HIGH, "width": WIDE})):
        yield fault.found


def test_figures_that_contradict_the_patches_are_refused() -> None:
    """Each wrong figure is named with the right one."""
    said = " ".join(faults_of(TurnedTee()))
    assert "lateral_moment =" in said
    assert "centroid, z = 0 m" in said
    assert "area" not in said
    assert "not symmetric about the bending plane" in " ".join(faults_of(Angle()))
    assert list(faults_of(tee(0.2, 0.2))) == []
