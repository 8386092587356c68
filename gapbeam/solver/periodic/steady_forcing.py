"""Steady forcing of a case, with a whole number of steps in a period, and figures of the probes over a period."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import ceil, pi
from typing import Any

import numpy as np

from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case
from gapbeam.solver.integrators.scheme_choice import USUAL
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.loads.load_choice import Load, forcing_frequencies
from gapbeam.solver.march.python.march import March
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.models.model import Model, model_of
from gapbeam.solver.periodic.modal_period_map import ModalMap
from gapbeam.solver.supports.layout import with_value
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State

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
        return march_of_model(self.model, scheme_of_period(self.model.case))

    @property
    def forcing_frequency(self) -> float:
        """Frequency of the loads, Hz."""
        return forcing_frequencies(self.model.case.load)[0]

    @property
    def omega(self) -> float:
        """Angular frequency of the response, rad/s."""
        return 2.0 * pi * self.forcing_frequency / self.periods

    def modal_map(self) -> ModalMap | None:
        """Return the period map in modal coordinates; None for models that are not dense."""
        modal = modal_system(self.model.system)
        if modal is None:
            return None
        return ModalMap(modal, self.model.law, scheme_of_period(self.model.case), self.model.step, self.steps)


def scheme_of_period(case: Case) -> TimeScheme:
    """Return the scheme of a case where it has a period map; the usual one otherwise."""
    return case.time.scheme if case.time.scheme.has_period_map else USUAL


def with_whole_steps(model: Model) -> tuple[Model, int]:
    """Return a model whose step goes a whole number of times into half a forcing period, at most as long.

    Symmetric responses repeat with the sign changed after half a period.

    Returns:
        The model, and the number of steps in a forcing period.

    Collective.
    """
    period = 1.0 / forcing_frequencies(model.case.load)[0]
    count = 2 * max(1, ceil(0.5 * period / model.step - WHOLE))
    return _timed(model, step=period / count), count


def steady(model: Model, analysis: Periodic) -> SteadyModel:
    """Return a model under steady forcing: ramps have passed long ago, and a run is one period of the response.

    Computed values, such as the contact stiffness, stay those of the case.

    Collective.
    """
    model, count = with_whole_steps(model)
    case = frozen(model)
    loads = tuple(load.at_full_amplitude() for load in case.load)
    period = analysis.periods / forcing_frequencies(case.load)[0]
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
    if chosen is None or not case.contact.formulation.follows_the_law:
        return case
    return case.model_copy(update={"contact": case.contact.model_copy(update={"stiffness": chosen})})


def varied(start: SteadyModel, key: str, value: float) -> SteadyModel:
    """Return the steady model with a key of its case changed; a frequency is that of all loads.

    The number of steps in a period stays.

    Args:
        start: The model.
        key: As in `gapbeam.solver.case.checks.periodic_checks.value_of`.
        value: Its value, in the unit of the key.
    """
    case = start.model.case
    table, _, rest = key.partition(".")
    if table == "load":
        name, field = rest.split(".")
        meant = {load.name for load in case.load if _varies(load, name, field)}
        loads = tuple(load.model_copy(update={field: value}) if load.name in meant else load for load in case.load)
        case = case.model_copy(update={"load": loads})
    elif table == "support":
        case = case.model_copy(update={table: with_value(case.support, key, value)})
    else:
        case = case.model_copy(update={table: getattr(case, table).model_copy(update={rest: value})})
    period = start.periods / forcing_frequencies(case.load)[0]
    timed = case.time.model_copy(update={"end": period, "step": period / start.steps})
    return replace(start, model=model_of(case.model_copy(update={"time": timed}), start.model.body))


def _varies(load: Load, name: str, field: str) -> bool:
    """Return whether a key of the load with a name means this load too: a frequency is that of all loads."""
    return field in load.curve_units and (field == "frequency" or load.name == name)


def _timed(model: Model, step: float) -> Model:
    """Return a model with another step. Collective."""
    if step == model.step:
        return model
    case = model.case.model_copy(update={"time": model.case.time.model_copy(update={"step": step})})
    return replace(model, case=case)


HARMONICS_REPORTED = 5


@dataclass
class ProbeFigures:
    """Listens to the steps of a period.

    Attributes:
        model: Whose probes they are.
        places: Displacement of every probe in the bending direction at the end of every step, m.
    """

    model: Model
    places: list[list[float]] = field(default_factory=list)

    def listening(self, steps: Iterator[Step]) -> Iterator[Step]:
        """Yield the steps. Collective."""
        for step in steps:
            if step.completes:
                self._read(step.new)
            yield step

    def figures(self, periods: int) -> dict[str, Any]:
        """Return mean, peak to peak and harmonics 1-5 of the forcing of every probe, m.

        Args:
            periods: Forcing periods that were listened to.
        """
        if not self.places or not self.model.probes:
            return {}
        return {
            name: {"mean": float(np.mean(place)), "peak_to_peak": float(np.ptp(place))}
            | {"harmonics": harmonic_amplitudes(place, periods), "unit": "m"}
            for name, place in zip(self.model.probes, np.array(self.places).T, strict=True)
        }

    def _read(self, state: State) -> None:
        operators = self.model.system.operators
        self.places.append([float(row.evaluate(state.u[VALUE], operators)[-1]) for row in self.model.probes.values()])


def harmonic_amplitudes(values: Array, periods: int) -> list[float]:
    """Return the amplitudes of harmonics 1-5 of the forcing in equal samples of some of its periods."""
    spectrum = 2.0 * np.abs(np.fft.rfft(values)) / len(values)
    orders = range(periods, (HARMONICS_REPORTED + 1) * periods, periods)
    return [float(spectrum[k]) for k in orders if k < len(spectrum)]
