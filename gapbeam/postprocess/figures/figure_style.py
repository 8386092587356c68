"""Style of all figures: column widths of journals, serif type, lines that differ in black and white too."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

# Widths in inches: 85 mm and 175 mm.
SINGLE = 3.35
DOUBLE = 6.89

# Okabe and Ito's colors, distinguished with color-blind eyes, and by lightness in print.
BLACK = "#000000"
GRAY = "#9A9A9A"
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
SKY = "#56B4E9"
PURPLE = "#CC79A7"

BASE_AND_GLAND = ("base", "gland")
COLORS = (BLACK, VERMILION, BLUE, GREEN, PURPLE, SKY)


def face_style(face: str, faces: Sequence[str]) -> dict[str, Any]:
    """Return the line of one of several faces: a color for each, dashed where it stands above the beam.

    Args:
        face: Name of the face; "" for a curve of something else.
        faces: Names of all faces that are drawn together.
    """
    number = (BASE_AND_GLAND if face in BASE_AND_GLAND else list(faces)).index(face) % len(COLORS)
    above = face == "gland" or face.endswith("_above")
    return {"color": COLORS[number], "linestyle": "--" if above else "-", "linewidth": 1.0}


_PARAMETERS: dict[str, Any] = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 2.2,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-4, 5),
    "axes.xmargin": 0.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "lines.linewidth": 0.9,
    "path.simplify": True,
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "figure.dpi": 100.0,
    "savefig.dpi": 300.0,
    "figure.constrained_layout.use": True,
    "agg.path.chunksize": 20000,
}


@contextmanager
def journal_style() -> Iterator[None]:
    """Draw in this style, and leave matplotlib as it was."""
    with mpl.rc_context(_PARAMETERS):
        yield


def panels(
    rows: int, columns: int = 1, width: float = DOUBLE, height: float = 2.0, **options: Any
) -> tuple[Figure, np.ndarray]:
    """Make a figure of stacked panels without a window.

    Args:
        rows: Number of rows.
        columns: Number of columns.
        width: Width of the figure, inches.
        height: Height of one row, inches.
        options: Options of `Figure.subplots`.

    Returns:
        The figure and the array of its axes, (rows, columns).
    """
    figure = Figure(figsize=(width, height * rows + 0.25))
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    spread(figure)
    return figure, axes


def spread(figure: Figure) -> None:
    """Set the room between panels."""
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(w_pad=0.03, h_pad=0.03, wspace=0.04, hspace=0.02)


def letter(axes: Sequence[Axes], pad: float = 3.0) -> None:
    """Mark panels (a), (b), ... above their upper left corners, `pad` points away."""
    for index, panel in enumerate(axes):
        panel.set_title(f"({chr(ord('a') + index)})", loc="left", pad=pad)


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure with the dots of this style, wherever it was drawn."""
    with journal_style():
        figure.savefig(path)


def save(figure: Figure, folder: Path, name: str, formats: Sequence[str]) -> list[Path]:
    """Write a figure in every format asked for.

    Args:
        figure: Complete.
        folder: Folder for the files; it is made if it does not exist.
        name: File name without suffix.
        formats: "png", "pdf", "svg".

    Returns:
        The paths written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.{suffix}" for suffix in formats]
    for path in paths:
        figure.savefig(path)
    return paths


def limits_around(axes: Axes, values: np.ndarray) -> None:
    """Set limits around values with some room."""
    low, high = float(np.min(values)), float(np.max(values))
    room = 0.08 * ((high - low) or abs(high) or 1.0)
    axes.set_ylim(low - room, high + room)
