"""Figures over windows as plain data, as the records of a sweep hold them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.postprocess.display_units import shown
from gapbeam.postprocess.signals.steady_figures import WindowFigure


def as_data(quantities: Mapping[str, WindowFigure]) -> dict[str, Any]:
    """Return figures by name: unit, mean and scatter, SI; accelerations in g too."""
    return {
        name: {"unit": one.unit, "mean": one.mean, "scatter": one.scatter, "unsettled": one.unsettled}
        | ({"mean_in_g": one.mean * shown(one.unit)[1]} if one.unit == "m/s^2" else {})
        for name, one in quantities.items()
    }
