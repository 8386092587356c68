"""Error of thin-wall formulas for the shear coefficient: box and I sections as polygons.

    python3 -m benchmarks.section_shear

Sections 30 mm wide and 40 mm high, all walls equally thick, at a Poisson ratio of 0.3. The polygon has Cowper's shear
coefficient by finite elements on the section, the formula is Cowper's for thin walls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from benchmarks.table import Cell, Table, options
from gapbeam.solver.sections.polygon_section import PolygonSection
from gapbeam.solver.sections.section_choice import BoxSection, ISection
from gapbeam.solver.sections.section_table import SectionTable

HIGH, WIDE, POISSON = 0.04, 0.03, 0.3
WALLS = (0.006, 0.003, 0.001)  # m
Corners = tuple[tuple[float, float], ...]


def rows(walls: Sequence[float] = WALLS) -> Iterator[tuple[Cell, ...]]:
    """Yield the thickness of walls with both shear coefficients of the box, and of the I section."""
    for wall in walls:
        inner = rectangle(WIDE - 2.0 * wall, HIGH - 2.0 * wall)
        box = PolygonSection(type="polygon", points=rectangle(WIDE, HIGH), holes=(inner,))
        profile = PolygonSection(type="polygon", points=i_corners(wall))
        yield (
            f"{1e3 * wall:g} mm",
            _both(box, BoxSection(type="box", wall=wall)),
            _both(profile, ISection(type="i", web=wall, flange=wall)),
        )


def rectangle(width: float, height: float) -> Corners:
    """Return the corners of a rectangle."""
    y, z = 0.5 * width, 0.5 * height
    return (-y, -z), (y, -z), (y, z), (-y, z)


def i_corners(wall: float) -> Corners:
    """Return the corners of an I section."""
    y, z, t = 0.5 * WIDE, 0.5 * HIGH, 0.5 * wall
    right = ((y, -z), (y, wall - z), (t, wall - z), (t, z - wall), (y, z - wall), (y, z))
    return (*right, *((-one, other) for one, other in reversed(right)))


def _both(polygon: SectionTable, formula: SectionTable) -> str:
    return ", ".join(f"{one.shear_coefficient(HIGH, WIDE, POISSON):.4f}" for one in (polygon, formula))


if __name__ == "__main__":
    columns = ("walls", "box: kappa, formula", "I: kappa, formula")
    Table("section_shear", "Shear coefficients of polygons", columns, tuple(rows())).write(options(__doc__).output)
