"""A march and everything that consumes it: accounts, history, fields, checkpoints, progress."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from copy import copy
from functools import partial
from pathlib import Path
from types import TracebackType

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.assumption import let_pass, limited
from gapbeam.solver.diagnostics.contact_episodes import Episodes
from gapbeam.solver.diagnostics.energy_gates import remedy_for
from gapbeam.solver.diagnostics.history_rows import Recorder, Rows
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.point_contact import Peaks, PointContact
from gapbeam.solver.diagnostics.statistics.run_statistics import PointStatistics
from gapbeam.solver.march.compiled.compiled_march import why_not_compiled
from gapbeam.solver.march.simulation import StepBlock, Wanted, agreement, marched, step_blocks_of
from gapbeam.solver.march.stepwise_march import March
from gapbeam.solver.messages.errors import AssumptionBroken, Interrupted, NotWritten, RunError
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.assumptions.motion_findings import of_contact, of_pose
from gapbeam.solver.run.assumptions.pose_rows import gauges_of, watch_of
from gapbeam.solver.run.checkpoint.checkpoints import Checkpoints, Left, kept_steps, steps_between
from gapbeam.solver.run.interruption import GivenUp, Interruption, Wish
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.run.output.hdf5_files import AT_ONCE
from gapbeam.solver.run.output.history_file import HistoryWriter, write_impacts, write_points
from gapbeam.solver.run.output.output_thread import OutputThread, StuckOutput
from gapbeam.solver.run.output.progress import ProgressFile, ProgressLine
from gapbeam.solver.run.output.wear_file import face_wear, write_wear
from gapbeam.solver.run.stop_rule import StopRule, statistics_of
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import Snapshots, State, Step

LEAST_BLOCKS = 32  # of a run with many fields: an assumption that is broken beyond all sense ends it after a few


class RunConsumers:
    """A march and everything that consumes it.

    Collective to make and to use.

    Args:
        case: The case of the march.
        model: Its model.
        folder: Results folder. Where a march goes on, nothing in it changes before `follow`.
        start: State from which the march starts, or in which it was left.
        rule: Rule by which it may end early; None: at its end only.

    Attributes:
        case: As given, as are `model`, `folder` and `rule`.
        recorder: Makes records.
        accounts: Ledger, gates, episodes, peaks and counts.
        fields: Writer of the fields.
        plastic_set: Plastic set of contact points, (m,), m; None: nothing yields.
        met: Whether the interval that the rule asks for is narrow enough.

    Raises:
        UserError: The histories to go on after are not there.
        NotWritten: The files cannot be written.
    """

    def __init__(
        self, case: Case, model: Model, folder: Path, start: State | Left, rule: StopRule | None = None
    ) -> None:
        self.case, self.model, self.rule, self.met = case, model, rule, False
        self.folder, self.comm = folder, model.space.mesh.comm
        self._checkpoints: Checkpoints | None = None
        points = PointContact(model.system, model.law) if case.output.points else None
        statistics = statistics_of(case, model, steps_between(case, model.step)["history_interval"])
        self.recorder = Recorder(case, model, watch_of(case, model), gauges_of(case, model), statistics, points)
        left = start if isinstance(start, Left) else None
        self._start = start.paused if isinstance(start, Left) else start
        begin = self._start if isinstance(self._start, State) else self._start.state
        self.accounts = Accounts.opened(model.system, model.law, begin, model.step, case.gates, remedy_for(case))
        if left is not None:
            left.restore(self.accounts, self.recorder)
        self._trouble: NotWritten | None = None
        self._looked = 0.0  # last time at which the rule could have ended the march, s
        self._passed: tuple[bytes, ...] = ()  # largest pose and penetration that were let pass
        kept, opened = None if left is None else int(left.header["records"]), list[HistoryWriter]()
        on_rank_zero(self.comm, lambda: opened.append(HistoryWriter(folder, self.recorder.labels, kept)))
        self._history = opened[0] if opened else None
        self._progress = ProgressFile(folder, case.time.end, quiet=self.comm.rank != 0)
        self.plastic_set: Array | None = None
        self.fields = FieldWriter(folder, case, model, None if left is None else left.header["fields"])

    def follow(
        self,
        plan: March,
        steps: Iterator[Step] | None,
        period: float | None,
        interruption: Interruption,
        checkpoints: Checkpoints | None = None,
    ) -> None:
        """Follow given steps, or march the plan.

        Args:
            plan: The march.
            steps: Its steps; None: march it, compiled where that is possible.
            period: Period of the forcing, s, for the progress shown.
            interruption: Whether to stop.
            checkpoints: Their writer; None: the march cannot be resumed.

        Raises:
            RunError: The march failed, created energy, was interrupted or could not be written; what was computed up
                to then is on disk, or up to the last checkpoint.
        """
        self._checkpoints = checkpoints
        case, every = self.case, steps_between(self.case, self.model.step)
        fields_every = every["fields_interval"]
        if isinstance(self._start, State):
            self._record(self.recorder.row(self._start, self.accounts), Snapshots.of_states([self._start]))
            on_rank_zero(self.comm, self._begin_history)
            self._let_pass(self.accounts.peaks, self.accounts.episodes)
        together = plan.steps // (fields_every * LEAST_BLOCKS) if self.rule is None else 1
        stops = fields_every * min(AT_ONCE, max(1, together))
        wanted = Wanted(every["history_interval"], stops, True, kept_steps(case.output, self.model.step), fields_every)
        if steps is None:
            blocks_of_steps = marched(plan, self._start, self.accounts, self.recorder, wanted, self.comm)
        else:
            agreed = agreement(self.comm)
            blocks_of_steps = step_blocks_of(steps, plan.steps, self.accounts, self.recorder, wanted, agreed=agreed)
        beside = steps is None and self.comm.size == 1 and why_not_compiled(plan) is None  # the loop needs no Python
        begun = 0 if isinstance(self._start, State) else self._start.done
        self._looked = begun // fields_every * fields_every * self.model.step
        clock, before = time.perf_counter(), self.accounts.tally.march
        progress = ProgressLine(case.time.end, period, quiet=self.comm.rank != 0, begin=self.accounts.time)
        try:
            with OutputThread(beside, lambda: interruption.heard) as output, progress:
                last: StepBlock | None = None
                try:
                    for step_block in blocks_of_steps:
                        last = step_block
                        if self.model.law.keeps_set:
                            self.plastic_set = step_block.end.plastic_set
                        output.do(
                            partial(self._take, step_block, copy(self.accounts.peaks), copy(self.accounts.episodes))
                        )
                        closed = self._closed_faces(step_block.pressure)
                        progress.advance(
                            step_block.time, step_block.steps, f"contact: {' and '.join(closed) or 'none'}"
                        )
                        self._progress.report(self.accounts, step_block.steps, closed)
                        wish, ends = self._wish(interruption), False
                        if self.rule is not None and wanted.shows(step_block.done, plan.steps):
                            output.wait()
                            ends = self._may_end(self.rule, step_block, plan.steps)
                        over = ends or step_block.done == plan.steps
                        if step_block.done in wanted.also or (
                            case.output.keep_checkpoint if over else wish != Wish.NONE
                        ):
                            output.wait()
                            wish = self._wish(interruption)
                            self.accounts.tally.march = before + time.perf_counter() - clock
                            self._pause(step_block, Wish.NONE if over else wish)
                        if ends:
                            break
                except GivenUp:
                    if last is None:
                        raise
                    output.wait()
                    self._pause(last, self._wish(interruption))
                output.wait()
                self._wish(interruption)
        finally:
            self.accounts.tally.march = before + time.perf_counter() - clock
            self._progress.remove()

    def __enter__(self) -> RunConsumers:
        """Keep the files open."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the files; those that cannot be written stay as they were at the last checkpoint.

        Collective, but after an error that other ranks may not have: then every field stays in a file of its own.

        Raises:
            NotWritten: A file could not be written.
        """
        if isinstance(error, StuckOutput):  # holds the files, and the lock of HDF5
            return
        if error is None or isinstance(error, RunError):
            on_rank_zero(self.comm, self._close)
        elif self._history is not None:
            with suppress(NotWritten):
                self._close_history()

    def _close(self) -> None:
        try:
            self._close_history()
        finally:
            self.fields.close()

    def _close_history(self) -> None:
        assert self._history is not None
        if self._trouble is not None:
            self._history.abandon()
            return
        try:
            self._history.close()
        except NotWritten:
            self._history.abandon()
            raise
        write_impacts(self.folder, self.model.system.contact.face_names, self.accounts.impacts.ended)
        statistics = self.recorder.statistics
        rates = statistics.work_rates() if isinstance(statistics, PointStatistics) else ()
        write_wear(self.folder, self.accounts.sliding, self.accounts.time, face_wear(self.case), rates)
        write_points(self.folder, self.recorder.points, self.accounts.peaks.impulse)

    def costs(self) -> Mapping[str, float]:
        """Return the cost of the checkpoints: their number, and their wall time, s."""
        checkpoints = self._checkpoints
        return {} if checkpoints is None else {"count": checkpoints.count, "seconds": checkpoints.seconds}

    def _begin_history(self) -> None:
        """Put the history in place with its first record, so that a run that is killed leaves one."""
        assert self._history is not None
        if self._trouble is None:
            self._history.commit()

    def _take(self, step_block: StepBlock, peaks: Peaks, episodes: Episodes) -> None:
        """Write records and fields of a block, and look whether the assumptions hold up to its end. Collective."""
        self._record(step_block.rows, step_block.snapshots)
        self._let_pass(peaks, episodes)

    def _record(self, rows: Rows | None, snapshots: Snapshots | None) -> None:
        """Write records and fields; an error is kept until all ranks can take part in it. Collective."""
        try:
            if snapshots is not None:
                self.fields.write(snapshots, self.model)
            if self._history is not None and rows is not None:
                self._history.append(rows)
        except NotWritten as trouble:
            self._trouble = self._trouble or trouble

    def _let_pass(self, peaks: Peaks, episodes: Episodes) -> None:
        """End the run where an assumption of the equations is broken beyond all sense, by the bits of every rank."""
        watch = self.recorder.watch
        if watch is None:
            return
        largest = watch.closest.tobytes(), peaks.deepest.tobytes()
        if largest == self._passed:
            return
        self._passed = largest
        try:
            found = [*of_pose(watch, self.case), *of_contact(self.case, peaks, episodes)]
            let_pass(limited(found, self.case.gates))
        except AssumptionBroken:
            watch.end()  # blocks that are computed already are recorded, but say no more about where it broke
            raise

    def _may_end(self, rule: StopRule, step_block: StepBlock, last: int) -> bool:
        """Return whether the interval at which the run is to end is narrow enough. Collective."""
        statistics = self.recorder.statistics
        if statistics is None:
            return False
        looks, self._looked = rule.looks_between(self._looked, step_block.time), step_block.time
        if looks or step_block.done == last:
            self.met = on_rank_zero(self.comm, lambda: rule.met(statistics))
        return self.met

    def _wish(self, interruption: Interruption) -> Wish:
        """Return the request of all ranks, and end the run where files cannot be written. Collective."""
        due = self._checkpoints is not None and self._checkpoints.due
        own = Wish.CHECKPOINT if due else Wish.NONE
        wish = interruption.agreed(own if self._trouble is None else Wish.GIVE_UP)
        if wish == Wish.GIVE_UP:

            def report() -> None:
                assert self._trouble is not None
                raise self._trouble

            on_rank_zero(self.comm, report)
        return wish

    def _pause(self, step_block: StepBlock, wish: Wish) -> None:
        """Write a checkpoint, and end the run where that was asked for."""
        if self._checkpoints is not None:
            try:
                self._checkpoints.write(step_block.paused, self.accounts, self.recorder, self._history, self.fields)
            except NotWritten as trouble:
                self._trouble = trouble
                raise
        if wish.ends:
            resumes = "" if self._checkpoints is None else "; `resume=True` continues from there"
            raise Interrupted(
                f"{wish.words} at t = {step_block.time:.6g} s of {self.case.time.end:g} s; "
                f"the results up to then are on disk{resumes}",
                wish.exit_status,
            )

    def _closed_faces(self, pressure: Array) -> list[str]:
        contact = self.model.system.contact
        closed = contact.faces_with(pressure > 0.0)
        return [name for name, touches in zip(contact.face_names, closed, strict=True) if touches]
