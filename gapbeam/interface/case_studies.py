"""Studies from Python: sweep, stability, trade-off, identification, life."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gapbeam.interface.case_source import (
    CaseSource,
    axis_of,
    case_file,
    check_fraction,
    check_range,
    folder_from,
    name_of,
    override_texts,
)
from gapbeam.process.failing_ranks import refuse_ranks
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.studies.engine.workers import Workers as Workers
from gapbeam.studies.engine.workers import as_workers

if TYPE_CHECKING:
    from gapbeam.studies.identification.run_identification import IdentificationResult
    from gapbeam.studies.life.run_life import LifeResult
    from gapbeam.studies.run_stability import StabilityResult
    from gapbeam.studies.sweep.sweep_tables import SweepResult
    from gapbeam.studies.tradeoff.run_tradeoff import TradeoffResult

Values = str | Sequence[object]
Progress = Callable[[int, int], None]


@checked
def sweep(
    case: CaseSource,
    values: Mapping[str, Values],
    overrides: Overrides = (),
    *,
    zipped: bool = False,
    carry: bool = False,
    both: bool = False,
    starts: int = 1,
    seed: int = 0,
    transient: float | None = None,
    tolerance: float = 0.02,
    output: str | PathLike[str] | None = None,
    overwrite: bool = False,
    workers: int | Workers | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Run a case over the values of some keys; resumes where it stopped.

    Args:
        case: Path of a case file, its text, a dict of its tables, or a case.
        values: Values of each key: a list, or text such as "0:2e-4:5" (first:last:count), with ":log" behind for
            logarithmic steps.
        overrides: Keys to replace at every point.
        zipped: Values side by side; by default every one with every other.
        carry: Start from the end of the point before, along the last key.
        both: Carry upward and downward; implies `carry`.
        starts: Starts of every point: the seat and random kicks.
        seed: Seed of the kicks.
        transient: s before a response counts; None: found in it.
        tolerance: Difference of amplitudes, as a fraction, below which two responses are the same.
        output: Folder; by default results/<case>-sweep.
        overwrite: Begin anew.
        workers: A number of them, or `gapbeam.Workers`; by default one a core of this machine.
        progress: Called with the number of responses that are done, and of all.

    Raises:
        CaseError: The case has faults at every point.
        UserError: An argument is out of its range, or the folder holds another sweep or cannot be written.
        ResultsError: Results of an earlier sweep cannot be read.
    """
    refuse_ranks("sweep")
    crew = as_workers(workers)
    from gapbeam.studies.sweep.sweep_plan import Sweep
    from gapbeam.studies.sweep.sweep_tables import run_sweep

    check_range("starts", starts, 1, 10_000)
    check_range("seed", seed, 0)
    check_range("transient", transient, 0.0)
    check_fraction("tolerance", tolerance)
    axes = tuple(axis_of(key, one) for key, one in values.items())
    folder = folder_from(output, f"{name_of(case)}-sweep")
    fixed = tuple(override_texts(overrides))
    wanted = Sweep(
        case_file(case, folder), fixed, axes, zipped, carry or both, both, starts, seed, transient, tolerance
    )  # fmt: skip
    return run_sweep(wanted, folder, overwrite, crew, progress)


@checked
def stability(
    case: CaseSource,
    stiffness: Values | None = None,
    step: Values | None = None,
    scheme: Values = "discrete-gradient,implicit-midpoint,newmark,hht-alpha,generalized-alpha",
    vary: Mapping[str, Values] | None = None,
    overrides: Overrides = (),
    *,
    output: str | PathLike[str] | None = None,
    workers: int | Workers | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> StabilityResult:
    """Run a case over a grid of stiffness, step and scheme, and draw where it can be trusted.

    Args:
        case: As in `sweep`.
        stiffness: Contact stiffness, Pa/m; values as in `sweep`, ranges even in the logarithm. None: 1e-4 to 100
            times the case's.
        step: Time step, s; likewise. None: 0.1 to 10 times the case's.
        scheme: Names of schemes.
        vary: Other keys and their values.
        overrides: Keys to replace at every point.
        output: Folder; by default results/<case>-stability.
        workers: A number of them, or `gapbeam.Workers`; by default one a core of this machine.
        overwrite: Begin anew.
        progress: Called with the number of trials that are done, and of all.

    Raises:
        CaseError: The case has faults at every point.
        UserError: The grid is too large, or the folder cannot be written or holds a study of other inputs.
    """
    refuse_ranks("stability")
    crew = as_workers(workers)
    from gapbeam.studies.run_stability import run_stability

    grid = {"contact.stiffness": stiffness, "time.step": step, "time.scheme": scheme, **(vary or {})}
    axes = [axis_of(key, one, "log") for key, one in grid.items() if one is not None]
    folder = folder_from(output, f"{name_of(case)}-stability")
    return run_stability(case_file(case, folder), axes, folder, override_texts(overrides), crew, progress, overwrite)


@checked
def tradeoff(
    case: CaseSource,
    overrides: Overrides = (),
    *,
    tolerance: float = 0.02,
    minutes: float = 12.0,
    output: str | PathLike[str] | None = None,
    overwrite: bool = False,
    progress: Callable[[str], None] = LOG.info,
) -> TradeoffResult:
    """Measure time, memory and error of models, meshes, steps and schemes of a case; name the cheapest that will do.

    Args:
        case: As in `sweep`.
        overrides: Keys to replace.
        tolerance: Largest error of a figure that will do, as a fraction.
        minutes: Wall time that the study may take.
        output: Folder; by default results/<case>-tradeoff.
        overwrite: Begin anew.
        progress: Called with what is known beforehand and with what each level gave.

    Returns:
        The trade-off; its `doubts` say why the tolerance is not promised up to `time.end`, and are empty where it is.

    Raises:
        CaseError: The case has faults.
        UserError: The forcing has no single frequency, the mesh cannot be refined, the reference fails, or the
            folder holds a trade-off of other inputs.
    """
    refuse_ranks("tradeoff")
    from gapbeam.studies.tradeoff.run_tradeoff import run_tradeoff
    from gapbeam.studies.tradeoff.tradeoff_study import overrides_as_mapping

    check_fraction("tolerance", tolerance)
    check_range("minutes", minutes, 0.1)
    folder = folder_from(output, f"{name_of(case)}-tradeoff")
    fixed = dict(overrides) if isinstance(overrides, Mapping) else overrides_as_mapping(override_texts(overrides))
    return run_tradeoff(case_file(case, folder), folder, fixed, tolerance, minutes, progress, overwrite)


@checked
def identify(
    file: str | PathLike[str],
    overrides: Overrides = (),
    *,
    leave_one_out: bool = False,
    output: str | PathLike[str] | None = None,
    workers: int | Workers | None = None,
    overwrite: bool = False,
    progress: Callable[[str, int, int | None], None] | None = None,
) -> IdentificationResult:
    """Find unknown keys of a case from measured values, and how well they are known; resumes where it stopped.

    Args:
        file: TOML file of unknowns and measurements.
        overrides: Keys of the case to replace.
        leave_one_out: Predict each fitted measurement from the others too.
        output: Folder; by default results/<file>.
        workers: As in `sweep`.
        overwrite: Begin anew.
        progress: Called with what is done, how many sets of values were tried, and how many may be; None: unknown.

    Raises:
        CaseError: The file or its case has faults.
        UserError: The folder holds another identification or cannot be written.
        ResultsError: Results of an earlier search cannot be read.
    """
    refuse_ranks("identify")
    crew = as_workers(workers)
    from gapbeam.studies.identification.identification_file import read_identification
    from gapbeam.studies.identification.run_identification import run_identification

    problem = read_identification(Path(file), override_texts(overrides))
    folder = folder_from(output, Path(file).stem)
    return run_identification(problem, folder, leave_one_out, crew, overwrite, progress)


@checked
def life(
    case: CaseSource,
    overrides: Overrides = (),
    *,
    tolerance: float = 0.02,
    at_most: float | None = None,
    runs: int = 40,
    output: str | PathLike[str] | None = None,
    overwrite: bool = False,
    progress: Callable[[int, int | None], None] | None = None,
) -> LifeResult:
    """Find the time until a support face is worn to `wear.depth_limit`; resumes where it stopped.

    Args:
        case: As in `sweep`.
        overrides: Keys to replace.
        tolerance: Error of a block, as a fraction of its depth.
        at_most: Longest life that is looked for, s; None: no end.
        runs: Most runs that are made.
        output: Folder; by default results/<case>-life.
        overwrite: Begin anew.
        progress: Called with the number of runs, and None.

    Returns:
        The life; its `exit_status` is 5 where the limit was not reached and the depths at `at_most` are not known, and
        its `headline()` says why.

    Raises:
        CaseError: The case has faults.
        UserError: The case has no limit or no wear, or the folder holds another life or cannot be written.
        RunError: A run on worn gaps did not pass.
        ResultsError: Results of an earlier life cannot be read.
    """
    refuse_ranks("life")
    from gapbeam.studies.life.run_life import run_life

    check_fraction("tolerance", tolerance)
    check_range("runs", runs, 2, 10_000)
    longest = float("inf") if at_most is None else at_most
    check_range("at_most", longest, 0.0)
    folder = folder_from(output, f"{name_of(case)}-life")
    return run_life(
        case_file(case, folder), folder, override_texts(overrides), tolerance, longest, runs, overwrite, progress
    )
