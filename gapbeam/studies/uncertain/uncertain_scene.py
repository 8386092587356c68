"""A scene with uncertain values: probabilities of responses and limits, distributions, rare events, Sobol indices.

A study file names the case, its starts, the variables and the folder.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import randint

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.argument_checks import finite
from gapbeam.solver.scene.ensemble_members import ensemble_key
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.run_atlas import PeriodicScene
from gapbeam.studies.study_folder import study_folder
from gapbeam.studies.uncertain.input_points import Pairs, Sampling, inputs_of, normal_points
from gapbeam.studies.uncertain.kept_answers import KeptAnswers
from gapbeam.studies.uncertain.member_responses import START, UNKNOWN, Answers, CalledModel, Period, SceneModel
from gapbeam.studies.uncertain.probability import mean_of, probability, subset_simulation
from gapbeam.studies.uncertain.sobol_indices import indices_of
from gapbeam.studies.uncertain.uncertain_file import Rare, UncertainStudy
from gapbeam.studies.uncertain.uncertain_result import Convergence, Distribution, Uncertain
from gapbeam.studies.uncertain.uncertain_writing import write_uncertain

QUANTILES = (0.025, 0.25, 0.5, 0.75, 0.975)
Counts = tuple[int, int, int, int, int, int]
Model = Scene | Callable[[dict[str, Array]], Mapping[str, Any]]


def uncertain(
    model: Model, distributions: Mapping[str, Any], *, correlation: Pairs | None = None,
    limits: Mapping[str, float] | None = None, members: int = 4096, sampling: Sampling = "sobol", replicates: int = 16,
    seed: int = 0, rare: bool = False, rare_members: int = 500, rare_replicates: int = 20, sensitivity: int = 0,
    period: Period | None = None, starts: SceneState | None = None, steps: int = 400, settle: int = 100,
    rounds: int = 4, orders: int = 8, measure: int = 48, exponents: int = 200, scheme: LinearScheme = MIDPOINT,
    threads: int | None = None, output: str | Path | None = None,
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
        limits: By figure; probabilities that it is exceeded.
        members: Of all replicates.
        sampling: "sobol", randomised Sobol points; "latin", Latin hypercubes; "random".
        replicates: Randomised on their own: their scatter gives the intervals.
        seed: Of all draws.
        rare: Probabilities of exceeding the limits by subset simulation, too.
        rare_members: Of a level of each replicate.
        rare_replicates: Of subset simulation.
        sensitivity: Points of Sobol indices, a power of two; each takes (inputs + 2) evaluations; 0: none.
        period: Of the loads, s; or a function of the values by path.
        starts: Of all members; default at rest, undeformed.
        steps: In a period.
        settle: See `atlas`.
        rounds: See `atlas`.
        orders: See `atlas`.
        measure: Periods over which figures are taken.
        exponents: See `atlas`.
        scheme: Of the time integration.
        threads: As of `ensemble`.
        output: A folder for tables, a picture, and finished members: a call with the same arguments continues there.
        progress: Called with the number of members that are done.

    Raises:
        UserError: A distribution, path, limit or number cannot be, or the folder has another study.
        NotWritten: The folder takes no file.

    Source: see `probability`, `subset_simulation` and `indices_of` in gapbeam.studies.uncertain.
    """
    given, counts = dict(distributions), (steps, settle, rounds, orders, measure, exponents)
    answer, key = _answered(model, given, period, starts, counts, scheme, threads), None
    if isinstance(answer, SceneModel) and answer.starts.q.shape[1] > 1:
        given[START] = randint(0, answer.starts.q.shape[1])
    inputs = inputs_of(given, correlation)
    if sensitivity and inputs.is_correlated:
        raise UserError("uncertain: Sobol indices share out the variance of independent inputs; leave correlation out")
    if rare_members < 100 or rare_replicates < 2:
        raise UserError("uncertain: expected 100 rare_members or more, and 2 rare_replicates or more")
    normal = normal_points(sampling, members, replicates, len(given), seed)
    if output is not None:
        key = _key(model, answer, [*counts, scheme])
    kept = KeptAnswers(answer, None if output is None else Path(output), key, progress)

    def at(points: Array) -> Answers:
        return kept(inputs.values(points))

    d = len(given)
    found = at(normal.reshape(-1, d))
    wanted = {name: float(finite(limit, f"uncertain: limit of {name}")) for name, limit in (limits or {}).items()}
    unknown = [name for name in wanted if name not in found.figures]
    if unknown:
        raise UserError(f"uncertain: no figure {unknown[0]!r}; figures: {', '.join(found.figures) or 'none'}")
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
        y = found.figures[name].reshape(shape)[:, part]
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
            return at(points).figures[name]

        subsets[name] = subset_simulation(figure, d, wanted[name], rare_members, rare_replicates, seed + 1 + number)
    indices = indices_of(lambda points: at(points).figures, d, sensitivity, seed) if sensitivity else {}
    result = Uncertain(
        values=inputs.values(normal.reshape(-1, d)), response=found.response, figures=found.figures,
        replicates=replicates, limits=wanted,
        responses={str(kind): probability(response == kind, known, independent) for kind in kinds
                   if kind not in UNKNOWN},
        unknown=float(1.0 - known.mean()), distributions=distributions_of,
        exceeded={name: exceeds(name, slice(None)) for name in wanted}, rare=subsets, inputs=list(given),
        indices=indices, convergence=halves, folder=None if output is None else Path(output),
    )  # fmt: skip
    if output is not None:
        write_uncertain(result, Path(output))
    return result


def _answered(
    model: Model, given: dict[str, Any], period: Period | None, starts: SceneState | None, counts: Counts,
    scheme: LinearScheme, threads: int | None,
) -> Callable[[dict[str, Array]], Answers]:  # fmt: skip
    """Return the model as a function from values to answers, after checking what is asked of it."""
    if not isinstance(model, Scene):
        if not callable(model):
            raise UserError(f"uncertain: found {model!r}, expected a scene or a function of values by path")
        if period is not None or starts is not None:
            raise UserError("uncertain: a function has neither period nor starts; they are of scenes")
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
    return SceneModel(model, period, starts or model.state(), *counts, scheme, threads)


def _key(model: Model, answer: Any, settings: list[Any]) -> str:
    """Return a hash of all that answers follow from, beside the values."""
    if not isinstance(model, Scene):
        code: Any = getattr(model, "__code__", None)
        if code is None:
            raise UserError("uncertain: `output=` needs a plain function or a scene, so that it can be recognised")
        return repr((code.co_code, code.co_consts, code.co_names))
    T = answer.period
    code = getattr(T, "__code__", None)
    if callable(T) and code is None:
        raise UserError("uncertain: `output=` needs a plain function as period, so that it can be recognised")
    times = answer.starts.t + (1.0 if callable(T) else float(T)) * np.linspace(0.0, 1.0, 50)
    return ensemble_key(model, {}, 1, answer.starts, times, *settings, (code.co_code, code.co_consts) if code else T)


def run_uncertain(
    study: UncertainStudy, one: PeriodicScene, folder: Path, progress: Callable[[int], None] | None = None
) -> Uncertain:
    """March the members of a study, and write tables and a picture; a call with the same folder continues there.

    Args:
        study: As read.
        one: The scene of its case.
        folder: Where files go.
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
    with study_folder(folder):
        return uncertain(
            one.scene, given, correlation={pair.paths: pair.rank for pair in study.correlation}, limits=limits,
            members=study.members, sampling=study.sampling, replicates=study.replicates, seed=study.seed,
            rare=study.rare is not None, rare_members=rare.members, rare_replicates=rare.replicates,
            sensitivity=0 if causes is None else causes.points, period=one.period, starts=study.begin(one),
            steps=one.steps, settle=study.settle, rounds=study.rounds, orders=study.orders,
            measure=study.measure, output=folder, progress=progress,
        )  # fmt: skip
