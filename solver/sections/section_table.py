"""What all cross-sections have in common. All but polygons are upright and symmetric about both of their axes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from math import pi, sqrt
from typing import Literal

from gapbeam.meshes.sections.section_patches import SectionPatches
from gapbeam.solver.faults import Fault
from gapbeam.solver.table import Table
from gapbeam.solver.wording.compared_numbers import apart, exceeds

KEY = ("beam", "section")
WALL_SHARE = 4  # cells through the thickness that make one cell through a wall

Lattice = Literal["rectangles", "rings", "own"]
"""What the cells of a section lie on: lines along y and z, circles, or nothing that another section shares."""


class SectionTable(Table, ABC):
    """Table of a cross-section. Its outer dimensions are `beam.thickness` and `beam.width`, m."""

    type: str

    @abstractmethod
    def area(self, thickness: float, width: float) -> float:
        """Return the area, m^2."""

    @abstractmethod
    def second_moment(self, thickness: float, width: float) -> float:
        """Return the second moment of area of bending in the bending plane, int z^2 dA, m^4."""

    @property
    def round(self) -> bool:
        """Whether its lower and upper faces are curved."""
        return False

    @property
    def mirrored(self) -> bool:
        """Whether it is symmetric about the bending plane, and its mesh as well."""
        return True

    @property
    def lattice(self) -> Lattice:
        """What its cells lie on: sections of one beam share their cells."""
        return "rings" if self.round else "rectangles"

    def gyration_radius(self, thickness: float, width: float) -> float:
        """Return sqrt(I / A), m."""
        return sqrt(self.second_moment(thickness, width) / self.area(thickness, width))

    def height(self, thickness: float, width: float) -> float:
        """Return A over the width, m."""
        return self.area(thickness, width) / width

    @abstractmethod
    def shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return the share kappa of the area that carries shear in the bending plane, no unit."""

    def lateral_moment(self, thickness: float, width: float) -> float:
        """Return the second moment of area of bending across the bending plane, int y^2 dA, m^4."""
        return self.second_moment(width, thickness)

    def lateral_shear_coefficient(self, thickness: float, width: float, poisson_ratio: float) -> float:
        """Return the share of the area that carries shear across the bending plane, no unit."""
        return self.shear_coefficient(width, thickness, poisson_ratio)

    def polar_moment(self, thickness: float, width: float) -> float:
        """Return the polar second moment of area about the axis, int y^2 + z^2 dA, m^4."""
        return self.second_moment(thickness, width) + self.lateral_moment(thickness, width)

    def torsion_constant(self, thickness: float, width: float) -> float | None:  # noqa: ARG002
        """Return J of Saint-Venant's torsion, the twist T / (G J) under a torque T, m^4; None: no figure is known.

        The section twists about the axis of the beam, which is its shear center: it is symmetric about both axes.
        """
        return None

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

    def centroid(self, thickness: float, width: float) -> tuple[float, float]:  # noqa: ARG002
        """Return y and z of the centroid, from the axis in the middle of thickness and width, m."""
        return 0.0, 0.0

    def flat(self, above: bool) -> bool:  # noqa: ARG002
        """Return whether a flat support above, or below, touches more than a corner of the section."""
        return True

    def coupling(self, in_space: bool) -> str:  # noqa: ARG002
        """Return why bending goes with twist, or with bending in the other plane, in words; "" where it does not.

        Args:
            in_space: Whether the beam bends across its bending plane or twists, too.
        """
        return ""

    def hollow(self, thickness: float, width: float) -> tuple[float, float]:  # noqa: ARG002
        """Return the sizes of what is hollow inside, as thickness and width, m; 0 where nothing is."""
        return 0.0, 0.0

    def faults(self, thickness: float, width: float) -> Iterator[Fault]:  # noqa: ARG002
        """Yield what does not fit the outer dimensions."""
        yield from ()


def wall_cells(through: int) -> int:
    """Return the number of cells through a wall, one for every four through the thickness."""
    return max(1, round(through / WALL_SHARE))


def quarter_cells(through: int, across: int) -> int:
    """Return the number of cells along a quarter of a circumference; a single one folds where it follows 90 degrees."""
    return max(through, across, 2)


def thin_enough(key: str, value: float, most: float, of: str) -> Iterator[Fault]:
    """Yield the fault of a wall that leaves no room: at most half of what it is taken from."""
    if not exceeds(most, value):
        found, limit = apart(value, most)
        yield Fault(
            (*KEY, key),
            f"{found} m",
            f"less than {limit} m, {of}",
            f"is it in mm? In m it is {value / 1000:g}" if value / 1000 < most <= 1000 * value else "",
            (("beam", "thickness"), ("beam", "width")),
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
        m: Area of both flanges over that of the webs.
        more: What the width of the flanges adds to the denominator.
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
