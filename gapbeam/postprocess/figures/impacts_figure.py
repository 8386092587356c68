"""Figure: histograms of approach speed, impulse and duration of the impacts of every face."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from gapbeam.postprocess.figures.figure_style import DOUBLE, face_style, letter, panels
from gapbeam.postprocess.signals.impact_tables import QUANTITIES

_MOST_BINS = 40


def draw_impacts(impacts: Mapping[str, np.ndarray]) -> Figure:
    """Draw the share of impacts by approach speed, impulse and duration.

    Args:
        impacts: At least one, (k, 5) by face; see `gapbeam.postprocess.results.impacts_of_run.impacts_of`.
    """
    figure, ((*drawn,),) = panels(1, len(QUANTITIES), width=DOUBLE, height=2.4)
    for column, (panel, (name, (unit, factor))) in enumerate(zip(drawn, QUANTITIES.items(), strict=True), start=1):
        together = factor * np.concatenate([rows[:, column] for rows in impacts.values()])
        count = min(_MOST_BINS, max(4, round(len(together) ** 0.5)))
        edges = np.linspace(0.0, 1.0001 * float(together.max()) or 1.0, count + 1)
        for face, rows in impacts.items():
            share = np.histogram(factor * rows[:, column], edges)[0] / len(rows)
            panel.stairs(100.0 * share, edges, label=face, **face_style(face, list(impacts)))
        panel.set_xlabel(f"{name} ({unit})")
    drawn[0].set_ylabel("share of impacts (%)")
    letter(drawn)
    figure.legend(*drawn[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure
