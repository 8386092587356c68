"""The error estimate of a finished run: from its records and its companions into its summary."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.postprocess.results.results import open_results
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_table import FullModel
from gapbeam.solver.case.symmetry import bends_in_two_planes
from gapbeam.solver.errors import UserError
from gapbeam.solver.models.body import Body
from gapbeam.solver.run.assumptions.frequency_findings import IN_BASIS, ON_MESH, RIGID, SLENDER
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.output.run_summary import write_summary
from gapbeam.solver.run.verdict import UNDER_NOISE
from gapbeam.studies.error_estimate.companion_marches import CompanionMotion, EstimateError, companion_motions
from gapbeam.studies.error_estimate.companions import SAME, STIFFER, CompanionPlan, companions_of
from gapbeam.studies.error_estimate.figure_errors import FigureError, figure_errors
from gapbeam.studies.error_estimate.force_peaks import doubtful_peaks, force_peaks
from gapbeam.studies.error_estimate.horizon import ALL, FEWEST_RECORDS, horizon_of, spans_of
from gapbeam.studies.error_estimate.key_figures import BEYOND_HORIZON, UP_TO_HORIZON, peak_forces
from gapbeam.studies.error_estimate.motion_record import MotionRecord

LOG = logging.getLogger("gapbeam")

LEAST_SHOWN = 0.001  # %: what rounds a sum of steps is no error estimate
SHARE, LEAST = 0.15, 5.0  # of the wall time of a full run, s: what its estimate may take
MARCHES, SET_UP = 5.0, 2.0  # marches of any other run, s
LEAST_BENDING = 1.0e-6  # of a figure: less is no error
FAR = 2.0  # times the limit of an assumption on the frequencies that carry the energy
RESOLVING = [one.name for one in (ON_MESH, IN_BASIS, SLENDER, RIGID)]
MOST_EATEN = 0.2  # of the energy under noise
ACCELERATION = " smoothed acceleration"
VARIABLE = "GAPBEAM_ERRORS"
IN_THE_MESSAGE = (" displacement", " stress", " peak force")
SHOWN = ("settled part", "whole run", "first part", BEYOND_HORIZON, UP_TO_HORIZON, "start-up")


@dataclass(frozen=True)
class RunErrors:
    """The error estimate of a run.

    Attributes:
        figures: Key figures with errors.
        horizon: Up to where the motion is predictable, s; None: up to the end of the estimate.
        reached: Up to where the companions went, s.
        whole: Whether that is the end of the run.
        later: Faces whose largest 0.5 ms mean force came after it.
        plan: The companions.
        marched: What they did, without their motions: DOFs, step, seconds by name.
    """

    figures: tuple[FigureError, ...]
    horizon: float | None
    reached: float
    plan: CompanionPlan
    marched: Mapping[str, Mapping[str, float]]
    whole: bool = True
    later: tuple[str, ...] = ()


def with_errors(case: Case, outcome: Outcome, comm: MPI.Comm) -> Outcome:
    """Estimate the errors of a finished run, write them to its summary, and return the outcome with them.

    A run that failed and one that has them are returned as they are.

    Args:
        case: The case of the run.
        outcome: How it ended.
        comm: The ranks of the run; the first one works, the others wait.

    Collective.
    """
    if outcome.exit_status != 0 or "errors" in outcome.summary:
        return outcome
    summary = on_rank_zero(comm, lambda: _estimated(case, outcome))
    return replace(outcome, summary=summary, message=summary["message"])


def errors_wanted(case: Case) -> bool:
    """Return whether errors are estimated: neither the case (output.errors) nor GAPBEAM_ERRORS switches them off.

    Raises:
        UserError: GAPBEAM_ERRORS is neither "none" nor "companions".
    """
    asked = os.environ.get(VARIABLE, "companions")
    if asked not in ("none", "companions"):
        raise UserError(f'the environment variable {VARIABLE} is "{asked}"; expected "none" or "companions"')
    return "none" not in (asked, case.output.errors)


def _estimated(case: Case, outcome: Outcome) -> dict[str, Any]:
    clock, summary = time.perf_counter(), dict(outcome.summary)
    errors, warnings = dict[str, Any](), list[str]()
    try:
        if not isinstance(case.analysis, Transient):
            raise EstimateError("a periodic response has its residual")
        if case.analysis.state is not None:
            raise EstimateError("companions cannot start from the state of another run, which is one of its model")
        run = MotionRecord.of_history(open_results(outcome.folder).history, bends_in_two_planes(case))
        if len(run.times) < FEWEST_RECORDS:
            raise EstimateError(f"there are {len(run.times)} records, and {FEWEST_RECORDS} are the fewest")
        errors["force_peaks"] = force_peaks(run, case)
        warnings += doubtful_peaks(errors["force_peaks"])
        found, beyond, noisy = estimate(case, run, summary, outcome.body), beyond_resolution(summary), eaten(summary)
        found = without_errors(found, "" if noisy else ACCELERATION) if beyond or noisy else found
        found = with_bending(found, summary["model"].get("bending", {}).get("off", 0.0))
        errors |= describe(found)
        warnings += [*doubts(found, run.end), *beyond, *noisy]
        summary["message"] += f"; {last_line(found)}"
    except (EstimateError, ResultsError) as failed:
        errors |= {"status": "not estimated", "reason": str(failed)}
        summary["message"] += f"; errors not estimated: {failed}"
    errors["seconds"] = time.perf_counter() - clock
    summary["errors"], summary["warnings"] = errors, [*summary["warnings"], *warnings]
    summary["wall_time"] = summary["wall_time"] | {"error_estimate": errors["seconds"]}
    for warning in warnings:
        LOG.warning("%s", warning)
    write_summary(outcome.folder, summary)
    return summary


def beyond_resolution(summary: Mapping[str, Any]) -> list[str]:
    """Return a sentence where the energy lies far beyond what model, mesh and basis resolve, and companions as little.

    Args:
        summary: Of the run, with its assumptions.
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
        summary: Of the run, with its assumptions.
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


def with_bending(found: RunErrors, share: float) -> RunErrors:
    """Return errors that include what round-off and locking take of the bending stiffness.

    Args:
        found: Errors of the companions, whose meshes have the same trouble.
        share: How far a figure may be off, over its value.
    """
    if share < LEAST_BENDING:
        return found
    figures = [
        one
        if one.error is None
        else replace(
            one, error=one.error + share * abs(one.value), parts={**one.parts, "bending": share * abs(one.value)}
        )
        for one in found.figures
    ]
    return replace(found, figures=tuple(figures))


def estimate(case: Case, run: MotionRecord, summary: Mapping[str, Any], body: Body | None = None) -> RunErrors:
    """Estimate the errors of the key figures of a run, on this process alone.

    Args:
        case: The case of the run.
        run: Its motion.
        summary: Its summary.
        body: That of its model, where it is still there.

    Raises:
        EstimateError: A companion is refused, finds no seat or does not converge, or there is no time for it.
    """
    computed = {default["key"]: default["value"] for default in summary["defaults"]}
    step = computed.get("time.step", case.time.step)
    stiff = computed.get("contact.stiffness", None if case.contact.stiffness == "auto" else case.contact.stiffness)
    plan = companions_of(case, step, stiff, "contact.stiffness" in computed)
    budget = _budget(case, summary)
    marches = companion_motions(case, plan.companions, run.end, step, run.interval, budget, body)
    return errors_of(case, run, {one.name: one for one in marches}, plan)


def errors_of(case: Case, run: MotionRecord, found: Mapping[str, CompanionMotion], plan: CompanionPlan) -> RunErrors:
    """Return the errors of the key figures of a run, given the motions of its companions."""
    motions = {name: one.motion for name, one in found.items()}
    reached = min(motion.end for motion in motions.values())
    whole, peaks = reached >= ALL * run.end, peak_forces(run)
    run = run.between(0.0, reached)
    later = () if whole else tuple(np.array(run.faces)[peaks > peak_forces(run)].tolist())
    same = motions.get(SAME, run)
    others = [motion for name, motion in motions.items() if name not in (SAME, STIFFER)]
    parted = [horizon_of(same, others), None if plan.in_plane else horizon_of(run, [same])]
    horizon = min((time for time in parted if time is not None), default=None)
    figures: list[FigureError] = []
    for span in spans_of(case, reached, run.interval, horizon):
        figures += figure_errors(run, motions, span, plan.in_plane)
    marched = {name: {"dofs": one.dofs, "step": one.step, "seconds": one.seconds} for name, one in found.items()}
    return RunErrors(tuple(figures), horizon, reached, plan, marched, whole, later)


def _budget(case: Case, summary: Mapping[str, Any]) -> float:
    """Return the wall time that the marches of companions may take, s."""
    march = float(summary["wall_time"]["march"])
    full = isinstance(case.model, FullModel)
    allowed = max(SHARE * march, LEAST - SET_UP) if full else MARCHES * march + SET_UP
    if case.output.wall_time is None:
        return allowed
    left = case.output.wall_time - float(summary["wall_time"]["total"]) - SET_UP
    if left <= 0.0:
        raise EstimateError("the wall-time limit leaves no time for it")
    return min(allowed, left)


def describe(found: RunErrors) -> dict[str, Any]:
    """Return the errors of a run as its summary has them."""
    return {
        "status": "estimated",
        "up_to": found.reached,
        "horizon": found.horizon,
        "plane_companions": found.plan.in_plane,
        "not_estimated": list(found.plan.left_out),
        "companions": dict(found.marched),
        "figures": [
            {
                "name": one.name,
                "unit": one.unit,
                "span": one.span,
                "value": one.value,
                "error": one.error,
                "relative_error": one.relative,
                "standard_error": one.standard_error,
                "differences": dict(one.parts),
            }
            for one in found.figures
        ],
    }


def last_line(found: RunErrors) -> str:
    """Return the main figures with their errors in one line."""
    known = [one for one in found.figures if one.error is not None]
    span = next((name for name in SHOWN if any(one.span == name for one in known)), None)
    shown = [one for one in known if one.span == span and one.name.endswith(IN_THE_MESSAGE)]
    words = ", ".join(f"{one.name} {_with_unit(one.value, one.unit)} {_plus_minus(one)}" for one in shown)
    until = "" if found.whole else f", up to t = {found.reached:.3g} s"
    return f"{span}{until}: {words}" if words else "no figure could be estimated"


def _plus_minus(one: FigureError) -> str:
    if one.relative is None:
        return f"+- {one.error:.2g} {one.unit}"
    percent = 100.0 * one.relative
    if percent < LEAST_SHOWN:
        return f"+- less than {LEAST_SHOWN:g} %"
    return f"+- {percent:.0f} %" if percent >= 10.0 else f"+- {percent:.2g} %"


def _with_unit(value: float, unit: str) -> str:
    if unit == "m" and abs(value) < 1.0:
        return f"{1e3 * value:.3g} mm"
    return f"{value:.3g} {unit}"


def doubts(found: RunErrors, end: float) -> list[str]:
    """Return what a user has to know of the errors, one sentence each."""
    words = []
    if found.horizon is not None:
        words.append(
            f"the motion can be predicted up to t = {found.horizon:.4g} s only: beyond, it depends on step and mesh, "
            "and only its statistics have errors"
        )
    if not found.whole:
        words.append(
            f"errors are estimated up to t = {found.reached:.4g} s of {end:g} s: the companions of the run would have "
            "taken too long"
        )
    if found.later:
        words.append(f"the largest force on {', '.join(found.later)} came later and has no error")
    if found.plan.left_out:
        words.append(f"the errors do not include {'; '.join(found.plan.left_out)}")
    return words
