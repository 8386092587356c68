"""Figures of a motion: orbits of probes in their room, contact forces with gap and penetration, the energy balance.

Figure of contact along a support: share of time in contact, impulse per area, largest penetration.

Faces around the beam are unrolled: x along the beam, the angle from straight down around it. Planes have curves over x.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from gapbeam.postprocess.display_units import shown, shown_along
from gapbeam.postprocess.figures.figure_style import (
    BLACK,
    BLUE,
    DOUBLE,
    GRAY,
    GREEN,
    PURPLE,
    SKY,
    VERMILION,
    face_style,
    letter,
    panels,
    spread,
)
from gapbeam.postprocess.results.columns_of_run import PointMap, RunFace, RunSupport, distinct, wall_motion_series
from gapbeam.postprocess.signals.signal import (
    display_of,
    enlarged_span,
    face_signal,
    finite_record,
    unit_of_record,
    unit_of_time,
)

BEYOND = 3.0  # an open polygon is cut off at this many times the farthest wall
MARGIN = 1.2  # or at this many times the largest motion


def room_of(met: RunFace, motion: float = 0.0) -> np.ndarray:
    """Return the outline of the region d . (r - o) <= c + p(d) that the axis of a rigid beam keeps to, (n, 2), m.

    Args:
        met: A face around the beam.
        motion: The largest distance of the axis from its place, m.

    Returns:
        The corners (y, z) in order, the first one at the end again, a row of NaN where the region is open; nothing
        where the play is negative.
    """
    angles, distances = met.walls()
    reach = max(MARGIN * motion, BEYOND * float(np.abs(distances).max()))
    room = reach * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for turn, distance in zip(np.radians(angles), distances, strict=True):
        room = _cut(room, np.array([np.sin(turn), -np.cos(turn)]), float(distance))
    if not len(room):
        return room
    closed = np.vstack([room, room[:1]])
    cut = np.isclose(np.abs(closed), reach, rtol=1.0e-9)
    open_after = np.flatnonzero(np.any(cut[:-1] & cut[1:], axis=1)) + 1
    return np.asarray(np.insert(closed, open_after, np.nan, axis=0) + np.array([met.lateral, met.offset]))


def _cut(room: np.ndarray, normal: np.ndarray, distance: float) -> np.ndarray:
    """Return the part of a convex polygon with n . r <= distance."""
    excess = room @ normal - distance
    kept = list[np.ndarray]()
    for here, there, one, other in zip(room, np.roll(room, -1, axis=0), excess, np.roll(excess, -1), strict=True):
        if one <= 0.0:
            kept.append(here)
        if one * other < 0.0:
            kept.append(here + (there - here) * (one / (one - other)))
    return np.array(kept).reshape(-1, 2)


ASIDE = 1.0e-6  # of the vertical motion; less is round-off
IN_A_ROW = 4


def moves_in_space(history: xr.Dataset) -> bool:
    """Return whether a probe moves out of the bending plane."""
    if "displacement" not in history or not history.sizes.get("probe", 0):
        return False
    if "z" not in history["component"].values:
        return False
    lateral, vertical = (np.ptp(history["displacement"].sel(component=axis).values, axis=0) for axis in "yz")
    return bool(np.any(lateral > ASIDE * vertical.max(initial=0.0)) and np.all(np.isfinite(lateral)))


def farthest(history: xr.Dataset) -> float:
    """Return the largest distance of a probe from its place across the beam, m."""
    return float(np.hypot(*(history["displacement"].sel(component=axis).values for axis in "yz")).max())


def rooms_at_probes(
    case: Mapping[str, Any], supports: Sequence[RunSupport], motion: float = 0.0
) -> dict[str, np.ndarray]:
    """Return the region that a support leaves to each probe on the axis in it, (n, 2), m, by the name of the probe.

    Args:
        case: The case as run.
        supports: Its supports.
        motion: The largest distance of a probe from its place, m: open regions are shown somewhat farther.
    """
    found = {}
    for name, place, one in _in_supports(case, supports):
        if not any(change[0] for _, change in one.faces[0].moves):  # a region that opens and closes has no one outline
            rise = one.faces[0].tilt * (place - 0.5 * (one.start + one.end))
            found[name] = room_of(one.faces[0], motion) + np.array([0.0, rise])
    return found


def shifts_at_probes(
    case: Mapping[str, Any], supports: Sequence[RunSupport], history: xr.Dataset
) -> dict[str, np.ndarray]:
    """Return the shifts of the supports around probes on the axis, (times, 2), m, by the probe's name.

    Args:
        case: The case as run.
        supports: Its supports.
        history: `Results.history`.
    """
    found, motions = dict[str, np.ndarray](), wall_motion_series(history)
    for name, _, one in _in_supports(case, supports):
        for motion, (_, up, aside) in one.faces[0].moves:
            if up or aside:
                along = motions[motion][:, None] * np.array([aside, up])
                found[name] = found.get(name, 0.0) + along
    return found


def _in_supports(case: Mapping[str, Any], supports: Sequence[RunSupport]) -> Iterator[tuple[str, float, RunSupport]]:
    """Yield the probes on the axis in supports around the beam: name, place along the beam, support."""
    for probe in case.get("probe") or ():
        place, *aside = np.atleast_1d(probe["point"])
        for one in supports:
            if one.faces[0].around and one.start <= place <= one.end and not np.any(aside):
                yield str(probe["name"]), float(place), one


def draw_orbits(
    history: xr.Dataset, start: float, rooms: Mapping[str, np.ndarray], shifts: Mapping[str, np.ndarray]
) -> Figure:
    """Draw z over y of every probe on equal scales, from the undeformed beam in the origin.

    Args:
        history: `Results.history`, with displacements in space.
        start: Time before which curves are gray, s.
        rooms: Corners of the region that the support around a probe leaves to it, m: its orbit does not leave that but
            by penetration and by the tilt of the beam.
        shifts: Displacement of the support around a probe, (times, 2), m: its orbit is that in the support.
    """
    names = [str(name) for name in history["probe"].values]
    rows = -(-len(names) // IN_A_ROW)
    columns = min(len(names), IN_A_ROW)
    figure, axes = panels(rows, columns, height=2.6 if columns < IN_A_ROW else 1.9)
    before = history["time"].values < start
    unit, factor = shown("m", farthest(history))
    for panel, name in zip(axes.flat, names, strict=False):
        path = np.stack([history["displacement"].sel(probe=name, component=axis).values for axis in "yz"], axis=1)
        y, z = factor * (path - shifts.get(name, 0.0)).T
        panel.plot(y[before], z[before], color=GRAY, lw=0.5, zorder=1)
        panel.plot(y[~before], z[~before], color=BLACK, lw=0.6, zorder=2)
        if len(rooms.get(name, ())):
            y, z = factor * rooms[name].T
            panel.plot(y, z, color=VERMILION, lw=0.8, ls="--", zorder=3)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(f"{name}, in its support" if name in shifts else name, loc="right", fontsize="medium", pad=3.0)
        panel.set_xlabel(f"y ({unit})")
    for panel in axes.flat[len(names) :]:
        panel.set_visible(False)
    for row in axes:
        row[0].set_ylabel(f"z ({unit})")
    letter(list(axes.flat[: len(names)]))
    return figure


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
    records = "contact_force", "penetration"
    forces, depths = ([face_signal(history, record, face) for face in faces] for record in records)
    start, stop = enlarged_span(time, np.sum([one.values for one in forces], axis=0), forcing_frequency, zoom)
    (unit, in_unit), (clock, in_record) = unit_of_time((start, stop)), unit_of_record(time)
    labels, factors = zip(display_of(forces), display_of(depths, -1), display_of(depths, 1), strict=True)
    figure, axes = panels(3, 2, height=1.35, sharey="row", sharex="col", width_ratios=[1.5, 1.0])
    for face, force, deep in zip(faces, forces, depths, strict=True):
        depth, style = deep.values, face_style(face, faces)
        rows = (force.values, np.maximum(-depth, 0.0), np.maximum(depth, 0.0))
        for record, factor, (whole, end) in zip(rows, factors, axes, strict=True):
            values = factor * record
            whole.plot(in_record * time, values, **{**style, "linewidth": 0.5, "linestyle": "-"})
            keep = (time >= start) & (time <= stop)
            end.plot(in_unit * time[keep], values[keep], label=face, **style)
    for name, label, (whole, _) in zip(("contact force", "smallest gap", "penetration"), labels, axes, strict=True):
        whole.set_ylabel(f"{name} ({label})")
        whole.axvspan(in_record * start, in_record * stop, color=GRAY, alpha=0.25, lw=0)
        low, high = whole.get_ylim()
        whole.set_ylim(low if whole.dataLim.y0 < 0.0 else 0.0, max(high, 1e-6))  # contacts that adhere pull
    axes[0][1].legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, borderaxespad=0.0, columnspacing=1.2)
    axes[-1][0].set_xlabel(f"time ({clock})")
    axes[-1][1].set_xlabel(f"time ({unit})")
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
    stored = [(finite_record(history, name), label, color, line) for name, label, color, line in _STORED]
    total = np.sum([values for values, *_ in stored], axis=0)
    start, stop = enlarged_span(time, total, forcing_frequency, zoom)
    figure = Figure(figsize=(DOUBLE, 4.9))
    axes = figure.subplot_mosaic(
        [["whole", "end"], ["ledger", "ledger"], ["residual", "residual"]],
        width_ratios=[1.5, 1.0], height_ratios=[1.1, 1.2, 0.8],
    )  # fmt: skip
    spread(figure)
    marker: dict[str, Any] = {"marker": "o", "ms": 4} if time.size == 1 else {}
    _stored(axes["whole"], axes["end"], time, (start, stop), marker, stored, total)
    _balance(axes["ledger"], history, time, marker)
    residual, (clock, in_record) = finite_record(history, "energy_residual"), unit_of_record(time)
    unit, factor = shown("J", np.abs(residual).max(initial=0.0))
    axes["residual"].plot(in_record * time, factor * residual, color=BLACK, lw=0.8, **marker)
    axes["residual"].axhline(0.0, color=GRAY, lw=0.5, zorder=0)
    axes["residual"].set_ylabel(f"residual ({unit})")
    axes["residual"].set_xlabel(f"time ({clock})")
    figure.legend(*axes["end"].get_legend_handles_labels(), loc="outside upper right", ncols=5)
    figure.align_ylabels([axes[name] for name in ("whole", "ledger", "residual")])
    letter([axes[name] for name in ("whole", "end", "ledger", "residual")])
    return figure


_Curve = tuple[np.ndarray, str, str, str]  # values, label, color and style


def _stored(
    whole: Axes, end: Axes, time: np.ndarray, span: tuple[float, float], marker: dict[str, Any],
    stored: Sequence[_Curve], total: np.ndarray,
) -> None:  # fmt: skip
    (unit, in_unit), (clock, in_record) = unit_of_time(span), unit_of_record(time)
    keep = (time >= span[0]) & (time <= span[1])
    joule, factor = shown("J", total.max(initial=0.0))
    for values, label, color, line in stored:
        if values.max() > _SMALL * total.max():
            end.plot(in_unit * time[keep], factor * values[keep], color=color, ls=line, label=label, **marker)
    whole.plot(in_record * time, factor * total, color=BLACK, lw=0.7, **marker)
    end.plot(in_unit * time[keep], factor * total[keep], color=BLACK, lw=0.8, label="sum", zorder=1, **marker)
    whole.axvspan(*(in_record * np.array(span)), color=GRAY, alpha=0.25, lw=0)
    whole.set_ylabel(f"stored energy ({joule})")
    whole.set_xlabel(f"time ({clock})")
    end.set_xlabel(f"time ({unit})")


def _balance(panel: Axes, history: xr.Dataset, time: np.ndarray, marker: dict[str, Any]) -> None:
    curves: list[_Curve] = []
    if "load_work" in history:
        work = finite_record(history, "load_work")
        for index, load in enumerate(str(name) for name in history["load"].values):
            curves.append((work[:, index], f"work of {load}", *_LOADS[index % len(_LOADS)]))
    rubs = _FRICTION[0] in history and bool(np.any(history[_FRICTION[0]].values))
    losses = (*_LOST, _FRICTION) if rubs else _LOST
    curves += [(finite_record(history, name), label, color, line) for name, label, color, line in losses]
    unit, factor = shown("J", max(float(np.abs(values).max(initial=0.0)) for values, *_ in curves))
    in_record = unit_of_record(time)[1]
    for values, label, color, line in curves:
        panel.plot(in_record * time, factor * values, color=color, ls=line, label=label, **marker)
    panel.set_ylabel(f"work, loss ({unit})")
    panel.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 0.98),
        ncols=6,
        borderaxespad=0.0,
        columnspacing=1.0,
        handletextpad=0.5,
    )


_HEIGHT = 2.3  # inches of a row
_WIDEST = 45.0  # degrees between neighbors: walls farther apart have a mark each, no cells
_DEPTH = 2  # the number of the panel of penetrations
_ANGLES = (-180.0, -90.0, 0.0, 90.0, 180.0)


class _Quantity(NamedTuple):
    """Quantity of a panel: its label, and its values at the points, never negative."""

    label: str
    values: np.ndarray


def draw_contact_map(points: Mapping[str, PointMap]) -> Figure:
    """Draw a row of three panels for each face around the beam, and one for all planes together.

    Args:
        points: Points of the faces of one support, by name, at least one; see
            `gapbeam.postprocess.results.columns_of_run.points_of`.
    """
    around = {face: one for face, one in points.items() if one.around}
    planes = {face: one for face, one in points.items() if not one.around}
    figure, grid = panels(len(around) + bool(planes), 3, width=DOUBLE, height=_HEIGHT)
    along = shown_along([one.x for one in points.values()])
    deep = shown("m", max(float(np.nanmax(one.deepest, initial=0.0)) for one in points.values()))
    for row, (face, one) in zip(grid, around.items(), strict=False):
        for panel, quantity in zip(row, _quantities(one, deep), strict=True):
            _draw_around(figure, panel, one, quantity, along)
        row[0].set_ylabel("angle from straight down (°)")
        row[0].set_title(face)
    if planes:
        for number, panel in enumerate(grid[-1]):
            _draw_planes(panel, planes, number, along, deep)
        grid[-1][0].legend()
    letter([panel for row in grid for panel in row])
    return figure


def _quantities(one: PointMap, deep: tuple[str, float]) -> tuple[_Quantity, ...]:
    unit, factor = deep
    return (
        _Quantity("contact share (%)", 100.0 * one.share),
        _Quantity("impulse per area (N s/m$^2$)", one.pressed),
        _Quantity(f"largest penetration ({unit})", factor * np.maximum(one.deepest, 0.0)),
    )


def _draw_around(
    figure: Figure, panel: Axes, one: PointMap, quantity: _Quantity, along: tuple[str, float]
) -> None:  # fmt: skip
    values = quantity.values
    known = values[np.isfinite(values)]
    largest = float(known.max(initial=0.0)) or 1.0
    colors, scale = "viridis", Normalize(0.0, largest)
    cells = _cells(one, values, along[1])
    if cells is None:
        panel.scatter(along[1] * one.x, one.angle, c=values, s=9.0, marker="s", cmap=colors, norm=scale)
        panel.margins(x=0.1)
    else:
        panel.pcolormesh(*cells, cmap=colors, norm=scale)
    panel.set_ylim(-180.0, 180.0)
    panel.set_yticks(_ANGLES)
    panel.set_xlabel(f"x ({along[0]})")
    if not known.size:
        panel.text(0.5, 0.5, "not known", transform=panel.transAxes, ha="center", va="center", color=GRAY)
    figure.colorbar(ScalarMappable(scale, colors), ax=panel, label=quantity.label, location="top")


def _cells(one: PointMap, values: np.ndarray, factor: float) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return edges along x, times a factor, and around, degrees, and the values between; None: the points fill no grid.

    The first row around is drawn again behind the last one, and the last one before the first, which closes the circle.
    """
    (x, columns), (angles, rows) = distinct(one.x), distinct(one.angle)
    turns = np.concatenate([angles[-1:] - 360.0, angles, angles[:1] + 360.0])
    grid = np.full((len(angles), len(x)), np.nan)
    grid[rows, columns] = values
    whole = len(values) == grid.size == len(np.unique(rows * len(x) + columns))
    if not whole or np.diff(turns).max() > _WIDEST:
        return None
    around = np.concatenate([turns[:1], _between(turns), turns[-1:]])
    half = 0.5 * float(np.sqrt(one.area.mean()))  # a face whose points all have one place is drawn as a row of squares
    ends = np.array([x[0] - half, x[0] + half]) if len(x) == 1 else 1.5 * x[[0, -1]] - 0.5 * x[[1, -2]]
    along = np.concatenate([ends[:1], _between(x), ends[1:]])
    return factor * along, around, np.concatenate([grid[-1:], grid, grid[:1]])


def _between(places: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (places[1:] + places[:-1]))


def _draw_planes(
    panel: Axes, planes: Mapping[str, PointMap], number: int, along: tuple[str, float], deep: tuple[str, float]
) -> None:
    """Draw curves over x: means over the width by area, of penetrations the largest."""
    for face, one in planes.items():
        label, values = _quantities(one, deep)[number]
        x, owners = distinct(one.x)
        across = np.bincount(owners, values * one.area) / np.bincount(owners, one.area)
        if number == _DEPTH:
            across = np.array([values[owners == place].max() for place in range(len(x))])
        panel.plot(along[1] * x, across, marker=".", markersize=3.0, label=face, **face_style(face, list(planes)))
        panel.set_ylabel(label)
    panel.set_xlabel(f"x ({along[0]})")
    panel.set_ylim(bottom=0.0)
    panel.margins(x=0.02)
