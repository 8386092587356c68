"""The records of a run that a user asks for: some of them, in a span of time."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

import xarray as xr

from gapbeam.postprocess.results_errors import OptionError

_ALIKE = 3  # suggestions for a name that is not there


def chosen_records(
    history: xr.Dataset, records: Sequence[str] = (), begin: float | None = None, end: float | None = None
) -> xr.Dataset:
    """Return the records asked for, in the time asked for.

    Args:
        history: Of a run.
        records: Names of records; empty: all.
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.

    Raises:
        OptionError: A record that the run does not have, or a time span without records.
    """
    unknown = [name for name in records if name not in history.data_vars]
    if unknown:
        known = sorted(map(str, history.data_vars))
        near = get_close_matches(unknown[0], known, _ALIKE) or known
        raise OptionError(f"the run has no record {unknown[0]!r}; expected one of: {', '.join(near)}")
    if begin is not None and end is not None and begin > end:
        raise OptionError(
            f"a span of time from {begin:g} to {end:g} s; expected an end behind the begin; try from {end:g} to "
            f"{begin:g} s"
        )
    chosen = history[list(records)] if records else history
    kept = chosen.sel(time=slice(begin, end))
    if kept.sizes["time"] == 0:
        times = history["time"].values
        span = f"records from {times[0]:g} to {times[-1]:g} s" if len(times) else "no records"
        first, last = ("the start" if begin is None else f"{begin:g} s"), ("the end" if end is None else f"{end:g} s")
        raise OptionError(f"there is no record from {first} to {last}; the run has {span}")
    return kept
