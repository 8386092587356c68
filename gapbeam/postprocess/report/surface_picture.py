"""A surface as a picture: for browsers without WebGL, and for paper."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D

from gapbeam.postprocess.figures.figure_style import GRAY, journal_style
from gapbeam.postprocess.report.charts import Surface

DOTS = 170  # per inch: sharp on a phone, 60 kB a picture


def surface_picture(surface: Surface) -> bytes:
    """Draw a surface and return the PNG file."""
    along = np.asarray(surface.along, dtype=float)
    across = np.asarray(surface.across, dtype=float)
    x, y = np.meshgrid(np.log10(along) if surface.log_x else along, np.log10(across) if surface.log_y else across)
    with journal_style(), rc_context({"figure.constrained_layout.use": False}):
        figure = Figure(figsize=(5.6, 4.0))
        axes = figure.add_subplot(projection="3d")
        assert isinstance(axes, Axes3D)
        axes.plot_surface(
            x, y, surface.heights, cmap="viridis", rcount=60, ccount=60, linewidth=0.15, edgecolor=(1, 1, 1, 0.35)
        )
        axes.view_init(elev=28.0, azim=-130.0)
        axes.set_xlabel(_axis(surface.x, surface.log_x), labelpad=4.0)
        axes.set_ylabel(_axis(surface.y, surface.log_y), labelpad=4.0)
        axes.set_zlabel(surface.z, labelpad=4.0)
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.pane.set_facecolor((1.0, 1.0, 1.0, 0.0))
            axis.pane.set_edgecolor(GRAY)
        axes.set_box_aspect(None, zoom=0.86)
        figure.subplots_adjust(left=0.0, right=0.96, bottom=0.04, top=1.0)
        file = BytesIO()
        figure.savefig(file, format="png", dpi=DOTS)
    return file.getvalue()


def _axis(title: str, logarithmic: bool) -> str:
    return f"log$_{{10}}$ {title}" if logarithmic else title
