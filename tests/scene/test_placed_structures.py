"""Structures that are placed in space: directions, weight, nearest places, and places that cannot be meant."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.messages.errors import CaseError
from tests.scene.test_scene_files import LAW, NODES, beam, solid
from tests.shared import slips
from tests.shared.slips import Tables, check_refused

TIME = {"step": 1e-4, "end": 0.02}


def test_a_placed_chain_has_the_directions_of_space(tmp_path: Path) -> None:
    """The own x axis lies along y of space and the own z along x, so the own y is z of space."""
    place = gb.Pose(origin=(1.0, 2.0, 3.0), axis=(0.0, 2.0, 0.0), across=(5.0, 0.0, 0.0))
    files = solid(tmp_path)
    given = {key: files[key] for key in ("stiffness", "mass", "dofs", "nodes", "units")}
    points = {
        "x": {"nearest": (1.0, 2.0 + 0.05 * 4, 3.0), "direction": (1.0, 0.0, 0.0)},
        "plane": {"node": NODES, "direction": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))},
    }
    chain = gb.read_structure(**given, points=points, place=place, name="chain")
    assert np.flatnonzero(chain["x"].rows[0]).tolist() == [3 * 4 + 2]
    assert [np.flatnonzero(row).tolist() for row in chain["plane"].rows] == [[3 * (NODES - 1)], [3 * (NODES - 1) + 1]]
    assert np.abs(np.abs(chain["plane"].rows).sum(axis=1) - 1.0).max() < 1e-15
    carried = gb.weight(chain, -9.81, (0.0, 0.0, 1.0)).pattern
    assert np.abs(carried - np.tile([0.0, 0.5, 0.0], NODES)).max() < 1e-15
    with pytest.raises(gb.UserError, match=r"expected \(x, y, z\)"):
        gb.weight(chain, -9.81)


def test_weight_and_base_motion_act_along_directions_of_space() -> None:
    """A mass that moves along (0, 0.6, 0.8) feels 0.8 of its weight, and 0.6 of a motion of the frame along y."""
    given: Tables = {
        "structure": [
            {"name": "box", "model": {"type": "mass", "mass": 2.0, "stiffness": 1e4},
             "place": {"axis": [1.0, 0.0, 0.0], "across": [0.0, 3.0, 4.0]}},
            {"name": "ball", "model": {"type": "mass", "mass": 1.0, "motions": 2, "stiffness": 1e4}, "place": {}},
        ],
        "load": [{"type": "gravity"}, {"type": "base_motion", "structure": "box", "direction": [0.0, 1.0, 0.0],
                                       "amplitude": 3.0, "frequency": 5.0}],
        "time": TIME,
        "start": {"state": "seat"},
    }  # fmt: skip
    scene = gb.scene(given)
    at = gb.seat(scene).q[:, 0]
    motions = [float((scene.rows_at(point) @ at)[0]) for point in (scene.point("box.at"), scene.point("ball.at"))]
    assert motions == pytest.approx([-2.0 * 9.81 * 0.8 / 1e4, -9.81 / 1e4], rel=1e-12)
    shaken = next(load for load in scene.loads if isinstance(load, gb.BaseMotion))
    assert shaken.pattern == pytest.approx([-2.0 * 0.6], rel=1e-14)
    shaken_point = shaken.motion_of(scene.point("box.at"))
    assert shaken_point == pytest.approx([0.6], rel=1e-14)


def crossed() -> Tables:
    """Return two beams that cross at right angles, 0.0125 m between their axes, the upper one moving down."""
    return {
        "structure": [
            {"name": "upper", "model": beam(0.5), "place": {"origin": [0.0, 0.0, 0.0125]}},
            {"name": "lower", "model": beam(0.4), "place": {"origin": [0.2, -0.1, 0.0], "axis": [0.0, 1.0, 0.0]}},
        ],
        "joint": [{"type": "pinned", "structure": "lower", "at": x} for x in (0.0, 0.4)],
        "pair": [{"name": "cross", "between": ["upper", "lower"], "at": "nearest", "law": dict(LAW)}],
        "time": TIME,
    }  # fmt: skip


def test_beams_that_cross_touch_where_they_are_nearest() -> None:
    """The axes cross at 0.2 and 0.1 m; the gap is their distance less both half thicknesses: the same as by hand."""
    scene = gb.scene(crossed())
    by_hand = crossed()
    by_hand["point"] = [
        {"name": "cross", "structure": "upper", "nearest": [0.2, 0.3, 0.2]},
        {"name": "cross", "structure": "lower", "at": 0.1},
    ]
    region = {"type": "half-plane", "clearance": 0.0005, "normal": -1}
    by_hand["pair"] = [{"name": "cross", "between": ["upper.cross", "lower.cross"], "region": region, "law": dict(LAW)}]
    ends = [
        gb.history(one, 1e-5, 0.01, one.state(velocity={one.structures[0]: start_of(one.structures[0], -0.3)}))
        for one in (scene, gb.scene(by_hand))
    ]
    assert np.count_nonzero(ends[0].force["cross"]) > 10
    first = np.flatnonzero(ends[0].force["cross"])[0]
    assert ends[0].t[first] == pytest.approx(0.0005 / 0.3, abs=1e-5)  # free flight until the gap is closed
    assert np.abs(ends[0].force["cross"] - ends[1].force["cross"]).max() <= 1e-9 * np.abs(ends[1].force["cross"]).max()


def start_of(one: gb.Structure, speed: float) -> np.ndarray:
    """Return the velocities of all DOFs of a free beam that moves as a whole."""
    assert one.rigid is not None
    return np.asarray(speed * one.rigid[:, 0])


def test_nodes_and_a_mass_touch_where_they_are_nearest(tmp_path: Path) -> None:
    """A mass 0.03 m above node 5 of a chain along x: node, gap and direction."""
    given: Tables = {
        "structure": [
            {"name": "rack", "model": solid(tmp_path), "place": {}},
            {"name": "box", "model": {"type": "mass", "mass": 1.0}, "place": {"origin": [0.2, 0.0, 0.03]}},
        ],
        "joint": [{"type": "clamped", "structure": "rack", "nodes": "ROOT"}],
        "pair": [{"name": "drop", "between": ["box", "rack"], "at": "nearest", "law": dict(LAW)}],
        "time": TIME,
    }
    scene = gb.scene(given)
    [touch] = scene.contacts
    assert list(touch.region.values) == pytest.approx([-1.0, 0.0, 0.03], rel=1e-12)  # normal and clearance
    rows = scene.structures[0]["drop"].rows[0]
    assert np.flatnonzero(rows).tolist() == [3 * 2 + 2]  # node 5, of which the first two are clamped; z
    falling = scene.state(displacement={scene.structures[1]: -0.0301})
    assert gb.history(scene, 1e-6, 2e-6, falling).force["drop"][0] == pytest.approx(1e6 * 1e-4, rel=1e-3)


def put(*path: Any, value: Any) -> Any:
    change = slips.put(*path, value=value)
    return lambda given: change(given, Path())


def parallel(given: Tables) -> None:
    given["structure"][1]["place"] = {"origin": [0.1, 0.0, 0.0]}


def named(given: Tables, **region: float) -> None:
    """Name the points of the crossing."""
    given["point"] = [{"name": "c", "structure": "upper", "at": 0.2}, {"name": "c", "structure": "lower", "at": 0.1}]
    given["pair"][0] |= {"between": ["upper.c", "lower.c"], "at": None}
    given["pair"][0]["region"] = {"type": "half-plane", "clearance": 1e-3, "normal": -1} | region
    del given["pair"][0]["at"]


def far(given: Tables) -> None:
    named(given)
    given["structure"][1]["place"]["origin"] = [0.2, -0.1, -7.0]


def deep(given: Tables) -> None:
    named(given)
    given["structure"][0]["place"]["origin"] = [0.0, 0.0, 0.01]


def through(given: Tables) -> None:
    named(given, normal=1)


def unplaced(given: Tables) -> None:
    del given["structure"][1]["place"]


def sideways(given: Tables) -> None:
    given["structure"][1]["place"] |= {"across": [1.0, 0.0, 0.0]}


def in_millimeters(given: Tables) -> None:
    given["point"] = [{"name": "c", "structure": "upper", "nearest": [200.0, 0.0, 12.5]}]


def load(**keys: Any) -> Any:
    def change(given: Tables) -> None:
        given["load"] = [{"type": "base_motion", "structure": "lower", "amplitude": 1.0, "frequency": 9.0, **keys}]

    return change


SLIPS = {
    "parallel": (parallel, '"cross".*between', "as near from 0.1 to 0.5 m of the first"),
    "no place": (unplaced, '"cross".*between', "add place"),
    "one structure": (put("pair", 0, "between", value=["upper"]), '"cross".*between', "two structures"),
    "a point, not a structure": (put("pair", 0, "between", value=["upper.c", "lower"]), '"cross".*between',
                                 "leave at out"),
    "overlap": (put("structure", 0, "place", value={"origin": [0.0, 0.0, 0.01]}), '"cross".*region',
                "overlap by 0.002 m"),
    "at one place": (put("structure", 0, "place", value={}), '"cross".*between', "at one place"),
    "another motion": (sideways, '"cross".*between', "place.across"),
    "a normal at nearest": (put("pair", 0, "region", value={"type": "half-plane", "clearance": 1e-4, "normal": -1}),
                            '"cross".*normal', "leave normal out"),
    "no region": (put("pair", 0, "at", value=None), '"cross".*region', "the key is missing"),
    "structures that do not meet": (far, '"cross".*between', "points 7.0125 m apart"),
    "overlap as placed": (deep, '"cross".*between', "overlap by 0.002 m where they are placed"),
    "inward": (through, '"cross".*normal', "points inward"),
    "a skew frame": (put("structure", 1, "place", "across", value=[0.0, 1.0, 1.0]), '"lower".*place', "right angles"),
    "coordinates in mm": (in_millimeters, '"c"', r"within 0\.5 m, its size"),
    "an upright axis": (put("structure", 1, "place", "axis", value=[0.0, 0.0, 1.0]), '"lower".*place', "across"),
    "an axis of 0": (put("structure", 1, "place", "axis", value=[0.0, 0.0, 0.0]), '"lower".*place', "not all 0"),
    "a velocity without direction": (put("structure", 0, "velocity", value=0.3), '"upper".*velocity', "a vector"),
    "no direction of the frame": (load(), 'load.*direction', "placed in space"),
    "a plane direction": (load(direction=[1.0, 0.0]), 'load.*direction', "placed in space"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_places_that_cannot_be_meant_are_refused_by_their_key(slip: str) -> None:
    given = crossed()
    change, where, words = SLIPS[slip]
    change(given)
    check_refused(given, where, words)


def decks(axis: Any, second: Any, gap: float, **pair: Any) -> Tables:
    """Return two frames, 1 m thick: from the origin along an axis, and behind a gap from its end on."""
    ways = [np.asarray(one, dtype=float) / np.linalg.norm(one) for one in (axis, second)]
    start = (40.0 + gap) * ways[0]
    routes = {
        "east": [[0.0, 0.0, 0.0], (40.0 * ways[0]).tolist()],
        "west": [start.tolist(), (start + 40.0 * ways[1]).tolist()],
    }
    material = {"young_modulus": 3e10, "poisson_ratio": 0.2, "density": 2500.0}
    made = {"type": "frame", "thickness": 1.0, "material": material}
    ends = [{"name": "end", "structure": name, "nearest": route[at], "direction": ways[0].tolist()}
            for (name, route), at in zip(routes.items(), (1, 0), strict=True)]  # fmt: skip
    return {
        "structure": [{"name": name, "model": {**made, "route": route}} for name, route in routes.items()],
        "joint": [
            {"type": "clamped", "structure": "east", "at": 0.0},
            {"type": "clamped", "structure": "west", "at": 40.0},
        ],
        "point": ends,
        "pair": [{"name": "gap", "law": {"type": "kelvin-voigt", "stiffness": 1e9}, **pair}],
        "load": [{"type": "constant_force", "point": "east.end", "amplitude": 1e8}],
        "time": TIME,
    }


NAMED = {"between": ["east.end", "west.end"], "region": {"type": "half-plane", "clearance": 0.05}}
NEAREST = {"between": ["east", "west"], "at": "nearest"}


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [3.0, -2.0, 1.0]])
@pytest.mark.parametrize("pair", [NAMED, NEAREST], ids=["named", "nearest"])
def test_frames_that_butt_touch_with_their_ends(axis: Any, pair: Any) -> None:
    """P / k = x + f / k, f = K (x - f / k - gap) with k = E A / L: an expansion joint across which two decks press."""
    scene = gb.scene(decks(axis, axis, 0.05, **pair))
    k, stop = 3e10 / 40.0, 1e9
    force = (1e8 / k - 0.05) / (2.0 / k + 1.0 / stop)
    assert np.abs(gb.seat(scene).F).max() == pytest.approx(force, rel=1e-6)


@pytest.mark.parametrize("turn", [90.0, 30.0])
def test_the_side_of_a_frame_keeps_the_end_of_another_one_away(turn: float) -> None:
    """The second one turns by an angle a: half of its thickness times sin a lies in the way of the end."""
    reach = 0.5 * np.sin(np.radians(turn))
    across = [np.cos(np.radians(turn)), 0.0, np.sin(np.radians(turn))]
    for share in (0.9, 1.1):
        given = decks([1.0, 0.0, 0.0], across, share * reach, **NAMED)
        if share < 1.0:
            check_refused(given, '"gap".*between', rf"overlap by {0.1 * reach:.3g}")
        else:
            assert len(gb.scene(given).contacts) == 1


@pytest.mark.parametrize("off", [0.02, 0.3])
@pytest.mark.parametrize("model", ["frame", "beam", "joint"])
def test_coordinates_far_from_a_structure_are_asked_about(
    model: str, off: float, caplog: pytest.LogCaptureFixture
) -> None:
    """A slip of 0.3 m beside a structure of 2 m is said, with its distance; an offset within a section is not."""
    steel = {"young_modulus": 2e11, "poisson_ratio": 0.3, "density": 7850.0}
    body: dict[str, Any] = {"thickness": 0.04, "material": steel}
    tables: dict[str, Any] = {"time": {"end": 0.1, "step": 1e-3}}
    point: dict[str, Any] = {"name": "guide", "structure": "pipe", "nearest": [1.0, off, 0.0]}
    if model == "beam":
        tables["structure"] = [{"name": "pipe", "model": body | {"type": "beam", "length": 2.0}, "place": {}}]
        held = {"at": 0.0}
    else:
        route = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
        tables["structure"] = [{"name": "pipe", "model": body | {"type": "frame", "route": route}}]
        point["direction"] = [0.0, 1.0, 0.0]
        held = {"nearest": [0.0, off, 0.0]} if model == "joint" else {"at": 0.0}
    if model == "joint":
        point["nearest"] = [1.0, 0.0, 0.0]
    tables |= {"point": [point], "joint": [{"type": "clamped", "structure": "pipe", **held}]}
    with caplog.at_level(logging.WARNING, "gapbeam"):
        gb.scene(tables)
    assert (f"coordinates are {off} m away from the structure of 2 m" in caplog.text) is (off > 0.1)


def test_quotes_are_advised_only_where_the_text_in_them_fits() -> None:
    """A number for "structure.point" gets an example, a number for a title quotes."""
    tables: Tables = {
        "title": 7,
        "structure": [{"name": "box", "model": {"type": "mass", "mass": 1.0, "stiffness": 1.0}}],
        "load": [{"type": "constant_force", "point": 5.0, "amplitude": 1.0}],
        "time": {"end": 1.0},
    }
    with pytest.raises(CaseError) as refused:
        gb.scene(tables)
    assert 'title = "7"' in str(refused.value)
    assert '"5.0"' not in str(refused.value)
