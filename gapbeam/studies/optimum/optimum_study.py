"""The file of a search for least figures as frozen pydantic models, and the search with its tables and picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from pydantic import Field
from rich.table import Table as RichTable

from gapbeam.postprocess.figures.figure_style import COLORS, GRAY, journal_style, panels, write_figure
from gapbeam.postprocess.report.sections.atlas_section import OPTIMUM_FILE, OPTIMUM_PICTURE, optimum_tables
from gapbeam.solver.messages.errors import Fault, NotConverged, UserError
from gapbeam.solver.scene.least_figure import Optimum, optimize
from gapbeam.solver.scene.limit_cycle import periodic
from gapbeam.solver.scene.recorded_places import turning_places, units_of_values
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_march import history
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.schema.table import Number, Positive, Table, Whole
from gapbeam.studies.atlas.run_atlas import PeriodicScene, rest_of
from gapbeam.studies.printed_results import DOUBTFUL, PrintedResult, table_of
from gapbeam.studies.study_folder import StudyPlan, study_folder, study_written, write_json, write_table
from gapbeam.studies.uncertain.uncertain_file import read_scene_study

SEARCH = "search.csv"


class FreeValue(Table):
    """A value of the scene that the search may change."""

    path: str = Field(
        min_length=3, max_length=100, examples=["stop*.clearance"],
        description="value of a contact or load of the scene of the case; a star stands for any letters",
    )  # fmt: skip
    lower: Number = Field(description="least value, in the unit of the value", examples=[0.4e-3])
    upper: Number = Field(description="largest value", examples=[1.2e-3])
    start: Number | None = Field(default=None, description="first value; default the middle")

    @property
    def range(self) -> tuple[float, float, float]:
        """Lowest, first and highest value."""
        return self.lower, 0.5 * (self.lower + self.upper) if self.start is None else self.start, self.upper


class HighestFigure(Table):
    """A figure that stays below a limit."""

    figure: str = Field(min_length=1, max_length=100, description="as `least`", examples=["stop*.peak_force"])
    value: Positive = Field(description="highest value, in the unit of the figure", examples=[40.0])


class OptimumStudy(Table):
    """A whole search."""

    title: str = Field("", max_length=200, description="one line that says what is searched for")
    case: str = Field(min_length=1, description="case file, relative to this file", examples=["cantilever-stop.toml"])
    set: dict[str, Any] = Field(default={}, description="changes to the case file: keys and their values")
    least: str = Field(
        min_length=1, max_length=100, examples=["stop*.work"],
        description="figure that becomes least: PROBE.peak, .rms (m) or .harmonic_2, CONTACT.peak_force (N), .impulse "
        "(N s) or .work (J, lost in a period); forces of contacts that share a star add up",
    )  # fmt: skip
    settle: Whole = Field(default=100, ge=1, description="periods from the seat to the response that is followed")
    order: Whole = Field(default=1, ge=1, le=64, description="periods after which it repeats")
    passes: Whole = Field(default=50, ge=1, le=10_000, description="of the search at most")
    free: tuple[FreeValue, ...] = Field(default=(), description="values that the search may change")
    limit: tuple[HighestFigure, ...] = Field(default=(), description="figures that stay below a limit")

    @property
    def limits(self) -> dict[str, float]:
        """Highest value of each figure that has a limit."""
        return {one.figure: one.value for one in self.limit}


def contradictions(tables: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield the faults between the tables that are intact, arrays of tables as {number: entry}."""
    free: Mapping[int, FreeValue] = tables.get("free", {})
    for number, one in free.items():
        key = ("free", number)
        if any(other.path == one.path for place, other in free.items() if place < number):
            yield Fault((*key, "path"), f'"{one.path}" twice', "every path once")
        low, first, high = one.range
        if not low < high:
            yield Fault((*key, "upper"), f"{high:g}", f"more than lower = {low:g}")
        elif not low <= first <= high:
            yield Fault((*key, "start"), f"{first:g}", f"a value from {low:g} to {high:g}")
    limits: Mapping[int, HighestFigure] = tables.get("limit", {})
    for number, limit in limits.items():
        if any(other.figure == limit.figure for place, other in limits.items() if place < number):
            yield Fault(("limit", number, "figure"), f'"{limit.figure}" twice', "one limit for each figure")


def read_optimum_study(path: Path) -> OptimumStudy:
    """Read the file of a search; errors as in `read_scene_study`."""
    return read_scene_study(path, OptimumStudy, contradictions, "free", "path, lower and upper")


@dataclass(frozen=True, repr=False)
class OptimumResult(PrintedResult):
    """The values at which a figure is least.

    Attributes:
        study: As read.
        found: Values, figures there with their derivatives, and all responses on the way.
        record: As in optimum.json.
        paths: Files.
    """

    study: OptimumStudy
    found: Optimum
    record: dict[str, Any]
    paths: list[Path]

    @property
    def exit_status(self) -> int:
        """0 where the response is stable there, else 5."""
        return 0 if self.found.is_stable else DOUBTFUL

    def headline(self) -> str:
        """Return the result in one line."""
        return str(self.record["headline"])

    def tables(self) -> list[RichTable]:
        """Return values, and figures with their derivatives."""
        return [table_of(heads, rows, 5) for _, heads, rows in optimum_tables(self.record)]


def run_optimum(study: OptimumStudy, one: PeriodicScene, folder: Path, plan: StudyPlan) -> OptimumResult:
    """Search from the response that a march from the seat comes to, and write tables and a picture.

    Args:
        study: As read.
        one: The scene of its case.
        folder: Folder for the files.
        plan: Inputs of the search.

    Raises:
        UserError: A path or figure cannot be, no load varies, the response has no derivatives, or the folder holds a
            search of other inputs.
        NotConverged: No response repeats, it ends on the way, or no values keep the limits.
        NotWritten: A file could not be written.
    """
    if isnan(one.period):
        raise UserError("optimize: no load of the case varies; expected loads that repeat after a period")
    period, steps = study.order * one.period, study.order * one.steps
    over = {free.path: free.range for free in study.free}
    with study_folder(folder, plan=plan):
        found = optimize(
            one.scene, study.least, over, limits=study.limits, period=period, steps=steps, passes=study.passes,
            start=_response(study, one, period, steps),
        )  # fmt: skip
        record = _record(study, found, one.scene)
        rows = [(*values.values(), *figures.values()) for values, figures in found.orbits]
        paths = [folder / name for name in (OPTIMUM_FILE, SEARCH, OPTIMUM_PICTURE)]
        write_table(paths[1], (*over, *found.orbits[0][1]), rows)
        with study_written(paths[2]):
            write_figure(draw_search(study, found), paths[2])
        write_json(paths[0], [record])
    return OptimumResult(study, found, record, paths)


def _response(study: OptimumStudy, one: PeriodicScene, period: float, steps: int) -> SceneState:
    """Return the state of the response that a march from the seat comes to at the first values."""
    scene = one.scene.with_({free.path: free.range[1] for free in study.free})
    begin = rest_of(PeriodicScene(scene, one.period, one.step, one.rise))
    near = history(scene, period / steps, begin.t + study.settle * period, begin).last.state
    try:
        return periodic(scene, period, steps, near).state
    except NotConverged as error:
        raise NotConverged(
            f"optimize: no response repeats after {study.order} periods at the first values: {error}; raise settle or "
            "order, or look at all responses: gapbeam atlas"
        ) from None


OF_FIGURES = {"peak": "m", "rms": "m", "peak_force": "N", "impulse": "N s", "work": "J"}


def unit_of_figure(scene: Scene, name: str) -> str:
    """Return the SI unit of a figure of a search, which is of a rotation where its place turns."""
    place, _, kind = name.rpartition(".")
    unit = OF_FIGURES.get(kind, "m")  # of harmonics
    place = scene.short_name(place)
    return unit_where(unit, any(fnmatchcase(one, place) for one in turning_places(scene)))


def _record(study: OptimumStudy, found: Optimum, scene: Scene) -> dict[str, Any]:
    """Return the record of optimum.json."""
    at, begin, limits = found.tangents, found.orbits[0][1], study.limits
    unit = unit_of_figure(scene, study.least)
    units = units_of_values(scene, found.values)
    values = ", ".join(f"{path} = {value:.5g} {units[path]}".rstrip() for path, value in found.values.items())
    unstable = "" if found.is_stable else "; this response is unstable: a march leaves it"
    fall = f"from {begin[study.least]:.5g} {unit} to {at.values[study.least]:.5g} {unit}"
    head = f"{study.least} falls {fall} at {values}{unstable}"
    return {
        "headline": head, "stable": found.is_stable, "responses": len(found.orbits), "least": study.least,
        "largest_multiplier": float(np.abs(at.multipliers).max()),
        "values": [
            {"path": free.path, "unit": units[free.path], "lower": free.lower, "first": free.range[1],
             "found": found.values[free.path], "upper": free.upper}
            for free in study.free
        ],
        "figures": [
            {"figure": name, "unit": unit_of_figure(scene, name), "first": begin[name], "found": value,
             "limit": limits.get(name), "slopes": at.slopes[name]}
            for name, value in at.values.items()
        ],
    }  # fmt: skip


@journal_style()
def draw_search(study: OptimumStudy, found: Optimum) -> Figure:
    """Draw figures, over their limits or first values, and values, in their ranges, of all responses of a search."""
    figure, grid = panels(2, height=1.9, sharex=True)
    limits = study.limits
    number = np.arange(1, len(found.orbits) + 1)
    above, below = grid[0][0], grid[1][0]
    for k, (name, first) in enumerate(found.orbits[0][1].items()):
        size = limits.get(name, first) or 1.0
        label = f"{name} / {'limit' if name in limits else 'first'}"
        above.plot(number, [one[name] / size for _, one in found.orbits], ".-", color=COLORS[k % len(COLORS)],
                   label=label)  # fmt: skip
    if limits:
        above.axhline(1.0, color=GRAY, lw=0.8, ls="--")
    for k, free in enumerate(study.free):
        shares = [(one[free.path] - free.lower) / (free.upper - free.lower) for one, _ in found.orbits]
        below.plot(number, shares, ".-", color=COLORS[k % len(COLORS)], label=free.path)
    above.set_ylabel("figures")
    below.set_ylabel("values in their ranges")
    below.set_ylim(-0.05, 1.05)
    below.set_xlabel("response")
    for axes in (above, below):
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
