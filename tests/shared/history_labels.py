"""Names along the labeled dimensions of the history of a slice with one probe and no load."""

from __future__ import annotations

from gapbeam.solver.schema.record_table import HISTORY

LABELS: dict[str, tuple[str, ...]] = {
    **{dimension: () for record in HISTORY for dimension in record.dims[1:]},
    "probe": ("tip",),
    "component": ("x", "y"),
    "face": ("base", "gland"),
}
