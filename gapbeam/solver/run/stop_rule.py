"""Rule that ends a run once the interval of one of its statistics is narrow enough."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, pi
from typing import TYPE_CHECKING, Any

from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.beam_motions import bends_in_two_planes
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import overhang_frequency, rayleigh
from gapbeam.solver.case.solution_tables import RigidModel
from gapbeam.solver.diagnostics.statistics.batch_interval import BURN_IN_RELAXATIONS, STOPPING_RELAXATIONS
from gapbeam.solver.diagnostics.statistics.run_statistics import FEW, PointStatistics, RunStatistics
from gapbeam.solver.diagnostics.statistics.statistic_figures import WORK_RATE, Doubts, figure_names, may_be_asked
from gapbeam.solver.messages.errors import IntervalNotMet, UserError
from gapbeam.solver.messages.wording import apart, near

if TYPE_CHECKING:
    from gapbeam.solver.models.model import Model

DOUBTS = {"not resolved": "not resolved by the step", "biased": "biased by the scheme"}
CERTAINTY = ("effective_samples", "relative_variance_times_time")
LATER = 1.1  # times the instant of one look is the earliest instant of the next
LARGEST = 0.5  # relative error that may be asked for


@dataclass(frozen=True)
class StopRule:
    """Rule that may end a run before `time.end`.

    Looks follow from the steps alone, so that a run that continues from a checkpoint ends where it would have.

    Attributes:
        figure: Name of a statistic.
        relative_error: Half width of its 95 % interval over the figure.
        earliest: Time before which the run does not end, s.
    """

    figure: str
    relative_error: float
    earliest: float

    def refuse_misfit(self, case: Case) -> None:
        """Refuse a rule that a run of a case cannot follow.

        Raises:
            UserError: A run of the case cannot follow the rule.
        """
        if not (isfinite(self.relative_error) and 0.0 < self.relative_error <= LARGEST):
            found, most = apart(self.relative_error, LARGEST)
            raise UserError(
                f"`relative_error=`: found {found}; expected more than 0 and at most {most}, such as 0.01 for 1 %"
            )
        if not has_statistics(case):
            raise UserError(
                "`relative_error=`: no load of this case is random, or its analysis is not a transient: a response "
                "that repeats has no interval; expected a load of type random; leave the option out, or see the "
                "errors that a run estimates"
            )
        names = names_of(case)
        allowed = list(filter(may_be_asked, names))
        if self.figure not in allowed:
            meant = near(self.figure, allowed)
            means = f"; did you mean {meant}?" if meant else ""
            known = ": a mean may be 0, and a percentile, too" if self.figure in names else ""
            if case.wear is None and self.figure.endswith(WORK_RATE):
                known = ", without [wear] in the case, which measures it"
            raise UserError(f'`of=`: found "{self.figure}"{known}; expected one of {", ".join(allowed)}{means}')

    def looks_between(self, start: float, end: float) -> bool:
        """Return whether a look is due in a time after `start` up to `end`, s: `earliest`, and every tenth later."""
        due = self.earliest
        while due <= start:
            due *= LATER
        return due <= end

    def met(self, statistics: RunStatistics) -> bool:
        """Return whether the run may end."""
        return statistics.met(self.figure, self.relative_error)

    def judge(self, statistics: RunStatistics, end: float, narrow: bool, doubts: Doubts) -> dict[str, Any]:
        """Return the result of the rule for the summary.

        Args:
            statistics: Statistics at the end of the run.
            end: Time of this end, s.
            narrow: Whether the rule ended the run: the interval is narrow enough.
            doubts: Doubts on the figures. A doubt on the figure of the rule, beyond the error asked for, leaves the
                rule not met: a longer run would not help.
        """
        described = statistics.describe()
        figure = next((one for one in described["figures"] if one["name"] == self.figure), None)
        reached = None if figure is None or figure["relative"] is None else float(figure["relative"])
        needed = None
        if reached is not None and figure is not None and not narrow:
            burn = described["burn_in"]
            least = (STOPPING_RELAXATIONS + BURN_IN_RELAXATIONS) * statistics.decay
            needed = max(least, burn + (end - burn) * (reached / self.relative_error) ** 2)
        asked = {"figure": self.figure, "relative_error": self.relative_error, "earliest": self.earliest}
        doubt = None if figure is None else doubts.on(self.figure, self.relative_error, least=0.0)
        doubted = {} if doubt is None else {"doubt": doubt, "doubt_words": doubts.words(self.figure, doubt)}
        met = narrow and doubt is None
        known = {key: None if figure is None else figure[key] for key in CERTAINTY}
        found = {"met": met, "narrow": narrow, "reached": reached, "end": end, "time_needed": needed}
        return asked | found | known | doubted


def refuse_not_met(found: dict[str, Any] | None) -> None:
    """Pass a run whose interval is narrow enough.

    Args:
        found: Result of `StopRule.judge`; None: there is no rule.

    Raises:
        IntervalNotMet: The interval is too wide.
    """
    if found is None or found["met"]:
        return
    doubt = found.get("doubt_words")
    if found["narrow"]:
        raise IntervalNotMet(
            f"at t = {found['end']:.6g} s the 95 % interval of {found['figure']} is narrow enough, but {doubt}; a "
            "longer run does not change that, and the results are kept; try a smaller time.step, the scheme "
            "discrete-gradient, or a larger `relative_error=`"
        )
    reached, needed = found["reached"], found["time_needed"]
    width = "not known" if reached is None else f"+- {reached:.2%} of {certainty_words(found)}"
    longer = max(needed or 0.0, 1.1 * found["end"])
    advice = "a much longer `at_most=`" if needed is None else f"`at_most=` of {longer:.3g} s"
    raise IntervalNotMet(
        f"at t = {found['end']:.6g} s the 95 % interval of {found['figure']} is {width}; expected "
        f"+- {found['relative_error']:.2%} on enough independent samples; the results are kept; try {advice} with "
        f"`overwrite=True`, or a larger `relative_error=`{'' if doubt is None else f'; besides, {doubt}'}"
    )


def statistics_words(summary: Mapping[str, Any]) -> str:
    """Return the statistics of a run under noise for its last line; empty for other runs.

    The figure that ended it, with its verdict where that is not good, and how many figures are in doubt.
    """
    found = summary.get("statistics", {})
    verdicts = {one["name"]: one["verdict"] for one in found.get("figures", ())}
    words = ""
    if (until := found.get("until")) is not None:
        name = until["figure"]
        judged = "" if verdicts.get(name, "good") == "good" else f", judged {verdicts[name]}"
        words = f"; {name} is known within {until['relative_error']:.2%} at t = {until['end']:.6g} s{judged}"
        words += f" ({certainty_words(until)})" if until["reached"] is not None else ""
    doubted = {doubt: list(verdicts.values()).count(doubt) for doubt in DOUBTS}
    counts = [f"{count} {words_of}" for doubt, words_of in DOUBTS.items() if (count := doubted[doubt])]
    return words + (f"; statistics: {', '.join(counts)}" if counts else "")


def certainty_words(until: Mapping[str, Any]) -> str:
    """Return the independent samples of the figure of a rule, and its variance, in words."""
    samples, variance = (until[key] for key in CERTAINTY)
    return f"{samples:.0f} independent samples, relative variance {variance:.3g} / T[s]"


def has_statistics(case: Case) -> bool:
    """Return whether runs of a case have statistics: transients under noise."""
    return isinstance(case.analysis, Transient) and any(load.noise for load in case.load)


def names_of(case: Case) -> list[str]:
    """Return the names of the statistics of a case."""
    probes = tuple(probe.name for probe in case.probe)
    faces = tuple(face.name for face in case.layout.faces)
    own = [one.name for one in case.figure if one.averages]
    return [*figure_names(faces, probes, bends_in_two_planes(case), case.wear is not None), *own]


def decay_time(case: Case) -> float:
    """Return the time in which damping takes 1 - 1/e of the energy of the first bending mode, s; 0: it takes nothing.

    1 / (a + b w^2 + 2 zeta w) of Rayleigh damping a M + b K and modal damping zeta. Contact and fluids damp more.
    """
    if isinstance(case.model, RigidModel):
        return 0.0
    speed = 2.0 * pi * overhang_frequency(case)
    mass, stiffness = rayleigh(case)
    rate = mass + stiffness * speed**2 + 2.0 * (case.damping.ratio or 0.0) * speed
    return 1.0 / rate if rate > 0.0 else 0.0


def statistics_of(case: Case, model: Model, every: int) -> RunStatistics | None:
    """Return the statistics to gather in a run of a case; None where it has none.

    Args:
        case: The case.
        model: Its model.
        every: Steps between records.
    """
    return gathered_statistics(case, model, every, decay_time(case)) if has_statistics(case) else None


def gathered_statistics(case: Case, model: Model, every: int, decay: float = 0.0) -> RunStatistics:
    """Return the statistics to gather for a case, whatever moves it: noise, or chaos.

    Args:
        case: The case.
        model: Its model.
        every: Steps between records.
        decay: As in `RunStatistics`.
    """
    faces, probes = tuple(model.system.contact.face_names), tuple(model.probes)
    slides = model.system.contact.measures_sliding
    own = tuple(one for one in case.figure if one.is_sampled)
    figures = faces, probes, bends_in_two_planes(case), every * model.step, decay, slides, own
    if not model.system.contact.maps_sliding:
        return RunStatistics(*figures)
    return PointStatistics(*figures, points=model.system.contact.size, most_blocks=FEW)
