"""Tables of cross-sections: tube, solid rectangle and disc by formulas, others by the patches of their mesh.

A section that is given by `patches` and `contains` alone has an area, second moments, a centroid, a torsion constant
and shear coefficients: those of its outline, by Green's theorem and by finite elements on the cross-section.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import lru_cache
from math import hypot, pi, sqrt, tanh
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.meshes.sections.section_mesh import PolygonOutline, outline_of
from gapbeam.meshes.sections.section_patches import CELLS_THROUGH, SectionPatches, rectangle_patches, ring_patches
from gapbeam.solver.messages.errors import Fault
from gapbeam.solver.messages.wording import apart, exceeds
from gapbeam.solver.schema.table import Positive, Table
from gapbeam.solver.sections.saint_venant import SaintVenantFigures, saint_venant

KEY = ("beam", "section")
ASIDE = 1.0e-3  # of the size, or of the second moments: what is off by less than this is taken to be on the axis
AGREES = 0.01  # relative difference between a formula for thin walls or chords of arcs, and the patches
THINNEST = 1e-8  # wall over what it is taken from: areas are differences of squares, which lose it to round-off
WALL_SHARE = 4  # cells through the thickness that make one cell through a wall

Lattice = Literal["rectangles", "rings", "own"]
"""Lattice of the cells of a section: lines along y and z, circles, or one that no other section shares."""


class SectionTable(Table, ABC):
    """Table of a cross-section. Its outer dimensions are `beam.thickness` and `beam.width`, m.

    Attributes:
        round: True where the lower and upper faces are curved; such a section is as wide as it is thick.
    """

    round: ClassVar[bool] = False
    type: str

    def outline(self, thickness: float, width: float) -> PolygonOutline:
        """Return the outline of its patches, arcs as chords."""
        return _outline(self, thickness, width)

    def saint_venant(self, thickness: float, width: float) -> SaintVenantFigures:
        """Return the figures of torsion and flexure of its outline, by finite elements."""
        return saint_venant(self.outline(thickness, width))

    def area(self, thickness: float, width: float) -> float:
        """Return the area, m^2."""
        return self.outline(thickness, width).moments.area

    def second_moment(self, thickness: float, width: float) -> float:
        """Return the second moment of area of bending in the bending plane, int z^2 dA about the centroid, m^4."""
        return self.outline(thickness, width).second_moments[1]

    @property
    def mirrored(self) -> bool:
        """True where the section and its mesh are symmetric about the bending plane."""
        return True

    @property
    def lattice(self) -> Lattice:
        """Lattice of the cells, which sections of one beam share."""
        return "rings" if self.round else "rectangles"

    def gyration_radius(self, thickness: float, width: float) -> float:
        """Return sqrt(I / A), m."""
        return sqrt(self.second_moment(thickness, width) / self.area(thickness, width))

    def height(self, thickness: float, width: float) -> float:
        """Return A over the width, m."""
        return self.area(thickness, width) / width

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return the share kappa of the area that carries shear in the bending plane, Cowper's, no unit."""
        terms = self.saint_venant(thickness, width).upright
        return _kappa(self.second_moment(thickness, width), terms, poisson_ratio)

    def lateral_moment(self, thickness: float, width: float) -> float:
        """Return the second moment of area of bending across the bending plane, int y^2 dA about the centroid, m^4."""
        return self.outline(thickness, width).second_moments[0]

    def lateral_shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return the share of the area that carries shear across the bending plane, Cowper's, no unit."""
        terms = self.saint_venant(thickness, width).sideways
        return _kappa(self.lateral_moment(thickness, width), terms, poisson_ratio)

    def polar_moment(self, thickness: float, width: float) -> float:
        """Return the polar second moment of area about the axis, int y^2 + z^2 dA, m^4."""
        return self.second_moment(thickness, width) + self.lateral_moment(thickness, width)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return J of Saint-Venant's torsion, the twist T / (G J) under a torque T, m^4."""
        return self.saint_venant(thickness, width).torsion_constant

    @abstractmethod
    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches | None:
        """Return the patches of its mesh; None: layers through thickness and width.

        Args:
            thickness: Outer size in the bending direction, m.
            width: Outer size across it, m.
            through: Cells through the thickness.
            across: Cells across the width.
        """

    @abstractmethod
    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point of the plane of the section is in the material."""

    def centroid(self, thickness: float, width: float) -> tuple[float, float]:
        """Return y and z of the centroid, from the axis in the middle of thickness and width, m."""
        return self.outline(thickness, width).centroid

    def flat(self, above: bool) -> bool:  # noqa: ARG002
        """Return whether a flat support above, or below, touches more than a corner of the section."""
        return True

    def coupling(self, in_space: bool, thickness: float, width: float) -> str:
        """Return the reason for which bending couples with twist, or with the other plane; "" where it does not.

        Args:
            in_space: Whether the beam bends across its bending plane or twists, too.
            thickness: Outer size in the bending direction, m.
            width: Outer size across it, m.
        """
        outline = self.outline(thickness, width)
        (across, upright, mixed), slack = outline.second_moments, ASIDE * outline.size
        if not self.mirrored:
            share = abs(mixed) / max((across * upright) ** 0.5, np.finfo(float).tiny)
            if share > ASIDE:
                return (
                    f"its principal axes are turned: int y z dA is {mixed:.3g} m^4, {share:.2g} of the second moments"
                )
            for name, place in (
                ("shear center", self.saint_venant(thickness, width).shear_center),
                ("centroid", outline.centroid),
            ):
                if abs(place[0]) > slack:
                    return f"its {name} is {abs(place[0]):.3g} m beside the bending plane"
        if in_space:
            for name, place in (
                ("centroid", outline.centroid),
                ("shear center", self.saint_venant(thickness, width).shear_center),
            ):
                if abs(place[1]) > slack:
                    where = f"{abs(place[1]):.3g} m off the axis"
                    return f"its {name} is {where}, and the beam bends across its plane or twists, too"
        return ""

    def hollow(self, thickness: float, width: float) -> tuple[float, float]:  # noqa: ARG002
        """Return the sizes of the hollow inside, as thickness and width, m; 0 where there is none."""
        return 0.0, 0.0

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:  # noqa: ARG002
        """Yield the contradictions to the outer dimensions."""
        yield from ()

    def disagreements(self, thickness: float, width: float) -> Iterator[str]:
        """Yield the figures that differ from those of the patches, in words."""
        outline = self.outline(thickness, width)
        (across, upright, _), size = outline.second_moments, outline.size
        for name, given, found, unit, slack in (
            ("area", self.area(thickness, width), outline.moments.area, "m^2", 0.0),
            ("second_moment", self.second_moment(thickness, width), upright, "m^4", 0.0),
            ("lateral_moment", self.lateral_moment(thickness, width), across, "m^4", 0.0),
            ("centroid, y", self.centroid(thickness, width)[0], outline.centroid[0], "m", AGREES * size),
            ("centroid, z", self.centroid(thickness, width)[1], outline.centroid[1], "m", AGREES * size),
        ):
            if abs(given - found) > AGREES * abs(found) + slack:
                yield f"{name} = {given:.4g} {unit}, with {found:.4g} {unit} of its patches"
        if self.mirrored and not outline.mirrored:
            yield "mirrored, with patches that are not symmetric about the bending plane"


class SymmetricSection(SectionTable):
    """A section that is symmetric about both axes, with figures of bending that exchange as thickness and width do."""

    def lateral_moment(self, thickness: float, width: float) -> float:
        """Return the second moment of area of bending across the bending plane, int y^2 dA, m^4."""
        return self.second_moment(width, thickness)

    def lateral_shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return the share of the area that carries shear across the bending plane, no unit."""
        return self.shear_coefficient(width, thickness, poisson_ratio)

    def centroid(self, thickness: float, width: float) -> tuple[float, float]:  # noqa: ARG002
        """Return the axis."""
        return 0.0, 0.0

    def coupling(self, in_space: bool, thickness: float, width: float) -> str:  # noqa: ARG002
        """Return "": bending couples with nothing else."""
        return ""


@lru_cache(maxsize=256)
def _outline(section: SectionTable, thickness: float, width: float) -> PolygonOutline:
    """Return the outline of the patches of a section, once for each."""
    patches = section.patches(thickness, width, CELLS_THROUGH, CELLS_THROUGH)
    return outline_of(patches or rectangle_patches(thickness, width, CELLS_THROUGH, CELLS_THROUGH))


def _kappa(second: float, terms: tuple[float, float], poisson_ratio: float) -> float:
    """Return Cowper's 2 (1 + nu) I over the part that a force moves."""
    return 2.0 * (1.0 + poisson_ratio) * second / (terms[0] + poisson_ratio * terms[1])


def wall_cells(through: int) -> int:
    """Return the number of cells through a wall, one for every four through the thickness."""
    return max(1, round(through / WALL_SHARE))


def quarter_cells(through: int, across: int) -> int:
    """Return the number of cells along a quarter of a circumference; a single one folds where it follows 90 degrees."""
    return max(through, across, 2)


def thin_enough(key: str, value: float, most: float, of: str) -> Iterator[Fault]:
    """Yield the fault of a wall that leaves no bore, or is lost to round-off: at most half of the outer size."""
    sizes = (("beam", "thickness"), ("beam", "width"))
    if value < THINNEST * most:
        yield Fault(
            (*KEY, key),
            f"{value:g} m",
            f"at least {THINNEST * most:.3g} m: a thinner wall is lost to round-off beside {most:g} m, {of}",
            "all lengths are in m",
            sizes,
        )
    if not exceeds(most, value):
        found, limit = apart(value, most)
        yield Fault(
            (*KEY, key),
            f"{found} m",
            f"less than {limit} m, {of}",
            f"is it in mm? In m it is {value / 1000:g}" if value / 1000 < most <= 1000 * value else "",
            sizes,
        )


def round_faults(name: str, thickness: float, width: float) -> Iterator[Fault]:
    """Yield the fault of a round section that is not as wide as it is thick."""
    if thickness != width:
        yield Fault(
            KEY,
            f'"{name}" with thickness = {thickness:g} and width = {width:g}',
            "thickness and width both the outer diameter",
            f"width = {thickness:g}",
            (("beam", "thickness"), ("beam", "width")),
        )


def solid_shear(poisson_ratio: float) -> float:
    """Return Cowper's kappa of a solid rectangle, 10 (1 + nu) / (12 + 11 nu)."""
    return 10.0 * (1.0 + poisson_ratio) / (12.0 + 11.0 * poisson_ratio)


def thin_walled_shear(m: float, more: float, poisson_ratio: float) -> float:
    """Return Cowper's kappa of a section of thin walls.

    Args:
        m: Area of both flanges over the area of the webs.
        more: Contribution of the flange width to the denominator.
        poisson_ratio: nu.
    """
    nu = poisson_ratio
    below = 12.0 + 72.0 * m + 150.0 * m**2 + 90.0 * m**3 + nu * (11.0 + 66.0 * m + 135.0 * m**2 + 90.0 * m**3)
    return 10.0 * (1.0 + nu) * (1.0 + 3.0 * m) ** 2 / (below + more)


def disc_area(diameter: float) -> float:
    """Return the area of a disc, m^2."""
    return 0.25 * pi * diameter**2


def disc_moment(diameter: float) -> float:
    """Return the second moment of a disc about a diameter, m^4."""
    return pi * diameter**4 / 64.0


class TubeSection(SymmetricSection):
    """A round tube.

    Source: Cowper (1966), table 1, hollow circle, for the shear coefficient.
    """

    type: Literal["tube"] = Field(description="a round tube; thickness is its outer diameter")
    wall: Positive = Field(description="thickness of the wall, m", examples=[0.005])

    round: ClassVar[bool] = True

    def area(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi (d^2 - d_i^2) / 4."""
        return disc_area(thickness) - disc_area(thickness - 2.0 * self.wall)

    def second_moment(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi (d^4 - d_i^4) / 64."""
        return disc_moment(thickness) - disc_moment(thickness - 2.0 * self.wall)

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:  # noqa: ARG002
        """Return 6 (1 + nu) (1 + m^2)^2 / ((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2) with m = d_i / d."""
        square, nu = ((thickness - 2.0 * self.wall) / thickness) ** 2, poisson_ratio
        whole = (1.0 + square) ** 2
        return 6.0 * (1.0 + nu) * whole / ((7.0 + 6.0 * nu) * whole + (20.0 + 12.0 * nu) * square)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return pi (d^4 - d_i^4) / 32."""
        return self.polar_moment(thickness, width)

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:  # noqa: ARG002
        """Return four quarters."""
        radius, quarter = 0.5 * thickness, quarter_cells(through, across)
        return ring_patches(radius, radius - self.wall, quarter, wall_cells(quarter), filled=False)

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:  # noqa: ARG002
        """Return whether a point is in the wall."""
        return 0.5 * thickness - self.wall <= hypot(y, z) <= 0.5 * thickness

    def hollow(self, thickness: float, width: float) -> tuple[float, float]:
        """Return the inner diameter, twice."""
        return thickness - 2.0 * self.wall, width - 2.0 * self.wall

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield different diameters, and walls that leave no bore."""
        yield from round_faults(self.type, thickness, width)
        yield from thin_enough("wall", self.wall, 0.5 * thickness, "half of the diameter")


TERMS = 400  # n up to which the series of the torsion constant is summed; what is left out is 1e-11 of it


class RectangularSection(SymmetricSection):
    """A solid rectangle.

    Source: Cowper (1966), J. Appl. Mech. 33, 335-340, table 1, for the shear coefficients of all sections.
    """

    type: Literal["rectangle"] = Field(description="a solid rectangle, thickness high and width wide")

    def area(self, thickness: float, width: float) -> float:
        """Return b h."""
        return width * thickness

    def second_moment(self, thickness: float, width: float) -> float:
        """Return b h^3 / 12."""
        return width * thickness**3 / 12.0

    def gyration_radius(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return h / sqrt(12)."""
        return thickness / sqrt(12.0)

    def height(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return h."""
        return thickness

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:  # noqa: ARG002
        """Return 10 (1 + nu) / (12 + 11 nu)."""
        return solid_shear(poisson_ratio)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return a b^3 / 3 (1 - 192 b / (pi^5 a) sum tanh(n pi a / (2 b)) / n^5), n = 1, 3, ..., with a >= b.

        Source: Timoshenko and Goodier (1970), Theory of Elasticity, 3rd ed., sec. 109.
        """
        long, short = max(thickness, width), min(thickness, width)
        series = sum(tanh(0.5 * n * pi * long / short) / n**5 for n in range(1, TERMS, 2))
        return long * short**3 / 3.0 * (1.0 - 192.0 * short / (pi**5 * long) * series)

    def patches(self, thickness: float, width: float, through: int, across: int) -> None:  # noqa: ARG002
        """Return None: layers follow the points of loads and probes."""
        return

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:
        """Return whether a point is in the rectangle."""
        return abs(y) <= 0.5 * width and abs(z) <= 0.5 * thickness


CORE = 0.55  # of the radius: the corners of the square of cells in the middle


class RoundSection(SymmetricSection):
    """A solid disc.

    Source: Cowper (1966), table 1, circle, for the shear coefficient.
    """

    type: Literal["round"] = Field(description="a solid disc; thickness is its diameter")

    round: ClassVar[bool] = True

    def area(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi d^2 / 4."""
        return disc_area(thickness)

    def second_moment(self, thickness: float, width: float) -> float:  # noqa: ARG002
        """Return pi d^4 / 64."""
        return disc_moment(thickness)

    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:  # noqa: ARG002
        """Return 6 (1 + nu) / (7 + 6 nu)."""
        return 6.0 * (1.0 + poisson_ratio) / (7.0 + 6.0 * poisson_ratio)

    def torsion_constant(self, thickness: float, width: float) -> float:
        """Return pi d^4 / 32."""
        return self.polar_moment(thickness, width)

    def patches(self, thickness: float, width: float, through: int, across: int) -> SectionPatches:  # noqa: ARG002
        """Return a square of cells and four patches around it."""
        quarter = quarter_cells(through, across)
        return ring_patches(0.5 * thickness, 0.5 * CORE * thickness, quarter, max(1, quarter // 2), filled=True)

    def contains(self, y: float, z: float, thickness: float, width: float) -> bool:  # noqa: ARG002
        """Return whether a point is in the disc."""
        return hypot(y, z) <= 0.5 * thickness

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:
        """Yield different diameters."""
        yield from round_faults(self.type, thickness, width)
