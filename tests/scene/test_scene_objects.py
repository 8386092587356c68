"""Own laws and regions, ensembles, seats, periodic responses and feedback of scenes; and nonsense, which is refused."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from math import pi, sqrt
from pathlib import Path

import numba
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import gapbeam as gb
from gapbeam.solver.scene import object_code
from gapbeam.solver.scene.linear_scheme import LinearScheme
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.object_code import address
from gapbeam.solver.scene.shipped_laws import check_law
from gapbeam.solver.scene.touch_kernel import SIGNATURE
from tests.shared.command import PROJECT


@gb.law(potential=lambda x, stiffness, scale: stiffness * scale**2 * (np.cosh(x / scale) - 1.0))
def Hardening(x, stiffness, scale):  # noqa: N802
    return stiffness * scale * np.sinh(x / scale)


def ellipse_distance(x, y, a, b):
    f, slope = (x / a) ** 2 + (y / b) ** 2 - 1.0, 2.0 * np.sqrt((x / a**2) ** 2 + (y / b**2) ** 2)
    return f / (slope + 1e-12)


ellipse = gb.region(ellipse_distance, name="ellipse")


@gb.region
def circle(x, y, r):
    return np.sqrt(x * x + y * y + 1e-300) - r


@pytest.mark.slow(minutes=0.3)
def test_an_own_spring_gives_the_duration_of_its_contact() -> None:
    """A mass meets a spring K s sinh(x / s); the time in contact is 2 int dx / v(x), by quadrature."""
    stiff, scale, speed = 1e5, 1e-4, 1.0
    one = gb.mass(1.0)
    wall = gb.Contact(one["at"], gb.HalfPlane(0.0), Hardening(stiffness=stiff, scale=scale), name="wall")
    scene = gb.Scene(one, contacts=[wall])
    found = gb.history(scene, 1e-6, 0.01, scene.state(velocity={one: speed}))
    deep = scale * np.arccosh(1.0 + 0.5 * speed**2 / (stiff * scale**2))

    def slowness(angle: float) -> float:
        x = deep * np.sin(angle)
        left = speed**2 - 2 * stiff * scale**2 * (np.cosh(x / scale) - 1.0)
        return float(deep * np.cos(angle) / sqrt(max(left, 1e-300)))

    duration = 2.0 * quad(slowness, 0.0, 0.5 * pi - 1e-9)[0]
    assert np.count_nonzero(found.force["wall"]) * 1e-6 == pytest.approx(duration, abs=3e-6)
    assert found.last["at"].velocity == pytest.approx(-speed, abs=1e-9)
    assert found.displacement["at"].max() == pytest.approx(deep, rel=1e-6)
    linear = gb.Contact(one["at"], gb.HalfPlane(0.0), gb.KelvinVoigt(stiffness=stiff), name="wall")
    soft = gb.history(gb.Scene(one, contacts=[linear]), 1e-6, 0.01, scene.state(velocity={one: speed}))
    assert np.count_nonzero(soft.force["wall"]) > 2 * np.count_nonzero(found.force["wall"])


@pytest.mark.parametrize("share", [0.4, 0.0, -0.5, 0.5001])
def test_a_potential_that_is_no_integral_of_its_spring_is_refused(share: float) -> None:
    @gb.law(potential=lambda x, stiffness: share * stiffness * x * x)
    def Wrong(x, stiffness):  # noqa: N802
        return stiffness * x

    one = gb.mass(1.0)
    with pytest.raises(gb.UserError, match=r"law Wrong: .*integral of"):
        gb.Contact(one["at"], gb.HalfPlane(0.0), Wrong(stiffness=1e3))


def power(n: float) -> tuple[Callable[[float, float], float], Callable[[float, float], float]]:
    """Return k x^n and its integral."""
    return lambda x, k: k * x**n, lambda x, k: k * x ** (n + 1) / (n + 1)


TRUE_LAWS = {
    **{f"power {n}": power(n) for n in (1, 1.5, 3, 12)},
    "sinh": (lambda x, k: k * np.sinh(x / 0.01), lambda x, k: 0.01 * k * (np.cosh(x / 0.01) - 1.0)),
    "exponential": (lambda x, k: k * (np.exp(x) - 1.0), lambda x, k: k * (np.exp(x) - 1.0 - x)),
    "two slopes": (
        lambda x, k: k * x if x < 1e-3 else k * (9.0 * x - 8e-3),
        lambda x, k: 0.5 * k * x * x if x < 1e-3 else k * (4.5 * x * x - 8e-3 * x + 4e-6),
    ),
    "a spring that ends": (lambda x, k: k * x / (0.1 - x), lambda x, k: k * (-x - 0.1 * np.log(1.0 - x / 0.1))),
}


@pytest.mark.parametrize("name", TRUE_LAWS)
@pytest.mark.parametrize("share", [1.0, 1.001])
def test_a_potential_is_accepted_where_it_is_the_integral_and_refused_a_thousandth_beside(
    name: str, share: float
) -> None:
    """Steep powers, kinks, poles and potentials without digits at small penetrations."""
    spring, potential = TRUE_LAWS[name]
    compiled = numba.njit(potential)
    law = gb.law(potential=lambda x, k: share * compiled(x, k))(spring)(k=1e6)
    if share == 1.0:
        check_law(law)
        return
    with pytest.raises(gb.UserError, match="integral of the spring"):
        check_law(law)


@pytest.mark.parametrize("size", [2.0**-14, 1.0, 2.0**10, 2.0**30])
def test_a_potential_is_judged_alike_at_every_size(size: float) -> None:
    """A second slope that the potential leaves out is found wherever it begins, and accepted where it is there."""
    corner = 1e-3 * size

    def spring(x: float, k: float) -> float:
        return k * x if x < corner else k * (9.0 * x - 8.0 * corner)

    @numba.njit  # type: ignore[untyped-decorator]
    def first(x: float, k: float) -> float:
        return 0.5 * k * x * x

    def both(x: float, k: float) -> float:
        return first(x, k) if x < corner else k * (4.5 * x * x - 8.0 * corner * x + 4.0 * corner * corner)

    check_law(gb.law(potential=both)(spring)(k=1e6))
    with pytest.raises(gb.UserError, match="integral of the spring"):
        check_law(gb.law(potential=first)(spring)(k=1e6))


def test_an_own_region_moves_as_the_one_that_it_repeats() -> None:
    """A circle from its distance against the disc, and an ellipse that keeps energy."""
    one, ends = gb.mass(0.2, motions=2), []
    for region in (gb.Disc(1e-3), circle(r=1e-3)):
        hole = gb.Contact(one["at"], region, gb.KelvinVoigt(stiffness=1e6, damping=5.0))
        scene = gb.Scene(one, contacts=[hole], loads=[gb.Force(one["at"], -1.9, [0.0, 1.0])])
        found = gb.history(scene, 1e-5, 0.05, scene.state(velocity={one: [0.1, 0.0]}))
        ends.append(found.displacement["at"])
    assert np.abs(ends[0] - ends[1]).max() < 1e-3 * np.abs(ends[0]).max()
    free = gb.Scene(one, contacts=[gb.Contact(one["at"], ellipse(a=1e-3, b=0.7e-3), gb.KelvinVoigt(stiffness=1e6))])
    for step in gb.march(free, 1e-5, 0.5, free.state(velocity={one: [0.1, 0.03]}), every=1000):
        assert step.balance == pytest.approx(0.1 * (0.01 + 0.0009), rel=1e-9)


def test_a_controller_that_sets_a_force_between_steps_acts_as_the_spring_that_it_repeats() -> None:
    """A force that is set from the displacement gives the frequency of its spring, to the delay of a step."""
    one = gb.mass(1.0)
    push = gb.Force(one["at"], 0.0, name="push")
    scene = gb.Scene(one, loads=[push])
    times, places = [], []
    for step in gb.march(scene, 1e-4, 1.0, scene.state(velocity={one: 1.0})):
        push.value = -400.0 * step["at"].displacement
        times.append(step.t)
        places.append(step["at"].displacement)
    assert (
        np.abs(np.array(places) - np.sin(20.0 * np.array(times)) / 20.0).max() < 6e-4
    )  # it acts half a step late: exp(w^2 h t / 4)


def two_gaps(clearance: object = 1e-4, friction: object = 0.0) -> gb.Scene:
    modes = np.arange(6) + 0.5
    shapes = sqrt(2) * np.sin(np.outer([0.31, 0.74, 1.0], modes) * pi)
    tube = gb.from_modes(2 * pi * 40 * modes**1.5, 0.01, {"left": shapes[0], "right": shapes[1], "tip": shapes[2]})
    pin = gb.mass(0.3, motions=2, stiffness=500.0, damping=0.1, name="pin")
    law = gb.KelvinVoigt(stiffness=1e6, damping=20.0)
    contacts = [gb.Contact(tube[name], gb.Slot(clearance), law, name=name) for name in ("left", "right")]
    hole = gb.HuntCrossley(stiffness=1e7, chi=0.5)
    contacts.append(gb.Contact(pin["at"], gb.Disc(1e-3), hole, friction=friction, sliding=1e-3, name="hole"))
    loads: list[gb.Load] = [gb.Force(tube["tip"], lambda t, size: size * np.sin(200 * t), name="shaker", size=30.0)]
    loads.append(gb.Force(pin["at"], lambda t: 2 * np.sin(40 * t), [1.0, 0.4]))
    return gb.Scene(tube, pin, contacts=contacts, loads=loads)


def test_members_of_an_ensemble_move_as_they_do_alone() -> None:
    """Clearance, friction and force of 70 drawn members, two blocks of lanes, against single marches."""
    draw = np.random.default_rng(5)
    values = {
        "left.clearance": draw.uniform(5e-5, 3e-4, 70),
        "hole.friction": draw.uniform(0.05, 0.4, 70),
        "hole.clearance": draw.uniform(5e-4, 2e-3, 70),
        "shaker.size": draw.uniform(10.0, 60.0, 70),
    }
    scene = two_gaps(friction=0.1)
    many = gb.ensemble(scene, values, step=1e-4, end=0.1)
    assert not many.failed.any()
    assert many.peak["at"].shape == (2, 70)
    assert np.abs(many.balance).max() < 1e-10 * many.energy["loads"].max()
    for i in (0, 3, 63, 64, 69):
        alone = scene.with_({path: float(value[i]) for path, value in values.items()})
        found = gb.history(alone, 1e-4, 0.1)
        assert many.peak["tip"][i] == pytest.approx(np.abs(found.displacement["tip"]).max(), rel=1e-9)
        assert many.rms["tip"][i] == pytest.approx(sqrt(np.mean(found.displacement["tip"] ** 2)), rel=1e-9)
        assert many.energy["friction"][i] == pytest.approx(found.last.energy["friction"], rel=1e-7)


def test_a_beam_in_stops_rests_as_theory_says() -> None:
    """A clamped beam under its weight: w L^4 / (8 EI); with a stop at its tip: 3 w L / 8 there, less its softness."""
    length, width, thickness, young, density, g = 1.0, 0.02, 0.01, 2e11, 7800.0, 9.81
    section = gb.section("rectangle", thickness, width)
    slim = section._replace(shear_area=float("inf"))
    beam = gb.beam(length, slim, gb.material(young, density), {"tip": length, "middle": 0.5}, clamped=[0.0])
    w, bending = density * width * thickness * g, young * width * thickness**3 / 12
    weight = gb.weight(beam, -g)
    free = gb.seat(gb.Scene(beam, loads=[weight]))
    scene = gb.Scene(beam, loads=[weight])
    sag = scene.rows([beam["tip"]]) @ free.q
    assert float(sag[0, 0]) == pytest.approx(-w * length**4 / (8 * bending), rel=1e-9)
    stop = gb.Contact(beam["tip"], gb.HalfPlane(0.0, -1.0), gb.KelvinVoigt(stiffness=1e9), name="stop")
    seated = gb.seat(gb.Scene(beam, loads=[weight], contacts=[stop]))
    assert float(seated.F[0, 0]) == pytest.approx(3 * w * length / 8, rel=1e-4)  # stiffness of the stop


def test_a_structure_that_nothing_holds_has_no_seat_and_says_along_what_it_falls() -> None:
    a, b = gb.mass(1.0, name="held"), gb.mass(1.0, name="loose")
    law = gb.KelvinVoigt(stiffness=1e6)
    floor = [gb.Contact(one["at"], gb.HalfPlane(0.0, -1.0), law, name=f"floor {one.name}") for one in (a, b)]
    weights = [gb.Force(one["at"], -9.81) for one in (a, b)]
    assert gb.seat(gb.Scene(a, b, contacts=floor, loads=weights)).F[:, 0] == pytest.approx(9.81)
    with pytest.raises(gb.NoSeat, match="rigid motion of loose that no contact opposes") as refused:
        gb.seat(gb.Scene(a, b, contacts=floor[:1], loads=weights))
    assert refused.value.escape.motion[b][0] < 0.0
    assert refused.value.escape.power > 0.0


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("tilt", [0.0, 1e-12, 1e-9, 1e-3, 0.29, 0.3])
def test_a_block_on_a_plane_rests_unless_its_weight_pulls_it_along(tilt: float, friction: float) -> None:
    """Round-off of a direction moves it nowhere along the plane: by a spring of 0 it went 2e8 m.

    A tilt is refused where its tangent is above the coefficient of friction, 0.3 at 0.2915 rad.
    """
    block = gb.mass(2.0, motions=2, name="block")
    down = (np.sin(tilt), -np.cos(tilt))
    plane = gb.Contact(block["at"], gb.HalfPlane(0.0, down), gb.KelvinVoigt(stiffness=1e6),
                       friction=friction, name="plane")  # fmt: skip
    scene = gb.Scene(block, contacts=[plane], loads=[gb.Force(block["at"], 20.0, (0.0, -1.0), name="weight")])
    if tilt > 1e-6 and np.tan(tilt) > friction:
        with pytest.raises(gb.NoSeat, match=r"motion of block that (no contact opposes|contacts do not)") as refused:
            gb.seat(scene)
        along = refused.value.escape.motion[block]
        assert abs(along @ down) < 1e-9 * np.abs(along).max()
        return
    rest = gb.seat(scene)
    depth = 2e-5 * np.cos(tilt) * np.array(down)
    assert (scene.rows_at(block["at"]) @ rest.q)[:, 0] == pytest.approx(depth, abs=2e-5 * 1e-8)
    if tilt > 1e-6:
        assert rest.F[:, 0] == pytest.approx([0.0, 20.0], abs=1e-5)
        *_, step = gb.march(scene, 1e-4, 0.1, rest, every=100)
        assert step["at"].displacement == pytest.approx(depth, abs=2e-5 * 1e-6)


@pytest.mark.parametrize("ratio", [1e-8, 1e-10, 1e-11])
def test_a_weak_spring_holds_beside_a_stiff_one(ratio: float) -> None:
    """Of squared frequencies 1 : 1/ratio, the first still belongs to a spring: the seat is F / k."""
    soft, stiff = gb.mass(2.0, stiffness=2.0, name="soft"), gb.mass(1.0, stiffness=1.0 / ratio, name="stiff")
    rest = gb.seat(gb.Scene(soft, stiff, loads=[gb.Force(soft["at"], 3.0)]))
    assert gb.Scene(soft, stiff).rows([soft["at"]]) @ rest.q == pytest.approx(1.5)


def test_a_periodic_response_repeats_and_its_multipliers_have_the_product_of_its_damping() -> None:
    """The product of the multipliers of an oscillator is exp(-c T / m), whatever its elastic contact does."""
    one = gb.mass(1.0, stiffness=1.0, damping=0.2)
    stop = gb.Contact(one["at"], gb.HalfPlane(0.3), gb.KelvinVoigt(stiffness=10.0))
    scene = gb.Scene(one, contacts=[stop], loads=[gb.Force(one["at"], lambda t: np.cos(1.3 * t))])
    period = 2 * pi / 1.3
    for step in gb.march(scene, period / 400, 20 * period):
        near = step.state
    near.t = 0.0
    orbit = gb.periodic(scene, period, 400, near)
    assert orbit.is_stable
    assert float(np.prod(orbit.multipliers).real) == pytest.approx(np.exp(-0.2 * period), rel=2e-4)
    found = gb.history(scene, period / 400, 5 * period, orbit.state)
    x = found.displacement["at"]
    assert x[-1] == pytest.approx(x[399], abs=1e-8)
    assert found.t[-1] == pytest.approx(5 * period)


def test_feedback_keeps_the_stability_limit_of_the_linear_system_at_any_step() -> None:
    """M x'' + c x' + k x = g z, z' = -a z + x': stable below g = c a + ... by Routh, for coarse and fine steps."""
    m, c, k, a = 1.0, 0.2, 9.0, 2.0
    # s^3 m + s^2 (m a + c) + s (c a + k - g) + k a: stable for (m a + c) (c a + k - g) > m k a
    limit = c * a + k - m * k * a / (m * a + c)
    for g, grows in ((0.99 * limit, False), (1.01 * limit, True)):
        for h in (0.01, 0.2):
            one = gb.mass(m, stiffness=k, damping=c)
            drive = gb.Feedback(one["at"], one["at"], A=[[-a]], B=[[0.0, 1.0]], C=[[g]])
            scene = gb.Scene(one, feedbacks=[drive])
            end = round(200.0 / h) * h
            found = gb.history(scene, h, end, scene.state(velocity={one: 1.0}))
            x = np.abs(found.displacement["at"])
            early, late = x[: len(x) // 4].max(), x[-len(x) // 4 :].max()
            assert (late > early) == grows, (g, h)


def refusals() -> dict[str, tuple[object, str]]:
    one, flat = gb.mass(1.0, name="one"), gb.mass(1.0, motions=2, name="flat")
    law = gb.KelvinVoigt(stiffness=1e6)
    scene = gb.Scene(one, contacts=[gb.Contact(one["at"], gb.Slot(1e-3), law, name="stop")])
    return {
        "point": (lambda: one["tip"], "no point 'tip'; its points: at"),
        "shape": (lambda: gb.Structure(np.eye(2), np.eye(3)), r"found K of shape \(3, 3\), expected that of M"),
        "triangle": (lambda: gb.Structure(np.eye(2), [[1.0, 0.5], [0.0, 1.0]]), "complete an exported triangle"),
        "row": (lambda: gb.Structure(np.eye(3), np.eye(3), points={"p": [1.0, 2.0]}), "a row of 2 entries"),
        "number": (lambda: gb.Structure(np.eye(3), np.eye(3), points={"p": 3}), "expected numbers from 0 to 2"),
        "no mass": (lambda: gb.Structure(np.zeros((2, 2)), np.eye(2)).modes, "M is not positive definite"),
        "nan": (lambda: gb.Structure([[float("nan")]], [[1.0]]), "expected finite numbers"),
        "negative": (lambda: gb.Structure(np.eye(2), np.diag([1.0, -1.0])).modes, "K has a negative direction"),
        "member sliding": (
            lambda: scene.with_({"stop.sliding": [0.0, 1e-4]}),
            "0 in some members and above 0 in others",
        ),
        "member nan": (
            lambda: gb.ensemble(scene, {"stop.clearance": [1.0, float("nan")]}, step=1e-3, end=1.0),
            "expected finite numbers",
        ),
        "value": (lambda: scene.with_({"stop.clearance": "wide"}), "expected real numbers"),
        "strained": (lambda: gb.Structure(np.eye(2), np.eye(2), rigid=[[1.0], [1.0]]), "a rigid motion strains"),
        "motions": (lambda: gb.Contact(flat["at"], gb.Slot(1e-3), law), "of 2 motions, expected 1 motion for"),
        "no law": (lambda: gb.Contact(one["at"], gb.Slot(1e-3), gb.KelvinVoigt), "expected a law with its parameters"),
        "friction": (lambda: gb.Contact(one["at"], gb.Slot(1e-3), law, friction=0.1), "points of two or three motions"),
        "parameter": (lambda: gb.KelvinVoigt(stifness=1.0), "unknown stifness, missing stiffness"),
        "polygon": (lambda: gb.Polygon([[0, 0], [0, 1], [1, 0]]), "counter-clockwise"),
        "normal": (lambda: gb.HalfPlane(0.0, [0.0, 0.0]), "a vector of two or three numbers that is not 0"),
        "foreign": (lambda: gb.Scene(flat, loads=[gb.Force(one["at"], 1.0)]), "which is not of this scene"),
        "twice": (lambda: gb.Scene(one, gb.mass(1.0, name="one")), "the name 'one' is given twice"),
        "path": (
            lambda: scene.with_({"stopp.clearance": 1.0, "stop.gap": 1.0}),
            "(?s)'stopp.clearance'.*'stop.gap'.*no value",
        ),
        "step": (lambda: list(gb.march(scene, -1e-3, 1.0)), "expected a time above 0"),
        "end": (lambda: list(gb.march(scene, 1e-3, 0.0)), "at least one step"),
        "lengths": (
            lambda: gb.ensemble(scene, {"stop.clearance": [1.0, 2.0], "stop.stiffness": [1.0]}, step=1e-3, end=1.0),
            "one length for all values",
        ),
        "table": (
            lambda: gb.history(gb.Scene(one, loads=[gb.Force(one["at"], ([0.0, 0.5], [0.0, 1.0]))]), 1e-2, 1.0),
            "its table covers 0 to 0.5 s",
        ),
        "infinite": (
            lambda: gb.history(gb.Scene(one, loads=[gb.Force(one["at"], lambda t: 1.0 / (t - t))]), 1e-2, 1.0),
            "is not finite",
        ),
        "section": (lambda: gb.section("tube", 0.02, wal=1e-3), "wall: field required"),
        "material": (lambda: gb.material(-1.0, 7800.0), "young_modulus: found -1.0, expected greater than 0"),
        "order": (lambda: gb.material(2e11, 0.3, 7800.0), "poisson_ratio: found 7800.0, expected less than 0.5"),
        "off": (
            lambda: gb.beam(1.0, gb.section("round", 0.02), gb.material(2e11, 7800.0), {"tip": 1.5}),
            "expected places from 0 to 1 m",
        ),
        "frequency": (lambda: gb.from_modes([-1.0], 0.0, {}), "expected frequencies from 0 on"),
        "level": (lambda: gb.theta(0.3), "expected 0.5 to 1"),
        "period": (lambda: gb.periodic(scene, -1.0, 100), "expected one above 0 in 3 or more"),
    }


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", refusals())
def test_nonsense_is_refused_with_what_was_expected(name: str) -> None:
    call, words = refusals()[name]
    with pytest.raises(gb.UserError) as refused:
        call()  # type: ignore[operator]
    assert re.search(words, str(refused.value)), str(refused.value)


@given(
    type=st.sampled_from(["tube", "box"]),
    thickness=st.floats(1e-6, 10.0),
    share=st.floats(1e-6, 3.0),
)
def test_a_hollow_section_is_what_its_outside_leaves_of_its_hole_or_is_refused(
    type: str,  # noqa: A002
    thickness: float,
    share: float,
) -> None:
    """A^2 and I are differences of outside and hole; a wall that leaves no hole has no section."""
    wall = 0.5 * share * thickness
    if share >= 1.0:
        with pytest.raises(gb.UserError, match=f"section '{type}': wall: found"):
            gb.section(type, thickness, wall=wall)
        return
    inner, factor = thickness - 2.0 * wall, {"tube": pi / 64.0, "box": 1.0 / 12.0}[type]
    made = gb.section(type, thickness, wall=wall)
    assert made.second_moment == pytest.approx(factor * (thickness**4 - inner**4), rel=1e-9)
    assert 0.0 < made.area <= thickness**2


def test_a_beam_on_a_shaken_frame_moves_as_theory_says() -> None:
    """The modal mass of the first mode of a clamped beam under base acceleration is 0.6131 of the beam."""
    section = gb.section("rectangle", 0.01)._replace(shear_area=float("inf"))
    beam = gb.beam(1.0, section, gb.material(2e11, 8000.0), {"tip": 1.0}, clamped=[0.0], modes=1)
    carried = gb.BaseMotion(beam, 1.0).pattern
    assert float(carried[0] ** 2) / (8000.0 * 1e-4) == pytest.approx(0.6131, rel=2e-4)


@pytest.mark.parametrize(("held", "still"), [([], 2), ([0.3], 1)])
def test_free_and_pinned_beams_keep_their_rigid_motions(held: list[float], still: int) -> None:
    beam = gb.beam(1.0, gb.section("tube", 0.02, wall=1e-3), gb.material(2e11, 7800.0), {"tip": 1.0}, pinned=held)
    squares = beam.modes[0]
    assert np.count_nonzero(squares == 0.0) == still


@pytest.mark.parametrize(
    ("held", "factor"),
    [({"clamped": [0.0]}, 3.516015), ({"pinned": [0.0, 1.0]}, 9.869604), ({"clamped": [0.0, 1.0]}, 22.373285)],
)
def test_frequencies_of_slim_beams_are_those_of_theory(held: dict[str, list[float]], factor: float) -> None:
    """Factors of Euler and Bernoulli: Blevins (1979), table 8-1."""
    section = gb.section("rectangle", 1e-3)._replace(shear_area=float("inf"))
    beam = gb.beam(1.0, section, gb.material(2e11, 8000.0), {}, **held)
    w = factor * sqrt(2e11 * section.second_moment / (8000.0 * section.area))
    assert sqrt(beam.modes[0][0]) == pytest.approx(w, rel=3e-6)


def test_scenes_need_neither_dolfinx_nor_mpi_nor_gmsh() -> None:
    """The public nouns in a process that refuses to import them."""
    program = """
import sys
for name in ("dolfinx", "petsc4py", "slepc4py", "mpi4py", "gmsh", "ufl", "basix", "meshio", "pyvista", "vtk"):
    sys.modules[name] = None
import gapbeam as gb
one = gb.mass(1.0, stiffness=1.0)
scene = gb.Scene(one, contacts=[gb.Contact(one["at"], gb.Slot(0.1), gb.KelvinVoigt(stiffness=1e3))])
print(gb.history(scene, 1e-3, 1.0, scene.state(velocity={one: 1.0})).last.balance)
beam = gb.beam(1.0, gb.section("round", 0.02), gb.material(2e11, 7800.0), {"tip": 1.0})
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=PROJECT, timeout=300)
    assert run.returncode == 0, run.stderr
    assert float(run.stdout) == pytest.approx(0.5, abs=1e-12)


def test_a_march_that_fails_leaves_the_state_at_the_start_of_its_step() -> None:
    """A spring that gives no number beyond a depth: the step that fails is named, and time stands before it."""

    @gb.law(potential=lambda x, stiffness: 0.5 * stiffness * x * x if x < 1.5e-3 else float("nan"))
    def Broken(x, stiffness):  # noqa: N802
        return stiffness * x if x < 1.5e-3 else float("nan")

    one = gb.mass(1.0)
    wall = gb.Contact(one["at"], gb.HalfPlane(0.01), Broken(stiffness=1e4))
    scene = gb.Scene(one, contacts=[wall])
    marcher = Marcher(scene, 1e-4, scene.state(velocity={one: 1.0}))
    with pytest.raises(gb.NotConverged, match=r"step (\d+), t = .* did not converge") as failed:
        marcher.advance(1000)
    found = re.search(r"step (\d+)", str(failed.value))
    assert found is not None
    assert 100 < int(found[1]) < 200
    assert marcher.t == pytest.approx((int(found[1]) - 1) * 1e-4)
    assert np.isfinite(marcher.q).all()


def test_damaged_machine_code_is_compiled_anew(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    address(SIGNATURE, _halves)
    (kept,) = (tmp_path / "touches").iterdir()
    for damage in (b"", b"nonsense", kept.read_bytes()[:-100]):
        kept.write_bytes(damage)
        object_code._kept.clear()
        before = object_code.counts["compiled"]
        assert address(SIGNATURE, _halves) != 0
        assert object_code.counts["compiled"] == before + 1
    object_code._kept.clear()
    assert address(SIGNATURE, _halves) != 0
    assert object_code.counts["compiled"] == before + 1, "what was compiled anew is kept"


def _halves(h, count, workspace):
    for i in range(count):
        workspace[i] = 0.5 * h


def test_a_notebook_shows_what_a_scene_was_made_of() -> None:
    """Each value under the name that `with_` takes; one row for the points of a face; names are escaped."""
    body = gb.mass(2.0, stiffness=800.0, name="a <b>")
    at = body["at"]
    stops = [
        gb.Contact(at, gb.HalfPlane(clearance), gb.KelvinVoigt(stiffness=7e5), name=f"stop {number}")
        for number, clearance in enumerate((0.25e-3, 0.75e-3), 1)
    ]
    slot = gb.Contact(at, gb.Slot(np.array([1e-3, 3e-3])), gb.KelvinVoigt(stiffness=5e4, damping=2.0), offset=1e-5)
    loads = [
        gb.Force(at, gb.sine, amplitude=3.0, frequency=20.0, name="shaker"),
        gb.Force(at, 4.5, name="pull"),
        gb.Force(at, ([0.0, 2.0], [1.0, 5.0]), name="recorded"),
    ]
    scene = gb.Scene(body, contacts=[*stops, slot], loads=loads, joints=[gb.Joint(at, 10.0, 0.1, name="j")])
    shown = scene._repr_html_()
    rows = [re.findall("<t[dh]>(.*?)</t[dh]>", line) for line in shown.splitlines() if line.startswith("<tr>")]
    assert rows[1:] == [
        ["structure", "a &lt;b&gt;", "at", "1 DOF"],
        ["contact", "stop 1 to stop 2", "a &lt;b&gt;.at", rows[2][3]],
        ["contact", "contact 3", "a &lt;b&gt;.at", rows[3][3]],
        ["load", "shaker", "a &lt;b&gt;", "sine: amplitude 3, frequency 20"],
        ["load", "pull", "a &lt;b&gt;", "4.5 N"],
        ["load", "recorded", "a &lt;b&gt;", "table from 0 to 2 s"],
        ["joint", "j", "a &lt;b&gt;.at, by a &lt;b&gt;.at", ""],
    ]
    assert {"clearance 0.00025 to 0.00075", "KelvinVoigt: stiffness 700000"} <= set(re.split("[,;] ", rows[2][3]))
    assert (
        rows[3][3] == "Slot: clearance 0.001 to 0.003, center 0; KelvinVoigt: stiffness 50000, damping 2; offset 1e-05"
    )
    assert "3 contacts, 3 loads, 1 DOF&gt;" in shown


@pytest.mark.parametrize("exponent", [1.1, 1.5, 1.7, 2.5, 3.0])
@pytest.mark.parametrize("scheme", [gb.midpoint(), gb.euler()])
def test_laws_of_powers_are_not_asked_below_touch(exponent: float, scheme: LinearScheme) -> None:
    """A power of a negative number is no number: in flight such laws made it the force. Against the shipped law."""

    @gb.law(potential=lambda x, k, p: k * x ** (p + 1.0) / (p + 1.0))
    def power(x, k, p):
        return k * x**p

    one, k = gb.mass(1.0, stiffness=400.0, damping=2.0), 1e2 * 1e3**exponent
    known = gb.HuntCrossley(k, exponent=exponent)
    push = gb.Force(one["at"], lambda t: 2.0 * np.sin(25.0 * t))
    stops = (gb.Contact(one["at"], gb.Slot(2e-3), law) for law in (power(k=k, p=exponent), known))
    found = [gb.history(gb.Scene(one, contacts=[stop], loads=[push]), 1e-4, 1.0, scheme=scheme) for stop in stops]
    x, expected = (some.displacement["at"] for some in found)
    assert np.abs(expected).max() > 1.05e-3
    assert np.abs(x - expected).max() < 1e-5 * np.abs(expected).max()


def test_own_laws_and_regions_run_into_a_folder(tmp_path: Path) -> None:
    """Penetrations on record are those of the distance at the places, normals included: forces are the law's."""
    one = gb.mass(1.0, motions=2, stiffness=400.0, damping=2.0)
    hole = gb.Contact(one["at"], ellipse(a=2e-3, b=1e-3), gb.KelvinVoigt(1e6), name="hole")
    push = gb.Force(one["at"], lambda t: 2.0 * np.sin(25.0 * t), [0.6, 0.8])
    outcome = gb.run(gb.Scene(one, contacts=[hole], loads=[push]), step=1e-4, end=1.0, output=tmp_path / "run")
    assert outcome.exit_status == 0
    x, y = outcome.history.displacement.values[:, 0].T
    depth = outcome.history.penetration.values[:, 0]
    assert depth == pytest.approx(ellipse_distance(x, y, 2e-3, 1e-3), abs=1e-12)
    assert depth.max() > 0.0


@pytest.mark.parametrize("whole", [True, False])
def test_a_load_that_ignores_its_times_is_asked_at_each(whole: bool) -> None:
    """A number that a function draws was held over thousands of steps; a constant still is one."""
    draw, one = np.random.default_rng(7), gb.mass(1.0, stiffness=1.0)
    load = gb.Force(one["at"], lambda t: draw.normal(size=np.shape(t)) if whole else draw.normal())
    values = load.table(np.arange(2000) * 1e-3)[:, 0]
    assert values.std() == pytest.approx(1.0, rel=0.1)
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 0.1
    assert np.ptp(gb.Force(one["at"], lambda t: 5.0 + 0.0 * np.size(t)).table(np.arange(9.0))) == 0.0


@pytest.mark.parametrize("made", [
    gb.KelvinVoigt(1e5, 3.0), gb.HuntCrossley(1e8, chi=0.2), gb.Cubic(1e6, 1e-3), gb.Slot(2e-4), gb.Disc(1e-3),
    gb.Unilateral(restitution=0.5), Hardening(1e5, 1e-4), ellipse(2e-3, 1e-3), gb.HalfPlane(1e-3, [0.6, 0.8]),
])  # fmt: skip
def test_laws_and_regions_print_as_they_are_made(made: object) -> None:
    """With each of their values by its name; so do contacts of them. Loads print their value."""
    values = re.fullmatch(r"(\w+)\((.+)\)", repr(made))
    assert values is not None
    assert values[1] == made.kind.name  # type: ignore[attr-defined]
    given = [float(part.partition("=")[2]) for part in values[2].split(", ")]
    assert given == pytest.approx([float(one) for one in made.values[: len(given)]])  # type: ignore[attr-defined]
    one = gb.mass(1.0, motions=2, name="ball")
    if made.kind in {gb.Disc(1.0).kind, ellipse(1.0, 1.0).kind}:  # type: ignore[attr-defined]
        assert repr(made) in repr(gb.Contact(one["at"], made, gb.Cubic(1e6, 1e-3)))
    assert repr(gb.Force(one["at"], 3.0, name="push")) == "<Force push on ball: 3 N>"
    assert "amplitude 2" in repr(gb.Force(one["at"], gb.sine, name="push", amplitude=2.0, frequency=1.0))


def test_states_of_structures_and_of_their_names() -> None:
    """One state by either; what is no structure of the scene, or has other numbers, is refused in words."""
    a, b = gb.mass(1.0, name="a"), gb.mass(2.0, motions=2, name="b")
    scene = gb.Scene(a, b)
    by_name, by_noun = scene.state(velocity={"a": 1.0, "b": [2.0, 3.0]}), scene.state(velocity={a: 1.0, b: [2.0, 3.0]})
    assert by_name.v.tobytes() == by_noun.v.tobytes()
    last = gb.history(scene, step=0.1, end=1.0, start=by_name).last
    assert last["a.at"].displacement == pytest.approx(1.0)
    assert last["b.at"].displacement == pytest.approx([2.0, 3.0])
    for wrong, words in (({"c": 1.0}, "structure c, which is not"), ({"b": [1.0, 2.0, 3.0]}, "shape"),
                         ({"a": "x"}, "real numbers"), ({a: np.nan}, "finite")):  # fmt: skip
        with pytest.raises(gb.UserError, match=words):
            scene.state(velocity=wrong)


@pytest.mark.parametrize("large", [False, True])
def test_states_of_other_scenes(large: bool) -> None:
    """Other DOFs are refused in words by all marches; other contacts start without forces, as the exact flight has it.

    Compiled loops went over the end of arrays of another scene's contact forces.
    """
    matrices = (sp.eye(1500), 1e-9 * sp.eye(1500))
    body = gb.Structure(*matrices, name="a", points={"at": [0]}) if large else gb.mass(1.0, name="a")
    touch = gb.Contact(body["at"], gb.HalfPlane(1.0), gb.KelvinVoigt(stiffness=1e5), name="w")
    free, stopped, both = gb.Scene(body), gb.Scene(body, contacts=[touch]), gb.Scene(body, gb.mass(1.0, name="b"))
    for scene, other in ((free, stopped), (stopped, free)):
        start = other.state(velocity={"a": 1.0})
        assert gb.history(scene, step=0.01, end=0.5, start=start).displacement["at"][-1] == pytest.approx(0.5)
        many = gb.ensemble(scene, step=0.01, end=0.5, start=start, members=2) if not large else None
        assert many is None or many.peak["at"] == pytest.approx([0.5, 0.5])
    for scene, other in ((both, free), (free, both)):
        with pytest.raises(gb.UserError, match="start: found a state of another scene, of"):
            gb.history(scene, step=0.01, end=0.5, start=other.state())
        with pytest.raises(gb.UserError, match="start: found a state of another scene, of"):
            next(gb.march(scene, step=0.01, end=0.5, start=other.state()))
