"""All columns of a record as signals, one for each of its probes, faces and components."""

from __future__ import annotations

from itertools import product

import numpy as np
import xarray as xr

from gapbeam.postprocess.signals.signal import INTERVAL_MEANS, Signal

_UNEVEN = 1.0e-3


def record_columns(history: xr.Dataset, record: str) -> dict[str, Signal]:
    """Return the columns of a record by their labels, such as "tip y".

    The first value of records of interval means, which no interval precedes, is left out, and a last one at another
    distance in time.

    Args:
        history: That holds the record.
        record: Its name.

    Raises:
        SignalError: Values that are not finite, or none.
    """
    variable = history[record]
    time, values = np.asarray(history["time"].values, dtype=float), variable.values.reshape(variable.shape[0], -1)
    if time.size > 2 and abs(time[-1] - 2.0 * time[-2] + time[-3]) > _UNEVEN * (time[-2] - time[-3]):
        time, values = time[:-1], values[:-1]
    if record in INTERVAL_MEANS:
        time, values = time[1:], values[1:]
    unit = str(variable.attrs.get("units", "1"))
    labels = [" ".join(words) for words in product(*(map(str, variable[dim].values) for dim in variable.dims[1:]))]
    return {
        label: Signal(time, np.asarray(column, dtype=float), unit, f"{record} {label}".strip())
        for label, column in zip(labels, values.T, strict=True)
    }
