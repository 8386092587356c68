"""Figures of a random motion with their intervals, from the block means of a run, and doubts on them.

No longer record takes away missed impacts, nor the bias of a scheme at its step, which has two causes.

* Energy. What noise brings is lost by damping and by the scheme. With the loss D by damping and contact and that by the
  scheme, A, negative where it creates energy, the motion has D / (D + A) of the energy that the noise would give it:
  damping takes energy in proportion to what there is. Both are measured in the run itself.
* Contact. Steps that are long beside a contact change its force and duration. How far, is known for a rattling mass by
  the steps in its contacts (`noise_bias`); the median of the contacts of a face counts here.

Measured on rattling masses: with 1, 4, 16 and 32 steps of implicit-midpoint in a contact A / (D + A) is 32, 26, 12 and
6.7 %, and the mean square of the velocity 31, 26, 12 and 8.4 % low.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, Literal

import numpy as np

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.diagnostics.energy_ledger import Ledger
from gapbeam.solver.diagnostics.statistics.batch_interval import (
    BATCHES,
    FEWEST,
    MOST_MISSED,
    STOPPING_RELAXATIONS,
    Interval,
    Verdict,
    batch_means,
    correlation_time,
    interval_of_mean,
    interval_of_percentile,
    stopping_interval,
    varies,
    verdict_on,
)
from gapbeam.solver.integrators.time_scheme import NoiseBias, bias_at
from gapbeam.solver.schema.record_table import SLIP_MODES

Doubt = Literal["not resolved", "biased"]

LEAST = 0.02  # of a figure: smaller biases, which are estimates, raise no doubt by themselves
COUNTED = ("impact_rate", "impact_duration", "impact_impulse", "approach_speed")
"""Figures of a face that depend on how many impacts were seen."""

WORK_RATE = "work_rate"
PARTS_OF_WORK = tuple(f"{mode}_{WORK_RATE}" for mode in SLIP_MODES)
"""Figures of a face that depend on when its impacts begin and end as well."""

OF_SHORT_CONTACTS = ("contact_share", "rms_force")
"""Figures of a face that hang on touches and partings which are short beside a step, as those of impacts do.

By how much they are off is not known where many of these are missed. Measured on a tube in three holes, a tenth of its
impacts missed: the contact share was 5 % low where a mass with as many steps in its contacts has 10 % too much; the
mean force and the work rate were off by 0.2 and 0.1 %.
"""

LEAST_STEPS = 6.0
"""Steps in the time of an impact. Bounces with 6 steps, whose first half counts, lack 3 %; with 4, 6 %."""


@dataclass(frozen=True)
class Doubts:
    """Doubts on the figures of a run.

    Attributes:
        missed: Part of the impacts that steps could not see, by face.
        energy: Relative error of the energy that the scheme leaves; negative: too little.
        contacts: Steps in the median contact, by face.
        table: Bias of the scheme; empty: not measured.
        impact_steps: Steps in the time at the begin of a contact that counts as its impact.
        still: Faces whose work of sliding is within the round-off of the energy balance: nothing slides there.
    """

    missed: Mapping[str, float] = field(default_factory=dict)
    energy: float = 0.0
    contacts: Mapping[str, float] = field(default_factory=dict)
    table: tuple[NoiseBias, ...] = ()
    impact_steps: float = inf
    still: frozenset[str] = frozenset()

    def rests(self, name: str) -> bool:
        """Return whether a figure is a work of sliding of a face on which nothing slides."""
        owner, _, figure = name.rpartition(".")
        return figure.endswith(WORK_RATE) and owner.removeprefix("face.") in self.still

    def bias(self, name: str) -> float | None:
        """Return about how far a figure is off by the scheme, relative; None: not known."""
        owner, _, figure = name.rpartition(".")
        kind, _, of = owner.partition(".")
        if kind == "probe":
            return 0.5 * self.energy if figure.endswith("rms") else None
        row = bias_at(self.table, self.contacts[of]) if of in self.contacts else None
        if row is not None and self.missed_of(name) > MOST_MISSED:
            return None
        if row is None:
            return self.energy if figure == "mean_force" or figure.endswith(WORK_RATE) else None
        return {
            "contact_share": row.contact_share,
            "mean_force": row.mean_force,
            "rms_force": 0.5 * row.mean_square_force,
            "impact_rate": row.impact_rate,
            WORK_RATE: row.mean_force + 0.5 * row.mean_square,
        }.get(figure)

    def missed_of(self, name: str) -> float:
        """Return the part of the impacts that a figure lacks; 0 for figures that do not hang on single impacts."""
        owner, _, figure = name.rpartition(".")
        kind, _, face = owner.partition(".")
        concerned = kind == "face" and figure in (*COUNTED, *PARTS_OF_WORK, *OF_SHORT_CONTACTS)
        return self.missed.get(face, 0.0) if concerned else 0.0

    @property
    def too_few_steps(self) -> str | None:
        """Steps in the time of an impact, with the number needed, where too few to split a work rate; else None."""
        if self.impact_steps >= LEAST_STEPS:
            return None
        return f"has {self.impact_steps:.2g} steps, and needs {LEAST_STEPS:g}"

    def splits_too_early(self, name: str) -> bool:
        """Return whether a figure is a part of a work rate that steps are too long to separate from the others."""
        return self.too_few_steps is not None and name.rpartition(".")[2] in PARTS_OF_WORK

    def on(self, name: str, relative: float, least: float = LEAST) -> Doubt | None:
        """Return the doubt on a figure that is known within a relative error by chance; None: there is none.

        Args:
            name: Name of the figure.
            relative: Half width of its interval over the figure.
            least: Smaller biases raise no doubt.
        """
        if self.missed_of(name) > MOST_MISSED or self.splits_too_early(name):
            return "not resolved"
        bias = self.bias(name)
        return "biased" if bias is not None and abs(bias) > max(relative, least) else None

    def words(self, name: str, doubt: Doubt) -> str:
        """Return a doubt on a figure in a sentence."""
        if doubt == "not resolved" and self.splits_too_early(name):
            return (
                f"the time that counts as impact {self.too_few_steps}: "
                "a longer wear.impact_time or a smaller time.step separates the parts; their sum is not concerned"
            )
        if doubt == "not resolved":
            return f"{self.missed_of(name):.1%} of the impacts of its face fell between two steps and were missed"
        bias = self.bias(name) or 0.0
        return f"the scheme in its step makes it about {abs(bias):.1%} too {'small' if bias < 0.0 else 'large'}"

    def describe(self, names: list[str]) -> dict[str, Any]:
        """Return the entries of the summary for figures of these names."""
        biases = {name: found for name in names if (found := self.bias(name)) is not None}
        counted: dict[str, Any] = {} if self.impact_steps == inf else {"steps_in_impact": self.impact_steps}
        counted |= {"still": sorted(self.still)} if self.still else {}
        return {"energy": self.energy, "steps_in_contact": dict(self.contacts), **counted, "figures": biases}

    @classmethod
    def restored(cls, statistics: Mapping[str, Any]) -> Doubts:
        """Return the doubts on a part of a run, from the statistics in its summary; without the table of the scheme."""
        bias = statistics.get("scheme_bias") or {}
        missed, energy = statistics.get("missed_impacts") or {}, float(bias.get("energy") or 0.0)
        steps, still = float(bias.get("steps_in_impact") or inf), frozenset(bias.get("still") or ())
        return cls(missed, energy, impact_steps=steps, still=still)


def energy_bias(ledger: Ledger) -> float:
    """Return by how much the energy of a motion under noise is off by the scheme, relative; 0 within round-off."""
    if abs(ledger.algorithmic) <= ledger.round_off:
        return 0.0
    brought = ledger.lost + ledger.algorithmic
    return ledger.lost / brought - 1.0 if brought > 0.0 else inf


ASKED = 0.02  # relative half width for which the time is given
OF_FACES = {"contact_share": "1", "mean_force": "N", "impact_rate": "1/s"}
OF_IMPACTS = {"impact_duration": ("s", 0), "impact_impulse": ("N s", 1), "approach_speed": ("m/s", 3)}
"""Means over impacts: unit, and the column whose sum is divided by the number of impacts."""
_CLOSINGS, _SQUARE, _WORK = 2, 4, 5  # columns
RMS_FORCE = "rms_force"
OF_PROBES = {"mean": "m", "rms": "m", "low": "m", "high": "m", "acceleration_rms": "m/s^2"}
LATERAL = "lateral_"
PERCENTILES = {"low": 0.05, "high": 0.95}
NOT_ASKED = ("mean", *PERCENTILES)
"""Figures of probes that may be 0, so that a relative error of theirs means nothing."""


@dataclass(frozen=True)
class StatisticFigure:
    """A figure of a random motion.

    Attributes:
        name: Such as face.base.contact_share or probe.tip.rms.
        unit: SI unit, "1" where there is none.
        interval: Value and 95 % interval.
        samples: Independent samples with the same uncertainty; at most the number of blocks.
        relaxation: Relaxation time of what is averaged, s.
        verdict: Whether the interval can be relied on; "no event": the face never closed, or never opened; "not
            resolved": steps were too long to see all impacts; "biased": by the scheme, by more than the interval.
        seconds: Seconds of the record behind the burn-in, s.
    """

    name: str
    unit: str
    interval: Interval
    samples: float
    relaxation: float
    verdict: Verdict | Doubt | Literal["no event"]
    seconds: float

    def doubted(self, doubts: Doubts) -> StatisticFigure:
        """Return the figure, which is not good where there are doubts on it, and 0 where it is round-off."""
        if doubts.rests(self.name):
            return replace(self, interval=Interval(0.0, 0.0, 0.0), verdict="no event")
        doubt = doubts.on(self.name, self.interval.relative) if self.verdict == "good" else None
        return self if doubt is None else replace(self, verdict=doubt)

    @property
    def needed(self) -> float | None:
        """Time behind the burn-in after which the interval is +- 2 %, s; None: not known."""
        relative = self.interval.relative
        return self.seconds * (relative / ASKED) ** 2 if np.isfinite(relative) else None


@dataclass(frozen=True)
class AveragedSeries:
    """Series whose mean, or percentile, is a figure.

    Attributes:
        name: Name of the figure.
        unit: Unit of the figure.
        values: Means over blocks, (blocks,); of a percentile the values at their ends.
        positive: Whether the figure is positive by its meaning.
        rare: Whether it counts events that blocks may lack.
        root: Whether the figure is the square root of the mean.
        share: Share of values below a percentile; None: the figure is a mean.
        events: Number of events in each block, for a mean over events, (blocks,).
    """

    name: str
    unit: str
    values: np.ndarray
    positive: bool = False
    rare: bool = False
    root: bool = False
    share: float | None = None
    events: np.ndarray | None = None

    def interval(self, of: Callable[[np.ndarray, bool], Interval] = interval_of_mean) -> Interval:
        """Return the figure with its interval."""
        if self.share is not None:
            return interval_of_percentile(self.values, self.share)
        found = of(self.values, self.positive)
        return found.root() if self.root else found

    @property
    def averaged(self) -> np.ndarray:
        """Averaged values, (blocks,): for a percentile, 1 where the motion is below it."""
        if self.share is None:
            return self.values
        return np.asarray(self.values <= np.quantile(self.values, self.share), dtype=float)

    def judged(self, block: float, slowest: float) -> StatisticFigure:
        """Return the figure with its verdict.

        Args:
            block: Length of a block, s.
            slowest: Relaxation time of the slowest figure of the run, in blocks. Oscillations about a mean that
                drifts hide the drift from their own correlation time.
        """
        series = self.averaged
        tau = correlation_time(series, block)
        return StatisticFigure(
            self.name,
            self.unit,
            self.interval(),
            len(series) * block / (2.0 * tau),
            tau,
            self._verdict(series, slowest),
            len(series) * block,
        )

    def met(self, relative_error: float, slowest: float) -> bool:
        """Return whether a run may end here: the widest of several intervals is narrow, and the record long enough.

        Args:
            relative_error: Half width over the figure.
            slowest: As in `judged`.
        """
        count = len(self.values)
        if self.share is not None or count < max(FEWEST, STOPPING_RELAXATIONS * slowest):
            return False
        if self._verdict(self.values, slowest) in ("not settled", "no event"):
            return False
        return self.interval(stopping_interval).relative <= relative_error

    def _verdict(self, series: np.ndarray, slowest: float) -> Verdict | Literal["no event"]:
        counted = self.values if self.events is None else self.events
        if self.rare and not varies(counted):
            return "no event"
        if self.events is not None and len(counted) >= FEWEST and np.any(batch_means(counted, BATCHES) == 0.0):
            return "too short"
        return verdict_on(series, self.rare, slowest)


def may_be_asked(name: str) -> bool:
    """Return whether a relative error of a figure means something: not of means and percentiles, which may be 0."""
    return name.rpartition(".")[2].removeprefix(LATERAL) not in NOT_ASKED


def face_series(face: str, means: np.ndarray) -> list[AveragedSeries]:
    """Return the series behind the figures of a face.

    Args:
        face: Its name.
        means: Means of contact time, impulse, closings, approach speeds, square of the force, and the work of sliding
            with its parts where it is measured, per second, (blocks, 5 or 9).
    """
    closings = means[:, _CLOSINGS]
    rates = [
        AveragedSeries(f"face.{face}.{figure}", unit, means[:, number], positive=True, rare=True)
        for number, (figure, unit) in enumerate(OF_FACES.items())
    ]
    squares = means[:, _SQUARE]
    rates.append(AveragedSeries(f"face.{face}.{RMS_FORCE}", "N", squares, positive=True, rare=True, root=True))
    if means.shape[1] > _WORK:
        rates += [
            AveragedSeries(f"face.{face}.{figure}", "W", means[:, column], positive=True, rare=True)
            for column, figure in enumerate((WORK_RATE, *PARTS_OF_WORK), _WORK)
        ]
    return rates + [
        AveragedSeries(
            f"face.{face}.{figure}", unit, _over_events(means[:, column], closings), True, True, events=closings
        )
        for figure, (unit, column) in OF_IMPACTS.items()
    ]


def _over_events(sums: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return a series whose mean is R = mean(sums) / mean(counts), and whose scatter is that of R: (blocks,).

    R + (sums - R counts) / mean(counts), the ratio estimator: to first order its mean errs as the ratio does.
    Source: Law, Simulation Modeling and Analysis (2015), section 9.5.3, for ratios of means.
    """
    mean = float(counts.mean())
    if mean <= 0.0:
        return np.zeros_like(sums)
    ratio = float(sums.mean()) / mean
    return np.asarray(ratio + (sums - ratio * counts) / mean)


def probe_series(probe: str, means: np.ndarray, ends: np.ndarray, direction: str = "") -> list[AveragedSeries]:
    """Return the series behind the figures of a probe in a direction.

    Args:
        probe: Its name.
        means: Means of displacement, its square and the square of the acceleration, (blocks, 3).
        ends: Displacement at the ends of the blocks, (blocks,).
        direction: "" for the bending direction, "lateral_" across it.
    """
    name = f"probe.{probe}.{direction}"
    x = means[:, 0]
    middle = x.mean()
    fluctuation = means[:, 1] - 2.0 * middle * x + middle * middle
    return [
        AveragedSeries(f"{name}mean", "m", x),
        AveragedSeries(f"{name}rms", "m", fluctuation, positive=True, root=True),
        *(AveragedSeries(f"{name}{figure}", "m", ends, share=share) for figure, share in PERCENTILES.items()),
        AveragedSeries(f"{name}acceleration_rms", "m/s^2", means[:, 2], positive=True, root=True),
    ]


def own_series(one: Figure, means: np.ndarray, ends: np.ndarray) -> AveragedSeries:
    """Return the series behind a figure of one's own.

    Args:
        one: The figure: a mean, rms, share or quantile of the run.
        means: Means of its quantity, of a share of 1 above the limit and 0 below, and of the square, (blocks, 2).
        ends: Its quantity at the ends of the blocks, (blocks,).
    """
    x, share = means[:, 0], one.statistic == "share"
    if one.statistic == "quantile":
        return AveragedSeries(one.name, one.unit, ends, share=one.level)
    if one.statistic != "rms":
        return AveragedSeries(one.name, one.unit, x, positive=share, rare=share)
    middle = x.mean()
    return AveragedSeries(
        one.name, one.unit, means[:, 1] - 2.0 * middle * x + middle * middle, positive=True, root=True
    )


def figure_names(faces: tuple[str, ...], probes: tuple[str, ...], in_space: bool, slides: bool = False) -> list[str]:
    """Return the names of all figures of a run.

    Args:
        faces: Names of the faces.
        probes: Names of the probes.
        in_space: Whether the beam leaves its bending plane.
        slides: Whether the work of sliding is measured.
    """
    of_faces = [*OF_FACES, RMS_FORCE, *([WORK_RATE, *PARTS_OF_WORK] if slides else [])]
    directions = ("", LATERAL) if in_space else ("",)
    of_faces += OF_IMPACTS
    return [f"face.{face}.{figure}" for face in faces for figure in of_faces] + [
        f"probe.{probe}.{direction}{figure}" for probe in probes for direction in directions for figure in OF_PROBES
    ]
