"""Case with worn supports: larger gaps, and other noise in its loads."""

from __future__ import annotations

from collections.abc import Sequence

from gapbeam.solver.case.case import Case
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.support_tables import BaseAndGland, OneSupport


def worn_case(case: Case, depths: Sequence[float], number: int = 0) -> Case:
    """Return a case with worn faces.

    A hole, a polygon or a profile grows by its depth all around. Both planes of a slot move away from the beam, each
    by its own depth; those of the base and the gland likewise, except that heights are still meant from the base.

    Args:
        case: The case, not worn.
        depths: Of all faces, in the order of `Case.layout`, m.
        number: Of the run: each has noise of its own.
    """
    left = iter(depths)
    parts = {id(one): [next(left) for _ in one.faces] for one in case.layout.supports}
    support = case.support
    changed: OneSupport | tuple[OneSupport, ...]
    if isinstance(support, BaseAndGland):
        changed = _worn(support, parts[id(support)])
    else:
        changed = tuple(_worn(one, parts[id(one)]) for one in support)
    loads = tuple(load.with_other_noise(number) for load in case.load)
    return case.model_copy(update={"support": changed, "load": loads})


def worn_clearances(case: Case) -> dict[str, float]:
    """Return the clearance of each support by its name, m."""
    return {one.name: one.clearance for one in Layout.of(case.support).supports}


def _worn(support: OneSupport, depths: Sequence[float]) -> OneSupport:
    clearance = support.clearance + sum(depths)
    if isinstance(support, BaseAndGland) or len(depths) == 1:
        return support.model_copy(update={"clearance": clearance})
    below, above = depths
    return support.model_copy(update={"clearance": clearance, "offset": support.offset + 0.5 * (above - below)})
