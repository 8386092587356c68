"""Figures of an atlas: strobes over a parameter (bifurcation diagram), responses over two, basins over starts."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gapbeam.postprocess.figures.figure_style import BLACK, COLORS, GRAY, journal_style, panels
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.response_atlas import Atlas, single_motions
from gapbeam.studies.atlas.response_search import CHAOTIC, NEVER

OPEN = "#F0E442"  # yellow: not settled, or failed
ALONE = 0.05
"""Half width of the band of a single value, over the value."""
MANY = 300
"""Starts that are drawn as small dots."""
UNITS = {"displacement": "m", "velocity": "m/s"}


@journal_style()
def draw_responses(found: Atlas, point: str) -> Figure:
    """Draw all responses over the parameters of an atlas.

    One parameter: displacement of a point at the last periods of all starts, chaotic ones gray, and the shares below.
    Two parameters: the number of stable periodic responses, and the share of chaotic starts.

    Args:
        found: Atlas over one or two parameters.
        point: Point of the scene; of several motions with the number of one, "tip 1".

    Raises:
        UserError: The atlas has no parameter, or the name is that of no single motion.
    """
    if not found.over:
        raise UserError("draw_responses: the atlas has no parameter; draw_basins draws its starts")
    x = _strobes(found, point)
    paths, axes_of = list(found.over), list(found.over.values())
    if len(paths) == 2:
        figure, grid = panels(1, 2, height=2.6)
        counts = np.array([len(one.responses) for one in found.points]).reshape([len(a) for a in axes_of])
        chaos = np.array([one.chaotic for one in found.points]).reshape(counts.shape)
        for axes, table, label in ((grid[0][0], counts, "stable responses"), (grid[0][1], chaos, "chaotic share")):
            most = max(1, counts.max()) if table is counts else 1.0
            shown = axes.pcolormesh(axes_of[0], axes_of[1], table.T, shading="nearest", cmap="Greys", vmin=0, vmax=most)
            ticks = MaxNLocator(integer=True) if table is counts else None
            figure.colorbar(shown, ax=axes, label=label, ticks=ticks)
            axes.xaxis.set_major_locator(MaxNLocator(3))
            axes.set_xlabel(paths[0])
            axes.set_ylabel(paths[1])
        return figure
    figure, grid = panels(2, height=2.0, sharex=True)
    over, strobes = axes_of[0], grid[0][0]
    for kind, color in ((CHAOTIC, GRAY), (CHAOTIC - 1, OPEN), (0, BLACK)):
        mine = found.which >= 0 if kind == 0 else (found.which == kind)
        where = np.broadcast_to(over[:, None, None], x.shape)[mine]
        strobes.plot(where.ravel(), x[mine].ravel(), ".", color=color, ms=2.5, mew=0.0, rasterized=True)
    strobes.set_ylabel(f"{point}, each period ({unit_where('m', point in found.turning)})")
    shares = grid[1][0]
    orders = sorted({one.order for each in found.points for one in each.responses})
    base = np.zeros(len(over))
    for number, order in enumerate(orders):
        share = np.array([sum(r.share for r in one.responses if r.order == order) for one in found.points])
        _band(shares, over, base, base + share, COLORS[number % len(COLORS)], _named(order))
        base = base + share
    chaos = np.array([one.chaotic for one in found.points])
    if chaos.any():
        _band(shares, over, base, base + chaos, GRAY, "chaotic")
    shares.set_ylim(0.0, 1.0)
    shares.set_ylabel("share of starts")
    shares.set_xlabel(paths[0])
    if shares.get_legend_handles_labels()[0]:
        shares.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _named(order: int) -> str:
    return "two frequencies" if order == NEVER else f"order {order}"


def _band(axes: Axes, over: Array, low: Array, high: Array, color: str, label: str) -> None:
    if len(over) == 1:
        room = ALONE * abs(float(over[0])) or ALONE
        over, low, high = over[0] + room * np.array([-1.0, 1.0]), np.repeat(low, 2), np.repeat(high, 2)
    axes.fill_between(over, low, high, step="mid", color=color, alpha=0.8, lw=0.0, label=label)


@journal_style()
def draw_basins(found: Atlas, x: tuple[str, str], y: tuple[str, str], scene: Any, at: int = 0) -> Figure:
    """Draw the response that each start comes to.

    Args:
        found: Atlas with starts as of `gridded_starts` or `drawn_starts`.
        x: Point of the scene, of several motions "tip 1", and "displacement" or "velocity": what is drawn to the right.
        y: Point and quantity that are drawn upward.
        scene: Scene of the atlas.
        at: Number of the parameter point.

    Raises:
        UserError: A name is unknown, or that of no single motion.
    """
    if not 0 <= at < len(found.points):
        raise UserError(f"draw_basins: found parameter point {at}, expected 0 to {len(found.points) - 1}")

    def place(name: tuple[str, str]) -> Array:
        point, quantity = name
        known = single_motions({key: scene.rows_at(one) for key, one in scene.point_names.items()})
        rows = known[point][None] if point in known else scene.rows_at(scene.point(point))
        if len(rows) != 1 or quantity not in ("displacement", "velocity"):
            raise UserError(
                f"draw_basins: found {name!r}, expected a point of one motion, or one of {', '.join(known)}, and "
                "displacement or velocity"
            )
        values: Array = (rows @ (found.starts.q if quantity == "displacement" else found.starts.v))[0]
        return values

    right, up, which = place(x), place(y), found.which[at]
    one = found.points[at]
    names = [f"{_named(r.order)}, {100 * r.share:.0f} %" for r in one.responses]
    colors = [COLORS[i % len(COLORS)] for i in range(len(names))]
    figure, grid = panels(1, height=3.4, width=4.6)
    axes = grid[0][0]
    columns, lines = np.unique(right.round(12)), np.unique(up.round(12))
    kind = np.where(which >= 0, which, np.where(which == CHAOTIC, len(names), len(names) + 1))
    palette = [*colors, GRAY, OPEN]
    if len(columns) * len(lines) == len(right) and min(len(columns), len(lines)) > 1:
        table = np.zeros((len(lines), len(columns)))
        table[np.searchsorted(lines, up.round(12)), np.searchsorted(columns, right.round(12))] = kind
        axes.pcolormesh(
            columns, lines, table, shading="nearest", cmap=ListedColormap(palette), vmin=-0.5, vmax=len(palette) - 0.5,
            rasterized=True,
        )  # fmt: skip
    else:
        axes.scatter(right, up, s=4.0 if len(right) > MANY else 16.0, c=[palette[k] for k in kind], lw=0.0)
    for number, name in enumerate([*names, "chaotic", "not settled"]):
        if np.any(kind == number):
            axes.plot([], [], "s", color=palette[number], label=name)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    axes.set_xlabel(f"{x[0]}: {x[1]} at the start ({unit_where(UNITS[x[1]], x[0] in found.turning)})")
    axes.set_ylabel(f"{y[0]}: {y[1]} at the start ({unit_where(UNITS[y[1]], y[0] in found.turning)})")
    return figure


def _strobes(found: Atlas, point: str) -> Array:
    known = single_motions(
        {name: one[None] if one.ndim == 3 else np.moveaxis(one, -1, 0) for name, one in found.strobes.items()}
    )
    if point not in known:
        raise UserError(f"draw_responses: found point {point!r}, expected one of: {', '.join(known) or 'none'}")
    return known[point]
