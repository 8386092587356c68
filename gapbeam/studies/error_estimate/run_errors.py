"""The error estimate of a finished run: from its records and its companions into its summary."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.postprocess.results.results import records_in
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.postprocess.signals.figure_names import LARGEST_FORCE, MEAN_FORCE, SMOOTHED_ACCELERATION
from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.solution_tables import FullModel, ReducedModel
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.models.body import Body
from gapbeam.solver.run.assumptions.frequency_findings import IN_BASIS, ON_MESH, RIGID, SLENDER
from gapbeam.solver.run.interruption import Signals
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.output.progress import log_file
from gapbeam.solver.run.output.results_folder import write_summary
from gapbeam.solver.run.stop_rule import has_statistics
from gapbeam.solver.run.verdict import UNDER_NOISE
from gapbeam.studies.error_estimate.closing_table import MOST_FORCES, closing_table, with_unit, words_beyond
from gapbeam.studies.error_estimate.companion_marches import WHOLE, CompanionMotion, EstimateError, companion_motions
from gapbeam.studies.error_estimate.companions import (
    FOURFOLD,
    STIFFER,
    TWICE,
    CompanionPlan,
    companions_of,
    error_way,
    words_of_failed,
)
from gapbeam.studies.error_estimate.figure_errors import (
    FigureError,
    figure_errors,
    figure_spans,
    lost_by_own,
)
from gapbeam.studies.error_estimate.force_peaks import (
    BEYOND_HORIZON,
    FEWEST_RECORDS,
    SETTLED,
    SMALLER_STEP,
    WHOLE_RUN,
    Averages,
    Span,
    contact_windows,
    doubtful_peaks,
    force_peaks,
    frequency_and_rise,
    lost_in_steps,
    peak_forces,
    spans_of,
)
from gapbeam.studies.error_estimate.motion_horizon import horizon_of, repeats
from gapbeam.studies.error_estimate.motion_record import MotionRecord, impact_rates
from gapbeam.studies.error_estimate.stiff_supports import doubts_about_forces, own_stiffness_advice

if TYPE_CHECKING:
    from mpi4py import MPI


SET_UP = 2.0  # s, of a wall time that the user limits
FAR = 2.0  # times the limit of an assumption on the frequencies that carry the energy
RESOLVING = [one.name for one in (ON_MESH, IN_BASIS, SLENDER, RIGID)]
MOST_EATEN = 0.2  # of the energy under noise
ACCELERATION = f" {SMOOTHED_ACCELERATION}"
SHARES = {TWICE: 0.25, FOURFOLD: 0.25}  # of a difference: half the step would make a quarter of it


@dataclass(frozen=True)
class RunErrors:
    """The error estimate of a run.

    Attributes:
        figures: Key figures with errors.
        horizon: Time up to which the motion is predictable, s; None: up to the end of the estimate.
        reached: Time up to which the companions went, s.
        whole: Whether that is the end of the run.
        plan: The companions.
        marched: Results of the companions without their motions: DOFs, step, steps, seconds by name.
        whole: Whether that is the end of the run.
        later: Faces whose largest force came after all figures that have errors.
        repeats: Whether the second half is periodic: settled.
        failed: Companions without a motion, and why.
        spans: The parts of the run.
        beyond: Words on the figures that have errors beyond the horizon.
        impact_rates: Least and largest number of impacts a second among run and companions, by face.
    """

    figures: tuple[FigureError, ...]
    horizon: float | None
    reached: float
    plan: CompanionPlan
    marched: Mapping[str, Mapping[str, float]]
    whole: bool = True
    later: tuple[str, ...] = ()
    repeats: bool = False
    failed: Mapping[str, str] = field(default_factory=dict)
    spans: tuple[Span, ...] = ()
    impact_rates: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    beyond: str = ""


def with_errors(case: Case, outcome: Outcome, comm: MPI.Comm) -> Outcome:
    """Estimate the errors of a finished run, write them to its summary, and return the outcome with them.

    A run that has them is returned as it is; one that ended early gets the peaks of its forces, by the same definition
    as those of a whole run. Where a signal ends the estimate, the summary has no errors, and the exit status comes from
    the signal.

    Args:
        case: The case of the run.
        outcome: Its end.
        comm: The ranks of the run; the first one works, the others wait.

    Collective.
    """
    if outcome.exit_status != 0:
        on_rank_zero(comm, lambda: _add_peaks(case, outcome))
        return outcome
    if "errors" in outcome.summary:
        return outcome
    with Signals(None) as signals:
        try:
            with signals.turned():
                summary = on_rank_zero(comm, lambda: _estimated(case, outcome))
        except Interrupted as stopped:
            message = (
                f"{signals.heard.words} while the errors of the run were estimated; its results are whole, and "
                "`resume=True` estimates the errors"
            )
            LOG.error("%s", message)
            return replace(outcome, exit_status=stopped.exit_status, message=message)
    return replace(outcome, summary=summary, message=summary["message"])


def _add_peaks(case: Case, outcome: Outcome) -> None:
    """Add the peak forces of a run that ended early to its summary, as far as it came, and log them."""
    if "errors" in outcome.summary or not isinstance(case.analysis, Transient):
        return
    try:
        run = MotionRecord.of_records(*records_in(outcome.folder), bends_in_two_planes(case))
        if len(run.times) < FEWEST_RECORDS:
            return
        whole = [Span("first part", 0.0, run.end, 1)]
        outcome.summary["errors"] = {
            "status": "not estimated",
            "reason": f"the run ended early, at t = {run.end:.6g} s",
            "force_peaks": force_peaks(run, _whole_spans(case, run) or whole),
        }
        write_summary(outcome.folder, outcome.summary)
    except (ResultsError, OSError):  # the run has said why it ended
        return
    windows = contact_windows(run)
    forces = peak_forces(run, [windows[face] for face in run.faces])
    words = [
        f"{face} {LARGEST_FORCE if windows[face] is None else MEAN_FORCE} {with_unit(float(force), 'N')}"
        for face, force in zip(run.faces, forces, strict=True)
    ]
    LOG.info("up to t = %.6g s, without errors: %s", run.end, ", ".join(words[:MOST_FORCES]))


def _estimated(case: Case, outcome: Outcome) -> dict[str, Any]:
    clock, summary = time.perf_counter(), dict(outcome.summary)
    errors, warnings = dict[str, Any](), list[str]()
    try:
        if not isinstance(case.analysis, Transient):
            raise EstimateError("a periodic response has its residual")
        if case.analysis.state is not None:
            raise EstimateError("companions cannot start from the state of another run, which is one of its model")
        run = MotionRecord.of_records(*records_in(outcome.folder), bends_in_two_planes(case), case.figure)
        if len(run.times) < FEWEST_RECORDS:
            raise EstimateError(f"there are {counted(len(run.times), 'record')}, and {FEWEST_RECORDS} are the fewest")
        errors["force_peaks"] = force_peaks(run, _whole_spans(case, run))
        computed = {default["key"]: default["value"] for default in summary["defaults"]}
        advice = own_stiffness_advice(case, computed)
        warnings += doubtful_peaks(errors["force_peaks"], run.interval, "" if advice else SMALLER_STEP)
        found, beyond, noisy = estimate(case, run, summary, outcome.body), beyond_resolution(summary), eaten(summary)
        found = without_errors(found, "" if noisy else ACCELERATION) if beyond or noisy else found
        off = summary["model"].get("bending", {}).get("off", 0.0)  # by round-off and locking, also of companions
        found = replace(found, figures=tuple(one.with_part("bending", off) for one in found.figures))
        errors |= describe(found)
        warnings += [*doubts(found, run.end), *beyond, *noisy, *doubts_about_forces(found.figures, advice)]
        summary["closing"] = closing_table(
            found.figures, found.reached, found.whole, summary.get("statistics"), found.horizon
        ).as_data()
    except (EstimateError, ResultsError) as failed:
        errors |= {"status": "not estimated", "reason": str(failed)}
        summary["message"] += f"; errors not estimated: {failed}"
    errors["seconds"] = time.perf_counter() - clock
    summary["errors"], summary["warnings"] = errors, [*summary["warnings"], *warnings]
    summary["wall_time"] = summary["wall_time"] | {"error_estimate": errors["seconds"]}
    with log_file(outcome.folder):
        for warning in warnings:
            LOG.warning("%s", warning)
    write_summary(outcome.folder, summary)
    return summary


def beyond_resolution(summary: Mapping[str, Any]) -> list[str]:
    """Return a sentence where model, mesh and basis, and those of comparison runs, resolve little of the energy.

    Args:
        summary: Summary of the run, with its assumptions.
    """
    passed = [
        one
        for one in summary.get("assumptions", [])
        if one["name"] in RESOLVING and not one["closest"] <= FAR * one["limit"]
    ]
    words = [f"{one['name']} {one['closest']:.3g}, limit {one['limit']:g}" for one in passed]
    together = f"the errors of accelerations are not known, as the companions resolve as little: {'; '.join(words)}"
    return [together] if words else []


def eaten(summary: Mapping[str, Any]) -> list[str]:
    """Return a sentence where the scheme took or created much of the energy under noise: half of the step does, too.

    Args:
        summary: Summary of the run, with its assumptions.
    """
    shares = [one["closest"] for one in summary.get("assumptions", []) if one["name"] == UNDER_NOISE[0]]
    return [
        f"the errors are not known: under noise the scheme took or created {share:.0%} of the energy, and does so with "
        "half of the step as well; try a much smaller time.step, or the scheme discrete-gradient"
        for share in shares
        if not share <= MOST_EATEN
    ]


def without_errors(found: RunErrors, ending: str) -> RunErrors:
    """Return errors of which those of the figures whose names end in some words are not known."""
    figures = tuple(replace(one, error=None) if one.name.endswith(ending) else one for one in found.figures)
    return replace(found, figures=figures)


def estimate(case: Case, run: MotionRecord, summary: Mapping[str, Any], body: Body | None = None) -> RunErrors:
    """Estimate the errors of the key figures of a run, on this process alone.

    Args:
        case: The case of the run.
        run: Its motion.
        summary: Its summary.
        body: Body of its model, where it still exists.

    Raises:
        EstimateError: No companion has a motion, there are too few records for one, or there is no time.
    """
    computed = {default["key"]: default["value"] for default in summary["defaults"]}
    plan, step = plan_of(case, computed), computed.get("time.step", case.time.step)
    interval = plan.records * run.interval
    if len(run.times) < FEWEST_RECORDS * plan.records:
        raise EstimateError(
            f"there are {counted(len(run.times), 'record')}, and {FEWEST_RECORDS * plan.records} are the fewest"
        )
    marches = companion_motions(case, plan.companions, run.end, interval, _time_left(case, summary), body)
    return errors_of(case, run, {one.name: one for one in marches}, plan, step)


def plan_of(case: Case, computed: Mapping[str, Any]) -> CompanionPlan:
    """Return the companions of a run.

    Args:
        case: The case of the run.
        computed: Its computed defaults by key.
    """
    automatic = case.contact.stiffness == "auto"
    stiff = computed.get("contact.stiffness", None if automatic else case.contact.stiffness)
    step = computed.get("time.step", case.time.step)
    return companions_of(case, step, stiff, automatic, error_way(case) == "thorough")


def errors_of(
    case: Case, run: MotionRecord, found: Mapping[str, CompanionMotion], plan: CompanionPlan, step: float | None = None
) -> RunErrors:
    """Return the errors of the key figures of a run, given the motions of its companions.

    Args:
        case: The case of the run.
        run: Its motion.
        found: Motions of the companions.
        plan: The companions.
        step: Time step of the run, s; None: its records are its steps.
    """
    motions = {name: one.motion for name, one in found.items() if one.motion is not None}
    failed = {name: one.failure for name, one in found.items() if one.motion is None}
    reference = plan.reference if plan.reference in motions else None
    if not motions or (plan.in_plane and reference is None):
        raise EstimateError("; ".join(f"{name}: {why}" for name, why in failed.items()))
    if reference is None and plan.reference is not None:  # the others march with another step than the run
        failed |= dict.fromkeys(motions, f"nothing to compare with, as {plan.reference} failed")
        raise EstimateError("; ".join(f"{name}: {why}" for name, why in failed.items()))
    reached = min(motion.end for motion in motions.values())
    interval = plan.records * run.interval
    whole = reached > run.end - interval * (1.0 + WHOLE)
    part = run if whole else run.between(0.0, reached)
    smoothing, _ = smoothing_window(case)
    horizon, settled = _predictability(case, part, motions, plan, reference, smoothing)
    figures = list[FigureError]()
    spans = spans_of(case, reached, interval, horizon, settled)
    if spans and spans[-1].name == WHOLE_RUN:
        spans[-1] = replace(spans[-1], width=run.end)
    meshed = isinstance(case.model, FullModel | ReducedModel)
    for span in spans:
        spanned = part.between(span.start, span.end)
        averages, lost = Averages(smoothing, contact_windows(spanned)), lost_in_steps(spanned, step or run.interval)
        figures += figure_errors(part, motions, reference, span, plan.in_plane, averages, plan.records, meshed, lost)
    averages = Averages(smoothing)
    repeating = next((one for one in spans if one.name == SETTLED), None) if settled else None
    for own in figure_spans(run, reached, horizon, repeating):
        lost = lost_by_own(run, own, step or run.interval)
        figures += figure_errors(run, motions, reference, own, plan.in_plane, averages, plan.records, meshed, lost)
    beyond, rates = "", impact_rates(part, motions.values())
    if horizon is not None:
        start = 0.0 if repeating is None else repeating.start
        beyond = words_beyond(figures, has_statistics(case), *frequency_and_rise(case), horizon, start)
        if not any(one.error is not None and one.span in (SETTLED, BEYOND_HORIZON) for one in figures):
            part = run.between(0.0, horizon)
    grown = run.force.max(axis=0) > part.force.max(axis=0, initial=0.0)
    later = tuple(np.array(run.faces)[grown].tolist())
    marched = {
        name: {"dofs": one.dofs, "step": one.step, "steps": one.steps, "seconds": one.seconds}
        for name, one in found.items()
        if one.steps
    }
    return RunErrors(
        tuple(figures), horizon, reached, plan, marched, whole, later, settled, failed, tuple(spans),
        rates, beyond,
    )  # fmt: skip


def _predictability(
    case: Case, run: MotionRecord, motions: Mapping[str, MotionRecord], plan: CompanionPlan, reference: str | None,
    smoothing: float,
) -> tuple[float | None, bool]:  # fmt: skip
    """Return the horizon of a run, s, and whether it has settled."""
    thin = run.thinned(plan.records)
    same = thin if reference is None else motions[reference]
    others = [(motion, SHARES.get(name, 1.0)) for name, motion in motions.items() if name not in (reference, STIFFER)]
    parted = [horizon_of(same, others, smoothing)]
    if reference is not None and not plan.in_plane:
        parted.append(horizon_of(thin, [(same, SHARES.get(reference, 1.0))], smoothing))
    horizon = min((time for time in parted if time is not None), default=None)
    return horizon, repeats(run, spans_of(case, run.end, run.interval, None), smoothing)


def _whole_spans(case: Case, run: MotionRecord) -> list[Span]:
    """Return the parts of a motion without a horizon, the settled part among them where it has settled."""
    spans = spans_of(case, run.end, run.interval, None)
    again = repeats(run, spans, smoothing_window(case)[0])
    return spans_of(case, run.end, run.interval, None, again) if again else spans


def _time_left(case: Case, summary: Mapping[str, Any]) -> float | None:
    """Return the wall time that the marches of companions may take, s; None where the user does not limit it."""
    if case.output.wall_time is None:
        return None
    left = case.output.wall_time - float(summary["wall_time"]["total"]) - SET_UP
    if left <= 0.0:
        raise EstimateError("the wall-time limit leaves no time for it")
    return left


def describe(found: RunErrors) -> dict[str, Any]:
    """Return the errors of a run as its summary has them."""
    return {
        "status": "estimated",
        "up_to": found.reached,
        "horizon": found.horizon,
        "settled_part_repeats": found.repeats,
        "spans": [vars(one) for one in found.spans],
        "plane_companions": found.plan.in_plane,
        "not_estimated": list(found.plan.left_out),
        "failed_companions": dict(found.failed),
        "reference": found.plan.reference,
        "companions": dict(found.marched),
        "figures": [one.as_data() for one in found.figures],
        "impact_rates": dict(found.impact_rates),
    }


def doubts(found: RunErrors, end: float) -> list[str]:
    """Return the remarks on the errors, one sentence each."""
    words = []
    if found.horizon is not None:
        words.append(
            f"the motion can be predicted up to t = {found.horizon:.4g} s only: beyond, it depends on step and mesh, "
            f"and {found.beyond}"
        )
    if not found.whole:
        words.append(
            f"errors are estimated up to t = {found.reached:.4g} s of {end:g} s: the comparison runs met the limit of "
            "the wall time"
        )
    if found.later:
        words.append(f"the largest force on {', '.join(found.later)} came later and has no error")
    words += words_of_failed(found.failed)
    if found.plan.left_out:
        words.append(f"the errors do not include {'; '.join(found.plan.left_out)}")
    return words
