"""Whether a run keeps the tolerance that was asked for: into its summary, its last line and its exit status."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mpi4py import MPI

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.output.results_folder import write_summary
from gapbeam.studies.tradeoff.level_errors import group_of, percent
from gapbeam.studies.tradeoff.run_tradeoff import NOT_PROMISED, Taken

LOG = logging.getLogger("gapbeam")
REASON = "tolerance not promised"


def with_promise(outcome: Outcome, taken: Taken, comm: MPI.Comm) -> Outcome:
    """Add to a finished run whether its tolerance is promised; where it is not, the exit status becomes 5.

    A run that failed is returned as it is.

    Args:
        outcome: How the run ended.
        taken: The fidelity level that it took.
        comm: The ranks of the run.

    Collective.
    """
    if outcome.exit_status != 0:
        return outcome
    if describe(taken).items() <= outcome.summary.get("tolerance", {}).items():  # it was done before
        return replace(outcome, exit_status=outcome.summary["exit_status"])
    summary = on_rank_zero(comm, lambda: _written(outcome, taken))
    return replace(outcome, summary=summary, message=summary["message"], exit_status=summary["exit_status"])


def describe(taken: Taken) -> dict[str, Any]:
    """Return what a trade-off says of a run, as its summary has it."""
    return {
        "asked": taken.tolerance,
        "promised": not taken.doubts,
        "level": taken.name,
        "errors": taken.errors,
        "uncertainty_of_the_reference": taken.uncertainty,
        "covered": taken.covered,
        "doubts": list(taken.doubts),
    }


def own_estimates(summary: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest relative error that a run estimates for itself, by group of figures of the trade-off."""
    found: dict[str, float] = {}
    for figure in summary.get("errors", {}).get("figures", []):
        group, error = group_of(figure["name"]), figure["relative_error"]
        if group is not None and error is not None:
            found[group] = max(found.get(group, 0.0), float(error))
    return found


def _written(outcome: Outcome, taken: Taken) -> dict[str, Any]:
    """Write the summary with the tolerance, and return it."""
    summary, asked = dict(outcome.summary), f"{100.0 * taken.tolerance:.3g} %"
    own = own_estimates(summary)
    summary["tolerance"] = describe(taken) | {"estimate_of_the_run": own}
    if taken.doubts:
        warning = f"a tolerance of {asked} is not promised for this run: {'; '.join(taken.doubts)}"
        summary["warnings"] = [*summary["warnings"], warning]
        summary["exit_status"], summary["reason"] = NOT_PROMISED, REASON
        summary["message"] += f"; {warning}"
        LOG.warning("%s", warning)
    else:
        worst = max(taken.errors.values(), default=0.0)
        summary["message"] += f"; within the tolerance of {asked}: {percent(worst)} off the reference of the trade-off"
        larger = {group: error for group, error in own.items() if error > taken.tolerance}
        if larger:
            warning = (
                f"the trade-off promises the tolerance of {asked}, and the error estimate of the run itself is larger: "
                + ", ".join(f"{group} {percent(error)}" for group, error in larger.items())
                + "; an estimate is a bound, several times the error in most cases, and contains that of an automatic "
                "contact.stiffness, which the trade-off does not vary"
            )
            summary["warnings"] = [*summary["warnings"], warning]
            LOG.warning("%s", warning)
    write_summary(outcome.folder, summary)
    return summary
