"""A span of time of a run: its records from one time to another, instead of all."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from gapbeam.postprocess.results.chosen_records import chosen_records
from gapbeam.postprocess.results.impacts_of_run import impacts_of
from gapbeam.postprocess.results.repeated_period import is_periodic
from gapbeam.postprocess.results.results import Results, open_results
from gapbeam.postprocess.results_errors import OptionError
from gapbeam.postprocess.signals.impact_tables import in_span


@dataclass(frozen=True)
class SpanOfRun(Results):
    """The records of a run in a span of time; whatever else it left is that of the whole run.

    Attributes:
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.
    """

    begin: float | None = None
    end: float | None = None

    @cached_property
    def whole_history(self) -> xr.Dataset:
        """All records of the run."""
        return open_results(self.folder).history

    @cached_property
    def history(self) -> xr.Dataset:
        """The records in the span."""
        return chosen_records(self.whole_history, (), self.begin, self.end)

    @property
    def times(self) -> tuple[float, float]:
        """Times of the first and the last record, s."""
        return float(self.history["time"][0]), float(self.history["time"][-1])

    @property
    def impacts(self) -> dict[str, np.ndarray]:
        """Impacts that began in the span, by face, as `impacts_of` has them."""
        return in_span(impacts_of(self.folder), *self.times)


def span_of(folder: Path, begin: float | None, end: float | None) -> SpanOfRun:
    """Return a span of a run.

    Args:
        folder: Its results folder.
        begin: First time, s; None: from the start.
        end: Last time, s; None: to the end.

    Raises:
        ResultsError: The results cannot be read.
        OptionError: A span with fewer than two records, or a run that computed one period of its response.
    """
    found = SpanOfRun(open_results(folder).folder, begin, end)
    if is_periodic(found):
        raise OptionError("the run computed one period of its response: no span of time can be chosen from it")
    if found.history.sizes["time"] < 2:
        raise OptionError(
            f"there is one record only, at {found.times[0]:g} s, in the span of time asked for; expected two at least; "
            "choose a longer span"
        )
    return found
