"""The atlas of a scene: all responses that a set of starts comes to, over one or two parameters.

Starts are displacements and velocities of points, drawn or on a grid.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import binomtest

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, period_at
from gapbeam.solver.scene.ensemble_members import response_figure_faults
from gapbeam.solver.scene.limit_cycle import state_of
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.printed_values import result_words
from gapbeam.solver.scene.recorded_places import turning_places
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.response_search import CHAOTIC, FAILED, UNSETTLED, ResponseSearch, repeating


@dataclass(frozen=True, eq=False)
class Response:
    """A stable response: a periodic one, found by shooting, rest, or a motion of two frequencies, by its spectrum.

    Attributes:
        order: Periods of the load after which it repeats; without such a load 1, a limit cycle, or 0, rest; -1: it has
            two frequencies, and never repeats.
        state: State at the start of a period: a march from it repeats.
        strobes: States (q, v) at its periods, (order, 2 n).
        multipliers: Multipliers of small disturbances over all its periods, complex; the largest is below 1 in size. Of
            two frequencies: the one of the largest exponent over a period, about 1.
        count: Starts that come to it.
        share: Share of all starts at this parameter point.
        interval: Interval of the share, 95 % (Wilson), for starts drawn at random.
        peak: Largest displacement in absolute value by point, m.
        impacts: Impacts a period of the load by contact.
        peak_force: Largest force by contact, N.
        period: Period of a limit cycle, s; NaN where the loads have a period, and at rest.
        figures: Figures of one's own, by name.
        frequencies: Hz, where there are two: under a load its own, and the one beside it, up to a half of it.
    """

    __repr__ = result_words

    order: int
    state: SceneState
    strobes: Array
    multipliers: Any
    count: int
    share: float
    interval: tuple[float, float]
    peak: dict[str, Any]
    impacts: dict[str | int, float]
    peak_force: dict[str | int, float]
    period: float = float("nan")
    figures: dict[str, float] = field(default_factory=dict)
    frequencies: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class AtlasPoint:
    """Everything found at one parameter point.

    Attributes:
        values: Parameters by path.
        period: Period of the load, s; NaN where none varies.
        responses: Stable ones, largest share first.
        chaotic: Share of starts whose motion is chaotic: its exponent is above 0 by more than three standard errors.
        exponent: Mean exponent of these, 1/s; NaN where there are none.
        unsettled: Share of starts that neither came to a response nor are chaotic: march longer, or look at the orders.
        failed: Share of starts whose contact forces did not converge.
    """

    __repr__ = result_words

    values: dict[str, float]
    period: float
    responses: list[Response]
    chaotic: float
    exponent: float
    unsettled: float
    failed: float


@dataclass(frozen=True, eq=False)
class Atlas:
    """All responses of a scene over its parameters.

    Attributes:
        over: Values by path.
        points: One for each combination of values, the last path fastest.
        which: Response of each start, (points, starts): its number in `responses`; -1 chaotic, -2 unsettled, -3 failed.
        starts: The starts.
        strobes: Displacements by point at the last periods, (points, starts, periods), or (..., motions).
        turning: Points that are rotations, rad, and contacts between them.
    """

    __repr__ = result_words

    over: dict[str, Array]
    points: list[AtlasPoint]
    which: Any
    starts: SceneState
    strobes: dict[str, Array]
    turning: tuple[str, ...] = ()

    @property
    def is_complete(self) -> bool:
        """True where each start came to a response or to chaos."""
        return bool((self.which > UNSETTLED).all())


@checked
def atlas(
    scene: Scene, *, period: float | Callable[[dict[str, float]], float], starts: SceneState,
    over: Mapping[str, Any] | None = None, steps: int = 400, settle: int = 100, rounds: int = 4, orders: int = 8,
    exponents: int = 200, scheme: LinearScheme = MIDPOINT, threads: int | None = None, figures: Sequence[Figure] = (),
) -> Atlas:  # fmt: skip
    """Find all stable periodic responses that a set of starts comes to, their shares, and the chaotic starts.

    All starts march in lock-step; members whose strobes repeat are candidates; a candidate counts where shooting
    converges, its multipliers are below 1 in size, and a member has come to 1e-3 of it and comes nearer. Orbits are
    compared by their converged states, and orders are the least. Members that do not settle march again, `rounds` times
    in all; then their exponent decides whether they are chaotic. Those that are not march once more, and are
    looked at for a second frequency beside the load. Motion that is
    chaotic for that long may still end in a response later.

    Args:
        scene: Its loads repeat after the period.
        period: Period of the loads, s; or a function of the parameters by path.
        starts: A set of starts, as of `drawn_starts`.
        over: Values by path; two paths: all combinations.
        steps: Steps in a period.
        settle: Periods before strobes are compared.
        rounds: Marches of so many periods at most.
        orders: Highest number of periods after which a response may repeat.
        exponents: Periods over which exponents are taken.
        scheme: Scheme of the time integration; without accelerations as states.
        threads: As of `ensemble`.
        figures: Figures of one's own, by `gapbeam.figure`, as of `ensemble`, over whole responses.

    Raises:
        UserError: A path, number, figure or period cannot be, or loads do not repeat after the period.
    """
    if min(steps, settle, rounds, orders) < 1 or exponents < 50:
        raise UserError("atlas: expected steps, settle, rounds and orders from 1 on, and exponents from 50 on")
    scene.refuse_memory("atlas")
    if scheme.is_accelerated:
        raise UserError("atlas: the scheme has accelerations as states; take the midpoint rule or theta")
    for one, words in response_figure_faults(scene, figures):
        raise UserError(f"atlas: figure {one.name}: {words}")
    axes = {path: np.atleast_1d(finite(value, path)) for path, value in (over or {}).items()}
    if empty := [path for path, value in axes.items() if not value.size]:
        raise UserError(f"atlas: over: {empty[0]}: found no values, expected one or more")
    if len(axes) > 2:
        raise UserError(f"atlas: found {len(axes)} parameters, expected at most 2")
    grid = np.meshgrid(*axes.values(), indexing="ij") if axes else [np.zeros(1)]
    values: dict[str, Array] = {path: one.ravel() for path, one in zip(axes, grid, strict=False)}
    count = grid[0].size
    every = [{path: float(value[i]) for path, value in values.items()} for i in range(count)]
    periods = [period_at(period, one, "atlas") for one in every]
    strobe = repeating(scene, values, finite(periods, "atlas: period"), starts, steps, scheme, threads)
    each = starts.q.shape[1]
    X = np.vstack([np.tile(one, (1, count)) for one in (starts.q, starts.v, starts.spread(each).z)])
    search = ResponseSearch(strobe, each, X, settle, rounds, orders, exponents, figures)
    exponent = search.run()
    points = [_summary(search, i, one, exponent) for i, one in enumerate(every)]
    which = search.which.reshape(count, each)
    for i in range(count):
        which[i] = _numbered(search, i)[which[i]] if len(search.found) else which[i]
    strobes = {}
    for name, point in scene.point_names.items():
        x = np.einsum("mn,knl->lkm", scene.rows_at(point), search.late[:, : scene.size])
        x = x.reshape(count, each, *x.shape[1:])
        strobes[name] = x[..., 0] if x.shape[-1] == 1 else x
    return Atlas(axes, points, which, starts, strobes, turning_places(scene))


def _numbered(search: ResponseSearch, i: int) -> Any:
    """Return a table from numbers of all orbits to those of a parameter point; negative ones stay."""
    table = np.concatenate([np.zeros(len(search.found), dtype=int), [FAILED, UNSETTLED, CHAOTIC]])
    table[search.ranked(i)] = np.arange(len(search.ranked(i)))
    return table


def share_of(count: int, starts: int) -> tuple[float, tuple[float, float]]:
    """Return a share of starts, and its 95 % interval (Wilson)."""
    share = binomtest(count, starts)
    ends = share.proportion_ci(method="wilson")
    return float(share.statistic), (float(ends.low), float(ends.high))


def _summary(search: ResponseSearch, i: int, values: dict[str, float], exponent: Any) -> AtlasPoint:
    """Return everything found at a parameter point."""
    which = search.which[search.point == i]
    responses = []
    for k in search.ranked(i):
        one = search.found[k]
        share, interval = share_of(len(one.members), search.each)
        load = 1.0 / float(search.strobe.period[i])
        both = tuple(load * f for f in (1.0, *one.frequencies)) if one.frequencies else ()
        state = state_of(search.strobe.scene, one.orbit.x[:, None], search.strobe.t)
        responses.append(
            Response(
                one.order, state, one.strobes, one.orbit.multipliers, len(one.members), share, interval,
                one.peak, one.impacts, one.peak_force, figures=one.figures, frequencies=both,
            )
        )  # fmt: skip
    chaos = exponent[(search.point == i) & (search.which == CHAOTIC)]
    shares = [float(np.mean(which == kind)) for kind in (CHAOTIC, UNSETTLED, FAILED)]
    mean = float(chaos.mean()) if len(chaos) else float("nan")
    return AtlasPoint(values, float(search.strobe.period[i]), responses, shares[0], mean, *shares[1:])


def single_motions(tables: Mapping[str, Array]) -> dict[str, Array]:
    """Return tables, (motions, ...) by point, by their motions: "tip" of one, "tip 1" and "tip 2" of a point of two."""
    return {
        f"{name} {i}" if len(table) > 1 else name: one
        for name, table in tables.items()
        for i, one in enumerate(table, 1)
    }


Ranges = Mapping[str, ArrayLike]


@checked
def drawn_starts(
    scene: Scene, count: int, displacement: Ranges | None = None, velocity: Ranges | None = None, seed: int = 0,
    rest: SceneState | None = None,
) -> SceneState:  # fmt: skip
    """Return starts with displacements and velocities of points drawn at random, each evenly between two values.

    The rest of a structure follows: of all motions with these displacements (velocities) it takes the one of least
    potential (kinetic) energy.

    Args:
        scene: The scene.
        count: Starts.
        displacement: Ranges by point, (lowest, highest), m, from `rest`; of each of its motions.
        velocity: Ranges of velocities likewise, m/s.
        seed: Seed of the draws.
        rest: State to which they are added, such as a seat; default undeformed.

    Raises:
        UserError: Values are no pair, or the motions of two points follow each other.
    """
    if count < 1:
        raise UserError(f"starts: found {count}, expected 1 or more")
    draw = np.random.default_rng(seed)

    def values(given: Ranges | None) -> dict[str, Array]:
        found = {}
        for name, pair in (given or {}).items():
            ends = finite(pair, f"starts: {name}")
            if ends.shape != (2,) or ends[0] > ends[1]:
                raise UserError(f"starts: {name}: found {pair!r}, expected (lowest, highest)")
            found[name] = draw.uniform(float(ends[0]), float(ends[1]), (len(scene.point(name).rows), count))
        return found

    return _starts(scene, values(displacement), values(velocity), count, rest)


@checked
def gridded_starts(
    scene: Scene, displacement: Ranges | None = None, velocity: Ranges | None = None, rest: SceneState | None = None
) -> SceneState:
    """Return starts at all combinations of values, the last one fastest, for a picture of basins.

    Args:
        scene: The scene.
        displacement: Values by point of one motion, m, from `rest`.
        velocity: Values of velocities likewise, m/s.
        rest: See `drawn_starts`.

    Raises:
        UserError: As `drawn_starts`, or a point has several motions.
    """
    axes = [
        finite(np.atleast_1d(one), "starts") for table in (displacement, velocity) for one in (table or {}).values()
    ]
    if not axes:
        raise UserError("starts: expected values of one point at least")
    grid = [one.ravel() for one in np.meshgrid(*axes, indexing="ij")]
    first = len(displacement or {})
    return _starts(
        scene, dict(zip(displacement or {}, grid, strict=False)), dict(zip(velocity or {}, grid[first:], strict=False)),
        len(grid[0]), rest,
    )  # fmt: skip


def _starts(
    scene: Scene, displacement: dict[str, Array], velocity: dict[str, Array], count: int, rest: SceneState | None
) -> SceneState:
    base = (rest or scene.state()).spread(count)
    soft = scene.squares[scene.squares > 1e-9 * scene.squares.max(initial=0.0)].min(initial=np.inf)
    weight = scene.squares + (soft if np.isfinite(soft) else 1.0)
    q = base.q + _motion(scene, displacement, 1.0 / weight)
    v = base.v + _motion(scene, velocity, np.ones(scene.size))
    return SceneState(base.t, q, v, base.z, base.F)


def _motion(scene: Scene, values: dict[str, Array], mobility: Array) -> Any:
    """Return the motion, (n, starts), of least weight that has these values."""
    if not values:
        return 0.0
    B, asked = scene.rows([scene.point(name) for name in values]), np.vstack(list(values.values()))
    if len(B) != len(asked):
        wide = ", ".join(name for name in values if len(scene.point(name).rows) != 1)
        raise UserError(f"starts: {wide}: expected points of one motion")
    G = (B * mobility) @ B.T
    if np.linalg.matrix_rank(G, hermitian=True) < len(G):
        raise UserError(f"starts: the motions of {', '.join(values)} follow each other; give fewer points")
    return mobility[:, None] * B.T @ np.linalg.solve(G, asked)
