"""Study of a scene with uncertain values, and its file as frozen pydantic models.

A study file names the case, its starts, the variables and the folder; a study finds probabilities of responses and
limits, distributions, rare events and Sobol indices.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from pydantic import Field
from scipy import stats
from scipy.stats import randint

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.case_reader import read_tables
from gapbeam.solver.case.reading.overrides import pairs
from gapbeam.solver.messages.errors import CaseError, Fault, UserError
from gapbeam.solver.messages.wording import LOG, near
from gapbeam.solver.scene.argument_checks import checked, finite
from gapbeam.solver.scene.ensemble_members import ensemble_key, response_figure_faults
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.object_code import fingerprint
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.schema.table import Number, Positive, Table, Whole
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.run_atlas import PeriodicScene, rest_of, starts_of
from gapbeam.studies.identification.identification_file import settings_of
from gapbeam.studies.study_folder import study_folder
from gapbeam.studies.uncertain.member_responses import (
    START,
    UNKNOWN,
    Answers,
    CalledModel,
    KeptAnswers,
    Period,
    SceneModel,
    figure_units,
)
from gapbeam.studies.uncertain.probability import (
    Pairs,
    Sampling,
    indices_of,
    inputs_of,
    mean_of,
    normal_points,
    probability,
    subset_simulation,
)
from gapbeam.studies.uncertain.uncertain_result import Convergence, Distribution, Uncertain, write_uncertain

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
        "work_rate/CONTACT (W), closed/CONTACT (share of time), or the name of a [[figure]] of the case",
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


def contradictions(tables: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield the faults between the tables that are intact, arrays of tables as {number: entry}."""
    variables: Mapping[int, Variable] = tables.get("variable", {})
    yield from variable_faults(variables)
    yield from _correlations(tables.get("correlation", {}), variables)
    limits: Mapping[int, Limit] = tables.get("limit", {})
    for number, one in limits.items():
        if any(other.figure == one.figure for place, other in limits.items() if place < number):
            yield Fault(("limit", number, "figure"), f'"{one.figure}" twice', "one limit for each figure")
    if tables.get("rare") is not None and not limits:
        yield Fault(("rare",), "[rare] without a limit", "a [[limit]] that is exceeded rarely")
    if tables.get("sensitivity") is not None and tables.get("correlation"):
        yield Fault(("sensitivity",), "[sensitivity] and [[correlation]]", "one of the two",
                    "leave one out: Sobol indices share out the variance of independent inputs")  # fmt: skip


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


Study = TypeVar("Study", bound=Table)


def read_scene_study(
    path: Path, kind: type[Study], faults: Callable[[Mapping[str, Any]], Iterator[Fault]], array: str = "variable",
    keys: str = "path and distribution",
) -> Study:  # fmt: skip
    """Read the file of a study over values of a scene.

    Args:
        path: Path of the file.
        kind: Tables of the study.
        faults: Yields contradictions between its tables.
        array: Array of tables that it must have.
        keys: Keys of each of these.

    Raises:
        CaseError: The file cannot be read, or has faults: all of them.
    """
    study = read_tables(path, kind, lambda tables: list(faults(tables)))
    if not getattr(study, array):
        fault = Fault((), f"no [[{array}]]", f"at least one, with {keys}", where=f"{path}: {array}")
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


QUANTILES = (0.025, 0.25, 0.5, 0.75, 0.975)
Counts = tuple[int, int, int, int, int, int]
Model = Scene | Callable[[dict[str, Array]], Mapping[str, Any]]


@checked
def uncertain(
    model: Model, distributions: Mapping[str, Any], *, correlation: Pairs | None = None,
    limits: Mapping[str, float] | None = None, members: int = 4096, sampling: Sampling = "sobol", replicates: int = 16,
    seed: int = 0, rare: bool = False, rare_members: int = 500, rare_replicates: int = 20, sensitivity: int = 0,
    period: Period | None = None, starts: SceneState | None = None, steps: int = 400, settle: int = 100,
    rounds: int = 4, orders: int = 8, measure: int = 48, exponents: int = 200, scheme: LinearScheme = MIDPOINT,
    threads: int | None = None, figures: Sequence[Figure] = (), output: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> Uncertain:  # fmt: skip
    """Return figures as distributions for each response, and probabilities with 95 % intervals.

    Members of a scene march in lock-step to their responses, which are distinguished as by `atlas`: by shooting, with
    their multipliers, order and impacts. Figures are taken over `measure` periods of the response; see
    `found.figures`. Several starts are one more input, "start", which takes each of them as often.

    Args:
        model: A scene whose loads repeat; or a function of values by path, (members,), that returns figures by name,
            (members,), NaN where it has none. Its members have no responses.
        distributions: Frozen distributions of scipy.stats, by path as of `scene.with_`.
        correlation: Rank correlations (Spearman) by pairs of paths, by a Gaussian copula.
        limits: Limits by figure; the result has the probabilities that they are exceeded.
        members: Members of all replicates.
        sampling: "sobol", randomised Sobol points; "latin", Latin hypercubes; "random".
        replicates: Number of independent randomisations: their scatter gives the intervals.
        seed: Seed of all draws.
        rare: Probabilities of exceeding the limits by subset simulation, too.
        rare_members: Members of a level of each replicate.
        rare_replicates: Replicates of subset simulation.
        sensitivity: Points of Sobol indices, a power of two; each takes (inputs + 2) evaluations; 0: none.
        period: Period of the loads, s; or a function of the values by path.
        starts: Starts of all members; default at rest, undeformed.
        steps: Steps in a period.
        settle: See `atlas`.
        rounds: See `atlas`.
        orders: See `atlas`.
        measure: Periods over which figures are taken.
        exponents: See `atlas`.
        scheme: Scheme of the time integration.
        threads: As of `ensemble`.
        figures: Figures of one's own, by `gapbeam.figure`, of a scene: as of `ensemble`, over whole periods.
        output: A folder for tables, a picture, and finished members: a call with the same arguments continues there.
        progress: Called with the number of members that are done.

    Raises:
        UserError: A distribution, path, limit or number cannot be, or the folder has another study.
        NotWritten: The folder takes no file.

    Source: see `probability`, `subset_simulation` and `indices_of` in gapbeam.studies.uncertain.
    """
    given, counts = dict(distributions), (steps, settle, rounds, orders, measure, exponents)
    answer, key = _answered(model, given, period, starts, counts, scheme, threads, figures), None
    if isinstance(answer, SceneModel) and answer.starts.q.shape[1] > 1:
        given[START] = randint(0, answer.starts.q.shape[1])
    inputs = inputs_of(given, correlation)
    if sensitivity and not np.array_equal(inputs.factor, np.eye(len(inputs.factor))):
        raise UserError("uncertain: Sobol indices share out the variance of independent inputs; leave correlation out")
    if rare_members < 100 or rare_replicates < 2:
        raise UserError("uncertain: expected 100 rare_members or more, and 2 rare_replicates or more")
    units = figure_units(model, figures) if isinstance(model, Scene) else {}
    wanted = {}
    for name, limit in (limits or {}).items():
        kind, slash, place = name.partition("/")
        place = model.short_name(place) if isinstance(model, Scene) else place
        wanted[f"{kind}{slash}{place}"] = float(finite(limit, f"uncertain: limit of {name}"))
    if units:
        _check_names(wanted, units)
    normal = normal_points(sampling, members, replicates, len(given), seed)
    if output is not None:
        key = _key(model, answer, [*counts, scheme, *figures])
    kept = KeptAnswers(answer, None if output is None else Path(output), key, progress)

    def at(points: Array) -> Answers:
        return kept(inputs.values(points))

    d = len(given)
    found = at(normal.reshape(-1, d))
    _check_names(wanted, units or found.figures)
    shape, independent = (replicates, -1), sampling == "random"
    response = found.response.reshape(shape)
    known = ~np.isin(response, UNKNOWN)
    kinds, counts = np.unique(found.response, return_counts=True)
    kinds = kinds[np.argsort(-counts, kind="stable")]
    distributions_of = {}
    for kind in kinds:
        for name, y in found.figures.items():
            inside = (response == kind) & np.isfinite(y.reshape(shape))
            values = y[inside.ravel()]
            if len(values):
                distributions_of[str(kind), name] = Distribution(
                    mean_of(y.reshape(shape), inside, independent), float(values.std(ddof=min(len(values) - 1, 1))),
                    dict(zip(QUANTILES, map(float, np.quantile(values, QUANTILES)), strict=True)),
                    float(values.min()), float(values.max()),
                )  # fmt: skip

    def exceeds(name: str, part: slice) -> Any:
        y = found.figure(name).reshape(shape)[:, part]
        return probability(y > wanted[name], np.isfinite(y), independent)

    each, halves = members // replicates, Convergence([], {})
    for n in (each >> k for k in range(4, -1, -1)):
        if n >= 2:
            halves.members.append(n * replicates)
            for name in wanted:
                halves.exceeded.setdefault(name, []).append(exceeds(name, slice(n)))
    subsets = {}
    for number, name in enumerate(wanted if rare else ()):

        def figure(points: Array, name: str = name) -> Array:
            return at(points).figure(name)

        subsets[name] = subset_simulation(figure, d, wanted[name], rare_members, rare_replicates, seed + 1 + number)
    indices = indices_of(lambda points: at(points).figures, d, sensitivity, seed) if sensitivity else {}
    result = Uncertain(
        values=inputs.values(normal.reshape(-1, d)), response=found.response, figures=found.figures,
        replicates=replicates, limits=wanted,
        responses={str(kind): probability(response == kind, known, independent) for kind in kinds
                   if kind not in UNKNOWN},
        unknown=float(1.0 - known.mean()), distributions=distributions_of,
        exceeded={name: exceeds(name, slice(None)) for name in wanted}, rare=subsets, inputs=list(given),
        indices=indices, convergence=halves, folder=None if output is None else Path(output), units=units,
    )  # fmt: skip
    if output is not None:
        write_uncertain(result, Path(output))
    return result


def _check_names(wanted: Iterable[str], known: Iterable[str]) -> None:
    """Refuse limits of figures that there are not."""
    for name in wanted:
        if name not in known:
            close = near(name, list(known))
            hint = f"did you mean {close}? " if close else ""
            raise UserError(f"uncertain: no figure {name!r}; {hint}figures: {', '.join(known) or 'none'}")


def _answered(
    model: Model, given: dict[str, Any], period: Period | None, starts: SceneState | None, counts: Counts,
    scheme: LinearScheme, threads: int | None, figures: Sequence[Figure],
) -> Callable[[dict[str, Array]], Answers]:  # fmt: skip
    """Return the model as a function from values to answers, after checking the request."""
    if not isinstance(model, Scene):
        if not callable(model):
            raise UserError(f"uncertain: found {model!r}, expected a scene or a function of values by path")
        if period is not None or starts is not None or figures:
            raise UserError("uncertain: a function has no period, starts or own figures; they are of scenes")
        return CalledModel(model)
    if period is None:
        raise UserError(
            "uncertain: a scene needs the period of its loads, `period=`; for one whose loads do not repeat, give a "
            "function that marches an ensemble and returns figures"
        )
    if min(counts) < 1 or counts[-1] < 50:
        raise UserError(
            "uncertain: expected steps, settle, rounds, orders and measure from 1 on, and exponents from 50 on"
        )
    if scheme.is_accelerated:
        raise UserError("uncertain: the scheme has accelerations as states; take the midpoint rule or theta")
    if START in given:
        raise UserError(f"uncertain: {START!r} is the input of several starts; give `starts=`")
    if model.is_large:
        raise UserError("uncertain: a structure has too many DOFs; reduce it: structure.reduced(modes)")
    for one, words in response_figure_faults(model, figures):
        raise UserError(f"uncertain: figure {one.name}: {words}")
    return SceneModel(model, period, starts or model.state(), *counts, scheme, threads, tuple(figures))


def _key(model: Model, answer: Any, settings: list[Any]) -> str:
    """Return a hash of all that answers follow from, beside the values."""
    if not isinstance(model, Scene):
        return fingerprint(model)
    T = answer.period
    times = answer.starts.t + (1.0 if callable(T) else float(T)) * np.linspace(0.0, 1.0, 50)
    return ensemble_key(model, {}, 1, answer.starts, times, *settings, fingerprint(T) if callable(T) else T)


def run_uncertain(
    study: UncertainStudy, one: PeriodicScene, folder: Path, progress: Callable[[int], None] | None = None
) -> Uncertain:
    """March the members of a study, and write tables and a picture; a call with the same folder continues there.

    Args:
        study: As read.
        one: The scene of its case.
        folder: Folder for the files.
        progress: Called with the number of members that are done.

    Raises:
        UserError: The scene has no such value or figure, or does not take a value that was drawn.
        NotWritten: A file could not be written.
    """
    rare, causes = study.rare or Rare(), study.sensitivity
    limits = {limit.figure: limit.value for limit in study.limit}
    given = {variable.path: variable.frozen for variable in study.variable}
    if not one.scene.point_names and any(name.startswith(("peak/", "rms/")) for name in limits):
        raise UserError("uncertain: the case has no probe, and so no displacement; add a [[probe]]")
    if isnan(one.period):
        raise UserError("uncertain: no load of the case varies; expected one that repeats; try gapbeam sweep or atlas")
    unfit = {figure.name: words for figure, words in response_figure_faults(one.scene, one.figures)}
    for name, words in unfit.items():
        if name in limits:
            raise UserError(f"uncertain: [[limit]] of figure {name}: {words}")
        LOG.warning("figure %s is left out: %s", name, words)
    with study_folder(folder):
        return uncertain(
            one.scene, given, correlation={pair.paths: pair.rank for pair in study.correlation}, limits=limits,
            members=study.members, sampling=study.sampling, replicates=study.replicates, seed=study.seed,
            rare=study.rare is not None, rare_members=rare.members, rare_replicates=rare.replicates,
            sensitivity=0 if causes is None else causes.points, period=one.period, starts=study.begin(one),
            steps=one.steps, settle=study.settle, rounds=study.rounds, orders=study.orders,
            measure=study.measure, figures=[figure for figure in one.figures if figure.name not in unfit],
            output=folder, progress=progress,
        )  # fmt: skip
