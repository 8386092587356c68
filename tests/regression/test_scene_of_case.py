"""The scene of a case against the march of the case: two programs for one mechanics, step by step."""

from __future__ import annotations

import numpy as np
import pytest

import gapbeam
from gapbeam.interface.case_scene import scene_of_model
from gapbeam.solver.scene.marcher import Marcher
from tests.shared.command import PROJECT

CASES = PROJECT / "cases"
STEPS = 200
BEAM = {"model": {"type": "beam"}, "mesh.dimension": 2}
CIRCLE = {"type": "hole", "contact": "circle"}
HOLES: dict[str, object] = {"support.left.region": CIRCLE, "support.right.region": CIRCLE}
SHAKER = {"type": "harmonic_force", "name": "shaker", "point": 0.5, "amplitude": 30.0, "frequency": 25.0}
MOVED = [
    {"type": "gravity"},
    SHAKER | {"direction": [0.0, 1.0, 0.3]},
    {"type": "support_motion", "support": "left", "amplitude": 1e-4, "frequency": 40.0, "direction": [0.0, 0.6, 0.8]},
]
CLOSED = {"type": "clearance_change", "support": "left", "times": [0.0, 0.002, 0.004], "changes": [0.0, -5e-5, -8e-5]}
CHOICES: dict[str, tuple[str, dict[str, object]]] = {
    "reduced": ("stability.toml", {"model": {"type": "reduced"}}),
    "beam": ("stability.toml", BEAM),
    "rigid": ("stability.toml", {"model": {"type": "rigid"}}),
    "two supports on springs": ("sprung-stops.toml", {}),
    "a record": ("recorded.toml", {}),
    "round holes, rigid": ("tube-holes.toml", {"model": {"type": "rigid"}} | HOLES),
    "round holes, rigid sections": ("tube-holes.toml", {"model": {"type": "reduced", "sections": "rigid"}} | HOLES),
    "a hole that closes": ("tube-holes.toml", {"model": {"type": "rigid"}, "load": [*MOVED, CLOSED]} | HOLES),
    "a moved hole": ("tube-holes.toml", {"model": {"type": "rigid"}, "load": MOVED} | HOLES),
}


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.slow(minutes=0.1) if "round" in one else ()) for one in CHOICES]
)
def test_a_scene_moves_as_its_case(name: str) -> None:
    """Displacements of all DOFs after 200 steps of the default scheme, from the seat of the case."""
    file, overrides = CHOICES[name]
    simulation = gapbeam.model(CASES / file, overrides)
    scene = scene_of_model(simulation.case, simulation.model)
    start = simulation.start(simulation.seat())
    (beam,) = scene.structures
    state = scene.state({beam: start.u[0]}, {beam: start.v[0]})
    found = gapbeam.history(scene, simulation.model.step, STEPS * simulation.model.step, state)
    *_, last = simulation.march(start, steps=STEPS)
    u = last.new.u[0]
    mine = beam.modes[2] @ found.last.state.q[:, 0]
    close = 1e-6 * np.abs(u).max()  # what the contact solve of the case leaves, after 200 steps
    assert np.abs(mine - u).max() <= close
    assert np.abs(u - start.u[0]).max() > 100.0 * close
    assert max(np.abs(force).max() for force in found.force.values()) > 0.0
    begun = float(Marcher(scene, simulation.model.step, state).balance)
    energy = found.last.energy
    assert found.last.balance == pytest.approx(begun, abs=1e-9 * max(abs(energy["loads"]), energy["strain"]))


def test_members_of_a_case_differ_in_what_their_paths_name() -> None:
    """A stiffer member of all contacts of a case, by one path with a star, against the case that says so."""
    scene = gapbeam.scene(CASES / "stability.toml", {"model": {"type": "rigid"}})
    stiffness = [contact.law.values[0] for contact in scene.contacts]
    assert len(set(stiffness)) >= 1
    names = sorted({contact.name.split()[0] for contact in scene.contacts})
    load = next(one for one in scene.loads if one.name not in ("", "gravity"))
    twice = scene.with_({f"{names[0]}*.stiffness": 2.0 * stiffness[0]})
    changed = [contact.law.values[0] for contact in twice.contacts if contact.name.startswith(names[0])]
    assert changed == [2.0 * stiffness[0]] * len(changed)
    assert load in scene.loads


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"model": {"type": "full"}}, "a full model has its mesh"),
        ({"contact.law": {"type": "hunt-crossley", "restitution": 0.5}}, "follows from the speed at touch"),
        ({"contact.friction": {"coefficient": 0.2}, "model.contact": "all"}, "friction along the beam"),
    ],
)
def test_what_a_scene_has_no_noun_for_is_refused_by_name(overrides: dict[str, object], words: str) -> None:
    whole = {"model": {"type": "reduced"}} | overrides
    with pytest.raises(gapbeam.UserError, match=words):
        gapbeam.scene(CASES / "stability.toml", whole)
