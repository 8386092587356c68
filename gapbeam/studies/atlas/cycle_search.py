"""All limit cycles and rests that drawn starts of a scene come to, where no load varies.

Starts are mixtures of the fastest growing oscillation of the scene with all contacts idle and of its slowest ones, as
large as those that first touch a contact, times drawn factors. They march in lock-step. A start has come to rest where
its motion is 1e-6 of the largest start, and to a cycle where its state is within 1 % of the line through the states of
the cycle, over its size: where in a step a contact closes moves a cycle by some tenths of a percent. Cycles are shot
from motions that nearly repeat; what is left may have two frequencies.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from gapbeam.postprocess.figures.figure_style import BLACK, GRAY, journal_style, panels
from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.scene.flow_margin import state_matrix
from gapbeam.solver.scene.lane_ensemble import ensemble
from gapbeam.solver.scene.limit_cycle import (
    LOOKED,
    VANISHED,
    LimitCycle,
    check_autonomous,
    limit_cycle,
    repetition,
    state_of,
    touching,
)
from gapbeam.solver.scene.linear_scheme import MIDPOINT
from gapbeam.solver.scene.linear_scheme import rest as touched
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.schema.record_table import unit_of_places
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.response_atlas import Atlas, AtlasPoint, Response, share_of
from gapbeam.studies.atlas.response_search import BATCHES, CHAOTIC, FAILED, NEVER, UNSETTLED, StrobeMap, growth
from gapbeam.studies.atlas.two_frequencies import TwoFrequencies, two_frequencies

MIXED, LOST = 4, 0.1  # oscillations in a start, and the frequency over decay below which a motion is none
NEAR = 1e-2  # distance from a cycle over its size at which a start has come to it, and two cycles are one
REPEATED = 0.1  # difference of a motion from itself a lag earlier, over its size, up to which it nearly repeats
RECORDED, SAMPLED = 128, 20  # periods of a record in which two frequencies are looked for, and its samples in one
TRIES = 3  # starts in a row from which shooting comes to nothing, after which the others march on


class CycleSearch:
    """Starts of one scene, and the cycles that they came to; arguments are of `cycle_atlas`."""

    def __init__(
        self, scene: Scene, rest: SceneState, starts: int, reach: float, seed: int, steps: int, settle: int
    ) -> None:
        self.scene, self.rest, self.steps, self.settle = scene, rest, steps, settle
        self.values, vectors = np.linalg.eig(state_matrix(scene))
        self.start, period = self.draw(vectors, starts, reach, seed)
        check_autonomous(scene, rest.t, period, "atlas: ")
        self.strobe = StrobeMap(scene, {}, np.array([period]), steps, MIDPOINT, rest.t)
        self.still, self.X = rest.x, self.start.x.copy()
        self.floor = VANISHED * float(self.strobe.size(self.X - self.still).max())
        self.which, self.tried = np.full(starts, UNSETTLED), np.zeros(starts, dtype=int)
        held = touched(scene.slabs(), scene.places(rest.q, rest.t))[0]
        self.rests = bool(self.values.real.max() < 0.0 or np.any(held))
        self.found: list[tuple[LimitCycle | TwoFrequencies | None, Array]] = []
        self.exponent = float("nan")

    def draw(self, vectors: Any, count: int, reach: float, seed: int) -> tuple[SceneState, float]:
        """Return drawn starts, and the period of the fastest growing oscillation, s; see the module."""
        if not reach > 0.0:
            raise UserError(f"found a reach of {reach:g}, expected one above 0")
        draw, mixed, periods = np.random.default_rng(seed), list[Any](), list[float]()
        values, rest = self.values, self.rest
        swings = [int(k) for k in np.flatnonzero(values.imag > LOST * np.abs(values.real))]
        fastest = max(swings, key=lambda k: values[k].real, default=None)
        for k in sorted(swings, key=lambda k: (k != fastest, values[k].imag)):
            motion = touching(self.scene, rest, vectors[:, k]) if len(mixed) < MIXED else None
            if motion is not None:
                mixed.append(motion)
                periods.append(2.0 * pi / float(values[k].imag))
        if not mixed:
            raise UserError(
                "atlas: no oscillation of the scene touches a contact, so that nothing limits one that grows"
            )
        turns = np.exp(2j * pi * draw.random((len(mixed), count)))
        shares = draw.standard_normal((len(mixed), count))
        shares *= reach * draw.random(count) / np.linalg.norm(shares, axis=0)
        x = rest.x + np.real(np.column_stack(mixed) @ (shares * turns))
        return state_of(self.scene, x, rest.t), periods[0]

    def run(self, rounds: int) -> None:
        """March starts, shoot from those that come to nothing known, and judge the rest by exponents."""
        for _ in range(rounds):
            left = np.flatnonzero(self.which == UNSETTLED)
            if not len(left):
                return
            changed, period = self.march(left)
            self.which[left[~np.isfinite(self.X[:, left]).all(axis=0)]] = FAILED
            self.assign()
            vain = 0
            for k in np.lexsort((changed, self.tried[left])):
                i = int(left[k])
                if self.which[i] == UNSETTLED and changed[k] <= REPEATED and vain < TRIES:
                    self.tried[i] += 1
                    vain = 0 if self.shoot(i, float(period[k])) else vain + 1
        left = np.flatnonzero(self.which == UNSETTLED)
        if len(left):
            none, periods = np.zeros(len(left), dtype=int), max(self.settle, 2 * BATCHES)
            mean, error, _ = growth(self.strobe, none, self.X[:, left], periods)
            chaotic = mean > 3.0 * error
            self.which[left[chaotic]] = CHAOTIC
            self.exponent = float(mean[chaotic].mean()) if chaotic.any() else self.exponent
            calm = ~chaotic & np.isfinite(mean)
            if calm.any():
                self.find_two_frequencies(left[calm], mean[calm])

    def find_two_frequencies(self, left: Any, exponent: Any) -> None:
        """Give starts whose motion has two frequencies, and these exponents, 1/s, to such motions."""
        T = self.strobe.period
        part = max(k for k in range(1, SAMPLED + 1) if self.steps % k == 0)
        finer = replace(self.strobe, period=T / part, steps=self.steps // part)
        _, record = finer.record(np.zeros(len(left), dtype=int), self.X[:, left], RECORDED * part)
        for k, i in enumerate(left):
            size = float(np.sqrt(record[..., k].var(axis=0).sum()))
            lines = two_frequencies(record[..., k], size, driven=False)
            if lines is None:
                continue
            lines = lines._replace(frequencies=tuple(part / float(T[0]) * f for f in lines.frequencies))
            known = ((number, one) for number, (one, _) in enumerate(self.found) if isinstance(one, TwoFrequencies))
            self.which[i] = lines.number_among(known, 1.0 / (RECORDED * float(T[0])), len(self.found))
            if self.which[i] == len(self.found):
                self.found.append((lines, np.exp(exponent[k] * T)))

    def march(self, members: Any) -> tuple[Any, Any]:
        """March starts; return the distance of their motions from repeating, and the periods after which they do, s."""
        strobe, T = self.strobe, float(self.strobe.period[0])
        many = strobe.march(
            np.zeros(len(members), dtype=int), self.X[:, members], self.settle + LOOKED,
            settle=strobe.t + self.settle * T, every=1,
        )  # fmt: skip
        self.X[:, members] = np.vstack([many.q, many.v, many.z])
        seen = [one.reshape(len(one), -1, len(members)) for one in many.displacement.values()]
        changed, lag = repetition(np.concatenate(seen, axis=1), self.steps)
        return changed, lag * T / self.steps

    def assign(self) -> None:
        """Give starts to the rest and to the cycles that they have come to."""
        left = np.flatnonzero(self.which == UNSETTLED)
        calm = left[self.strobe.size(self.X[:, left] - self.still) <= self.floor] if self.rests else left[:0]
        if len(calm):
            number = next((k for k, (one, _) in enumerate(self.found) if one is None), len(self.found))
            if number == len(self.found):
                self.found.append((None, self.still))
            self.which[calm] = number
        for number, (one, states) in enumerate(self.found):
            left = np.flatnonzero(self.which == UNSETTLED)
            if isinstance(one, LimitCycle) and len(left):
                self.which[left[self.apart(self.X[:, left], states) <= NEAR]] = number

    def apart(self, X: Any, states: Array) -> Any:
        """Return the distance of states X, (2 n + states, k), to the line through those of a cycle, over its size."""
        strobe, n = self.strobe, self.scene.size
        keep = np.concatenate([np.sqrt(strobe.weight)[strobe.resolved], np.ones(int(strobe.resolved.sum()))])[:, None]
        mine = np.flatnonzero(np.concatenate([strobe.resolved, strobe.resolved]))
        x, line = keep * X[mine], keep * states[mine]
        way = np.roll(line, -1, axis=1) - line
        squares = np.maximum((way**2).sum(axis=0), np.finfo(float).tiny)
        size = float(np.linalg.norm(line - keep * self.still[: 2 * n][mine], axis=0).max())
        found = np.empty(x.shape[1])
        for k, one in enumerate(x.T[:, :, None]):
            part = np.clip(((one - line) * way).sum(axis=0) / squares, 0.0, 1.0)
            found[k] = np.linalg.norm(one - line - part * way, axis=0).min() / size
        return found

    def stable(self, steps: int, start: SceneState, period: float) -> LimitCycle | None:
        """Return the stable cycle that shooting from a start comes to; None where it comes to none."""
        try:
            found = limit_cycle(self.scene, steps, start, period, cycles=self.settle)
        except (NotConverged, UserError):
            return None
        return found if found.is_stable else None

    def shoot(self, i: int, period: float) -> bool:
        """Look for a stable cycle from a start, given its period, s; return whether there is one."""
        steps = round(period * self.steps / float(self.strobe.period[0]))  # as long as those of the starts
        cycle = self.stable(steps, state_of(self.scene, self.X[:, i : i + 1].copy(), self.strobe.t), period)
        if cycle is None or not cycle.is_decided:
            return False
        marcher, states = Marcher(self.scene, cycle.period / cycle.steps, cycle.state), list[Array]()
        for _ in range(cycle.steps):
            marcher.advance(1)
            states.append(marcher.state.x[:, 0])
        known = (k for k, (one, line) in enumerate(self.found)
                 if isinstance(one, LimitCycle) and self.apart(states[0][:, None], line)[0] <= NEAR)  # fmt: skip
        self.which[i] = next(known, len(self.found))
        if self.which[i] == len(self.found):
            finer = self.stable(self.steps, cycle.state, cycle.period)
            near = finer is not None and abs(finer.period - cycle.period) <= NEAR * cycle.period
            self.found.append((finer if near else cycle, np.column_stack(states)))
            self.assign()
        return True

    def point(self, values: dict[str, float]) -> tuple[AtlasPoint, Any]:
        """Return everything that was found, and the response of each start."""
        count, named = len(self.which), list[Response]()
        first = float(self.strobe.period[0])
        calm = max([first, *(one.delay for one in self.scene.feedbacks)])  # a march is as long as a delay, or longer
        ranked = np.argsort([-np.sum(self.which == k) for k in range(len(self.found))], kind="stable")
        for k in ranked:
            motion, grown = self.found[k]
            mine = np.flatnonzero(self.which == k)
            share, interval = share_of(len(mine), count)
            order, state, span, steps, per = 0, self.rest, calm, self.steps, 1
            multipliers, period, frequencies = np.exp(self.values * first), float("nan"), tuple[float, ...]()
            if isinstance(motion, LimitCycle):
                order, state, span, steps = 1, motion.state, motion.period, motion.steps
                multipliers, period = motion.multipliers, motion.period
            elif motion is not None:
                order, state, per = NEVER, state_of(self.scene, self.X[:, mine[:1]], self.strobe.t), RECORDED
                span, steps, multipliers, frequencies = per * first, per * self.steps, grown, motion.frequencies
            once = ensemble(
                self.scene, step=span / steps, end=state.t + span, start=state, members=1, period=np.array([span])
            )
            named.append(
                Response(
                    order, state, np.vstack([state.q, state.v]).T, multipliers, len(mine), share, interval,
                    {name: np.linalg.norm(np.atleast_1d(one[..., 0])) for name, one in once.peak.items()},
                    {name: float(one[0]) / per for name, one in once.impacts.items()},
                    {name: float(one[0]) for name, one in once.peak_force.items()}, period, frequencies=frequencies,
                )
            )  # fmt: skip
        shares = [float(np.mean(self.which == kind)) for kind in (CHAOTIC, UNSETTLED, FAILED)]
        rank = np.concatenate([np.argsort(ranked), [FAILED, UNSETTLED, CHAOTIC]]).astype(int)
        return AtlasPoint(values, float("nan"), named, shares[0], self.exponent, *shares[1:]), rank[self.which]


def cycle_atlas(
    scene: Scene, rest: SceneState, starts: int, reach: float, seed: int, steps: int, settle: int, rounds: int
) -> Atlas:  # fmt: skip
    """Find the limit cycles and rests that drawn starts come to.

    Args:
        scene: Scene without loads that vary.
        rest: State at rest.
        starts: Number of starts.
        reach: Largest start over the motion that first touches a contact.
        seed: Seed of the draws.
        steps: Steps in a period of the fastest growing oscillation.
        settle: Periods of a march; `rounds` of these at most.
        rounds: See settle.

    Raises:
        UserError: A load or wall varies, a contact remembers, or no oscillation touches a contact.
    """
    scene.refuse_memory("atlas")
    search = CycleSearch(scene, rest, starts, reach, seed, steps, settle)
    search.run(rounds)
    point, which = search.point({})
    return Atlas({}, [point], which[None], search.start, {})


@journal_style()
def draw_cycles(points: Sequence[AtlasPoint], over: dict[str, Array], turning: Collection[str] = ()) -> Figure:
    """Draw the peak force of each cycle or motion of two frequencies, and shares of starts, over the first key."""
    path = next(iter(over), "")
    figure, grid = panels(2, height=2.0, sharex=True)
    for number, one in enumerate(points):
        x = one.values.get(path, float(number))
        for r in one.responses:
            color, mark = GRAY if r.order == 0 else BLACK, "s" if r.frequencies else "o"
            grid[0][0].plot(x, max(r.peak_force.values(), default=0.0), mark, color=color, ms=3.0)
            grid[1][0].plot(x, r.share, mark, color=color, ms=3.0)
        others = one.chaotic + one.unsettled + one.failed
        if others > 0.0:
            grid[1][0].plot(x, others, "o", color=BLACK, ms=4.0, mfc="none")
    pressed = dict.fromkeys(name for one in points for r in one.responses for name in r.peak_force)
    grid[0][0].set_ylabel(f"largest force ({unit_of_places('N', pressed, turning)})")
    grid[1][0].set_ylabel("share (gray: rest, square: two frequencies, open: others)")
    for row in grid:
        row[0].margins(0.05, 0.1)
    grid[1][0].set_xlabel(path)
    return figure
