"""Figure: where the energy is, where it went, and what the balance leaves over."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gapbeam.postprocess.figures.figure_style import (
    BLACK,
    BLUE,
    DOUBLE,
    GRAY,
    GREEN,
    PURPLE,
    SKY,
    VERMILION,
    letter,
    spread,
)
from gapbeam.postprocess.signals.enlarged_part import enlarged_span
from gapbeam.postprocess.signals.signal import SignalError

_STORED = (
    ("kinetic_energy", "kinetic", BLUE, "-"),
    ("strain_energy", "strain", VERMILION, "--"),
    ("contact_energy", "contact", GREEN, "-."),
    ("restraint_energy", "restraint", PURPLE, ":"),
)
_LOST = (
    ("structural_dissipation", "structural damping", BLUE, "-"),
    ("contact_dissipation", "contact damping", VERMILION, "--"),
    ("algorithmic_dissipation", "scheme", GREEN, "-."),
)
_FRICTION = ("friction_dissipation", "friction", PURPLE, ":")  # where there is any
# Parts that stay below this fraction of the sum are not drawn.
_SMALL = 1.0e-3
_LOADS = ((BLACK, "-"), (GRAY, "-"), (SKY, "--"), (PURPLE, ":"))


def draw_energy(history: xr.Dataset, forcing_frequency: float | None, zoom: int = 3) -> Figure:
    """Draw the ledger of energies.

    (a) Stored energy over the whole record, (b) its parts over a part of it, (c) work of the loads and losses
    since t = 0, (d) residual of the balance.

    Args:
        history: `Results.history`, with all energy records.
        forcing_frequency: Hz; None shows the tenth of the record where most happens in (b).
        zoom: Forcing periods in (b).

    Raises:
        SignalError: A value is not finite.
    """
    time = np.asarray(history["time"].values, dtype=float)
    start, stop = enlarged_span(
        time, np.sum([_millijoule(history, name) for name, *_ in _STORED], axis=0), forcing_frequency, zoom
    )
    figure = Figure(figsize=(DOUBLE, 4.9))
    axes = figure.subplot_mosaic(
        [["whole", "end"], ["ledger", "ledger"], ["residual", "residual"]],
        width_ratios=[1.5, 1.0], height_ratios=[1.1, 1.2, 0.8],
    )  # fmt: skip
    spread(figure)
    marker: dict[str, Any] = {"marker": "o", "ms": 4} if time.size == 1 else {}
    _stored(axes["whole"], axes["end"], history, time, (start, stop), marker)
    _balance(axes["ledger"], history, time, marker)
    axes["residual"].plot(time, _millijoule(history, "energy_residual"), color=BLACK, lw=0.8, **marker)
    axes["residual"].axhline(0.0, color=GRAY, lw=0.5, zorder=0)
    axes["residual"].set_ylabel("residual (mJ)")
    axes["residual"].set_xlabel("time (s)")
    figure.legend(*axes["end"].get_legend_handles_labels(), loc="outside upper right", ncols=5)
    figure.align_ylabels([axes[name] for name in ("whole", "ledger", "residual")])
    letter([axes[name] for name in ("whole", "end", "ledger", "residual")])
    return figure


def _stored(
    whole: Axes, end: Axes, history: xr.Dataset, time: np.ndarray, span: tuple[float, float], marker: dict[str, Any]
) -> None:
    start, stop = span
    keep = (time >= start) & (time <= stop)
    total = np.zeros(time.size)
    parts = []
    for name, label, color, line in _STORED:
        values = _millijoule(history, name)
        total += values
        parts.append((values, label, color, line))
    for values, label, color, line in parts:
        if values.max() > _SMALL * total.max():
            end.plot(1e3 * time[keep], values[keep], color=color, ls=line, label=label, **marker)
    whole.plot(time, total, color=BLACK, lw=0.7, **marker)
    end.plot(1e3 * time[keep], total[keep], color=BLACK, lw=0.8, label="sum", zorder=1, **marker)
    whole.axvspan(start, stop, color=GRAY, alpha=0.25, lw=0)
    whole.set_ylabel("stored energy (mJ)")
    whole.set_xlabel("time (s)")
    end.set_xlabel("time (ms)")


def _balance(panel: Axes, history: xr.Dataset, time: np.ndarray, marker: dict[str, Any]) -> None:
    if "load_work" in history:
        work = _millijoule(history, "load_work")
        for index, load in enumerate(str(name) for name in history["load"].values):
            color, line = _LOADS[index % len(_LOADS)]
            panel.plot(time, work[:, index], color=color, ls=line, label=f"work of {load}", **marker)
    rubs = _FRICTION[0] in history and bool(np.any(history[_FRICTION[0]].values))
    for name, label, color, line in (*_LOST, _FRICTION) if rubs else _LOST:
        panel.plot(time, _millijoule(history, name), color=color, ls=line, label=label, **marker)
    panel.set_ylabel("work, loss (mJ)")
    panel.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 0.98),
        ncols=6,
        borderaxespad=0.0,
        columnspacing=1.0,
        handletextpad=0.5,
    )


def _millijoule(history: xr.Dataset, name: str) -> np.ndarray:
    values = 1e3 * np.asarray(history[name].values, dtype=float)
    if not np.isfinite(values).all():
        raise SignalError(f"{name}: a value is not finite")
    return values
