"""All time schemes: the one list of them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import TypeAdapter

from gapbeam.solver.integrators.central_difference import CentralDifference
from gapbeam.solver.integrators.generalized_alpha import GeneralizedAlpha, HHTAlpha, Newmark
from gapbeam.solver.integrators.midpoint import DiscreteGradient, ImplicitMidpoint
from gapbeam.solver.integrators.moreau_jean import MoreauJean
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.schema.table import OF_TYPE, models_in, type_name

Scheme = Annotated[
    DiscreteGradient | ImplicitMidpoint | Newmark | HHTAlpha | GeneralizedAlpha | MoreauJean | CentralDifference,
    OF_TYPE,
]
USUAL = DiscreteGradient()
"""The scheme of a case that names none."""

_ADAPTER: TypeAdapter[TimeScheme] = TypeAdapter(Scheme)


def scheme_of(name: str, **values: Any) -> TimeScheme:
    """Return a scheme by its name and the keys of its table.

    Raises:
        pydantic.ValidationError: No scheme has this name, or one of these keys or values.
    """
    return _ADAPTER.validate_python({"type": name, **values})


def scheme_names(trait: str = "") -> list[str]:
    """Return the names of all schemes, or of those with a trait, in the order of the list."""
    return [type_name(model) for model in models_in(Scheme) if not trait or getattr(model, trait)]
