"""Records that were never written, as the history that results folders hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from gapbeam.solver.record_table import HISTORY


def as_history(records: Mapping[str, np.ndarray], labels: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """Return records as a data set with the dimensions and units of `Results.history`.

    Args:
        records: Values by name, the times as "time", (times, ...).
        labels: Names along probe, component, face, load and tangent.
    """
    variables = {
        record.name: (record.dims, records[record.name], {"units": record.unit})
        for record in HISTORY
        if record.name in records
    }
    coordinates: dict[str, np.ndarray] = {"time": records["time"]}
    coordinates |= {name: np.array(list(names), dtype=object) for name, names in labels.items() if names}
    return xr.Dataset(variables, coordinates)
