"""The promises of error estimates, class by class, and what drawn runs keep of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from benchmarks.drawn_cases.attempts import Attempt
from benchmarks.table import Cell, Table, machine_words

PROMISES = ((1.0, 0.95), (2.0, 0.99), (5.0, 1.0))  # of a class: a share of errors below so many times the estimate
ENOUGH = 100  # figures of a class, of which a share of 99 % says something
TINY = 1.0e-300


def ratios_by_class(attempts: Sequence[Attempt]) -> dict[str, list[tuple[float, float, float]]]:
    """Return error / estimate, estimate / figure and error / figure of each figure, class by class."""
    found: dict[str, list[tuple[float, float, float]]] = {}
    for attempt in attempts:
        for one in attempt.figures:
            scale = max(abs(one.value), TINY)
            row = (one.error / max(one.estimate, TINY), one.estimate / scale, one.error / scale)
            for name in ("all", attempt.kind, f"stiffness {attempt.stiffness}", one.part):
                found.setdefault(name, []).append(row)
    return found


def missed(attempts: Sequence[Attempt]) -> Iterator[str]:
    """Yield a line for each promise that is missed by a class with enough figures, and for each false refusal."""
    for name, rows in ratios_by_class(attempts).items():
        ratios = np.array(rows)[:, 0]
        for limit, promised in PROMISES:
            share = float(np.mean(ratios <= limit))
            if share < promised and len(rows) >= ENOUGH:
                yield f"{name}: {share:.1%} of {len(rows)} figures below {limit:g} E, promised {promised:.0%}"
    for attempt in attempts:
        if attempt.falsely_refused:
            yield f"case {attempt.number} ({attempt.kind}) is refused, and the second way solves it: {attempt.message}"


def coverage(attempts: Sequence[Attempt]) -> Table:
    """Return the table of all classes, with what is missed and how many pairs of choices were drawn."""
    rows: list[tuple[Cell, ...]] = []
    for name, found in ratios_by_class(attempts).items():
        ratio, estimate, error = np.array(found).T
        shares = (f"{np.mean(ratio <= limit):.1%}" for limit, _ in PROMISES)
        middle = (f"{np.median(estimate):.2%}", f"{np.median(error):.2%}")
        rows.append((name, len(found), *shares, f"{ratio.max():.3g}", *middle))
    pairs = {
        pair
        for attempt in attempts
        for pair in combinations(sorted((attempt.choices | {"model": attempt.kind}).items()), 2)
    }
    ended = {
        status: sum(one.status == status for one in attempts) for status in sorted({one.status for one in attempts})
    }
    seconds = [one.seconds for one in attempts]
    notes = (
        machine_words(),
        f"{len(attempts)} cases, of which end {ended}; {len(pairs)} pairs of choices",
        f"a run takes {np.median(seconds):.1f} s by the median, {max(seconds):.1f} s at most, without its estimate",
        *missed(attempts),
    )
    return Table(
        "drawn_cases",
        f"Error estimates of {len(attempts)} drawn cases",
        ("class", "figures", "below E", "below 2 E", "below 5 E", "largest error / E", "median E", "median error"),
        tuple(rows),
        notes,
    )
