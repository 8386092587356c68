"""A panel across the beam in a support: its section, and what the support leaves to it, with enlarged gaps."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from gapbeam.postprocess.scene.ring import inner_radii, outer_radius
from gapbeam.postprocess.scene.set_up import SectionMask
from gapbeam.postprocess.scene.support_surface import FaceBox
from gapbeam.postprocess.scene.surface_color import ABOVE, BEAM, BELOW, EDGE

_BLOCK = 0.35  # height of a block over the thickness of the beam
_TURNS = np.linspace(-180.0, 180.0, 721)


def draw_section(panel: Axes, section: SectionMask, faces: tuple[FaceBox, ...], scale: float) -> None:
    """Draw the section of the beam between the faces of a support; y to the right, the bending direction up.

    Args:
        panel: Where.
        section: Of the beam.
        faces: Of the support.
        scale: Enlarges the gaps.
    """
    up = 1e3 * section.up
    across = 1e3 * section.across
    bottom, top = section.up[0], section.up[-1]
    left, right = across[0], across[-1]
    for face in faces:
        met = face.met
        if face.around:
            outer = outer_radius(met, face.thickness, scale)
            inner = np.minimum(inner_radii(met, face.thickness, scale, _TURNS), outer)
            sine, cosine = np.sin(np.radians(_TURNS)), -np.cos(np.radians(_TURNS))
            y = 1e3 * (scale * met.lateral + np.concatenate([inner * sine, (outer * sine)[::-1]]))
            z = 1e3 * (scale * met.offset + np.concatenate([inner * cosine, (outer * cosine)[::-1]]))
            panel.fill(y, z, color=BELOW, alpha=0.6, lw=0.0)
            for radius in (inner, np.full_like(inner, outer)):
                walls = np.where(inner < outer, radius, np.nan)
                panel.plot(
                    1e3 * (scale * met.lateral + walls * sine),
                    1e3 * (scale * met.offset + walls * cosine),
                    color=EDGE,
                    lw=1.0,
                )
            continue
        overlap = max(0.0, -scale * met.gap)
        height = _BLOCK * face.thickness + overlap
        low = -0.5 * face.thickness - scale * met.gap - height if face.below else 0.5 * face.thickness + scale * met.gap
        panel.fill(
            [left, right, right, left],
            [1e3 * low, 1e3 * low, 1e3 * (low + height), 1e3 * (low + height)],
            facecolor=BELOW if face.below else ABOVE,
            edgecolor=EDGE,
            lw=1.0,
            alpha=0.5 if overlap else 0.8,
            zorder=3 if overlap else 1,  # an interference is seen through the face
            clip_on=False,
        )
    if section.inside.min() > 0.0:  # nothing but material: no contour would close
        panel.fill(
            [left, right, right, left], 1e3 * np.array([bottom, bottom, top, top]), facecolor=BEAM, edgecolor=EDGE
        )
    else:
        panel.contourf(across, up, section.inside, levels=[0.5, 2.0], colors=[BEAM])
        panel.contour(across, up, section.inside, levels=[0.5], colors=[EDGE], linewidths=1.0)
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.08)
    panel.set_axis_off()
