"""Trade-off of a case: the reference, then the fidelity levels from cheap to expensive, within a budget of time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, inf
from pathlib import Path
from typing import Any

from gapbeam.postprocess.display_units import in_percent
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.overrides import parse_value
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.messages.errors import UserError, in_one_line
from gapbeam.studies.engine.workers import in_fresh_process
from gapbeam.studies.tradeoff.level_errors import (
    GROUPS,
    WHOLE,
    Grounds,
    Judged,
    choice,
    differences,
    doubts,
    front,
    judged,
    nearest,
    predictable_periods,
    uncertainty,
)
from gapbeam.studies.tradeoff.level_measurement import (
    FINEST,
    REFINEMENT,
    Level,
    LevelJob,
    LevelPlan,
    MeasuredLevel,
    measure,
    plan_levels,
)

FOLLOWED = 8  # forcing periods after the ramp over which it is asked how long a motion can be predicted
CYCLES, TRANSIENT = 60, 24  # forcing periods of the long marches
STARTS = 2
SHARE = 0.35  # of the budget that the reference may take for the periods that are followed, and its long marches
SPAN_SHARE = 0.35  # of the budget that marches over the span of the case may take
NEVER_REPEATS = "no cycle"
GROWTH = 1.2  # exponent of time over DOFs
Report = Callable[[str], None]


@dataclass(frozen=True)
class TradeoffStudy:
    """A trade-off.

    Attributes:
        plan: Levels that were run.
        levels: The fidelity levels and their errors.
        reference: The reference, compared with itself, and the check of it by full finite elements.
        full_check: Differences of the reduced and the full model on the mesh of the case; None where the full one was
            not affordable.
        grounds: Span, uncertainty of the reference and kind of motion.
        periods: Forcing periods from the seat over which figures were compared where not over the span.
        tolerance: The requested tolerance.
        chosen: The cheapest fidelity level inside it, or None.
        skipped: Fidelity levels that were too dear, with their predicted time, s.
        seconds: Wall time of the study, s.
        notes: Notes before the study.
    """

    plan: LevelPlan
    levels: tuple[Judged, ...]
    reference: Judged
    full_check: dict[str, float] | None
    grounds: Grounds
    periods: int
    tolerance: float
    chosen: Judged | None
    skipped: tuple[tuple[Level, float], ...]
    seconds: float
    notes: tuple[str, ...]

    @property
    def doubts(self) -> list[str]:
        """Reasons for which the chosen level does not promise the tolerance; empty where it does."""
        taken = self.chosen or nearest(self.levels, self.grounds)
        return ["every fidelity level failed"] if taken is None else doubts(taken, self.tolerance, self.grounds)

    @property
    def promised(self) -> bool:
        """True where the chosen level keeps the tolerance over the span of the case."""
        return self.chosen is not None and not self.doubts

    @property
    def front(self) -> list[Judged]:
        """The fidelity levels than which no other is both cheaper and nearer."""
        return front([one for one in self.levels if one.measured.verdict == "passed"])


def overrides_as_mapping(texts: list[str]) -> dict[str, Any]:
    """Return overrides KEY=VALUE as a mapping; anything else is left for the reader to refuse."""
    pairs = (text.partition("=") for text in texts)
    return {name.strip(): parse_value(value.strip()) for name, _, value in pairs}


def run_study(case: Path, fixed: dict[str, Any], tolerance: float, minutes: float, report: Report) -> TradeoffStudy:
    """Run the fidelity levels of a case.

    Args:
        case: Path of the case file.
        fixed: Keys that are replaced on all fidelity levels.
        tolerance: Largest error of a fidelity level that will do.
        minutes: Wall time that the study may take.
        report: Called with what is known beforehand and what each fidelity level gave.

    Raises:
        CaseError: The case has faults.
        UserError: Its forcing has no single frequency, its mesh cannot be refined, or the reference fails.
    """
    started, budget = time.perf_counter(), 60.0 * minutes
    read = read_case(case, fixed)
    frequency = _frequency(read)
    plan = plan_levels(read)
    notes = list(plan.notes)
    for note in notes:
        report(note)
    ramps = [load.rise_time for load in read.load]
    ramp = ceil(max(ramps, default=0.0) * frequency - 1e-9)
    most = ramp + FOLLOWED

    def run(
        levels: Sequence[Level], periods: int, long: Callable[[Level], bool], span: float = 0.0
    ) -> list[MeasuredLevel]:
        def job(level: Level) -> LevelJob:
            changes, cycles = {**fixed, **plan.fixed, **level.changes}, CYCLES if long(level) else 0
            return LevelJob(case, changes, periods, cycles, ramp + TRANSIENT, STARTS, span=0.0 if level.full else span)

        # alone on the machine, as far as this study goes: what is measured is time and memory
        return in_fresh_process(measure, [job(level) for level in levels])

    # the coarsest of the reference first: what it cost says what the finest will
    coarsest = plan.meshes[1]
    (first,) = run([coarsest], most, lambda _: True)
    _must_pass(coarsest, first)
    plan = _affordable(read, plan, first, most, frequency, SHARE * budget)
    finest = plan.reference
    never_repeats = NEVER_REPEATS in first.words
    span, cut = (0.0, "") if never_repeats else _span(read.time.end, frequency, plan, first, SPAN_SHARE * budget)
    predicted = _family_seconds(first, plan, coarsest, most, frequency) + len(plan.family) * span * first.per_second
    notes.append(
        f"reference: {finest.name}, the finest that is affordable: about {predicted:.0f} s for it and what its "
        "uncertainty is made of"
    )
    report(notes[-1])
    found: dict[str, MeasuredLevel] = {}
    for group in together(plan.family):
        for level, result in zip(group, run(group, most, lambda level: level is finest, span), strict=True):
            _must_pass(level, result)
            found[level.name] = result
            report(f"{level.name}: {result.dofs} DOFs, set-up {result.set_up:.1f} s")
    family = [found[level.name] for level in (finest, plan.meshes[0], plan.steps[0], plan.basis)]
    periods = max(predictable_periods(family, most), min(ramp + 1, most), 2)
    truth = found[finest.name]
    chaotic = never_repeats or NEVER_REPEATS in truth.words
    if chaotic:
        span, cut = 0.0, ""
        for member in found.values():
            member.span, member.windows = 0.0, {}
    notes.append(_comparison_words(read.time.end, span, periods, frequency, cut, chaotic))
    report(notes[-1])
    levels: list[Judged] = []
    skipped: list[tuple[Level, float]] = []
    last: dict[int, tuple[Level, MeasuredLevel]] = {}  # the last full fidelity level of each dimension
    for group in together(plan.levels):
        left = budget - (time.perf_counter() - started)
        wanted = _predicted(group[0], last, periods / frequency)
        if not group[0].full:
            wanted = len(group) * span * truth.per_second
        if wanted > left:
            skipped += [(level, wanted) for level in group]
            report(f"{group[0].name}: skipped, about {wanted:.0f} s of {max(left, 0.0):.0f} s that are left")
            continue
        for level, measured in zip(group, run(group, periods, lambda level: not level.full, span), strict=True):
            if level.full and measured.verdict == "passed":
                last[level.dimension] = level, measured
            one = judged(level, measured, truth, periods, read.time.end)
            levels.append(one)
            report(f"{level.name}: " + _words(one))
    own, full = (_named(levels, f"{model} {read.mesh.dimension}D") for model in ("reduced", "full"))
    check = _full_check(own, full, periods)
    grounds = Grounds(read.time.end, uncertainty(plan, found, periods), chaotic, cut)
    return TradeoffStudy(
        plan, tuple(levels), judged(finest, truth, truth, periods, read.time.end), check, grounds, periods,
        tolerance, choice(levels, tolerance, grounds), tuple(skipped), time.perf_counter() - started, tuple(notes),
    )  # fmt: skip


def together(levels: Sequence[Level]) -> list[list[Level]]:
    """Return fidelity levels in groups that share a mesh and a model, in the order of the first of each."""
    groups: dict[str, list[Level]] = {}
    for level in levels:
        groups.setdefault(level.body, []).append(level)
    return list(groups.values())


def _frequency(case: Case) -> float:
    frequencies = forcing_frequencies(case.load)
    if len(frequencies) != 1 or not case.probe:
        found = ", ".join(f"{f:g} Hz" for f in frequencies) or "no harmonic load"
        raise UserError(
            f"a trade-off compares figures over forcing periods at probes: found {found} and {len(case.probe)} probes; "
            "expected harmonic loads of one frequency and at least one [[probe]]"
        )
    return frequencies[0]


def _must_pass(level: Level, measured: MeasuredLevel) -> None:
    if measured.verdict != "passed":
        raise UserError(f"the reference of the trade-off, {level.name}, {measured.verdict}: {measured.message}")


def _seconds(first: MeasuredLevel, size: float, simulated: float, parts: float = 1.0) -> float:
    """Return the predicted time of a level whose mesh has size times the DOFs, with parts times the steps, s."""
    return float(first.set_up * size**GROWTH + simulated * first.per_second * parts)


def _family_seconds(first: MeasuredLevel, plan: LevelPlan, coarsest: Level, periods: int, frequency: float) -> float:
    """Return the predicted time of the reference family, whose steps are all the shortest but two, s."""
    short, long = periods / frequency, STARTS * (CYCLES + TRANSIENT) / frequency
    total = long * first.per_second
    for group in together(plan.family):
        total += _seconds(first, group[0].size / coarsest.size, len(group) * short)
    return total


def _span(end: float, frequency: float, plan: LevelPlan, first: MeasuredLevel, budget: float) -> tuple[float, str]:
    """Return the time from the seat over which figures are compared, s, and why it is not the whole case, or "".

    All levels but the full ones march over it, each in about the time of the coarsest mesh of the reference: reduced
    models of all meshes have about as many DOFs.
    """
    marches = len(plan.family) + sum(not level.full for level in plan.levels)
    wanted = max(end, 1.0 / frequency)
    seconds = marches * wanted * first.per_second
    if seconds <= budget:
        return wanted, ""
    part = max(wanted * budget / seconds, 1.0 / frequency)
    return part, (
        f"to march the reference and {marches - 1} other models over all of it would take about {seconds:.0f} s, and "
        f"{budget:.0f} s were allowed; `gapbeam tradeoff` with more `minutes=` covers more"
    )


def _comparison_words(end: float, span: float, periods: int, frequency: float, cut: str, chaotic: bool) -> str:
    """Return the part of the case over which figures are compared."""
    first = f"the first {periods} forcing periods ({periods / frequency:.3g} s)"
    if chaotic:
        return (
            f"motions are compared over {first}, as long as they can be predicted; the response never repeats, so "
            "beyond that means over windows and starts are compared"
        )
    whole = f"the {end:.4g} s of the case" if span >= WHOLE * end else f"the first {span:.3g} s of {end:.4g} s ({cut})"
    words = f"figures are compared in windows of 12 forcing periods over {whole}"
    return words if periods / frequency >= span else f"{words}; those of full models over {first} only"


def _affordable(
    case: Case, plan: LevelPlan, first: MeasuredLevel, periods: int, frequency: float, budget: float
) -> LevelPlan:
    """Return the plan with the finest reference that is affordable."""
    coarsest, coarser = plan.meshes[1], 1.0
    while _family_seconds(first, plan, coarsest, periods, frequency) > budget and coarser * FINEST < 2.0:
        coarser *= REFINEMENT
        plan = plan_levels(case, coarser)
    return plan


def _predicted(level: Level, last: dict[int, tuple[Level, MeasuredLevel]], simulated: float) -> float:
    """Return the predicted time of a full level from the last one of its dimension, s; 0 where nothing is known."""
    if not level.full or level.dimension not in last:
        return 0.0
    before, measured = last[level.dimension]
    size = level.size / before.size
    return _seconds(measured, size, simulated, float(size**GROWTH))


def _named(levels: list[Judged], name: str) -> Judged | None:
    return next((one for one in levels if one.level.name == name), None)


def _full_check(own: Judged | None, full: Judged | None, periods: int) -> dict[str, float] | None:
    if own is None or full is None or {own.measured.verdict, full.measured.verdict} != {"passed"}:
        return None
    return differences(own.measured.figures(periods), full.measured.figures(periods))


def _words(one: Judged) -> str:
    if one.measured.verdict != "passed":
        return f"{one.measured.verdict}: {in_one_line(one.measured.message)}"
    worst = max(one.errors, key=lambda group: one.errors[group], default=GROUPS[0])
    statistics = (
        "" if one.statistics in (None, 0.0) else f", statistics {_percent(one.statistics or 0.0)} beyond scatter"
    )
    return f"{one.seconds:.3g} s for the case, {_percent(one.error)} off in {worst}{statistics}"


def _percent(fraction: float) -> str:
    return "another cycle" if fraction == inf else in_percent(fraction)
