"""Cost of the study engine: time per point by itself, many waiting workers, and a sweep on 1 and 2 workers.

environment/run python3 -m benchmarks.study_workers [--large] [--output results/bench]
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time

from benchmarks.table import Cell, Table, machine_words, options, seconds
from gapbeam.studies.engine.study_engine import Engine
from gapbeam.studies.engine.workers import Workers

CASE = "cases/stability.toml"
SETTINGS = (
    'model={type="beam",elements=24}',
    "time.end=0.5",
    "time.step=1e-4",
    "load.shaker.frequency=50",
    "load.shaker.amplitude=60",
)
POINTS = 800  # that do nothing
WAITS = 0.1  # s, of a point that waits
FEW, MANY = 4, 44  # points of a sweep: their difference leaves start-up out


def nothing(number: int) -> int:
    """Return a number."""
    return number


def waiting(number: int) -> int:
    """Wait, and return a number."""
    time.sleep(WAITS)
    return number


def overhead(workers: int) -> tuple[float, float]:
    """Return the time to start workers, s, and the time per point of points that do nothing, s."""
    clock = time.perf_counter()
    with Engine(Workers(workers)) as engine:
        for _ in engine.done(nothing, range(workers)):
            pass
        start = time.perf_counter() - clock
        clock = time.perf_counter()
        for _ in engine.done(nothing, range(POINTS)):
            pass
        return start, (time.perf_counter() - clock) / POINTS


def kept_busy(workers: int) -> float:
    """Return the share of time that workers spend in points that wait, whatever else the machine does."""
    points = 40 * workers
    with Engine(Workers(workers)) as engine:
        for _ in engine.done(nothing, range(workers)):
            pass
        clock = time.perf_counter()
        for _ in engine.done(waiting, range(points)):
            pass
        return points * WAITS / workers / (time.perf_counter() - clock)


def sweep_time(points: int, workers: int) -> float:
    """Return the wall time of a sweep of cheap points, as a user calls it, s."""
    with tempfile.TemporaryDirectory() as folder:
        words = [f"support.clearance=0.05e-3:0.2e-3:{points}", "--workers", str(workers), "--output", folder]
        words += [word for setting in SETTINGS for word in ("--set", setting)]
        clock = time.perf_counter()
        command = [sys.executable, "-m", "gapbeam", "sweep", CASE, *words]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return time.perf_counter() - clock


def measure(many: tuple[int, ...]) -> Table:
    """Return the table; `many` is how many workers wait at the same time."""
    rows: list[tuple[Cell, ...]] = []
    figures: dict[str, Cell] = {}
    for workers in (1, 2):
        start, each = overhead(workers)
        where = "this process" if workers == 1 else f"{workers} workers"
        rows.append((f"{POINTS} points that do nothing, {where}", seconds(each), f"{1.0 / each:.0f} points/s"))
        rows.append((f"start, {where}", seconds(start), ""))
        figures |= {f"overhead_{workers}": each, f"start_{workers}": start}
    for workers in many:
        share = kept_busy(workers)
        rows.append(
            (f"points that wait for {WAITS:g} s, {workers} workers", "", f"{100.0 * share:.0f} % of their time")
        )
        figures[f"busy_{workers}"] = share
    first = sweep_time(FEW, 1)  # compiles what is not compiled yet
    times = {}
    for workers in (1, 2):
        few, all_points = sweep_time(FEW, workers), sweep_time(MANY, workers)
        times[workers] = (all_points - few) / (MANY - FEW)
        rows.append(
            (f"a point of a sweep, {workers} workers", seconds(times[workers]), f"{seconds(few)} for {FEW} points")
        )
        figures |= {f"point_{workers}": times[workers], f"few_{workers}": few}
    efficiency = times[1] / (2.0 * times[2])
    rows.append(("efficiency of 2 workers", "", f"{100.0 * efficiency:.0f} %"))
    figures |= {"efficiency": efficiency, "first": first}
    notes = (
        machine_words(),
        "start-up is left out of the time of a point: difference of sweeps of few and many points",
    )
    return Table("study_workers", "Studies in several workers", ("what", "time", ""), tuple(rows), notes, figures)


def main() -> None:
    """Measure and write the table."""
    chosen = options(__doc__, ("large", "up to 64 workers that wait"))
    measure((2, 8, 64) if chosen.large else (2, 8)).write(chosen.output)


if __name__ == "__main__":  # the workers import this file
    main()
