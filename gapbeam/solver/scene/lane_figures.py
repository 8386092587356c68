"""Figures of one's own of the members of an ensemble, gathered block by block as they march: no history is kept.

Between steps a quantity is a straight line, and figures are those of the history of a run with a record at every step:
sums of h (a + b) / 2, h (a^2 + a b + b^2) / 3 and h p, the part above a limit, and the largest and smallest values. The
square is taken of the change since the start, so that little is lost beside a large mean.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import inf

import numpy as np

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.figure_value import part_above
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.system.operators import Array

MOTIONS = ("displacement", "velocity")
FORCE = "contact_force"
KEPT_BY_HISTORIES = ("quantile", "probability")
"""Statistics that need the whole history."""
TIMED = ("value", "time-of-maximum", "time-of-minimum")


def lane_figure_faults(scene: Scene, figures: Sequence[Figure]) -> Iterator[tuple[Figure, str]]:
    """Yield figures that cannot be gathered in lock-step, with why and what to try."""
    pairs = zip(scene.contact_names, scene.contacts, strict=True)
    signed = {name for name, one in pairs if one.is_rough or one.law.kind.adhesive}
    for one in figures:
        if one.quantity not in (*MOTIONS, FORCE):
            yield one, f"quantity = {one.quantity!r}; expected {', '.join(MOTIONS)} or {FORCE}; or run one member"
        elif one.statistic in KEPT_BY_HISTORIES:
            yield one, f"statistic = {one.statistic!r}, which needs a history; expected another, or run one member"
        elif one.quantity == FORCE and any(name == one.place for name in _labels_of(scene, one, signed)):
            yield one, "a contact with friction, or that pulls; expected one that presses, or run one member"
        else:
            try:
                _series(scene, one, np.zeros((1, scene.watched, 1)), np.zeros((1, len(scene.contacts), 1)))
            except UserError as error:
                yield one, str(error).removeprefix(f"figure {one.name}: ")


def response_figure_faults(scene: Scene, figures: Sequence[Figure]) -> Iterator[tuple[Figure, str]]:
    """Yield figures that responses cannot have, with why: those of `lane_figure_faults`, and those at a time."""
    for one in figures:
        if one.statistic in TIMED or one.start > 0.0 or one.end is not None:
            yield one, "it has a time, and figures of a response are over whole periods; expected none; or try a sweep"
        else:
            yield from lane_figure_faults(scene, [one])


def _labels_of(scene: Scene, figure: Figure, names: Iterable[str]) -> list[str]:
    """Return names of contacts; "gland 1", "gland 2", ... are those of "gland" where a figure is of that face."""
    if figure.place in scene.contact_names:
        return list(names)
    return [f"{figure.place}" if name.rstrip("0123456789") == f"{figure.place} " else name for name in names]


def _series(scene: Scene, figure: Figure, moved: Array, sizes: Array) -> Array:
    """Return the quantity of a figure, (steps, lanes), from motions of points and sizes of forces."""
    given = sizes if figure.quantity == FORCE else moved
    steps, _, lanes = given.shape
    flat = given.transpose(0, 2, 1).reshape(steps * lanes, -1)
    if figure.quantity == FORCE:
        found = figure.series({FORCE: flat}, {"face": _labels_of(scene, figure, scene.contact_names)})
    else:
        records = {figure.quantity: flat.reshape(steps * lanes, len(scene.probe_names), scene.probe_width)}
        labels = {"probe": scene.probe_names, "component": ("y", "z")[: scene.probe_width]}
        found = figure.series(records, labels)
    return np.asarray(found.reshape(steps, lanes))


class LaneFigures:
    """Figures of the lanes of one march.

    Args:
        scene: The scene.
        figures: That `lane_figure_faults` has nothing against.
        lanes: Members side by side.
    """

    def __init__(self, scene: Scene, figures: Sequence[Figure], lanes: int) -> None:
        self.scene, self.t = scene, 0.0
        self.parts = [_Gathered(one, lanes) for one in figures]
        self.before: list[Array] = []

    @property
    def needs_speeds(self) -> bool:
        """True where a figure is of a velocity."""
        return any(one.figure.quantity == "velocity" for one in self.parts)

    def begin(self, t: float, seen: Array, speeds: Array, sizes: Array) -> None:
        """Begin at a time, s, with displacements and velocities (watched, lanes), and forces (contacts, lanes)."""
        self.t = t
        self.before = [one[0] for one in self._all(seen[None], speeds[None], sizes[None])]

    def add(self, h: float, seen: Array, speeds: Array, sizes: Array) -> None:
        """Take in a block of steps of h: (steps, watched, lanes) twice, (steps, contacts, lanes)."""
        times = self.t + h * np.arange(len(seen) + 1)
        for place, (one, x) in enumerate(zip(self.parts, self._all(seen, speeds, sizes), strict=True)):
            one.add(times, np.concatenate([self.before[place][None], x]))
            self.before[place] = x[-1].copy()
        self.t = float(times[-1])

    def values(self) -> dict[str, Array]:
        """Return the figures by name, (lanes,); NaN where the march ended before them."""
        return {one.figure.name: one.value() for one in self.parts}

    def _all(self, seen: Array, speeds: Array, sizes: Array) -> list[Array]:
        return [
            _series(self.scene, one.figure, speeds if one.figure.quantity == "velocity" else seen, sizes)
            for one in self.parts
        ]


class _Gathered:
    """Sums and extremes of one figure so far, (lanes,) each."""

    def __init__(self, figure: Figure, lanes: int) -> None:
        self.figure, self.span, self.reached = figure, 0.0, -inf
        self.high, self.low = np.full(lanes, -inf), np.full(lanes, inf)
        self.high_at, self.low_at = np.zeros(lanes), np.zeros(lanes)
        self.first: Array | None = None
        self.last, self.area, self.square, self.above = (np.zeros(lanes) for _ in range(4))

    def add(self, t: Array, x: Array) -> None:
        """Take in values (n, lanes) at times (n,), of which the first are known already."""
        one = self.figure
        until = inf if one.last is None else one.last
        low = max(until if one.statistic == "value" else one.start, float(t[0]))
        high = min(until, float(t[-1]))
        if low > high:
            return
        inside = (t > low) & (t < high)
        t, x = np.array([low, *t[inside], high]), np.vstack([_at(low, t, x), x[inside], _at(high, t, x)])
        h, lanes = np.diff(t), np.arange(x.shape[1])
        for sign, best, at in ((1.0, self.high, self.high_at), (-1.0, self.low, self.low_at)):
            place = np.argmax(sign * x, axis=0)
            better = sign * x[place, lanes] > sign * best
            best[better], at[better] = x[place, lanes][better], t[place][better]
        self.first = x[0].copy() if self.first is None else self.first
        a, b = x[:-1] - self.first, x[1:] - self.first
        self.area += h @ (0.5 * (a + b))
        self.square += h @ (a * a + a * b + b * b) / 3.0
        if one.statistic == "share":
            self.above += h @ part_above(x, one.limit or 0.0)
        self.span, self.reached, self.last = self.span + float(h.sum()), high, x[-1].copy()

    def value(self) -> Array:
        """Return the figure, (lanes,)."""
        one = self.figure
        if self.first is None or (one.last is not None and self.reached < one.last * (1.0 - 1e-9)):
            return np.full(len(self.last), np.nan)
        span, point = self.span, self.span == 0.0
        mean = np.asarray(self.last if point else self.first + self.area / span)
        match one.statistic:
            case "value":
                return self.last
            case "maximum" | "minimum":
                return self.high if one.statistic == "maximum" else self.low
            case "time-of-maximum" | "time-of-minimum":
                return self.high_at if one.statistic == "time-of-maximum" else self.low_at
            case "peak-to-peak":
                return np.asarray(self.high - self.low)
            case "mean":
                return mean
            case "rms":
                spread = self.square * 0.0 if point else self.square / span - (mean - self.first) ** 2
                return np.asarray(np.sqrt(np.maximum(spread, 0.0)))
            case _:
                limit = one.limit or 0.0
                return np.asarray(np.where(self.last > limit, 1.0, 0.0) if point else self.above / span)


def _at(time: float, t: Array, x: Array) -> Array:
    """Return values (n, lanes) at a time between the times (n,), on straight lines, (lanes,)."""
    place = min(max(int(np.searchsorted(t, time)), 1), len(t) - 1)
    part = (time - t[place - 1]) / (t[place] - t[place - 1])
    return np.asarray((1.0 - part) * x[place - 1] + part * x[place])
