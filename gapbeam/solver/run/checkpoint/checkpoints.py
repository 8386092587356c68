"""Checkpoints of a run: schedule, contents, and the last good one."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.solver.case.case import Case, Output
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.stepwise_march import Paused
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG, apart
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.checkpoint_files import (
    BrokenCheckpoint,
    Contents,
    found,
    read_checkpoint,
    remove_but,
    write_checkpoint,
)
from gapbeam.solver.run.checkpoint.diagnostics_text import MALFORMED, as_json, restore
from gapbeam.solver.run.checkpoint.same_model import (
    FREE,
    differences,
    keep_model,
    keys_of,
    measures_of,
    model_as_it_was,
    refuse_other_matrices,
)
from gapbeam.solver.run.checkpoint.state_checks import layout_of, refuse_implausible, restored, stored
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.run.output.history_file import HistoryWriter
from gapbeam.solver.run.output.parallel_tables import ParallelTable, Pieces, on_rank_zero_with
from gapbeam.solver.run.output.results_folder import clear
from gapbeam.solver.schema.record_table import CASE_FILE, CHECKPOINT_FOLDER

if TYPE_CHECKING:
    from mpi4py import MPI

LARGEST_SHARE = 0.01  # of the wall time, for checkpoints


@dataclass(frozen=True)
class Left:
    """State that a run stopped in.

    Attributes:
        model: The model that was marched.
        paused: The march.
        exact: Whether it goes on to the same bits.
        header: Other contents of the checkpoint.
    """

    model: Model
    paused: Paused
    exact: bool
    header: dict[str, Any]

    def restore(self, accounts: Accounts, recorder: Recorder) -> None:
        """Bring accounts and recorder, as they are at a start, to where the run was left.

        Raises:
            UserError: The accounts are malformed.
        """
        try:
            restore(accounts, recorder, self.header["accounts"])
        except MALFORMED as error:
            raise UserError(
                f"the accounts of the last checkpoint cannot be read ({error!r}); start again with `overwrite=True`"
            ) from error


def kept_steps(output: Output, step: float) -> frozenset[int]:
    """Return the steps, s, after which a run keeps its state."""
    return frozenset(max(1, round(time / step)) for time in output.keep_states)


def steps_between(case: Case, step: float) -> dict[str, int]:
    """Return the steps, s, between records, and between fields, by the keys of [output]."""
    return {
        "history_interval": round((case.output.history_interval or step) / step),
        "fields_interval": max(1, round((case.output.fields_interval or case.time.end / 100.0) / step)),
    }


def remove_unasked(folder: Path, output: Output, step: float) -> None:
    """Remove the checkpoints of a run in steps, s, that is done, but those that it keeps; on rank 0."""
    if output.keep_checkpoint:
        return
    if steps := kept_steps(output, step):
        remove_but(folder, steps, 0)
    else:
        clear(folder, CHECKPOINT_FOLDER)


class Checkpoints:
    """Writes the checkpoints of a run.

    Args:
        folder: Results folder.
        case: The case of the march.
        model: Its model.
        comm: Its ranks.
        kept: Other contents of a checkpoint, for JSON.

    Attributes:
        kept_steps: Steps after which the run keeps its state.
        count: Number written.
        seconds: Wall time that they took, s.

    Collective to make and to write.
    """

    def __init__(self, folder: Path, case: Case, model: Model, comm: MPI.Comm, kept: Mapping[str, Any]) -> None:
        self._folder, self._comm, self._interval = folder, comm, case.output.checkpoint_interval
        self._layout = layout_of(model, comm)
        self._kept = dict(kept) | {"basis": self._layout.basis, "modes": self._layout.modes, "ranks": comm.size}
        self._kept |= {"case": on_rank_zero(comm, lambda: keys_of(case)), "measures": measures_of(model)}
        self._next = time.perf_counter() + self._interval
        self.count, self.seconds = 0, 0.0
        self.kept_steps = kept_steps(case.output, model.step)

    @property
    def due(self) -> bool:
        """True where a checkpoint is due, by the clock of rank 0."""
        return self._interval > 0.0 and self._comm.rank == 0 and time.perf_counter() >= self._next

    def write(
        self,
        paused: Paused,
        accounts: Accounts,
        recorder: Recorder,
        history: HistoryWriter | None,
        fields: FieldWriter,
    ) -> None:
        """Bring histories and fields to the disk, and then the state of the march.

        The next one is not due before a hundred times as long as this one took.

        Args:
            paused: The march.
            accounts: Accounts of its steps.
            recorder: Its records.
            history: The history, on rank 0.
            fields: The fields.

        Raises:
            NotWritten: The checkpoint could not be written; earlier ones are unchanged.

        Collective.
        """
        started = time.perf_counter()
        if not self.count:
            keep_model(self._folder, self._layout)
        arrays = stored(paused, self._layout)
        tables = {name: array for name, array in arrays.items() if isinstance(array, ParallelTable)}

        def write(pieces: Pieces) -> None:
            assert history is not None
            history.commit()
            fields.commit()
            header = self._kept | {
                "time": paused.state.time,
                "done": paused.done,
                "since": paused.since,
                "records": history.records,
                "fields": fields.times,
                "accounts": as_json(accounts, recorder),
            }
            write_checkpoint(self._folder, paused.done, header, arrays, pieces, self.kept_steps)

        on_rank_zero_with(self._comm, tables, write)
        now = time.perf_counter()
        self.count, self.seconds = self.count + 1, self.seconds + now - started
        self._next = now + max(self._interval, (now - started) / LARGEST_SHARE)
        LOG.info("checkpoint at t = %.6g s, in %.2g s", paused.state.time, now - started)


def last_checkpoint(folder: Path, case: Case, model: Model, comm: MPI.Comm, keys: dict[str, Any]) -> Left | None:
    """Return the state of the last checkpoint in a results folder; None where it has none yet.

    Args:
        folder: Results folder.
        case: The case that shall go on, as it was read.
        model: Its model, found anew.
        comm: Its ranks.
        keys: Values of its case by their dotted keys, of `keys_of`.

    Raises:
        UserError: The case differs from the one that was run, or no checkpoint can be read.

    Collective.
    """
    paths = on_rank_zero(comm, lambda: found(folder))
    reasons = []
    for path in paths:
        local: list[Contents] = []
        try:
            header = on_rank_zero(comm, partial(checked_header, path, local))
            _refuse_another_case(path, keys, header, case, model.step)
            contents = local[0] if local else None
            same = model_as_it_was(folder, case, model, header, comm)
            refuse_other_matrices(same.body, model.body, comm)
            paused, exact = restored(contents, header, layout_of(same, comm))
            refuse_implausible(paused, header, case, same, comm)
            return Left(same, paused, exact, header)
        except (BrokenCheckpoint, np.linalg.LinAlgError) as broken:  # no modes: a mass is not positive
            reasons.append(f"{path}: {broken}")
            LOG.warning("%s cannot be read: %s", path, broken)
    if reasons:
        raise UserError(
            "no checkpoint can be read:\n  " + "\n  ".join(reasons) + "\nstart again with `overwrite=True`, or choose "
            "another `output=`"
        )
    return None


def checked_header(path: Path, local: list[Contents]) -> dict[str, Any]:
    """Return the header of a checkpoint, and append its contents to `local`.

    Raises:
        BrokenCheckpoint: The checkpoint cannot be read, or its header lacks an entry.
    """
    contents = read_checkpoint(path)
    header = contents.header
    wanted = {
        "case": dict,
        "accounts": dict,
        "fields": list,
        "every": dict,
        "resumed": list,
        "seat": dict,
        "time": float,
        "basis": str,
    }
    for name, kind in (wanted | {"done": int, "since": int, "records": int}).items():
        if not isinstance(header.get(name), kind):
            raise BrokenCheckpoint(f"its {name} is missing")
    measures = header.get("measures")
    if not isinstance(measures, list) or [type(one) for one in measures] != [float, float]:
        raise BrokenCheckpoint("its measures are missing")
    local.append(contents)
    return header


def _refuse_another_case(path: Path, keys: dict[str, Any], header: dict[str, Any], case: Case, step: float) -> None:
    faults = differences(keys, header["case"], FREE)
    for name, steps in steps_between(case, step).items():
        if header["every"].get(name) != steps and f"output.{name}" not in " ".join(faults):
            faults.append(
                f"output.{name}: found {steps} steps, expected {header['every'].get(name)}: give it as a number of "
                "seconds where time.end changes"
            )
    if header["done"] > round(case.time.end / step):
        end, reached = apart(case.time.end, header["time"])
        faults.append(f"time.end: found {end}, expected more than {reached}, the checkpoint")
    refuse(faults, f"{path} is of another case")


def refuse(faults: list[str], what: str) -> None:
    """Refuse to resume with a case that differs.

    Raises:
        UserError: There are faults.
    """
    if faults:
        raise UserError(
            f"{what}:\n  " + "\n  ".join(faults) + "\ntake the case as it was run, or start again with "
            "`overwrite=True` or in another `output=`"
        )


def refuse_another_case(folder: Path, keys: dict[str, Any], comm: MPI.Comm, free: frozenset[str]) -> None:
    """Refuse a results folder whose `case.toml` is another case except for some keys; one without that file passes.

    Raises:
        UserError: The folder holds another case.

    Collective.
    """

    def look() -> None:
        path = folder / CASE_FILE
        if path.is_file():
            refuse(differences(keys, keys_of(read_case(path)), free), f"{path} is another case")

    on_rank_zero(comm, look)
