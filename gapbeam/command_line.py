"""The command `gapbeam`.

Exit status: 0 done; 1 internal error; 2 a fault of the input; 3 energy was created; 4 not converged;
5 finished, but what was asked for cannot be claimed; 6 results could not be written; 7 out of memory;
124 the wall-time limit was reached; 130 interrupted; 143 terminated.
"""

from __future__ import annotations

import gc
import json
import logging
import os
import re
import sys
import time
from collections.abc import Mapping
from copy import copy
from itertools import pairwise
from pathlib import Path
from shutil import get_terminal_size
from typing import Annotated, NoReturn

import typer

from gapbeam.commands.command_group import SuggestingGroup
from gapbeam.commands.compare import fraction
from gapbeam.commands.compile_ahead import compile_
from gapbeam.commands.drawing import export, fmu, plot, render, report, view, watch
from gapbeam.commands.new import new
from gapbeam.commands.study_choice import STUDIES
from gapbeam.commands.terminal import CaseArgument, Overrides
from gapbeam.commands.tradeoff import judged_by, level_within
from gapbeam.process.failing_ranks import abort_together, first_rank, on_one_rank
from gapbeam.process.launcher import end_with_launcher, leave
from gapbeam.process.process_environment import REMARKS, is_somewhere, refuse_cramped, words_of_the_command
from gapbeam.process.terminal_text import NoRoomError, OptionWords, harmless, outlive_the_screen, with_options
from gapbeam.process.usage_errors import BadParameter, ClickException, UsageError

INPUT_FAULT = 2
NOT_WRITTEN = 6
DOUBTFUL = 5  # finished, but what was asked for cannot be claimed
INTERRUPTED = 130
SECONDS = {"h": 3600.0, "m": 60.0, "s": 1.0}
LOADED = 300_000  # objects that a run of a case loads, with all libraries

app = typer.Typer(
    name="gapbeam",
    cls=SuggestingGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_versions(wanted: bool) -> None:
    """Print the versions of gapbeam and of the packages behind its results, and leave."""
    if not wanted:
        return
    if first_rank():
        from gapbeam.meshes.versions.installed_versions import all_versions

        print(*(f"{name} {harmless(number)}" for name, number in all_versions().items()), sep="\n")
    raise typer.Exit


@app.callback()
def versions_or_command(
    _versions: Annotated[
        bool,
        typer.Option(
            "--version",
            is_eager=True,
            callback=_print_versions,
            help="print the versions of gapbeam and its libraries",
        ),
    ] = False,
) -> None:
    """Dynamic contact of beams and tubes in supports with play."""


@app.command()
def run(
    case: CaseArgument,
    override: Overrides = None,
    output: Annotated[Path | None, typer.Option(help="results folder; by default results/<case>")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="replace the results of an earlier run")] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="continue from the last checkpoint in the results folder")
    ] = False,
    wall_time: Annotated[
        str | None, typer.Option(help="write a checkpoint and stop after this time, such as 2h30m, 45m or 90s")
    ] = None,
    error: Annotated[
        str | None,
        typer.Option(help="how errors are estimated after the run: companions (default), thorough or none"),
    ] = None,
    tolerance: Annotated[
        str | None, typer.Option(help="take the cheapest model, mesh and step within it, such as 2%, by a trade-off")
    ] = None,
    relative_error: Annotated[
        str | None,
        typer.Option(help="go on after time.end until the 95 % interval of a statistic is this narrow, such as 1%"),
    ] = None,
    of: Annotated[str | None, typer.Option(metavar="FIGURE", help="the statistic, such as probe.tip.rms")] = None,
    at_most: Annotated[
        str | None, typer.Option(help="longest time that is marched, such as 60s; by default 10 times time.end")
    ] = None,
) -> int:
    """Run a case; also under mpirun.

    Exit status 5: the run is done, but its --tolerance cannot be promised over the span of the case, or the interval of
    its --relative-error is still wider.
    """
    from gapbeam.interface.single_case import run as run_file

    if overwrite and resume:
        raise UsageError("--overwrite replaces the results of an earlier run, --resume goes on with it: give one")
    overrides: Mapping[str, object] | list[str] = override or []
    began, limit = time.monotonic(), None if wall_time is None else duration(wall_time)
    taken = None if tolerance is None else level_within(case, override or [], tolerance, limit)
    if taken is not None:
        overrides = taken.changes
    asked: dict[str, object] = {}
    if limit is not None:  # what a trade-off of --tolerance took is no longer left for the run
        asked["output.wall_time"] = max(limit - (time.monotonic() - began), 1.0) if taken is not None else limit
    if error is not None:
        asked["output.errors"] = error
    if isinstance(overrides, Mapping):
        overrides = {**overrides, **asked}
    else:
        overrides = [*overrides, *(f"{key}={value}" for key, value in asked.items())]
    asked_error = None if relative_error is None else fraction(relative_error, "--relative-error")
    longest = None if at_most is None else duration(at_most, "--at-most")
    ran = run_file(case, overrides, output, overwrite, resume, asked_error, of, longest)
    outcome = ran if taken is None else judged_by(ran, taken)
    if first_rank():
        from gapbeam.studies.error_estimate.closing_table import closing_lines

        stream, lines = sys.stderr if outcome.exit_status else sys.stdout, list[str]()
        if outcome.exit_status in (0, DOUBTFUL):  # the message of a failure is in the log already
            lines.append(f"done: {harmless(with_options(outcome.message))}")
            if closing := outcome.summary.get("closing"):
                lines += map(harmless, closing_lines(closing, get_terminal_size().columns))
        print(*lines, f"results: {harmless(outcome.folder)}", sep="\n", file=stream)
    return outcome.exit_status


def duration(text: str, option: str = "--wall-time") -> float:
    """Read a time such as 2h30m, 45m, 90s or 90 behind an option, s.

    Raises:
        BadParameter: Not such a time, or none at all.
    """
    parts = re.fullmatch(r"(?:([\d.]+)h)?(?:([\d.]+)m)?(?:([\d.]+)s?)?", text.strip())
    given = zip(parts.groups() if parts else (), SECONDS.values(), strict=False)
    try:
        seconds = sum(float(part) * unit for part, unit in given if part)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < float("inf"):
        raise BadParameter(f'found "{text}"; expected a time such as 2h30m, 45m, 90s or 90', param_hint=option)
    return seconds


@app.command()
def check(case: CaseArgument, override: Overrides = None) -> int:
    """Read and mesh a case, and report model, time and memory of its run."""
    from gapbeam.interface.single_case import check as check_file

    description = check_file(case, override or [])
    if first_rank():
        from rich.console import Console, Group

        Console(soft_wrap=True).print(Group(*description.tables()))
    return 0


@app.command()
def schema() -> int:
    """Print the JSON schema of case files, for editors."""
    from gapbeam.solver.case.json_schema import schema as case_schema

    print(json.dumps(case_schema(), indent=2))
    return 0


app.command()(on_one_rank(new))
app.command()(on_one_rank(view))
app.command()(on_one_rank(watch))
app.command()(on_one_rank(plot))
app.command()(on_one_rank(render))
app.command()(on_one_rank(export))
app.command()(on_one_rank(fmu))
app.command()(on_one_rank(report))
app.command("compile")(on_one_rank(compile_))
for study in STUDIES:
    app.command()(study.command if study.collective else on_one_rank(study.command))


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the command line and leave with its exit status."""
    _leave_what_loads()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # they are looked for in every installed package
    if arguments is None:
        outlive_the_screen()
        arguments = words_of_the_command()
    end_with_launcher()
    talks = first_rank()
    if not is_somewhere():
        if talks:
            print("gapbeam: the folder that it was started in is gone; change to one that is there", file=sys.stderr)
        sys.exit(INPUT_FAULT)
    _log_to_terminal(talks)
    for remark in REMARKS:
        logging.getLogger("gapbeam").warning("%s", remark)
    leave(_said(_dispatch(arguments, talks), talks))


def _leave_what_loads() -> None:
    """Look for garbage once there are more objects than a run loads: none of these is, and looking takes 0.1 s."""
    usual = gc.get_threshold()

    def first(_phase: str, _found: Mapping[str, int]) -> None:
        gc.callbacks.remove(first)
        gc.set_threshold(*usual)

    gc.callbacks.append(first)
    gc.set_threshold(LOADED)


def _said(status: int, talks: bool) -> int:
    """Return the exit status once standard output holds all that was said; that of `NoRoomError` where it cannot."""
    try:
        sys.stdout.flush()
    except NoRoomError as error:
        if talks:
            print(f"gapbeam: {error}", file=sys.stderr)
        return status or error.exit_status
    return status


def _dispatch(arguments: list[str] | None, talks: bool) -> int:
    try:
        _refuse_empty(arguments or [])
        refuse_cramped()
        return abort_together(lambda: _application(arguments or [])(arguments, standalone_mode=False) or 0)
    except typer.Exit as leaving:
        return int(leaving.exit_code)
    except ClickException as fault:
        if talks:
            fault.message = harmless(with_options(fault.message))
            fault.show()
        return INPUT_FAULT
    except (KeyboardInterrupt, typer.Abort):
        if talks:
            print("gapbeam: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        status = getattr(error, "exit_status", None)
        if status is None:
            status, error = NOT_WRITTEN, _of_full_disk(error)
        if talks:
            print(f"gapbeam: {harmless(with_options(error))}", file=sys.stderr)
        return int(status)


def _application(arguments: list[str]) -> typer.Typer:
    """Return the application with the command of the first word alone, if there is one: to make all takes 0.04 s."""
    alone = copy(app)
    asked = [
        one for one in app.registered_commands if arguments[:1] == [one.name or getattr(one.callback, "__name__", "")]
    ]
    alone.registered_commands = asked or app.registered_commands
    return alone


def _of_full_disk(error: Exception) -> Exception:
    """Return in words that a disk takes nothing more, whichever command met it; raise any other error.

    Raises:
        Exception: As given.
    """
    from gapbeam.solver.run.output.atomic_files import is_of_disk, no_place

    if not isinstance(error, OSError) or not is_of_disk(error):
        raise error
    return no_place(Path(error.filename or "a file"), error)


def _refuse_empty(arguments: list[str]) -> None:
    """Refuse words without a letter: `--output "$RESULTS"` with nothing in RESULTS would fill the current folder.

    Raises:
        UsageError: A word has no letter.
    """
    for before, word in pairwise(["gapbeam", *arguments]):
        if not word.strip():
            raise UsageError(f"an empty word behind {before}: is a variable of the shell not set?")
        if re.fullmatch(r"--[\w-]+=\s*", word):
            raise UsageError(f"nothing behind {word.strip()}: is a variable of the shell not set?")


def _log_to_terminal(talks: bool) -> None:
    logger = logging.getLogger("gapbeam")
    logger.setLevel(logging.DEBUG if talks else logging.CRITICAL + 1)  # details go to run.log
    logger.propagate = False
    logger.handlers[:] = [_terminal_handler()]
    logger.filters[:] = [OptionWords()]


def _terminal_handler() -> logging.Handler:
    """Return a handler with colors on a terminal, and whole lines where there is none; nothing commands that."""
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.logging import RichHandler

        console = Console(stderr=True, highlight=False)
        handler: logging.Handler = RichHandler(console=console, show_path=False, show_time=False, markup=False)
        handler.setFormatter(_Harmless("%(message)s"))
    else:
        handler = logging.StreamHandler()
        handler.setFormatter(_Harmless("%(levelname)-7s %(message)s"))
    handler.setLevel(logging.INFO)
    return handler


class _Harmless(logging.Formatter):
    """Lines whose control characters are written out."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of a record."""
        return harmless(super().format(record))
