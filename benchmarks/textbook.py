"""Condensed steps against the textbook's Newton, on the same beam from the same seat, side by side.

The solid beam of cases/li2013.toml (about 29 000 DOFs) with the scheme implicit-midpoint, which the textbook's residual
is written for, is shaken so hard that base and gland open and close within the steps measured.

    environment/run python3 -m benchmarks.textbook
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.table import Cell, Table, machine_words, options, seconds
from benchmarks.textbook_newton import Marched, TextbookBeam, marched, seated
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case

CASE = Path(__file__).parents[1] / "cases" / "li2013.toml"
SHAKEN = (
    "time.scheme=implicit-midpoint",
    "load.shaker.ramp=0.0",
    "load.shaker.amplitude=500.0",
    "load.shaker.frequency=100.0",
)
STEPS, LONG = 14, 400  # of both ways; of the condensed steps against their back-substitution
FACTORIZATIONS = {"lu": STEPS, "cholesky": STEPS}  # steps of the textbook with each way to factor its Jacobian
AGREEMENT = 1.0e-8
WANTED_RATIO, WANTED_SHARE = 100.0, 1.5


def compare(case: Case, steps: dict[str, int], long: int) -> Table:
    """Return the table of a case.

    Args:
        case: The case, with the scheme implicit-midpoint, penalty contact and without contact damping.
        steps: Steps of the textbook with each way to factor its Jacobian.
        long: Steps for the ratio of a condensed step to its back-substitution.
    """
    start = seated(case)
    most = max(steps.values())
    marched(start, 2)
    condensed = marched(start, most, keep=True)
    rows: list[tuple[Cell, ...]] = []
    ratios: dict[str, float] = {}
    worst = 0.0
    for factorization, count in steps.items():
        textbook = TextbookBeam(start.model, start.start, factorization)
        spent, iterations, difference = 0.0, 0, 0.0
        beside: list[Marched] = []  # whole condensed marches, one after each step of the textbook, on the same load
        for expected in condensed.displacements[:count]:
            clock = time.perf_counter()
            iterations += textbook.advance().iterations
            spent += time.perf_counter() - clock
            missed = np.max(np.abs(textbook.displacement - expected)) / np.max(np.abs(expected))
            difference = max(difference, float(missed))
            beside.append(marched(start, count))
        per_step = float(np.mean([one.per_step for one in beside]))
        ratios[factorization] = spent / count / per_step
        worst = max(worst, difference)
        rows.append(
            (f"textbook, {factorization}", count, seconds(spent / count), f"{iterations / count:.1f}", 1.0, difference)
        )
        rows.append(
            (
                "condensed, the same steps",
                count,
                seconds(per_step),
                f"{beside[0].iterations:.1f}",
                ratios[factorization],
                None,
            )
        )
    whole = marched(start, long)
    share = whole.per_step / whole.back_substitution
    rows.append(("condensed", long, seconds(whole.per_step), f"{whole.iterations:.1f}", None, None))
    rows.append(("- its back-substitution", long, seconds(whole.back_substitution), "-", None, None))
    model = start.model
    setup = {name: f"{value:.2g} s" for name, value in start.seconds.items()}
    return Table(
        "textbook",
        f"Condensed against textbook, {model.dofs} DOFs, {model.system.contact.size} contact points",
        ("way", "steps", "per step", "iterations", "times faster", "difference"),
        tuple(rows),
        (
            machine_words(),
            "the condensed march is repeated after each step of the textbook, so that both meet the same machine",
            f"up to {whole.active} contact points under pressure; set-up of the condensed way: "
            + ", ".join(f"{name} {value}" for name, value in setup.items()),
            "difference: largest in any displacement relative to the largest displacement, over all steps; "
            f"{worst:.1e} "
            f"{'is' if worst <= AGREEMENT else 'is NOT'} below {AGREEMENT:g}",
            f"times faster: {min(ratios.values()):.0f} or more, wanted {WANTED_RATIO:.0f}: "
            f"{'met' if min(ratios.values()) >= WANTED_RATIO else 'NOT met'}",
            f"the condensed step is {share:.2f} times its back-substitution, wanted at most {WANTED_SHARE}: "
            f"{'met' if share <= WANTED_SHARE else 'NOT met'}",
        ),
        {"difference": worst, "step_over_back_substitution": share}
        | {f"ratio_{name}": ratio for name, ratio in ratios.items()},
    )


def shaken(path: Path = CASE, overrides: Sequence[str] = ()) -> Case:
    """Return a case that rattles within a few steps."""
    return read_case(path, [*SHAKEN, *overrides])


if __name__ == "__main__":
    chosen = options(__doc__)
    compare(shaken(), FACTORIZATIONS, LONG).write(chosen.output)
