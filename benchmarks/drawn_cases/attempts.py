"""Drawn case, run as users run it, against a second computation: a finer step, a finer mesh or richer basis.

    slices, any model     the reduced model with a quarter of the cell size, 40 modes and 19 shapes along each face
    those that rub        the reduced model with half of the cell size and every interface DOF
    beam, in space        twice as many elements
    rigid, in space       beam elements
    rigid sections        40 modes, half as many sections again

It marches a quarter of the step by the scheme that conserves energy at any step: others create or take some there, too.
A contact stiffness that was computed stands for rigid contact: the second way has eight times as much, and an eighth of
the step, as contacts are shorter. Beams that chatter have a 16th and a 32nd of the step, and half of the cell size.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import gapbeam
from benchmarks.drawn_cases.chatter import chattering_scene
from benchmarks.drawn_cases.scenes import Scene, drawn_scene
from benchmarks.table import Cell, Table, machine_words
from benchmarks.true_errors import true_errors
from gapbeam.postprocess.results.results import records_in
from gapbeam.postprocess.results_errors import ResultsError
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.messages.errors import EnergyCreated
from gapbeam.studies.error_estimate.companions import FINEST_MODES, FINEST_SHAPES
from gapbeam.studies.error_estimate.force_peaks import BEYOND_HORIZON, SETTLED
from gapbeam.studies.error_estimate.motion_record import MotionRecord
from gapbeam.studies.trials.refined_mesh import mesh_keys

STIFFER = 8.0  # times the computed contact stiffness of the run
TINY = 1.0e-300
CELLS_THAT_RUB = 0.5
STATIONS, ELEMENTS = 12, 200
RIGHT = 0.02  # of a figure: a run that is so near to the second way is no wrong one
NEGLIGIBLE = 1.0e-6  # of the largest figure of its unit: an error and an estimate below it say nothing
PARTS = {SETTLED: "settled", BEYOND_HORIZON: "beyond the horizon"}  # the others are the start-up


class Finer(NamedTuple):
    """Resolution of a second way.

    Attributes:
        cells: Cell size, over the cell size of the run.
        steps: Steps over those of the run.
        stiffer: Steps over those of the run, where the contact is stiffer, too.
    """

    cells: float
    steps: int
    stiffer: int


USUAL, OF_CHATTER = Finer(0.25, 4, 8), Finer(0.5, 16, 32)


@dataclass(frozen=True)
class Figure:
    """Figure of a drawn run with its second computation.

    Attributes:
        part: "settled", "start-up" or "beyond the horizon".
        name: Name of the figure.
        value: The figure.
        estimate: Estimate of its error.
        error: Its difference from the second way.
    """

    part: str
    name: str
    value: float
    estimate: float
    error: float


@dataclass(frozen=True)
class Attempt:
    """A drawn run.

    Attributes:
        number: Number of the scene.
        kind: Its model, or rigid sections.
        stiffness: Stiffness of the contact: "given" or "auto".
        choices: Other choices.
        status: Status of the run.
        message: Message of the run.
        horizon: Time up to which its motion can be predicted, s; None: to the end.
        seconds: Processor time of it and its error estimate.
        second_seconds: Wall time of the second way.
        second_status: Status of the second way; None: there was nothing to compare.
        off: Distance from the second way of a run with another status than 0, over its figures; None: it has no end.
        figures: Figures that have errors.
    """

    number: int
    kind: str
    stiffness: str
    choices: dict[str, str]
    status: int
    message: str
    horizon: float | None
    seconds: float
    second_seconds: float
    second_status: int | None
    off: float | None
    figures: tuple[Figure, ...]

    @property
    def falsely_refused(self) -> bool:
        """True where the second method solves what this run did not: the run has no result, or refused a right one.

        Energy that a scheme created or took is measured: an energy gate of a scheme that does not conserve energy is
        right, however near the figures are.
        """
        gate = self.status == EnergyCreated.exit_status and not scheme_of(self.choices["scheme"]).conserves_energy
        wrong = self.status != 0 and not gate
        return wrong and self.second_status == 0 and (self.off is None or self.off < RIGHT)


def attempted(number: int, folder: Path, chatters: bool = False) -> Attempt:
    """Run the scene of a number and, where there is something to compare, a second way."""
    scene, finer = (chattering_scene(number), OF_CHATTER) if chatters else (drawn_scene(number), USUAL)
    times = scene.tables["time"]
    records = {"output.history_interval": times["step"], "output.fields_interval": times["end"]}
    case = gapbeam.read_case(scene.tables, records)
    clock = time.process_time()
    outcome = gapbeam.run(case, output=folder / "run", overwrite=True)
    seconds, summary = time.process_time() - clock, outcome.summary
    errors = summary.get("errors", {})
    estimated = errors.get("status") == "estimated"
    second_status, off, figures = None, None, tuple[Figure, ...]()
    clock = time.process_time()
    if outcome.exit_status != 0 or estimated:
        computed = {one["key"]: one["value"] for one in summary.get("defaults", ())}
        end = float(errors["up_to"]) if estimated else case.time.end
        other = gapbeam.read_case(case, second_way(scene, case, computed.get("contact.stiffness"), end, finer))
        second = gapbeam.run(other, output=folder / "second", overwrite=True)
        second_status = second.exit_status
        if second_status == 0:
            exact = _motion(folder / "second", case)
            figures = tuple(_figures(summary, exact)) if estimated else ()
            off = None if estimated else _off(folder / "run", case, exact)
    return Attempt(
        number, scene.kind, "auto" if scene.automatic else "given", scene.choices | {"motion": scene.motion},
        outcome.exit_status, outcome.message, errors.get("horizon"), seconds, time.process_time() - clock,
        second_status, off, figures,
    )  # fmt: skip


def _motion(folder: Path, case: Case) -> MotionRecord:
    return MotionRecord.of_records(*records_in(folder), bends_in_two_planes(case))


def _off(folder: Path, case: Case, exact: MotionRecord) -> float | None:
    """Return the largest relative difference of displacement ranges and impulses; None for a run without its end."""
    try:
        run = _motion(folder, case)
    except (ResultsError, KeyError):
        return None
    if run.end < exact.end - 1.5 * exact.interval:
        return None
    found = []
    for mine, other in ((run.spans, exact.spans), (run.impulse[-1], exact.impulse[-1])):
        scale = max(float(np.abs(other).max(initial=0.0)), TINY)
        found.append(float(np.abs(mine - other).max(initial=0.0)) / scale)
    return max(found)


def _figures(summary: dict[str, Any], exact: MotionRecord) -> Iterator[Figure]:
    rows = list(true_errors(summary, exact))
    largest: dict[str, float] = {}
    for row, _ in rows:
        largest[row["unit"]] = max(largest.get(row["unit"], 0.0), abs(row["value"]))
    for row, error in rows:
        if max(row["error"], error) > NEGLIGIBLE * largest[row["unit"]]:
            part = PARTS.get(row["span"], "start-up")
            yield Figure(part, row["name"], row["value"], row["error"], error)


def second_way(scene: Scene, case: Case, stiffness: float | None, end: float, finer: Finer) -> dict[str, Any]:
    """Return the keys of the second way.

    Args:
        scene: The scene.
        case: Its case.
        stiffness: Contact stiffness of the run, where it was computed.
        end: End, s.
        finer: Its resolution.
    """
    step = float(scene.tables["time"]["step"])
    changes: dict[str, Any] = {
        "time.step": step / (finer.stiffer if scene.automatic else finer.steps),
        "time.scheme": "discrete-gradient",
        "time.end": end,
        "output.history_interval": step,
        "output.fields_interval": end,
        "output.errors": "none",
    }
    if stiffness is not None:
        changes["contact.stiffness"] = stiffness * (STIFFER if scene.automatic else 1.0)
    return changes | _finer_model(scene, case, finer.cells)


def _finer_model(scene: Scene, case: Case, cells: float) -> dict[str, Any]:
    rubs = case.friction is not None
    if case.mesh.dimension == 2:
        basis = {"contact": "all"} if rubs else {"shapes": FINEST_SHAPES}
        finest = {"type": "reduced", "modes": FINEST_MODES} | basis
        return mesh_keys(case, CELLS_THAT_RUB if rubs else cells) | {"model": finest}
    if scene.kind == "rigid sections":
        return {"model": {"type": "reduced", "sections": "rigid", "modes": FINEST_MODES, "stations": STATIONS}}
    return {"model": {"type": "beam", "elements": ELEMENTS}}


PROMISES = ((1.0, 0.95), (2.0, 0.99), (5.0, 1.0))  # of a class: a share of errors below so many times the estimate
ENOUGH = 100  # figures of a class, of which a share of 99 % says something


def ratios_by_class(attempts: Sequence[Attempt]) -> dict[str, list[tuple[float, float, float]]]:
    """Return error / estimate, estimate / figure and error / figure of each figure, class by class."""
    found: dict[str, list[tuple[float, float, float]]] = {}
    for attempt in attempts:
        for one in attempt.figures:
            scale = max(abs(one.value), TINY)
            row = (one.error / max(one.estimate, TINY), one.estimate / scale, one.error / scale)
            for name in ("all", attempt.kind, f"stiffness {attempt.stiffness}", one.part):
                found.setdefault(name, []).append(row)
    return found


def missed(attempts: Sequence[Attempt]) -> Iterator[str]:
    """Yield a line for each promise that is missed by a class with enough figures, and for each false refusal."""
    for name, rows in ratios_by_class(attempts).items():
        ratios = np.array(rows)[:, 0]
        for limit, promised in PROMISES:
            share = float(np.mean(ratios <= limit))
            if share < promised and len(rows) >= ENOUGH:
                yield f"{name}: {share:.1%} of {len(rows)} figures below {limit:g} E, promised {promised:.0%}"
    for attempt in attempts:
        if attempt.falsely_refused:
            yield f"case {attempt.number} ({attempt.kind}) is refused, and the second way solves it: {attempt.message}"


def coverage(attempts: Sequence[Attempt], name: str = "drawn_cases") -> Table:
    """Return the table of all classes, with what is missed and how many pairs of choices were drawn."""
    rows: list[tuple[Cell, ...]] = []
    for one_class, found in ratios_by_class(attempts).items():
        ratio, estimate, error = np.array(found).T
        shares = (f"{np.mean(ratio <= limit):.1%}" for limit, _ in PROMISES)
        middle = (f"{np.median(estimate):.2%}", f"{np.median(error):.2%}")
        rows.append((one_class, len(found), *shares, f"{ratio.max():.3g}", *middle))
    pairs = {
        pair
        for attempt in attempts
        for pair in combinations(sorted((attempt.choices | {"model": attempt.kind}).items()), 2)
    }
    ended = {
        status: sum(one.status == status for one in attempts) for status in sorted({one.status for one in attempts})
    }
    seconds, others = [one.seconds for one in attempts], [one.second_seconds for one in attempts]
    notes = (
        machine_words(),
        f"{len(attempts)} cases, of which end {ended}; {len(pairs)} pairs of choices",
        f"processor time: {np.median(seconds):.1f} s by the median for a run with its estimate, at most "
        f"{max(seconds):.1f} s; {np.median(others):.1f} s for the second way, at most {max(others):.1f} s",
        *missed(attempts),
    )
    return Table(
        name,
        f"Error estimates of {len(attempts)} drawn cases",
        ("class", "figures", "below E", "below 2 E", "below 5 E", "largest error / E", "median E", "median error"),
        tuple(rows),
        notes,
    )
