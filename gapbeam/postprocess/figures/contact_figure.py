"""Figure: contact forces on the faces of the supports, gap and penetration."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from gapbeam.postprocess.figures.figure_style import GRAY, face_style, letter, panels
from gapbeam.postprocess.signals.enlarged_part import enlarged_span
from gapbeam.postprocess.signals.signal import face_signal

_MICRO = 1.0e6


def draw_contact(history: xr.Dataset, forcing_frequency: float | None, zoom: int = 3) -> Figure:
    """Draw normal force, smallest gap and penetration of every face; left the whole record, right a part of it.

    Args:
        history: `Results.history`, with contact_force and penetration.
        forcing_frequency: Hz; None shows the tenth of the record where most happens on the right.
        zoom: Forcing periods on the right.

    Raises:
        SignalError: A value is not finite.
    """
    time = np.asarray(history["time"].values, dtype=float)
    faces = [str(name) for name in history["face"].values]
    forces = [face_signal(history, "contact_force", face).values for face in faces]
    start, stop = enlarged_span(time, np.sum(forces, axis=0), forcing_frequency, zoom)
    figure, axes = panels(3, 2, height=1.35, sharey="row", sharex="col", width_ratios=[1.5, 1.0])
    for face, force in zip(faces, forces, strict=True):
        depth = _MICRO * face_signal(history, "penetration", face).values
        style = face_style(face, faces)
        rows = (force, np.maximum(-depth, 0.0), np.maximum(depth, 0.0))
        for values, (whole, end) in zip(rows, axes, strict=True):
            whole.plot(time, values, **{**style, "linewidth": 0.5, "linestyle": "-"})
            keep = (time >= start) & (time <= stop)
            end.plot(1e3 * time[keep], values[keep], label=face, **style)
    labels = ("contact force (N)", "smallest gap (µm)", "penetration (µm)")
    for label, (whole, _) in zip(labels, axes, strict=True):
        whole.set_ylabel(label)
        whole.axvspan(start, stop, color=GRAY, alpha=0.25, lw=0)
        whole.set_ylim(0.0, max(whole.get_ylim()[1], 1e-6))
    axes[0][1].legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, borderaxespad=0.0, columnspacing=1.2)
    axes[-1][0].set_xlabel("time (s)")
    axes[-1][1].set_xlabel("time (ms)")
    if time.size == 1:
        _one_record(axes)
    figure.align_ylabels(axes[:, 0])
    letter(list(axes.flat))
    return figure


def _one_record(axes: np.ndarray) -> None:
    for panel in axes.flat:
        for line in panel.get_lines():
            line.set_marker("o")
            line.set_markersize(4)
