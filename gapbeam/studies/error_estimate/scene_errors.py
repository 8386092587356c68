"""The error estimate of a run of a scene: from its records and the same scene at half the step into its summary.

With f of the run, H of half its step, K of twice the stiffness of its penalty contacts and M of twice the modes of
reduced structures and the elements of beams and frames, with finer meshes of reduced solids,

    E = max(F |f - H|, share of unresolved contacts) + 3.4 |f - K| + 2 |f - M| + what records miss of ranges.

The midpoint rule is of second order, where 4/3 |f - H| would do; where contacts close and open within steps it is of
first order, and F = 2 its error. Other schemes and impulses are of first order at each contact, Euler's rule
everywhere: F = 3, since 2 leaves out that what is lost falls with the loss, 1 - y^2 > 2 (y - y^2). Ranges of motions,
which may agree by chance, differ by at least a tenth of the range of the difference, sums of impulses by what they
differ in three quarters of the time. Of contacts of few steps half of the step shows as little as the run: see
`lost_in_steps`. Where both motions differ by 3 % of their range, the motion can no longer be predicted, and only its
statistics have errors. Errors include the part of a first frequency that digits of matrices leave unknown.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gapbeam.postprocess.results.results import records_in
from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.diagnostics.assumption import HOLDS
from gapbeam.solver.messages.errors import CaseError, Interrupted, RunError, UserError, in_one_line
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.run.interruption import Signals
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.output.progress import log_file
from gapbeam.solver.run.output.results_folder import write_summary
from gapbeam.solver.run.scene_run import SceneMarch, SceneRun, smoothing_of
from gapbeam.solver.run.scene_summary import DIGITS
from gapbeam.solver.scene.argument_checks import shown
from gapbeam.solver.scene.recorded_places import turning_places
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_march import steps_to
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.closing_table import ClosingTable, closing_table, words_beyond
from gapbeam.studies.error_estimate.companions import FINER, HALF_STEP, STIFFER, quiet, words_of_failed
from gapbeam.studies.error_estimate.figure_errors import (
    FACTORS,
    RESTS,
    FigureError,
    figure_errors,
    figure_spans,
    lost_by_own,
)
from gapbeam.studies.error_estimate.force_peaks import (
    FEWEST_RECORDS,
    SETTLED,
    Averages,
    contact_windows,
    doubtful_peaks,
    force_peaks,
    lost_in_steps,
    spans_between,
)
from gapbeam.studies.error_estimate.motion_horizon import horizon_of, repeats
from gapbeam.studies.error_estimate.motion_record import MotionRecord, impact_rates

OF_MIDPOINT, OF_OTHERS = 2.0, 3.0  # the factors F
Estimate = tuple[dict[str, Any], list[str], ClosingTable | str]
NO_ERRORS = {"GAPBEAM_ERRORS": "none"}


def with_scene_errors(asked: SceneRun, outcome: Outcome) -> Outcome:
    """Estimate the errors of a run that passed, write them to its summary, and return the outcome with them.

    Where a signal or the wall time ends the estimate, the summary has no errors, and the exit status says which.
    """
    off = any(os.environ.get(name) == value for name, value in NO_ERRORS.items())
    if outcome.exit_status != 0 or not asked.errors or off or "errors" in outcome.summary:
        return outcome
    clock, summary = time.perf_counter(), dict(outcome.summary)
    limit = None if asked.wall_time is None else max(asked.wall_time - summary["wall_time"]["total"], 1e-3)
    with Signals(limit) as signals:
        signals.march_begins()
        try:
            errors, warnings, closing = _estimated(asked, outcome, signals)
        except Interrupted as stopped:
            message = f"{signals.heard.words} while the errors of the run were estimated; its results are whole"
            LOG.error("%s", message)
            return replace(outcome, exit_status=stopped.exit_status, message=message)
    errors["seconds"] = time.perf_counter() - clock
    summary["errors"], summary["warnings"] = errors, [*summary["warnings"], *warnings]
    if isinstance(closing, str):
        summary["message"] += f"; {closing}"
    else:
        summary["closing"] = closing.as_data()
    with log_file(outcome.folder):
        for warning in warnings:
            LOG.warning("%s", warning)
    write_summary(outcome.folder, summary)
    return replace(outcome, summary=summary, message=summary["message"])


def _estimated(asked: SceneRun, outcome: Outcome, signals: Signals) -> Estimate:
    """Return the errors, warnings, and the table that closes the run, or why there is none."""

    def none(why: str) -> Estimate:
        return {"status": "not estimated", "reason": why}, [], f"errors not estimated: {why}"

    if asked.observers:
        return none("observers may set loads, and are not called again")
    records, labels = records_in(outcome.folder)
    begin = float(records["time"][0])
    run = _motion(records, labels, asked)
    if len(run.times) < FEWEST_RECORDS:
        return none(f"there are {counted(len(run.times), 'record')}, and {FEWEST_RECORDS} are the fewest")
    motions, failed = dict[str, MotionRecord](), dict[str, str]()
    stiff = asked.stiffer()
    companions: dict[str, Callable[[], SceneRun]] = {
        HALF_STEP: lambda: replace(asked, step=0.5 * asked.step, every=2 * asked.every)
    }
    if stiff is not None:
        companions[STIFFER] = lambda: replace(asked, scene=stiff)
    if asked.finer is not None:
        companions[FINER] = lambda: _finer(asked)
    for name, companion in companions.items():
        try:
            motions[name] = marched(companion(), signals).first(len(run.times))
        except Interrupted:
            raise
        except (CaseError, RunError) as error:
            failed[name] = in_one_line(str(error))
    if HALF_STEP not in motions:
        return none(f"{HALF_STEP}: {failed[HALF_STEP]}")
    return _errors(asked, run, motions, failed, begin, outcome.summary)


def _finer(asked: SceneRun) -> SceneRun:
    """Return the run of finer structures."""
    with quiet(logging.ERROR):
        found = asked.finer() if asked.finer else None
    if not isinstance(found, tuple) or len(found) != 2 or not isinstance(found[0], Scene):
        raise UserError(f"finer: found {shown(found)}, expected a scene and its start")
    return replace(asked, scene=found[0], start=found[1])


def marched(asked: SceneRun, signals: Signals) -> MotionRecord:
    """March a scene in memory.

    Raises:
        RunError: The march stopped before its end.
    """
    marcher = asked.marcher()
    limits = Gates(accept_energy_growth=True, accept_energy_loss=True)
    march = SceneMarch(asked, marcher, steps_to(asked.end, marcher.t, marcher.h), limits, signals)
    parts = [rows for rows in march.rows() if rows is not None]
    records = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return _motion(records, march.records.labels, asked)


def _motion(records: Mapping[str, Array], labels: Mapping[str, Sequence[str]], asked: SceneRun) -> MotionRecord:
    """Return the motion in records, with times from 0 on, also those of figures of one's own."""
    begin, in_space = float(records["time"][0]), len(labels.get("component", ())) > 1
    moved = {**records, "time": records["time"] - begin}
    found = MotionRecord.of_records(moved, labels, in_space, [one.earlier(begin) for one in asked.figures])
    impulsive = tuple(one.name for one in asked.scene.contacts if one.is_impulsive)
    return replace(found, impulsive=impulsive, turning=turning_places(asked.scene))


def _of_pairs(motion: MotionRecord, scene: Scene) -> Iterator[MotionRecord]:
    """Yield the motion of points relative to those that carry them, if there are such pairs: both may drift."""
    moved = dict(zip(motion.probes, motion.displacement.T, strict=True))
    pairs = {
        tuple(scene.short_name(f"{end.structure.name}.{end.name}") for end in one.points) for one in scene.contacts
    }
    apart = list[Array]()
    for motions in ("", " lateral") if motion.in_space else ("", " 1", " 2", " 3"):
        for first, *others in sorted(pairs):
            both = [(moved[first + motions], moved[one + motions]) for one in others
                    if {first + motions, one + motions} <= moved.keys()]  # fmt: skip
            apart += [(a - b) * bool(np.ptp(a - b) > RESTS * np.ptp(a)) for a, b in both]  # less is round-off
    if apart:
        yield replace(motion, probes=tuple(map(str, range(len(apart)))), displacement=np.stack(apart, axis=1))


def _errors(
    asked: SceneRun, run: MotionRecord, motions: Mapping[str, MotionRecord], failed: Mapping[str, str], begin: float,
    summary: Mapping[str, Any],
) -> Estimate:  # fmt: skip
    """Return the entries of summary, warnings and message; times of the summary count from t = 0."""
    statistics = summary.get("statistics")
    frequency = None if asked.period is None else 1.0 / asked.period
    smoothing = float(smoothing_of(asked, run.end)["window"])
    seen, other = ([one, *_of_pairs(one, asked.scene)] for one in (run, motions[HALF_STEP]))
    parted = [horizon_of(one, [(another, 1.0)], smoothing) for one, another in zip(seen, other, strict=True)]
    horizon = min((one for one in parted if one is not None), default=None)
    whole = (run.end, run.end, frequency, 0.0, run.interval, None)
    again = all(repeats(one, spans_between(*whole), smoothing) for one in seen)
    peaks = force_peaks(run, spans_between(*whole, again))
    midpoint = asked.scheme.law == 0.0 and asked.scheme.level == 0.5 and not run.impulsive
    factors = {**FACTORS, HALF_STEP: OF_MIDPOINT if midpoint else OF_OTHERS}
    figures = list[FigureError]()
    spans = spans_between(run.end, run.end, frequency, 0.0, run.interval, horizon, again)
    for span in spans:
        part = run.between(span.start, span.end)
        averages = Averages(smoothing, contact_windows(part))
        lost = lost_in_steps(part, asked.step)
        figures += figure_errors(run, motions, None, span, False, averages, lost=lost, factors=factors)
    settled = next((one for one in spans if one.name == SETTLED), None) if again else None
    averages = Averages(smoothing)
    for own in figure_spans(run, run.end, horizon, settled):
        lost = lost_by_own(run, own, asked.step)
        figures += figure_errors(run, motions, None, own, False, averages, lost=lost, factors=factors)
    doubted = [one for one in summary["assumptions"] if one["name"] == DIGITS.name and one["verdict"] != HOLDS]
    unknown = max((one["closest"] for one in doubted), default=0.0)
    figures = [one.with_part(DIGITS.name, unknown) for one in figures]
    warnings = list(doubtful_peaks(peaks, run.interval, turning=run.turning))
    warnings += words_of_failed(failed)
    if horizon is not None:
        start = begin + (0.0 if settled is None else settled.start)
        beyond = words_beyond(figures, statistics is not None, frequency, 0.0, horizon, start)
        warnings.append(
            f"the motion can be predicted up to t = {begin + horizon:.4g} s only: beyond, it depends on the step, and "
            f"{beyond}"
        )
    described = {
        "status": "estimated",
        "up_to": begin + run.end,
        "horizon": None if horizon is None else begin + horizon,
        "settled_part_repeats": again,
        "spans": [vars(one) for one in spans],
        "not_estimated": [] if asked.penalty else ["contact stiffness: no contact is named in `penalty`"],
        "failed_companions": dict(failed),
        "reference": None,
        "force_peaks": peaks,
        "companions": {name: {"step": asked.step * (0.5 if name == HALF_STEP else 1.0)} for name in motions},
        "figures": [one.as_data() for one in figures],
        "impact_rates": impact_rates(run, motions.values()),
    }
    return described, warnings, closing_table(figures, run.end, whole=True, statistics=statistics, horizon=horizon)
