"""Search of a run for periodic responses: progress, interruption, summary, curve."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gapbeam.solver.case.analysis_table import Continuation, Periodic
from gapbeam.solver.case.checks.periodic_checks import value_of
from gapbeam.solver.messages.errors import Interrupted
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.models.model import Model
from gapbeam.solver.periodic.continuation import CurveSettings
from gapbeam.solver.periodic.period_map import ModalMap
from gapbeam.solver.periodic.periodic_response import PeriodicResponse, SteadyModel, end_of_march, find_response, varied
from gapbeam.solver.periodic.response_branches import follow_branches
from gapbeam.solver.run.interruption import Interruption
from gapbeam.solver.run.output.field_files import coverage, curve_rows, unit_of, write_curve
from gapbeam.solver.run.output.progress import ProgressLine
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State

if TYPE_CHECKING:
    from mpi4py import MPI


def search(
    model: Model,
    seat: State,
    analysis: Periodic,
    folder: Path,
    comm: MPI.Comm,
    summary: dict[str, Any],
    interruption: Interruption,
) -> PeriodicResponse:
    """Find the response of a case, and the curve through it where one is asked for.

    Args:
        model: The model of the case.
        seat: Its static seat.
        analysis: Table [analysis] of the case.
        folder: Results folder, for the curve.
        comm: The ranks.
        summary: Takes what is found, under "periodic" and "warnings".
        interruption: Whether to stop.

    Raises:
        NotConverged: There is no periodic response near the start.
        UserError: Harmonic balance would be too large.
        Interrupted: A signal came, or the deadline.

    Collective.
    """

    def stop(words: str) -> None:
        if interruption.asked:
            raise Interrupted(words, interruption.agreed().exit_status)

    response = _found(model, seat, analysis, comm, summary["forcing"]["period"], interruption)
    found = response.figures
    summary["periodic"] = found
    summary["warnings"] += response.remarks
    LOG.info(
        "%s: a response of %s in %d iterations, residual %.1e, %s",
        found["method"],
        counted(found["periods"], "forcing period"),
        found["iterations"],
        found["residual"],
        stability_words(found),
    )
    for remark in response.remarks:
        LOG.warning("%s", remark)
    if analysis.continuation is not None:
        _follow_curve(response, analysis, analysis.continuation, seat, folder, comm, found, stop)
    return response


def _found(
    model: Model, seat: State, analysis: Periodic, comm: MPI.Comm, period: float | None, interruption: Interruption
) -> PeriodicResponse:
    """Find the response, with a line of progress."""
    with ProgressLine(model.end, period, quiet=comm.rank != 0) as progress:

        def talk(now: float, steps: int) -> None:
            progress.advance(now, steps, "before the search")

        try:
            return find_response(model, seat, analysis, lambda: interruption.asked, talk)
        except Interrupted as stopped:
            raise Interrupted(str(stopped), interruption.agreed().exit_status) from stopped


def stability_words(found: dict[str, Any]) -> str:
    """Return the stability of a response in words, from its figures."""
    if found["stable"] is None:
        return f"stability {found['stability']}"
    kind = "stable" if found["stable"] else f"unstable: {found['stability']}"
    return f"{kind}, largest multiplier {found['largest_multiplier']:.4g}"


def _follow_curve(
    response: PeriodicResponse,
    analysis: Periodic,
    asked: Continuation,
    seat: State,
    folder: Path,
    comm: MPI.Comm,
    found: dict[str, Any],
    stop: Callable[[str], None],
) -> None:
    """Follow the curve and write it; `stop` raises where the run was asked to stop."""
    started = time.perf_counter()
    held, x = response.steady, response.x
    assert x is not None
    case = held.case
    tables = {"support": case.support, "contact": case.contact}
    value = value_of(asked.key, tables, dict(enumerate(case.load)))
    assert value is not None
    settings = CurveSettings(
        asked.low,
        asked.high,
        asked.first_step,
        asked.longest_step,
        max_points=asked.max_points,
        tolerance=analysis.tolerance,
    )

    @lru_cache(maxsize=4)
    def model_at(at: float) -> SteadyModel:
        return varied(held, asked.key, at)

    @lru_cache(maxsize=4)
    def map_at(at: float) -> ModalMap:
        stop(f"interrupted on the curve, at {asked.key} = {at:g}")
        period_map = model_at(at).modal_map()
        assert period_map is not None
        return period_map

    def start_at(at: float) -> Array:
        held_there = model_at(at)
        steps = held_there.steps * ceil(found["periods_marched"] / held_there.periods)
        plan = replace(held_there.plan, steps=steps)
        words = f"interrupted in the march at {asked.key} = {at:g}, before the curve from there"
        return map_at(at).coordinates(end_of_march(plan, seat, lambda _time, _steps: stop(words)))

    branches = follow_branches(map_at, value, x, settings, start_at, analysis.periods)
    unit = unit_of(asked.key, held)
    rows = curve_rows(branches.curves, model_at)
    if comm.rank == 0:
        write_curve(folder, asked.key, unit, analysis.periods, branches, rows)
    events = [point for curve in branches.curves for point in curve.events]
    found["curve"] = {
        "key": asked.key,
        "unit": unit,
        "points": len(rows),
        **coverage(branches),
        "events": [{"value": point.value, "event": point.event} for point in events],
        "unstable_points": sum(row["stable"] is False for row in rows),
        "points_of_unknown_stability": sum(row["stable"] is None for row in rows),
        "seconds": time.perf_counter() - started,
    }
    for curve in branches.curves:
        ends = [f"{curve.points[at].value:.6g} ({why})" for at, why in zip((0, -1), curve.endings, strict=True)]
        LOG.info("curve in %s: %d points from %s to %s", asked.key, len(curve.points), *ends)
        for point in curve.events:
            LOG.info("%s at %s = %.6g %s", point.event, asked.key, point.value, unit)
    for low, high in branches.unstable:
        LOG.info(
            "no stable response of %d forcing periods from %.6g to %.6g %s: a march settles on another motion there",
            analysis.periods,
            low,
            high,
            unit,
        )
