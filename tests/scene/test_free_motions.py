"""Motions that nothing opposes: responses of two bodies that turn or drift together are those of their relative motion.

The relative motion of I_0 and I_1 at radii r_0 and r_1 has the mass 1 / (r_0^2 / I_0 + r_1^2 / I_1).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gapbeam as gb

PLAY, MESH, FORCE, ERROR = 1e-4, 2e8, 400.0, 2e-6
NATURAL = 2.2e4  # rad/s, about the frequency of the mesh
DRAGS = [(0.0, 0.0), (900.0, 0.0), (900.0, 200.0)]
"""Damping over inertia, 1/s, and the acceleration by a mean force, m/s^2: neither, bearings with drag, and a drive."""


def drawn(seed: int, w: float, drag: float = 0.0, pull: float = 0.0) -> tuple[gb.Scene, gb.Scene, Any]:
    """Return two bodies that press on each other with FORCE, their relative motion, and their motion together.

    Args:
        seed: Seed of the draws.
        w: Angular frequency of the mesh, rad/s.
        drag: Damping of each body over its inertia, 1/s.
        pull: Acceleration of both rims by the forces, m/s^2.
    """
    draw = np.random.default_rng(seed)
    radii = np.ones(2) if seed % 2 else draw.uniform(0.03, 0.1, 2)  # two wagons, or gears
    inertias = draw.uniform(0.3, 3.0, 2) * radii**2
    inertias *= MESH / NATURAL**2 * (radii**2 / inertias).sum()
    bodies = [
        gb.Structure([[I]], [[0.0]], [[drag * I]], points={"rim": [[r]]}, name=name)
        for I, r, name in zip(inertias, radii, ("first", "second"), strict=True)  # noqa: E741
    ]
    mass = 1.0 / (radii**2 / inertias).sum()
    law = gb.KelvinVoigt(stiffness=MESH, damping=0.1 * np.sqrt(MESH * mass))

    def between(place: Any) -> gb.Contact:
        return gb.Contact(place, gb.Slot(PLAY), law, wall=lambda t: ERROR * np.cos(w * t), name="mesh")

    rims, one = [body["rim"] for body in bodies], gb.mass(mass, damping=drag * mass)
    pair = gb.Scene(
        *bodies, contacts=[between((rims[0], rims[1]))],
        loads=[
            gb.Force(rim, side * FORCE + pull * I / r**2, name=name)
            for rim, side, I, r, name in zip(rims, (1.0, -1.0), inertias, radii, ("drive", "load"), strict=True)  # noqa: E741
        ],
    )  # fmt: skip
    alone = gb.Scene(one, contacts=[between(one["at"])], loads=[gb.Force(one["at"], FORCE)])
    return pair, alone, pair.state({"first": 1.0 / radii[0], "second": 1.0 / radii[1]}).q


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("part", [0.42, 0.83, 1.3])
@pytest.mark.parametrize(("speed", "drag", "pull"), [(0.0, *DRAGS[0]), *((30.0, *one) for one in DRAGS)])
def test_two_bodies_respond_as_their_relative_motion(
    seed: int, speed: float, part: float, drag: float, pull: float
) -> None:
    (pair, alone, together), period = drawn(seed, part * NATURAL, drag, pull), 2.0 * np.pi / (part * NATURAL)
    rest = gb.seat(drawn(seed, part * NATURAL, drag)[0])
    turned = replace(rest, q=rest.q + 10.0 * speed * together, v=speed * together)
    expected = gb.periodic(alone, period, 200, start=gb.seat(alone))
    found = gb.periodic(pair, period, 200, start=turned)
    late = (
        [((2.0 - drag * period / 200) / (2.0 + drag * period / 200)) ** 200] if drag else []
    )  # of their speed together
    sizes = np.sort(np.abs(found.multipliers))[2 - len(late) :]
    assert np.allclose(sizes, np.sort([*np.abs(expected.multipliers), *late]), rtol=1e-4)
    assert np.sum(np.abs(found.multipliers) < 1e-6) == 2 - len(late)
    assert found.is_stable == expected.is_stable


@pytest.mark.parametrize("part", [0.42, 0.62, 0.84, 1.26])
@pytest.mark.parametrize(("drag", "pull"), DRAGS)
def test_all_responses_of_two_bodies_are_those_of_their_relative_motion(part: float, drag: float, pull: float) -> None:
    pair, alone, together = drawn(1, part * NATURAL, drag, pull)
    period, along = 2.0 * np.pi / (part * NATURAL), np.linspace(-0.05, 0.05, 12)
    rest, first = gb.seat(drawn(1, part * NATURAL, drag)[0]), gb.seat(alone)
    apart = pair.state({}, {"first": 1.0}).v
    # the first body of the pair moves by the speed of the relative motion, beside a drift of both
    starts = replace(rest.spread(12), v=apart * along + 0.3 * together * np.arange(12))
    found = gb.atlas(pair, period=period, steps=200, starts=starts)
    unit = alone.contact_rows.T / (alone.contact_rows**2).sum()
    expected = gb.atlas(alone, period=period, steps=200, starts=replace(first.spread(12), v=unit * along))
    assert found.is_complete
    assert [one.order for one in found.points[0].responses] == [one.order for one in expected.points[0].responses]
    for one, other in zip(found.points[0].responses, expected.points[0].responses, strict=True):
        assert one.share == other.share
        assert abs(one.peak_force["mesh"] - other.peak_force["mesh"]) <= 1e-6 * other.peak_force["mesh"]
        if not drag:
            assert np.allclose(np.sort(np.abs(one.multipliers))[-2:], np.sort(np.abs(other.multipliers)), rtol=1e-4)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("part", [0.42, 1.3])
@pytest.mark.parametrize("path", ["mesh.stiffness", "mesh.damping"])
@pytest.mark.parametrize(("drag", "pull"), DRAGS)
def test_derivatives_of_two_bodies_are_those_of_their_relative_motion(
    seed: int, part: float, path: str, drag: float, pull: float
) -> None:
    pair, alone, together = drawn(seed, part * NATURAL, drag, pull)
    period, law = 2.0 * np.pi / (part * NATURAL), alone.contacts[0].law
    rest = gb.seat(drawn(seed, part * NATURAL, drag)[0])
    turned = replace(rest, q=rest.q + 3.0 * together, v=5.0 * together)
    value = {"mesh.stiffness": MESH, "mesh.damping": law.values[1]}[path]
    slopes = []
    for scene, start in ((pair, turned), (alone, gb.seat(alone))):
        begin = gb.periodic(scene, period, 200, start=start).state
        given = {"period": period, "steps": 200, "start": begin}
        slopes.append(gb.tangents(scene, ["mesh.peak_force"], {path: value}, **given).slopes["mesh.peak_force"][path])
    force = np.abs(gb.history(alone, period / 200, period, begin).force["mesh"]).max()
    assert abs(slopes[0] - slopes[1]) * value <= 1e-6 * force


@pytest.mark.parametrize("mass", [1e-9, 2.0, 5e4])
def test_a_free_body_under_a_harmonic_force_repeats_in_closed_form(mass: float) -> None:
    w, body = 7.0, gb.mass(mass, name="body")
    scene = gb.Scene(body, loads=[gb.Force(body["at"], lambda t: mass * np.sin(w * t))])
    found = gb.periodic(scene, 2.0 * np.pi / w, 2000)
    velocity = gb.history(scene, step=np.pi / w / 1000, end=np.pi / w / 1000, start=found.state).velocity["at"][0]
    assert abs(velocity + 1.0 / w) < 1e-4 / w
    assert found.is_stable
