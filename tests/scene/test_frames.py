"""Frames in space against closed forms: beams, a portal, a ring, Castigliano's theorem, and elbows."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, root

import gapbeam as gb
from gapbeam.solver.scene.frame_route import FrameRoute
from gapbeam.solver.scene.structure import dense
from tests.shared.slips import check_refused, put

STEEL = gb.material(2e11, 7800.0, 0.3)
E, G, RHO = 2e11, 2e11 / 2.6, 7800.0
RADIUS = 0.004
ROUND = gb.SpaceSection(pi * RADIUS**2, pi / 4 * RADIUS**4, pi / 4 * RADIUS**4, pi / 2 * RADIUS**4)
A, SECOND, TWIST = ROUND.area, ROUND.second_moment, ROUND.torsion_constant
Z = [0.0, 0.0, 1.0]


def frequencies(one: gb.Structure, count: int) -> np.ndarray:
    """Return the first angular frequencies beyond rigid motions."""
    squares = one.modes[0]
    still = 0 if one.rigid is None else one.rigid.shape[1]
    assert np.all(np.abs(squares[:still]) <= 1e-9 * squares[still])
    return np.asarray(np.sqrt(squares[still : still + count]))


def deflection(one: gb.Structure, point: str) -> np.ndarray:
    """Return the motions of a point under a unit force along each of them, as a matrix."""
    rows = one[point].rows
    return np.asarray(rows @ np.linalg.solve(dense(one.K), rows.T))


@pytest.mark.parametrize("way", [[1.0, 0.0, 0.0], [1.0, 2.0, -2.0]], ids=["along x", "skew"])
def test_a_free_beam_has_six_rigid_motions_and_its_frequencies(way: list[float]) -> None:
    """Bending twice, twist and tension n pi c / L, of a slender round bar in any direction."""
    length = 0.8
    ends = [[0.3, 0.1, 0.2], list(np.array([0.3, 0.1, 0.2]) + length * np.array(way) / np.linalg.norm(way))]
    bar = gb.frame(ends, ROUND, STEEL, {}, elements=40)
    assert bar.rigid is not None
    assert bar.rigid.shape[1] == 6
    found = frequencies(bar, 40)
    slow = np.sqrt(E * SECOND / (RHO * A)) / length**2
    roots = [brentq(lambda b: np.cos(b) - 1 / np.cosh(b), (k + 0.5) * pi - 0.2, (k + 0.5) * pi + 0.2)
             for k in (1, 2, 3)]  # fmt: skip
    for k, b in enumerate(roots):
        assert found[2 * k : 2 * k + 2] == pytest.approx(slow * b * b, rel=1.5e-3)
    for speed, tight in ((np.sqrt(G * TWIST / (RHO * 2 * SECOND)), 3e-4), (np.sqrt(E / RHO), 3e-4)):
        assert np.abs(found / (pi * speed / length) - 1.0).min() < tight


def test_a_portal_frame_has_the_frequencies_of_its_equation() -> None:
    """Sway and symmetric modes of a clamped portal without tension, from dynamic stiffness in closed form.

    Legs and beam of length 1, E I = rho A = 1: joint rotation stiffness of a bar at wave number b.
    """
    length = 1.0
    thin = gb.SpaceSection(1.0, 1e3, 1e-4, 1e3)  # across the plane, along its thickness, it hardly bends
    corners = [[0, 0, 0], [0, 0, length], [length, 0, length], [length, 0, 0]]
    portal = gb.frame(corners, thin, gb.material(1e4, 1.0), {}, clamped=[0.0, 3.0 * length], up=[0.0, 1.0, 0.0],
                      elements=60)  # fmt: skip

    def stiff(b: float) -> tuple[float, float, float, float, float, float]:
        """Return s, t (near and far moment of a rotation), and moment and forces of a sway, E I = L = 1."""
        c, s, C, S = np.cos(b), np.sin(b), np.cosh(b), np.sinh(b)
        d = 1.0 - c * C
        near, far = b * (s * C - c * S) / d, b * (S - s) / d
        moment, over = b**2 * s * S / d, b**2 * (C - c) / d
        force, across = b**3 * (s * C + c * S) / d, b**3 * (s + S) / d
        return near, far, moment, over, force, across

    def sway(b: float) -> float:
        """Both joints turn alike and the beam sways as a mass: 2 x 2 determinant."""
        near, far, moment, _, force, _ = stiff(b)
        a11 = near + near + far
        return float(a11 * (2.0 * force - b**4) - 2.0 * moment**2)

    def symmetric(b: float) -> float:
        near, far, *_ = stiff(b)
        return near + near - far

    grid = np.linspace(0.3, 4.6, 3000)  # below the first mode of a bar that is clamped at both ends
    roots = []
    for equation in (sway, symmetric):
        values = np.array([equation(b) for b in grid])
        for i in np.flatnonzero(values[:-1] * values[1:] < 0.0):
            root = brentq(equation, grid[i], grid[i + 1])
            if abs(equation(root)) < 1.0:  # else a pole
                roots.append(root)
    assert frequencies(portal, 3) == pytest.approx(np.sort(roots)[:3] ** 2, rel=3e-3)
    assert np.sort(roots)[0] ** 2 == pytest.approx(3.2, rel=0.02)  # a textbook figure of this portal's sway


def test_a_ring_has_the_frequencies_of_its_plane_modes() -> None:
    """In its plane n (n^2 - 1) / sqrt(n^2 + 1), and out of it with twist; four bends whose ends are tied."""
    R = 0.5
    square = [[R, 0, 0], [R, R, 0], [-R, R, 0], [-R, -R, 0], [R, -R, 0], [R, 0, 0]]
    ring = gb.frame(square, ROUND, STEEL, {}, bends=R, flexibility=1.0, elements=88)
    K, M = np.asarray(ring.K), np.asarray(ring.M)
    n = len(K)
    Q = np.zeros((n, n - 6))
    Q[: n - 6] = np.eye(n - 6)
    Q[n - 6 :, :6] = np.eye(6)
    closed = gb.Structure(Q.T @ M @ Q, Q.T @ K @ Q)
    found = np.sqrt(np.abs(closed.modes[0]))[6:20]
    slow = np.sqrt(E * SECOND / (RHO * A)) / R**2
    nu = E * SECOND / (G * TWIST)
    for k in (2, 3, 4):
        inside = slow * k * (k**2 - 1) / np.sqrt(k**2 + 1)
        outside = slow * k * (k**2 - 1) / np.sqrt(k**2 + nu)
        for exact in (inside, outside):
            assert np.sort(np.abs(found / exact - 1.0))[1] < 4e-3, (k, exact)


def test_an_l_bends_and_twists_as_castigliano_says() -> None:
    """A force out of the plane of an L bends both legs and twists one; in its plane both bend, one is in tension."""
    a, b = 0.7, 0.4
    elbow = gb.frame([[0, 0, 0], [a, 0, 0], [a, b, 0]], ROUND, STEEL, {"tip": (a + b, np.eye(3))}, clamped=[0.0])
    found, bend = deflection(elbow, "tip"), 1.0 / (E * SECOND)
    assert found[2, 2] == pytest.approx(bend * (a**3 + b**3) / 3.0 + a * b**2 / (G * TWIST), rel=1e-8)
    assert found[0, 0] == pytest.approx(bend * (b**2 * a + b**3 / 3.0) + a / (E * A), rel=1e-8)
    assert found[1, 1] == pytest.approx(bend * a**3 / 3.0 + b / (E * A), rel=1e-8)
    assert found[0, 1] == pytest.approx(-bend * a**2 * b / 2.0, rel=1e-8)


def test_a_t_bends_and_twists_as_castigliano_says() -> None:
    """A beam on a thicker column: forces at its end bend, twist and compress both; the other arm only rides along."""
    a, h = 0.6, 0.9
    thick = gb.SpaceSection(4 * A, 16 * SECOND, 16 * SECOND, 16 * TWIST)
    column = gb.Member([[0, 0, 0], [0, 0, h]], thick, gb.material(7e10, 2700.0, 0.3))
    points = {"tip": ([a, 0, h], np.eye(3)), "other": (0.0, np.eye(3))}
    tee = gb.frame([[-0.5, 0, h], [a, 0, h]], ROUND, STEEL, points, branches=[column], clamped=[[0.0, 0.0, 0.0]])
    found, beam = deflection(tee, "tip"), 1.0 / (E * SECOND)
    bend, tension, twist = 1.0 / (7e10 * 16 * SECOND), 1.0 / (7e10 * 4 * A), 1.0 / (7e10 / 2.6 * 16 * TWIST)
    assert found[0, 0] == pytest.approx(bend * h**3 / 3 + a / (E * A), rel=1e-8)
    assert found[1, 1] == pytest.approx(beam * a**3 / 3 + bend * h**3 / 3 + twist * a**2 * h, rel=1e-8)
    assert found[2, 2] == pytest.approx(beam * a**3 / 3 + bend * a**2 * h + tension * h, rel=1e-8)
    assert found[0, 2] == pytest.approx(-bend * a * h**2 / 2, rel=1e-8)
    lifted = tee["other"].rows @ np.linalg.solve(dense(tee.K), tee["tip"].rows[2])
    assert lifted[2] == pytest.approx(tension * h - bend * a * h * 0.5, rel=1e-8)


def test_hinged_ends_bend_freely() -> None:
    """Two cantilevers that a hinge joins share a force; between hinges a member is a beam on two supports."""
    ends = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    far = gb.Member([[0.4, 0, 0], [1, 0, 0]], ROUND, STEEL, hinged=("start",))
    pair = gb.frame([ends[0], [0.4, 0, 0]], ROUND, STEEL, {"hinge": ([0.4, 0, 0], np.eye(3))}, branches=[far],
                    clamped=ends)  # fmt: skip
    found = deflection(pair, "hinge")
    bending = 1.0 / (3 * E * SECOND / 0.4**3 + 3 * E * SECOND / 0.6**3)
    assert found == pytest.approx(np.diag([0.4 * 0.6 / (E * A), bending, bending]), rel=1e-8, abs=1e-8 * bending)
    stubs = [[-0.01, 0, 0], [1.01, 0, 0]]
    beam = gb.Member(ends, ROUND, STEEL, hinged=("start", "end"))
    other = gb.Member([ends[1], stubs[1]], ROUND, STEEL)
    held = gb.frame([stubs[0], ends[0]], ROUND, STEEL, {"mid": ([0.5, 0, 0], Z)}, branches=[beam, other],
                    clamped=[*stubs, *ends])  # fmt: skip
    assert deflection(held, "mid")[0, 0] == pytest.approx(1.0 / (48 * E * SECOND), rel=1e-8)
    w = (np.pi * np.arange(1, 4)) ** 2 * np.sqrt(E * SECOND / (RHO * A))
    assert frequencies(held, 6) == pytest.approx(np.repeat(w, 2), rel=1.5e-3)
    free = gb.frame([ends[0], [0.4, 0, 0]], ROUND, STEEL, {}, branches=[far])
    assert np.count_nonzero(free.modes[0] < 1e-6 * free.modes[0][10]) == 8  # rigid motions, and two of the hinge


def test_members_are_the_frame_of_one_route() -> None:
    """A portal of three members whose ends meet has the frequencies of one route; its weight is that of all members."""
    corners = [[0.0, 0, 0], [0.0, 0, 1.0], [1.2, 0, 1.0], [1.2, 0, 0]]
    one = gb.frame(corners, ROUND, STEEL, {}, clamped=[0.0, 3.2], elements=32)
    legs = [gb.Member(corners[k : k + 2], ROUND, STEEL) for k in (0, 2)]
    three = gb.frame(corners[1:3], ROUND, STEEL, {}, branches=legs, clamped=[corners[0], corners[3]], elements=32)
    assert three.size == one.size
    assert frequencies(three, 20) == pytest.approx(frequencies(one, 20), rel=1e-9)
    free = gb.frame(corners[1:3], ROUND, STEEL, {}, branches=legs)
    assert free.rigid is not None
    assert free.rigid.shape[1] == 6
    assert free.inertia is not None
    assert np.asarray(free.rigid)[:, 2] @ free.inertia[:, 2] == pytest.approx(3.2 * RHO * A, rel=1e-12)


def test_a_preload_stiffens_and_buckles_as_strings_and_columns() -> None:
    """Pinned: (n pi/L)^4 EI/m (1 + N/N_n), N_n = EI (n pi/L)^2; static sag of a string that bends; Euler's load."""
    length, plane = 2.0, gb.CrossSection(A, SECOND)
    turns, critical = np.arange(1, 5) * pi / length, E * SECOND * (pi / length) ** 2
    for tension in (-0.5 * critical, 0.0, 3.0 * critical, 1e3 * critical):
        held: dict[str, Any] = {"pinned": [0.0, length], "tension": tension}
        wire = gb.beam(length, plane, STEEL, {"mid": 1.0}, **held)
        wanted = np.sqrt(turns**2 / (RHO * A) * (turns**2 * E * SECOND + tension))
        assert frequencies(wire, 4) == pytest.approx(wanted, rel=1e-4)
    stiff = 0.5 * length * np.sqrt(tension / (E * SECOND))
    sag = 0.25 * length / tension * (1.0 - np.tanh(stiff) / stiff)
    assert deflection(wire, "mid")[0, 0] == pytest.approx(sag, 1e-3)
    gb.beam(length, plane, STEEL, {}, pinned=[0.0, length], tension=-0.999 * critical)
    with pytest.raises(gb.UserError, match="under which it buckles"):
        gb.beam(length, plane, STEEL, {}, pinned=[0.0, length], tension=-1.001 * critical)
    assert gb.beam(length, plane, STEEL, {}, tension=1.0).rigid.shape[1] == 1  # type: ignore[union-attr]


def test_a_tie_rod_of_a_frame_and_its_fluid() -> None:
    """A clamped member against the plane beam with the same preload; fluid without weight, and none along the axis."""
    ends, points = [[0.2, 0, 0], [0.2, 1.5, 0]], {"mid": (0.7, [0, 0, 1]), "along": (0.7, [0, 1, 0])}
    given: dict[str, Any] = {"clamped": [0.0, 1.5], "tension": 300.0, "added_mass": 0.2}
    rod = gb.frame(ends, ROUND, STEEL, points, **given)
    wire = gb.beam(1.5, gb.CrossSection(A, SECOND), STEEL, {"mid": 0.7}, **given)
    assert frequencies(rod, 8)[::2] == pytest.approx(frequencies(wire, 4), rel=1e-5)
    assert deflection(rod, "mid") == pytest.approx(deflection(wire, "mid"), rel=1e-5)
    dry = gb.frame(ends, ROUND, STEEL, points, clamped=[0.0, 1.5])
    assert rod.inertia == pytest.approx(dry.inertia)
    assert dense(rod.M) @ rod["along"].rows[0] == pytest.approx(dense(dry.M) @ dry["along"].rows[0])
    for slip, words in (({"tension": -900.0}, "buckles"), ({"clamped": []}, "tilts as a whole")):
        with pytest.raises(gb.UserError, match=words):
            gb.frame(ends, ROUND, STEEL, points, **(given | slip))
    with pytest.raises(gb.UserError, match="compression of 1e\\+06 N") as refused:
        gb.frame(ends, ROUND, STEEL, points, **given, branches=[gb.Member([[0, 0, 0], [0.2, 0, 0]], ROUND, STEEL,
                                                                          tension=-1e6)])  # fmt: skip
    assert getattr(refused.value, "argument", "") == "members.0.tension"


@pytest.mark.parametrize("length", [2.0, 2e-3])
@pytest.mark.parametrize("way", [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 2.0, -0.5]])
def test_a_string_in_space_may_spin_about_its_axis(length: float, way: list[float]) -> None:
    """Pinned ends, or ends that slide along the axis, too: (pi/L)^2 (EI (pi/L)^2 + N)/(rho A) in both planes.

    Euler's load buckles it; an end that is free to swing is refused.
    """
    u = np.array(way) / np.linalg.norm(way)
    across = np.linalg.svd(u[None])[2][1:]
    d = 1e-3 * length
    section, area, bends = gb.space_section("round", d), pi * d**2 / 4.0, E * pi * d**4 / 64.0
    critical = bends * (pi / length) ** 2
    slides = {"pinned": [], "held": [(at, way) for at in (0.0, length) for way in across]}
    for supports, free in (({"pinned": [0.0, length]}, 1), (slides, 2)):
        given: dict[str, Any] = {**supports, "elements": 20}
        for share in (-0.999, -0.5, 100.0):
            wire = gb.frame([[0, 0, 0], length * u], section, STEEL, {}, tension=share * critical, **given)
            squares = (pi / length) ** 2 * (1.0 + share) * critical / (RHO * area)
            assert wire.rigid is not None
            assert wire.rigid.shape[1] == free
            assert wire.modes[0][free : free + 2] == pytest.approx(
                2 * [squares], rel=1e-5 * max(1.0, 1.0 / (1.0 + share))
            )
        with pytest.raises(gb.UserError, match="buckles"):
            gb.frame([[0, 0, 0], length * u], section, STEEL, {}, tension=-1.001 * critical, **given)
    with pytest.raises(gb.UserError, match="tilts as a whole"):
        gb.frame([[0, 0, 0], length * u], section, STEEL, {}, tension=critical, pinned=[0.0])


def test_a_grid_is_that_of_a_direct_stiffness_script() -> None:
    """Two crossed beams in two halves each, clamped at four ends: dense blocks written out here, statics and modes."""
    ends, halves = [[-0.5, 0, 0], [0.7, 0, 0], [0, -0.4, 0], [0, 0.6, 0]], []
    for place in ends:  # stiffness of the free end of a clamped bar: w, turn about x, turn about y at the crossing
        x, y = np.array(place[:2]) / np.hypot(*place[:2])
        L = float(np.hypot(*place[:2]))
        bend, twist = E * SECOND, G * TWIST / L
        k_w, k_c, k_t = 12 * bend / L**3, 6 * bend / L**2, 4 * bend / L
        # the bar runs from the crossing along (x, y): a deflection w and slope w' = (turn) . (y, -x)
        slope, spin = np.array([0.0, y, -x]), np.array([0.0, x, y])
        up = np.array([1.0, 0.0, 0.0])
        halves.append(k_w * np.outer(up, up) + k_c * (np.outer(up, slope) + np.outer(slope, up))
                      + k_t * np.outer(slope, slope) + twist * np.outer(spin, spin))  # fmt: skip
    flexible = np.linalg.inv(sum(halves))[0, 0]
    cross = gb.Member(ends[2:], ROUND, STEEL)
    middle = gb.Member([[0, 0, 0], [0, 0, 0.3]], ROUND, STEEL)  # a stub, whose end lies on both axes
    grid = gb.frame(ends[:2], ROUND, STEEL, {"mid": ([0, 0, 0], Z)}, branches=[cross, middle], clamped=ends)
    assert deflection(grid, "mid")[0, 0] == pytest.approx(flexible, rel=1e-8)


@pytest.mark.parametrize("factor", [1.0, None, 7.5], ids=["1", "by the formula", "given"])
def test_an_elbow_is_as_soft_as_castigliano_says(factor: float | None) -> None:
    """A quarter bend of a tube between legs: integrals of moment, twist and tension, bending times the factor."""
    outer, wall, R, leg = 0.06, 0.003, 0.09, 0.25
    tube = gb.space_section("tube", outer, wall=wall)._replace(shear_area=np.inf, lateral_shear_area=np.inf)
    mean = 0.5 * (outer - wall)
    k = 1.65 / (wall * R / mean**2) if factor is None else factor
    assert tube.flexibility(R) == pytest.approx(1.65 * 0.0285**2 / (0.003 * 0.09), rel=1e-12)
    corner = leg + R
    second, twist = tube.second_moment, tube.torsion_constant
    assert second == pytest.approx(pi / 64 * (outer**4 - (outer - 2 * wall) ** 4), rel=1e-9)
    assert twist == pytest.approx(2.0 * second, rel=1e-6)
    errors = []
    for elements in (20, 200):
        pipe = gb.frame([[0, 0, 0], [corner, 0, 0], [corner, corner, 0]], tube, STEEL,
                        {"tip": (2 * leg + pi / 2 * R, np.eye(3))}, clamped=[0.0], bends=R, flexibility=factor,
                        elements=elements)  # fmt: skip
        found = deflection(pipe, "tip")

        def on_bend(f: Any) -> float:
            return float(quad(f, 0.0, pi / 2)[0]) * R

        # a force along z at (corner, corner): arms of places on the bend at (leg + R sin t, R - R cos t)
        out = leg**3 / 3 / (E * second)  # last leg
        out += on_bend(lambda t: k * (leg * np.cos(pi / 2 - t) + R * np.sin(pi / 2 - t)) ** 2) / (E * second)
        out += on_bend(lambda t: (leg * np.sin(pi / 2 - t) + R * (1 - np.cos(pi / 2 - t))) ** 2) / (G * twist)
        out += quad(lambda x: (R + x) ** 2, 0.0, leg)[0] / (E * second) + (leg + R) ** 2 * leg / (G * twist)
        plane = leg**3 / 3 / (E * second)  # a force along x: moment is the distance along y
        plane += on_bend(lambda t: k * (leg + R * np.cos(t)) ** 2) / (E * second) + (leg + R) ** 2 * leg / (E * second)
        plane += (leg + on_bend(lambda t: np.cos(t) ** 2)) / (E * tube.area)
        errors.append([abs(found[2, 2] / out - 1.0), abs(found[0, 0] / plane - 1.0)])
    assert np.max(errors[0]) < 3e-3
    assert np.max(errors[1]) < 1e-4


def test_supports_hold_in_the_directions_that_they_are_given() -> None:
    """A skew guide carries its part of the weight; a free pipe falls with all of it."""
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    points = {"end": (2.0, Z), "mid": ([1, 0, 0], np.eye(3)[:2])}
    pipe = gb.frame(corners, ROUND, STEEL, points, clamped=[0.0], held=[(2.0, [0.0, 3.0, 4.0])], name="pipe")
    load = gb.weight(pipe, -9.81, Z)
    u = np.linalg.solve(np.asarray(pipe.K), -9.81 * load.pattern)
    full = gb.frame(corners, ROUND, STEEL, {"end": (2.0, [[0.0, 3.0, 4.0], [0.0, 4.0, -3.0]])},
                    clamped=[0.0])  # fmt: skip
    force = np.linalg.solve(np.asarray(full.K), -9.81 * gb.weight(full, 1.0, Z).pattern)
    flexibility = deflection(full, "end")
    first, second = full["end"].rows @ force
    held = second - flexibility[1, 0] / flexibility[0, 0] * first  # the guide takes what moves along it
    along = np.array([0.0, 4.0, -3.0]) / 5.0
    assert float((pipe["end"].rows @ u)[0]) == pytest.approx(held * along[2], rel=1e-8)
    free = gb.frame(corners, ROUND, STEEL, {"end": (2.0, Z)})
    assert gb.weight(free, 1.0, Z).pattern @ np.asarray(free.rigid)[:, 2] == pytest.approx(2.0 * RHO * A, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"route": [[0, 0, 0]]}, "two corners"),
        ({"route": [[0, 0, 0], [0, 0, 0], [1, 0, 0]]}, "length 0"),
        ({"route": [[0, 0, 0], [1, 0, 0], [0.5, 0, 0]]}, "turns back"),
        ({"bends": 3.0}, "for the bends at its ends"),
        ({"bends": [0.1, 0.1]}, "one for each of 1 corner"),
        ({"points": {"tip": (9.0, Z)}}, "from 0 to 2 m"),
        ({"points": {"tip": (1.0, [0, 0, 0])}}, "not all 0"),
        ({"points": {"tip": (1.0, [[1, 0, 0], [1, 1, 0]])}}, "right angles"),
        ({"flexibility": 0.0}, "above 0"),
        ({"branches": [gb.Member([[0, 0.1, 0], [0, 1, 0]], ROUND, STEEL)]}, "member 1 whose nearest end is 0.1 m"),
        ({"branches": [gb.Member([[0, 0, 0], [0, 0, 0]], ROUND, STEEL)]}, "member 1: found a leg of length 0"),
        ({"branches": [gb.Member([[1, 1, 0], [1, 2, 0]], ROUND, STEEL, hinged=("stop",))]}, "'stop' hinged"),  # type: ignore[arg-type]
        ({"up": [0.0, 1.0, 0.0], "section": gb.SpaceSection(1e-4, 1e-9, 2e-9, 1e-9)}, "along up"),
    ],
)
def test_frames_that_cannot_be_are_refused(change: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {
        "route": [[0, 0, 0], [1, 0, 0], [1, 1, 0]],
        "section": ROUND,
        "material": STEEL,
        "points": {},
    }
    with pytest.raises(gb.UserError, match=words):
        gb.frame(**given | change)


def test_the_nearest_place_of_a_route_is_exact() -> None:
    """On a leg by projection, on a bend toward its center, at an end beyond it."""
    route = FrameRoute([[0, 0, 0], [1, 0, 0], [1, 1, 0]], 0.3, "pipe")
    assert route.length == pytest.approx(1.4 + 0.15 * pi, rel=1e-14)
    assert route.nearest(np.array([0.4, -0.2, 0.5])) == pytest.approx(0.4, rel=1e-14)
    assert route.nearest(np.array([0.7 + 0.1, 0.3 - 0.1, 7.0])) == pytest.approx(0.7 + 0.075 * pi, rel=1e-14)
    assert route.nearest(np.array([1.1, 3.0, 0.0])) == route.length
    assert route.at(0.7 + 0.075 * pi) == pytest.approx([0.7 + 0.3 * 0.5**0.5, 0.3 - 0.3 * 0.5**0.5, 0.0], rel=1e-14)
    assert route.parts[1].direction(0.7 + 0.075 * pi) == pytest.approx([0.5**0.5, 0.5**0.5, 0.0], rel=1e-14)


def route_file() -> dict[str, Any]:
    """Return a file of a clamped pipe in three legs, shaken along three directions, between two stops."""
    return {
        "structure": [
            {"name": "pipe", "model": {"type": "frame", "route": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
                                       "bend_radius": 0.1, "thickness": 0.04, "elements": 12,
                                       "section": {"type": "tube", "wall": 0.002},
                                       "material": {"young_modulus": 2e11, "poisson_ratio": 0.3, "density": 7800.0}}},
        ],
        "point": [{"name": "mid", "structure": "pipe", "nearest": [1, 0.5, 0], "direction": [1, 0, 0]}],
        "joint": [
            {"type": "clamped", "structure": "pipe", "at": 0.0},
            {"type": "held", "structure": "pipe", "nearest": [1, 1, 1], "direction": [0, 1, 0]},
        ],
        "pair": [{"name": "stop", "between": ["pipe.mid"], "region": {"type": "slot", "clearance": 1e-3},
                  "law": {"type": "kelvin-voigt", "stiffness": 1e6}}],
        "load": [
            {"type": "gravity"},
            {"type": "base_motion", "name": "x", "direction": [1, 0, 0], "amplitude": 30.0, "frequency": 9.0},
            {"type": "base_motion", "name": "y", "direction": [0, 2, 0], "amplitude": 20.0, "frequency": 7.0},
            {"type": "base_motion", "name": "z", "direction": [0, 0, 1], "amplitude": 10.0, "frequency": 5.0},
        ],
        "time": {"step": 2e-4, "end": 0.2, "scheme": "newmark"},
    }  # fmt: skip


def test_a_pipe_route_under_a_record_follows_a_script_on_its_matrices(tmp_path: Path) -> None:
    """Three elbows, two supports with play, a snubber, three recorded directions: the midpoint rule in numpy, 1e-6."""
    rows = np.random.default_rng(3).normal(0.0, [20.0, 15.0, 10.0], (60, 3))
    np.savetxt(tmp_path / "ground.csv", np.column_stack([5e-3 * np.arange(60), rows]), delimiter=",", header="t,x,y,z")
    given = route_file()
    given["structure"][0]["model"]["route"].append([2, 1, 1])
    given["point"].append({"name": "rest", "structure": "pipe", "nearest": [0.5, 0, 0], "direction": Z})
    given["point"].append({"name": "brake", "structure": "pipe", "nearest": [1, 1, 0.5], "direction": [0, 1, 0]})
    given["joint"][1]["nearest"] = [2, 1, 1]
    given["joint"].append({"type": "snubber", "name": "brake", "between": ["pipe.brake"], "velocity": 0.05,
                           "release": 0.02, "stiffness": 2e5, "damping": 50.0, "drag": 5.0})  # fmt: skip
    given["pair"].append({"name": "rest", "between": ["pipe.rest"], "law": {"type": "kelvin-voigt", "stiffness": 2e6},
                          "region": {"type": "half-plane", "clearance": 1e-4, "normal": -1}})  # fmt: skip
    given["load"] = [{"type": "gravity"}] + [
        {"type": "recorded_motion", "name": axis, "direction": way, "file": str(tmp_path / "ground.csv"),
         "value_column": axis} for axis, way in zip("xyz", np.eye(3).tolist(), strict=True)
    ]  # fmt: skip
    scene = gb.scene(given)
    pipe, h, steps = scene.structures[0], 2e-4, 800
    M, K = dense(pipe.M), dense(pipe.K)
    assert pipe.inertia is not None
    found = gb.history(scene, h, h * steps)
    record = CubicSpline(5e-3 * np.arange(60), rows)
    B = np.vstack([pipe[name].rows for name in ("mid", "rest", "brake")])
    inverse = np.linalg.inv(2 / h * M + 0.5 * h * K)
    mobility = B @ inverse @ B.T
    stores = (lambda x: 0.5e6 * max(abs(x) - 5e-4, 0.0) ** 2, lambda x: 1e6 * max(-x - 1e-4, 0.0) ** 2)
    u, v, anchor, motion, locks = np.zeros(len(M)), np.zeros(len(M)), None, [], 0
    for k in range(steps):
        x = B @ u

        def forces(w: np.ndarray, x: np.ndarray = x, anchor: float | None = anchor) -> np.ndarray:
            """Means over the step, which store what they work, for velocities of the points."""
            stops = [(f(x[i] + h * w[i]) - f(x[i])) / (h * w[i] or 1.0) for i, f in enumerate(stores)]
            held = 5.0 * w[2] if anchor is None else 2e5 * (x[2] + 0.5 * h * w[2] - anchor) + 50.0 * w[2]
            return -np.array([*stops, held])

        ground = [*record((k + 0.5) * h)[:2], record((k + 0.5) * h)[2] + 9.81]
        free = inverse @ (2 / h * M @ v - K @ u - pipe.inertia @ ground)
        at = root(lambda w, free=free, forces=forces: w - B @ free - mobility @ forces(w), B @ free, tol=1e-13)
        w = free + inverse @ B.T @ forces(at.x)
        u, v = u + h * w, 2 * w - v
        motion.append(B @ u)
        if anchor is None and abs(at.x[2]) >= 0.05:
            anchor, locks = motion[-1][2], locks + 1
        elif anchor is not None and abs(at.x[2]) <= 0.02:
            anchor = None
    own = np.transpose([found.displacement[name] for name in ("mid", "rest", "brake")])
    assert locks > 3
    assert all(np.any(found.force[name] != 0.0) for name in ("stop", "rest"))
    assert np.abs(own - motion).max() < 1e-6 * np.abs(motion).max()


def test_a_shaft_with_angular_play_stops_as_statics_say() -> None:
    """Twist of a clamped shaft by a moment: G J phi / L + k (phi - play / 2) = T; rotations are no displacements."""
    given = route_file()
    model = given["structure"][0]["model"] | {"route": [[0, 0, 0], [1, 0, 0]], "section": {"type": "round"}}
    given["structure"][0]["model"] = {key: value for key, value in model.items() if key != "bend_radius"}
    given["point"] = [{"name": "dog", "structure": "pipe", "at": 1.0, "about": [2, 0, 0]},
                      {"name": "mid", "structure": "pipe", "at": 1.0, "direction": [1, 0, 0]}]  # fmt: skip
    given["joint"], given["start"] = given["joint"][:1], {"state": "seat"}
    given["pair"] = [{"name": "stop", "between": ["pipe.dog"], "region": {"type": "slot", "clearance": 2e-3},
                      "law": {"type": "kelvin-voigt", "stiffness": 4e4}}]  # fmt: skip
    given["load"] = [{"type": "constant_force", "name": "moment", "point": "pipe.dog", "amplitude": 200.0}]
    scene = gb.scene(given)
    stiff = G * pi / 32 * 0.04**4
    turn = gb.history(scene, 1e-5, 1e-5, gb.seat(scene)).last["dog"].displacement
    assert turn == pytest.approx((200.0 + 4e4 * 1e-3) / (stiff + 4e4), rel=1e-6)
    assert turn > 1e-3
    given["pair"][0]["between"] = ["pipe.dog", "pipe.mid"]
    check_refused(given, '"stop".*between', "same directions")
    given["point"][0]["direction"] = [1, 0, 0]
    check_refused(given, '"dog".*direction', "an axis of rotation")


def branched_file() -> dict[str, Any]:
    """Return the pipe with a thinner branch at its second leg, whose end stands above a mass."""
    given = route_file()
    branch = {"structure": "pipe", "route": [[1, 0.5, 0], [1.4, 0.5, 0], [1.4, 0.5, 0.4]], "bend_radius": 0.05}
    given["member"] = [branch | {"thickness": 0.03, "section": {"type": "tube", "wall": 0.0015}}]
    given["structure"].append({"name": "box", "model": {"type": "mass", "mass": 2.0, "stiffness": 1e3},
                               "place": {"origin": [1.4, 0.5, 0.7]}})  # fmt: skip
    given["point"].append({"name": "tip", "structure": "pipe", "nearest": [1.4, 0.5, 0.4], "direction": [0, 1, 0]})
    given["pair"].append({"name": "lid", "between": ["pipe", "box"], "at": "nearest",
                          "law": {"type": "kelvin-voigt", "stiffness": 1e6}})  # fmt: skip
    return given


def test_members_of_a_file_are_branches() -> None:
    """As `gb.frame` makes them; what a member leaves out is as of its frame; pairs find its nearest place."""
    scene = gb.scene(branched_file())
    pipe = scene.structures[0]
    tube = {"material": gb.material(2e11, 7800.0, 0.3)}
    branch = gb.Member([[1, 0.5, 0], [1.4, 0.5, 0], [1.4, 0.5, 0.4]], gb.space_section("tube", 0.03, wall=0.0015),
                       bends=0.05, **tube)  # fmt: skip
    points: dict[str, Any] = {"mid": ([1, 0.5, 0], [1, 0, 0]), "tip": ([1.4, 0.5, 0.4], [0, 1, 0])}
    same = gb.frame([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]], gb.space_section("tube", 0.04, wall=0.002),
                    points=points, bends=0.1, clamped=[0.0], held=[([1, 1, 1], [0, 1, 0])], branches=[branch],
                    elements=12, **tube)  # fmt: skip
    assert frequencies(pipe, 6) == pytest.approx(frequencies(same, 6), rel=1e-9)
    assert deflection(pipe, "tip") == pytest.approx(deflection(same, "tip"), rel=1e-8)
    [lid] = [one for one in scene.contacts if one.name == "lid"]
    assert lid.region.values == pytest.approx((1.0, 0.0, 0.3), rel=1e-9)  # above the end of the branch
    assert gb.history(scene, 2e-4, 0.01).displacement["mid"].shape == (50,)


@pytest.mark.parametrize(
    ("key", "value", "where", "words"),
    [
        ("structure", "tube", "member.*structure", "which is no structure"),
        ("structure", "box", "member.*structure", "a model mass"),
        ("route", [[1, 0.6, 0.1], [1.4, 0.5, 0.3]], "member.*route", "from the others"),
        ("route", [[1, 0.5, 0], [1, 0.5, 0]], "member.*route", "length 0"),
        ("bend_radius", 0.6, "member.*bend_radius", "for the bends at its ends"),
        ("section", {"type": "tube", "wall": 0.02}, "member.*section", "wall"),
        ("hinged", ["middle"], "member.*hinged", "start"),
        ("tension", 5.0, "member.*tension", "a straight member"),
    ],
)
def test_slips_of_members_are_refused_by_their_key(key: str, value: Any, where: str, words: str) -> None:
    given = branched_file()
    given["member"][0][key] = value
    check_refused(given, where, words)


@pytest.mark.parametrize(
    ("path", "value", "where", "words"),
    [
        (("structure", 0, "model", "bend_radius"), 0.6, '"pipe".*bend_radius', "for the bends at its ends"),
        (("structure", 0, "model", "bend_radius"), [0.1], '"pipe".*bend_radius', "one for each of 2 corners"),
        (("structure", 0, "model", "route"), [[0, 0, 0], [1, 0, 0], [0, 0, 0]], '"pipe".*route', "turns back"),
        (("structure", 0, "place"), {}, '"pipe".*place', "leave place out"),
        (("point", 0), {"name": "mid", "structure": "pipe", "at": 99.0, "direction": [1, 0, 0]}, '"mid"', "from 0 to"),
        (("point", 0), {"name": "mid", "structure": "pipe", "at": 1.0}, '"mid".*direction', "the key is missing"),
        (("joint", 1, "direction"), [0, 0, 0], "joint.*direction", "not all 0"),
        (("joint", 1, "at"), 1.0, "joint", "or nearest"),
        (("structure", 0, "model", "tension"), 10.0, '"pipe".*tension', "a straight member"),
        (("load", 1, "direction"), None, "load.*direction", "placed in space"),
    ],
)
def test_slips_of_frames_in_files_are_refused_by_their_key(
    path: tuple[Any, ...], value: Any, where: str, words: str
) -> None:
    given = route_file()
    put(*path, value=value)(given, Path())
    check_refused(given, where, words)


@pytest.mark.parametrize("scale", [0.2, 2.0])
@pytest.mark.parametrize("name", ["frame", "clamp", "nodes"])
def test_coordinates_in_another_unit_are_asked_about(name: str, scale: float, tmp_path: Path) -> None:
    """Millimeters took the end of the structure. Those that are beside it by less than its size are taken."""
    steel, place = gb.material(2e11, 7850.0), scale * np.array([0.9, 0.3, 0.0])

    def made(place: Any) -> gb.Structure:
        if name == "nodes":
            text = "".join(f"{k + 1} {scale * k / 10} 0 0\n" for k in range(11))
            (tmp_path / "nodes.txt").write_text(text, encoding="utf-8")
            (tmp_path / "rows.dof").write_text("".join(f"{k + 1}.2\n" for k in range(11)), encoding="utf-8")
            for stem, matrix in (("K", 2.0 * np.eye(11)), ("M", np.eye(11))):
                np.save(tmp_path / f"{stem}.npy", matrix)
            point = {"p": {"nearest": place, "direction": [0.0, 1.0, 0.0]}}
            files = (tmp_path / "K.npy", tmp_path / "M.npy")
            return gb.read_structure(
                *files, units="m-kg-s", dofs=tmp_path / "rows.dof", nodes=tmp_path / "nodes.txt", points=point
            )
        points = {"p": (place, [0.0, 1.0, 0.0])} if name == "frame" else {}
        held = [place] if name == "clamp" else [0.0]
        return gb.frame([[0, 0, 0], [scale, 0, 0]], ROUND, steel, points, clamped=held, elements=10)

    made(place.tolist())
    with pytest.raises(gb.UserError, match=r"m away from the structure, expected some within .* are they in m\?"):
        made((1e3 * place).tolist())
