"""The time over which accelerations are averaged, so that the ringing of impacts is left out of them."""

from __future__ import annotations

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import bending_words, overhang_frequency
from gapbeam.solver.loads.load_choice import forcing_frequencies

SHARE = 0.05  # of a period: 2.5 ms at 20 Hz, as Li et al. (2013), section 4.2, smooth


def smoothing_window(case: Case) -> tuple[float, str]:
    """Return the window of the smoothed acceleration, s, and where it comes from.

    `output.smoothing_window`, or a twentieth of the forcing period, or without one of the first bending period; at most
    a twentieth of the run.
    """
    if case.output.smoothing_window is not None:
        return case.output.smoothing_window, "output.smoothing_window"
    frequencies = forcing_frequencies(case.load)
    if len(frequencies) == 1:
        period, words = 1.0 / frequencies[0], "the forcing period"
    else:
        period, words = 1.0 / overhang_frequency(case), f"the first bending period of the {bending_words(case)}"
    if period > case.time.end:
        period, words = case.time.end, "the run"
    return SHARE * period, f"{SHARE:g} of {words}"
