"""From a model to the march that its case asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.python.adaptive_step import Resolution
from gapbeam.solver.march.python.march import EffectiveOperators, March

if TYPE_CHECKING:
    from gapbeam.solver.models.model import Model


def march_of_model(model: Model, scheme: TimeScheme) -> March:
    """Return the march of a model: system, law, scheme, steps and their limits."""
    settings, gates = model.case.time, model.case.gates
    limits = () if scheme.conserves_energy else (gates.impact_growth, gates.impact_loss)
    resolution = Resolution(model.contact_duration, *limits)
    return March(
        model.system,
        model.law,
        scheme,
        EffectiveOperators(model.system, scheme),
        model.step,
        round(settings.end / model.step),
        settings.max_halvings,
        settings.max_iterations,
        resolution if settings.adaptive else None,
    )
