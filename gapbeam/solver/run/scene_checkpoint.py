"""Checkpoints of runs of scenes: all that a march, its accounts and its records need to continue to the same bits."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.diagnostics.contact_episodes import Watched
from gapbeam.solver.diagnostics.energy_gates import SEEN
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.run.checkpoint.checkpoint_files import (
    BrokenCheckpoint,
    Contents,
    found,
    read_checkpoint,
    write_checkpoint,
)
from gapbeam.solver.run.output.shape_file import ShapeFrames
from gapbeam.solver.run.scene_records import SceneAccounts, SceneRecords
from gapbeam.solver.scene import object_code
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.system.operators import Array

SAMPLES = 65  # times at which loads and walls of two scenes are compared
MARCHED = ("q", "v", "a", "y", "F", "z", "inputs", "ledger", "worked")


def fingerprint(marcher: Marcher, end: float, every: int) -> str:
    """Return a hash of a scene that is about to march: matrices, contacts, start, scheme, values of loads and walls."""
    scene, total = marcher.scene, hashlib.sha256()
    times: Array = np.asarray(np.linspace(marcher.t, end, SAMPLES), dtype=float)
    feed = marcher.linear.feed
    arrays: list[Array] = [*marcher.linear[:-1], feed.law.value, feed.rows.value, feed.acted]
    arrays += [marcher.slabs.work, marcher.q, marcher.v, marcher.z, scene.offsets]
    arrays += [load.table(times) for load in scene.loads]
    arrays += [scene.walls(times), marcher.rows(times)]
    for one in arrays:
        total.update(np.ascontiguousarray(one).tobytes())
    for contact in scene.contacts:
        total.update(object_code.fingerprint(contact.name, contact.region.kind, contact.law.kind).encode())
    for load in scene.loads:
        total.update(object_code.fingerprint(load.value, load.parameters).encode())  # of pulses between these times
    total.update(repr((marcher.h, marcher.t, end, every, tuple(marcher.scheme), list(scene.point_names))).encode())
    return total.hexdigest()


@dataclass(frozen=True)
class SceneCheckpoint:
    """State from which a run of a scene continues.

    Attributes:
        mark: Fingerprint of the run.
        marcher: The march.
        accounts: Accounts of the march.
        records: Records of the march.
        frames: Shapes of the structures.
        statistics: Statistics of a march under random loads.
    """

    mark: str
    marcher: Marcher
    accounts: SceneAccounts
    records: SceneRecords
    frames: ShapeFrames
    statistics: RunStatistics | None = None

    def save(self, folder: Path, written: int) -> None:
        """Write a checkpoint after the present step.

        Args:
            folder: Results folder.
            written: Records up to now.

        Raises:
            NotWritten: The checkpoint could not be written; earlier ones are unchanged.
        """
        marcher, accounts, records = self.marcher, self.accounts, self.records
        arrays = {name: getattr(marcher, name) for name in MARCHED}
        arrays |= {"work": marcher.slabs.work, "spent": marcher.slabs.spent, "speed": records.speed,
                   "held": records.held}  # fmt: skip
        arrays |= {"frames": self.frames.q, "frame times": self.frames.times}
        arrays |= {f"accounts {name}": getattr(accounts, name) for name in accounts.kept}
        gates, ledger = accounts.gates, dict(vars(accounts.ledger))
        header = {
            "kind": "scene",
            "mark": self.mark,
            "time": marcher.t,
            "done": marcher.count,
            "passes": marcher.passes,
            "records": written,
            "last_record": records.time,
            "ledger": ledger | {"load_work": ledger["load_work"].tolist()},
            "gates": {name: getattr(gates, name) for name in SEEN},
            "faces": [list(gates.watched(i)) for i in range(len(accounts.impacts))],
            "impacts": [one.as_json() for one in accounts.impacts],
            "worn": accounts.worn.as_json(),
            "statistics": None if self.statistics is None else self.statistics.as_json(),
        }
        write_checkpoint(folder, marcher.count, header, arrays, lambda _: iter(()))

    def restore(self, folder: Path) -> int | None:
        """Bring march, accounts and records to the last checkpoint that can be read.

        Returns:
            Records to keep; None: there is no checkpoint.

        Raises:
            UserError: The checkpoint is one of another scene, step or start, or none can be read.
        """
        faults = []
        for path in found(folder):
            try:
                contents = read_checkpoint(path)
                self._take(contents)
                return int(contents.header["records"])
            except (BrokenCheckpoint, KeyError, ValueError, TypeError) as error:
                faults.append(f"{path}: {error}")
        if faults:
            raise UserError("no checkpoint can be read: " + "; ".join(faults) + "; start again with `overwrite=True`")
        return None

    def _take(self, contents: Contents) -> None:
        header, marcher, accounts = contents.header, self.marcher, self.accounts
        refuse_other(header.get("mark"), self.mark, contents.path)
        for name in MARCHED:
            getattr(marcher, name)[:] = contents.array(name)
        marcher.slabs.work[:], marcher.slabs.spent[:] = contents.array("work"), contents.array("spent")
        marcher.count, marcher.passes = int(header["done"]), int(header["passes"])
        self.records.held = contents.array("held")
        self.records.speed, self.records.time = contents.array("speed"), float(header["last_record"])
        for name in accounts.kept:
            getattr(accounts, name)[:] = contents.array(f"accounts {name}")
        self.frames.q[:], self.frames.times[:] = contents.array("frames"), contents.array("frame times")
        accounts.worn.restore(header["worn"])
        if self.statistics is not None:
            self.statistics.restore(header["statistics"])
        stored = header["ledger"]
        accounts.ledger = Ledger(**{**stored, "load_work": np.array(stored["load_work"], dtype=float)})
        for name in SEEN:
            setattr(accounts.gates, name, type(getattr(accounts.gates, name))(header["gates"][name]))
        for i, seen in enumerate(header["faces"]):
            accounts.gates.keep(i, Watched(*seen))
        for one, stored in zip(accounts.impacts, header["impacts"], strict=True):
            one.restore(stored)


def refuse_other(found_mark: Any, mark: str, where: Path) -> None:
    """Refuse to continue another run.

    Raises:
        UserError: The marks differ.
    """
    if found_mark != mark:
        raise UserError(
            f"{where}: found the run of another scene, step, end, start or loads; expected the same to continue; "
            "choose another `output=`, or start again with `overwrite=True`"
        )
