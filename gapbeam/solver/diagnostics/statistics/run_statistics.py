"""Statistics of a run under random loads, gathered from its records in constant memory, sliding work included.

One interval from several runs of the same motion under other noise: the members of an ensemble, pooled.

Each member j has a mean m_j over the time T_j with the standard error s_j from its own batches, which
knows what the member remembers. Members of other seeds are independent, so that

    m = sum T_j m_j / T,    s^2 = sum (T_j s_j / T)^2,    nu = s^4 / sum ((T_j s_j / T)^4 / 9),    T = sum T_j,

and the interval is m +- t_nu s, even about the logarithm for figures that are positive; an rms is pooled as its square.
Every member leaves out a burn-in of its own, and is judged by itself: pooling does not make members longer. Where
their means differ by more than their own intervals allow (F test at 1 %), the members disagree: they are too short, or
there are several motions, and the interval means nothing.

Sources: Law, Simulation Modeling and Analysis (2015), section 9.5, for independent replications; Welch, Biometrika 34
(1947) 28, for nu.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, log
from typing import Any

import numpy as np
import scipy

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.diagnostics.statistics.batch_interval import (
    BATCHES,
    CONFIDENCE,
    FEWEST,
    MOST,
    BlockEnds,
    BlockMeans,
    Interval,
    burn_in,
    correlation_time,
    interval_about,
    interval_of_mean,
    quantile,
)
from gapbeam.solver.diagnostics.statistics.statistic_figures import (
    ASKED,
    LATERAL,
    PARTS_OF_WORK,
    PERCENTILES,
    RMS_FORCE,
    AveragedSeries,
    Doubts,
    StatisticFigure,
    face_series,
    may_be_asked,
    own_series,
    probe_series,
)
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.schema.record_table import SLIP_MODES, STRUCK, TURNING, unit_where

EVEN = 1.0e-6  # of the interval, by which records may be unevenly spaced
SUMMED = ("contact_time", "impulse", "closings", "approach_speeds", "force_square")
PER_PROBE, PER_OWN = 3, 2
ORDER = ("no event", "good", "not resolved", "biased", "too short", "not settled")


@dataclass
class RunStatistics:
    """Gathers the records of a run.

    Attributes:
        faces: Names of the faces.
        probes: Names of the probes.
        in_space: Whether the beam leaves its bending plane.
        interval: Time between records, s; records at other distances, such as the last one, are left out.
        decay: Time in which the damping of the beam takes 1 - 1/e of the energy of its slowest vibration, s; 0: not
            known. A record that is short beside it has not seen how far the motion strays, and cannot show that.
        slides: Whether the work of sliding and its parts are recorded.
        own: Figures of one's own that are means over the run, or quantiles of it.
        labels: Names along the dimensions of the records, for those.
        blocks: Means over blocks of records.
    """

    faces: tuple[str, ...]
    probes: tuple[str, ...]
    in_space: bool
    interval: float
    decay: float = 0.0
    slides: bool = False
    own: tuple[Figure, ...] = ()
    labels: Mapping[str, Sequence[str]] = field(default_factory=dict)
    blocks: BlockMeans = field(init=False)
    _time: float | None = None
    _sums: np.ndarray | None = None

    def __post_init__(self) -> None:
        of_probes = PER_PROBE * len(self.directions) * len(self.probes)
        self.blocks = BlockMeans(self._columns * len(self.faces) + of_probes + PER_OWN * len(self.own))

    @property
    def _summed(self) -> tuple[str, ...]:
        """Records of a face that are sums over time."""
        return (*SUMMED, "sliding_work") if self.slides else SUMMED

    @property
    def _columns(self) -> int:
        """Number of sums over time of a face."""
        return len(self._summed) + (len(SLIP_MODES) if self.slides else 0)

    @property
    def directions(self) -> tuple[str, ...]:
        """Suffixes by which figures of probes name their direction."""
        return ("", LATERAL) if self.in_space else ("",)

    def see(self, rows: Mapping[str, np.ndarray]) -> None:
        """Take in records, each with a leading axis of times."""
        times = np.atleast_1d(rows["time"])
        if not len(times):
            return
        stacked = np.stack([rows[name] for name in self._summed], axis=-1)
        parts = [rows["work_by_mode"]] if self.slides else []
        sums: np.ndarray = np.concatenate([stacked, *parts], axis=-1).reshape(len(times), -1)
        if self._time is None or self._sums is None:
            self._time, self._sums = float(times[0]), sums[0]
            rows, times, sums = {name: column[1:] for name, column in rows.items()}, times[1:], sums[1:]
            if not len(times):
                return
        intervals = np.diff(times, prepend=self._time)
        changes = np.diff(sums, axis=0, prepend=self._sums[None])
        even = np.abs(intervals - self.interval) <= EVEN * self.interval
        self._time, self._sums = float(times[-1]), sums[-1]
        columns = [changes / self.interval]
        if self.probes:
            ways = [-1, -2] if self.in_space else [-1]
            place, shake = (rows[name][..., ways] for name in ("displacement", "acceleration_absolute"))
            columns.append(np.stack([place, place**2, shake**2], axis=-1).reshape(len(times), -1))
        for one in self.own:
            x = one.series(rows, self.labels)
            x = np.asarray(x > one.limit, dtype=float) if one.statistic == "share" else x
            columns.append(np.stack([x, x**2], axis=-1))
        self.blocks.add(np.concatenate(columns, axis=1)[even])

    def series(self) -> list[AveragedSeries]:
        """Return the series of all figures behind the burn-in; none where the record is far too short."""
        means, ends = self.blocks.means, self.blocks.ends
        if len(means) < FEWEST:
            return []
        found = self._series(means, ends)
        cut = burn_in([one.values for one in found if one.share is None], self.decay / self.block)
        return self._series(means[cut:], ends[cut:])

    @property
    def block(self) -> float:
        """Length of a block, s."""
        return self.blocks.length * self.interval

    def figures(self) -> list[StatisticFigure]:
        """Return all figures with their intervals and verdicts."""
        found = self.series()
        slowest = self._slowest_of(found)
        return [one.judged(self.block, slowest) for one in found]

    def met(self, name: str, relative_error: float) -> bool:
        """Return whether a run may end: the interval of a figure is narrow enough, on a record that is long enough."""
        found = self.series()
        return any(one.name == name and one.met(relative_error, self._slowest_of(found)) for one in found)

    def describe(self, doubts: Doubts | None = None) -> dict[str, Any]:
        """Return the figures for the summary.

        Args:
            doubts: Doubts on the figures; None: not known.
        """
        found = [one.doubted(doubts or Doubts()) for one in self.figures()]
        marched = self.blocks.records * self.interval
        if not found:
            return {"verdict": "too short", "seconds": marched, "burn_in": None, "figures": []}
        used = found[0].seconds
        return {
            "verdict": max((one.verdict for one in found), key=ORDER.index),
            "seconds": marched,
            "burn_in": marched - used,
            "confidence": CONFIDENCE,
            "batches": BATCHES,
            **({} if doubts is None else {"missed_impacts": dict(doubts.missed)}),
            **({} if doubts is None else {"scheme_bias": doubts.describe([one.name for one in found])}),
            "figures": [_described(one, marched - used) for one in found],
        }

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        sums = None if self._sums is None else self._sums.tolist()
        return {"blocks": self.blocks.as_json(), "time": self._time, "sums": sums}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore new statistics from a checkpoint.

        Raises:
            KeyError: Something is missing; likewise ValueError and TypeError where it is not of the right form.
        """
        self.blocks.restore(data["blocks"])
        self._time = None if data["time"] is None else float(data["time"])
        size = self._columns * len(self.faces)
        self._sums = None if data["sums"] is None else np.array(data["sums"], dtype=float).reshape(size)

    def _series(self, means: np.ndarray, ends: np.ndarray) -> list[AveragedSeries]:
        found: list[AveragedSeries] = []
        for number, face in enumerate(self.faces):
            first = self._columns * number
            found += self._at(face, face_series(face, means[:, first : first + self._columns]))
        first = self._columns * len(self.faces)
        for probe in self.probes:
            for direction in self.directions:
                mine = means[:, first : first + PER_PROBE]
                found += self._at(probe, probe_series(probe, mine, ends[:, first], direction))
                first += PER_PROBE
        for one in self.own:
            mine = means[:, first : first + PER_OWN]
            found += self._at(one.place, [own_series(one, mine, ends[:, first])])
            first += PER_OWN
        return found

    def _at(self, place: str | None, series: Sequence[AveragedSeries]) -> list[AveragedSeries]:
        """Return the series of a place in its units, rad and N m where it rotates; of impulses those without a step."""
        turns, struck = (place in self.labels.get(name, ()) for name in (TURNING, STRUCK))
        kept = (one for one in series if not (struck and one.name.endswith((RMS_FORCE, "acceleration_rms"))))
        return [replace(one, unit=unit_where(one.unit, turns)) for one in kept]

    def _slowest_of(self, series: Sequence[AveragedSeries]) -> float:
        """Return the longest relaxation time, as measured or by the damping, in blocks; percentiles are left out."""
        found = (correlation_time(one.values) for one in series if one.share is None)
        return max(max(found, default=inf), self.decay / self.block)


def in_words(found: Mapping[str, Any]) -> str:
    """Return the statistics of a run, as the summary has them, in one line."""
    known = [one for one in found["figures"] if one["verdict"] == "good" and one["relative"] is not None]
    known.sort(key=lambda one: float(one["relative"]))
    words = " to ".join(f"+- {one['relative']:.1%} ({one['name']})" for one in (known[:1] + known[1:][-1:]))
    doubtful = [one["verdict"] for one in found["figures"] if one["verdict"] != "good"]
    counts = [f"{doubtful.count(verdict)} {verdict}" for verdict in ORDER if verdict in doubtful]
    parts = [f"{counted(len(known), 'figure')} known within {words}"] if known else []
    asked = [one for one in found["figures"] if may_be_asked(one["name"])]
    widest = max(asked, key=lambda one: float(one["relative"] or 0.0), default=None)
    if widest is not None and widest["relative"] is not None:
        parts.append(
            f"least certain {widest['name']}: relative variance {widest['relative_variance_times_time']:.3g} / T[s], "
            f"{widest['effective_samples']:.0f} independent samples, 2 % takes {widest['time_for_2_percent']:.3g} s"
        )
    return f"statistics over {found['seconds']:.4g} s: {'; '.join(parts + counts) or found['verdict']}"


def _described(one: StatisticFigure, burn: float) -> dict[str, Any]:
    relative, needed = one.interval.relative, one.needed
    known = one.verdict != "no event" and np.isfinite(relative)
    deviations = quantile(CONFIDENCE, BATCHES)  # in the half-width; the record must be long compared with T
    return {
        "name": one.name,
        "unit": one.unit,
        "value": one.interval.value,
        "low": one.interval.low,
        "high": one.interval.high,
        "relative": relative if known else None,
        "effective_samples": one.samples,
        "relaxation_time": one.relaxation,
        "verdict": one.verdict,
        "relative_variance_times_time": (relative / deviations) ** 2 * one.seconds if known else None,
        f"time_for_{100 * ASKED:g}_percent": burn + needed if known and needed is not None else None,
    }


FEW = 128  # blocks of each point that a run keeps: many points have to fit in memory and in checkpoints


@dataclass
class PointStatistics(RunStatistics):
    """Gathers the records of a run whose `ContactOperator.maps_sliding`.

    Attributes:
        points: Number of contact points.
        most_blocks: Blocks of each point for which there is room; with as many as of the other figures, they are the
            same blocks.
        point_blocks: Their work at the ends of blocks.
    """

    points: int = 0
    most_blocks: int = MOST
    point_blocks: BlockEnds = field(init=False)
    _work: np.ndarray | None = None
    _left_out: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.point_blocks = BlockEnds(self.points, self.most_blocks)
        self._left_out = np.zeros(self.points)

    def see(self, rows: Mapping[str, np.ndarray]) -> None:
        """Take in records, each with a leading axis of times."""
        before = self._time
        super().see(rows)
        times, work = np.atleast_1d(rows["time"]), rows["point_work"]
        if before is None or self._work is None:
            before, self._work, times, work = float(times[0]), work[0].copy(), times[1:], work[1:]
            self.point_blocks.begin(self._work)
        if not len(times):
            return
        even = np.abs(np.diff(times, prepend=before) - self.interval) <= EVEN * self.interval
        if np.all(even):
            self.point_blocks.add(work - self._left_out if self._left_out.any() else work)
        else:
            changes = np.diff(work, axis=0, prepend=self._work[None])
            gone = self._left_out + np.add.accumulate(np.where(even[:, None], 0.0, changes), axis=0)
            self.point_blocks.add((work - gone)[even])
            self._left_out = gone[-1]
        self._work = work[-1].copy()

    def point_series(self) -> np.ndarray:
        """Return the work rate of each point over blocks behind the burn-in, (blocks, points), W; none: too short."""
        found, means = self.series(), self.point_blocks.changes / self.interval
        if not found or not len(means):
            return np.zeros((0, self.points))
        burned = 1.0 - len(found[0].values) / len(self.blocks.means)
        rest = means[round(burned * len(means)) :]
        return rest if len(rest) >= BATCHES else np.zeros((0, self.points))

    def work_rates(self) -> list[Interval]:
        """Return the work rate of each point behind the burn-in with its interval, W; none of far too short records."""
        series = self.point_series()
        return [interval_of_mean(one, positive=True) for one in series.T] if len(series) else []

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        work = None if self._work is None else self._work.tolist()
        return super().as_json() | {
            "point_blocks": self.point_blocks.as_json(),
            "point_work": work,
            "points_left_out": self._left_out.tolist(),
        }

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore new statistics from a checkpoint; raises as `RunStatistics.restore`."""
        super().restore(data)
        self.point_blocks.restore(data["point_blocks"])
        work = data["point_work"]
        self._work = None if work is None else np.array(work, dtype=float).reshape(self.points)
        self._left_out = np.array(data["points_left_out"], dtype=float).reshape(self.points)


NEEDS = {
    RMS_FORCE: "force_square",
    "approach_speed": "approach_speeds",
    "acceleration_rms": "acceleration_absolute",
    f"{LATERAL}acceleration_rms": "acceleration_absolute",
    **dict.fromkeys(PARTS_OF_WORK, "work_by_mode"),
}
"""Figures with the records that they follow from and histories may lack."""


@dataclass
class RecordStatistics(RunStatistics):
    """Statistics of records that lack some sums, as those of histories and scenes do; figures of these are left out."""

    _lacking: frozenset[str] = frozenset()

    def see(self, rows: Mapping[str, np.ndarray]) -> None:
        """Take in records, each with a leading axis of times."""
        self._lacking = frozenset(NEEDS.values()) - set(rows)
        faces, modes = np.zeros_like(rows["impulse"]), len(SLIP_MODES)
        none = dict.fromkeys(("force_square", "approach_speeds"), faces)
        none |= {"work_by_mode": np.zeros((*faces.shape, modes))}
        if self.probes:
            none["acceleration_absolute"] = np.zeros_like(rows["displacement"])
        super().see(none | dict(rows))

    def figures(self) -> list[StatisticFigure]:
        """Return all figures that the records give, with their intervals and verdicts."""
        return [one for one in super().figures() if NEEDS.get(one.name.rpartition(".")[2]) not in self._lacking]

    def as_json(self) -> dict[str, Any]:
        """Return everything that is kept, for JSON."""
        return super().as_json() | {"lacking": sorted(self._lacking)}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore new statistics from a checkpoint; raises as `RunStatistics.restore`."""
        super().restore(data)
        self._lacking = frozenset(data["lacking"])


DISAGREE = "members disagree"
BY_CHANCE = 0.01  # of ensembles disagree by chance
FEWEST_MEMBERS = 2  # members

Described = Mapping[str, Any]


def pooled_figures(members: Sequence[Described]) -> list[dict[str, Any]]:
    """Return the figures that all members have, but percentiles, with the interval of all of them together.

    Args:
        members: Described statistics of each member, with `seconds`, `burn_in` and `figures`.
    """
    if len(members) < FEWEST_MEMBERS or not all(one["figures"] for one in members):
        return []
    by_name = [{one["name"]: one for one in member["figures"]} for member in members]
    spans = np.array([float(member["seconds"]) - float(member["burn_in"]) for member in members])
    names = [name for name in by_name[0] if not name.endswith(tuple(PERCENTILES))]
    return [_pooled([one[name] for one in by_name], spans) for name in names if all(name in one for one in by_name)]


def _pooled(members: Sequence[Described], spans: np.ndarray) -> dict[str, Any]:
    """Return a figure of all members together."""
    name = str(members[0]["name"])
    power = 2.0 if name.endswith(("rms", "rms_force")) else 1.0
    shares = spans / spans.sum()
    values, errors = np.array([_mean_and_error(one, power, not name.endswith("mean")) for one in members]).T
    mean, error = float(shares @ values), float(np.sqrt(np.sum((shares * errors) ** 2)))
    verdict = max((str(one["verdict"]) for one in members), key=ORDER.index)
    if verdict != "no event" and _disagree(values, errors):
        verdict = DISAGREE
    if error == 0.0 or mean == 0.0:
        interval, kappa = Interval(mean, mean - error, mean + error), None
    else:
        freedom = error**4 / float(np.sum((shares * errors) ** 4)) * (BATCHES - 1)
        reach = error * float(scipy.stats.t.ppf(0.5 + 0.5 * CONFIDENCE, freedom))
        interval = interval_about(mean, reach, positive=not name.endswith("mean"))
        kappa = (error / mean / power) ** 2 * float(spans.sum())
    interval = interval.root() if power > 1.0 else interval
    relative = interval.relative if kappa is not None else None
    return {
        "name": name,
        "unit": members[0]["unit"],
        "value": interval.value,
        "low": interval.low,
        "high": interval.high,
        "relative": relative,
        "effective_samples": float(sum(one["effective_samples"] for one in members)),
        "relative_variance_times_time": kappa,
        "verdict": verdict,
        f"time_for_{100 * ASKED:g}_percent": None if relative is None else float(spans.sum()) * (relative / ASKED) ** 2,
    }


def _mean_and_error(one: Described, power: float, positive: bool) -> tuple[float, float]:
    """Return the mean, of squares for an rms, and its standard error, from a figure with its interval."""
    value, high, reached = float(one["value"]), float(one["high"]), quantile(CONFIDENCE, BATCHES)
    if value == 0.0:
        return 0.0, 0.0
    if positive and value > 0.0:
        mean = value**power
        return mean, power * mean * log(high / value) / reached
    return value, (high - value) / reached


def _disagree(values: np.ndarray, errors: np.ndarray) -> bool:
    """Return whether means differ by more than their errors allow: those between members over those within."""
    within = float(np.mean(errors**2))
    if within == 0.0:
        return bool(np.ptp(values) > 0.0)
    ratio = float(np.var(values, ddof=1)) / within
    return bool(scipy.stats.f.sf(ratio, len(values) - 1, len(values) * (BATCHES - 1)) < BY_CHANCE)
