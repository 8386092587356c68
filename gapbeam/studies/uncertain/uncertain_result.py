"""Result of a study of uncertain values, with its tables."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from gapbeam.solver.system.operators import Array
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.uncertain.probability import IntervalEstimate, RareProbability
from gapbeam.studies.uncertain.sobol_indices import Indices

DOUBTFUL = 5
SPARED = ("deviation", "least", "25 %", "75 %", "largest")
"""Columns of distributions that are in files only."""
Row = tuple[str | float | int, ...]


@dataclass(frozen=True)
class Distribution:
    """A figure over the members of one response.

    Attributes:
        mean: With its 95 % interval.
        deviation: Standard deviation.
        quantiles: By probability.
        least: Of all members.
        largest: Of all members.
    """

    mean: IntervalEstimate
    deviation: float
    quantiles: dict[float, float]
    least: float
    largest: float


@dataclass(frozen=True)
class Convergence:
    """Probabilities of exceeding limits from a part of the members.

    Attributes:
        members: Their numbers.
        exceeded: By figure, the estimates.
    """

    members: list[int]
    exceeded: dict[str, list[IntervalEstimate]]


@dataclass(frozen=True, repr=False, eq=False)
class Uncertain(PrintedResult):
    """Distributions of figures for each response, and probabilities.

    Attributes:
        values: By path, (members,); "start": the number of the start.
        response: Name of the response of each member, (members,): "order 1: stop 1" strikes "stop" once in each period;
            "chaotic", "unsettled", "failed"; "all" for members of a function.
        figures: By name, (members,); NaN where a member failed or did not settle. See `figures_of` in
            gapbeam.studies.uncertain.member_responses.
        replicates: Members of one replicate follow each other.
        limits: By figure.
        responses: Probability of each response.
        unknown: Share of members that failed or did not settle.
        distributions: By (response, figure).
        exceeded: Probability that a figure is above its limit.
        rare: The same by subset simulation.
        inputs: Names in the order of `indices`.
        indices: Sobol indices by figure.
        convergence: Probabilities from parts of the members.
        folder: Where tables are; None: nowhere.
    """

    values: dict[str, Array]
    response: Any
    figures: dict[str, Array]
    replicates: int
    limits: dict[str, float]
    responses: dict[str, IntervalEstimate]
    unknown: float
    distributions: dict[tuple[str, str], Distribution]
    exceeded: dict[str, IntervalEstimate]
    rare: dict[str, RareProbability]
    inputs: list[str]
    indices: dict[str, Indices]
    convergence: Convergence
    folder: Path | None = None

    @property
    def is_complete(self) -> bool:
        """True where each member came to a response or to chaos, and subset simulation to its limits."""
        missing = any(one.missing for one in self.indices.values())
        rare = all(one.complete and not one.failed for one in self.rare.values())
        return not self.unknown and rare and not missing

    @property
    def exit_status(self) -> int:
        """0 if the study is complete, else 5."""
        return 0 if self.is_complete else DOUBTFUL

    def headline(self) -> str:
        """Return the result in one line."""
        words = [f"{len(self.response)} members", f"{len(self.responses)} response{'s' * (len(self.responses) != 1)}"]
        words += [
            f"{name} above {self.limits[name]:.4g}: {one.value:.3g} ({one.low:.3g} to {one.high:.3g})"
            for name, one in self.exceeded.items()
        ]
        if self.unknown:
            words.append(f"{self.unknown:.1%} failed or did not settle: raise settle, rounds or orders")
        late = [name for name, one in self.rare.items() if not one.complete]
        if late:
            words.append(f"subset simulation did not come to the limit of {', '.join(late)}: raise rare_members")
        return "; ".join(words)

    def probability_rows(self) -> tuple[Row, list[Row]]:
        """Return heads and rows of all probabilities."""
        heads = ("event", "method", "probability", "from", "to", "members")
        rows: list[Row] = [
            (f"response {name}", "members", one.value, one.low, one.high, one.count)
            for name, one in self.responses.items()
        ]
        for name, limit in self.limits.items():
            event, one = f"{name} > {limit:.6g}", self.exceeded[name]
            rows.append((event, "members", one.value, one.low, one.high, one.count))
            if name in self.rare:
                rare = self.rare[name]
                rows.append((event, "subset simulation", rare.value, rare.low, rare.high, rare.members))
        return heads, rows

    def distribution_rows(self) -> tuple[Row, list[Row]]:
        """Return heads and rows of all figures of all responses."""
        first = next(iter(self.distributions.values()), None)
        parts = list(first.quantiles) if first else []
        heads = ("figure", "response", "members", "mean", "from", "to", "deviation", "least",
                 *(f"{100 * part:g} %" for part in parts), "largest")  # fmt: skip
        order = {name: i for i, name in enumerate(self.figures)}
        ranked = sorted(self.distributions.items(), key=lambda item: order[item[0][1]])
        rows: list[Row] = [
            (name, response, one.mean.count, one.mean.value, one.mean.low, one.mean.high, one.deviation, one.least,
             *one.quantiles.values(), one.largest)
            for (response, name), one in ranked
        ]  # fmt: skip
        return heads, rows

    def index_rows(self) -> tuple[Row, list[Row]]:
        """Return heads and rows of all Sobol indices."""
        heads = ("figure", "input", "first", "from", "to", "total", "from", "to", "first, half", "total, half")
        rows: list[Row] = [
            (name, path, *map(float, (one.first[i], *one.first_interval[i], one.total[i], *one.total_interval[i],
                                      one.half_first[i], one.half_total[i])))
            for name, one in self.indices.items() for i, path in enumerate(self.inputs)
            if np.isfinite(one.first[i])
        ]  # fmt: skip
        return heads, rows

    def convergence_rows(self) -> tuple[Row, list[Row]]:
        """Return heads and rows of probabilities from parts of the members."""
        heads = ("event", "members", "probability", "from", "to")
        rows: list[Row] = [
            (f"{name} > {self.limits[name]:.6g}", count, one.value, one.low, one.high)
            for name, every in self.convergence.exceeded.items()
            for count, one in zip(self.convergence.members, every, strict=True)
        ]
        return heads, rows

    def tables(self) -> list[Table]:
        """Return probabilities, distributions and Sobol indices."""
        found, (heads, rows) = [], self.distribution_rows()
        shown = [i for i, head in enumerate(heads) if head not in SPARED]
        narrow = (tuple(heads[i] for i in shown), [tuple(row[i] for i in shown) for row in rows])
        for heads, rows in (self.probability_rows(), narrow, self.index_rows()):
            if rows:
                table = Table(*map(str, heads))
                for row in rows:
                    table.add_row(*(f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row))
                found.append(table)
        return found
