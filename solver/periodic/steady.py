"""A case under its steady forcing, with a whole number of steps in a period of its response."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, pi

from solver.analyses.transient import March
from solver.case import Case, Ramped
from solver.case_tables.analysis import Periodic
from solver.integrators.midpoint import Midpoint
from solver.march_of_model import march_of_model
from solver.modal import modal_system
from solver.model import Model, model_of
from solver.periodic.modal_map import ModalMap
from solver.time_step import forcing_frequencies

WHOLE = 1.0e-6  # of a step


@dataclass(frozen=True)
class SteadyModel:
    """A model whose loads have their full amplitude at all times.

    Attributes:
        model: The model; its run is one period of the response.
        periods: Forcing periods in that.
        steps: Steps in it.
    """

    model: Model
    periods: int
    steps: int

    @property
    def plan(self) -> March:
        """The march over one period of the response."""
        return march_of_model(self.model, midpoint_of(self.model.case))

    @property
    def forcing_frequency(self) -> float:
        """Of the loads, Hz."""
        return forcing_frequencies(self.model.case)[0]

    @property
    def omega(self) -> float:
        """Angular frequency of the response, rad/s."""
        return 2.0 * pi * self.forcing_frequency / self.periods

    def modal_map(self) -> ModalMap | None:
        """Return the period map in modal coordinates; None for models that are not dense."""
        modal = modal_system(self.model.system)
        if modal is None:
            return None
        return ModalMap(modal, self.model.law, midpoint_of(self.model.case), self.model.step, self.steps)


def midpoint_of(case: Case) -> Midpoint:
    """Return the midpoint rule of a case; the one with discrete gradients where it asks for another scheme."""
    return Midpoint(implicit=case.time.scheme.type == "implicit-midpoint")


def with_whole_steps(model: Model) -> tuple[Model, int]:
    """Return a model whose step goes a whole number of times into a forcing period, at most as long, and that number.

    Collective.
    """
    period = 1.0 / forcing_frequencies(model.case)[0]
    count = max(1, ceil(period / model.step - WHOLE))
    return _timed(model, step=period / count), count


def steady(model: Model, analysis: Periodic) -> SteadyModel:
    """Return a model under steady forcing: ramps have passed long ago, and a run is one period of the response.

    Computed values, such as the contact stiffness, stay those of the case.

    Collective.
    """
    model, count = with_whole_steps(model)
    case = frozen(model)
    loads = tuple(load.model_copy(update={"ramp": 0.0}) if isinstance(load, Ramped) else load for load in case.load)
    period = analysis.periods / forcing_frequencies(case)[0]
    timed = case.time.model_copy(update={"end": period})
    case = case.model_copy(update={"load": loads, "time": timed})
    made = model_of(case, model.body)
    made = replace(made, defaults=model.defaults)
    return SteadyModel(made, analysis.periods, analysis.periods * count)


def frozen(model: Model) -> Case:
    """Return the case of a model with the computed contact stiffness written into it."""
    case = model.case
    if case.contact.stiffness != "auto":
        return case
    chosen = next((default.value for default in model.defaults if default.key == "contact.stiffness"), None)
    if chosen is None or case.contact.formulation.type != "penalty":
        return case
    return case.model_copy(update={"contact": case.contact.model_copy(update={"stiffness": chosen})})


def varied(start: SteadyModel, key: str, value: float) -> SteadyModel:
    """Return the steady model with a key of its case changed; a frequency is that of all loads.

    The number of steps in a period stays.

    Args:
        start: The model.
        key: As in `solver.case_file.periodic.value_of`.
        value: Its value, in the unit of the key.
    """
    case = start.model.case
    table, _, rest = key.partition(".")
    if table == "load":
        name, field = rest.split(".")
        shaken = (load for load in case.load if isinstance(load, Ramped))
        meant = {load.name for load in shaken if field == "frequency" or load.name == name}
        loads = tuple(load.model_copy(update={field: value}) if load.name in meant else load for load in case.load)
        case = case.model_copy(update={"load": loads})
    else:
        case = case.model_copy(update={table: getattr(case, table).model_copy(update={rest: value})})
    period = start.periods / forcing_frequencies(case)[0]
    timed = case.time.model_copy(update={"end": period, "step": period / start.steps})
    return replace(start, model=model_of(case.model_copy(update={"time": timed}), start.model.body))


def _timed(model: Model, step: float) -> Model:
    """Return a model with another step. Collective."""
    if step == model.step:
        return model
    case = model.case.model_copy(update={"time": model.case.time.model_copy(update={"step": step})})
    return replace(model, case=case)
