"""Charts of values along the beam, with a button for each support where supports lie far apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gapbeam.postprocess.report.charts import Chart, ChartCurve

_APART = 1.0  # of the length of what lies together: a larger distance to the next one leaves no room for both
MARKED = 60  # points of a line that has a mark for each


def chart_along(caption: str, y: str, lines: Mapping[str, tuple[np.ndarray, np.ndarray]], command: str = "") -> Chart:
    """Return a chart of values of faces along the beam.

    Args:
        caption: Description.
        y: Name of the vertical axis.
        lines: Places along the beam, m, increasing, and values, by face; at least one.
        command: That makes it.
    """
    curves = {
        face: ChartCurve(face, 1e3 * x, values, "lines+markers" if len(x) < MARKED else "lines")
        for face, (x, values) in lines.items()
    }
    together = groups({face: (float(x[0]), float(x[-1])) for face, (x, _) in lines.items()})
    if len(together) == 1:
        return Chart(caption, "x (mm)", y, list(curves.values()), command)
    names = {face: " and ".join(group) for group in together for face in group}
    chosen = [replace(curve, choice=names[face]) for face, curve in curves.items()]
    return Chart(caption, "x (mm)", y, chosen, command, choices=list(dict.fromkeys(names.values())), choice="face")


def groups(spans: Mapping[str, tuple[float, float]]) -> list[list[str]]:
    """Return names of spans by what lies together; all in one where no gap between them is long.

    Args:
        spans: Begin and end of each, m.
    """
    found: list[list[str]] = []
    begin = end = 0.0
    for name, (first, last) in sorted(spans.items(), key=lambda item: item[1]):
        if found and first - end <= _APART * max(end - begin, last - first):
            found[-1].append(name)
            end = max(end, last)
        else:
            found.append([name])
            begin, end = first, last
    return found


ZOOM = 3  # forcing periods


def end_words(frequency: float | None) -> str:
    """Return the name of that part in captions, under a forcing of a frequency in Hz, or under none."""
    return f"the last {ZOOM} forcing periods" if frequency is not None else "the tenth of the record where most happens"


def is_long(time: np.ndarray, frequency: float | None) -> bool:
    """Return whether that part is less than the whole record.

    Args:
        time: (n,), s.
        frequency: Of the forcing, Hz.
    """
    return frequency is None or float(np.ptp(time)) > 1.2 * ZOOM / frequency
