"""Weight and base motions of several structures: advice that works, and inertia that is left out."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb

LAW = {"type": "kelvin-voigt", "stiffness": 1e6}
FREQUENCY, SHAPE = sqrt(500.0) / (2.0 * pi), sqrt(0.5)
"""Hz, 1/sqrt(kg): of 2 kg on 1e3 N/m."""
SHAKER = {"type": "base_motion", "name": "quake", "amplitude": 1.0, "frequency": 2.0}


def masses(motions: int = 1) -> dict[str, Any]:
    """Return the tables of two masses of 2 kg and 1 kg, of so many motions."""
    return {
        "structure": [
            {"name": "tower", "model": {"type": "mass", "mass": 2.0, "stiffness": 1e3, "motions": motions}},
            {"name": "damper", "model": {"type": "mass", "mass": 1.0, "stiffness": 1e3, "motions": motions}},
        ],
        "contact": {"law": LAW},
        "time": {"step": 1e-3, "end": 0.1},
    }


@pytest.mark.parametrize("kind", ["two motions", "three motions", "matrices", "modes"])
def test_advice_on_weight_without_a_direction_helps(kind: str, tmp_path: Path) -> None:
    """The file is refused; with the key or the column that the message adds, the mass weighs 2 kg times 9.81 m/s^2."""
    given = masses({"two motions": 2, "three motions": 3}.get(kind, 1)) | {"load": [{"type": "gravity"}]}
    del given["structure"][1]
    body, advised = given["structure"][0], tmp_path / "tower.csv"
    if kind == "matrices":
        for name, value in (("K", 1e3), ("M", 2.0)):
            np.save(tmp_path / f"{name}.npy", np.array([[value]]))
        (tmp_path / "tower.dof").write_text("1.3\n")
        body["model"] = {"type": "matrices", "stiffness": str(tmp_path / "K.npy"), "mass": str(tmp_path / "M.npy"),
                         "dofs": str(tmp_path / "tower.dof"), "units": "m-kg-s"}  # fmt: skip
        given["point"] = [{"name": "at", "structure": "tower", "dof": "1.3"}]
    elif kind == "modes":
        advised.write_text(f"frequency,damping,at\n{FREQUENCY!r},0.0,{SHAPE!r}\n")
        body["model"] = {"type": "modes", "file": str(advised)}
    with pytest.raises(gb.CaseError) as refused:
        gb.scene(given)
    words = str(refused.value)
    if kind == "modes":
        assert f"column frame to {advised}" in words
        advised.write_text(f"frequency,damping,at,frame\n{FREQUENCY!r},0.0,{SHAPE!r},"
                           f"{2.0 * SHAPE!r}\n")  # fmt: skip
    else:
        key, value = ("frame", [0, 0, 1]) if kind == "matrices" else ("place", {"across": [0, 0, 1]})
        assert f"add {key} = " in words
        assert "[0, 0, 1]" in words
        body[key] = value
    scene = gb.scene(given)
    found = scene.rows_at(scene.point("at")) @ gb.seat(scene).q[:, 0]
    assert found[0] == pytest.approx(-2.0 * 9.81 / 1e3, rel=1e-12)
    assert np.abs(found[1:]).max(initial=0.0) < 1e-15


TIES: dict[str, dict[str, Any]] = {
    "a pair": {"pair": [{"name": "gap", "between": ["damper.at", "tower.at"],
                         "region": {"type": "slot", "clearance": 1e-2}}]},
    "a spring": {"joint": [{"type": "elastic", "between": ["tower.at", "damper.at"], "stiffness": 100.0}]},
    "a snubber": {"joint": [{"type": "snubber", "name": "brake", "between": ["tower.at", "damper.at"], "velocity": 0.1,
                             "release": 0.05, "stiffness": 1e4}]},
    "a controller": {"feedback": [{"name": "drive", "type": "controller", "sense": ["tower.at"], "act": ["damper.at"],
                                   "D": [[10.0, 1.0]]}]},
    "nothing": {},
}  # fmt: skip


@pytest.mark.parametrize("tie", TIES)
@pytest.mark.parametrize("shaken", ["tower", "damper", "all"])
def test_a_base_motion_that_leaves_a_neighbor_out_is_named(tie: str, shaken: str, tmp_path: Path) -> None:
    """A structure without base motion, tied to one that has it, lacks its inertia: a warning names both."""
    load = SHAKER if shaken == "all" else SHAKER | {"structure": shaken}
    outcome = gb.run(masses() | TIES[tie] | {"load": [load]}, output=tmp_path / "run")
    other = "damper" if shaken == "tower" else "tower"
    found = [one for one in outcome.summary["warnings"] if f"the inertia of {other} is left out" in one]
    assert len(found) == (tie != "nothing" and shaken != "all"), outcome.summary["warnings"]
    assert all(f"quake shakes {shaken}, but not {other}" in one for one in found)


@pytest.mark.parametrize("turned", [0.0, 33.0])
@pytest.mark.parametrize("motions", [1, 2, 3])
@pytest.mark.parametrize("way", [0, 1, 2])
def test_a_base_motion_along_which_nothing_moves_is_named(
    way: int, motions: int, turned: float, tmp_path: Path
) -> None:
    """Masses move along their own z, z and y, or in any direction: what shakes them across that is a mistake."""
    c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    place = {"axis": [c, s, 0.0], "across": [0.0, 0.0, 1.0]}
    direction = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]][way]
    given = masses(motions) | {"load": [SHAKER | {"direction": direction}]}
    for one in given["structure"]:
        one["place"] = place
    outcome = gb.run(given, output=tmp_path / "run")
    found = [one for one in outcome.summary["warnings"] if "quake moves nothing" in one]
    still = float(np.abs(outcome.history["displacement"]).max()) < 1e-15
    assert len(found) == still == (way < 3 - motions)


def test_a_base_motion_that_moves_one_of_two_structures_is_no_mistake(tmp_path: Path) -> None:
    """A second mass, which moves along y alone, is not shaken along z; the first one is."""
    given = masses() | {"load": [SHAKER | {"direction": [0.0, 0.0, 1.0]}]}
    given["structure"][0]["place"], given["structure"][1]["place"] = {}, {"across": [0.0, 1.0, 0.0]}
    outcome = gb.run(given, output=tmp_path / "run")
    assert not [one for one in outcome.summary["warnings"] if "moves nothing" in one]


WAYS = {  # axis and across of a mass of two motions: along across, and along across x axis
    "y z": ([-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
    "z y": ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    "x -y": ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
    "z x": ([0.0, -1.0, 0.0], [0.0, 0.0, 1.0]),
    "y -z": ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
}


@pytest.mark.parametrize("ways", WAYS)
def test_components_in_space_are_the_motions_that_they_name(ways: str, tmp_path: Path) -> None:
    """Letters of directions that motions do not have are refused; numbers are those of the motions, on springs."""
    axis, across = WAYS[ways]
    given = masses(2)
    del given["structure"][1]
    given["structure"][0]["place"] = {"axis": axis, "across": across}
    forces = (2.0, 3.0)
    given["load"] = [{"type": "constant_force", "name": f"f{k}", "point": "tower.at", "amplitude": forces[k],
                      "direction": np.eye(2)[k].tolist()} for k in range(2)]  # fmt: skip
    given["start"] = {"state": "seat"}
    names = {"y": 0, "z": 1, "1": 0, "2": 1}
    for name, motion in names.items():
        given["figure"] = [{"name": "moved", "quantity": "displacement", "place": "tower.at", "component": name}]
        if name in "yz" and ways.split()[motion] != name:
            with pytest.raises(gb.CaseError, match="component") as refused:
                gb.run(given, output=tmp_path / name)
            assert "1, 2" in str(refused.value)
            continue
        outcome = gb.run(given, output=tmp_path / name)
        assert outcome.summary["figures"]["moved"]["value"] == pytest.approx(forces[motion] / 1e3, rel=1e-9)


def test_full_names_of_motions_are_places_of_figures(tmp_path: Path) -> None:
    """In a file with one structure of three motions, "tower.at 2" is "at 2"."""
    given = masses(3)
    del given["structure"][1]
    given["load"] = [{"type": "constant_force", "point": "tower.at", "direction": [0, 1, 0], "amplitude": 4.0}]
    given["start"] = {"state": "seat"}
    for place in ("at 2", "tower.at 2"):
        given["figure"] = [{"name": "moved", "quantity": "displacement", "place": place}]
        outcome = gb.run(given, output=tmp_path / place.replace(" ", "-"))
        assert outcome.summary["figures"]["moved"]["value"] == pytest.approx(4e-3, rel=1e-9)
