"""Which contact laws there are: the union of their tables, and their damping formulas by number for compiled code.

A law is added by its file, and here by an import, a place in the union, a number and a line of `damping`.
"""

from __future__ import annotations

from math import nan
from typing import Annotated

from pydantic import Field

from gapbeam.solver.contact.laws.adams_impact import AdamsImpact, stepped_damping
from gapbeam.solver.contact.laws.chosen_law import ChosenLaw
from gapbeam.solver.contact.laws.damper import DampedPoint
from gapbeam.solver.contact.laws.elastic_plastic import ElasticPlastic
from gapbeam.solver.contact.laws.hunt_crossley import HuntCrossley, proportional_damping
from gapbeam.solver.contact.laws.kelvin_voigt import KelvinVoigt, constant_damping
from gapbeam.solver.contact.laws.lankarani_nikravesh import LankaraniNikravesh
from gapbeam.solver.contact.laws.piecewise_linear import PiecewiseLinear
from gapbeam.solver.jit import compiled_in_order
from gapbeam.solver.table import models_in, type_name

Law = Annotated[
    KelvinVoigt | HuntCrossley | LankaraniNikravesh | AdamsImpact | PiecewiseLinear | ElasticPlastic,
    Field(discriminator="type"),
]
LAWS: dict[str, type[ChosenLaw]] = {type_name(law): law for law in models_in(Law) if issubclass(law, ChosenLaw)}
"""The tables of the laws by their names in a case file."""

UNDAMPED, KELVIN_VOIGT, HUNT_CROSSLEY, ADAMS_IMPACT = range(4)
FORMULAS = {"kelvin-voigt": KELVIN_VOIGT, "hunt-crossley": HUNT_CROSSLEY, "adams-impact": ADAMS_IMPACT}
"""The number of each damping formula, by the name of the law that brings it."""


@compiled_in_order
def damping(formula: int, at: DampedPoint, depth: float) -> tuple[float, float, float]:
    """Return c(d), its slope and its integral C(d) by a formula; not numbers where the formula is not known."""
    if formula == UNDAMPED or depth <= 0.0:
        return 0.0, 0.0, 0.0
    if formula == KELVIN_VOIGT:
        return constant_damping(at, depth)
    if formula == HUNT_CROSSLEY:
        return proportional_damping(at, depth)
    if formula == ADAMS_IMPACT:
        return stepped_damping(at, depth)
    return nan, nan, nan
