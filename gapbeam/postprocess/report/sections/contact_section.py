"""Contact forces, gaps and penetrations of the faces of a run."""

from __future__ import annotations

import numpy as np
import xarray as xr

from gapbeam.postprocess.report.blocks import Block, ReportSection, TableBlock
from gapbeam.postprocess.report.charts import Chart, ChartCurve
from gapbeam.postprocess.report.envelope import envelope, thinning_words
from gapbeam.postprocess.report.sections.record_ends import ZOOM, end_words, is_long
from gapbeam.postprocess.signals.enlarged_part import enlarged_span
from gapbeam.postprocess.signals.signal import Signal, face_signal

_MICRO = 1.0e6


def contact_section(
    history: xr.Dataset, frequency: float | None, command: str, anchor: str = "contact"
) -> ReportSection:
    """Return force, gap and penetration of every face over the record and over its end.

    Args:
        history: `Results.history`, with contact_force and penetration.
        frequency: Of the forcing, Hz; None shows the tenth of the record where most happens.
        command: That makes the figures.
        anchor: Of the section.

    Raises:
        SignalError: A value is not finite.
    """
    faces = [str(name) for name in history["face"].values]
    force = {face: face_signal(history, "contact_force", face) for face in faces}
    depth = {face: face_signal(history, "penetration", face) for face in faces}
    time = np.asarray(history["time"].values, dtype=float)
    end = end_words(frequency) if is_long(time, frequency) else "the whole record"
    size = max(one.time.size for one in force.values())
    whole = [ChartCurve(face, *envelope(one.time, one.values)) for face, one in force.items()]
    span = enlarged_span(time, np.sum([one.values for one in force.values()], axis=0), frequency, ZOOM)
    last = [ChartCurve(face, *_part(one.between(*span))) for face, one in force.items()]
    gaps = [ChartCurve(face, *_part(one.between(*span), -_MICRO)) for face, one in depth.items()]
    rows = []
    for face in faces:
        pressed = force[face].values > 0.0
        impulses = face_signal(history, "impulse", face).values if "impulse" in history else None
        rows.append(
            (
                face, float(force[face].values.max()), float(force[face].values.mean()), 100.0 * float(pressed.mean()),
                _MICRO * float(max(depth[face].values.max(), 0.0)), _MICRO * float(max(-depth[face].values.min(), 0.0)),
                None if impulses is None else float(impulses[-1] - impulses[0]),
            )
        )  # fmt: skip
    heads = ("face", "largest recorded force (N)", "mean force (N)", "in contact (% of the records)",
             "largest penetration (µm)", "largest gap (µm)", "impulse (N s)")  # fmt: skip
    blocks: list[Block] = []
    if is_long(time, frequency):
        words = f"Normal force on the beam, the whole record.{thinning_words(size)}"
        blocks.append(Chart(words, "time (s)", "contact force (N)", whole, command))
    blocks += [
        Chart(f"Normal force on the beam, {end}.", "time (ms)", "contact force (N)", last, command),
        Chart(
            f"Smallest gap of each face, {end}; below zero the largest penetration.",
            "time (ms)", "gap (µm)", gaps, command,
        ),
        TableBlock("The faces over the whole record, at the recorded instants", heads, rows),
        *_bodies(history),
    ]  # fmt: skip
    return ReportSection("Contact", anchor, blocks)


def _bodies(history: xr.Dataset) -> list[Block]:
    """Return the table of the supports that give way; nothing where all stand still."""
    if "support_displacement" not in history:
        return []
    heads = ("support", "axis", "largest displacement (µm)", "at the start (µm)", "largest force on the frame (N)")
    rows = []
    for name in history["support_body"].values:
        for axis in history["support_axis"].values:
            moved, force = (
                history[key].sel(support_body=name, support_axis=axis).values
                for key in ("support_displacement", "support_force")
            )
            if np.any(moved):
                largest = _MICRO * float(np.abs(moved).max())
                rows.append((str(name), str(axis), largest, _MICRO * float(moved[0]), float(np.abs(force).max())))
    return [TableBlock("The supports that give way, at the recorded instants", heads, rows)]


def _part(part: Signal, factor: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    return envelope(1e3 * part.time, factor * part.values)
