"""[beam] and [material]: outer size and cross-section of the beam, and what it is made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field

from gapbeam.meshes.sections.section_patches import CELLS_THROUGH, SectionPatches
from gapbeam.solver.sections.section_choice import RECTANGLE, SectionChoice
from gapbeam.solver.table import Number, Positive, Table, named


class Beam(Table):
    """The outer dimensions of the beam, and its cross-section."""

    length: Positive = Field(description="length along x, m", examples=[0.51])
    thickness: Positive = Field(description="size in the bending direction, m", examples=[0.012])
    width: Positive = Field(
        description="size across the bending plane, also in 2D: forces are whole forces, m", examples=[0.02]
    )
    section: Annotated[SectionChoice, BeforeValidator(named)] = Field(
        default=RECTANGLE, description="the cross-section: a name, or a table with the type and its keys"
    )

    @property
    def area(self) -> float:
        """Area of the cross-section, m^2."""
        return self.section.area(self.thickness, self.width)

    @property
    def second_moment(self) -> float:
        """Second moment of area of bending in the bending plane, m^4."""
        return self.section.second_moment(self.thickness, self.width)

    @property
    def gyration_radius(self) -> float:
        """Radius of gyration of the cross-section, sqrt(I / A), m."""
        return self.section.gyration_radius(self.thickness, self.width)

    @property
    def height(self) -> float:
        """Area over width: the height of material above a unit of the contact faces, m."""
        return self.section.height(self.thickness, self.width)

    @property
    def centroid(self) -> tuple[float, float]:
        """Place y and z of the centroid of the cross-section, from the axis, m."""
        return self.section.centroid(self.thickness, self.width)

    @property
    def rectangular(self) -> bool:
        """True for a solid rectangle, which a slice in the bending plane can represent."""
        return self.section == RECTANGLE

    @property
    def hollow(self) -> bool:
        """True where the axis of the beam lies outside the material."""
        return not self.contains(0.0, 0.0)

    def patches(self, through: int | None, across: int | None) -> SectionPatches | None:
        """Return the patches that a mesh of the section is made of; None: layers through thickness and width.

        Args:
            through: Cells through the thickness; None: the default.
            across: Cells across the width; None: the default.
        """
        counts = through or CELLS_THROUGH, across or CELLS_THROUGH
        return self.section.patches(self.thickness, self.width, *counts)

    def shear_coefficient(self, poisson_ratio: float) -> float:
        """Return the share kappa of the area that carries shear in the bending plane, no unit."""
        return self.section.shear_coefficient(self.thickness, self.width, poisson_ratio)

    @property
    def lateral_moment(self) -> float:
        """Second moment of area of bending across the bending plane, m^4."""
        return self.section.lateral_moment(self.thickness, self.width)

    def lateral_shear_coefficient(self, poisson_ratio: float) -> float:
        """Return the share kappa of the area that carries shear across the bending plane, no unit."""
        return self.section.lateral_shear_coefficient(self.thickness, self.width, poisson_ratio)

    @property
    def polar_moment(self) -> float:
        """Polar second moment of area about the axis, m^4."""
        return self.section.polar_moment(self.thickness, self.width)

    @property
    def torsion_constant(self) -> float:
        """J of Saint-Venant's torsion, m^4; None: the section has no figure."""
        return self.section.torsion_constant(self.thickness, self.width)

    def contains(self, y: float, z: float) -> bool:
        """Return whether a point of the plane of the section is in the material."""
        return self.section.contains(y, z, self.thickness, self.width)


class Material(Table):
    """Isotropic linear elasticity."""

    young_modulus: Positive = Field(description="Young's modulus, Pa", examples=[2.1e11])
    poisson_ratio: Number = Field(gt=-1.0, lt=0.5, description="Poisson ratio, no unit", examples=[0.3])
    density: Positive = Field(description="mass density, kg/m^3", examples=[7919.0])
    yield_stress: Positive | None = Field(
        default=None,
        description="stress beyond which a run warns, Pa; default none",
        examples=[3.55e8],
    )
