"""Tables of section 3 of the paper: factors to the experiment, settled responses, sensitivities."""

from __future__ import annotations

from itertools import product

from gapbeam.postprocess.report.blocks import Cell, TableBlock
from gapbeam.studies.paper.adams_plan import (
    COMMAND,
    ELASTIC,
    LONG,
    SUSPENDED,
    TEXT,
    Runs,
    clearances,
    depths,
    ends,
    main_run,
    measured,
    variants,
)
from gapbeam.studies.paper.adams_runs import EXCITER, FORCE, RunFigures, geometric_mean

STEPS = {
    "settled": "settled, instead of the start",
    "smoothed": "smoothed by five points",
    "elastic": "elastic beam",
    "suspended": "exciter with its mass and suspension",
}
"""From the simulation to the experiment, one after the other."""


def factors(runs: Runs) -> TableBlock:
    """Return what each of four differences does, after those before it and alone."""
    rows: list[list[Cell]] = [["their simulation: rigid, bare force, start, as recorded"]]
    flags = dict.fromkeys(STEPS, False)
    for depth in reversed(depths()):
        rows[0] += [_mean(runs, depth, **flags), None, None]
    for step, name in STEPS.items():
        before, flags = flags, {**flags, step: True}
        row: list[Cell] = [name]
        for depth in reversed(depths()):
            value = _mean(runs, depth, **flags)
            row += [value, value / _mean(runs, depth, **before), _alone(runs, depth, step)]
        rows.append(row)
    rows.append(["the experiment, Table 4", *[geometric_mean([measured(one) for one in clearances()]), None, None] * 2])
    heads = [head for depth in reversed(depths()) for head in (f"{depth:g} mm: (g)", "factor", "in any order")]
    return TableBlock(
        "From their simulation to the experiment: peak to peak, geometric mean of the four clearances, with full "
        "damping at 0.01 mm as in the text and at 1e-3 mm as in Table 2; the factor of each step, and the least and "
        "the most that it does with the other steps taken or not",
        ("step", *heads),
        rows,
        notes=(
            f"Exciter: {EXCITER['mass']:g} kg, {EXCITER['stiffness']:g} N/m, {EXCITER['damping']:g} N s/m; assumed. "
            "Its spring is relaxed in the undeformed pose.",
            "Smoothed as in the paper: five points at 2 kHz, each the mean of 0.5 ms.",
        ),
        digits=3,
        command=f"{COMMAND}{ELASTIC}{SUSPENDED}{TEXT} --set time.end=2",
    )


def settled_responses(runs: Runs) -> TableBlock:
    """Return the settled responses, clearance by clearance."""
    rows: list[list[Cell]] = []
    for suspended, elastic in product((False, True), repeat=2):
        for depth in reversed(depths()):
            name = f"{'elastic' if elastic else 'rigid'}, {'suspended exciter' if suspended else 'bare force'}"
            found = [runs[main_run(clearance, depth, elastic, suspended)] for clearance in clearances()]
            rows.append([name, f"{depth:g}", *(_settled(words) for words in found)])
    rows.append(["experiment, Table 4", None, *(f"{measured(clearance):.3g}" for clearance in clearances())])
    return TableBlock(
        f"Settled peak to peak, smoothed, in g, at {FORCE:g} N after {LONG} periods, with the kind of response: a "
        "cycle of so many forcing periods, or none, with the scatter of windows of 12 periods",
        ("beam and load", "full damping at (mm)", *(f"{clearance:g} mm" for clearance in clearances())),
        rows,
        command=f"{COMMAND}{ELASTIC}{SUSPENDED} --set time.end=2",
    )


def sensitivities(runs: Runs) -> TableBlock:
    """Return what the figures owe to what is not printed."""
    rows: list[list[Cell]] = []
    for name, each in variants().items():
        row: list[Cell] = [name]
        for elastic in (False, True):
            found = [runs[one] for one in each if one.elastic == elastic]
            if not found:
                row += [None] * 4
                continue
            small, large = found
            over = [words.start / measured(words.asked.clearance) for words in (small, large)]
            settled = [words.settled_smoothed for words in (small, large)]
            kinds = ", ".join(dict.fromkeys((small.kind, large.kind)))
            row += [geometric_mean(over), large.start / small.start, geometric_mean(settled), kinds]
        rows.append(row)
    least, most = ends()
    heads = ("start over Table 4", "growth", "settled (g)", "response")
    return TableBlock(
        "What is not printed, and what it does: peak to peak of the start over Table 4, its growth from "
        f"{least:g} to {most:g} mm, settled smoothed peak to peak, and the kind of response; full damping at 0.01 mm "
        "where nothing else is said",
        ("changed", *(f"{beam}: {head}" for beam in ("rigid", "elastic") for head in heads)),
        rows,
        notes=(
            "Geometric means of the smallest and the largest clearance, between which Table 4 grows by "
            f"{measured(most) / measured(least):.3g}; {variants_periods()} periods.",
        ),
        digits=3,
        command=f"{COMMAND}{TEXT} --set load.shaker.amplitude=20",
    )


def variants_periods() -> int:
    """Return how many forcing periods the runs of the sensitivities have."""
    return next(iter(variants().values()))[0].periods


def _alone(runs: Runs, depth: float, step: str) -> str:
    """Return the least and the most that a step does, with the others taken or not."""
    others = [name for name in STEPS if name != step]
    found = []
    for taken in product((False, True), repeat=len(others)):
        rest = dict(zip(others, taken, strict=True))
        with_it, without = (_mean(runs, depth, **rest, **{step: does}) for does in (True, False))
        found.append(with_it / without)
    return f"{min(found):.3g} to {max(found):.3g}"


def _mean(runs: Runs, depth: float, elastic: bool, suspended: bool, settled: bool, smoothed: bool) -> float:
    """Return the geometric mean over the clearances of one of the peaks to peaks, g."""
    kind = ("settled" if settled else "start") + ("_smoothed" if smoothed else "")
    found = [runs[main_run(clearance, depth, elastic, suspended)] for clearance in clearances()]
    return geometric_mean([getattr(words, kind) for words in found])


def _settled(words: RunFigures) -> str:
    scatter = "" if words.kind.startswith("period") else f" ± {words.scatter:.2g}"
    return f"{words.settled_smoothed:.3g}{scatter} ({words.kind})"
