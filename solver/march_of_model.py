"""From a model to the march that its case asks for."""

from __future__ import annotations

from solver.analyses.resolution import Resolution
from solver.analyses.transient import EffectiveOperators, March
from solver.case_tables.time import DiscreteGradient
from solver.integrators.schemes import Integrator
from solver.model import Model


def march_of_model(model: Model, scheme: Integrator) -> March:
    """Return the march of a model: system, law, scheme, steps and their limits."""
    settings, gates = model.case.time, model.case.gates
    limits = () if isinstance(settings.scheme, DiscreteGradient) else (gates.impact_growth, gates.impact_loss)
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
