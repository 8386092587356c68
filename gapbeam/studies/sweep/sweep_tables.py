"""Results of a sweep: one table of all responses, the census, and a picture.

A sweep reads its points, computes the responses in parallel and classifies them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Column, Table

from gapbeam.postprocess.report.sections.sweep_section import ENSEMBLES_FILE, MAP_FILE, shown_figures
from gapbeam.postprocess.results.bounded_files import as_written
from gapbeam.postprocess.study_figures.study_axis import si_key
from gapbeam.postprocess.study_figures.sweep_branches import (
    Branch,
    SweepPoint,
    census,
    census_words,
    draw_branches,
    draw_map,
    start_words,
)
from gapbeam.solver.diagnostics.statistics.run_statistics import FEWEST_MEMBERS, pooled_figures
from gapbeam.solver.diagnostics.statistics.statistic_figures import may_be_asked
from gapbeam.solver.messages.errors import CaseError
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.workers import Workers
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import study_folder, write_json, write_table
from gapbeam.studies.sweep.sweep_plan import (
    Chain,
    Sweep,
    chains_of,
    finished,
    plan_of,
    point_file,
    prepare,
    read_points,
    written_responses,
)
from gapbeam.studies.sweep.sweep_point import lost_chain, run_chain

LOAD, SEED = "load.", ".seed"


@dataclass(frozen=True)
class Ensemble:
    """Members that differ in seeds only.

    Attributes:
        values: Values of the other keys of the sweep, as typed.
        members: Number of members.
        seconds: Seconds of all records behind the burn-ins, s.
        figures: Pooled figures, as `pooled_figures` returns them.
    """

    values: dict[str, str]
    members: int
    seconds: float
    figures: list[dict[str, Any]]


def ensembles_of(records: Sequence[Mapping[str, Any]]) -> list[Ensemble]:
    """Return the ensembles of two members and more among the responses of a sweep, in the order of the points.

    Members have passed, and have statistics. Responses from other starts, or carried ones, are no members.
    """
    groups: dict[tuple[tuple[str, str], ...], dict[tuple[str, ...], Mapping[str, Any]]] = {}
    for record in records:
        seeds = tuple(value for key, value in record["values"].items() if is_seed(key))
        if not seeds or record["verdict"] != "passed" or not (record.get("statistics") or {}).get("figures"):
            continue
        others = tuple((key, value) for key, value in record["values"].items() if not is_seed(key))
        groups.setdefault(others, {}).setdefault(seeds, record)
    return [
        _pooled(dict(others), list(members.values()))
        for others, members in groups.items()
        if len(members) >= FEWEST_MEMBERS
    ]


def is_seed(key: str) -> bool:
    """Return whether a key of a sweep is the seed of a load."""
    return key.startswith(LOAD) and key.endswith(SEED)


def ensemble_words(one: Ensemble) -> str:
    """Return the result of an ensemble and the need of its least certain figure, in one line."""
    known = [figure for figure in one.figures if figure["relative"] is not None and may_be_asked(figure["name"])]
    words = f"{counted(one.members, 'member')}, {one.seconds:.6g} s together"
    if not known:
        return words
    widest = max(known, key=lambda figure: float(figure["relative"]))
    need = float(widest["time_for_2_percent"])
    return (
        f"{words}; least certain: {widest['name']} +- {widest['relative']:.1%} of {widest['effective_samples']:.0f} "
        f"independent samples, relative variance {widest['relative_variance_times_time']:.3g} / T[s], "
        f"2 % takes {need:.3g} s, {need / one.members:.3g} s of each member"
    )


def _pooled(values: dict[str, str], members: list[Mapping[str, Any]]) -> Ensemble:
    found = [member["statistics"] for member in members]
    seconds = sum(float(one["seconds"]) - float(one["burn_in"]) for one in found)
    return Ensemble(values, len(members), seconds, pooled_figures(found))


PLAIN = ("direction", "start", "verdict", "response", "period", "repeats_within", "transient", "windows")
FIGURES = ("periods_in_a_window", "created", "residual", "penetration", "peak_force")


def write_tables(folder: Path, records: Sequence[Mapping[str, Any]], points: Sequence[SweepPoint]) -> list[Path]:
    """Write sweep.csv (a row a response), sweep.json (all that is known of it), census.json and sweep.png.

    A sweep over a grid of two keys has a map, sweep-map.png, too.

    Where points differ in the seeds of noise only, ensembles.json has their pooled statistics.

    Returns:
        The files.
    """
    paths = [folder / name for name in ("sweep.csv", "sweep.json", "census.json", "sweep.png")]
    rows = [_row(record) for record in records]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    write_table(paths[0], columns, [[row.get(name, "") for name in columns] for row in rows])
    write_json(paths[1], list(records))
    write_json(paths[2], [_as_data(point) for point in points])
    ensembles = ensembles_of(records)
    pooled = folder / ENSEMBLES_FILE
    pooled.unlink(missing_ok=True)
    if ensembles:
        write_json(pooled, [vars(one) for one in ensembles])
    more = [pooled] if ensembles else []
    if any(point.branches for point in points):
        draw_branches(points, paths[3])
        drawn = draw_map(points, folder / MAP_FILE)
        return [*paths, *more, *([drawn] if drawn else [])]
    return [*paths[:3], *more]


def _row(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record as one flat row; accelerations in g too. One window alone says nothing on scatter."""
    row: dict[str, Any] = dict(record["values"])
    row |= {name: record.get(name) for name in PLAIN + FIGURES}
    row |= {f"{name} (s)": value for name, value in (record.get("seconds") or {}).items()}
    for name, figure in (record.get("figures") or {}).items():
        row[f"{name} ({figure['unit']})"] = figure["mean"]
        seen = record.get("windows", 1) > 1 and not figure.get("own")
        row[f"{name} scatter ({figure['unit']})"] = figure["scatter"] if seen or figure["scatter"] else None
        if "low" in figure:
            row |= {f"{name} {end} ({figure['unit']})": figure[end] for end in ("low", "high")}
        if "mean_in_g" in figure:
            row[f"{name} (g)"] = figure["mean_in_g"]
    for one in (record.get("statistics") or {}).get("figures", ()):
        unit = f"({one['unit']})"
        row |= {f"{one['name']} {unit}": one["value"], f"{one['name']} verdict": one["verdict"]}
        row |= {f"{one['name']} {end} {unit}": one[end] for end in ("low", "high")}
    return row | {"message": record["message"], "notes": "; ".join(record["notes"])}


def _as_data(point: SweepPoint) -> dict[str, Any]:
    return {
        "values": point.values,
        "responses": [
            {
                "response": branch.word,
                "reached": branch.count,
                "reached_from": branch.reached_from,
                "figures": {
                    name: {"mean": mean, "scatter": scatter, "unit": unit}
                    for name, (mean, scatter, unit) in branch.figures.items()
                },
            }
            for branch in point.branches
        ],
        "did_not_pass": [
            {name: record.get(name) for name in ("start", "direction", "verdict", "message", "notes", "figures")}
            for record in point.failures
        ],
    }


def ensemble_table(one: Ensemble) -> Table:
    """Return the pooled figures of an ensemble for the terminal."""
    where = ", ".join(f"{key} = {value}" for key, value in one.values.items())
    title = f"{one.members} members together{f', {where}' if where else ''}"
    heads = ("figure", "value", "95 % interval", "+-", "independent", "variance x T", "s for 2 %", "judged")
    table = Table(*heads, box=None, title=title, title_justify="left")
    for figure in one.figures:
        known = figure["relative"] is not None
        unit = "" if figure["unit"] == "1" else f" {figure['unit']}"
        table.add_row(
            figure["name"],
            f"{figure['value']:.4g}{unit}",
            f"{figure['low']:.4g} to {figure['high']:.4g}",
            f"{figure['relative']:.1%}" if known else "",
            f"{figure['effective_samples']:.0f}",
            f"{figure['relative_variance_times_time']:.3g} s" if known else "",
            f"{figure['time_for_2_percent']:.3g}" if known else "",
            figure["verdict"],
        )
    return table


MOST_FIGURES = 6
"""Figures of the table in a terminal: more are cut off there."""


def census_table(points: Sequence[SweepPoint]) -> Table:
    """Return the census for the terminal: a row a response of a point."""
    every = list(shown_figures(points).items())
    names, left = dict(every[:MOST_FIGURES]), len(every[MOST_FIGURES:])
    heads = [f"{name}, {unit}" for name, (unit, _) in names.items()]
    keys = [".\n".join(si_key(key, points[0].units).rsplit(".", 1)) for key in points[0].values]
    columns: list[Column | str] = [*(Column(key, overflow="fold") for key in keys), "response", "reached", *heads]
    more = f"{counted(left, 'more figure')} in sweep.csv" if left else None
    table = Table(*columns, box=None, title="Responses", title_justify="left", caption=more, caption_justify="left")
    for point in points:
        for branch in point.branches:
            cells = [_cell(branch, name, factor) for name, (_, factor) in names.items()]
            ways = ", ".join(f"{way}" for way in dict.fromkeys(branch.reached_from))
            table.add_row(*point.values.values(), branch.word, f"{branch.count} ({ways})", *cells)
        for record in point.failures:
            words = record["verdict"] if record["verdict"] != "passed" else "no figures"
            start, found = start_words(record), record.get("figures") or {}
            known = {name: factor * found[name]["mean"] for name, (_, factor) in names.items() if name in found}
            cells = [f"{known[name]:.4g}" if name in known else "" for name in names]
            table.add_row(*point.values.values(), words, f"from {start}" if start else "", *cells)
    return table


def _cell(branch: Branch, name: str, factor: float) -> str:
    if name not in branch.figures:
        return "-"
    mean, scatter, _ = branch.figures[name]
    return f"{factor * mean:.4g}" + (f" ± {factor * scatter:.2g}" if scatter > 5e-4 * abs(mean) else "")


@dataclass(frozen=True, repr=False)
class SweepResult(PrintedResult):
    """Result of a sweep.

    Attributes:
        folder: Folder of its files.
        records: One record a response, as in sweep.json.
        points: The different responses at each point.
        paths: The tables and the picture.
    """

    folder: Path
    records: Sequence[dict[str, Any]]
    points: Sequence[SweepPoint]
    paths: Sequence[Path]

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Records of the responses that did not pass."""
        return [record for record in self.records if record["exit_status"]]

    @property
    def ensembles(self) -> list[Ensemble]:
        """Points that differ in the seeds of their noise only, pooled."""
        return ensembles_of(self.records)

    @property
    def exit_status(self) -> int:
        """0 where all responses passed, else the largest exit status of a response."""
        return max((int(record["exit_status"]) for record in self.failed), default=0)

    @property
    def notes(self) -> list[tuple[str, int]]:
        """The ten most frequent notes on responses, each with the number of responses that have it."""
        return Counter(note for record in self.records for note in record["notes"]).most_common(10)

    def headline(self) -> str:
        """Return the number of responses that passed, and of points with several."""
        total = len(self.records)
        words = [f"{total - len(self.failed)} of {counted(total, 'response')} passed", *census_words(self.points)]
        return "; ".join([*words, *map(ensemble_words, self.ensembles)])

    def tables(self) -> list[Table]:
        """Return the table of the different responses, and that of each ensemble of seeds."""
        return [census_table(self.points), *map(ensemble_table, self.ensembles)]


def run_sweep(
    wanted: Sweep,
    folder: Path,
    overwrite: bool = False,
    workers: Workers | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> SweepResult:
    """Run a sweep, or resume the one in the folder.

    Args:
        wanted: The sweep.
        folder: Folder for the sweep.
        overwrite: Begin anew.
        workers: Workers that compute; by default one a core of this machine.
        progress: Called with the number of responses that are done, and of all.

    Returns:
        The result; responses that failed are in it, with their exit status.

    Raises:
        CaseError: Every point has faults; those of the first are reported.
        UserError: The case is no march, a state cannot be carried along the last key, or the folder holds another
            sweep or cannot be written.
        ResultsError: Results of an earlier sweep cannot be read.
        NotWritten: A response could not be written.
    """
    subjects = [entry for entry in read_points(wanted).values() if not isinstance(entry, CaseError)]
    with study_folder(folder, plan=plan_of(wanted, subjects, overwrite)):
        done = prepare(wanted, folder)
        chains = chains_of(wanted, folder)
        total = sum(len(chain.tasks) for chain in chains)
        if done:
            LOG.info("%d of %d responses are on disk already", done, total)

        def tick() -> None:
            if progress is not None:
                progress(written_responses(folder), total)

        tick()
        missing = [chain for chain in chains if not all(point_file(folder, task).exists() for task in chain.tasks)]
        lost: dict[int, dict[str, Any]] = {}

        def give_up(chain: Chain, words: str) -> int:
            lost.update(lost_chain(chain, words))
            return 0

        with Engine(workers, len(missing), subjects[0].memory_with(subjects[1:]), folder) as engine:
            for _ in engine.done(run_chain, missing, tick, give_up):
                tick()
        with as_written(folder):
            records = [record for _, record in sorted((lost | finished(folder)).items())]
            points = census(records, wanted.tolerance)
            return SweepResult(folder, records, points, write_tables(folder, records, points))
