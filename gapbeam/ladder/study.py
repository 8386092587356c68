"""The trade-off of a case: the reference first, then the rungs from cheap to dear, within a budget of time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, inf
from pathlib import Path
from typing import Any

from gapbeam.ladder.judgement import GROUPS, Judged, choice, differences, foretold, front, judged, uncertainty
from gapbeam.ladder.measure import Job, Measured, measure
from gapbeam.ladder.rungs import FINEST, REFINEMENT, Ladder, Rung, ladder_of
from solver.case import Case, Ramped
from solver.case_file.overrides import parse_value
from solver.case_file.reader import read_case
from solver.errors import UserError
from solver.studies.side_by_side import side_by_side
from solver.time_step import forcing_frequencies

FOLLOWED = 8  # forcing periods after the ramp over which motions are followed at most
CYCLES, TRANSIENT = 60, 24  # forcing periods of the long marches
STARTS = 2
SHARE = 0.35  # of the budget that the reference may take
GROWTH = 1.2  # exponent of time over DOFs
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Study:
    """A trade-off.

    Attributes:
        case: The case.
        ladder: What was run of it.
        found: Measurements of the reference family, by name.
        rungs: The rungs and their errors.
        reference: The reference, compared with itself, and the check of it by full finite elements.
        full_check: Differences of the reduced and the full model on the mesh of the case; None where the full one was
            not affordable.
        uncertainty: Of the reference, by group of figures.
        periods: Forcing periods from the seat over which figures were compared.
        chaotic: Whether the reference never repeats.
        tolerance: What was asked for.
        chosen: The cheapest rung inside it, or None.
        skipped: Rungs that were too dear, with their predicted time, s.
        seconds: Wall time of the study, s.
        notes: What was told beforehand.
    """

    case: Case
    ladder: Ladder
    found: dict[str, Measured]
    rungs: tuple[Judged, ...]
    reference: Judged
    full_check: dict[str, float] | None
    uncertainty: dict[str, float]
    periods: int
    chaotic: bool
    tolerance: float
    chosen: Judged | None
    skipped: tuple[tuple[Rung, float], ...]
    seconds: float
    notes: tuple[str, ...]

    @property
    def front(self) -> list[Judged]:
        """The rungs than which no other is both cheaper and nearer."""
        return front([one for one in self.rungs if one.measured.verdict == "passed"])


def overrides_as_mapping(texts: list[str]) -> dict[str, Any]:
    """Return overrides KEY=VALUE as a mapping; what is none of them stays for the reader to refuse."""
    pairs = (text.partition("=") for text in texts)
    return {name.strip(): parse_value(value.strip()) for name, _, value in pairs}


def run_study(case: Path, fixed: dict[str, Any], tolerance: float, minutes: float, tell: Tell) -> Study:
    """Run the rungs of a case.

    Args:
        case: Path of the case file.
        fixed: Keys that are replaced on all rungs.
        tolerance: Largest error of a rung that will do.
        minutes: Wall time that the study may take.
        tell: Called with what is known beforehand and what each rung gave.

    Raises:
        CaseError: The case has faults.
        UserError: Its forcing has no single frequency, its mesh cannot be refined, or the reference fails.
    """
    started, budget = time.perf_counter(), 60.0 * minutes
    read = read_case(case, fixed)
    frequency = _frequency(read)
    ladder = ladder_of(read)
    notes = list(ladder.notes)
    for note in notes:
        tell(note)
    ramps = [load.ramp for load in read.load if isinstance(load, Ramped)]
    ramp = ceil(max(ramps, default=0.0) * frequency - 1e-9)
    most = ramp + FOLLOWED

    def job(rung: Rung, periods: int, long: bool) -> Job:
        cycles = CYCLES if long else 0
        return Job(case, {**fixed, **ladder.fixed, **rung.changes}, periods, cycles, ramp + TRANSIENT, STARTS)

    def run(rungs: Sequence[Rung], periods: int, long: Callable[[Rung], bool]) -> list[Measured]:
        ((_, results),) = side_by_side(measure, [[job(rung, periods, long(rung)) for rung in rungs]], 1)
        return results

    # the coarsest of the reference first: what it cost says what the finest will
    coarsest = ladder.meshes[1]
    (first,) = run([coarsest], most, lambda _: False)
    _must_pass(coarsest, first)
    ladder = _affordable(read, ladder, first, most, frequency, SHARE * budget)
    finest = ladder.reference
    predicted = _family_seconds(first, ladder, coarsest, most, frequency)
    notes.append(
        f"reference: {finest.name}, the finest that is affordable: about {predicted:.0f} s for it and what its "
        "uncertainty is made of"
    )
    tell(notes[-1])
    found: dict[str, Measured] = {}
    for group in together(ladder.family):
        for rung, result in zip(group, run(group, most, lambda rung: rung is finest), strict=True):
            _must_pass(rung, result)
            found[rung.name] = result
            tell(f"{rung.name}: {result.dofs} DOFs, set-up {result.set_up:.1f} s")
    family = [found[rung.name] for rung in (finest, ladder.meshes[0], ladder.steps[0], ladder.basis)]
    periods = max(foretold(family, most), min(ramp + 1, most), 2)
    truth = found[finest.name]
    chaotic = "no cycle" in truth.words
    words = f"motions are compared over the first {periods} forcing periods, as long as they can be foretold"
    words += (
        "; the response never repeats, so beyond that means over windows and starts are compared" if chaotic else ""
    )
    notes.append(words)
    tell(words)
    rungs: list[Judged] = []
    skipped: list[tuple[Rung, float]] = []
    last: dict[int, tuple[Rung, Measured]] = {}  # the last full rung of each dimension
    for group in together(ladder.rungs):
        left = budget - (time.perf_counter() - started)
        wanted = _predicted(group[0], last, periods / frequency)
        if wanted > left:
            skipped += [(rung, wanted) for rung in group]
            tell(f"{group[0].name}: skipped, about {wanted:.0f} s of {max(left, 0.0):.0f} s that are left")
            continue
        for rung, measured in zip(group, run(group, periods, lambda rung: not rung.full), strict=True):
            if rung.full and measured.verdict == "passed":
                last[rung.dimension] = rung, measured
            one = judged(rung, measured, truth, periods, read.time.end)
            rungs.append(one)
            tell(f"{rung.name}: " + _words(one))
    own, full = (_named(rungs, f"{model} {read.mesh.dimension}D") for model in ("reduced", "full"))
    check = _full_check(own, full, periods)
    return Study(
        read, ladder, found, tuple(rungs), judged(finest, truth, truth, periods, read.time.end), check,
        uncertainty(ladder, found, periods), periods, chaotic, tolerance, choice(rungs, tolerance), tuple(skipped),
        time.perf_counter() - started, tuple(notes),
    )  # fmt: skip


def together(rungs: Sequence[Rung]) -> list[list[Rung]]:
    """Return rungs in groups that share a mesh and a model, in the order of the first of each."""
    groups: dict[str, list[Rung]] = {}
    for rung in rungs:
        groups.setdefault(rung.body, []).append(rung)
    return list(groups.values())


def _frequency(case: Case) -> float:
    frequencies = forcing_frequencies(case)
    if len(frequencies) != 1 or not case.probe:
        found = ", ".join(f"{f:g} Hz" for f in frequencies) or "no harmonic load"
        raise UserError(
            f"a trade-off compares figures over forcing periods at probes: found {found} and {len(case.probe)} probes; "
            "expected harmonic loads of one frequency and at least one [[probe]]"
        )
    return frequencies[0]


def _must_pass(rung: Rung, measured: Measured) -> None:
    if measured.verdict != "passed":
        raise UserError(f"the reference of the trade-off, {rung.name}, {measured.verdict}: {measured.message}")


def _seconds(first: Measured, size: float, simulated: float, parts: float = 1.0) -> float:
    """Return the predicted time of a rung whose mesh has size times the DOFs, with parts times the steps, s."""
    return float(first.set_up * size**GROWTH + simulated * first.per_second * parts)


def _family_seconds(first: Measured, ladder: Ladder, coarsest: Rung, periods: int, frequency: float) -> float:
    """Return the predicted time of the reference family, whose steps are all the shortest but two, s."""
    short, long = periods / frequency, STARTS * (CYCLES + TRANSIENT) / frequency
    total = long * first.per_second
    for group in together(ladder.family):
        total += _seconds(first, group[0].size / coarsest.size, len(group) * short)
    return total


def _affordable(case: Case, ladder: Ladder, first: Measured, periods: int, frequency: float, budget: float) -> Ladder:
    """Return the ladder with the finest reference that is affordable."""
    coarsest, coarser = ladder.meshes[1], 1.0
    while _family_seconds(first, ladder, coarsest, periods, frequency) > budget and coarser * FINEST < 2.0:
        coarser *= REFINEMENT
        ladder = ladder_of(case, coarser)
    return ladder


def _predicted(rung: Rung, last: dict[int, tuple[Rung, Measured]], simulated: float) -> float:
    """Return the predicted time of a full rung from the last one of its dimension, s; 0 where nothing is known."""
    if not rung.full or rung.dimension not in last:
        return 0.0
    before, measured = last[rung.dimension]
    size = rung.size / before.size
    return _seconds(measured, size, simulated, float(size**GROWTH))


def _named(rungs: list[Judged], name: str) -> Judged | None:
    return next((one for one in rungs if one.rung.name == name), None)


def _full_check(own: Judged | None, full: Judged | None, periods: int) -> dict[str, float] | None:
    if own is None or full is None or {own.measured.verdict, full.measured.verdict} != {"passed"}:
        return None
    return differences(own.measured.figures(periods), full.measured.figures(periods))


def _words(one: Judged) -> str:
    if one.measured.verdict != "passed":
        return f"{one.measured.verdict}: {one.measured.message.splitlines()[0]}"
    worst = max(one.errors, key=lambda group: one.errors[group], default=GROUPS[0])
    statistics = (
        "" if one.statistics in (None, 0.0) else f", statistics {_percent(one.statistics or 0.0)} beyond scatter"
    )
    return f"{one.seconds:.3g} s for the case, {_percent(one.error)} off in {worst}{statistics}"


def _percent(fraction: float) -> str:
    return "another cycle" if fraction == inf else f"{100 * fraction:.2g} %"
