"""Periodic response that a case asks for, from its model, its seat and its steady forcing.

A period of the forcing has a whole number of steps; figures of the probes are those over a period.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import ceil, pi
from typing import Any

import numpy as np

from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case
from gapbeam.solver.integrators.scheme_choice import USUAL
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, why_not_compiled
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.march.stepwise_march import March, march
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.models.model import Model, model_of
from gapbeam.solver.periodic.floquet import UNKNOWN, Judgment, with_error
from gapbeam.solver.periodic.harmonic_balance import series_steps
from gapbeam.solver.periodic.harmonic_continuation import (
    HARMONICS_REPORTED,
    NOTABLE_TRUNCATION,
    Climb,
    balanced_multipliers,
    climb,
)
from gapbeam.solver.periodic.period_map import MarchedMap, ModalMap, shoot_marched
from gapbeam.solver.periodic.shooting import Fourier, relative_change, shoot
from gapbeam.solver.supports.layout import with_value
from gapbeam.solver.system.modal_coordinates import modal_system
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State, Step

WHOLE = 1.0e-6  # of a step


@dataclass(frozen=True)
class SteadyModel:
    """A model whose loads have their full amplitude at all times.

    Attributes:
        case: The case; its run is one period of the response.
        model: Its model.
        periods: Forcing periods in that.
        steps: Steps in it.
    """

    case: Case
    model: Model
    periods: int
    steps: int

    @property
    def plan(self) -> March:
        """The march over one period of the response."""
        return march_of_model(self.model, scheme_of_period(self.model.scheme))

    @property
    def forcing_frequency(self) -> float:
        """Frequency of the loads, Hz."""
        return self.model.forcing[0]

    @property
    def omega(self) -> float:
        """Angular frequency of the response, rad/s."""
        return 2.0 * pi * self.forcing_frequency / self.periods

    def modal_map(self) -> ModalMap | None:
        """Return the period map in modal coordinates; None for models that are not dense."""
        modal = modal_system(self.model.system)
        if modal is None:
            return None
        return ModalMap(modal, self.model.law, scheme_of_period(self.model.scheme), self.model.step, self.steps)


def scheme_of_period(scheme: TimeScheme) -> TimeScheme:
    """Return a scheme that has a period map; the usual one for others."""
    return scheme if scheme.has_period_map else USUAL


def with_whole_steps(model: Model) -> tuple[Model, int]:
    """Return a model whose step goes a whole number of times into half a forcing period, at most as long.

    Symmetric responses repeat with the sign changed after half a period.

    Returns:
        The model, and the number of steps in a forcing period.

    Collective.
    """
    period = 1.0 / model.forcing[0]
    count = 2 * max(1, ceil(0.5 * period / model.step - WHOLE))
    return model.with_step(period / count), count


def steady(model: Model, analysis: Periodic) -> SteadyModel:
    """Return a model under steady forcing: ramps have passed long ago, and a run is one period of the response.

    Computed values, such as the contact stiffness, stay those of the case.

    Collective.
    """
    model, count = with_whole_steps(model)
    case = model.settled_case
    loads = tuple(load.at_full_amplitude() for load in case.load)
    period = analysis.periods / forcing_frequencies(case.load)[0]
    timed = case.time.model_copy(update={"end": period})
    case = case.model_copy(update={"load": loads, "time": timed})
    made = model_of(case, model.body)
    made = replace(made, defaults=model.defaults)
    return SteadyModel(made.case, made, analysis.periods, analysis.periods * count)


def varied(start: SteadyModel, key: str, value: float) -> SteadyModel:
    """Return the steady model with a key of its case changed; a frequency is that of all loads.

    The number of steps in a period stays.

    Args:
        start: The model.
        key: As in `gapbeam.solver.case.checks.periodic_checks.value_of`.
        value: Its value, in the unit of the key.
    """
    case = start.case
    table, _, rest = key.partition(".")
    if table == "load":
        name, field = rest.split(".")
        own = [load.name for load in case.load if field in load.curve_units]
        meant = {one for one in own if field == "frequency" or one == name}  # a frequency is that of all loads
        loads = tuple(load.model_copy(update={field: value}) if load.name in meant else load for load in case.load)
        case = case.model_copy(update={"load": loads})
    elif table == "support":
        case = case.model_copy(update={table: with_value(case.support, key, value)})
    else:
        case = case.model_copy(update={table: getattr(case, table).model_copy(update={rest: value})})
    period = start.periods / forcing_frequencies(case.load)[0]
    timed = case.time.model_copy(update={"end": period, "step": period / start.steps})
    case = case.model_copy(update={"time": timed})
    return replace(start, case=case, model=model_of(case, start.model.body))


@dataclass
class ProbeFigures:
    """Listens to the steps of a period.

    Attributes:
        model: Model that has the probes.
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


MULTIPLIERS_REPORTED = 12
NOTABLE_CHANGE = 0.01


@dataclass(frozen=True)
class PeriodicResponse:
    """A periodic response.

    Attributes:
        steady: The model under steady forcing.
        start: State at t = 0.
        steps: Steps of one period from there.
        figures: Figures for the summary.
        remarks: Remarks for the user, one sentence each.
        x: State at t = 0 in modal coordinates; None for models that are not dense.
    """

    steady: SteadyModel
    start: State
    steps: Iterator[Step]
    figures: dict[str, Any]
    remarks: list[str]
    x: np.ndarray[Any, np.dtype[np.float64]] | None = None


def find_response(
    model: Model, seat: State, analysis: Periodic, asked: Callable[[], bool], talk: Callable[[float, int], None]
) -> PeriodicResponse:
    """Find the periodic response of a model.

    Args:
        model: The model.
        seat: Its static seat.
        analysis: Table [analysis] of the case.
        asked: Whether to stop. Collective.
        talk: Called with the time of the march before the search, s, and the steps since the last call.

    Raises:
        NotConverged: There is no response near the start, or the method does not reach it.
        UserError: Harmonic balance would be too large.
        Interrupted: The user asked to stop.

    Collective.
    """
    clock = time.perf_counter()
    model, per_period = with_whole_steps(model)
    rounds = analysis.periods * ceil(model.end / (analysis.periods * per_period * model.step) - 1.0e-6)
    marched = rounds if analysis.start == "march" else 0

    def seen(now: float, taken: int) -> None:
        talk(now, taken)
        if asked():
            raise Interrupted(f"interrupted at t = {now:.6g} s of the march before the search")

    def pause() -> None:
        if asked():
            raise Interrupted("interrupted in the search for a periodic response")

    # under the loads of the case, ramps included
    plan = replace(march_of_model(model, scheme_of_period(model.scheme)), steps=marched * per_period)
    begin = end_of_march(plan, seat, seen)
    held = steady(model, analysis)
    settled = time.perf_counter()
    period_map = held.modal_map()
    if analysis.method == "harmonic-balance":
        assert period_map is not None
        response = _balanced(held, period_map, begin, analysis, marched > 0, pause)
    elif period_map is not None:
        response = _shot(held, period_map, begin, analysis, pause)
    else:
        response = _shot_by_krylov(held, begin, analysis, pause)
    figures = {
        "method": analysis.method,
        "forcing_frequency": held.forcing_frequency,
        "periods": analysis.periods,
        "period": held.steps * held.model.step,
        "steps_per_period": held.steps,
        "ramps": "passed before the search",
        "periods_marched": marched,
        "started_from": f"a march of {counted(marched, 'forcing period')}" if marched else "the seat",
        "seconds_before_search": settled - clock,
        "seconds_of_search": time.perf_counter() - settled,
    }
    return replace(response, figures=figures | response.figures)


def end_of_march(plan: March, seat: State, seen: Callable[[float, int], None]) -> State:
    """Return the end of a march as a state at t = 0 of the steady forcing; the seat where the plan has no steps.

    Args:
        plan: The march.
        seat: State that it starts from.
        seen: Called with the time, s, and the steps since the last call; what it raises ends the march.

    Raises:
        NotConverged: A step did not converge.

    Collective.
    """
    state = seat
    if plan.steps:
        for state, taken in _states(plan, seat):
            seen(state.time, taken)
    return replace(state, time=0.0)


def _states(plan: March, seat: State) -> Iterator[tuple[State, int]]:
    """Yield states of a march up to its end, and the steps since the last: of every step, or of some. Collective."""
    if why_not_compiled(plan) is None:
        for block in CompiledLoop(plan).blocks(seat, plan.steps):
            yield block.end, block.steps
        return
    for step in march(plan, seat):
        if step.completes:
            yield step.refreshed or step.new, 1


def _shot(
    held: SteadyModel, period_map: ModalMap, begin: State, analysis: Periodic, pause: Callable[[], None]
) -> PeriodicResponse:
    orbit = shoot(period_map, period_map.coordinates(begin), analysis.tolerance, analysis.max_iterations, pause)
    start = period_map.begun(orbit.x)
    judgment = with_error(period_map.stability(orbit.monodromy), 0.0)
    figures = {
        "residual": orbit.residual,
        "iterations": orbit.iterations,
        "residuals": list(orbit.residuals),
        **stability_figures(judgment),
    }
    remarks = _stability_remarks(judgment, "some damping")
    return PeriodicResponse(held, start, march(held.plan, start), figures, remarks, orbit.x)


def _shot_by_krylov(held: SteadyModel, begin: State, analysis: Periodic, pause: Callable[[], None]) -> PeriodicResponse:
    def report(iteration: int, residual: float) -> None:
        LOG.info("shooting, iteration %d: the state changes by %.2e over a period", iteration, residual)
        pause()

    plan = held.plan
    orbit = shoot_marched(MarchedMap(plan), begin, analysis.tolerance, analysis.max_iterations, report, pause)
    judgment = with_error(orbit.stability, orbit.multiplier_error)
    figures = {
        "residual": orbit.residual,
        "iterations": orbit.iterations,
        "residuals": list(orbit.residuals),
        "marches_of_disturbances": orbit.products,
        "multiplier_error": orbit.multiplier_error,
        **stability_figures(judgment),
    }
    remarks = _stability_remarks(judgment, 'type = "reduced" in [model], which finds all multipliers')
    return PeriodicResponse(held, orbit.state, march(plan, orbit.state), figures, remarks)


def _balanced(
    held: SteadyModel,
    period_map: ModalMap,
    begin: State,
    analysis: Periodic,
    near: bool,
    pause: Callable[[], None],
) -> PeriodicResponse:
    x, n = period_map.coordinates(begin), len(period_map.modal.squares)
    if near:
        places, _ = period_map.history(x)
        series = Fourier(min(analysis.harmonics, held.steps // 2 - 1), held.steps, held.omega)
        start = series, series.analyze(np.array([period_map.modal.coordinates(place) for place in places[:-1]]))
    else:
        start = Fourier(0, 5, held.omega), x[None, :n]
    found = climb(
        period_map.modal,
        held.model.law,
        held.omega,
        analysis.harmonics,
        analysis.samples_per_harmonic,
        start,
        near,
        analysis.tolerance,
        analysis.max_iterations,
        pause,
    )
    solution = found.solution
    place, speed, _ = solution.motion(np.zeros(1))
    x = np.concatenate([place[0], speed[0]])
    end, tangent = period_map.with_tangent(x)
    change = relative_change(period_map.scale, x, end)
    judgment = balanced_multipliers(period_map, found, period_map.stability(tangent))
    figures = {
        "residual": solution.residual,
        "iterations": sum(stage.iterations for stage in found.stages),
        "residuals": list(solution.residuals),
        "harmonics": analysis.harmonics,
        "samples": solution.series.samples,
        "ladder": [vars(stage) for stage in found.stages],
        "change_from_last_rung": found.change,
        "forces_beyond_harmonics": solution.truncated,
        "change_when_marched": change,
        "multiplier_error": judgment.error,
        **stability_figures(judgment),
    }
    begin, steps = series_steps(period_map.modal, held.model.law, solution, held.model.step, held.steps)
    advice = "analysis.method = shooting, or more analysis.harmonics"
    remarks = [*_stability_remarks(judgment, advice), *_harmonic_remarks(found)]
    gates = held.case.gates.model_copy(update={"accept_energy_growth": True})
    accepting = replace(held, case=held.case.model_copy(update={"gates": gates}))
    return PeriodicResponse(accepting, begin, steps, figures, remarks, x)


def stability_figures(judgment: Judgment) -> dict[str, Any]:
    """Return the multipliers for the summary, the leading ones of them: empty where they are not known."""
    if not judgment.known:
        return {"stability": UNKNOWN, "stable": None, "largest_multiplier": None, "multipliers": []}
    stability = judgment.stability
    report = stability.multipliers[:MULTIPLIERS_REPORTED]
    return {
        "stability": stability.kind,
        "stable": stability.stable,
        "largest_multiplier": stability.largest,
        "multipliers": [{"real": float(mu.real), "imaginary": float(mu.imag)} for mu in report],
    }


def _stability_remarks(judgment: Judgment, advice: str = "") -> list[str]:
    stability = judgment.stability
    if not judgment.known:
        return [f"whether the periodic response is stable is not known: {'; '.join(judgment.doubts)}; try {advice}"]
    if stability.stable:
        return []
    return [
        f"the periodic response is unstable ({stability.kind}; largest multiplier {stability.largest:.4g}): "
        "a march leaves it, and so would the beam"
    ]


def _harmonic_remarks(found: Climb) -> list[str]:
    remarks = []
    if found.solution.truncated > NOTABLE_TRUNCATION:
        remarks.append(
            f"{found.solution.truncated:.0%} of the contact force lies beyond harmonic "
            f"{found.solution.series.harmonics}: its peaks are not resolved; try more analysis.harmonics, or shooting"
        )
    if found.change is not None and found.change > NOTABLE_CHANGE:
        remarks.append(
            f"harmonics 1-5 still change by {found.change:.1%} from the last stage but one; try more analysis.harmonics"
        )
    failed = [stage.harmonics for stage in found.stages if not stage.converged]
    if failed:
        remarks.append(f"harmonic balance did not converge with {', '.join(map(str, failed))} harmonics on its way")
    return remarks
