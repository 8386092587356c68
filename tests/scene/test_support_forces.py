"""Forces and moments of supports of frames: equilibrium at rest and at every step, closed forms, and moving clamps."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.postprocess.report.sections.statistics_section import peak_rows
from gapbeam.solver.loads.support_motion import HarmonicSupportMotion
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.reaction_rows import ReactionRows
from gapbeam.solver.scene.scene_load import sine
from tests.shared.slips import check_refused

G, RHO = 9.81, 7800.0
STEEL = gb.material(2e11, RHO, 0.3)
TABLES = {"young_modulus": 2e11, "poisson_ratio": 0.3, "density": RHO}
SHAKEN: dict[str, Any] = {"type": "support_motion", "amplitude": 2e-3, "frequency": 9.0, "ramp": 0.1}
ROUTE = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.5], [0.7, 0.0, 0.5]]


class Drawn:
    """A frame of three legs with a clamp, and perhaps a pin, and a place that is held one way.

    Attributes:
        x: Its corners, m.
        size: Its size, m.
        at: Places of its supports and its tip, m.
        draw: Draws more.
        one: The frame.
    """

    def __init__(self, seed: int) -> None:
        self.draw = draw = np.random.default_rng(seed)
        self.size = size = 10.0 ** draw.uniform(-2.0, 1.0)
        steps = draw.normal(size=(3, 3))
        legs = steps / np.linalg.norm(steps, axis=1)[:, None] * draw.uniform(0.5, 1.0, 3)[:, None]
        self.x = x = size * (draw.normal(size=3) + np.vstack([np.zeros(3), np.cumsum(legs, axis=0)]))
        self.at = {"wall": x[0], "pin": x[2], "rest": 0.3 * x[0] + 0.7 * x[1], "tip": x[3]}
        places = {key: place.tolist() for key, place in self.at.items()}
        names = ["wall", *(["pin"] if seed % 2 else []), *(["rest"] if seed % 3 else [])]
        self.one = gb.frame(
            x.tolist(), gb.space_section("tube", 0.05 * size, wall=0.01 * size), STEEL,
            {"tip": (places["tip"], np.eye(3))}, clamped=[places["wall"]], elements=15,
            pinned=[places["pin"]] if seed % 2 else (),
            held=[(places["rest"], draw.normal(size=3))] if seed % 3 else (),
            reactions={key: places[key] for key in names},
        )  # fmt: skip

    @property
    def masses(self) -> np.ndarray:
        """Mass of each leg, kg."""
        area = 0.25 * pi * (0.05**2 - 0.03**2) * self.size**2
        return np.asarray(RHO * area * np.linalg.norm(np.diff(self.x, axis=0), axis=1))


@pytest.mark.parametrize("how", ["whole", "reduced", "with a mass"])
@pytest.mark.parametrize("seed", range(4))
def test_supports_carry_weight_and_forces_at_rest(seed: int, how: str) -> None:
    """All forces, and all moments about any point, add up to 0; pins and held places carry no moment."""
    drawn = Drawn(seed)
    one, at, masses = drawn.one, drawn.at, drawn.masses
    one = gb.reduced_at_points(one, 5) if how == "reduced" else one
    weight, push = masses.sum() * G, drawn.draw.normal(size=3)
    extra = 0.3 * masses.sum() if how == "with a mass" else 0.0
    push *= weight / np.linalg.norm(push)
    loads = [gb.weight(one, -G, (0, 0, 1), name="weight"), gb.Force(one["tip"], weight, push / weight, name="push")]
    scene = gb.Scene(one, loads=loads, masses=[(one["tip"], extra)] if extra else ())
    rows, q = ReactionRows(scene), gb.seat(scene).q
    found = rows.at_rest(0.0, (rows.rows @ q).T)[0]
    down, about = np.array([0.0, 0.0, -G]), drawn.draw.normal(size=3) * drawn.size
    acting = [(m * down, 0.5 * (a + b)) for m, a, b in zip(masses, drawn.x[:-1], drawn.x[1:], strict=True)]
    acting += [(push + extra * down, at["tip"])]
    acting += [(R[:3], at[key]) for key, R in zip(rows.names, found, strict=True)]
    moment = sum((np.cross(place - about, force) for force, place in acting), found[:, 3:].sum(axis=0))
    tolerance = 1e-5 if how == "reduced" else 1e-8
    assert sum(force for force, _ in acting) == pytest.approx(0.0, abs=tolerance * weight)
    assert moment == pytest.approx(0.0, abs=tolerance * weight * drawn.size)
    assert not any(R[3:].any() for key, R in zip(rows.names, found, strict=True) if key != "wall")


@pytest.mark.parametrize("seed", range(4))
def test_forces_of_every_step_are_the_gain_of_momentum(seed: int) -> None:
    """With a shaken frame, weight, and hits on a wall: sum of R, contact and inertia = dP/dt, to round-off."""
    drawn = Drawn(seed)
    one, mass = drawn.one, float(drawn.masses.sum())
    w = float(np.sqrt(one.modes[0][0]))
    h, along = 2.0 * pi / w / 100.0, np.array([0.48, 0.6, 0.64])
    fall = gb.weight(one, -G, (0, 0, 1), name="weight")
    ground = gb.BaseMotion(one, sine, along, name="ground", amplitude=5.0 * G, frequency=0.9 * w / (2.0 * pi))
    sag = float(np.abs(gb.history(gb.Scene(one, loads=[fall]), h, h).displacement["tip"]).max())
    law = gb.KelvinVoigt(20.0 * mass * w**2, 0.1 * mass * w)
    wall = gb.Contact(one.point(one["tip"].rows[:1]), gb.Slot(clearance=sag), law, name="wall")
    scene = gb.Scene(one, contacts=[wall], loads=[fall, ground])
    assert one.inertia is not None
    rows = scene.structures[0].modes[2].T @ one.inertia
    momentum = [np.zeros(3)]
    momentum += [rows.T @ step.state.v[:, 0] for step in gb.march(scene, h, 400 * h)]
    found = gb.history(scene, h, 400 * h)
    shaken = ground.table(found.t - 0.5 * h)
    applied = mass * (np.array([0.0, 0.0, -G]) - shaken * along)
    reactions = np.sum([R[:, :3] for R in found.reaction.values()], axis=0)
    hit = np.outer(found.force["wall"], [1.0, 0.0, 0.0])
    assert np.abs(hit).max() > 0.3 * mass * G
    rest = reactions + hit + applied - np.diff(momentum, axis=0) / h
    assert rest == pytest.approx(0.0, abs=1e-7 * np.abs(reactions).max())


def test_a_clamped_span_has_the_moments_of_the_handbook() -> None:
    """A uniform load q on a beam clamped at both ends: q l / 2 and q l^2 / 12."""
    span = gb.frame([[0, 0, 0], [2, 0, 0]], gb.space_section("round", 0.05), STEEL, {}, clamped=[0.0, 2.0],
                    elements=10, reactions={"left": 0.0, "right": 2.0})  # fmt: skip
    scene = gb.Scene(span, loads=[gb.weight(span, -G, (0, 0, 1), name="weight")])
    found = gb.history(scene, 1e-4, 1e-4, gb.seat(scene)).reaction
    q = RHO * 0.25 * pi * 0.05**2 * G
    assert found["left"][0] == pytest.approx([0.0, 0.0, q, 0.0, -q * 4.0 / 12.0, 0.0], abs=1e-7 * q)
    assert found["right"][0] == pytest.approx([0.0, 0.0, q, 0.0, q * 4.0 / 12.0, 0.0], abs=1e-7 * q)


def pipe(**joint: Any) -> dict[str, Any]:
    """Return the tables of a frame on a clamp and a pin, of which the clamp is moved by a load."""
    model = {"type": "frame", "route": ROUTE, "thickness": 0.02, "elements": 8, "material": TABLES, "section": "round"}
    return {
        "structure": [{"name": "a", "model": model}],
        "point": [{"name": "tip", "structure": "a", "nearest": ROUTE[-1], "direction": [0.6, 0.0, 0.8]}],
        "joint": [{"type": "clamped", "name": "foot", "structure": "a", "at": 0.0, "force": True} | joint],
        "load": [SHAKEN | {"support": "foot", "direction": [0.6, 0.0, 0.8]}],
        "time": {"step": 1e-4, "end": 0.4},
    }


@pytest.mark.parametrize("modes", [None, 6])
def test_the_only_clamp_that_moves_feels_what_a_clamp_on_a_moving_frame_feels(modes: int | None) -> None:
    """Two formulations with nothing alike: displacements in space and K d s, or relative ones and M r a."""
    tables = pipe()
    if modes is not None:
        tables["structure"][0]["reduce"] = {"modes": modes}
    found = gb.history(gb.scene(tables), step=1e-4, end=0.4).reaction["foot"]
    acceleration = HarmonicSupportMotion(name="m", **SHAKEN).time_function().acceleration
    held = gb.scene(tables | {"load": []}).structures[0]
    frame = gb.BaseMotion(held, acceleration, [0.6, 0.0, 0.8], name="frame")
    wanted = gb.history(gb.Scene(held, loads=[frame]), step=1e-4, end=0.4).reaction["foot"]
    for part in (slice(0, 3), slice(3, 6)):
        assert found[:, part] == pytest.approx(wanted[:, part], abs=3e-4 * np.abs(wanted[:, part]).max())


def test_a_run_records_forces_of_joints_and_goes_on_to_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Records are those of `history` at the recorded steps; a figure of them has an error; a killed run resumes."""
    scene = gb.scene(pipe())
    pull = gb.figure(name="pull", quantity="joint_force", place="foot", component="z", magnitude=True)
    asked: dict[str, Any] = {"step": 1e-4, "end": 0.21, "every": 7}
    whole = gb.run(scene, output=tmp_path / "whole", **asked, figures=[pull])
    history = gb.open_results(whole).history
    wanted = gb.history(scene, 1e-4, 0.21).reaction["foot"]
    for name, part in (("joint_force", slice(0, 3)), ("joint_moment", slice(3, 6))):
        expected = wanted[6::7, part]
        assert history[name].values[1:, 0] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    figure = whole.summary["figures"]["pull"]
    assert figure["value"] == pytest.approx(np.abs(wanted[6::7, 2]).max(), rel=1e-9)
    assert "largest force of the joint foot" in str(peak_rows(history))
    advance, blocks = Marcher.advance, []

    def stopping(self: Marcher, steps: int, record: bool = False, energies: bool = False) -> Any:
        blocks.append(steps)
        if len(blocks) == 4:
            raise MemoryError("killed")
        return advance(self, steps, record, energies)

    monkeypatch.setattr(Marcher, "advance", stopping)
    with pytest.raises(MemoryError):
        gb.run(scene, output=tmp_path / "part", checkpoint=0.0, errors=False, **asked)
    again = gb.run(scene, output=tmp_path / "part", resume=True, errors=False, **asked)
    assert again.summary["resumed"][0] > 0.0
    assert gb.open_results(again).history["joint_moment"].identical(history["joint_moment"])


SLIPS = (
    ({"name": None}, r"joint.*force", "a name of its own"),
    ({"type": "pinned", "structure": "bar", "at": 0.0}, r"joint.*force", "a frame, too"),
)


@pytest.mark.parametrize(("change", "where", "words"), SLIPS)
def test_forces_that_nothing_can_name_or_know_are_refused(change: dict[str, Any], where: str, words: str) -> None:
    tables = pipe(**change)
    tables["joint"][0] = {key: value for key, value in tables["joint"][0].items() if value is not None}
    beam = {"type": "beam", "length": 1.0, "thickness": 0.02, "material": TABLES}
    tables |= {"load": [], "structure": [*tables["structure"], {"name": "bar", "model": beam}]}
    tables["point"].append({"name": "end", "structure": "bar", "at": 1.0})
    check_refused(tables, where, words)


def test_a_name_for_two_forces_and_a_place_that_nothing_holds_are_refused() -> None:
    tables = pipe()
    tables["joint"].append(tables["joint"][0] | {"type": "pinned", "at": 1.0})
    check_refused(tables, r"joint", "a name of its own for each force")
    with pytest.raises(gb.UserError, match="nothing holds"):
        gb.frame(ROUTE, gb.space_section("round", 0.02), STEEL, {}, clamped=[0.0], reactions={"free": 1.0})


@pytest.mark.parametrize("seed", range(3))
def test_elastic_joints_carry_a_frame_at_rest_and_in_every_step(seed: int) -> None:
    """Three joints along x, y and z hold a free frame: all that they give is weight at rest, and then dP/dt."""
    drawn = Drawn(seed)
    places = {f"hanger {k}": drawn.x[k].tolist() for k in (0, 1, 3)}
    one = gb.frame(
        drawn.x.tolist(), gb.space_section("tube", 0.05 * drawn.size, wall=0.01 * drawn.size), STEEL,
        {name: (place, np.linalg.qr(drawn.draw.normal(size=(3, 3)))[0]) for name, place in places.items()}, elements=6,
    )  # fmt: skip
    mass = float(drawn.masses.sum())
    stiffness = 1e3 * mass * G / drawn.size
    drag = 0.1 * np.sqrt(stiffness * mass)
    joints = [gb.Joint(one[name], stiffness, drag, name, force=True) for name in places]
    scene = gb.Scene(one, joints=joints, loads=[gb.weight(one, -G, (0, 0, 1), name="weight")])
    rows, seat = ReactionRows(scene), gb.seat(scene)
    at_rest = dict(zip(rows.names, rows.at_rest(0.0, (rows.rows @ seat.q).T)[0], strict=True))
    middles = 0.5 * (drawn.x[:-1] + drawn.x[1:])
    weights = [(np.array([0.0, 0.0, -m * G]), at) for m, at in zip(drawn.masses, middles, strict=True)]
    acting = [*weights, *((at_rest[name][:3], np.array(place)) for name, place in places.items())]
    assert sum(force for force, _ in acting) == pytest.approx(0.0, abs=1e-7 * mass * G)
    assert sum(np.cross(at, force) for force, at in acting) == pytest.approx(0.0, abs=1e-6 * mass * G * drawn.size)
    h = 0.05 * float(np.sqrt(mass / stiffness))
    push = gb.Force(one["hanger 3"], 30.0 * mass * G, [0.6, 0.0, 0.8], name="push")
    pushed = gb.Scene(one, joints=joints, loads=[*scene.loads, push])
    assert one.inertia is not None
    assert one["hanger 3"].directions is not None
    momentum = [np.zeros(3)]
    momentum += [(scene.structures[0].modes[2].T @ one.inertia).T @ step.state.v[:, 0]
                 for step in gb.march(pushed, h, 100 * h, seat)]  # fmt: skip
    found = gb.history(pushed, h, 100 * h, seat).reaction
    given = np.sum([force[:, :3] for force in found.values()], axis=0) + np.array([0.0, 0.0, -mass * G])
    along = 30.0 * mass * G * one["hanger 3"].directions.T @ np.array([0.6, 0.0, 0.8])
    assert given + along == pytest.approx(np.diff(momentum, axis=0) / h, abs=1e-6 * mass * G)
    assert not any(force[:, 3:].any() for force in found.values())


def test_a_joint_with_a_moving_end_pulls_by_what_it_is_stretched(tmp_path: Path) -> None:
    """A mass along (0, 0.6, 0.8) on a spring and damper whose end moves: m u'' is the force, along x, y and z."""
    tables = {
        "structure": [{"name": "box", "model": {"type": "mass", "mass": 2.0}, "place": {"across": [0.0, 0.6, 0.8]}}],
        "joint": [{"type": "elastic", "name": "strut", "between": ["box.at"], "stiffness": 5e3, "damping": 30.0,
                   "force": True}],
        "load": [SHAKEN | {"support": "strut", "direction": [1.0]}],
        "time": {"step": 1e-3, "end": 0.4},
    }  # fmt: skip
    found = gb.run(tables, output=tmp_path / "run")
    history = gb.open_results(found).history
    force, speed = history["joint_force"].values[:, 0], history["velocity"].values.reshape(len(history.time))
    gained = 2.0 * np.diff(speed) / np.diff(history.time)
    assert force[1:] == pytest.approx(np.outer(gained, [0.0, 0.6, 0.8]), abs=1e-9 * np.abs(force).max())
    assert "largest force of the joint strut" in str(peak_rows(history))


STRUT = {"type": "elastic", "name": "strut", "between": ["box.at"], "stiffness": 1.0, "force": True}


@pytest.mark.parametrize(
    ("joints", "place", "where", "words"),
    [
        ([STRUT, STRUT], {"across": [0.0, 0.0, 1.0]}, r"joint.*name", "a name of its own"),
        ([STRUT], None, r"joint.*force", "placed in space"),
    ],
)
def test_forces_of_elastic_joints_need_a_name_and_directions(
    joints: list[dict[str, Any]], place: dict[str, Any] | None, where: str, words: str
) -> None:
    box = {"name": "box", "model": {"type": "mass", "mass": 2.0}} | ({} if place is None else {"place": place})
    check_refused({"structure": [box], "joint": joints, "time": {"step": 1e-3, "end": 0.1}}, where, words)
