"""The studies that gapbeam offers: one line each."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gapbeam.commands import compare, modes, tradeoff
from gapbeam.commands.terminal import (
    CaseArgument,
    Overrides,
    Overwrite,
    SchedulerAddress,
    SlurmOptions,
    StudyCommand,
    WorkerCount,
    print_study,
    progress_bar,
    shipped_kind,
    workers_from,
)
from gapbeam.process.usage_errors import BadParameter
from gapbeam.solver.messages.errors import in_one_line

if TYPE_CHECKING:
    from gapbeam.postprocess.report.folder_report import Kind


def library(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="what is unknown, and what is recorded (TOML)")],
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<study>")] = None,
) -> int:
    """March a library of members over unknown values, for `gapbeam estimate`; resumes where it stopped.

    Exit status: 0 done, 2 a fault of the input, 6 results could not be written.
    """
    from gapbeam.interface.case_atlas import repeating_scene
    from gapbeam.studies.library.library_file import read_library_study, run_library
    from gapbeam.studies.uncertain.uncertain_file import settings_of_study

    read = read_library_study(study)
    folder = output if output is not None else Path("results") / study.stem
    with progress_bar("members") as bar:
        one = repeating_scene(study.parent / read.case, settings_of_study(study, read.set, override or []))
        result = run_library(read, one, folder, lambda done: bar.show(done, read.members))
    print_study(result.tables(), [folder, result.headline()])
    return 0


def estimate(
    library: Annotated[Path, typer.Argument(metavar="LIBRARY", help="folder of gapbeam library")],
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help="CSV, WAV, UFF, by time")],
    unit: Annotated[str, typer.Option(help="of the values: m, mm, um, m/s, mm/s, um/s, m/s2, mm/s2 or g")],
    column: Annotated[str, typer.Option(help="of the values in a text file: number from 1 or name")] = "2",
    time_column: Annotated[str, typer.Option(help="of the times in s: number from 1 or name")] = "1",
    channel: Annotated[int, typer.Option(help="of a WAV file, or data set 58 of a universal file, from 1")] = 1,
    full_scale: Annotated[float | None, typer.Option(help="of a WAV file: value of full scale, in the unit")] = None,
    frequency: Annotated[
        float | None, typer.Option(help="of the load in the recordings, Hz; by default as in the library")
    ] = None,
    at: Annotated[
        str | None, typer.Option(metavar="T1,T2,...", help="times of the recordings, in any unit, such as weeks")
    ] = None,
    limit: Annotated[
        list[str] | None, typer.Option(metavar="PATH=VALUE", help="a limit of a value; may be repeated")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="a CSV file for all estimates")] = None,
    samples: Annotated[
        Path | None, typer.Option(metavar="FILE", help="a CSV file for samples of the values that fit each recording")
    ] = None,
) -> int:
    """Estimate the values of a library from recordings, with 95 % intervals; of several, rates and times to limits.

    Exit status: 0 done, 5 a recording lies outside of the library, 2 a fault of the input, 4 samples did not settle, 6
    a file could not be written.
    """
    from gapbeam.solver.messages.errors import UserError
    from gapbeam.studies.library.estimate import estimate as estimated
    from gapbeam.studies.library.estimate import series
    from gapbeam.studies.library.posterior import posterior, sample_rows
    from gapbeam.studies.library.recording import read_recording
    from gapbeam.studies.library.recording_library import read_library
    from gapbeam.studies.study_folder import write_table

    def number(text: str, where: str) -> float:
        try:
            return float(text)
        except ValueError:
            raise UserError(f"{where}: found {text!r}, expected a number") from None

    def place(text: str) -> int | str:
        return int(text) if text.isdigit() else text

    found, period = read_library(library), None
    if frequency is not None:
        if not frequency > 0.0:
            raise UserError(f"--frequency: found {frequency:g}, expected a number of Hz above 0")
        period = 1.0 / frequency
    times = None if at is None else [number(one, "--at") for one in at.split(",")]
    limits = {}
    for text in limit or []:
        path, equals, value = text.partition("=")
        if not equals:
            raise UserError(f"--limit: found {text!r}, expected PATH=VALUE, such as {found.paths[0]}=1e-3")
        limits[path] = number(value, f"--limit {path}")
    recorded, estimates = [], []
    for file in recordings:
        one = read_recording(
            file, unit, column=place(column), time_column=place(time_column), channel=channel, full_scale=full_scale
        )
        recorded.append(one)
        estimates.append(estimated(found, one, period))
    result = series(estimates, times, limits)
    print_study(result.tables(), [])
    if output is not None:
        write_table(output, *result.rows())
    print_study(
        [], [one.headline() for one in [*estimates, *([result] if len(estimates) > 1 or times or limits else [])]]
    )
    if samples is not None:
        drawn = [posterior(found, one, period) for one in recorded]
        write_table(samples, *sample_rows(drawn))
        print_study([table for one in drawn for table in one.tables()], [one.headline() for one in drawn])
    return result.exit_status


def sweep(
    case: CaseArgument,
    keys: Annotated[list[str], typer.Argument(metavar="KEY=VALUES...", help="KEY=a,b,c or KEY=first:last:count[:log]")],
    zipped: Annotated[
        bool, typer.Option("--zip", help="values side by side; by default every one with every other")
    ] = False,
    carry: Annotated[
        bool, typer.Option("--carry", help="start from the end of the point before, along the last key")
    ] = False,
    both: Annotated[bool, typer.Option("--both", help="carry upward and downward; implies --carry")] = False,
    starts: Annotated[int, typer.Option(min=1, max=10_000, help="starts: the seat and random kicks")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="of the kicks")] = 0,
    transient: Annotated[
        float | None, typer.Option(min=0.0, help="s before a response counts; by default found in it")
    ] = None,
    tolerance: Annotated[str, typer.Option(help="amplitudes that are the same in the census")] = "2%",
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-sweep")] = None,
    overwrite: Overwrite = False,
    workers: WorkerCount = None,
    scheduler: SchedulerAddress = None,
    slurm: SlurmOptions = None,
) -> int:
    """Run a case over the values of some keys; resumes where it stopped.

    Exit status: 0 all passed, 3 energy was created or 4 not converged at some point, 7 a point ended its workers, 2 a
    fault of the input, 6 results could not be written.
    """
    from gapbeam.commands.compare import fraction
    from gapbeam.studies.sweep.sweep_plan import Sweep
    from gapbeam.studies.sweep.sweep_tables import run_sweep
    from gapbeam.studies.trials.axes import read_axis

    crew = workers_from(workers, scheduler, slurm)
    axes = tuple(read_axis(text, "linear", "") for text in keys)
    wanted = Sweep(
        case, tuple(override or ()), axes, zipped, carry or both, both, starts, seed, transient, fraction(tolerance)
    )
    folder = output if output is not None else Path("results") / f"{case.stem}-sweep"
    with progress_bar("responses") as bar:
        result = run_sweep(wanted, folder, overwrite, crew, bar.show)
    notes = [f"note ({count} of {len(result.records)}): {note}" for note, count in result.notes]
    for record in result.failed:
        values = ", ".join(f"{key} = {value}" for key, value in record["values"].items())
        notes.append(f"{values}: {record['verdict']}: {in_one_line(record['message'])}")
    print_study(result.tables(), [*notes, *result.paths, result.headline()])
    return result.exit_status


SCHEMES = "discrete-gradient,implicit-midpoint,newmark,hht-alpha,generalized-alpha"


def stability(
    case: CaseArgument,
    stiffness: Annotated[
        str | None,
        typer.Option(
            help="contact stiffness, Pa/m: a,b,c or first:last:count; by default 1e-4 to 100 times the case's"
        ),
    ] = None,
    step: Annotated[
        str | None,
        typer.Option(help="time step, s: a,b,c or first:last:count; by default 0.1 to 10 times the case's"),
    ] = None,
    scheme: Annotated[str, typer.Option(help="schemes, by name")] = SCHEMES,
    vary: Annotated[list[str] | None, typer.Option(metavar="KEY=VALUES", help="any other key; may be repeated")] = None,
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-stability")] = None,
    overwrite: Overwrite = False,
    workers: WorkerCount = None,
    scheduler: SchedulerAddress = None,
    slurm: SlurmOptions = None,
) -> int:
    """Run a case over a grid of stiffness, step and scheme, and draw where it can be trusted."""
    from gapbeam.studies.run_stability import run_stability
    from gapbeam.studies.trials.axes import read_axis

    given = {"contact.stiffness": stiffness, "time.step": step, "time.scheme": scheme}
    grid = [*(f"{key}={values}" for key, values in given.items() if values is not None), *(vary or [])]
    folder = output if output is not None else Path("results") / f"{case.stem}-stability"
    crew = workers_from(workers, scheduler, slurm)
    with progress_bar("trials") as bar:
        axes = [read_axis(text) for text in grid]
        result = run_stability(case, axes, folder, override or [], crew, bar.show, overwrite)
    print(*result.summaries(), *result.pictures, sep="\n")
    return 0


def atlas(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="file (TOML) with loads that repeat, or with a flow")],
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUES", help="a key and its values, a,b,c or first:last:count; at most two"),
    ] = None,
    override: Overrides = None,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="starts at each point")] = 64,
    settle: Annotated[int, typer.Option(min=1, help="periods before responses are looked for")] = 100,
    rounds: Annotated[int, typer.Option(min=1, help="marches of so many periods at most")] = 4,
    orders: Annotated[int, typer.Option(min=1, help="most periods after which a response repeats")] = 8,
    reach: Annotated[
        float, typer.Option(help="largest velocity of a start, relative to the motion from the seat")
    ] = 2.0,
    seed: Annotated[int, typer.Option(min=0, help="of the starts")] = 0,
    follow: Annotated[bool, typer.Option("--follow", help="follow responses over the key, to where they end")] = False,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-atlas")] = None,
    overwrite: Overwrite = False,
) -> int:
    """Find all stable responses of a case, with the share of starts that come to each, over values of keys.

    An atlas that was killed resumes after its last point.

    Exit status: 0 done, 5 some starts did not settle, 2 a fault of the input, 6 results could not be written.
    """
    from gapbeam.interface.case_atlas import scenes_of
    from gapbeam.studies.atlas.run_atlas import run_atlas
    from gapbeam.studies.trials.axes import read_axis
    from gapbeam.studies.trials.subject import read_subject, shared_inputs

    axes = [read_axis(text, "linear", "--vary ") for text in vary or []]
    folder = output if output is not None else Path("results") / f"{case.stem}-atlas"
    subject = read_subject(case, override or [])
    with progress_bar("points") as bar:
        result = run_atlas(
            scenes_of(case, override or []), axes, folder, starts=starts, settle=settle, rounds=rounds, orders=orders,
            reach=reach, seed=seed, progress=bar.show, inputs=shared_inputs([subject], axes), follow=follow,
            units={axis.key: subject.unit_of(axis.key) for axis in axes}, overwrite=overwrite,
        )  # fmt: skip
    print_study(result.tables(), [*result.paths, result.headline()])
    return result.exit_status


def uncertain(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="what is uncertain, and limits (TOML)")],
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<study>")] = None,
) -> int:
    """Find figures as distributions for each response, and probabilities; resumes where it stopped.

    Exit status: 0 done, 5 some members did not settle or a limit was not reached, 2 a fault of the input, 6 results
    could not be written.
    """
    from gapbeam.interface.case_atlas import repeating_scene
    from gapbeam.studies.uncertain.uncertain_file import read_uncertain, run_uncertain, settings_of_study

    read = read_uncertain(study)
    folder = output if output is not None else Path("results") / study.stem
    with progress_bar("members") as bar:
        one = repeating_scene(study.parent / read.case, settings_of_study(study, read.set, override or []))
        result = run_uncertain(read, one, folder, lambda done: bar.show(done, read.expected))
    print_study(result.tables(), [folder, result.headline()])
    return result.exit_status


def identify(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="what is unknown and what was measured (TOML)")],
    override: Overrides = None,
    leave_one_out: Annotated[
        bool, typer.Option("--leave-one-out", help="predict each fitted measurement from the others too")
    ] = False,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<file>")] = None,
    workers: WorkerCount = None,
    scheduler: SchedulerAddress = None,
    slurm: SlurmOptions = None,
    overwrite: Overwrite = False,
) -> int:
    """Find unknown keys of a case from measured values, and how well they are known; resumes where it stopped.

    Exit status: 0 done, 2 a fault of the input, 4 the best values themselves did not pass, 5 the fit misses
    search.tolerance, or the measurements by far more than their standard errors.
    """
    from gapbeam.studies.identification.identification_file import read_identification
    from gapbeam.studies.identification.run_identification import run_identification

    crew = workers_from(workers, scheduler, slurm)
    problem = read_identification(file, override or [])
    folder = output if output is not None else Path("results") / file.stem
    with progress_bar("search") as bar:
        result = run_identification(
            problem,
            folder,
            leave_one_out,
            crew,
            overwrite,
            lambda words, done, total: bar.show(done, total, words),
        )
    remark = result.remark()
    print_study(result.tables(), [*result.paths, *([] if remark is None else [remark])], width=180)
    return result.exit_status


def optimize(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="what becomes least, free values, and limits (TOML)")],
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<study>")] = None,
    overwrite: Overwrite = False,
) -> int:
    """Find the clearances, stiffnesses or loads at which a figure is least, by exact derivatives of one response.

    Exit status: 0 done, 2 a fault of the input or a response without derivatives, 4 the response ends or no values keep
    the limits, 5 the response is unstable there, 6 results could not be written.
    """
    from gapbeam.interface.case_atlas import repeating_scene
    from gapbeam.studies.optimum.optimum_study import read_optimum_study, run_optimum
    from gapbeam.studies.study_folder import StudyPlan
    from gapbeam.studies.trials.subject import read_subject, shared_inputs
    from gapbeam.studies.uncertain.uncertain_file import settings_of_study

    read = read_optimum_study(study)
    folder = output if output is not None else Path("results") / study.stem
    case, settings = study.parent / read.case, settings_of_study(study, read.set, override or [])
    with progress_bar("responses"):
        search = read.model_dump(mode="json", exclude={"title", "case", "set"})
        plan = StudyPlan(shared_inputs([read_subject(case, settings)]) | search, overwrite)
        result = run_optimum(read, repeating_scene(case, settings), folder, plan)
    print_study(result.tables(), [*result.paths, result.headline()])
    return result.exit_status


def life(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="case file (TOML) with wear.depth_limit")],
    override: Overrides = None,
    tolerance: Annotated[str, typer.Option(help="error of a block, as a share of its depth")] = "2%",
    at_most: Annotated[
        str | None,
        typer.Option(
            help="time at which the march ends with the depths of all faces, such as 40y or 300d; by default none"
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=2, max=10_000, help="most runs that are made")] = 40,
    output: Annotated[Path | None, typer.Option(help="folder; by default results/<case>-life")] = None,
    overwrite: Overwrite = False,
) -> int:
    """Find the time until a support face is worn to wear.depth_limit; resumes where it stopped.

    Exit status: 0 the limit was reached, or --at-most with the depth of each face then, 5 neither, 3 energy was created
    or 4 not converged in a run, 2 a fault of the input, 6 results could not be written.
    """
    from gapbeam.commands.compare import fraction
    from gapbeam.studies.life.run_life import run_life
    from gapbeam.studies.life.worn_case import long_time

    longest = inf if at_most is None else long_time(at_most)
    if longest is None:
        raise BadParameter(
            f'found "{at_most}"; expected a time such as 40y, 300d, 2000h or 90 (seconds)', param_hint="--at-most"
        )
    folder = output if output is not None else Path("results") / f"{case.stem}-life"
    share = fraction(tolerance, "--tolerance")
    with progress_bar("runs on worn gaps") as bar:
        result = run_life(case, folder, override or (), share, longest, runs, overwrite, bar.show)
    print_study(result.tables(), [*result.paths, result.headline()])
    return result.exit_status


STUDIES: tuple[StudyCommand, ...] = (
    StudyCommand(sweep, shipped_kind("sweep")),
    StudyCommand(stability, shipped_kind("stability")),
    tradeoff.STUDY,
    StudyCommand(atlas, shipped_kind("atlas")),
    StudyCommand(uncertain, shipped_kind("uncertain")),
    StudyCommand(library, shipped_kind("library")),
    StudyCommand(estimate),
    StudyCommand(identify, shipped_kind("identification")),
    StudyCommand(optimize, shipped_kind("optimum")),
    StudyCommand(life, shipped_kind("life")),
    compare.STUDY,
    modes.STUDY,
)


def report_kinds() -> tuple[Kind, ...]:
    """Return the kinds of results folders of all studies, in the order in which a folder is tried."""
    return tuple(study.kind() for study in STUDIES if study.kind is not None)
