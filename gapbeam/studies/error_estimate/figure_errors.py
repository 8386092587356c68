"""Errors of the key figures, from the differences between a run and its companions.

With f of the run, R of its reference, and A, C, D, H, K of the companions (finest, coarser mesh, four times the step,
half the step, stiffer contact),

    E = max(2 |R - A|, |R - C|, |R - D| / 2, 4/3 |R - H|) + |f - R| + 3.4 |R - K|

each term where there is such a companion; of largest recorded forces 1.75 times, of smoothed accelerations 1.5 times as
much up to the horizon. The reference marches with twice the step of the run, by a scheme that conserves energy: |f - R|
is the error of a scheme of first order, and three times that of one of second order; it has the energy that another
scheme creates or takes and, of full models, the error of the reduced basis, too. A thorough estimate has a reference by
the scheme and with the step of the run. |R - K| belongs to a contact stiffness that was computed and stands for rigid
contact: the duration of contacts goes as K^(-1/2), so that the distance from rigid contact is 1 / (1 - 2^(-1/2)) = 3.4
times the difference that doubling K makes.

Twice the step shows no error of contacts that it resolves as little as the run. |f - R| of a face, and beyond the
horizon of all figures, is at least the share of `lost_in_steps`: (2 d / pi) tan(pi / (2 d)) - 1 for a contact of d
steps. Motions that chatter in contacts of fewer than ten steps differ by chance, and their ranges agree by chance: a
difference of two steps in the range of a displacement or acceleration is at least 0.35 of the range of the difference
of the two motions, as much as the rms of a sine is of its range.

What settles still moves. With the figures v_1 ... v_k of the windows of a settled part, |f - v_k| + d is added to E: d
is the last difference of neighbors or, where all have one sign, what a geometric series of them leaves, d q / (1 - q).

The factor 2 belongs to a mesh of first order. Where coarser and finer mesh show a lower one, q = |R - A| / |R - C|
above 1/2, as at an edge that carries the contact, the differences of ever finer meshes add up to |R - A| / (1 - q),
which is taken, q up to 9/10. Differences of harmonics are the amplitudes of the difference of two motions: amplitudes
of motions that differ by phase agree by chance. An error E of the first one, H, is mixed into the others by contact,
which is quadratic in small changes of the motion: their errors are at least min(E, E^2 / (2 H)).

Where plane companions stand for a solid, differences are taken relative to the figures of the plane and enlarged by a
tenth, and |f - R| falls away. A motion across another one that is a million times as large, beyond the horizon a
thousand times, is made by the asymmetry of the mesh, and its figures have no error. Where the horizon ends a span, be
it within the second half, motions are about to part: E is twice as large there. Of a part up to the horizon in one
window, the change of f with an end later by two records of the companions is added: a blow that comes just after the
end of the run's part comes before that in others.

Beyond the horizon figures are means over windows, and so is each term: it differs by chance as much as two means do.
With the variance v of a mean, c = t sqrt(2 v) and Student's t (95 %, two-sided),

    E = 1.15 (c + max_i F_i max(0, |d_i| - c))

with the factors F_i of the terms above: what differs by more than chance is an error of step, mesh or stiffness.
The factor 1.15 is that of windows that follow each other.

The factors but those derived here were found by comparing estimates with converged marches (benchmarks.drawn_cases).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import scipy

from gapbeam.postprocess.signals.figure_names import DISPLACEMENT, FORCES, IMPULSE, LARGEST_FORCE, SMOOTHED_ACCELERATION
from gapbeam.postprocess.signals.steady_figures import WindowFigure
from gapbeam.solver.case.figure_table import parts_of
from gapbeam.solver.diagnostics.contact_episodes import RESOLVING_STEPS
from gapbeam.solver.system.operators import Array
from gapbeam.studies.error_estimate.companions import COARSER, FINER, FINEST, FOURFOLD, HALF_STEP, STIFFER, TWICE
from gapbeam.studies.error_estimate.force_peaks import (
    BEYOND_HORIZON,
    FEWEST_WINDOWS,
    HARMONIC,
    OF_MOTION,
    RESOLVED,
    SETTLED,
    Averages,
    FigureSpan,
    Span,
    key_figures,
    lost_in_steps,
)
from gapbeam.studies.error_estimate.motion_horizon import STILL
from gapbeam.studies.error_estimate.motion_record import MotionRecord, lost_between_records

FACTORS = {FINEST: 2.0, COARSER: 1.0, FOURFOLD: 0.5, HALF_STEP: 4.0 / 3.0}
OTHER_STEPS = (TWICE, FOURFOLD, HALF_STEP)
RIGID_FACTOR = 1.0 / (1.0 - 0.5**0.5)
MODEL = "step and model"  # the difference from the reference
SHORT, EDGE = "steps in a contact", "end of the part"
RECORDS = "records"  # what they leave open of a figure of one's own, and miss of ranges
LATER = 2  # records of the companions, by which the end may be late
SETTLING = "settling"
QUICK, SLOW = 0.5, 0.99  # ratios of neighboring differences of windows
OF_A_SOLID = 1.1  # differences of a solid over those of its plane slice
PARTED, OF_FINER = 2.0, 2.0  # E is so much larger where motions are about to part; over what finer structures change
# Least differences of figures of two motions, which agree by chance, over those of the difference of the motions; of
# impulses, and of the records of figures of one's own, the share of the time in which they differ by less.
OF_CHATTER = {DISPLACEMENT: 0.35, SMOOTHED_ACCELERATION: 0.35}
OF_ONE = {DISPLACEMENT: 0.1, SMOOTHED_ACCELERATION: 0.1, LARGEST_FORCE: 0.02, IMPULSE: 0.75}  # with one companion
OF_PEAKS = {LARGEST_FORCE: 1.75, SMOOTHED_ACCELERATION: 1.5}  # over errors of figures that follow ringing less
OF_WINDOWS = 1.15  # over errors of means of independent windows: neighbors in one motion follow each other
CONFIDENCE = 0.95
SAME_VARIANCE = 0.75  # of the ratios of two estimates of one variance lie below what is pooled
FIRST_ORDER, SLOWEST = 0.5, 0.9  # ratios of differences of finer meshes
RESTS = 1.0e-9  # of the largest displacement: a range that is smaller is round-off and the residue of the seat
BARELY = 1.0e-5  # likewise, where none of its digits is right: the asymmetry of a mesh moves a beam so far sideways
LEAST_PART = 1.0e-6  # of a figure: less is no error
BESIDE = 1.0e-3  # of a motion across another, beyond the horizon: what moves less grows out of asymmetry
ROUND_OFF = 1.0e-12  # of a figure: a plane one that is smaller is no scale


@dataclass(frozen=True)
class FigureError:
    """A key figure of a run with its error.

    Attributes:
        name: Such as "tip peak-to-peak displacement".
        unit: SI unit.
        span: Part of the run.
        value: Mean over the windows of the span.
        error: Estimate of its error; None: not known.
        parts: Differences from each companion, in the unit of the figure, by name.
        standard_error: Standard error of the mean over windows.
        window: Width of the mean that the figure is, s; None: it is none.
        rests: Whether it is the displacement of a point that does not move.
        own: Whether it is a figure of one's own.
    """

    name: str
    unit: str
    span: str
    value: float
    error: float | None
    parts: Mapping[str, float]
    standard_error: float
    window: float | None = None
    rests: bool = False
    own: bool = False

    @property
    def untouched(self) -> bool:
        """True for the force on a face that neither the run nor a companion touches: how near it comes is not known."""
        return self.value == 0.0 == self.error and not self.own and self.name.endswith(FORCES)

    @property
    def relative(self) -> float | None:
        """The error relative to the figure; None: not known, larger than the figure, or of a point at rest."""
        known = not self.rests and self.error is not None and self.error <= abs(self.value) and self.value != 0.0
        return self.error / abs(self.value) if known and self.error is not None else None

    def with_part(self, name: str, share: float) -> FigureError:
        """Return the figure, whose error includes one more part of that share of its value, where it is known."""
        if self.error is None or share < LEAST_PART:
            return self
        part = share * abs(self.value)
        return replace(self, error=self.error + part, parts={**self.parts, name: part})

    def as_data(self) -> dict[str, Any]:
        """Return the figure for summary.json."""
        return {
            "name": self.name,
            "unit": self.unit,
            "span": self.span,
            "value": self.value,
            "error": None if self.untouched else self.error,
            "relative_error": self.relative,
            "standard_error": self.standard_error,
            "window": self.window,
            "differences": dict(self.parts),
        }


def figure_errors(
    run: MotionRecord,
    companions: Mapping[str, MotionRecord],
    reference: str | None,
    span: Span,
    in_plane: bool,
    averages: Averages,
    records: int = 1,
    meshed: bool = False,
    lost: Mapping[str, float] = MappingProxyType({}),
    factors: Mapping[str, float] = FACTORS,
) -> list[FigureError]:
    """Return the key figures of a run over a span, with their errors.

    Args:
        run: The motion of the run.
        companions: Motions of its companions, by name.
        reference: The companion with which the others are compared; None: they are compared with the run.
        span: Part of the run.
        in_plane: Whether plane companions stand for a solid.
        averages: Widths of the means.
        records: Companions have the first of every so many records of the run.
        lost: Shares of figures that the step may falsify in short contacts, by face and OF_MOTION.
        meshed: Whether all that the finest companion changes is the mesh and the basis of a solid.
        factors: Factors from the difference of a companion to the error that it shows.
    """
    reported = key_figures(run, span, averages)
    mine = reported if records == 1 else key_figures(run.thinned(records), span, averages)
    theirs = {name: key_figures(motion, span, averages) for name, motion in companions.items()}
    same = mine if reference is None else theirs[reference]
    longer = replace(span, width=span.width + LATER * records * run.interval)
    later = key_figures(run, longer, averages) if span.cut and span.count == 1 else {}
    usual_motion = run.thinned(records) if reference is None else companions[reference]
    alone = companions.keys() <= {HALF_STEP, STIFFER, FINER}
    least = OF_ONE if alone else {}
    if max(lost.values(), default=0.0) > RESOLVED:
        least = {**least, **OF_CHATTER}
    left = _left_open(run, span, averages) if alone or isinstance(span, FigureSpan) else {}
    apart = {
        name: _apart(usual_motion, motion, span, averages, least if name in (*OTHER_STEPS, FINER) else {})
        for name, motion in companions.items()
    }
    if not in_plane:
        here, other_step = run.thinned(records), least if reference in OTHER_STEPS else {}
        apart[MODEL] = _apart(here, usual_motion, span, averages, other_step)
    farthest = run.farthest or float(np.abs(run.displacement).max(initial=0.0))
    moves = run.ranges >= (STILL if span.predictable else BESIDE) * run.spans
    still = {probe for probe, moving in zip(run.probes, moves, strict=True) if not moving}
    found = []
    for name, figure in reported.items():
        if any(name not in one for one in (mine, same, *theirs.values())):
            found.append(FigureError(name, figure.unit, span.name, figure.mean, None, {}, 0.0, own=True))
            continue
        usual = same[name].mean
        ratio = OF_A_SOLID * _ratio(mine[name].mean, usual) if in_plane else 1.0
        parts = {
            other: ratio * max(apart[other].get(name, 0.0), abs(usual - theirs[other][name].mean))
            for other in theirs
            if other != reference
        }
        if reference is not None and not in_plane:
            parts[MODEL] = max(apart[MODEL].get(name, 0.0), abs(mine[name].mean - usual))
        share = _lost_of(name, run.faces, lost, span)
        error = None
        if parts and _probe_of(name, run.probes) not in still:
            if share:
                parts[SHORT] = share * abs(figure.mean)
            everyone = [mine[name], *(one[name] for one in theirs.values())]
            known = parts | _later_meshes(parts) if meshed else parts
            larger = 1.0 if alone else next((by for end, by in OF_PEAKS.items() if name.endswith(end)), 1.0)
            if span.name == SETTLED:
                parts[SETTLING] = left_to_settle(figure.values)
                error = larger * _error(known, span, factors) + parts[SETTLING]
            elif span.predictable:
                if name in later:
                    parts[EDGE] = abs(later[name].mean - figure.mean)
                error = larger * _error(known, span, factors) + parts.get(EDGE, 0.0)
            else:
                error = _error_of_means(known, everyone, ratio, factors)
        if left.get(name) and (error is not None or figure.unit == "1"):
            parts[RECORDS] = left[name]
            error = left[name] + (error or 0.0)
        rests = figure.unit in ("m", "rad") and _rests(abs(figure.mean), error, farthest)
        found.append(FigureError(
            name, figure.unit, span.name, figure.mean, error, parts, figure.uncertainty, averages.width_of(name), rests,
            isinstance(span, FigureSpan),
        ))  # fmt: skip
    return list(_mixed(found)) if span.predictable else found


def figure_spans(
    run: MotionRecord, reached: float, horizon: float | None, settled: Span | None
) -> Iterator[FigureSpan]:
    """Yield the parts of a run that figures of one's own are taken over, where companions have reached their end.

    Args:
        run: The motion of the run.
        reached: Time up to which companions went, s.
        horizon: Time up to which the motion is predictable, s; None: up to the end.
        settled: The settled part, which repeats and so is predictable; None: there is none.
    """
    for number, figure in enumerate(run.figures):
        end = run.end if figure.last is None else figure.last
        begin = min(figure.start, end)
        if end > reached + run.interval:
            continue
        known = horizon is None or end <= horizon or (settled is not None and begin >= settled.start)
        words = f"t = {end:.6g} s" if figure.statistic == "value" else f"{begin:.6g} s to {end:.6g} s"
        yield FigureSpan(words if known else BEYOND_HORIZON, begin, end - begin, 1, None, figure, number)


def lost_by_own(run: MotionRecord, own: FigureSpan, step: float) -> dict[str, float]:
    """Return the shares that short contacts may falsify of a figure of one's own: contacts in its part, or about it.

    Args:
        run: The motion of the run.
        own: Part that the figure is taken over; of a value at a time only the end counts.
        step: Time step, s.
    """
    assert own.figure is not None
    around = RESOLVING_STEPS * run.interval
    begin = own.end if own.figure.statistic == "value" else own.start
    return lost_in_steps(run.between(max(0.0, begin - around), own.end + around), step)


def left_to_settle(values: Array) -> float:
    """Return by how much the mean of windows may miss the figure that they settle to; see the module.

    Args:
        values: Values of the windows, one after the other, (windows,).
    """
    steps = np.diff(values)
    if not steps.size:
        return 0.0
    last, ratio = abs(float(steps[-1])), QUICK
    if steps.size > 1 and (np.all(steps > 0.0) or np.all(steps < 0.0)):
        ratio = min(max(float(abs(steps[-1] / steps[0])) ** (1.0 / (steps.size - 1)), QUICK), SLOW)
    return float(abs(values.mean() - values[-1])) + last * ratio / (1.0 - ratio)


def _mixed(found: Iterable[FigureError]) -> Iterator[FigureError]:
    """Yield figures whose harmonics have at least the error that comes from the first one, which is before them."""
    least = 0.0
    for one in found:
        if one.name.endswith(f"{HARMONIC}1"):
            error, size = one.error or 0.0, abs(one.value)
            least = min(error, 0.5 * error**2 / size) if size > 0.0 else error
        elif HARMONIC in one.name and one.error is not None:
            one = replace(one, error=max(one.error, least))
        yield one


def _probe_of(name: str, probes: Iterable[str]) -> str:
    """Return the probe of a figure, "tip lateral" rather than "tip"; empty: it has none."""
    return max((probe for probe in probes if name.startswith(f"{probe} ")), key=len, default="")


def _rests(moved: float, error: float | None, farthest: float) -> bool:
    """Return whether a displacement is none: round-off, or the residue of the seat, without a digit that is right."""
    return moved <= RESTS * farthest or (moved <= BARELY * farthest and error is not None and error > moved)


def _lost_of(name: str, faces: Iterable[str], lost: Mapping[str, float], span: Span) -> float:
    """Return the share of a figure that short contacts falsify: of faces, and of all statistics of a motion."""
    if isinstance(span, FigureSpan):
        assert span.figure is not None
        place, peak = span.figure.place, span.figure.statistic in ("maximum", "peak-to-peak")
        end = f" {LARGEST_FORCE}" if peak and span.figure.quantity == "contact_force" else ""
        places = [place, *parts_of(place, faces)] if place else [OF_MOTION]
        return max((lost.get(f"{one}{end}", 0.0) for one in places), default=0.0)
    for face in faces:
        if name.startswith(f"{face} "):
            return lost.get(name, lost.get(face, 0.0))
    return 0.0 if span.predictable else lost.get(OF_MOTION, 0.0)


def _apart(
    one: MotionRecord, other: MotionRecord, span: Span, averages: Averages, least: Mapping[str, float]
) -> dict[str, float]:
    """Return the least differences of figures up to the horizon that follow from the difference of two motions.

    Args:
        one: A motion.
        other: The other one.
        span: Part of them.
        averages: Widths of the means.
        least: Least difference of a figure over the same figure of the difference, by the end of its name.
    """
    if not span.predictable or not (span.frequency or least):
        return {}
    count = min(len(one.times), len(other.times))
    left, right = one.first(count), other.first(count)
    if isinstance(span, FigureSpan):
        return span.apart(left, right, least[IMPULSE]) if IMPULSE in least else {}
    moved = ("displacement", "velocity_gained", "force", "impulse")
    between = replace(left, **{name: getattr(left, name) - getattr(right, name) for name in moved})
    between = replace(between, force=np.abs(between.force))
    figures = key_figures(between, span, averages)
    found = {name: figure.mean for name, figure in figures.items() if HARMONIC in name}
    for end, share in least.items():
        found |= {name: share * figure.mean for name, figure in figures.items() if name.endswith(f" {end}")}
    if IMPULSE in least:  # not the moments in which one motion alone has hit
        parts = [np.abs(part.impulse - part.impulse[0]) for part in span.windows(between)]
        usual = np.mean([np.quantile(part, least[IMPULSE], axis=0) for part in parts], axis=0)
        found |= {f"{face} {IMPULSE}": float(apart) for face, apart in zip(one.faces, usual, strict=True)}
    return found


def _left_open(run: MotionRecord, span: Span, averages: Averages) -> dict[str, float]:
    """Return the errors that the records of a run leave, by figure: means over the windows of a span."""
    if isinstance(span, FigureSpan) and span.figure is not None:
        return {span.figure.name: span.left_open(run)}
    windows = [lost_between_records(one, averages.acceleration) for one in span.windows(run)]
    return {name: float(np.mean([one[name] for one in windows])) for name in windows[0]}


def _later_meshes(parts: Mapping[str, float]) -> dict[str, float]:
    """Return the difference of the finest companion as large as that of a mesh of first order would be."""
    coarse, fine = parts.get(COARSER, 0.0), parts.get(FINEST, 0.0)
    if fine <= FIRST_ORDER * coarse or coarse == 0.0:
        return {}
    return {FINEST: fine * (1.0 - FIRST_ORDER) / (1.0 - min(fine / coarse, SLOWEST))}


def _ratio(solid: float, plane: float) -> float:
    """Return a figure of a solid over that of its slice; 1 where the slice has none."""
    return abs(solid / plane) if abs(plane) > ROUND_OFF * abs(solid) else 1.0


def _error(parts: Mapping[str, float], span: Span, shares: Mapping[str, float]) -> float:
    error = max((factor * parts[name] for name, factor in shares.items() if name in parts), default=0.0)
    error += OF_FINER * parts.get(FINER, 0.0) + max(parts.get(MODEL, 0.0), parts.get(SHORT, 0.0))
    error += RIGID_FACTOR * parts.get(STIFFER, 0.0)
    return (PARTED if span.cut else 1.0) * error


def _error_of_means(
    parts: Mapping[str, float], figures: Iterable[WindowFigure], ratio: float, shares: Mapping[str, float]
) -> float | None:
    """Return the error of a mean over windows; None with fewer than four windows, which say nothing."""
    values = [figure.values for figure in figures]
    count = values[0].size
    if count < FEWEST_WINDOWS:
        return None
    within = float(np.mean([one.var(ddof=1) for one in values]) / count)
    between = float(np.var([one.mean() for one in values], ddof=1))
    scattered = quantile_of_means(within, between, len(values), count)
    chance = max(ratio, 1.0) * float(np.sqrt(2.0)) * scattered
    factors = {**shares, MODEL: 1.0, SHORT: 1.0, STIFFER: RIGID_FACTOR, FINER: OF_FINER}
    excess = max(factors[name] * max(0.0, part - chance) for name, part in parts.items())
    return OF_WINDOWS * (chance + excess)


def quantile_of_means(within: float, between: float, means: int, count: int) -> float:
    """Return the distance of a mean from its expectation by chance, in 95 %.

    The scatter of windows and that of means estimate the same variance, and are pooled, unless the F test finds that
    means differ by more than their windows explain: these have something in common then, and only the means count.
    Source: Bancroft, Ann. Math. Statist. 15 (1944) 190; the level of 25 % is that of Bozivich, Bancroft and Hartley,
    Ann. Math. Statist. 27 (1956) 1017.

    Args:
        within: Variance of a mean by the scatter of its windows.
        between: Variance of the means.
        means: Their number.
        count: Windows of each.
    """
    free, level = (means * (count - 1), means - 1), 0.5 + 0.5 * CONFIDENCE
    if free[1] < 2:  # two means say nothing of how means differ
        return float(scipy.stats.t.ppf(level, free[0]) * np.sqrt(within))
    if between > within * float(scipy.stats.f.ppf(SAME_VARIANCE, free[1], free[0])):
        return float(scipy.stats.t.ppf(level, free[1]) * np.sqrt(between))
    pooled = (free[0] * within + free[1] * between) / sum(free)
    return float(scipy.stats.t.ppf(level, sum(free)) * np.sqrt(pooled))
