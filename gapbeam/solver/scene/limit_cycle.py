"""Limit cycles and periodic responses of scenes, by shooting; the period of a limit cycle is an unknown.

    P(x, T) = x,     f . (x - x_0) = 0,     f = dP/dT,

where P is the march over one period in a fixed number of steps: the step is T / steps, and f points along the cycle.
Multipliers are those of the map of the section across f onto itself, (1 - f f^T) dP/dx for a unit f. Disturbed members
of one ensemble give dP/dx. The period of a response to loads is known.

Source: Parker and Chua (1989), Practical Numerical Algorithms for Chaotic Systems, sec. 5.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any, NamedTuple

import numpy as np

from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.feedback import aligned
from gapbeam.solver.scene.flow_margin import state_matrix
from gapbeam.solver.scene.lane_ensemble import ensemble
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme, rest
from gapbeam.solver.scene.marcher import Marcher
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.unresolved_modes import resolved_multipliers, unresolved_decay

TOLERANCE = 1e-10
SHIFT = 1e-6
FEWEST = 3
"""Steps in a period below which a load is not seen: two see its zeros alone."""
REPEATS = 1e-6  # of the largest value of a load: what may differ a period later


@dataclass(frozen=True, eq=False)
class PeriodicOrbit:
    """A response that repeats after a period.

    Attributes:
        state: State at the start of a period: a march from it repeats.
        multipliers: Multipliers of small disturbances over a period, (2 n + states,), complex; 0 for motions that
            nothing opposes, see `free_motions`; of modes that steps do not resolve see `multipliers_of`.
        residual: Change over a period, over the size of the motion.
        passes: Passes of Newton's method.
    """

    __repr__ = result_words

    state: SceneState
    multipliers: Any
    residual: float
    passes: int

    @property
    def is_stable(self) -> bool:
        """True where all disturbances decay but those of motions that nothing opposes."""
        return bool(np.abs(self.multipliers).max() < 1.0)


def check_period(scene: Scene, t: float, period: float, steps: int) -> None:
    """Refuse loads and walls that do not repeat from a time on, and steps that do not see them.

    Raises:
        UserError: The period is not above 0, has fewer than three steps, or a load or a wall does not repeat after it.
    """
    if not (np.isfinite(period) and period > 0.0) or steps < FEWEST:
        raise UserError(f"found a period of {period:.6g} s in {steps} steps, expected one above 0 in {FEWEST} or more")
    times = t + period * np.linspace(0.013, 0.987, 23)
    for load in scene.loads:
        here, later = load.table(times), load.table(times + period)
        if np.abs(later - here).max() > REPEATS * np.abs(here).max():
            raise UserError(f"load {load.name or '?'} does not repeat after {period:.6g} s; see the period")
    here, later = scene.walls(times), scene.walls(times + period)
    if np.abs(later - here).max(initial=0.0) > REPEATS * np.abs(here).max(initial=0.0):
        raise UserError(f"the wall of a contact does not repeat after {period:.6g} s; see the period")


@checked
def periodic(
    scene: Scene, period: float, steps: int, start: SceneState | None = None, passes: int = 30,
    scheme: LinearScheme = MIDPOINT,
) -> PeriodicOrbit:  # fmt: skip
    """Return a response that repeats after a period, from a start that is near it.

    Newton's method solves P(x) = x; members are disturbed by 1e-6 of the size of the motion.

    Args:
        scene: Its loads repeat after the period.
        period: s.
        steps: Steps in a period.
        start: State to start from; default at rest. March some periods first where that is far away.
        passes: Largest number of passes of Newton's method.
        scheme: Scheme of the time integration; without accelerations as states.

    Raises:
        UserError: The period, steps or scheme cannot be.
        NotConverged: The state did not converge to 1e-10; a motion that slides or grazes may not be smooth enough.
    """
    scene.refuse_memory("periodic")
    if scheme.is_accelerated:
        raise UserError("periodic: the scheme has accelerations as states; take the midpoint rule or theta")
    begin = start or scene.state()
    if begin.q.shape[1] != 1:
        raise UserError("periodic: the start has several members; take one")
    check_period(scene, begin.t, period, steps)
    return repeating_orbit(scene, begin.x[:, 0], begin.t, period / steps, steps, scheme, passes)[0]


def repeating_orbit(
    scene: Scene, x: Any, t: float, h: float, steps: int, scheme: LinearScheme, passes: int
) -> tuple[PeriodicOrbit, Any]:  # fmt: skip
    """Return the orbit of a period near a state x, and the derivative of the map over its period; see `periodic`."""
    best, free = np.inf, free_motions(scene)
    x = bared(x, free)
    for count in range(1, passes + 1):
        miss, P, size = returned(scene, x, t, h, steps, scheme, free)
        best = float(np.abs(miss / size).max())
        if best < TOLERANCE:
            values = multipliers_of(scene, bared(P, free), h, steps)
            return PeriodicOrbit(state_of(scene, x[:, None].copy(), t), values, best, count), P
        x = x + change_of_orbit(P, miss)
    raise NotConverged(
        f"periodic: after {passes} passes a period of {steps * h:g} s leaves {best:.2g} of the motion; start nearer "
        "(march some periods first), or the response has another period"
    )


def multipliers_of(scene: Scene, P: Any, h: float, steps: int) -> Any:
    """Return the eigenvalues of dP/dx over so many steps of h, by the damping of modes that these do not resolve."""
    damping = scene.damping[0] if len(scene.damping) == 1 else np.zeros(scene.size)  # damping that couples is left out
    return resolved_multipliers(P, unresolved_decay(scene.squares, damping, h, steps * h), h)


def state_of(scene: Scene, x: Array, t: float) -> SceneState:
    """Return columns of coordinates, velocities and states as the lanes of a state."""
    n = scene.size
    return SceneState(t, x[:n], x[n : 2 * n], x[2 * n :], np.zeros((scene.motions, x.shape[1])))


def returned(
    scene: Scene, x: Array, t: float, h: float, steps: int, scheme: LinearScheme, free: FreeMotions
) -> tuple[Any, Any, Array]:  # fmt: skip
    """Return P(x) - x after so many steps, dP/dx by disturbed members, and the sizes of x that scale both."""
    n = scene.size
    size: Array = np.concatenate([np.full(len(one), np.abs(one).max(initial=0.0)) for one in np.split(x, [n, 2 * n])])
    if not size.max() > 0.0:
        size = np.ones_like(size) * (np.abs(scene.load_columns).max() or 1.0) * h * h
    if not size[:n].any():  # it passes 0, and moves about so far
        size[:n] = size[n] * h * steps / (2.0 * pi)
    size = np.maximum(size, 1e-12 * size.max())
    e = SHIFT * size
    X = np.column_stack([x, x[:, None] + np.diag(e), x[:, None] - np.diag(e)])
    found = ensemble(scene, step=h, end=t + steps * h, start=state_of(scene, X, t), scheme=scheme)
    if found.failed.any():
        raise NotConverged("periodic: the contact forces of a step failed; take more steps")
    Y = np.vstack([found.q, found.v, found.z])
    P = (Y[:, 1 : 1 + len(x)] - Y[:, 1 + len(x) :]) / (2.0 * e)
    return change_in(x, Y[:, 0], free), drifting(P, free, h * steps), size


class FreeMotions(NamedTuple):
    """Motions that nothing opposes, orthonormal: the other motions depend on neither their place nor their speed.

    Attributes:
        places: Motions without springs, contacts and feedback, (n, count), which dampers may oppose.
        speeds: Motions among them without dampers, (n, count).
    """

    places: Array
    speeds: Array


def free_motions(scene: Scene) -> FreeMotions:
    """Return the motions that nothing opposes, such as the rotation of a gear pair, be there drag or not."""
    none = np.zeros((scene.size, 0))
    if scene.is_moving or scene.is_large:
        return FreeMotions(none, none)
    low = scene.squares <= FREE * scene.squares.max(initial=0.0)
    damping = np.diag(scene.damping[0]) if len(scene.damping) == 1 else scene.damping
    fed = [scene.rows([place]) for one in scene.feedbacks for place in (one.sense, one.act)]
    kept: list[Array] = [np.eye(scene.size)[:, low]]
    for rows in ([*scene.contact_rows, *np.vstack([none.T, *fed])], [damping]):
        units = [one / (np.linalg.norm(one) or 1.0) for one in rows]
        _, values, across = np.linalg.svd(np.vstack([none.T, *units]) @ kept[-1])
        kept.append(kept[-1] @ across[np.count_nonzero(values > np.sqrt(FREE)) :].T)
    return FreeMotions(*kept[1:])


def bared(X: Any, free: FreeMotions) -> Any:
    """Return states X, (2 n + states, ...), without the coordinates and velocities of free motions."""
    n = len(free.places)
    found: Any = np.array(X, dtype=float)
    for part, along in zip((found[:n], found[n : 2 * n]), free, strict=True):
        part -= np.tensordot(along, np.tensordot(along.T, part, 1), 1)
    return found


def change_in(x: Array, y: Array, free: FreeMotions) -> Array:
    """Return y - x without the places of free motions that dampers oppose, which a mean force moves on and on."""
    n, change = len(free.places), y - x
    change[:n] -= (free.places @ free.places.T - free.speeds @ free.speeds.T) @ change[:n]
    return change


def drifting(P: Array, free: FreeMotions, span: float) -> Array:
    """Return dP/dx over a span with the drift of free motions in closed form.

    Differences leave a little of 1 - P along them, by which Newton's method would move them far away.
    """
    if not free.places.size:
        return P
    n, along, found = len(free.places), free.speeds @ free.speeds.T, bared(bared(P, free).T, free).T
    found[: 2 * n, : 2 * n] += np.block([[along, span * along], [np.zeros_like(along), along]])
    return np.asarray(found)


def after_steps(scene: Scene, x: Any, t: float, h: float, steps: int, scheme: LinearScheme = MIDPOINT) -> Any:
    """Return the state x after so many steps of h."""
    marcher = Marcher(scene, h, state_of(scene, x[:, None].copy(), t), scheme=scheme)
    marcher.advance(steps)
    return marcher.state.x[:, 0]


def change_of_orbit(P: Any, miss: Array) -> Any:
    """Return (1 - P)^-1 times the change in a period: Newton's change of a state, or the derivative of an orbit."""
    return np.linalg.lstsq(np.eye(len(P)) - P, miss, rcond=None)[0]


LOOKED, SHORTEST = 5, 0.2  # periods in which a motion is looked at, and the least lag over a period
NEARLY = 2.0  # the first lag whose difference is below so much of the least one, or half a step, is the period
SETTLED = 1e-4  # difference over the size of the motion at which shooting begins
VANISHED, UNBOUND = 1e-6, 1e6  # amplitude over the first one at which a motion has decayed, or grows without limit
ACCEPTED, STALLED = 1e-6, 8  # change over a period where contacts open or close, and passes without a smaller one
DOUBLINGS = 120
FREE = 1e-12  # square of a frequency over the largest one below which a motion is free, but for round-off
MOST_PARTS, PART = 8, 0.01  # of the motion: what a part of a cycle that is a period leaves at most


@dataclass(frozen=True, eq=False)
class LimitCycle(PeriodicOrbit):
    """A motion that repeats by itself: `history(scene, period / steps, period, state)` is one cycle.

    Attributes beside those of `PeriodicOrbit`, whose multipliers are of disturbances across the cycle:
        period: s.
        steps: In a period.
        along: Multiplier of a shift along the cycle: 1, up to what the step leaves where contacts open and close.
        growth: Largest growth rate of the scene with all contacts idle, 1/s.
    """

    __repr__ = result_words

    period: float
    steps: int
    along: float
    growth: float

    @property
    def is_subcritical(self) -> bool:
        """True where small motions that touch no contact decay, so that the cycle needs a large motion to begin."""
        return self.growth < 0.0

    @property
    def is_decided(self) -> bool:
        """True where the multipliers are farther from 1 than the multiplier along the cycle."""
        return bool(abs(np.abs(self.multipliers).max() - 1.0) > abs(self.along - 1.0))

    @property
    def frequency(self) -> float:
        """Angular frequency, rad/s."""
        return 2.0 * pi / self.period


@checked
def limit_cycle(
    scene: Scene, steps: int = 200, start: SceneState | None = None, period: float | None = None, cycles: int = 200,
    passes: int = 30,
) -> LimitCycle:  # fmt: skip
    """Return a limit cycle of a scene whose loads and walls do not vary.

    Without a start the motion grows out of rest, along the fastest growing mode, from the amplitude at which a contact
    is first touched. The march settles, then shooting solves for state and period. With a start and a period shooting
    begins at once: that finds unstable cycles, too. Where shooting does not converge, the march settles first.

    Args:
        scene: Scene with feedback that makes it unstable, and contacts that limit the motion.
        steps: Steps in a period.
        start: State to start from.
        period: Estimate of the period, s; default: from a march.
        cycles: Cycles that the march may take to settle.
        passes: Largest number of passes of Newton's method.

    Raises:
        UserError: A load varies, nothing limits the motion, or rest is stable and no start is given.
        NotConverged: The motion decays to rest, grows without limit, or does not repeat.
    """
    if steps < 4 or cycles < 3 or not (period is None or (np.isfinite(period) and period > 0.0)):
        raise UserError(
            f"limit cycle: found {steps} steps, {cycles} cycles and period {period!r}; expected at least 4 and 3, "
            "and a time above 0"
        )
    scene.refuse_memory("limit cycle")
    if scene.is_large:
        raise UserError("limit cycle: a structure is too large; reduce it: gapbeam.reduced_at_points")
    if not scene.contacts:
        raise UserError("limit cycle: the scene has no contacts, and nothing else limits a motion that grows")
    check_autonomous(scene, 0.0 if start is None else start.t, period or _slowest(scene))
    guess, given = period, start
    if start is None or guess is None:
        begin, around = _growing(scene) if start is None else (start, None)
        start, guess = _settled(scene, begin, guess or around or _slowest(scene), steps, cycles)
    if start.q.shape[1] != 1:
        raise UserError("limit cycle: the start has several members; take one")
    try:
        found = _shot(scene, start, guess, steps, passes)
    except NotConverged:
        if start is not given:
            raise
        found = _shot(scene, *_settled(scene, start, guess, steps, cycles), steps, passes)
    found = next((_shot(scene, found.state, found.period / k, steps, passes) for k in _parts(scene, found)), found)
    for one in scene.feedbacks:
        one.check(found.frequency)
    return found


def check_autonomous(scene: Scene, t: float, period: float, what: str = "limit cycle: ") -> None:
    """Raise UserError if a load or a wall varies within a period."""
    times = t + period * np.linspace(0.0, 1.0, 37)
    for load in scene.loads:
        if np.ptp(load.table(times)[:, 0]) != 0.0:
            raise UserError(f"{what}load {load.name or '?'} varies in time; `periodic` takes a known period")
    if np.ptp(scene.walls(times), axis=0).any():
        raise UserError(f"{what}a wall moves; `periodic` takes a known period")


def _growing(scene: Scene) -> tuple[SceneState, float]:
    """Return the fastest growing motion at the amplitude at which a contact is first touched, and its period."""
    values, vectors = np.linalg.eig(state_matrix(scene))
    best = int(np.argmax(values.real))
    if not values[best].real > 0.0:
        raise UserError(
            f"limit cycle: none grows out of rest, where all motions decay (the slowest as exp({values[best].real:.4g} "
            "t)); a cycle beside a stable rest needs a start with a large motion"
        )
    if not values[best].imag:
        raise UserError(f"limit cycle: the scene diverges as exp({values[best].real:.4g} t) without oscillation")
    motion = touching(scene, scene.state(), vectors[:, best])
    if motion is None:
        raise UserError("limit cycle: the growing motion touches no contact, so that nothing limits it")
    return state_of(scene, motion.real[:, None], 0.0), 2.0 * pi / abs(float(values[best].imag))


def touching(scene: Scene, state: SceneState, mode: Any) -> Any:
    """Return a mode, (2 n + states,) complex, as large as its real part first touches a contact, to a factor of 2.

    None where it touches none. The phase is such that the largest coordinate is real.
    """
    shape = mode / mode[np.abs(mode[: scene.size]).argmax()]
    slabs, at = scene.slabs(rough=False), scene.places(state.q, state.t)
    motion, still = scene.contact_rows @ shape[: scene.size].real, rest(slabs, at)[0]
    amplitude = 2.0**-DOUBLINGS / max(float(np.abs(shape.real).max()), 1e-300)
    for _ in range(2 * DOUBLINGS):
        moved = amplitude * motion[:, None]
        if any(not np.array_equal(rest(slabs, at + sign * moved)[0], still) for sign in (1.0, -1.0)):
            return amplitude * shape
        amplitude *= 2.0
    return None


def _slowest(scene: Scene) -> float:
    """Return the period of the slowest mode that oscillates; of bodies that feedback alone holds, with the feedback."""
    turning = np.sqrt(np.maximum(scene.squares, 0.0))
    if not np.any(turning > 0.0):
        turning = np.abs(np.linalg.eigvals(state_matrix(scene)).imag)
    turning = turning[turning > np.sqrt(FREE) * turning.max(initial=0.0)]
    if not turning.size:
        raise UserError("limit cycle: no mode oscillates by itself; give the period, about")
    return 2.0 * pi / float(turning.min())


def repetition(seen: Array, period: int) -> tuple[Any, Any]:
    """Return the distance of motions from repeating, over their size, and the lags after which they do, (members,).

    Displacements, (times, motions, members), of the last times of a period are compared with those a lag earlier. Lags
    lie between times, where a parabola through the differences is least.
    """
    last, first, least = seen[-period:], len(seen) - period, max(2, round(SHORTEST * period))
    size = np.maximum(np.sqrt(last.var(axis=0).sum(axis=0)), np.finfo(float).tiny)
    lags = np.arange(least - 1, first + 1)
    apart = np.array([((last - seen[first - lag :][:period]) ** 2).mean(axis=0).sum(axis=0) for lag in lags])
    apart = np.sqrt(apart) / size
    low = (apart[1:-1] <= apart[:-2]) & (apart[1:-1] <= apart[2:])
    inner = np.where(low, apart[1:-1], np.inf)
    changed = inner.min(axis=0)
    where = 1 + np.argmax(inner <= np.maximum(NEARLY * changed, 2.0 * pi / period), axis=0)
    before, here, after = (apart[where + k, np.arange(len(where))] ** 2 for k in (-1, 0, 1))
    bent = np.maximum(before - 2.0 * here + after, np.finfo(float).tiny)
    return changed, lags[where] + np.clip(0.5 * (before - after) / bent, -0.5, 0.5)


def _settled(
    scene: Scene, start: SceneState, around: float, steps: int, cycles: int
) -> tuple[SceneState, float]:  # fmt: skip
    """March until the motion repeats; return a state of it, and its period."""
    h, size, changed, lag = around / steps, 0.0, np.array([np.inf]), np.zeros(1)
    way = start.q[:, 0] if start.q.any() else start.v[:, 0]
    marcher = Marcher(scene, h, start, linear=scene.condensed(h, MIDPOINT)._replace(watch=aligned(way[None])))
    for _ in range(0, cycles, LOOKED):
        seen = marcher.advance(LOOKED * steps, record=True).seen
        amplitude = 0.5 * float(np.ptp(seen[-2 * steps :]))
        if amplitude < VANISHED * size:
            raise NotConverged("limit cycle: the motion decays to rest; start from a larger one")
        if size and amplitude > UNBOUND * size:
            raise NotConverged("limit cycle: the motion grows without limit; no contact stops it")
        size = size or amplitude
        changed, lag = repetition(seen, steps)
        if changed[0] <= SETTLED:
            break
    if not np.isfinite(changed[0]):
        raise NotConverged(
            f"limit cycle: no oscillation in {cycles} periods of {around:.4g} s; give a period or a start"
        )
    return marcher.state, float(lag[0] * h)


def _parts(scene: Scene, found: LimitCycle) -> list[int]:
    """Return the largest number of equal parts of a cycle, each of which is a period, where it is above 1."""
    marcher, state = Marcher(scene, found.period / found.steps, found.state), found.state
    first = np.vstack([state.q, state.v])
    size = np.repeat([np.abs(state.q).max(), np.abs(state.v).max()], scene.size)[:, None]
    done, parts = 0, list[int]()
    for k in range(MOST_PARTS, 1, -1):
        if found.steps % k == 0:
            marcher.advance(found.steps // k - done)
            done = found.steps // k
            if np.all(np.abs(np.vstack([marcher.q, marcher.v]) - first) <= PART * size):
                parts.append(k)
    return parts


def _shot(scene: Scene, start: SceneState, period: float, steps: int, passes: int) -> LimitCycle:
    """Solve for the state and the period by Newton's method."""
    t, T = start.t, period
    free = free_motions(scene)
    x: Any = bared(start.x[:, 0], free)
    first = np.linalg.norm(x)
    least, found, growth = np.inf, None, float(np.linalg.eigvals(state_matrix(scene)).real.max())
    for count in range(1, passes + 1):
        miss, P, size = returned(scene, x, t, T / steps, steps, MIDPOINT, free)
        late, early = (after_steps(scene, x, t, T * far / steps, steps) for far in (1.0 + SHIFT, 1.0 - SHIFT))
        side = (late - early) / (2.0 * SHIFT * T) / size
        scaled, left = P / size[:, None] * size, float(np.abs(miss / size).max())
        if left < least:
            least, unit = left, side / np.linalg.norm(side)
            across = (scaled - np.outer(unit, unit @ scaled)) * size[:, None] / size
            values = multipliers_of(scene, bared(across, free), T / steps, steps)
            kept = np.delete(values, np.abs(values).argmin())
            state = state_of(scene, x[:, None].copy(), t)
            found = LimitCycle(state, kept, left, count, T, steps, float(unit @ scaled @ unit), growth)
        if left < TOLERANCE or (found is not None and count - found.passes >= STALLED):
            break
        whole = np.block([[scaled - np.eye(len(x)), side[:, None] * T], [side[None] * T, np.zeros((1, 1))]])
        change = np.linalg.lstsq(whole, np.append(-miss / size, 0.0), rcond=None)[0]
        change *= min(1.0, 0.2 / max(abs(change[-1]), 1e-300))
        x, T = x + change[:-1] * size, T * (1.0 + float(change[-1]))
    if found is None or least > ACCEPTED:
        raise NotConverged(
            f"limit cycle: after {passes} passes a period of {T:.6g} s leaves {least:.2g} of the motion; it may be "
            "irregular, or graze a contact; start nearer, or take more steps"
        )
    if np.linalg.norm(found.state.x) < 1e-3 * first:
        raise NotConverged("limit cycle: shooting came to rest: no cycle is near the start")
    return found
