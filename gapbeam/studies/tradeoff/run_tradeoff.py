"""Trade-off of a case: run, stored on disk, and asked for the fidelity level of a tolerance.

A run that was asked for a tolerance states in its summary, last line and exit status whether it keeps it.

A trade-off is a table, plain data that `gapbeam run --tolerance` reads again, and a picture.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.postprocess.display_units import finite_or_none, in_percent
from gapbeam.postprocess.report.sections.tradeoff_section import TRADEOFF_FILE
from gapbeam.postprocess.report.study_json import read_object
from gapbeam.postprocess.results.bounded_files import as_written
from gapbeam.postprocess.shell_command import shell_command
from gapbeam.postprocess.study_figures.stability_map import Place, draw_pareto
from gapbeam.solver.case.case import Case, Output
from gapbeam.solver.case.checks.run_checks import whole_interval
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.run.outcome import Outcome
from gapbeam.solver.run.output.results_folder import write_summary
from gapbeam.studies.printed_results import PrintedResult
from gapbeam.studies.study_folder import StudyPlan, study_folder, write_json
from gapbeam.studies.tradeoff.level_errors import (
    GROUPS,
    WHOLE,
    Grounds,
    Judged,
    choice,
    doubts,
    group_of,
    nearest,
)
from gapbeam.studies.tradeoff.level_measurement import Level, MeasuredLevel
from gapbeam.studies.tradeoff.tradeoff_study import TradeoffStudy, run_study
from gapbeam.studies.trials.scene_subject import CaseSubject
from gapbeam.studies.trials.subject import shared_inputs

if TYPE_CHECKING:
    from mpi4py import MPI

PICTURE = "tradeoff.png"


def write_study(folder: Path, study: TradeoffStudy, key: Mapping[str, Any]) -> list[Path]:
    """Write tradeoff.json and tradeoff.png.

    Args:
        folder: Folder for the files; it is made if it does not exist.
        study: The trade-off.
        key: Inputs of the study, see `gapbeam.studies.tradeoff.run_tradeoff.study_key`.

    Returns:
        The files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / TRADEOFF_FILE, as_data(study, key))
    places = [
        Place(one.level.name, one.seconds, one.error, one in study.front, one is study.chosen)
        for one in study.levels
        if one.measured.verdict == "passed"
    ]
    picture = folder / PICTURE
    draw_pareto(places, max(study.grounds.uncertainty.values(), default=0.0), study.tolerance, picture)
    return [folder / TRADEOFF_FILE, picture]


def as_data(study: TradeoffStudy, key: Mapping[str, Any]) -> dict[str, Any]:
    """Return a trade-off as plain data in SI units."""
    return {
        "key": dict(key),
        "tolerance": study.tolerance,
        "chosen": study.chosen.level.name if study.chosen else None,
        "verdict": verdict(study),
        "promised": study.promised,
        "doubts": study.doubts,
        "end": study.grounds.end,
        "covered": study.reference.covered,
        "not_covered_because": study.grounds.cut,
        "periods_compared": study.periods,
        "chaotic": study.grounds.chaotic,
        "seconds": study.seconds,
        "notes": list(study.notes),
        "fixed": dict(study.plan.fixed),
        "reference": _row(study.reference, study),
        "uncertainty": dict(study.grounds.uncertainty),
        "reduced_against_full_on_the_mesh_of_the_case": study.full_check,
        "rungs": [_row(one, study) for one in study.levels],
        "skipped": [{"name": level.name, "predicted_seconds": seconds} for level, seconds in study.skipped],
    }


def _row(one: Judged, study: TradeoffStudy) -> dict[str, Any]:
    measured = one.measured
    return {
        "name": one.level.name,
        "changes": dict(one.level.changes),
        "verdict": measured.verdict,
        "message": measured.message,
        "dofs": measured.dofs,
        "mesh_dofs": measured.mesh_dofs,
        "step": measured.step,
        "set_up": measured.set_up,
        "per_simulated_second": measured.per_second,
        "seconds_of_the_case": one.seconds,
        "memory": measured.memory,
        "energy_residual": finite_or_none(measured.residual),
        "errors": one.errors,
        "covered": one.covered,
        "below_the_uncertainty": [
            name for name, error in one.errors.items() if error <= study.grounds.uncertainty[name]
        ],
        "statistics_beyond_scatter": finite_or_none(one.statistics),
        "means_known_to": finite_or_none(one.means),
        "other_cycle": one.statistics is not None and not isfinite(one.statistics),
        "responses": measured.words,
        "on_the_front": one in study.front,
        "long": {
            name: {"unit": figure.unit, "mean": figure.mean, "standard_error": figure.uncertainty}
            for name, figure in measured.long.items()
        },
    }


def as_table(study: TradeoffStudy) -> Table:
    """Return a trade-off for the terminal, fidelity levels from cheap to expensive."""
    table = Table(
        "", "DOFs", "set-up, s", "s per simulated s", "case, s", "memory, GB", "errors up to, s",
        *(f"{name}, %" for name in GROUPS), "means",
        title=f"Errors against {study.reference.level.name}", title_justify="left", box=None,
    )  # fmt: skip
    uncertain = [f"± {100 * study.grounds.uncertainty.get(name, 0.0):.2g}" for name in GROUPS]
    covered = f"{study.reference.covered:.3g}"
    table.add_row("the reference itself", *_costs(study.reference), covered, *uncertain, "")
    for one in sorted(study.levels, key=lambda one: one.seconds):
        mark = "* " if one is study.chosen else "  "
        if one.measured.verdict != "passed":
            table.add_row(f"  {one.level.name}", one.measured.verdict)
            continue
        cells = [_error(one, name, study) for name in GROUPS]
        table.add_row(mark + one.level.name, *_costs(one), f"{one.covered:.3g}", *cells, _means(one))
    return table


def verdict(study: TradeoffStudy) -> str:
    """Return the result of a trade-off in a sentence or two: the level to take, the span, and every doubt."""
    asked, grounds = f"{100 * study.tolerance:.3g} %", study.grounds
    doubt = f" The tolerance is not promised: {'; '.join(study.doubts)}." if study.doubts else ""
    if study.chosen is None:
        span = grounds.span_words(study.reference.covered)
        return f"no fidelity level is within {asked} of the reference {span}.{doubt}"
    one = study.chosen
    return (
        f"the cheapest fidelity level within {asked} of the reference {grounds.span_words(one.covered)}: "
        f"{one.level.name}, {in_percent(one.error)} off, {one.seconds:.3g} s for the case.{doubt}"
    )


def _costs(one: Judged) -> list[str]:
    measured = one.measured
    return [
        f"{measured.dofs}",
        f"{measured.set_up:.3g}",
        f"{measured.per_second:.3g}",
        f"{one.seconds:.3g}",
        f"{measured.memory / 1e9:.2f}",
    ]


def _error(one: Judged, name: str, study: TradeoffStudy) -> str:
    error = one.errors.get(name)
    if error is None:
        return "-"
    text = f"{100 * error:.2g}"
    return f"({text})" if error <= study.grounds.uncertainty.get(name, 0.0) else text


def _means(one: Judged) -> str:
    if one.statistics is None:
        return ""
    if not isfinite(one.statistics):
        return "another cycle"
    return "agree" if one.statistics <= 0.0 else f"{in_percent(one.statistics)} beyond"


FREE = ("title", "model", "output", "gates")  # what may differ between a study and a run that uses it


@dataclass(frozen=True)
class Taken:
    """The fidelity level that a run takes for a tolerance.

    Attributes:
        name: Name of the level.
        changes: Keys that it replaces.
        tolerance: The requested tolerance, as a fraction.
        errors: Errors of the level against the reference, by group of figures.
        uncertainty: Uncertainty of the reference, likewise.
        covered: Time from the start that the errors cover, s.
        doubts: Why the tolerance is not promised for the run; nothing where it is.
    """

    name: str
    changes: dict[str, Any]
    tolerance: float
    errors: dict[str, float]
    uncertainty: dict[str, float]
    covered: float
    doubts: tuple[str, ...]


def study_key(case: Case) -> dict[str, Any]:
    """Return the inputs of a trade-off: the case except for its title, model, outputs, gates and its end."""
    tables = case.model_dump(mode="json")
    time = {name: value for name, value in tables.pop("time").items() if name != "end"}
    return {name: table for name, table in tables.items() if name not in FREE} | {"time": time}


def stored_choice(folder: Path, case: Case, tolerance: float) -> Taken | None:
    """Return the cheapest fidelity level of a study on disk inside a tolerance; the nearest where none is inside.

    Args:
        folder: Folder of the study.
        case: The case to run.
        tolerance: Largest error that will do.

    Returns:
        None where there is no study of this very case, or only one of a shorter time.

    Raises:
        UserError: All fidelity levels of the study failed.
        ResultsError: The study cannot be read.
    """
    path = folder / TRADEOFF_FILE
    if not path.exists():
        return None
    with as_written(path):
        return _cheapest(path, case, tolerance)


def _cheapest(path: Path, case: Case, tolerance: float) -> Taken | None:
    study = read_object(path, ("key", "rungs", "fixed"), "remove it, or repeat the trade-off")
    if study.get("key") != study_key(case) or study.get("end", 0.0) < WHOLE * case.time.end:
        return None  # studies without an end compared the first forcing periods only
    grounds = Grounds(case.time.end, study["uncertainty"], study["chaotic"], study["not_covered_because"])
    levels = [_level(one) for one in study["rungs"]]
    taken = choice(levels, tolerance, grounds) or nearest(levels, grounds)
    if taken is None:
        raise UserError(f"{path}: every fidelity level failed; expected a run without `tolerance=`")
    found = doubts(taken, tolerance, grounds)
    if found and study["end"] > case.time.end / WHOLE:
        found.append(
            f"errors are those up to t = {study['end']:g} s: a trade-off of this shorter case may promise more"
        )
    fixed = {key: value for key, value in study["fixed"].items() if not key.startswith("output.")}
    return Taken(
        taken.level.name, {**fixed, **taken.level.changes}, tolerance, dict(taken.errors), dict(grounds.uncertainty),
        min(taken.covered, case.time.end), tuple(found),
    )  # fmt: skip


def _level(row: Mapping[str, Any]) -> Judged:
    """Return a fidelity level as the study judged it; one in another cycle is infinitely far."""
    failed = row["verdict"] != "passed"
    level, measured = Level("", {}), MeasuredLevel(verdict=row["verdict"])
    if failed:
        return Judged(level, measured, {}, None, inf)
    level = Level(row["name"], row["changes"])
    statistics, means = (inf, inf) if row["other_cycle"] else (row["statistics_beyond_scatter"], row["means_known_to"])
    return Judged(level, measured, row["errors"], statistics, row["seconds_of_the_case"], row["covered"], means)


MINUTES, TOLERANCE = 12.0, 0.02
NOT_PROMISED = 5


@dataclass(frozen=True, repr=False)
class TradeoffResult(PrintedResult):
    """A trade-off and its files.

    Attributes:
        folder: Folder of the files.
        study: Levels of fidelity with their costs and errors.
        paths: The files.
    """

    folder: Path
    study: TradeoffStudy
    paths: tuple[Path, ...]

    @property
    def changes(self) -> dict[str, Any] | None:
        """Keys that the cheapest level inside the tolerance replaces; None where there is no such level."""
        chosen = self.study.chosen
        return None if chosen is None else dict(chosen.level.changes)

    @property
    def exit_status(self) -> int:
        """0 where the tolerance is promised over the span of the case, else 5."""
        return 0 if self.study.promised else NOT_PROMISED

    @property
    def doubts(self) -> list[str]:
        """Reasons for which the tolerance is not promised; empty where it is."""
        return self.study.doubts

    def headline(self) -> str:
        """Return the verdict."""
        return verdict(self.study)

    def tables(self) -> list[Table]:
        """Return costs and errors of all levels."""
        return [as_table(self.study)]


def run_tradeoff(
    case: Path,
    folder: Path,
    fixed: Mapping[str, Any] | None = None,
    tolerance: float = TOLERANCE,
    minutes: float = MINUTES,
    report: Callable[[str], None] = LOG.info,
    overwrite: bool = False,
) -> TradeoffResult:
    """Measure time, memory and error of models, meshes, steps and schemes of a case, and write the results.

    Args:
        case: Path of the case file.
        folder: Folder for the trade-off.
        fixed: Keys that are replaced on all levels.
        tolerance: Largest error that will do, as a fraction.
        minutes: Wall time that the study may take.
        report: Called with what is known beforehand and with what each level gave.
        overwrite: Begin anew.

    Raises:
        CaseError: The case has faults.
        UserError: Its forcing has no single frequency, its mesh cannot be refined, the reference fails, or the folder
            holds a trade-off of other inputs.
    """
    fixed = dict(fixed or {})
    read = read_case(case, fixed)
    with study_folder(folder, plan=StudyPlan(shared_inputs([CaseSubject(read)]), overwrite)):
        study = run_study(case, fixed, tolerance, minutes, report)
        return TradeoffResult(folder, study, tuple(write_study(folder, study, study_key(read))))


def tradeoff_folder(case: Path) -> Path:
    """Return the folder of the trade-off of a case."""
    return Path("results") / f"{case.stem}-tradeoff"


def level_for(case: Path, fixed: Mapping[str, Any], tolerance: float, alone: bool, minutes: float = MINUTES) -> Taken:
    """Return the cheapest level inside a tolerance, with all keys that it replaces; a missing study is made now.

    Args:
        case: Path of the case file.
        fixed: Keys that the run replaces.
        tolerance: Largest error that will do, as a fraction.
        alone: Whether this process may make the study: not under mpirun.
        minutes: Wall time that a study made now may take.

    Returns:
        The level, with the doubts about the tolerance; the nearest where none is inside.

    Raises:
        UserError: All levels failed, or the study would have to be made under mpirun.
        CaseError: The case has faults.
    """
    folder, read = tradeoff_folder(case), read_case(case, fixed)
    found = stored_choice(folder, read, tolerance)
    if found is None:
        if not alone:
            made = shell_command("gapbeam", "tradeoff", case)
            raise UserError(
                f"{folder} holds no trade-off of this case up to t = {read.time.end:g} s; run {made} first, on one "
                "rank, with the same keys replaced"
            )
        LOG.info("no trade-off of this case in %s: measured now, up to %g minutes", folder, minutes)
        run_tradeoff(case, folder, fixed, tolerance, minutes, overwrite=True)
        found = stored_choice(folder, read, tolerance)
        assert found is not None
    LOG.info("tolerance %g %%: %s, as measured in %s", 100.0 * tolerance, found.name, folder)
    changes = {**fixed, **found.changes}
    return replace(found, changes=changes | whole_intervals(read.output, changes))


def whole_intervals(output: Output, changes: Mapping[str, Any]) -> dict[str, float]:
    """Return the intervals of records and fields that are no whole number of the steps of a level, made so.

    Args:
        output: Table [output] of the case.
        changes: Keys that the level replaces.
    """
    step, found = changes.get("time.step"), dict[str, float]()
    if not isinstance(step, float):
        return found
    for name in ("history_interval", "fields_interval"):
        key = f"output.{name}"
        interval = changes.get(key, getattr(output, name))
        if not isinstance(interval, float):
            continue
        nearest = whole_interval(interval, step)
        if nearest is not None:
            found[key] = nearest
            LOG.info("%s = %g, whole steps of %g s, instead of %g s", key, nearest, step, interval)
    return found


REASON = "tolerance not promised"


def with_promise(outcome: Outcome, taken: Taken, comm: MPI.Comm) -> Outcome:
    """Add to a finished run whether its tolerance is promised; where it is not, the exit status becomes 5.

    A run that failed is returned as it is.

    Args:
        outcome: End of the run.
        taken: The fidelity level that it took.
        comm: The ranks of the run.

    Collective.
    """
    if outcome.exit_status != 0:
        return outcome
    if describe(taken).items() <= outcome.summary.get("tolerance", {}).items():  # it was done before
        return replace(outcome, exit_status=outcome.summary["exit_status"])
    summary = on_rank_zero(comm, lambda: _written(outcome, taken))
    return replace(outcome, summary=summary, message=summary["message"], exit_status=summary["exit_status"])


def describe(taken: Taken) -> dict[str, Any]:
    """Return the trade-off's entry in the summary of a run."""
    return {
        "asked": taken.tolerance,
        "promised": not taken.doubts,
        "level": taken.name,
        "errors": taken.errors,
        "uncertainty_of_the_reference": taken.uncertainty,
        "covered": taken.covered,
        "doubts": list(taken.doubts),
    }


def own_estimates(summary: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest relative error that a run estimates for itself, by group of figures of the trade-off."""
    found: dict[str, float] = {}
    for figure in summary.get("errors", {}).get("figures", []):
        group, error = group_of(figure["name"]), figure["relative_error"]
        if group is not None and error is not None:
            found[group] = max(found.get(group, 0.0), float(error))
    return found


def _written(outcome: Outcome, taken: Taken) -> dict[str, Any]:
    """Write the summary with the tolerance, and return it."""
    summary, asked = dict(outcome.summary), f"{100.0 * taken.tolerance:.3g} %"
    own = own_estimates(summary)
    summary["tolerance"] = describe(taken) | {"estimate_of_the_run": own}
    if taken.doubts:
        warning = f"a tolerance of {asked} is not promised for this run: {'; '.join(taken.doubts)}"
        summary["warnings"] = [*summary["warnings"], warning]
        summary["exit_status"], summary["reason"] = NOT_PROMISED, REASON
        summary["message"] += f"; {warning}"
        LOG.warning("%s", warning)
    else:
        worst = max(taken.errors.values(), default=0.0)
        summary["message"] += (
            f"; within the tolerance of {asked}: {in_percent(worst)} off the reference of the trade-off"
        )
        larger = {group: error for group, error in own.items() if error > taken.tolerance}
        if larger:
            warning = (
                f"the trade-off promises the tolerance of {asked}, and the error estimate of the run itself is larger: "
                + ", ".join(f"{group} {in_percent(error)}" for group, error in larger.items())
                + "; an estimate is a bound, several times the error in most cases, and contains that of an automatic "
                "contact.stiffness, which the trade-off does not vary"
            )
            summary["warnings"] = [*summary["warnings"], warning]
            LOG.warning("%s", warning)
    write_summary(outcome.folder, summary)
    return summary
