"""Figure: phase portrait with Poincaré points, and the section over the forcing periods."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.figures.figure_style import BLACK, GRAY, VERMILION, letter, panels
from gapbeam.postprocess.signals.probe_analysis import Analysis


def draw_phase_portrait(analysis: Analysis) -> Figure:
    """Draw velocity over displacement, and the displacement once per forcing period.

    The portrait shows the settled response, or the last twelve periods where it has not settled.

    Args:
        analysis: With displacement and velocity; without a section only the portrait of the whole record is
            drawn.
    """
    assert analysis.displacement is not None
    assert analysis.velocity is not None
    displacement, velocity = analysis.displacement.signal, analysis.velocity.signal
    section, found = analysis.section, analysis.periodicity
    (length_unit, length), (speed_unit, speed) = shown(displacement.unit), shown(velocity.unit)
    figure, axes = panels(1, 1 if section is None else 2, height=2.6)
    portrait = axes[0][0]
    start = analysis.settled_since()
    shown_part = slice(int(np.searchsorted(displacement.time, start)), None)
    portrait.plot(
        length * displacement.values[shown_part],
        speed * velocity.values[shown_part],
        color=GRAY,
        lw=0.6,
        zorder=1,
    )
    portrait.set_xlabel(f"displacement ({length_unit})")
    portrait.set_ylabel(f"velocity ({speed_unit})")
    portrait.margins(x=0.05, y=0.05)
    if section is None or analysis.forcing_frequency is None:
        return figure
    settled = section.time >= start - 1e-9
    portrait.plot(
        length * section.displacement[settled],
        speed * section.velocity[settled],
        "o", color=VERMILION, ms=3.5, mec=BLACK, mew=0.4, zorder=3,
    )  # fmt: skip
    strobe = axes[0][1]
    number = np.round(section.time * analysis.forcing_frequency)
    strobe.plot(number, length * section.displacement, "o", color=BLACK, ms=2.6, mfc="white", mew=0.7)
    strobe.plot(
        number[settled],
        length * section.displacement[settled],
        "o",
        color=VERMILION,
        ms=2.8,
        mec=BLACK,
        mew=0.4,
    )
    strobe.set_xlabel("forcing period")
    strobe.set_ylabel(f"displacement at its start ({length_unit})")
    strobe.margins(x=0.03, y=0.08)
    strobe.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    if found is not None and found.transient is not None:
        strobe.axvline(found.transient * analysis.forcing_frequency, color=GRAY, lw=0.6, ls="--", zorder=0)
    letter([portrait, strobe])
    return figure
