"""Disk space that a run needs, and a check that it is free."""

from __future__ import annotations

import shutil
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING

from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.schema.record_table import FIELDS, HISTORY, STRESS_FIELDS, VECTOR_FIELDS

if TYPE_CHECKING:
    from gapbeam.solver.case.case import Case
    from gapbeam.solver.models.model import Model

VALUE = 8  # bytes
LARGE = 1.0e10  # bytes: reported before they are written


def size_of_results(case: Case, model: Model) -> tuple[float, float]:
    """Return the bytes of the history and of the fields of a march to time.end."""
    labels, output = Recorder(case, model).labels, case.output
    values = 1 + sum(prod(len(labels[dimension]) for dimension in record.dims[1:]) for record in HISTORY)
    records = model.end / (output.history_interval or model.step)
    fields = model.end / output.fields_interval if output.fields_interval else 100.0
    names = (*FIELDS, *(STRESS_FIELDS if output.stress else ()))
    per_node = sum(3 if name in VECTOR_FIELDS else 1 for name in names)
    return VALUE * values * records, VALUE * per_node * model.tagged.vertex_count * fields


def check_space(folder: Path, history: float, fields: float) -> None:
    """Refuse results that the disk has no room for; report large ones.

    Args:
        folder: Folder for the results; it need not exist yet.
        history: Bytes of the history.
        fields: Bytes of the fields.

    Raises:
        UserError: There is no room for them.
    """
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    disk, needed = shutil.disk_usage(existing), history + fields
    if disk.total == 0:  # no disk, such as /proc: what cannot be written is reported where it is
        return
    words = f"history.h5 will take about {_size(history)} and fields.h5 {_size(fields)}"
    remedy = "a longer output.history_interval or output.fields_interval, or fewer probes"
    if needed > disk.free:
        raise UserError(
            f"{words}; {existing} has room for {_size(disk.free)}. Try {remedy}, a shorter time.end, or an `output=` "
            "elsewhere"
        )
    if needed > LARGE:
        LOG.warning("%s; %s makes them smaller", words, remedy)


def _size(count: float) -> str:
    """Return a number of bytes in words."""
    return f"{count / 1e9:.3g} GB" if count >= 1e8 else f"{count / 1e6:.3g} MB"
