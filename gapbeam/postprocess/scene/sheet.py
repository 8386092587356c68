"""The sheet on which pictures, pressures and time signals are put together: one picture of a film.

Contact pressures on the support shown from near are curves along it in 2D, maps of its faces in 3D.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.tri import Triangulation

from gapbeam.postprocess.display_units import shown, shown_along, shown_by
from gapbeam.postprocess.figures.figure_style import BASE_AND_GLAND, GRAY, SKY, face_style
from gapbeam.postprocess.results.field_reader import Frame
from gapbeam.postprocess.scene.motion_range import Window, unrolled
from gapbeam.postprocess.scene.support_surface import ARM, PlacedMark, SupportBoxes
from gapbeam.postprocess.scene.surface_color import PRESSURES, SurfaceColor
from gapbeam.postprocess.scene.traces import Caption, Traces

_BETWEEN_TICKS = -16.0  # points: the name of the angle stands beside its short label 0, between those of -180 and 180


class PressurePanel:
    """Contact pressure on the faces of a support, filled again for every frame."""

    def __init__(
        self,
        figure: Figure,
        place: tuple[float, float, float, float],
        support: SupportBoxes,
        points: np.ndarray,
        faces: dict[str, np.ndarray],
        largest: float,
        large: float = 1.0,
    ) -> None:
        """Lay out.

        Args:
            figure: The sheet.
            place: Left, bottom, width, height as fractions of the sheet.
            support: Beam and support.
            points: Points of the undeformed mesh, m.
            faces: Numbers of the mesh points on each face.
            largest: End of the scale, Pa.
            large: Height of the sheet over the one it was designed for.
        """
        left, bottom, width, height = place
        self._unit, self._factor = shown("Pa", largest)
        self._limit, self._large = self._factor * largest or 1.0, large
        self._along, self._in_x = shown_along([support.near])
        self._numbers: dict[str, np.ndarray] = {}
        self._artists: dict[str, Any] = {}
        bar_place = (left + width + 0.008, bottom, 0.008, height)
        if support.dimension == 2:
            self._curves(figure, place, support, points, faces)
        else:
            self._maps(figure, place, support, points, faces)
        bar = figure.colorbar(ScalarMappable(Normalize(0.0, self._limit), PRESSURES), cax=figure.add_axes(bar_place))
        bar.outline.set_visible(False)  # type: ignore[operator]
        bar.ax.locator_params(nbins=5)
        if support.dimension == 2:
            bar.ax.set_yticklabels([])
            bar.ax.tick_params(length=0)

    @property
    def artists(self) -> list[Artist]:
        """Artists that change from frame to frame."""
        return list(self._artists.values())

    def fill(self, pressure: np.ndarray) -> None:
        """Show the pressures of one frame; of all points of the mesh, (n,), Pa."""
        for face, numbers in self._numbers.items():
            values = self._factor * pressure[numbers]
            artist = self._artists[face]
            if hasattr(artist, "set_ydata"):
                artist.set_ydata(values)
            else:
                artist.set_array(values)

    def _curves(
        self, figure: Figure, place: tuple[float, float, float, float], support: SupportBoxes, points: np.ndarray,
        faces: dict[str, np.ndarray],
    ) -> None:  # fmt: skip
        panel = figure.add_axes(place)
        for face, numbers in faces.items():
            order = numbers[np.argsort(points[numbers, 0])]
            style = face_style(face, list(faces))
            x = self._in_x * points[order, 0]
            (self._artists[face],) = panel.plot(x, 0.0 * x, **{**style, "linewidth": 1.6}, label=face)
            self._numbers[face] = order
        panel.set_xlim(self._in_x * support.near[0], self._in_x * support.near[1])
        panel.set_ylim(0.0, self._limit)
        panel.set_xlabel(f"x ({self._along})", labelpad=0)
        panel.set_ylabel(f"contact pressure ({self._unit})", labelpad=2.0 * self._large)
        panel.locator_params(axis="y", nbins=5)
        panel.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 0.99),
            ncols=2,
            borderaxespad=0.0,
            handlelength=1.6,
            columnspacing=1.0,
        )

    def _maps(
        self, figure: Figure, place: tuple[float, float, float, float], support: SupportBoxes, points: np.ndarray,
        faces: dict[str, np.ndarray],
    ) -> None:  # fmt: skip
        left, bottom, width, height = place
        each = 0.36 * height
        for number, face in enumerate(faces):
            low = bottom + 0.5 * height * number
            panel = figure.add_axes((left, low, width, each))
            numbers = faces[face]
            around = support.is_around(face)
            x, y = self._in_x * points[numbers, :2].T
            if around:
                numbers, x, y = unrolled(numbers, points)
                x = self._in_x * x
            if numbers.size:
                self._artists[face] = panel.tripcolor(
                    Triangulation(x, y),
                    np.zeros(numbers.size),
                    shading="gouraud",
                    cmap=PRESSURES,
                    vmin=0.0,
                    vmax=self._limit,
                )
                self._numbers[face] = numbers
            aside = _BETWEEN_TICKS * self._large if around else 0.0
            panel.set_ylabel(
                "angle (°)" if around else f"y ({self._along})",
                labelpad=aside,
                fontsize="small" if around else "medium",
            )
            edges = self._in_x * support.front, 0.0, self._in_x * support.back
            panel.set_yticks([-180.0, 0.0, 180.0] if around else edges)
            words = f"pressure on the {face}" if face in BASE_AND_GLAND else face
            panel.set_title(
                f"{words} ({self._unit})",
                loc="left",
                fontsize="medium",
                pad=4.0 * self._large,
            )
            panel.spines[:].set_visible(True)
            if number == 0:
                panel.set_xlabel(f"x ({self._along})", labelpad=0)
            else:
                panel.tick_params(labelbottom=False)


Place = tuple[float, float, float, float]

# Left, bottom, width, height as fractions of the sheet.
WHOLE: Place = (0.02, 0.545, 0.96, 0.35)
_WHOLE_BESIDE_SCALE: Place = (0.02, 0.545, 0.88, 0.35)
_SCALE: Place = (0.925, 0.575, 0.008, 0.29)
ZOOM: Place = (0.02, 0.105, 0.43, 0.35)
_PRESSURE: Place = (0.50, 0.105, 0.165, 0.35)
_FORCE: Place = (0.775, 0.295, 0.205, 0.16)
_MOTION: Place = (0.775, 0.105, 0.205, 0.16)

DPI = 100
DESIGNED_FOR = 900
_PERIODS_SHOWN = 3.0
STYLE: dict[str, Any] = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 16.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.9,
    "axes.xmargin": 0.0,
    "xtick.labelsize": 14.0,
    "ytick.labelsize": 14.0,
    "xtick.major.size": 3.5,
    "ytick.major.size": 3.5,
    "xtick.major.pad": 3.5,
    "ytick.major.pad": 3.5,
    "legend.frameon": False,
    "legend.fontsize": 14.0,
}


def style_of(large: float) -> dict[str, Any]:
    """Return the style of a sheet, lengths and letters as large as the sheet is.

    Args:
        large: Height of the sheet over the one it was designed for.
    """
    return {key: value * large if key.endswith(("size", "pad")) else value for key, value in STYLE.items()}


def whole_place(color: SurfaceColor) -> Place:
    """Return the place of the whole beam: beside the scale of its colors, where it has one."""
    return _WHOLE_BESIDE_SCALE if color.everywhere else WHOLE


def pixels(place: Place, size: tuple[int, int]) -> tuple[int, int]:
    """Width and height in pixels of a place on the sheet."""
    return round(place[2] * size[0]), round(place[3] * size[1])


def ruler_step(length: float, most: int) -> float:
    """Return the distance of the labels on a ruler: 1, 2 or 5 times a power of ten, so that not too many stand there.

    Args:
        length: Length of the window, in any unit.
        most: Intervals that the picture has room for.
    """
    decade = 10.0 ** np.floor(np.log10(length / most))
    return float(next(step for step in (1.0, 2.0, 5.0, 10.0) if length <= most * step * decade * (1.0 + 1e-9)) * decade)


class Sheet:
    """A sheet that is laid out once and filled again for every frame."""

    def __init__(
        self,
        size: tuple[int, int],
        support: SupportBoxes,
        pressures: tuple[np.ndarray, dict[str, np.ndarray], float],
        traces: Traces,
        caption: Caption,
        windows: tuple[Window, Window],
        marks: Sequence[PlacedMark] = (),
        color: SurfaceColor | None = None,
    ) -> None:
        """Lay out.

        Args:
            size: Width and height in pixels.
            support: Beam and support.
            pressures: Points of the undeformed mesh, m; numbers of those on each face of the support shown from
                near; largest pressure, Pa.
            traces: Time signals.
            caption: Texts.
            windows: Windows of the pictures of the whole beam and of the support.
            marks: Joints, masses and fluids on the undeformed beam.
            color: Color of the surface; None: contact pressure.
        """
        self._size, self._caption, self._traces = size, caption, traces
        self._large = size[1] / DESIGNED_FOR
        with mpl.rc_context(style_of(self._large)):
            self.figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, facecolor="white")
            self._canvas = FigureCanvasAgg(self.figure)
            color = color or SurfaceColor.of_pressure(pressures[2])
            self._moving: list[Artist] = []
            self._carried: dict[str, tuple[Line2D, Line2D | None, Annotation]] = {}
            self._ground: Any = None  # all that no frame changes, once it is drawn
            self._whole = self._ruled(whole_place(color), windows[0], support, 11)
            if color.everywhere:
                self._add_scale(color)
            self._mark(marks)
            self._near = self._ruled(ZOOM, windows[1], support, 7)
            self._pressure = PressurePanel(self.figure, _PRESSURE, support, *pressures, self._large)
            close = [block.met.face for block in support.near_blocks()]
            unit, factor = shown_by("N", (float(force.max(initial=0.0)) for force in traces.forces.values()))
            forces = {face: factor * force for face, force in traces.forces.items()}
            self._force = self._trace(_FORCE, f"force ({unit})", traces.time, forces, close)
            unit, factor = shown("m", float(np.abs(traces.displacement).max(initial=0.0)))
            moved = {"": factor * traces.displacement}
            self._motion = self._trace(_MOTION, f"{traces.place} ({unit})", traces.displacement_time, moved)
            self._motion[0].set_xlabel(f"time ({caption.in_unit[0]})")
            self._force[0].tick_params(labelbottom=False)
            self._write()
            self._clock = self.figure.text(0.98, 0.96, "", ha="right", va="center", fontsize=18 * self._large)
            self._note = self.figure.text(0.98, 0.915, "", ha="right", va="center", fontsize=16 * self._large)
            self._moving += [*self._pressure.artists, self._clock, self._note]

    def fill(self, frame: Frame, whole: np.ndarray, near: np.ndarray, note: str = "") -> np.ndarray:
        """Put the pictures and the signals of one frame on the sheet.

        Args:
            frame: The fields.
            whole: Picture of the whole beam, (height, width, 3 or 4), 8 bits.
            near: Picture of the support.
            note: One line below the time.

        Returns:
            The sheet, (height, width, 4), 8 bits, until it is filled again.
        """
        self._pressure.fill(frame.contact_pressure)
        self._clock.set_text(self._caption.clock(frame.time))
        self._note.set_text(note)
        for panel, now in (self._force, self._motion):
            panel.set_xlim(*self._span(frame.time))
            now.set_xdata(2 * [self._caption.in_unit[1] * frame.time])
        sheet = self._begun()
        _paste(sheet, self._whole, whole)
        _paste(sheet, self._near, near)
        for artist in self._moving:
            self.figure.draw_artist(artist)
        return sheet

    def move(self, marks: Iterable[PlacedMark]) -> None:
        """Put marks of masses where the beam carries them in the next frame."""
        for one in marks:
            symbol, arm, name = self._carried[one.mark.name]
            symbol.set_data(one.at[:1], one.at[1:])
            if arm is not None and one.root is not None:
                arm.set_data(*np.stack([one.root, one.at]).T)
            name.xy = (float(one.above[0]), float(one.above[1]))

    def _begun(self) -> np.ndarray:
        """Draw the parts that no frame changes, once; return the pixels, (height, width, 4)."""
        if self._ground is None:
            for panel, _ in (self._force, self._motion):
                _hold_label(panel.xaxis, self._canvas.get_renderer())  # type: ignore[no-untyped-call]
            shown = [artist.get_visible() for artist in self._moving]
            for artist in self._moving:
                artist.set_visible(False)
            self._canvas.draw()  # type: ignore[no-untyped-call]
            self._ground = self._canvas.copy_from_bbox(self.figure.bbox)  # type: ignore[no-untyped-call]
            for artist, visible in zip(self._moving, shown, strict=True):
                artist.set_visible(visible)
        self._canvas.restore_region(self._ground)  # type: ignore[no-untyped-call]
        return np.asarray(self._canvas.buffer_rgba())  # type: ignore[no-untyped-call]

    def _ruled(self, place: Place, window: Window, support: SupportBoxes, most: int) -> Axes:
        """Lay out the place of a picture, with a ruler below in 2D."""
        panel = self.figure.add_axes(place)
        unit, factor = shown_along([window.x])
        extent = tuple(factor * end for end in (*window.x, *window.height))
        panel.set_xlim(*extent[:2])
        panel.set_ylim(*extent[2:])
        panel.set_yticks([])
        panel.set_xticks([])
        panel.spines[:].set_visible(False)
        if support.dimension == 2:
            first, last = max(factor * support.start, extent[0]), min(factor * support.end, extent[1])
            step = ruler_step(extent[1] - extent[0], most)
            ticks = np.arange(np.ceil(first / step - 1e-6), np.floor(last / step + 1e-6) + 1) * step + 0.0
            panel.set_xticks(ticks, [*(f"{x:g}" for x in ticks[:-1]), f"{ticks[-1]:g} {unit}"])
            panel.spines["bottom"].set_visible(True)
            panel.spines["bottom"].set_bounds(first, last)
            self._moving.append(panel.spines["bottom"])  # in front of the picture
        return panel

    def _add_scale(self, color: SurfaceColor) -> None:
        """Draw the scale of the colors beside the whole beam, with name and unit."""
        scale = ScalarMappable(Normalize(*color.shown_limits), color.colors)
        bar = self.figure.colorbar(scale, cax=self.figure.add_axes(_SCALE))
        bar.outline.set_visible(False)  # type: ignore[operator]
        bar.ax.locator_params(nbins=6)
        bar.set_label(color.label)

    def _mark(self, marks: Sequence[PlacedMark]) -> None:
        """Mark joints and masses on the axis of the undeformed beam, and shade fluids, with names above the beam."""
        panel, large = self._whole, self._large
        for one in marks:
            where, offset = one.above, 4.0
            symbol, arm = None, None
            if one.outline is not None:
                self._moving += panel.fill(*one.outline.T, transform=panel.transAxes, color=SKY, alpha=0.2, lw=0.0)
                where, offset = np.array([one.at[0], 0.0]), 6.0
            else:
                style: dict[str, Any] = {
                    "marker": one.mark.symbol,
                    "ms": 11 * large,
                    "mfc": "white",
                    "mec": "black",
                    "mew": 1.6,
                }
                if one.root is not None:
                    offset = 9.0
                    ends = np.stack([one.root, one.at])
                    [arm] = panel.plot(*ends.T, **ARM, transform=panel.transAxes, clip_on=False)
                    self._moving.append(arm)
                [symbol] = panel.plot(*one.at[:, None], transform=panel.transAxes, clip_on=False, zorder=5, **style)
                self._moving.append(symbol)
            name = panel.annotate(
                one.mark.name, (float(where[0]), float(where[1])), (0.0, offset * large), xycoords="axes fraction",
                textcoords="offset points", ha="center", va="bottom", annotation_clip=False, fontsize=14 * large,
            )  # fmt: skip
            self._moving.append(name)
            if symbol is not None and one.mark.moves:
                self._carried[one.mark.name] = symbol, arm, name

    def _trace(
        self, place: Place, label: str, time: np.ndarray, curves: dict[str, np.ndarray], close: Sequence[str] = ("",)
    ) -> tuple[Axes, Line2D]:
        """Draw curves over time: those that are close in colors, all others in gray with one entry in the legend."""
        panel = self.figure.add_axes(place)
        others = [name for name in curves if name not in close]
        now = panel.axvline(0.0, color=GRAY, lw=2.0 * self._large, zorder=0)
        for name in (*others, *(name for name in close if name in curves)):
            style = {"color": GRAY, "zorder": 1} if name in others else face_style(name, close)
            label_here = name if name in close else "others" if name == others[0] else "_"
            panel.plot(
                self._caption.in_unit[1] * time,
                curves[name],
                label=label_here,
                **style | {"linewidth": 1.3 * self._large},
            )
        panel.set_ylabel(label)
        panel.yaxis.set_label_coords(-0.2, 0.5)
        panel.locator_params(nbins=4)
        if len(curves) > 1:
            panel.legend(
                loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=3, borderaxespad=0.0,
                handlelength=1.2, columnspacing=0.8,
            )  # fmt: skip
        self._moving += [*panel.lines, panel.xaxis]  # axis and legend stand still
        return panel, now

    def _span(self, time: float) -> tuple[float, float]:
        """Three forcing periods around a time, within the record; all of it without forcing."""
        first, last = float(self._traces.displacement_time[0]), float(self._traces.displacement_time[-1])
        frequency = self._caption.forcing_frequency
        if frequency is not None and last - first > _PERIODS_SHOWN / frequency:
            width = _PERIODS_SHOWN / frequency
            first = min(max(first, time - 0.5 * width), last - width)
            last = first + width
        factor = self._caption.in_unit[1]
        return factor * first, factor * last if last > first else factor * first + 1.0

    def _write(self) -> None:
        caption, text = self._caption, 16 * self._large
        self.figure.text(0.02, 0.96, caption.title, ha="left", va="center", fontsize=20 * self._large)
        self.figure.text(0.02, 0.915, caption.whole, ha="left", va="center", fontsize=text)
        self.figure.text(0.02, 0.475, caption.support, ha="left", va="center", fontsize=text)
        self.figure.text(0.98, 0.02, caption.cadence, ha="right", va="center", fontsize=0.85 * text, color="#444444")


def _hold_label(axis: Axis, renderer: Any) -> None:
    """Keep the label of an axis where it is: the labels of ticks, which frames change, are no longer asked for room."""
    axis.get_tightbbox(renderer)  # puts it there
    axis.set_label_coords(*axis.label.get_position(), transform=axis.label.get_transform())


def _paste(sheet: np.ndarray, panel: Axes, picture: np.ndarray) -> None:
    """Put a picture on its place on the sheet, to the nearest pixel."""
    height, width = picture.shape[:2]
    corner = panel.get_window_extent()
    left, top = round(corner.x0), len(sheet) - height - round(corner.y0)
    sheet[top : top + height, left : left + width, : picture.shape[2]] = picture
