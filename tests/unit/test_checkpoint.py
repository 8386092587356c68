"""A run that is interrupted and resumed computes what an uninterrupted one does, to the last bit."""

from __future__ import annotations

from pathlib import Path

import pytest

import gapbeam
from tests.shared.command import DEMO, RATTLE, alone
from tests.shared.interrupted import differing, run_in_parts

pytestmark = alone

HUNT = "contact.law={type='hunt-crossley', restitution=0.6}"
BRIEF = (*RATTLE, "time.end=0.007", "output.fields_interval=2e-3")
CASES = {
    "full": ((), (7, 42)),
    "friction": (("contact.friction={coefficient=0.3, static_coefficient=0.5, slip_velocity=1e-3}",), (37,)),
    "adaptive": (("time.adaptive=true", "time.max_halvings=3", "time.end=0.006"), (23,)),
    "restitution": ((HUNT,), (41,)),
    "massless": (("contact.mass=redistributed", "contact.formulation=unilateral"), (33,)),
    "explicit": (
        (
            "time.scheme=central-difference",
            "damping={mass=4.4, stiffness=0.0}",
            "time.step=1e-7",
            "time.end=2e-5",
            "output.history_interval=1e-6",
            "output.fields_interval=1e-5",
            "contact.stiffness=1e12",
        ),
        (50,),
    ),
    "generalized alpha": (("time.scheme=generalized-alpha", "contact.stiffness=1e12"), (33,)),
    "impulses": (("time.scheme=moreau-jean", "contact.formulation=unilateral"), (29,)),
    "nitsche": (("contact.formulation=nitsche",), (31,)),
    "augmented": (("contact.formulation=augmented-lagrangian", "time.scheme=implicit-midpoint"), (31,)),
    "reduced": (("model.type=reduced", "model.modes=8", "model.shapes=5", "time.end=0.05"), (2, 3)),
    "reduced with restitution": (
        ("model.type=reduced", "model.modes=8", "model.shapes=5", HUNT),
        (2,),
    ),
    "reduced, step by step": (
        ("model.type=reduced", "model.modes=8", "time.adaptive=true", "time.max_halvings=3"),
        (40,),
    ),
    "beam": (("model=beam", "time.end=0.05"), (4,)),
    "rigid": (("model=rigid", "time.end=0.05"), (4,)),
}


LATER = {"restitution", "generalized alpha", "augmented", "reduced with restitution", "rigid"}  # like others here


@pytest.mark.parametrize(
    ("keys", "stops"),
    [pytest.param(*case, marks=pytest.mark.slow) if name in LATER else case for name, case in CASES.items()],
    ids=CASES,
)
def test_resumed_run_is_the_same(keys: tuple[str, ...], stops: tuple[int, ...], tmp_path: Path) -> None:
    """Histories, fields and figures of every kind of march, stopped once or twice: no bit differs."""
    whole = gapbeam.run(DEMO, (*BRIEF, *keys), tmp_path / "whole")
    assert whole.exit_status == 0, whole.message
    parts = run_in_parts(DEMO, (*BRIEF, *keys), tmp_path / "parts", stops)
    assert parts.exit_status == 0, parts.message
    assert len(parts.summary["resumed"]) == len(stops)
    assert 0.0 < parts.summary["resumed"][0] < whole.summary["convergence"]["steps"]
    assert differing(tmp_path / "whole", tmp_path / "parts") == []
