"""Contradictions between the limits of a run."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.gates_table import Gates
from gapbeam.solver.faults import Fault
from gapbeam.solver.wording.short_words import apart, exceeds


def gates_are_in_order(gates: Gates) -> Iterator[Fault]:
    """Limits of a whole run are at least as large as those of one impact."""
    if exceeds(gates.impact_growth, gates.total_growth):
        found, limit = apart(gates.total_growth, gates.impact_growth)
        yield Fault(
            ("gates", "total_growth"),
            f"{found}, less than impact_growth, {limit}",
            "at least impact_growth: one impact may not end the run while it keeps its own limit",
            f"total_growth = {max(0.05, 20 * gates.impact_growth):g}",
            (("gates", "impact_growth"),),
        )


def limits_are_in_order(gates: Gates) -> Iterator[Fault]:
    """No assumption ends a run that it does not warn of."""
    for name in type(gates.failures).model_fields:
        warning, failure = getattr(gates.warnings, name), getattr(gates.failures, name)
        if isinstance(warning, float) and isinstance(failure, float) and exceeds(warning, failure):
            found, limit = apart(failure, warning)
            yield Fault(
                ("gates", "failures", name),
                f"{found}, less than the warning, {limit}",
                "at least the warning: a run that fails has passed the limit of the warning, too",
                f"{name} = {limit}, or a smaller one in [gates.warnings]",
                (("gates", "warnings", name),),
            )
