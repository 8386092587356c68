"""Outcome of a run in a Python session: its records, its figures, and its closing table in a notebook."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from gapbeam.solver.run.outcome import Outcome

if TYPE_CHECKING:
    import xarray as xr


class UserOutcome(Outcome):
    """An outcome from `gapbeam.run`."""

    @classmethod
    def of(cls, outcome: Outcome) -> UserOutcome:
        """Return an outcome with the same results; memory of its body goes."""
        return cls(outcome.folder, outcome.exit_status, outcome.message, outcome.summary)

    @cached_property
    def history(self) -> xr.Dataset:
        """The records, see `gapbeam.open_results`.

        Raises:
            ResultsError: The records cannot be read.
        """
        from gapbeam.postprocess.results.results import open_results

        return open_results(self.folder).history

    @property
    def figures(self) -> list[dict[str, Any]]:
        """Figures with their errors, one a row, in SI units; none where no errors were estimated."""
        return [dict(row) for row in (self.summary.get("errors") or {}).get("figures", ())]

    def _repr_html_(self) -> str:
        from gapbeam.studies.error_estimate.closing_table import closing_lines
        from gapbeam.studies.printed_results import as_html

        closing = self.summary.get("closing")
        return as_html([repr(self), *(closing_lines(closing) if closing else ())])
