"""Contradictions between the energy gates."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.case import Gates
from gapbeam.solver.faults import Fault
from gapbeam.solver.wording.compared_numbers import apart, exceeds


def gates_are_in_order(gates: Gates) -> Iterator[Fault]:
    """What one impact may do does not end the run at once."""
    if exceeds(gates.impact_growth, gates.total_growth):
        found, limit = apart(gates.total_growth, gates.impact_growth)
        yield Fault(
            ("gates", "total_growth"),
            f"{found}, less than impact_growth, {limit}",
            "at least impact_growth: one impact may not end the run while it keeps its own limit",
            f"total_growth = {max(0.05, 20 * gates.impact_growth):g}",
            (("gates", "impact_growth"),),
        )
