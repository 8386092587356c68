"""Continuation of harmonic balance from fewer harmonics or softer contact, and multipliers of its solutions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.periodic.floquet import Judgment, Stability, judged
from gapbeam.solver.periodic.harmonic_balance import HarmonicBalance, HarmonicSolution
from gapbeam.solver.periodic.period_map import ModalMap
from gapbeam.solver.periodic.shooting import Fourier, no_pause
from gapbeam.solver.system.modal_coordinates import ModalSystem
from gapbeam.solver.system.operators import Array

FEWEST_HARMONICS = 5
SOFTEST = 1.0e-8  # of the contact stiffness
SMALLEST_FACTOR = 1.02  # by which the stiffness grows
HARMONICS_REPORTED = 5


@dataclass(frozen=True)
class HarmonicStage:
    """Result of one number of harmonics.

    Attributes:
        harmonics: H.
        unknowns: Number of unknowns.
        residual: Residual, relative.
        iterations: Newton iterations, softer contacts included.
        softened: Number of softer contacts that were solved on the way.
        converged: Whether it converged.
    """

    harmonics: int
    unknowns: int
    residual: float
    iterations: int
    softened: int
    converged: bool


@dataclass(frozen=True)
class Climb:
    """The highest stage, and the way to it.

    Attributes:
        solution: Solution on the highest stage.
        stages: All that were tried.
        change: Largest change of the harmonics 1-5 of the traces from the last stage but one, relative to the largest
            of them; None where only one stage converged.
        before: Solution on the last stage but one that converged; None where only one did.
    """

    solution: HarmonicSolution
    stages: tuple[HarmonicStage, ...]
    change: float | None
    before: HarmonicSolution | None = None


def stages_up_to(harmonics: int) -> list[int]:
    """Return 5, 10, 20, ... up to a number of harmonics, which is the last."""
    stages, stage = [], FEWEST_HARMONICS
    while stage < harmonics:
        stages.append(stage)
        stage *= 2
    return [*stages, harmonics]


def climb(
    modal: ModalSystem,
    law: ContactLaw,
    omega: float,
    harmonics: int,
    samples_per_harmonic: int = 64,
    start: tuple[Fourier, Array] | None = None,
    near: bool = False,
    tolerance: float = 1.0e-9,
    max_iterations: int = 40,
    pause: Callable[[], None] = no_pause,
) -> Climb:
    """Solve the harmonic balance with more and more harmonics, each from the solution with fewer or from the start.

    A stage that does not converge from there is reached from softer contact, and left out where that fails as well.
    A body that contact alone holds has to touch in the start: its static seat will do.

    Args:
        modal: The system; its loads are those of the steady state.
        law: Contact law.
        omega: Base angular frequency, rad/s: of the forcing, or its p-th part.
        harmonics: Number of harmonics of the highest stage.
        samples_per_harmonic: Samples in a period over the number of harmonics.
        start: A series and its coefficients of modal coordinates, (2 H + 1, n); None: rest.
        near: Whether the start is near the response, so that the last two stages are enough.
        tolerance: Tolerance of the residual.
        max_iterations: Limit of each solution.
        pause: Called before every Newton iteration; what it raises ends the search.

    Raises:
        NotConverged: The highest stage did not converge.
        UserError: There are too many unknowns.
    """
    stages = stages_up_to(harmonics)[-2 if near else 0 :]
    HarmonicBalance(modal, law, Fourier(harmonics, samples_per_harmonic * harmonics, omega)).refuse_large()
    tried_stages: list[HarmonicStage] = []
    found: list[HarmonicSolution] = []
    for stage in stages:
        series = Fourier(stage, samples_per_harmonic * stage, omega)
        balance = HarmonicBalance(modal, law, series, pause)
        guesses = _guesses(balance, found, start, near)
        try:
            solution, iterations, softened = _solve(balance, guesses, tolerance, max_iterations)
        except NotConverged as failure:
            tried = len(failure.residuals)
            tried_stages.append(
                HarmonicStage(stage, balance.unknowns, min(failure.residuals, default=np.inf), tried, 0, False)
            )
            if stage == stages[-1]:
                raise
            continue
        found.append(solution)
        tried_stages.append(HarmonicStage(stage, balance.unknowns, solution.residual, iterations, softened, True))
    return Climb(found[-1], tuple(tried_stages), _change(found), found[-2] if len(found) > 1 else None)


def _guesses(
    balance: HarmonicBalance, found: list[HarmonicSolution], start: tuple[Fourier, Array] | None, near: bool
) -> list[Array]:
    """Return traces to start from, the most promising first: of the last stage, and of the start."""
    harmonics = balance.series.harmonics
    tried = [found[-1].series.extended(found[-1].traces, harmonics)] if found else []
    if start is not None:
        tried.insert(0 if near else len(tried), np.asarray(start[0].extended(start[1], harmonics) @ balance.basis[1].T))
    return tried or [np.zeros((balance.series.size, balance.basis[1].shape[0]))]


def _solve(
    balance: HarmonicBalance, guesses: list[Array], tolerance: float, max_iterations: int
) -> tuple[HarmonicSolution, int, int]:
    """Return the solution, all iterations, and the number of softer contacts on the way."""
    iterations, softened = 0, 0
    solved: HarmonicSolution | None = None
    failures: list[NotConverged] = []
    for share in _shares(len(guesses)):
        softer = replace(balance, law=balance.law if share.value == 1.0 else balance.law.softened(share.value))
        first = guesses[share.guess] if solved is None else solved.traces
        try:
            latest = softer.solve(first, tolerance, max_iterations)
        except NotConverged as failure:
            iterations += len(failure.residuals)
            failures.append(failure)
            share.failed = True
            continue
        share.failed, solved = False, latest
        iterations, softened = iterations + len(latest.residuals) - 1, softened + (share.value < 1.0)
    if solved is None or share.failed:
        raise failures[0]
    return solved, iterations, softened


@dataclass
class _Share:
    """A share of the contact stiffness that is tried, from which guess, and whether that failed."""

    value: float
    guess: int = 0
    failed: bool = False


def _shares(guesses: int) -> Iterator[_Share]:
    """Yield 1 for every guess, then softer contacts until one is solved, then stiffer ones up to 1 again.

    It ends with a failed one where not even the softest contact is solved, or the stiffness does not grow any more.
    """
    for guess in range(guesses):
        share = _Share(1.0, guess)
        yield share
        if not share.failed:
            return
    while share.failed:
        share = _Share(0.01 * share.value)
        if share.value < SOFTEST:
            return
        yield share
    solved, factor = share.value, 10.0
    while solved < 1.0 and factor > SMALLEST_FACTOR:
        share = _Share(min(factor * solved, 1.0))
        yield share
        solved, factor = (solved, factor**0.5) if share.failed else (share.value, factor)


def _change(found: list[HarmonicSolution]) -> float | None:
    if len(found) < 2:
        return None
    before, last = (solution.series.amplitudes(solution.traces)[:HARMONICS_REPORTED] for solution in found[-2:])
    count = min(len(before), len(last))
    largest = float(np.max(last, initial=0.0))
    return float(np.max(np.abs(last[:count] - before[:count]), initial=0.0)) / largest if largest > 0.0 else 0.0


NOTABLE_TRUNCATION = 0.1  # of the contact force beyond the harmonics: the instants of contact are not resolved
EXACT = 1.0e-9  # of the contact force beyond the harmonics: there is nothing that more harmonics would change


def balanced_multipliers(period_map: ModalMap, found: Climb, marched: Stability) -> Judgment:
    """Return the multipliers along a solution, judged by those with fewer harmonics and by those of a march from it.

    A march resolves every contact by its steps, whatever the series says; fewer harmonics show how it converges.

    Args:
        period_map: The period in steps.
        found: The solution, and the one with fewer harmonics.
        marched: Multipliers of a march over a period from the state of the solution at t = 0.
    """
    solution, before = found.solution, found.before
    harmonics = solution.series.harmonics
    others = {"a march over a period": marched}
    if before is not None:
        others[f"{before.series.harmonics} harmonics"] = _multipliers_along(period_map, before)
    judgment = judged(_multipliers_along(period_map, solution), others, f"{harmonics} harmonics")
    doubts = judgment.doubts
    if solution.truncated > NOTABLE_TRUNCATION:
        doubts += (f"{solution.truncated:.0%} of the contact force lies beyond harmonic {harmonics}",)
    if before is None and solution.truncated > EXACT:
        doubts += ("no smaller number of harmonics converged to compare with",)
    return replace(judgment, doubts=doubts)


def _multipliers_along(period_map: ModalMap, solution: HarmonicSolution) -> Stability:
    """Return the multipliers of the steps of a period along a Fourier series."""
    places, _, _ = solution.motion(np.asarray(period_map.dt * np.arange(period_map.steps + 1), dtype=float))
    return period_map.stability(period_map.tangent_along(places))
