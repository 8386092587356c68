"""Polygons as cross-sections: torsion and shear of Saint-Venant's bars, and beams beside those of other sections."""

from __future__ import annotations

from math import cos, pi, sin, sqrt, tanh
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.meshes.sections.section_mesh import PolygonOutline
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.model import build_model
from gapbeam.solver.sections.polygon_section import PolygonSection
from gapbeam.solver.sections.saint_venant import SaintVenantFigures, saint_venant
from gapbeam.solver.sections.section_choice import BoxSection, ISection
from gapbeam.solver.sections.section_table import solid_shear
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7919.0
Points = list[tuple[float, float]]


def rectangle(width: float, height: float) -> Points:
    """Return the corners of a rectangle."""
    y, z = 0.5 * width, 0.5 * height
    return [(-y, -z), (y, -z), (y, z), (-y, z)]


def ring(diameter: float, count: int) -> Points:
    """Return the corners of a regular polygon that is flat below and above, on a circle."""
    turns = [2.0 * pi * (number + 0.5) / count + 0.5 * pi for number in range(count)]
    return [(0.5 * diameter * cos(turn), 0.5 * diameter * sin(turn)) for turn in turns]


def profile(width: float, height: float, web: float, flange: float) -> Points:
    """Return the corners of an I section."""
    y, z, t, f = 0.5 * width, 0.5 * height, 0.5 * web, 0.5 * height - flange
    right = [(y, -z), (y, -f), (t, -f), (t, f), (y, f), (y, z)]
    return [*right, *((-one, other) for one, other in reversed(right))]


def found(points: Points, *holes: Points) -> tuple[PolygonOutline, SaintVenantFigures]:
    """Return a polygon and what its finite elements give."""
    outline = PolygonOutline.of(points, holes)
    return outline, saint_venant(outline)


def kappas(points: Points, *holes: Points, nu: float = POISSON) -> tuple[float, float]:
    """Return the shear coefficients of a force along z, and along y."""
    section = PolygonSection(type="polygon", points=tuple(points), holes=tuple(tuple(hole) for hole in holes))
    width, height = section.outline(1.0, 1.0).extents
    arguments = height, width, nu
    return section.shear_coefficient(*arguments), section.lateral_shear_coefficient(*arguments)


def torsion_of_rectangle(width: float, height: float) -> float:
    """Return J = h b^3 (1/3 - 64 / pi^5 b / h sum tanh(n pi h / 2 b) / n^5), Timoshenko and Goodier, art. 109."""
    short, long = sorted((width, height))
    total = sum(tanh(0.5 * n * pi * long / short) / n**5 for n in range(1, 200, 2))
    return long * short**3 * (1.0 / 3.0 - 64.0 / pi**5 * short / long * total)


@pytest.mark.parametrize("sides", [(1.0, 1.0), (0.03, 0.04), (2.0, 0.5)])
def test_rectangles_twist_as_the_series_says(sides: tuple[float, float]) -> None:
    """A square has 0.140577 a^4; the estimate of the error holds."""
    _, figures = found(rectangle(*sides))
    error = abs(figures.torsion_constant / torsion_of_rectangle(*sides) - 1.0)
    assert error < figures.error < 1.0e-4
    if sides == (1.0, 1.0):
        assert figures.torsion_constant == pytest.approx(0.140577, rel=5e-6)


def test_triangles_and_discs_twist_as_they_are_known_to() -> None:
    """Equilateral triangle, sqrt(3) / 80 a^4, with the shear center in its centroid; a disc, pi d^4 / 32."""
    outline, figures = found([(0.0, 0.0), (0.02, 0.0), (0.01, 0.01 * sqrt(3.0))])
    assert figures.torsion_constant == pytest.approx(sqrt(3.0) / 80.0 * 0.02**4, rel=figures.error)
    assert figures.shear_center == pytest.approx(outline.centroid, abs=1e-6 * 0.02)
    outline, figures = found(ring(0.04, 100))
    same_moment = sum(outline.second_moments[:2])  # J of a fine polygon falls short as its polar moment does
    assert figures.torsion_constant == pytest.approx(same_moment, rel=3e-4)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_shear_coefficients_are_those_of_cowper(nu: float) -> None:
    """Rectangles of any shape, a disc, and a tube of many sides."""
    for sides in ((0.04, 0.04), (0.02, 0.04), (0.06, 0.02)):
        assert kappas(rectangle(*sides), nu=nu) == pytest.approx([solid_shear(nu)] * 2, rel=2e-6)
    assert kappas(ring(0.04, 100), nu=nu) == pytest.approx([6.0 * (1.0 + nu) / (7.0 + 6.0 * nu)] * 2, rel=1e-4)
    square = 0.8**2
    whole = (1.0 + square) ** 2
    tube = 6.0 * (1.0 + nu) * whole / ((7.0 + 6.0 * nu) * whole + (20.0 + 12.0 * nu) * square)
    assert kappas(ring(0.04, 100), ring(0.032, 100), nu=nu) == pytest.approx([tube] * 2, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["box", "i"])
def test_thin_walls_come_to_the_formulas_for_thin_walls(kind: str) -> None:
    """Their error halves with the wall; that of Bredt's J, 4 A_m^2 t / U, and of sum b t^3 / 3, as well."""
    high, wide = 0.04, 0.03
    shears, turns = [], []
    for wall in (2.0e-3, 1.0e-3):
        if kind == "box":
            points, holes = rectangle(wide, high), [rectangle(wide - 2.0 * wall, high - 2.0 * wall)]
            formula = BoxSection(type="box", wall=wall).shear_coefficient(high, wide, POISSON)
            sides = wide - wall, high - wall
            thin = 4.0 * (sides[0] * sides[1]) ** 2 * wall / (2.0 * sum(sides))
        else:
            points, holes = profile(wide, high, wall, wall), []
            formula = ISection(type="i", web=wall, flange=wall).shear_coefficient(high, wide, POISSON)
            thin = (2.0 * wide + high - 2.0 * wall) * wall**3 / 3.0
        shears.append(kappas(points, *holes)[0] / formula - 1.0)
        turns.append(found(points, *holes)[1].torsion_constant / thin - 1.0)
    for errors in (shears, turns):
        assert 0.0 < errors[1] < 0.03
        assert errors[1] / errors[0] == pytest.approx(0.5, abs=0.08)


def test_the_shear_center_of_a_channel_is_behind_its_web() -> None:
    """For thin walls at e = 3 b^2 / (h + 6 b) from the web, outside; Timoshenko and Gere, strength of materials."""
    high, wide, wall = 0.04, 0.02, 1.0e-3
    inner = [(wide, wall), (wall, wall), (wall, high - wall), (wide, high - wall)]
    _, figures = found([(0.0, 0.0), (wide, 0.0), *inner, (wide, high), (0.0, high)])
    b, h = wide - 0.5 * wall, high - wall
    web = -0.5 * wide + 0.5 * wall
    assert figures.shear_center[0] == pytest.approx(web - 3.0 * b**2 / (h + 6.0 * b), abs=0.02 * wide)
    assert figures.shear_center[1] == pytest.approx(0.0, abs=1e-6 * high)


def test_figures_do_not_depend_on_where_a_polygon_is() -> None:
    """Turned by 90 degrees, moved and passed the other way around, y and z change places."""
    points = [(0.0, 0.0), (0.04, 0.0), (0.03, 0.02), (0.008, 0.025)]
    (one, first), (other, second) = found(points), found([(3.0 - z, y - 2.0) for y, z in reversed(points)])
    assert second.torsion_constant == pytest.approx(first.torsion_constant, rel=first.error)
    assert other.second_moments == pytest.approx([one.second_moments[n] * s for n, s in ((1, 1), (0, 1), (2, -1))])
    assert second.shear_center == pytest.approx((-first.shear_center[1], first.shear_center[0]), abs=1e-4 * 0.04)
    assert second.upright == pytest.approx(first.sideways, rel=1e-4)


def cantilever(beam: dict[str, Any], model: dict[str, Any], length: float, **mesh: Any) -> Array:
    """Return the frequencies of a small model of a cantilever, ascending, Hz."""
    case = {
        "beam": {"length": length, **beam},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": [{"name": "far", "from": 0.9 * length, "to": 0.97 * length, "clearance": 9.0e-3}],
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "restraint": {"axial": 1e-6, "lateral": 1e-6},
        "mesh": {"dimension": 3, "size": 0.06, "support_size": 0.04, **mesh},
        "model": model,
        "load": [{"type": "harmonic_force", "name": "f", "point": length, "amplitude": 1.0, "frequency": 5.0}],
        "probe": [{"name": "tip", "point": length}],
        "time": {"end": 0.1, "step": 1.0e-4},
    }
    operators = build_model(gapbeam.read_case(case), MPI.COMM_SELF).system.operators
    assert isinstance(operators, DenseOperators)
    return np.asarray(np.sqrt(np.maximum(operators.modes[0], 0.0)) / (2.0 * pi))


def polygon(points: Points, *holes: Points) -> dict[str, Any]:
    """Return the keys of [beam] of a polygon."""
    width, height = PolygonOutline.of(points, holes).extents
    return {"thickness": height, "width": width, "section": {"type": "polygon", "points": points, "holes": holes}}


SAME = {
    "rectangle": (polygon(rectangle(0.03, 0.04)), "rectangle"),
    "box": (polygon(rectangle(0.03, 0.04), rectangle(0.022, 0.032)), {"type": "box", "wall": 0.004}),
    "i": (polygon(profile(0.03, 0.04, 0.006, 0.005)), {"type": "i", "web": 0.006, "flange": 0.005}),
}


@pytest.mark.parametrize("name", SAME)
def test_polygons_have_the_figures_of_the_sections_that_they_are(name: str) -> None:
    """Area, both second moments, height over the faces and hollow to rounding."""
    drawn, section = SAME[name]
    one, other = (
        gapbeam.read_case(
            {
                "beam": {"length": 0.5, "thickness": 0.04, "width": 0.03, "section": which},
                "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
                "support": {"length": 0.1, "clearance": 1e-4},
                "mesh": {"dimension": 3},
                "load": [{"type": "gravity"}],
                "time": {"end": 0.1, "step": 1.0e-4},
            }
        ).beam
        for which in (drawn["section"], section)
    )
    for figure in ("area", "second_moment", "lateral_moment", "gyration_radius", "height"):
        assert getattr(one, figure) == pytest.approx(getattr(other, figure), rel=1e-12)
    assert one.section.hollow(0.04, 0.03) == pytest.approx(other.section.hollow(0.04, 0.03), rel=1e-9)
    assert one.centroid == pytest.approx((0.0, 0.0), abs=1e-15)


@pytest.mark.parametrize("name", SAME)
def test_polygons_vibrate_as_the_sections_that_they_are(name: str) -> None:
    """Beam elements of rectangles within the error of kappa; solids of the same cells to rounding, of others nearly."""
    drawn, section = SAME[name]
    other = {"thickness": 0.04, "width": 0.03, "section": section}
    if name == "rectangle":
        pair = [cantilever(beam, {"type": "beam", "elements": 20}, 0.6)[:3] for beam in (drawn, other)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-6)
    cells = {"cells_through_thickness": 2, "cells_across_width": 2, "support_size": 0.04}
    pair = [cantilever(beam, {"type": "reduced", "modes": 4}, 0.6, **cells)[:3] for beam in (drawn, other)]
    assert pair[0] == pytest.approx(pair[1], rel=1e-8 if name == "rectangle" else 1e-3)


FLANGE = [(0.003, 0.0), (0.003, 0.034), (0.02, 0.034), (0.02, 0.04)]
COARSE = {"cells_through_thickness": 2, "cells_across_width": 2}
SLENDER = {
    "dovetail": polygon([(-0.02, 0.0), (0.02, 0.0), (0.012, 0.014), (-0.012, 0.014)]),
    "hexagon": polygon(ring(0.04, 6)),
    "T": polygon([*FLANGE, *((-y, z) for y, z in reversed(FLANGE))]),
}


@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", SLENDER)
def test_solids_of_polygons_vibrate_as_their_beams_do(name: str) -> None:
    """The first three bending frequencies of a slender cantilever within 0.5 %."""
    solid = cantilever(SLENDER[name], {"type": "reduced", "modes": 6}, 0.8, size=0.04, support_size=0.02, **COARSE)
    beam = cantilever(SLENDER[name], {"type": "beam", "elements": 40}, 0.8)
    assert solid[:3] == pytest.approx(beam[:3], rel=5e-3)


def hanging(beam: dict[str, Any], model: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a short beam that lies in a slot under its weight."""
    return {
        "beam": {"length": 0.4, **beam},
        "material": {"young_modulus": YOUNG, "poisson_ratio": POISSON, "density": DENSITY},
        "support": {"length": 0.1, "clearance": 2.0e-4},
        "mesh": {"dimension": 3, "support_size": 0.03, "cells_through_thickness": 2, "cells_across_width": 2},
        "model": model,
        "load": [{"type": "gravity"}],
        "probe": [{"name": "tip", "point": 0.4}],
        "output": {"errors": "none"},
        "time": {"end": 0.1, "step": 1.0e-4},
    }


def resting(beam: dict[str, Any], model: dict[str, Any]) -> Array:
    """Return where the tip of that beam is at rest, m."""
    built = build_model(gapbeam.read_case(hanging(beam, model)), MPI.COMM_SELF)
    state = Simulation(built).seat().state
    return np.asarray(built.probes["tip"].evaluate(state.u[VALUE], built.system.operators))


@pytest.mark.slow(minutes=0.1)
def test_a_dovetail_rests_alike_as_all_models() -> None:
    """By hand the rigid one turns about the edge of the base and sinks by its play; bending adds some of it."""
    dovetail = SLENDER["dovetail"]
    full, reduced, beam, rigid = (
        resting(dovetail, {"type": name})[-1] for name in ("full", "reduced", "beam", "rigid")
    )
    by_hand = -2.0e-4 * 0.3 / 0.1
    assert rigid == pytest.approx(by_hand, rel=0.03)
    assert 1.0 < full / by_hand < 1.4
    assert reduced == pytest.approx(full, rel=2e-3)
    assert beam == pytest.approx(full, rel=0.01)


def test_an_angle_moves_sideways_as_a_solid() -> None:
    """Its tip goes down and aside, to the side of its upright leg, as it bends about axes that are turned."""
    angle = polygon([(0.0, 0.0), (0.03, 0.0), (0.03, 0.01), (0.01, 0.01), (0.01, 0.03), (0.0, 0.03)])
    full, reduced = (resting(angle, {"type": name}) for name in ("full", "reduced"))
    assert reduced == pytest.approx(full, rel=0.04)
    assert full[2] < -5.0e-4
    assert full[1] < -1.0e-5


def test_the_stress_of_a_tee_is_zero_at_its_centroid() -> None:
    """Beam elements under weight have M (z - z_c) / I at both surfaces, the centroid being off the axis."""
    tables = hanging(SLENDER["T"], {"type": "beam", "elements": 40})
    tables |= {
        "joint": [{"name": "root", "type": "clamped", "point": 0.0}],
        "restraint": {"axial": 1e-6, "lateral": 1e-6},
    }
    tables |= {
        "support": [{"name": "far", "from": 0.36, "to": 0.39, "clearance": 5e-3}],
        "time": {"end": 0.01, "step": 1e-4},
    }
    tables["probe"] += [
        {"name": name, "point": [0.2, 0.0, z], "stress": True} for name, z in (("low", -0.02), ("high", 0.02))
    ]
    with TemporaryDirectory() as folder:
        gapbeam.run(gapbeam.read_case(tables), (), f"{folder}/t")
        stress = np.asarray(gapbeam.open_results(f"{folder}/t").history["axial_stress"])[-1]
    beam = gapbeam.read_case(tables).beam
    moment = DENSITY * beam.area * 9.81 * 0.2**2 / 2.0
    arms = np.array([-0.02, 0.02]) - beam.centroid[1]
    assert arms[0] == pytest.approx(-2.0 * arms[1], rel=0.3), "far from symmetric"
    assert stress == pytest.approx(moment * arms / beam.second_moment, rel=0.01)
