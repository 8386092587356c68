"""Contradictions in time: step, span, forcing and records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

from gapbeam.solver.case.case import Output
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.faults import Fault
from gapbeam.solver.wording.short_words import apart, exceeds

MOST_STEPS = 1e9
MULTIPLE_TOLERANCE = 1e-6
"""Tolerance of intervals against a whole number of steps, in steps."""


class MarchSpan(Protocol):
    """Step and end of a run, s, as the table [time] of cases and of files of several structures has them."""

    @property
    def step(self) -> float | str:
        """Step, s; "auto" until it is chosen."""

    @property
    def end(self) -> float:
        """End, s."""


def run_has_steps(time: MarchSpan) -> Iterator[Fault]:
    """A run has at least one step, and not more than can ever be marched."""
    if isinstance(time.step, str):
        return
    steps = time.end / time.step
    if steps < 1 - MULTIPLE_TOLERANCE:
        step, end = apart(time.step, time.end)
        yield Fault(
            ("time", "step"),
            f"{step} s, longer than the whole run",
            f"at most end, {end} s, and much less to be of use",
            "are step and end swapped, or in ms?",
            (("time", "end"),),
        )
    elif steps > MOST_STEPS:
        yield Fault(
            ("time", "step"),
            f"{time.step:g} s, which makes {steps:.3g} steps until {time.end:g} s",
            f"at most {MOST_STEPS:g} steps",
            f"a step of {time.end / 1e5:g} s makes 100000 steps",
            (("time", "end"),),
        )


def step_follows_the_forcing(time: MarchSpan, load: Mapping[int, Any]) -> Iterator[Fault]:
    """The step is far shorter than the period of every load."""
    if isinstance(time.step, str):
        return
    for number, entry in load.items():
        frequency = entry.forcing_frequency
        if frequency is not None and time.step >= 0.5 / frequency:
            step, half = apart(time.step, 0.5 / frequency)
            yield Fault(
                ("time", "step"),
                f"{step} s, with a load of {frequency:g} Hz",
                f"far less than {half} s, half its period; 50 steps per period are good",
                f"step = {0.02 / frequency:.3g}",
                (("load", number, "frequency"),),
            )


def interest_covers_the_forcing(time: Time, load: Loads) -> Iterator[Fault]:
    """The highest frequency of interest is not below that of a load."""
    for number, entry in load.items():
        frequency = entry.forcing_frequency
        if time.frequency and frequency is not None and exceeds(frequency, time.frequency):
            asked, loaded = apart(time.frequency, frequency)
            yield Fault(
                ("time", "frequency"),
                f"{asked} Hz, with a load of {loaded} Hz",
                "at least the frequency of every load",
                f"frequency = {5 * frequency:g}, or leave it out",
                (("load", number, "frequency"),),
            )


def outputs_fall_on_steps(time: Time, output: Output) -> Iterator[Fault]:
    """Output intervals are whole numbers of steps."""
    if time.step == "auto":
        return
    for name in ("history_interval", "fields_interval"):
        interval = getattr(output, name)
        if interval is None:
            continue
        nearest = whole_interval(interval, time.step)
        if nearest is not None:
            few = f"{interval / time.step:.6g} steps of {time.step:g} s"
            found, remedy, related = f"{interval:g} s, {few}", f"{name} = {nearest!r}", (("time", "step"),)
            yield Fault(("output", name), found, "a whole number of steps, at least 1", remedy, related)


def whole_interval(interval: float, step: float) -> float | None:
    """Return the whole number of steps that is nearest to an interval, s; None where the interval is one."""
    ratio = interval / step
    steps = max(1, round(ratio)) if ratio < 1e15 else 1
    return None if abs(ratio - steps) <= MULTIPLE_TOLERANCE else float(f"{steps * step:.12g}")


def adaptive_steps_resolve_a_contact(time: Time) -> Iterator[Fault]:
    """Adaptive steps resolve the time history of a contact; impulses take no time."""
    if time.adaptive and time.scheme.impulses:
        yield Fault(
            ("time", "adaptive"),
            f"true, with the scheme {time.scheme.type}",
            "false: impulses have no duration that steps could resolve",
            "adaptive = false, or another scheme",
            (("time", "scheme"),),
        )
