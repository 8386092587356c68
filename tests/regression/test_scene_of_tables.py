"""Every table of a case: the march of its scene equals the march of the case, or the scene is refused by name."""

from __future__ import annotations

import re
import tomllib
from typing import Any

import numpy as np
import pytest

import gapbeam
from gapbeam.interface.case_scene import scene_of_model
from gapbeam.solver.contact.laws.mixed_law import MixedLaw
from tests.shared.command import PROJECT

STEPS = 100
CASES = PROJECT / "cases"
RIGID: dict[str, Any] = {"model": {"type": "rigid"}}
BEAM: dict[str, Any] = {"model": {"type": "beam"}, "mesh.dimension": 2}
GRAVITY = {"type": "gravity"}
MARCHED: dict[str, dict[str, Any]] = {
    "damping of mass and stiffness": BEAM | {"damping": {"mass": 3.0, "stiffness": 1e-6}},
    "a damping ratio": BEAM | {"damping": {"ratio": 0.02}},
    "a mass": BEAM | {"mass": [{"name": "m", "point": 0.4, "mass": 0.3}]},
    "fluid": BEAM
    | {"fluid": [{"name": "w", "from": 0.1, "to": 0.4, "added_mass": 0.5, "displaced_mass": 0.5, "damping": 2.0}]},
    "a joint": BEAM | {"joint": [{"name": "j", "type": "elastic", "point": 0.3, "stiffness": {"vertical": 1e4}}]},
    "gravity": RIGID | {"load": [GRAVITY]},
    "a moving support": RIGID | {"load": [GRAVITY, {"type": "support_motion", "amplitude": 1e-4, "frequency": 40.0}]},
    "a moving frame": RIGID | {"load": [GRAVITY, {"type": "base_motion", "amplitude": 1e-4, "frequency": 40.0}]},
    "a start without a seat": RIGID | {"analysis": {"type": "transient", "start": "undeformed"}},
}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "a full model": ({"model": {"type": "full"}}, "a full model has its mesh"),
    "a restitution": (RIGID | {"contact.law": {"type": "hunt-crossley", "restitution": 0.5}}, "the speed at touch"),
    "friction": (BEAM | {"contact.friction": {"coefficient": 0.2}}, "friction along the beam"),
    "another scheme": (RIGID | {"time.scheme": {"type": "implicit-midpoint"}}, "the scheme implicit-midpoint"),
    "adaptive steps": (RIGID | {"time.adaptive": True}, "time.adaptive = false"),
    "a damper over depth": (
        RIGID | {"contact.law": {"type": "adams-impact", "damping": 1e5, "full_depth": 1e-5, "exponent": 1.0}},
        "the damper of the law",
    ),
    "a stop that yields": (
        RIGID | {"contact.law": {"type": "elastic-plastic", "yield_pressure": 1e6}}, "keeps a state"
    ),
    "a buffer": (
        RIGID | {"contact.law": {"type": "piecewise-linear", "depths": [1e-5], "factors": [3.0]}}, "is piecewise"
    ),
    "a damper that pulls": (RIGID | {"contact.damping": 1e6, "contact.tension": "adhesive"}, "a law that pulls"),
    "multipliers": (
        {"model": {"type": "reduced", "contact": "all"}, "contact.formulation": "augmented-lagrangian",
         "time.scheme": "implicit-midpoint"},
        "augmented multipliers",
    ),
}  # fmt: skip
ADVICE = re.compile(r"(?:set|choose) (?:\[(\w+)\] )?([\w.]+) = (\"[^\"]*\"|\{[^}]*\}|\w+)")


def compare(case: str, overrides: dict[str, Any]) -> None:
    """Compare displacements of all DOFs after some steps from the seat of the case."""
    simulation = gapbeam.model(CASES / case, overrides)
    scene = scene_of_model(simulation.case, simulation.model)
    start = simulation.start(simulation.seat_or_failure())
    (beam,) = scene.structures
    state = scene.state({beam: start.u[0]}, {beam: start.v[0]})
    found = gapbeam.history(scene, simulation.model.step, STEPS * simulation.model.step, state)
    *_, last = simulation.march(start, steps=STEPS)
    u = last.new.u[0]
    mine = beam.modes[2] @ found.last.state.q[:, 0]
    assert np.abs(mine - u).max() <= 1e-6 * np.abs(u).max()


@pytest.mark.parametrize("name", MARCHED)
def test_tables_that_a_scene_carries(name: str) -> None:
    """Each alone, on the coarse beam that is pushed hard."""
    compare("stability.toml", MARCHED[name])


@pytest.mark.slow(minutes=0.1)
def test_each_support_keeps_its_law() -> None:
    """Dampers by a restitution on one pier; a law that scenes do not have is refused at any of them."""
    own = RIGID | {"support.1.law": {"type": "kelvin-voigt", "restitution": 0.6}}
    assert isinstance(gapbeam.model(CASES / "piers.toml", own).model.law, MixedLaw)
    contacts = gapbeam.scene(CASES / "piers.toml", own).contacts
    assert [one.law.values[1] > 0.0 for one in contacts] == [one.name.startswith("second") for one in contacts]
    damped = {"type": "adams-impact", "damping": 1.0e5, "full_depth": 1.0e-5, "exponent": 1.0}
    with pytest.raises(gapbeam.UserError, match="the damper of the law"):
        gapbeam.scene(CASES / "piers.toml", RIGID | {"support.1.law": damped})


@pytest.mark.parametrize("name", REFUSED)
def test_tables_that_a_scene_refuses(name: str) -> None:
    """By the name that the case file has for them; advice followed to the letter gives a scene."""
    overrides, words = REFUSED[name]
    with pytest.raises(gapbeam.UserError, match=words) as refused:
        gapbeam.scene(CASES / "stability.toml", overrides)
    cured = dict(overrides)
    for table, key, value in ADVICE.findall(str(refused.value)):
        whole = f"{table}.{key}" if table else "contact.law" if key == "law" else key
        cured[whole.removesuffix(".type")] = tomllib.loads(f"x = {value}")["x"]
    if "leave friction out" in str(refused.value):
        cured.pop("contact.friction")
    assert cured != overrides
    assert gapbeam.scene(CASES / "stability.toml", cured).contacts


@pytest.mark.slow(minutes=0.3)
@pytest.mark.parametrize("file", sorted(path.name for path in CASES.glob("*.toml")))
def test_every_shipped_case_as_a_scene(file: str) -> None:
    """With a rigid beam, where the case allows that: exciters, recorded signals, holes, springs, fluids."""
    try:
        compare(file, RIGID)
    except gapbeam.UserError as refused:
        assert "no scene of this case" in str(refused)  # noqa: PT017
        assert file == "li2013-adams.toml"
    except gapbeam.CaseError as refused:
        assert "with joints" in str(refused)  # noqa: PT017
