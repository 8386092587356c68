"""What a chain of choices does not know is refused, never taken for one that it knows."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, cast

import pytest
from mpi4py import MPI
from pydantic import ValidationError

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.contact.laws.contact_law import kelvin_voigt
from gapbeam.solver.integrators.midpoint import DiscreteGradient
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.integrators.time_scheme import KernelNumbers, TimeScheme
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.march.compiled.plan_arrays import scheme_table
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March
from gapbeam.solver.memory.memory_check import memory_of
from gapbeam.solver.models import model as models
from gapbeam.solver.models import solid_body
from gapbeam.solver.models.bending_stiffness import BendingStiffness
from gapbeam.solver.schema.table import Table
from gapbeam.solver.seat.start import start_of_case
from gapbeam.solver.system.semi_discrete import Step
from tests.shared.toys import stopped_oscillator

DEMO = Path(__file__).parents[2] / "cases" / "demo.toml"


class MadeUp(Table):
    """A choice that nothing knows."""

    type: Literal["made-up"] = "made-up"


class OtherMidpoint(DiscreteGradient):
    """A scheme that marches in another way than the rule that it derives from."""

    def advance(self, *arguments: Any, **options: Any) -> Step:
        """Advance in another way."""
        return super().advance(*arguments, **options)


def case_with(table: str) -> Case:
    """The demo with an unknown choice instead of a table."""
    return read_case(DEMO).model_copy(update={table: MadeUp()})


def test_schemes() -> None:
    """A name that no scheme has is refused, and so is a scheme that leaves out what nobody may guess."""
    with pytest.raises(ValidationError, match="made-up"):
        scheme_of("made-up")
    with pytest.raises(TypeError, match="carries_acceleration and contact_range"):
        type("Silent", (TimeScheme,), {"__module__": __name__})
    silent = type("Silent", (DiscreteGradient,), {"__module__": __name__, "creates_energy": TimeScheme.creates_energy})
    with pytest.raises(TypeError, match="creates_energy"):
        silent()


def test_models(monkeypatch: pytest.MonkeyPatch) -> None:
    """An unknown model is not marched as the full one, and its memory is not estimated like the full one."""
    case = case_with("model")
    with pytest.raises(AssertionError, match="made-up"):
        memory_of(case, 1000.0)
    meshed = SimpleNamespace(tagged=SimpleNamespace(cell_count=1), seconds=0.0)
    for name, result in (
        ("refuse_too_large_before_meshing", None),
        ("mesh_beam", meshed),
        ("mesh_dofs", 1),
    ):
        monkeypatch.setattr(models, name, lambda *_, result=result: result)
    assembled = SimpleNamespace(seconds={"assembly": 0.0}, bending=BendingStiffness())
    monkeypatch.setattr(solid_body, "finite_elements", lambda *_: assembled)
    with pytest.raises(AssertionError, match="made-up"):
        models.build_body(case, MPI.COMM_SELF)


def test_analyses() -> None:
    """An unknown analysis does not start as a transient one."""
    with pytest.raises(AssertionError, match="made-up"):
        start_of_case(cast(Any, case_with("analysis")), cast(Any, None), None)


def test_kernels_march_the_schemes_that_they_know_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """What derives from a scheme that kernels know is marched step by step, and has no numbers for kernels."""
    system, law = stopped_oscillator(spring=1.0), kelvin_voigt(50.0)
    known, other = (
        March(system, law, scheme, EffectiveOperators(system, scheme), 0.01, 10)
        for scheme in (DiscreteGradient(), OtherMidpoint())
    )
    assert why_not_compiled(known) is None
    assert why_not_compiled(other) == "no kernel marches the scheme discrete-gradient"
    with pytest.raises(ValueError, match="no kernel"):
        scheme_table(other)
    monkeypatch.setattr(DiscreteGradient, "kernel", KernelNumbers(form=7))
    with pytest.raises(ValueError, match="form 7"):
        scheme_table(known)
