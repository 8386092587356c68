"""Sheet of a set-up: the whole beam with loads and probes, supports from near, and cross-sections in their play."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import rounded_down, size_words
from gapbeam.postprocess.figures.figure_style import SKY
from gapbeam.postprocess.results.columns_of_run import RunSupport
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene.film import rows_of
from gapbeam.postprocess.scene.motion_range import (
    GAP_SHOWN,
    ROUND,
    MotionRange,
    Window,
    window_of_support,
    window_of_whole,
)
from gapbeam.postprocess.scene.plane_view import FROM_SUPPORT, FROM_WHOLE, PictureView, Shot, views_of
from gapbeam.postprocess.scene.set_up import LoadArrow, SectionMask, SetUp
from gapbeam.postprocess.scene.sheet import DESIGNED_FOR, DPI, Place, pixels, style_of
from gapbeam.postprocess.scene.support_surface import (
    ARM,
    FaceBox,
    SupportBoxes,
    carried_by,
    inner_radii,
    marks_of,
    outer_radius,
    placed,
    support_of,
)
from gapbeam.postprocess.scene.surface_color import ABOVE, BEAM, BELOW, EDGE, SurfaceColor

_BLOCK = 0.35  # height of a block over the thickness of the beam
_TURNS = np.linspace(-180.0, 180.0, 721)


def draw_section(panel: Axes, section: SectionMask, faces: tuple[FaceBox, ...], scale: float) -> None:
    """Draw the section of the beam between the faces of a support; y to the right, the bending direction up.

    Args:
        panel: Panel to draw in.
        section: Section of the beam.
        faces: Faces of the support.
        scale: Enlarges the gaps.
    """
    up = 1e3 * section.up
    across = 1e3 * section.across
    bottom, top = section.up[0], section.up[-1]
    left, right = across[0], across[-1]
    for face in faces:
        met = face.met
        if met.around:
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
        edge = 0.5 * face.thickness + scale * met.gap
        low = -edge - height if met.below else edge
        panel.fill(
            [left, right, right, left],
            [1e3 * low, 1e3 * low, 1e3 * (low + height), 1e3 * (low + height)],
            facecolor=BELOW if met.below else ABOVE,
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


_WHOLE: Place = (0.02, 0.52, 0.96, 0.29)
_NEAR_BOTTOM, _NEAR_HEIGHT = 0.045, 0.27
_MOST_NEAR = 3
_ROWS = 4
_LOAD = "#B0200C"
_PROBE = "#1F5FA8"
_ARROW = 0.17  # of the height of the picture


def picture_of(set_up: SetUp, size: tuple[int, int]) -> tuple[np.ndarray, float]:
    """Draw a set-up.

    Args:
        set_up: The set-up to draw.
        size: Width and height, pixels.

    Returns:
        The picture, (height, width, 3), 8 bits, and the factor of all gaps in it.
    """
    scale = factor_of(set_up.supports, support_of(set_up.points, set_up.dimension, set_up.supports).thickness)
    large = size[1] / DESIGNED_FOR
    with mpl.rc_context(style_of(large)):
        sheet = _Sheet(set_up, scale, size, large)
        return sheet.drawn(), scale


def factor_of(supports: tuple[RunSupport, ...], thickness: float) -> float:
    """Return a round factor that shows the widest gap at nearly half the thickness of the beam; at least 1.

    Args:
        supports: Supports of the case.
        thickness: Thickness of the beam, m.
    """
    widest, thinnest = 0.0, thickness
    for one in supports:
        thinnest = min(thinnest, one.thickness or thickness)
        for met in one.faces:
            recess = max((abs(value) for value in met.recesses), default=0.0)
            widest = max(widest, abs(met.gap) + recess + max(abs(met.offset), abs(met.lateral)))
    return rounded_down(max(1.0, GAP_SHOWN * thinnest / widest), ROUND) if widest else 1.0


class _Sheet:
    def __init__(self, set_up: SetUp, scale: float, size: tuple[int, int], large: float) -> None:
        self._set_up, self._scale, self._size, self._large = set_up, scale, size, large
        self._figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, facecolor="white")
        self._canvas = FigureCanvasAgg(self._figure)
        self._whole = support_of(set_up.points, set_up.dimension, set_up.supports)
        at_rest = np.zeros_like(set_up.points)
        self._frame = Frame(0.0, at_rest, at_rest, np.zeros(len(at_rest)))
        self._left_out = 0

    def drawn(self) -> np.ndarray:
        """Return the picture."""
        self._draw_whole()
        shown = _different(self._set_up.supports)
        for number, alike in enumerate(shown[:_MOST_NEAR]):
            self._draw_near(number, alike)
        self._write(len(shown))
        self._canvas.draw()  # type: ignore[no-untyped-call]
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()  # type: ignore[no-untyped-call]

    def _picture(
        self, support: SupportBoxes, window: Window, place: Place, toward: tuple[float, float, float]
    ) -> PictureView:
        """Draw a view of the beam at a place on the sheet; it is to be closed."""
        shot = Shot(window, pixels(place, self._size), self._scale, toward)
        [view], _ = views_of(self._set_up, support, [shot], SurfaceColor.of_pressure(0.0), meshed=True)
        picture = view.picture(self._frame)
        panel = self._figure.add_axes(place)
        panel.imshow(picture, extent=(0.0, 1.0, 0.0, 1.0), aspect="auto", interpolation="none")
        panel.set_axis_off()
        return view

    def _draw_whole(self) -> None:
        nothing = MotionRange(np.zeros(1), np.zeros(1), 0.0, 0.0, 0.0, 0.0, 0)
        carried = carried_by(marks_of(self._set_up.case, self._whole.start), self._whole.middle)
        window = window_of_whole(nothing, self._whole, self._scale, pixels(_WHOLE, self._size), carried)
        with closing(self._picture(self._whole, window, _WHOLE, FROM_WHOLE)) as view:
            panel = self._figure.axes[-1]
            labels = list[tuple[float, float, str, str]]()  # place, words and color of what stands above the beam
            self._mark(panel, view, window, labels)
            self._add_probes(panel, view, labels)
            for load in self._set_up.loads:
                self._add_load(panel, view, load, labels)
            self._stack(panel, labels, up=True)
            below = list[tuple[float, float, str, str]]()
            for one in self._set_up.supports:
                blocks = tuple(block for block in self._whole.blocks if block.met in one.faces)
                low = self._whole.heights(blocks, self._scale)[0]
                middle = self._whole.start + 0.5 * (one.start + one.end)
                [at] = view.fractions(np.array([self._whole.inside(middle, low)]))
                below.append((float(at[0]), float(at[1]), f"{one.name} {size_words(one.clearance)}", "black"))
            self._stack(panel, below, up=False)

    def _mark(
        self, panel: Axes, view: PictureView, window: Window, labels: list[tuple[float, float, str, str]]
    ) -> None:
        """Mark joints and masses, and shade fluids."""
        marks = marks_of(self._set_up.case, self._whole.start)
        for one in placed(marks, self._whole, window.height, view.fractions):
            x = float(one.at[0])
            if one.outline is not None:
                panel.fill(*one.outline.T, color=SKY, alpha=0.2, lw=0.0)
            else:
                style: dict[str, Any] = {"marker": one.mark.symbol, "ms": 11 * self._large, "mew": 1.6}
                if one.root is not None:
                    panel.plot(*np.stack([one.root, one.at]).T, **ARM, clip_on=False)
                panel.plot(*one.at[:, None], mfc="white", mec="black", zorder=5, clip_on=False, **style)
            labels.append((x, float(one.above[1]), one.mark.name, "black"))

    def _add_probes(self, panel: Axes, view: PictureView, labels: list[tuple[float, float, str, str]]) -> None:
        for name, point in self._set_up.probes.items():
            [at] = view.fractions(self._placed(point)[None])
            panel.plot(*at[:, None], "o", color=_PROBE, ms=6 * self._large, mec="white", clip_on=False, zorder=6)
            labels.append((float(at[0]), float(at[1]), name, _PROBE))

    def _add_load(
        self, panel: Axes, view: PictureView, load: LoadArrow, labels: list[tuple[float, float, str, str]]
    ) -> None:
        """Draw an arrow: at the point of a force, in a moved support, at the middle of the beam for its weight."""
        moved = next((one for one in self._set_up.supports if one.name == load.support), None)
        if load.point is not None:
            place = self._placed(load.point)
        elif moved is not None:
            place = self._placed((0.5 * (moved.start + moved.end), 0.0, 0.0))
        else:
            along = self._whole.start + (0.42 + 0.08 * len(self._before(load))) * (self._whole.end - self._whole.start)
            place = np.array(self._whole.inside(along, self._whole.middle))
        step = 1e-3 * (self._whole.end - self._whole.start)
        direction = np.array(load.direction)
        at, ahead = view.fractions(np.array([place, place + step * direction]))
        wide = self._size[0] * _WHOLE[2] / (self._size[1] * _WHOLE[3])
        toward = (ahead - at) * (wide, 1.0)
        length = float(np.linalg.norm(toward))
        toward = _ARROW * (toward / length if length > 1e-12 else np.array([0.0, 1.0])) / (wide, 1.0)
        style = "<|-|>" if load.sways else "-|>"
        start, end = (at - toward, at + toward) if load.sways else (at - 2.0 * toward * 0.9, at)
        head: dict[str, Any] = {"color": _LOAD, "lw": 2.0 * self._large, "mutation_scale": 14 * self._large}
        head |= {"arrowstyle": style, "shrinkA": 0.0, "shrinkB": 0.0}
        panel.annotate(
            "", end, start, annotation_clip=False, zorder=7,
            arrowprops=head,
        )  # fmt: skip
        labels.append((float(at[0]), float(max(start[1], end[1])), load.words, _LOAD))

    def _before(self, load: LoadArrow) -> list[LoadArrow]:
        """Return the loads on the whole beam that are drawn before one."""
        loads = self._set_up.loads
        return [one for one in loads[: loads.index(load)] if one.point is None and one.support is None]

    def _placed(self, point: tuple[float, float, float]) -> np.ndarray:
        """Return a point of the case where it is in the mesh, (3,), m."""
        x, y, z = point
        if self._set_up.dimension == 2:
            return np.array([self._whole.start + x, self._whole.middle + y, 0.0])
        return np.add(self._whole.inside(self._whole.start + x, self._whole.middle + z), (0.0, y, 0.0))

    def _stack(self, panel: Axes, labels: list[tuple[float, float, str, str]], up: bool) -> None:
        """Write labels in rows above or below the picture, with a thin line to their targets."""
        labels = sorted(labels)
        style: dict[str, Any] = {"fontsize": 13 * self._large, "annotation_clip": False}
        renderer = self._canvas.get_renderer()  # type: ignore[no-untyped-call]
        spans = []
        for x, _, words, _color in labels:
            text = self._figure.text(0.0, 0.0, words, fontsize=style["fontsize"])
            half = 0.5 * text.get_window_extent(renderer).width / (self._size[0] * _WHOLE[2])
            text.remove()
            middle = min(max(x, half), 1.0 - half)
            spans.append((middle - half, middle + half))
        rows = rows_of(spans, _ROWS if up else 2, 0.012)
        self._left_out += rows.count(None)
        high = 20.0 * self._large / (self._size[1] * _WHOLE[3])
        edge = max([0.93, *(y for _, y, _, _ in labels)]) if up else min([0.0, *(y for _, y, _, _ in labels)])
        for (x, y, words, color), (first, last), row in zip(labels, spans, rows, strict=True):
            if row is None:
                continue
            level = edge + (row + 1.0) * high if up else edge - (row + 0.6) * high
            panel.plot([x, x], [y, level], color=color, lw=0.6 * self._large, alpha=0.5, clip_on=False, zorder=4)
            panel.annotate(
                words, (0.5 * (first + last), level), ha="center", va="bottom" if up else "top", color=color,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.85}, zorder=8, **style,
            )  # fmt: skip
        panel.set_xlim(0.0, 1.0)
        panel.set_ylim(0.0, 1.0)

    def _draw_near(self, number: int, alike: list[RunSupport]) -> None:
        """Draw the first of some supports that are alike, along the beam and across it."""
        one = alike[0]
        left = 0.02 + number * 0.327
        span = (self._whole.start + one.start, self._whole.start + one.end)
        support = replace(self._whole, near=span, clearance=one.clearance)
        place = (left, _NEAR_BOTTOM, 0.19, _NEAR_HEIGHT)
        window = window_of_support(support, self._scale, pixels(place, self._size))
        self._picture(support, window, place, FROM_SUPPORT).close()
        faces = tuple(block for block in self._whole.blocks if block.met in one.faces)
        if one.name in self._set_up.sections:
            across = self._figure.add_axes((left + 0.20, _NEAR_BOTTOM, 0.105, _NEAR_HEIGHT))
            draw_section(across, self._set_up.sections[one.name], faces, self._scale)
        region = self._set_up.regions[one.name]
        others = f" and {len(alike) - 1} alike" if len(alike) > 1 else ""
        kind = "clearance" if one.clearance >= 0.0 else "interference"
        words = f"{one.name}{others}: {region}, {kind} {size_words(one.clearance).lstrip('−')}"
        self._figure.text(left, _NEAR_BOTTOM + _NEAR_HEIGHT + 0.035, words, fontsize=15 * self._large, va="center")

    def _write(self, shown: int) -> None:
        large, set_up = self._large, self._set_up
        self._figure.text(0.02, 0.965, set_up.title, fontsize=20 * large, va="center")
        words = f"set-up before the run, undeformed; gaps × {self._scale:g}; "
        words += f"beam {size_words(self._whole.end - self._whole.start, 5)}, {set_up.cell_count} cells"
        more = [f"{self._left_out} names have no room"] if self._left_out else []
        if shown > _MOST_NEAR:
            more.append(f"{shown - _MOST_NEAR} more kinds of supports not shown from near")
        self._figure.text(0.98, 0.965, words, fontsize=14 * large, va="center", ha="right")
        self._figure.text(0.98, 0.015, "; ".join(more), fontsize=13 * large, va="center", ha="right", color="#444444")


def _different(supports: tuple[RunSupport, ...]) -> list[list[RunSupport]]:
    """Group the supports by kind: those of a list differ by place and name alone."""
    found = dict[object, list[RunSupport]]()
    for one in supports:
        shapes = tuple(met._replace(face="", moves=()) for met in one.faces)
        found.setdefault((f"{one.end - one.start:.3g}", one.clearance, shapes, one.thickness), []).append(one)
    return list(found.values())
