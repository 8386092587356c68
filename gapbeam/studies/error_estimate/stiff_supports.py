"""Supports whose stiffness is computed and far above what a run resolves: their forces have wide intervals.

A contact of a stiffness K per area lasts T = pi sqrt(m / K) at least, m the mass above a unit of its face. A step that
is chosen resolves contacts that are no shorter than T = 1 / (2 r f), with the frequency of interest f and r =
`RIGID_RATIO`; a step that is given, those of `STEPS_PER_CONTACT` steps. Forces of shorter contacts depend on K, which
nobody gave, and on the step.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import floor, log10
from typing import Any

from gapbeam.postprocess.signals.figure_names import PEAKS
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.model_choice import nominal_area
from gapbeam.solver.integrators.time_scheme import RIGID_RATIO, STEPS_PER_CONTACT
from gapbeam.solver.models.time_step import contact_duration, frequency_of_interest
from gapbeam.studies.error_estimate.figure_errors import FigureError

WIDE = 0.2  # of a force: from which error on its interval is wide
SURE = 0.5  # of the largest stiffness that is resolved


def own_stiffness_advice(case: Case, computed: Mapping[str, Any]) -> str:
    """Return the advice to give supports their own stiffness, where theirs is computed and not resolved; else "".

    Args:
        case: The case, as it was asked for.
        computed: Its computed defaults by key.
    """
    stiffness, contact = computed.get("contact.stiffness"), case.contact
    own = [one.brings_stiffness for one in case.layout.supports]
    if stiffness is None or contact.stiffness != "auto" or contact.points is not None or all(own):
        return ""
    if contact.formulation.holds_points or contact.formulation.stress_terms is not None:
        return ""
    automatic = case.time.step == "auto"
    frequency = frequency_of_interest(case)[0]
    if automatic and not frequency > 0.0:
        return ""
    shortest = 0.5 / (RIGID_RATIO * frequency) if automatic else STEPS_PER_CONTACT * float(case.time.step)
    lasts = contact_duration(case, stiffness)
    if lasts >= shortest:
        return ""
    largest = SURE * stiffness * (lasts / shortest) ** 2
    if isinstance(case.support, tuple):
        without = [one for one, given in zip(case.layout.supports, own, strict=True) if not given]
        least = min(nominal_area(case, one) for one in without)
        keys = (
            f"support.{without[0].name}.support_stiffness" if len(without) == 1 else "support_stiffness of each support"
        )
        value = f"{_rounded(largest * least):g} N/m"
    else:
        keys, value = "contact.stiffness", f"{_rounded(largest):g} {contact.stiffness_unit}"
    stiffer = (
        f"; a stiffer one needs time.frequency = {0.6 / RIGID_RATIO:g} / its contact duration, too, which `gapbeam "
        "check` shows"
        if automatic
        else "; a stiffer one needs a smaller time.step, too"
    )
    return (
        f"contacts last {lasts:.2g} s, and those of less than {shortest:.2g} s are not resolved: forces follow the "
        f"computed contact.stiffness, and a smaller time.step alone does not narrow them. As far as the motion is "
        f"predictable, the real stiffness does: {keys}, up to {value}{stiffer}"
    )


def doubts_about_forces(figures: Iterable[FigureError], advice: str) -> list[str]:
    """Return the advice with the faces whose forces have wide intervals; nothing without any.

    Args:
        figures: Figures of a run with their errors.
        advice: As `own_stiffness_advice` returns it.
    """
    wide = [
        one.name.removesuffix(ending)
        for one in figures
        for ending in PEAKS
        if one.name.endswith(ending)
        and not (one.untouched or one.own)
        and not (one.relative is not None and one.relative <= WIDE)
    ]
    faces = list(dict.fromkeys(wide))
    return [f"wide intervals of forces on {', '.join(faces)}: {advice}"] if faces and advice else []


def _rounded(value: float) -> float:
    """Return a positive number rounded down to one digit."""
    unit = 10.0 ** floor(log10(value))
    return float(f"{floor(value / unit) * unit:.1g}")
