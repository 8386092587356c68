"""The atlas of a case: all responses over values of keys, as tables and pictures in a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, isnan, pi
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from gapbeam.postprocess.figures.figure_style import write_figure
from gapbeam.postprocess.report.sections.atlas_section import ATLAS_FILE, ATLAS_PICTURE, responses_of, shown_responses
from gapbeam.postprocess.study_figures.study_axis import Units, is_logarithmic, si_key
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.run.output.results_folder import finite
from gapbeam.solver.scene.ensemble_members import response_figure_faults
from gapbeam.solver.scene.lane_ensemble import ensemble
from gapbeam.solver.scene.recorded_places import turning_places
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_seat import NoSeat, seat
from gapbeam.solver.schema.record_table import TURNING
from gapbeam.studies.atlas.atlas_figures import draw_basins, draw_responses
from gapbeam.studies.atlas.cycle_search import cycle_atlas, draw_cycles
from gapbeam.studies.atlas.followed_responses import FollowedResponse, Shaken, follow_responses
from gapbeam.studies.atlas.response_atlas import Atlas, AtlasPoint, Response, atlas, drawn_starts, single_motions
from gapbeam.studies.engine.study_journal import StudyJournal
from gapbeam.studies.printed_results import DOUBTFUL, PrintedResult, table_of
from gapbeam.studies.study_folder import StudyPlan, study_folder, study_written, write_json, write_table
from gapbeam.studies.trials.axes import Axis, points_of

BRANCHES = "branches.csv"
JOURNAL = "points.jsonl"  # while the atlas is under way
CYCLE_STEPS = 200
"""Steps in a period of the fastest growing oscillation, with all contacts idle."""


@dataclass(frozen=True, eq=False)
class PeriodicScene:
    """The scene of a case under loads that repeat.

    Attributes:
        scene: Its structure, contacts and loads.
        period: Period of all loads, s; NaN: none varies after `rise`.
        step: Step of the case, s: the atlas takes the whole part of a period below it.
        rise: Time after which all loads have their full amplitude, s.
        figures: Figures of one's own.
    """

    scene: Scene
    period: float
    step: float
    rise: float
    figures: tuple[Figure, ...] = ()

    @property
    def steps(self) -> int:
        """Steps of a period: as few as are no longer than the step of the case."""
        return ceil(self.period / self.step * (1.0 - 1e-9))

    @property
    def begin(self) -> float:
        """Time from which all loads have their full amplitude, s: a whole number of periods where they have one."""
        return self.rise if isnan(self.period) else ceil(self.rise / self.period - 1e-9) * self.period


@dataclass(frozen=True, repr=False)
class AtlasResult(PrintedResult):
    """All responses of a case.

    Attributes:
        folder: Folder of its files.
        atlas: The responses.
        records: One a point, as in atlas.json.
        paths: Files.
        branches: Responses that were followed over the key.
    """

    folder: Path
    atlas: Atlas
    records: Sequence[dict[str, Any]]
    paths: Sequence[Path]
    branches: Sequence[FollowedResponse] = ()

    @property
    def exit_status(self) -> int:
        """0 where each start came to a response or to chaos, else 5."""
        return 0 if self.atlas.is_complete else DOUBTFUL

    def headline(self) -> str:
        """Return the result in one line."""
        counts = [len(one.responses) for one in self.atlas.points]
        several = sum(count + (one.chaotic > 0.0) > 1 for count, one in zip(counts, self.atlas.points, strict=True))
        chaos = sum(one.chaotic > 0.0 for one in self.atlas.points)
        left = float(np.mean([one.unsettled + one.failed for one in self.atlas.points]))
        periodic = all(r.order >= 1 for one in self.atlas.points for r in one.responses)
        kind = "stable periodic response" if periodic else "stable response"
        words = f"{counted(sum(counts), kind)} at {counted(len(counts), 'point')}, {several} with several responses"
        words += f", {chaos} with chaos" if chaos else ""
        rest = (
            f"; {left:.1%} of the starts did not settle: raise settle, rounds or orders, or take other steps"
            if left
            else ""
        )
        return words + rest

    def tables(self) -> list[Table]:
        """Return one line for each response, and one for each that was followed."""
        found = [table_of(*shown_responses(self.records))]
        return [*found, table_of(*branch_rows(self.branches))] if self.branches else found


def branch_rows(branches: Sequence[FollowedResponse]) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
    """Return heads and one row for each response that was followed: where it is, and how it ends."""
    heads = (
        "branch", "order", "from", "to", "lower end", "lower end at", "upper end", "upper end at",
        "values without a start",
    )  # fmt: skip
    rows = [
        (
            number, one.order, float(one.values[0]), float(one.values[-1]), one.ends[0], _known(one.limits[0]),
            one.ends[1], _known(one.limits[1]), sum(k is None for k in one.numbers),
        )
        for number, one in enumerate(branches, 1)
    ]  # fmt: skip
    return heads, rows


def _known(value: float) -> float | None:
    return None if isnan(value) else value


def run_atlas(
    scene_at: Callable[[tuple[str, ...]], PeriodicScene], axes: Sequence[Axis], folder: Path, *, starts: int = 64,
    settle: int = 100, rounds: int = 4, orders: int = 8, reach: float = 2.0, seed: int = 0,
    progress: Callable[[int, int], None] | None = None, inputs: dict[str, Any] | None = None, follow: bool = False,
    units: Units | None = None, overwrite: bool = False,
) -> AtlasResult:  # fmt: skip
    """Find all responses of a case at each combination of values, and write tables and pictures.

    Starts are the seat with velocities of the probes drawn evenly, up to `reach` times those of the motion that
    follows from the seat; without loads that vary those of `CycleSearch`.

    Args:
        scene_at: Returns the scene with these overrides, KEY=VALUE.
        axes: Axes of the atlas, at most two keys, with numbers as values.
        folder: Folder for the files.
        starts: Number of starts at each point.
        settle: See `atlas`.
        rounds: See `atlas`.
        orders: See `atlas`.
        reach: Largest velocity of a start, relative to the motion from the seat.
        seed: Seed of the draws.
        progress: Called with the number of points that are done, and of all.
        inputs: All that decides the scenes, and values of the axes: an atlas of the same inputs that was killed
            resumes after its last point. None: none resumes.
        follow: Follow responses over the key, to where they end; see `gapbeam.follow`.
        units: SI units of the keys, as far as they are known.
        overwrite: Begin anew.

    Raises:
        UserError: An axis has no numbers, there are three, responses are followed over another number of keys than one,
            or of a scene without loads that repeat, a scene has no probe, or its loads move none, or the folder holds
            an atlas of other inputs.
        NotWritten: A file could not be written.
    """
    if len(axes) > 2:
        raise UserError(f"atlas: found {counted(len(axes), 'key')}, expected at most 2")
    over = {axis.key: _numbers(axis) for axis in axes}
    if follow and (len(axes) != 1 or not np.all(np.diff(over[axes[0].key]) > 0.0)):
        raise UserError("atlas: responses are followed over one key whose values increase; expected one --vary")
    points = points_of(axes) if axes else [()]
    plan = None
    if inputs is not None:
        numbers = {"starts": starts, "settle": settle, "rounds": rounds, "orders": orders, "reach": reach, "seed": seed}
        plan = StudyPlan({**inputs, **numbers, "follow": follow}, overwrite, (JOURNAL,))
    with study_folder(folder, plan=plan):
        found: list[Atlas] = []
        journal, scene = None if plan is None else StudyJournal(folder / JOURNAL), None
        for number, values in enumerate(points):
            kept = None if journal is None else journal.kept.get(number)
            if kept is None or number == 0:
                texts = tuple(f"{axis.key}={value}" for axis, value in zip(axes, values, strict=True))
                one = scene_at(texts)
                cycles = isnan(one.period)
                if follow and cycles:
                    raise UserError(
                        "atlas: found responses to follow without loads that repeat; expected loads that do: limit "
                        "cycles are not followed, leave out --follow"
                    )
                begin = rest_of(one) if cycles else starts_of(one, settle, starts, reach, seed)
                scene = scene or one.scene
            if kept is not None:
                part = _resumed(kept, begin)
            elif cycles:
                part = cycle_atlas(one.scene, begin, starts, reach, seed, CYCLE_STEPS, settle, rounds)
            else:
                part = atlas(
                    one.scene, period=one.period, starts=begin, steps=one.steps, settle=settle, rounds=rounds,
                    orders=orders, figures=fit_figures(one, first=number == 0),
                )  # fmt: skip
            if kept is None:
                named = dict(zip(over, map(float, values), strict=True))
                part = replace(part, points=[replace(part.points[0], values=named)])
                if journal is not None:
                    journal.write(number, _kept(part))
            found.append(part)
            if progress is not None:
                progress(number + 1, len(points))
        assert scene is not None
        whole = Atlas(
            over, [part.points[0] for part in found], np.vstack([part.which for part in found]), found[0].starts,
            {name: np.concatenate([part.strobes[name] for part in found]) for name in found[0].strobes},
            turning_places(scene),
        )  # fmt: skip
        turning = {TURNING: list(whole.turning)}
        known = {**(units or {}), **{figure.name: figure.unit_in(turning) for figure in one.figures}}
        records = [finite(_record(point) | turning | {"units": known}) for point in whole.points]
        paths = [folder / ATLAS_FILE, folder / "atlas.csv", folder / ATLAS_PICTURE]
        write_json(paths[0], records)
        write_table(paths[1], *responses_of(records))
        with study_written(paths[2]):
            picture = draw_cycles(whole.points, over, whole.turning) if cycles else _picture(whole, scene)
            give_units(picture, over, known)
            write_figure(picture, paths[2])
        branches = _followed(whole, scene_at) if follow else []
        if branches:
            paths.append(folder / BRANCHES)
            write_table(paths[-1], *branch_rows(branches))
        if journal is not None:
            journal.close()
    return AtlasResult(folder, whole, records, paths, branches)


def fit_figures(one: PeriodicScene, first: bool = True) -> list[Figure]:
    """Return the figures of one's own that a response can have; those that it cannot are named at the first point."""
    unfit = {figure.name: words for figure, words in response_figure_faults(one.scene, one.figures)}
    for name, words in unfit.items() if first else ():
        LOG.warning("figure %s is left out: %s", name, words)
    return [figure for figure in one.figures if figure.name not in unfit]


def _followed(found: Atlas, scene_at: Callable[[tuple[str, ...]], PeriodicScene]) -> list[FollowedResponse]:
    """Return the responses of an atlas over one key, followed."""
    (key,) = found.over

    @lru_cache(maxsize=16)
    def at(value: float) -> Shaken:
        one = scene_at((f"{key}={value!r}",))
        return Shaken(one.scene, one.period, one.steps, one.begin)

    return follow_responses(found.points, at)


def _kept(part: Atlas) -> dict[str, Any]:
    """Return one point of an atlas as its record in the journal."""
    responses = [
        vars(one)
        | {
            "state": {name: getattr(one.state, name).tolist() for name in ("q", "v", "z", "F")} | {"t": one.state.t},
            "strobes": one.strobes.tolist(),
            "multipliers": [np.real(one.multipliers).tolist(), np.imag(one.multipliers).tolist()],
            "peak": {name: np.asarray(value).tolist() for name, value in one.peak.items()},
        }
        for one in part.points[0].responses
    ]
    strobes = {name: one.tolist() for name, one in part.strobes.items()}
    return {"point": vars(part.points[0]) | {"responses": responses}, "which": part.which.tolist(), "strobes": strobes}


def _resumed(record: dict[str, Any], starts: SceneState) -> Atlas:
    """Return one point of an atlas from its record in the journal."""
    responses = []
    for one in record["point"]["responses"]:
        state = {name: value if name == "t" else _floats(value) for name, value in one["state"].items()}
        real, imaginary = (_floats(part) for part in one["multipliers"])
        kinds = {"state": SceneState(**state), "strobes": _floats(one["strobes"]), "multipliers": real + 1j * imaginary}
        peak = {name: _floats(value)[()] for name, value in one["peak"].items()}
        kinds |= {"period": float(_floats(one["period"]))}
        kinds |= {name: tuple(one.get(name, ())) for name in ("interval", "frequencies")}
        responses.append(Response(**one | kinds | {"peak": peak}))
    known = {name: float(_floats(record["point"][name])) for name in ("exponent", "period")}
    point = AtlasPoint(**record["point"] | {"responses": responses} | known)
    strobes = {name: _floats(value) for name, value in record["strobes"].items()}
    return Atlas({}, [point], np.array(record["which"]), starts, strobes)


def _floats(values: Any) -> Any:
    """Return numbers of a record, where null is none."""
    return np.array(values, dtype=float)


def _numbers(axis: Axis) -> Any:
    try:
        return np.array([float(value) for value in axis.values])
    except ValueError:
        raise UserError(f"atlas: {axis.key}: found {', '.join(axis.values)}; expected numbers") from None


def rest_of(one: PeriodicScene) -> SceneState:
    """Return the seat at a time when the loads have their full amplitude; undeformed where there is none."""
    t = one.begin
    try:
        rest = one.scene.state() if isnan(one.period) and not _pushed(one.scene, t) else seat(one.scene, t)
    except (NoSeat, NotConverged):
        rest = one.scene.state()
    rest.t = t
    return rest


def _pushed(scene: Scene, t: float) -> bool:
    """Return whether a load acts at a time."""
    return any(np.any(load.table(np.array([t]))) for load in scene.loads)


def starts_of(one: PeriodicScene, settle: int, count: int, reach: float, seed: int) -> SceneState:
    """Return drawn starts: the seat with velocities of the probes, at a time when the loads have their full amplitude.

    Of probes whose motions follow those of the ones before, such as a third on a rigid bar, none are drawn.

    Args:
        one: Scene that starts.
        settle: Periods after which the motion from the seat is measured.
        count: Starts.
        reach: Largest velocity, over the velocity of the motion from the seat.
        seed: Seed of the draws.

    Raises:
        UserError: The scene has no probe, or its loads move none.
    """
    scene, T, rest = one.scene, one.period, rest_of(one)
    names, drawn = list[str](), scene.rows([])
    for name, point in scene.point_names.items():
        more = np.vstack([drawn, scene.rows_at(point)])
        if np.linalg.matrix_rank(more / np.linalg.norm(more, axis=1, keepdims=True).clip(1e-300)) == len(more):
            names, drawn = [*names, name], more
    if not names:
        raise UserError("starts are drawn by velocities of points, found none; add a [[probe]] or a [[point]]")
    if not reach > 0.0:
        raise UserError(f"found a reach of {reach:g}, expected one above 0")
    steps = one.steps
    first = ensemble(
        scene,
        step=T / steps,
        end=rest.t + 2 * settle * T,
        settle=rest.t + settle * T,
        start=rest,
        members=1,
        period=T,
        harmonics=0,
    )
    speeds = {}
    for name in names:
        moved = np.max(first.rms[name][0] ** 2 - abs(first.harmonics[name][0, 0]) ** 2)
        speeds[name] = float(2.0 * pi / T * np.sqrt(max(2.0 * moved, 0.0)))
    if not max(speeds.values()) > 0.0:
        raise UserError("the loads do not move the probes")
    ranges = {name: (-reach * speed, reach * speed) for name, speed in speeds.items()}
    return drawn_starts(scene, count, velocity=ranges, seed=seed, rest=rest)


def _record(one: AtlasPoint) -> dict[str, Any]:
    """Return a point as its record in atlas.json."""
    responses = [
        {
            "order": r.order, "starts": r.count, "share": r.share, "interval": list(r.interval),
            "multipliers": [[float(m.real), float(m.imag)] for m in r.multipliers],
            "largest_multiplier": float(np.abs(r.multipliers).max()),
            "peak": {name: float(one) for name, one in single_motions(peaks).items()},
            "impacts": {str(name): value for name, value in r.impacts.items()},
            "peak_force": {str(name): value for name, value in r.peak_force.items()},
            "period": r.period, "figures": r.figures, "frequencies": list(r.frequencies),
        }
        for r in one.responses
        for peaks in [{name: np.atleast_1d(one) for name, one in r.peak.items()}]
    ]  # fmt: skip
    shares = {"chaotic": one.chaotic, "exponent": one.exponent, "unsettled": one.unsettled, "failed": one.failed}
    return {"values": one.values, "period": one.period, "responses": responses, **shares}


def _picture(found: Atlas, scene: Scene) -> Any:
    names = list(single_motions({name: scene.rows_at(point) for name, point in scene.point_names.items()}))
    if found.over:
        return draw_responses(found, names[-1])
    up = (names[-2], "velocity") if len(names) > 1 else (names[-1], "displacement")
    return draw_basins(found, (names[-1], "velocity"), up, scene)


def give_units(picture: Any, over: dict[str, Any], units: Units) -> None:
    """Give axes over a key its unit, and a logarithmic scale where its values are spread so."""
    for key, values in over.items():
        for axes in picture.axes:
            for axis in (axes.xaxis, axes.yaxis):
                if axis.get_label_text() == key:
                    axis.set_label_text(si_key(key, units))
                    if is_logarithmic(values):
                        axes.set(**{f"{axis.axis_name}scale": "log"})
