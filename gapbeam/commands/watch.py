"""The command `gapbeam watch`: a run, seen from another terminal."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from gapbeam.commands.drawing import ResultsArgument
from gapbeam.process.terminal_text import harmless, with_options

if TYPE_CHECKING:
    from gapbeam.postprocess.results.run_watch import RunWatch

GONE = 4
WIDTH = 100  # of a frame where there is no terminal
BAR = 40
MINUTE, HOUR = 60, 3600  # s


def watch(
    results: ResultsArgument,
    once: Annotated[bool, typer.Option("--once", help="print one frame and end")] = False,
    interval: Annotated[float, typer.Option(min=0.2, max=3600.0, help="time between two looks, s")] = 2.0,
) -> int:
    """Watch a run from another terminal: time left, contact, energy, peaks, last warning; ends when the run does.

    Exit status: the run's own once it has ended; 0 with --once while it goes on; 4 where its process is gone.
    """
    from gapbeam.postprocess.results.run_watch import look_at

    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, WIDTH)
    seen = look_at(results)
    if not once and seen.state in ("starting", "running"):
        if console.is_terminal:
            with Live(frame(seen), console=console, transient=True, auto_refresh=False) as live:
                for seen in _looks(results, interval):
                    live.update(frame(seen), refresh=True)
        else:
            for seen in _looks(results, interval):
                console.print(line(seen), markup=False, soft_wrap=True)
    console.print(frame(seen))
    if seen.state == "gone":
        return GONE
    return seen.exit_status or 0


def _looks(results: Path, interval: float) -> Iterator[RunWatch]:
    """Yield looks at a run until it has ended; a run that is over is looked at once more, for its last words."""
    from gapbeam.postprocess.results.run_watch import look_at

    while True:
        time.sleep(interval)
        seen = look_at(results)
        yield seen
        if seen.state in ("ended", "gone"):
            return


def line(seen: RunWatch) -> str:
    """Return a run in one line, for logs."""
    if not seen.progress:
        return harmless(f"{seen.state}: {seen.last}")
    return f"{_marched(seen.progress)}, {_left(seen)}"


def frame(seen: RunWatch) -> RenderableType:
    """Return a run as rows of name and value."""
    rows = Table.grid(padding=(0, 2))
    rows.add_column(style="bold")
    rows.add_column(overflow="fold")
    for name, value in _rows(seen):
        rows.add_row(name, Text(harmless(value)) if isinstance(value, str) else value)
    return Group(Text(harmless(seen.title or seen.folder), style="bold"), rows)


def _rows(seen: RunWatch) -> Iterator[tuple[str, RenderableType]]:
    progress = seen.progress
    if seen.state == "ended":
        yield from _verdict(seen)
    elif seen.state == "gone":
        reached = f" at t = {progress['time']:.6g} s of {progress['end']:g} s" if progress else ""
        yield "state", f"its process is gone{reached}; gapbeam run --resume continues from the last checkpoint"
    elif not progress:
        yield "state", "setting up, or searching: no march yet" + _where(seen)
        yield "last line", seen.last or "none yet"
    else:
        share = min(1.0, progress["time"] / progress["end"])
        yield "marched", _marched(progress)
        yield "", ProgressBar(total=1.0, completed=share, width=BAR)
        yield "time left", _left(seen) + _where(seen)
    if seen.state != "ended" and progress:
        yield from _figures(progress)
    if seen.warning:
        yield "last warning", seen.warning


def _verdict(seen: RunWatch) -> Iterator[tuple[str, RenderableType]]:
    summary = seen.summary
    reason = f", {summary['reason']}" if summary.get("reason") else ""
    yield "state", f"{summary.get('status')}, exit status {summary.get('exit_status')}{reason}"
    yield "verdict", with_options(summary.get("message") or "none")
    if seen.errors_pending:
        yield "errors", "being estimated, or switched off"
    peaks, depth = summary.get("peak_contact_force"), (summary.get("penetration") or {}).get("largest")
    if peaks and depth is not None:
        yield from _peaks("peaks", peaks, depth)
    if summary.get("energy"):
        yield "energy", _energy(summary["energy"])
    yield "warnings", str(len(summary.get("warnings") or []))


def _figures(progress: Any) -> Iterator[tuple[str, RenderableType]]:
    """Yield contact, peaks and energy so far."""
    shares = [f"{name} {100.0 * one:.3g} %" for name, one in progress["contact_share"].items() if one is not None]
    yield (
        "in contact",
        f"{', '.join(shares) or 'nothing'} of the time; now {' and '.join(progress['closed']) or 'none'}",
    )
    yield from _peaks("peaks so far", progress["peak_contact_force"], progress["largest_penetration"])
    yield "energy", _energy(progress["energy"])


def _peaks(name: str, forces: Any, depth: float | None) -> Iterator[tuple[str, RenderableType]]:
    words = ", ".join(f"{face} {force:.4g} N" for face, force in forces.items() if force is not None)
    yield name, f"{words}; penetration {depth:.3g} m" if depth is not None else words


def _energy(energy: Any) -> str:
    now = (energy["kinetic"] or 0.0) + (energy["strain"] or 0.0) + (energy["contact"] or 0.0)
    open_ = energy["relative_residual"]
    return (
        f"{now:.4g} J now; not accounted for {open_:.2g} of what was exchanged" if open_ is not None else f"{now:.4g} J"
    )


def _marched(progress: Any) -> str:
    share = 100.0 * progress["time"] / progress["end"]
    return f"t = {progress['time']:.6g} of {progress['end']:g} s, {share:.3g} %, {progress['steps']} steps"


def _left(seen: RunWatch) -> str:
    """Return the time left at the mean speed so far, and how old that is."""
    left, speed = seen.progress.get("seconds_left"), seen.progress.get("steps_per_second")
    if left is None or speed is None:
        return "not known yet"
    from gapbeam.postprocess.results.run_watch import SILENT

    old = f"; no news for {_duration(seen.age)}" if seen.age is not None and seen.age > SILENT else ""
    return f"{_duration(left)} at the mean of {speed:.4g} steps/s so far, error estimate not included{old}"


def _where(seen: RunWatch) -> str:
    return f" (on {seen.elsewhere})" if seen.elsewhere else ""


def _duration(seconds: float) -> str:
    whole = round(seconds)
    if whole < MINUTE:
        return f"{whole} s"
    if whole < HOUR:
        return f"{whole // MINUTE} min {whole % MINUTE} s"
    return f"{whole // HOUR} h {whole % HOUR // MINUTE} min"
