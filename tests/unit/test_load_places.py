"""Where loads act: models refuse a load whose place they do not know, and never take it for inertia."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import pytest
from mpi4py import MPI

from gapbeam.solver.assembly.assembled_system import assembled_system
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import support_reaction
from gapbeam.solver.loads.places import Attachment
from gapbeam.solver.loads.point_load import HarmonicLoad
from gapbeam.solver.loads.support_motion import BaseMotion
from gapbeam.solver.models.model import build_model
from tests.shared.models import COARSE, GRAVITY, beam_case

MODELS: tuple[dict[str, Any], ...] = ({"type": "full"}, {"type": "reduced"}, {"type": "beam"}, {"type": "rigid"})


@dataclass(frozen=True)
class Section:
    """A place that models do not know."""

    point: ClassVar[None] = None


class Moment(HarmonicLoad):
    """A harmonic load at no place that models know."""

    type: str = "moment"
    name: str = "moment"

    @property
    def place(self) -> Any:
        """A section of the beam."""
        return Section()


class Placeless(HarmonicLoad):
    """A harmonic load that says nothing about its place."""


class ShakenMass(BaseMotion):
    """A motion of the support that attaches a mass to the beam, at no point."""

    @property
    def attachment(self) -> Attachment:
        """1 kg."""
        return Attachment(1.0, 0.0, 0.0)


def twisted(changes: dict[str, Any] | None = None) -> Case:
    """Return the beam under gravity and a load of an unknown kind."""
    case = beam_case({"mesh": COARSE, **(changes or {})}, (GRAVITY,))
    return case.model_copy(update={"load": (*case.load, Moment(amplitude=1.0, frequency=20.0))})


def test_reactions_to_unknown_loads_are_not_guessed() -> None:
    with pytest.raises(AssertionError, match="Section"):
        support_reaction(twisted())


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model["type"])
def test_models_refuse_unknown_loads(model: dict[str, Any]) -> None:
    stiff = {"model": model, "contact": {"stiffness": 1.0e12}}
    with pytest.raises(AssertionError, match="Section"):
        build_model(twisted(stiff), MPI.COMM_SELF)


def test_loads_without_a_place_cannot_be_made() -> None:
    with pytest.raises(TypeError, match="place"):
        Placeless(amplitude=1.0, frequency=20.0)


def test_masses_are_attached_at_points_only() -> None:
    model = build_model(
        beam_case({"mesh": COARSE}, ({"type": "base_motion", "amplitude": 1.0, "frequency": 20.0},)), MPI.COMM_SELF
    )
    (motion,) = model.case.load
    case = model.case.model_copy(update={"load": (ShakenMass(**motion.model_dump()),)})
    body, rayleigh = model.body, (0.0, 0.0)
    with pytest.raises(TypeError, match="acts at no point"):
        assembled_system(case, body.operators, body.contact, body.patterns, 2, rayleigh)
