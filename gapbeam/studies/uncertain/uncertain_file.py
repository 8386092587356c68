"""The file of a study of uncertain values as frozen pydantic models, and contradictions between its tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import Field
from scipy import stats

from gapbeam.solver.case.reading.case_reader import read_tables
from gapbeam.solver.case.reading.overrides import pairs
from gapbeam.solver.errors import CaseError, Fault
from gapbeam.solver.scene.scene import SceneState
from gapbeam.solver.table import Number, Positive, Table, Whole
from gapbeam.solver.wording.short_words import near
from gapbeam.studies.atlas.run_atlas import PeriodicScene, rest_of, starts_of
from gapbeam.studies.identification.identification_file import settings_of
from gapbeam.studies.uncertain.member_responses import START

SHOWN = ("norm", "lognorm", "uniform", "triang", "beta", "gamma", "truncnorm", "weibull_min")


class Variable(Table):
    """A value of the scene that is uncertain."""

    path: str = Field(
        min_length=3,
        max_length=100,
        description="value of a contact or load of the scene of the case; a star stands for any letters",
        examples=["stop.clearance", "gland*.stiffness", "shaker.scale"],
    )
    distribution: str = Field(
        min_length=1, max_length=40, description="name of a distribution of scipy.stats", examples=["norm"]
    )
    parameters: dict[str, Number] = Field(
        default={}, description="its parameters by name, such as loc and scale, in the unit of the value"
    )

    @property
    def frozen(self) -> Any:
        """The distribution with its parameters."""
        return getattr(stats, self.distribution)(**self.parameters)


class Correlation(Table):
    """A rank correlation (Spearman) of two variables."""

    paths: tuple[str, str] = Field(description="paths of two variables", examples=[["a.clearance", "b.clearance"]])
    rank: Number = Field(gt=-1, lt=1, description="rank correlation, no unit", examples=[0.5])


class Limit(Table):
    """A limit of a figure: the probability of exceeding it is found."""

    figure: str = Field(
        min_length=1, max_length=100,
        description="peak/PROBE, rms/PROBE (m), peak_force/CONTACT, mean_force/CONTACT (N), impact_rate/CONTACT (1/s), "
        "work_rate/CONTACT (W), closed/CONTACT (share of time)",
        examples=["peak/tip"],
    )  # fmt: skip
    value: Number = Field(description="limit, in the unit of the figure", examples=[1e-3])


class Rare(Table):
    """Subset simulation of all limits."""

    members: Whole = Field(default=500, ge=100, le=1_000_000, description="members of a level of each replicate")
    replicates: Whole = Field(default=20, ge=2, le=1000, description="independent replicates")


class Sensitivity(Table):
    """Sobol indices of all figures."""

    points: Whole = Field(
        default=512, ge=16, le=2**24, description="a power of two; each point takes (variables + 2) members"
    )


class SceneStudy(Table):
    """A study of the scene of a case over values of it."""

    title: str = Field("", max_length=200, description="one line that says what is studied")
    case: str = Field(min_length=1, description="case file, relative to this file", examples=["cantilever-stop.toml"])
    set: dict[str, Any] = Field(default={}, description="changes to the case file: keys and their values")
    seed: Whole = Field(default=0, ge=0, description="of everything random")
    starts: Whole = Field(
        default=1, ge=1, le=100_000, description="1: all members start from the seat; more: with drawn velocities, too"
    )
    reach: Positive = Field(
        default=2.0, description="largest velocity of a start, over the velocity of the motion from the seat, no unit"
    )
    settle: Whole = Field(default=100, ge=1, description="periods before motions count")
    variable: tuple[Variable, ...] = Field(default=(), description="values that differ between members")

    def begin(self, one: PeriodicScene) -> SceneState:
        """Return the starts of the members: the seat, or `starts` draws; errors as in `starts_of`."""
        if self.starts == 1:
            return rest_of(one)
        return starts_of(one, self.settle, self.starts, self.reach, self.seed)


class UncertainStudy(SceneStudy):
    """A whole study of uncertain values."""

    members: Whole = Field(default=1024, ge=4, le=100_000_000, description="members of all replicates")
    sampling: Literal["sobol", "latin", "random"] = Field(
        default="sobol", description="randomised Sobol points, Latin hypercubes, or random points"
    )
    replicates: Whole = Field(
        default=16, ge=2, le=10_000, description="randomised on their own: their scatter gives the intervals"
    )
    rounds: Whole = Field(default=4, ge=1, le=1000, description="marches of so many periods at most")
    orders: Whole = Field(default=8, ge=1, le=64, description="most periods after which a response repeats")
    measure: Whole = Field(default=48, ge=1, description="periods over which figures are taken")
    correlation: tuple[Correlation, ...] = Field(
        default=(), description="rank correlations; other pairs are independent"
    )
    limit: tuple[Limit, ...] = Field(default=(), description="limits of figures")
    rare: Rare | None = Field(default=None, description="subset simulation of the limits; default none")
    sensitivity: Sensitivity | None = Field(default=None, description="Sobol indices; default none")

    @property
    def expected(self) -> int | None:
        """Number of members that march; None where subset simulation decides."""
        inputs = len(self.variable) + (self.starts > 1)
        causes = 0 if self.sensitivity is None else self.sensitivity.points * (inputs + 2)
        return None if self.rare else self.members + causes


def contradictions(tables: Mapping[str, Any]) -> list[Fault]:
    """Return the faults between the tables that are intact, arrays of tables as {number: entry}."""
    variables: Mapping[int, Variable] = tables.get("variable", {})
    faults = [*variable_faults(variables), *_correlations(tables.get("correlation", {}), variables)]
    limits: Mapping[int, Limit] = tables.get("limit", {})
    for number, one in limits.items():
        if any(other.figure == one.figure for place, other in limits.items() if place < number):
            faults.append(Fault(("limit", number, "figure"), f'"{one.figure}" twice', "one limit for each figure"))
    if tables.get("rare") is not None and not limits:
        faults.append(Fault(("rare",), "[rare] without a limit", "a [[limit]] that is exceeded rarely"))
    if tables.get("sensitivity") is not None and tables.get("correlation"):
        faults.append(
            Fault(("sensitivity",), "[sensitivity] and [[correlation]]", "one of the two",
                  "leave one out: Sobol indices share out the variance of independent inputs")
        )  # fmt: skip
    return faults


def variable_faults(variables: Mapping[int, Variable]) -> Iterator[Fault]:
    """Yield the faults of variables by their number: paths given twice, and distributions that are none."""
    for number, one in variables.items():
        key = ("variable", number)
        if any(other.path == one.path for place, other in variables.items() if place < number):
            yield Fault((*key, "path"), f'"{one.path}" twice', "every path once")
        if one.path == START or "." not in one.path:
            yield Fault((*key, "path"), f'"{one.path}"', 'name.value, such as "stop.clearance"')
        kind = getattr(stats, one.distribution, None)
        if not isinstance(kind, stats.rv_continuous | stats.rv_discrete):
            known = [name for name in dir(stats) if isinstance(getattr(stats, name), stats.rv_continuous)]
            close = near(one.distribution, known)
            yield Fault(
                (*key, "distribution"), f'"{one.distribution}"', f"a distribution of scipy.stats: {', '.join(SHOWN)}",
                f'did you mean "{close}"?' if close else "",
            )  # fmt: skip
            continue
        shapes = [word.strip() for word in (kind.shapes or "").split(",") if word.strip()]
        wanted = [*shapes, "loc", *(["scale"] if isinstance(kind, stats.rv_continuous) else [])]
        extra = [name for name in one.parameters if name not in wanted]
        lacking = [name for name in shapes if name not in one.parameters]
        if extra or lacking:
            words = f"{', '.join(extra)}" if extra else f"no {', '.join(lacking)}"
            yield Fault((*key, "parameters"), words, f"{', '.join(wanted)} of {one.distribution}")
        elif not np.all(np.isfinite(one.frozen.ppf([0.01, 0.5, 0.99]))):
            values = ", ".join(f"{name} = {value:g}" for name, value in one.parameters.items())
            yield Fault((*key, "parameters"), values, f"parameters that {one.distribution} has a meaning for")


def _correlations(correlations: Mapping[int, Correlation], variables: Mapping[int, Variable]) -> Iterator[Fault]:
    paths = [one.path for one in variables.values()]
    for number, one in correlations.items():
        key = ("correlation", number, "paths")
        unknown = [path for path in one.paths if path not in paths]
        if unknown:
            close = near(unknown[0], paths)
            yield Fault(
                key, f'"{unknown[0]}"', "paths of two [[variable]]", f'did you mean "{close}"?' if close else ""
            )
        elif one.paths[0] == one.paths[1]:
            yield Fault(key, f'"{one.paths[0]}" twice', "two variables")
        elif any(set(other.paths) == set(one.paths) for place, other in correlations.items() if place < number):
            yield Fault(key, f'"{one.paths[0]}" and "{one.paths[1]}" twice', "each pair once")


Study = TypeVar("Study", bound=SceneStudy)


def read_scene_study(path: Path, kind: type[Study], faults: Callable[[Mapping[str, Any]], list[Fault]]) -> Study:
    """Read the file of a study over values of a scene.

    Args:
        path: Of the file.
        kind: Tables of the study.
        faults: Returns contradictions between its tables.

    Raises:
        CaseError: It cannot be read, or there are faults: all of them.
    """
    study = read_tables(path, kind, faults)
    if not study.variable:
        fault = Fault((), "no [[variable]]", "at least one, with path and distribution", where=f"{path}: variable")
        raise CaseError(str(path), [fault])
    return study


def read_uncertain(path: Path) -> UncertainStudy:
    """Read the file of a study of uncertain values; errors as in `read_scene_study`."""
    return read_scene_study(path, UncertainStudy, contradictions)


def settings_of_study(path: Path, given: Mapping[str, Any], overrides: Sequence[str]) -> dict[str, object]:
    """Return the settings over those of the case: [set] of the file of a study, and texts KEY=VALUE over it.

    Raises:
        CaseError: A text is no KEY=VALUE.
    """
    typed = list(pairs(overrides))
    faults = [entry for entry in typed if isinstance(entry, Fault)]
    if faults:
        raise CaseError(str(path), faults)
    return settings_of(given) | dict(entry for entry in typed if not isinstance(entry, Fault))
