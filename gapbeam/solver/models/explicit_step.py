"""The time step of the explicit scheme: the stability limit, and a step below the limit where none was given."""

from __future__ import annotations

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import Default
from gapbeam.solver.errors import UserError
from gapbeam.solver.integrators.stable_step import SAFETY, StableStep
from gapbeam.solver.models.time_step import rounded_down

MUCH_SHORTER = 0.5  # damping that shortens the stable step this much is reported


def with_stable_step(
    asked: Case, case: Case, computed: tuple[Default, ...], limit: StableStep
) -> tuple[Case, tuple[Default, ...]]:
    """Return the case with a step that the explicit scheme can march, and the limit with its reason.

    A computed step is shortened to the limit; a given one is not touched.

    Args:
        asked: The case as it was given.
        case: The case with its step as a number.
        computed: Defaults of the step.
        limit: The largest stable step.

    Raises:
        UserError: The given step is longer than the limit.
    """
    step = case.time.step
    assert step != "auto"
    damped = limit.step < MUCH_SHORTER * limit.undamped
    words = f"; without damping {limit.undamped:g} s, and damping by mass alone costs nothing" if damped else ""
    reason = f"{SAFETY:g} of the stable step; the highest frequency is {limit.frequency:.3g} rad/s{words}"
    limit_row = Default(
        "limit of time.step", limit.step, "s", reason, "half: half the cells, or a contact 4 times stiffer"
    )
    if step <= limit.step:
        return case, (*computed, limit_row)
    if asked.time.step == "auto":
        value, _ = rounded_down(asked, limit.step)
        shortened = case.model_copy(update={"time": case.time.model_copy(update={"step": value})})
        return shortened, (Default("time.step", value, "s", "the limit of the explicit scheme"), limit_row)
    raise UserError(
        f"time.step: {step:g} s, which the scheme {case.time.scheme.type} cannot march; expected at most "
        f"{limit.written} s on this mesh{words}; try time.step = {limit.written}, larger cells, or an implicit "
        'scheme: time.scheme = "discrete-gradient"'
    )
