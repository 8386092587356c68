"""One run of a scene: march, gates, records, verdict; its folder is read as those of cases are."""

from __future__ import annotations

import json
import resource
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from gapbeam.meshes.versions.installed_versions import python_versions
from gapbeam.solver.case.computed_defaults import SHARE
from gapbeam.solver.case.figure_table import Figure, figure_faults
from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.diagnostics.assumption import let_pass
from gapbeam.solver.diagnostics.energy_ledger import balance_words
from gapbeam.solver.diagnostics.statistics.run_statistics import in_words
from gapbeam.solver.messages.errors import Interrupted, NotConverged, NotWritten, RunError, UserError
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.run.clamp_energies import ClampEnergies
from gapbeam.solver.run.contact_block import contacts_of
from gapbeam.solver.run.interruption import Signals, Wish
from gapbeam.solver.run.outcome import Outcome, wear_words
from gapbeam.solver.run.output.atomic_files import disk_reported, written
from gapbeam.solver.run.output.history_file import HistoryWriter, recorded_figures, refuse_cut, write_impacts
from gapbeam.solver.run.output.progress import log_file
from gapbeam.solver.run.output.results_folder import (
    check_folder,
    clear,
    locked,
    prepare_folder,
    write_case,
    write_summary,
)
from gapbeam.solver.run.output.shape_file import ShapeFrames, write_shapes
from gapbeam.solver.run.scene_checkpoint import SceneCheckpoint, fingerprint, refuse_other
from gapbeam.solver.run.scene_records import Rows, SceneAccounts, SceneRecords, promises_balance
from gapbeam.solver.run.scene_summary import describe_scene, figures_of, findings_of, remarks_of, wear_of
from gapbeam.solver.scene.argument_checks import check_fields, positive
from gapbeam.solver.scene.feedback import Joint
from gapbeam.solver.scene.flow_force import Flow
from gapbeam.solver.scene.flow_margin import UNDECIDED, eigenvalues
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme, StepRecords
from gapbeam.solver.scene.marcher import BLOCK, Marcher
from gapbeam.solver.scene.reaction_rows import ReactionRows
from gapbeam.solver.scene.recorded_places import as_recorded, gauges_of, places_of_figures
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_march import SceneStep, marcher_of, steps_to
from gapbeam.solver.schema.record_table import CHECKPOINT_FOLDER, SUMMARY_FILE, TURNING
from gapbeam.solver.schema.table import faults_in

WEAR = ("coefficient", "area")
STILL = 1e-12
"""Part of the largest squared frequency below which a motion is rigid, up to round-off."""


@dataclass(frozen=True)
class SceneRun:
    """Request for a run of a scene.

    Attributes:
        scene: The scene.
        step: s.
        end: Time of the last step, s.
        start: State at the start; None: at rest, undeformed.
        every: Steps from one record to the next.
        scheme: Scheme of the time integration.
        gates: As the table [gates] of case files.
        observers: Called after every record.
        period: Period of the forcing, s; None: it has none.
        title: Title of the results.
        checkpoint: Wall time from one checkpoint to the next, s.
        wall_time: Wall time after which the run writes a checkpoint and stops, s; None: no limit.
        errors: Whether the errors of the figures are estimated, by the same scene at half the step.
        penalty: Contacts, by name with stars, whose stiffness stands for rigid contact: their errors include what a
            rigid contact would change, by the same scene with twice the stiffness.
        figures: Figures of one's own, of what is recorded at points ("probe") and contacts ("face").
        sources: Sources of values given by hand, for the report, by a description of the value.
        random_loads: Spectra of random loads as generated and as asked for. Where there are such, the run has
            statistics with intervals.
        shapes: Steps between two shapes of structures with nodes in space, for films; None: 200 over the run, fewer of
            large structures.
        text: Its file, with every default, for the results; empty: it has none.
        overrides: Values of the scene that the file does not have, by paths: {"gap.clearance": 1e-4}.
        finer: Function that returns a finer scene, of more modes or elements, and its start: errors include the change.
        wear: Archard's coefficient, 1/Pa, and the worn area of each contact, m^2: {"coefficient": 1e-14, "area": 1e-5}.
    """

    scene: Scene
    step: float
    end: float
    start: SceneState | None = None
    every: int = 1
    scheme: LinearScheme = MIDPOINT
    gates: Mapping[str, Any] = field(default_factory=dict)
    observers: Sequence[Callable[[SceneStep], Any]] = ()
    period: float | None = None
    title: str = ""
    checkpoint: float = 300.0
    wall_time: float | None = None
    errors: bool = True
    penalty: Sequence[str] = ()
    wear: Mapping[str, float | None] | None = None
    figures: Sequence[Figure] = ()
    sources: Mapping[str, str] = field(default_factory=dict)
    random_loads: Sequence[Mapping[str, Any]] = ()
    shapes: int | None = None
    text: str = ""
    overrides: Mapping[str, Any] = field(default_factory=dict)
    finer: Callable[[], tuple[Scene, SceneState | None]] | None = None

    def __post_init__(self) -> None:
        """Give places of figures the names of the records."""
        if self.figures:
            object.__setattr__(self, "figures", as_recorded(self.scene, self.figures))

    @property
    def limits(self) -> Gates:
        """The gates.

        Raises:
            UserError: An entry is unknown or out of range.
        """
        try:
            return Gates.model_validate(dict(self.gates))
        except ValidationError as error:
            expected = "expected entries of the table [gates] of case files"
            raise UserError(f"run: gates: {faults_in(error)}; {expected}") from None

    def check(self) -> None:
        """Refuse arguments out of range.

        Raises:
            UserError: An argument is out of range.
        """
        check_fields(self, "run")
        for name, steps in (("every", self.every), ("shapes", self.shapes)):
            if steps is not None and steps < 1:
                raise UserError(f"run: found {name} = {steps}, expected 1 or more")
        if self.period is not None and not (np.isfinite(self.period) and self.period > 0.0):
            raise UserError(f"run: found period {self.period!r} s, expected a time above 0, or None")
        for name, value in (self.wear or {}).items():
            if name not in WEAR:
                raise UserError(f"run: found wear {name} = {value!r}, expected {' and '.join(WEAR)} above 0")
            if value is not None:
                positive(value, f"run: wear {name}")
        for one in self.observers:
            if not callable(one):
                raise UserError(f"run: found the observer {one!r}, expected a function of the step")
        begin = 0.0 if self.start is None else self.start.t
        places = places_of_figures(self.scene)
        for fault in figure_faults(dict(enumerate(self.figures)), places, max(self.end, begin)):
            name = self.figures[int(fault.key[1])].name
            raise UserError(f"run: figure {name}: {fault.key[-1]}: found {fault.found}; expected {fault.expected}")
        self.stiffer()

    def marcher(self) -> Marcher:
        """Return the marcher of the run, which also records stresses, reactions, and what moving clamps take."""
        reactions, clamps = ReactionRows(self.scene).rows, ClampEnergies(self.scene, self.scheme).rows
        watch = [*gauges_of(self.scene).values(), reactions, clamps]
        return marcher_of(self.scene, self.step, self.start, self.scheme, np.vstack(watch))

    def stiffer(self) -> Scene | None:
        """Return the scene with twice the stiffness of its penalty contacts; None: it has none.

        Raises:
            UserError: A name fits no contact, or a contact whose law has no stiffness.
        """
        changes = dict[str, Any]()
        for pattern in self.penalty:
            found = [one for one in self.scene.contacts if one.name and fnmatchcase(one.name, pattern)]
            without = [one.name for one in found if "stiffness" not in one.law.kind.names]
            if not found or without:
                names = ", ".join(one.name for one in self.scene.contacts if one.name) or "none"
                what = f"the law of {without[0]} has no stiffness" if without else f"its contacts: {names}"
                raise UserError(f"run: penalty {pattern!r}: expected contacts whose law has a stiffness; {what}")
            for one in found:
                place = one.law.kind.names.index("stiffness")
                changes[f"{one.name}.stiffness"] = 2.0 * np.asarray(one.law.values[place])
        return self.scene.with_(changes) if changes else None


def run_scene(asked: SceneRun, folder: Path, overwrite: bool = False, resume: bool = False) -> Outcome:
    """March a scene into a results folder.

    Args:
        asked: The request.
        folder: Folder for the results.
        overwrite: Replace the results of an earlier run.
        resume: Continue from its last checkpoint, to the same bits; from the start where it has none yet.

    Returns:
        The outcome; its exit status is not zero when the run created energy, did not converge or was interrupted, and
        what was computed up to then is on disk.

    Raises:
        UserError: An argument is out of range, the folder holds results, those of another scene, or cannot be written.
    """
    asked.check()
    if resume and asked.observers:
        raise UserError("run: found resume=True with observers; what they keep is in no checkpoint: march again")
    limits = asked.limits
    check_folder(folder, overwrite or resume, overwrite)
    with Signals(asked.wall_time) as signals, signals.turned():
        marcher = asked.marcher()
        steps = steps_to(asked.end, marcher.t, marcher.h)
        asked.scene.check_feedback(marcher.z, asked.end - marcher.t)
        mark = fingerprint(marcher, asked.end, asked.every)
        march = SceneMarch(asked, marcher, steps, limits, signals)
        with locked(folder):
            left = _left(folder, mark) if resume else {}
            if left.get("exit_status") == 0:
                refuse_cut(folder)
                return Outcome(folder, 0, f"was done before: {left['message']}", left)
            checkpoint = SceneCheckpoint(mark, marcher, march.accounts, march.records, march.frames, march.statistics)
            kept = checkpoint.restore(folder) if resume else None
            if kept is None:
                prepare_folder(folder)
            with log_file(folder):
                summary = _opening(asked, folder, marcher) | {"fingerprint": mark}
                if kept is not None:
                    summary["resumed"] = [*left.get("resumed", ()), marcher.t]
                    LOG.info("continues from t = %.6g s, step %d, to the same bits", marcher.t, marcher.count)
                try:
                    with disk_reported(folder):
                        write_case(folder, asked.text, summary)
                        signals.march_begins()
                        march.write(folder, checkpoint, kept)
                    march.judge()
                    summary |= {"status": "completed", "exit_status": 0}
                    summary["message"] = f"{counted(marcher.count, 'step')}, {march.balance_words}{march.flow_words}"
                    LOG.debug("%s", summary["message"])
                except RunError as error:
                    summary |= {"status": error.run_status, "exit_status": error.exit_status, "reason": error.reason}
                    summary["message"] = str(error)
                    LOG.error("%s", error)
                except BaseException as error:
                    summary |= {"status": "failed", "exit_status": 1, "reason": RunError.reason}
                    summary["message"] = f"{type(error).__name__}: {error}"
                    with suppress(OSError):
                        write_summary(folder, summary)
                    raise
                march.describe(summary)
                if asked.figures:
                    summary["figures"] = recorded_figures(asked.figures, folder, march.records.labels)
                summary["wall_time"]["total"] = time.perf_counter() - signals.started
                _close(folder, summary)
    return Outcome(folder, summary["exit_status"], summary["message"], summary)


def _left(folder: Path, mark: str) -> dict[str, Any]:
    """Return the summary of an earlier run of the same scene; empty where there is none.

    Raises:
        UserError: The summary belongs to another scene.
    """
    path = folder / SUMMARY_FILE
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    if not isinstance(found, dict):
        return {}
    refuse_other(found.get("fingerprint"), mark, path)
    return found


def smoothing_of(asked: SceneRun, whole: float) -> dict[str, Any]:
    """Return the window of smoothed accelerations: a share of the forcing period, the first period, or the run, s."""
    period, words = asked.period, "forcing period"
    if period is None and not asked.scene.is_large:
        squares = asked.scene.squares
        moving = squares[squares > STILL * squares.max(initial=0.0)]
        if moving.size:
            period, words = float(2.0 * np.pi / np.sqrt(moving.min())), "first period of the structures"
    if period is None or period > whole:
        period, words = whole, "run"
    return {"window": SHARE * period, "reason": f"{SHARE:g} of the {words}"}


def _opening(asked: SceneRun, folder: Path, marcher: Marcher) -> dict[str, Any]:
    return {
        "title": asked.title or folder.name, "status": "running", "exit_status": None, "reason": None, "message": "",
        "warnings": [], "overrides": dict(asked.overrides), "versions": python_versions(),
        "forcing": {"frequency": None if asked.period is None else 1.0 / asked.period, "period": asked.period},
        "smoothing": smoothing_of(asked, asked.end - marcher.t0),
        "model": {"type": "scene", "dofs": asked.scene.size, "contact_points": len(asked.scene.contacts),
                  "supports": []},
        "scene": describe_scene(asked.scene, marcher.h, asked.end, asked.scheme),
        "sources": dict(asked.sources), "defaults": [], "wall_time": {}, "resumed": [],
    }  # fmt: skip


def _close(folder: Path, summary: dict[str, Any]) -> None:
    summary["memory"] = {"peak_per_rank": [resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024]}
    try:
        with written(folder / SUMMARY_FILE):
            write_summary(folder, summary)
    except NotWritten as error:
        LOG.error("%s", error)
        if summary["exit_status"] == 0:
            summary |= {"status": "failed", "exit_status": error.exit_status, "message": str(error)}


class SceneMarch:
    """A march that is recorded, counted and judged, block by block."""

    def __init__(self, asked: SceneRun, marcher: Marcher, steps: int, limits: Gates, signals: Signals) -> None:
        self.asked, self.marcher, self.steps, self.signals = asked, marcher, steps, signals
        softer = "" if all(one.is_impulsive for one in asked.scene.contacts) else " or a softer stiffness"
        remedy = f"Try a smaller step{softer}"
        if not promises_balance(asked.scheme):
            remedy = "Try the default scheme, which creates none, a smaller step or a softer stiffness"
        self.accounts = SceneAccounts(marcher, limits, remedy)
        self.records = SceneRecords(marcher, asked.every)
        self.statistics = self.records.statistics(asked.figures, is_random=True) if asked.random_loads else None
        self.seconds, self.frames = 0.0, ShapeFrames(marcher, steps, asked.shapes)

    @property
    def scheme(self) -> str:
        """Name of the scheme, for messages."""
        return "midpoint" if promises_balance(self.asked.scheme) else "that was given"

    @property
    def balance_words(self) -> str:
        """Residual of the energy balance in words, or the energy that the scheme took."""
        if self.accounts.balanced:
            return balance_words(self.accounts.ledger)
        taken = self.accounts.ledger.algorithmic
        return (
            f"a scheme that promises no energy balance: it {'took' if taken >= 0.0 else 'created'} {abs(taken):.3g} J"
        )

    @property
    def flow_words(self) -> str:
        """The work of all flows, and of loads beside them; nothing without a flow."""
        work = self.marcher.work
        parts = [work[one.name or i] for i, one in enumerate(self.asked.scene.feedbacks) if isinstance(one, Flow)]
        if not parts:
            return ""
        words = f", work of the flow {sum(parts):.4g} J"
        loads = self.accounts.ledger.load_work[0]
        return f"{words}, of {self.records.loaded[0]} {loads:.4g} J" if self.records.loaded else words

    @cached_property
    def growth(self) -> float:
        """Logarithm of the growth of the linear motion over the march; 0: contact limits it, or nothing drives it."""
        scene, accounts = self.asked.scene, self.accounts
        if scene.is_large or accounts.impulse.any() or all(isinstance(one, Joint) for one in scene.feedbacks):
            return 0.0
        leading = eigenvalues(scene)[0]
        return self.marcher.count * self.marcher.h * leading.real if leading.real > UNDECIDED * abs(leading) else 0.0

    def write(self, folder: Path, checkpoint: SceneCheckpoint, kept: int | None) -> None:
        """March to the end into a results folder.

        Args:
            folder: Folder for the results.
            checkpoint: Checkpoint, saved from time to time and where the march is interrupted.
            kept: Records of an earlier run that stay; None: it begins.

        Raises:
            RunError: A gate is passed, a step did not converge, the disk is full, or the user asked to stop.
        """
        clock = saved = time.perf_counter()
        writer = HistoryWriter(folder, self.records.labels, kept, self.records.variables)
        try:
            for rows in self.rows():
                if rows is not None:
                    writer.append(rows)
                    if self.statistics is not None:
                        self.statistics.see(rows)
                elif time.perf_counter() - saved > self.asked.checkpoint:
                    writer.commit()
                    checkpoint.save(folder, writer.records)
                    saved = time.perf_counter()
            writer.close()
            clear(folder, CHECKPOINT_FOLDER)
        except NotWritten:
            writer.abandon()
            raise
        except Interrupted:
            writer.close()
            checkpoint.save(folder, writer.records)
            raise
        except BaseException:
            writer.close()
            raise
        finally:
            self.seconds += time.perf_counter() - clock
            with suppress(NotWritten):
                labels = self.records.labels
                write_impacts(folder, labels["face"], self.accounts.impacts, labels[TURNING])
                write_shapes(folder, self.asked.scene, self.frames)

    def rows(self) -> Iterator[Rows | None]:
        """March to the end, and yield the records of each block of steps, and None where a march may be continued.

        Raises:
            RunError: As `write`, except for the disk; after the records before it.
        """
        marcher, every = self.marcher, self.asked.every
        block = every if self.asked.observers else max(every, BLOCK // every * every)
        if marcher.count == 0:
            yield self.records.first(marcher, self.accounts)
        while marcher.count < self.steps:
            due = self.frames.due(marcher.count) if len(self.frames.q) and not self.asked.observers else block
            yield from self._advance(min(block, due, self.steps - marcher.count))
            for observer in self.asked.observers:
                observer(SceneStep(marcher))
            self._listen()
            yield None

    def _listen(self) -> None:
        heard = self.signals.look()
        if heard != Wish.NONE:
            raise Interrupted(f"{heard.words} at t = {self.marcher.t:.6g} s", heard.exit_status)

    def _advance(self, steps: int) -> Iterator[Rows]:
        """March a block, take in all steps before one that failed, and yield their records."""
        marcher, before, failure, place = self.marcher, self.marcher.count, None, self.marcher.y[:, 0].copy()
        try:
            kept = marcher.advance(steps, energies=True)
        except NotConverged as error:
            kept, failure = marcher.kept, error
        whole = len(kept.energies)
        finite = np.isfinite(kept.energies).all(axis=(1, 2)) & np.isfinite(kept.seen).all(axis=(1, 2))
        finite &= np.isfinite(kept.felt).all(axis=(1, 2))
        count = whole if finite.all() else int(np.argmin(finite))
        kept = StepRecords(*(one[:count] for one in kept))
        times = marcher.t0 + (before + 1 + np.arange(count)) * marcher.h
        accounts, scene = self.accounts, self.asked.scene
        rates = accounts.rates(kept.places[:, :, 0], place, marcher.h)
        contacts = contacts_of(scene, kept.places[:, :, 0], kept.felt[:, :, 0], place, rates)
        energies = accounts.energies(times, kept, kept.felt[:, :, 0])
        sums = accounts.take(times, marcher.h, contacts, energies)
        last = failure is not None or count < whole or before + count == self.steps
        rows = self.records.rows(before, times, kept, contacts, energies, sums, last)
        if rows is not None:
            yield rows
        if count < whole:
            accounts.gates.let_pass(marcher.t0 + (before + count + 1) * marcher.h, False, accounts.ledger)
        accounts.pass_gates(times, energies)
        if count == whole and failure is None:
            self.frames.take(marcher, marcher.count == self.steps)
        if failure is not None:
            raise failure

    def judge(self) -> None:
        """Pass a march that reached its end, or raise.

        Raises:
            EnergyCreated: More energy was created over the run than the gate of an impact allows.
            EnergyLost: The scheme took more of the energy than the gates allow.
            AssumptionBroken: A limit beyond which the figures mean nothing is passed.
        """
        accounts = self.accounts
        accounts.gates.judge(self.scheme, accounts.ledger)
        accounts.gates.judge_loss(self.scheme, accounts.ledger, ", or the default scheme, which takes none")
        let_pass(findings_of(accounts, self.growth))

    def describe(self, summary: dict[str, Any]) -> None:
        """Add figures, findings and remarks to the summary, and log them."""
        marcher, accounts = self.marcher, self.accounts
        names = self.records.labels["face"]
        summary |= figures_of(accounts, names, marcher.count * marcher.h)
        forces = {str(name): work for name, work in marcher.work.items() if isinstance(name, str)}
        if forces:
            summary["energy"]["work_of_feedback"] = forces
            for name, work in forces.items():
                LOG.info("work of %s: %.6g J", name, work)
        if self.asked.wear is not None or accounts.sliding.any():
            seconds = marcher.count * marcher.h
            summary["wear"] = wear_of(accounts, names, seconds, marcher.h, self.asked.wear or {})
            LOG.info("%s", wear_words(summary["wear"]))
        if self.statistics is not None:
            summary["random_loads"], summary["statistics"] = list(self.asked.random_loads), self.statistics.describe()
            LOG.info("%s", in_words(summary["statistics"]))
        if summary["scene"]["turning"]:
            LOG.info("%s: rotations and moments, in rad and N m", ", ".join(summary["scene"]["turning"]))
        findings = findings_of(accounts, self.growth)
        summary["assumptions"] = [one.as_data() for one in findings]
        remarks = remarks_of(accounts, findings)
        summary["warnings"] += remarks
        passes = marcher.passes / marcher.count if marcher.count else 0.0
        summary["convergence"] = {"steps": marcher.count, "iterations_mean": passes}
        summary["wall_time"] |= {"march": self.seconds, "per_step": self.seconds / max(marcher.count, 1)}
        for remark in remarks:
            LOG.warning("%s", remark)
