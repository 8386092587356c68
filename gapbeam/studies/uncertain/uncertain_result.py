"""Result of a study of uncertain values: its tables and its folder, with a picture and the record that reports read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter
from rich.table import Table

from gapbeam.postprocess.display_units import shown_by
from gapbeam.postprocess.figures.figure_style import BLACK, COLORS, GRAY, journal_style, panels, write_figure
from gapbeam.postprocess.report.sections.sweep_section import UNCERTAIN_FILE, UNCERTAIN_PICTURE
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.system.operators import Array
from gapbeam.studies.printed_results import DOUBTFUL, PrintedResult, table_of
from gapbeam.studies.study_folder import study_written, write_json, write_table
from gapbeam.studies.uncertain.probability import Indices, IntervalEstimate, RareProbability

MOST_PANELS = 4
SPARED = ("deviation", "least", "25 %", "75 %", "largest")
"""Columns of distributions that are in files only."""
Row = tuple[str | float | int, ...]


@dataclass(frozen=True)
class Distribution:
    """A figure over the members of one response.

    Attributes:
        mean: Mean with its 95 % interval.
        deviation: Standard deviation.
        quantiles: Quantiles by probability.
        least: Least value of all members.
        largest: Largest value of all members.
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
        members: Number of members in each part.
        exceeded: Estimated probabilities by figure.
    """

    members: list[int]
    exceeded: dict[str, list[IntervalEstimate]]


@dataclass(frozen=True, repr=False, eq=False)
class Uncertain(PrintedResult):
    """Distributions of figures for each response, and probabilities.

    Attributes:
        values: Values by path, (members,); "start": the number of the start.
        response: Name of the response of each member, (members,): "order 1: stop 1" strikes "stop" once in each period;
            "chaotic", "unsettled", "failed"; "all" for members of a function.
        figures: Figures by name, (members,); NaN where a member failed or did not settle. See `figures_of` in
            gapbeam.studies.uncertain.member_responses.
        replicates: Members of one replicate follow each other.
        limits: Limits by figure.
        responses: Probability of each response.
        unknown: Share of members that failed or did not settle.
        distributions: Distributions by (response, figure).
        exceeded: Probability that a figure is above its limit.
        rare: The same by subset simulation.
        inputs: Names in the order of `indices`.
        indices: Sobol indices by figure.
        convergence: Probabilities from parts of the members.
        folder: Folder of the tables; None: there is none.
        units: SI units of figures, as far as they are known.
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
    units: Mapping[str, str] = field(default_factory=dict)

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
        words = [f"{counted(len(self.response), 'member')}", f"{counted(len(self.responses), 'response')}"]
        words += [
            f"{name} above {self.limits[name]:.4g}{unit}: {one.value:.3g} ({one.low:.3g} to {one.high:.3g})"
            for unit, (name, one) in zip(map(self._behind, self.exceeded), self.exceeded.items(), strict=True)
        ]
        if self.unknown:
            words.append(
                f"{self.unknown:.1%} failed or did not settle: raise settle, rounds or orders, or take other steps"
            )
        late = [name for name, one in self.rare.items() if not one.complete]
        if late:
            words.append(f"subset simulation did not come to the limit of {', '.join(late)}: raise rare_members")
        return "; ".join(words)

    def _behind(self, name: str) -> str:
        unit = self.units.get(name, "")
        return f" {unit}" if unit else ""

    def shown_figures(self) -> list[str]:
        """Return the figures of the tables in a terminal and of pictures: those with limits, else the first four."""
        return list(self.limits) or [name for name, y in self.figures.items() if np.any(y)][:MOST_PANELS]

    def probability_rows(self) -> tuple[Row, list[Row]]:
        """Return heads and rows of all probabilities."""
        heads = ("event", "method", "probability", "from", "to", "members")
        rows: list[Row] = [
            (f"response {name}", "members", one.value, one.low, one.high, one.count)
            for name, one in self.responses.items()
        ]
        for name, limit in self.limits.items():
            event, one = f"{name} > {limit:.6g}{self._behind(name)}", self.exceeded[name]
            rows.append((event, "members", one.value, one.low, one.high, one.count))
            if name in self.rare:
                rare = self.rare[name]
                rows.append((event, "subset simulation", rare.value, rare.low, rare.high, rare.members))
        return heads, rows

    def distribution_rows(self) -> tuple[Row, list[Row]]:
        """Return heads and rows of all figures of all responses."""
        first = next(iter(self.distributions.values()), None)
        parts = list(first.quantiles) if first else []
        heads = ("figure", "unit", "response", "members", "mean", "from", "to", "deviation", "least",
                 *(f"{100 * part:g} %" for part in parts), "largest")  # fmt: skip
        order = {name: i for i, name in enumerate(self.figures)}
        ranked = sorted(self.distributions.items(), key=lambda item: order[item[0][1]])
        rows: list[Row] = [
            (name, self.units.get(name, ""), response, one.mean.count, one.mean.value, one.mean.low, one.mean.high,
             one.deviation, one.least, *one.quantiles.values(), one.largest)
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
            (f"{name} > {self.limits[name]:.6g}{self._behind(name)}", count, one.value, one.low, one.high)
            for name, every in self.convergence.exceeded.items()
            for count, one in zip(self.convergence.members, every, strict=True)
        ]
        return heads, rows

    def tables(self) -> list[Table]:
        """Return probabilities, distributions of the figures that are shown, and Sobol indices."""
        found, (heads, every) = [], self.distribution_rows()
        rows = [row for row in every if row[0] in self.shown_figures()]
        kept = [i for i, head in enumerate(heads) if head not in SPARED]
        narrow = (tuple(heads[i] for i in kept), [tuple(row[i] for i in kept) for row in rows])
        left = counted(len({row[0] for row in every}) - len({row[0] for row in rows}), "more figure")
        for heads, rows in (self.probability_rows(), narrow, self.index_rows()):
            if rows:
                more = f"{left} in distributions.csv" if rows is narrow[1] and not left.startswith("0 ") else None
                found.append(table_of(heads, rows, caption=more))
        return found


def write_uncertain(found: Uncertain, folder: Path) -> None:
    """Write tables and picture.

    Raises:
        NotWritten: The disk takes no file.
    """
    tables = {
        "probabilities": found.probability_rows(), "distributions": found.distribution_rows(),
        "sobol-indices": found.index_rows(), "convergence": found.convergence_rows(),
    }  # fmt: skip
    columns = {**found.values, "response": found.response, **found.figures}
    for name, (heads, rows) in {**tables, "members": (tuple(columns), zip(*columns.values(), strict=True))}.items():
        write_table(folder / f"{name}.csv", heads, rows)
    record = {
        "members": len(found.response), "responses": len(found.responses), "unknown": found.unknown,
        "complete": found.is_complete, "headline": found.headline(),
        **{name: {"heads": heads, "rows": rows} for name, (heads, rows) in tables.items()},
    }  # fmt: skip
    picture = folder / UNCERTAIN_PICTURE
    with study_written(picture):
        write_figure(draw_distributions(found), picture)
    write_json(folder / UNCERTAIN_FILE, [record])


@journal_style()
@checked
def draw_distributions(found: Uncertain, figures: Iterable[str] = ()) -> Figure:
    """Draw the distribution of figures for each response, and the convergence of probabilities.

    Args:
        found: A study.
        figures: Names; default those with limits, or the first four.
    """
    names = [name for name in list(figures) or found.shown_figures() if name in found.figures]
    converging = any(one.count for every in found.convergence.exceeded.values() for one in every)
    figure, grid = panels(max(len(names) + converging, 1), height=1.9)
    if not found.figures:
        grid[0][0].set_title("no member settled, and none is chaotic")
    kinds = [name for name in found.responses if any((name, one) in found.distributions for one in names)]
    for (axes,), name in zip(grid, names, strict=False):
        unit, factor = shown_by(found.units.get(name, ""), map(float, found.figures[name]))
        y = factor * found.figures[name]
        ends = np.histogram_bin_edges(y[np.isfinite(y)], bins="auto") if np.isfinite(y).any() else np.array([0.0, 1.0])
        base: Array = np.zeros(len(ends) - 1)
        for number, kind in enumerate(kinds):
            mine = (found.response == kind) & np.isfinite(y)
            share = np.histogram(y[mine], bins=ends)[0] / len(y)
            color = GRAY if kind == "chaotic" else COLORS[(number + number // len(COLORS)) % len(COLORS)]
            axes.stairs(base + share, ends, baseline=base, fill=True, color=color,
                        alpha=0.8 if number < len(COLORS) else 0.4, label=kind)  # fmt: skip
            base = base + share
        if name in found.limits:
            axes.axvline(factor * found.limits[name], color=BLACK, ls="--", lw=0.8)
        axes.set_xlabel(f"{name} ({unit})" if unit else name)
        axes.set_ylabel("share of members")
    if len(kinds) > 1:
        grid[0][0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    if converging:
        axes = grid[-1][0]
        for number, (name, every) in enumerate(found.convergence.exceeded.items()):
            middle = np.array([one.value for one in every])
            ends = np.array([[one.low for one in every], [one.high for one in every]])
            axes.errorbar(
                found.convergence.members, middle, np.maximum(np.abs(ends - middle), 0.0),
                color=COLORS[number % len(COLORS)], marker="o", ms=3.0, capsize=2.0, label=name,
            )  # fmt: skip
        axes.set_xscale("log", base=2)
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:.0f}"))
        axes.margins(x=0.03)
        axes.set_xlabel("members")
        axes.set_ylabel("probability")
        if len(found.convergence.exceeded) > 1:
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
