"""Attempts of the fuzzer: real files made once by the commands, and one attempt in a process with bounded resources.

Files are cases, a mesh, and results folders of every kind.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NoReturn

from gapbeam.process.terminal_text import harmless

Kind = Literal["done", "refused", "crash", "hang", "escape"]
LONGEST_MESSAGE = 50_000  # characters
REFUSED = 2
REPORTED = (0, 3, 4, 5, 6)  # a run that was done, and the ways in which it says that it cannot be trusted
ALLOWED = {"\n", "\t", "\r"}


@dataclass(frozen=True)
class Limits:
    """Limits on time, memory and file size of an attempt.

    Attributes:
        seconds: Seconds of the wall clock.
        memory: Bytes of address space on top of what the process has when it starts.
        file: Bytes of the largest file that it may write.
    """

    seconds: float = 20.0
    memory: int = 2 * 2**30
    file: int = 200 * 2**20


@dataclass(frozen=True)
class Outcome:
    """Result of an attempt.

    Attributes:
        kind: done, refused with a message, crash, hang, or escape: control characters reached the terminal.
        status: Exit status; negative for a signal.
        seconds: Wall time, s.
        memory: Peak resident memory, bytes.
        printed: Its output.
    """

    kind: Kind
    status: int
    seconds: float
    memory: int
    printed: str

    @property
    def is_finding(self) -> bool:
        """True where the outcome is a defect: neither success nor a proper refusal."""
        return self.kind not in ("done", "refused")


def attempt(work: Callable[[], int], said: Path, limits: Limits = Limits()) -> Outcome:
    """Do some work in a forked process.

    Args:
        work: Returns an exit status; errors with an `exit_status` are reported as the command line reports them.
        said: File for what it says.
        limits: Limits of time, memory and files.

    Returns:
        The outcome.
    """
    started = time.perf_counter()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads of numerical libraries, which forks do not use
        child = os.fork()
    if child == 0:
        _do(work, said, limits)
    deadline, hung = started + limits.seconds, False
    while True:
        ended, code, used = os.wait4(child, os.WNOHANG)
        if ended:
            break
        if not hung and time.perf_counter() > deadline:
            hung = True
            os.killpg(child, signal.SIGKILL)
        time.sleep(0.002)
    seconds = time.perf_counter() - started
    status = os.waitstatus_to_exitcode(code)
    printed = said.read_text(encoding="utf-8", errors="replace")
    return Outcome(_kind(status, hung, printed), status, seconds, used.ru_maxrss * 1024, printed)


def _kind(status: int, hung: bool, printed: str) -> Kind:
    if hung:
        return "hang"
    if "Traceback (most recent call last)" in printed or status not in (REFUSED, *REPORTED):
        return "crash"
    if status == REFUSED and (not printed.strip() or len(printed) > LONGEST_MESSAGE):
        return "crash"
    if any(not letter.isprintable() and letter not in ALLOWED for letter in printed):
        return "escape"
    return "refused" if status == REFUSED else "done"


def _do(work: Callable[[], int], said: Path, limits: Limits) -> NoReturn:
    """Be the process of an attempt."""
    status = 1
    try:
        os.setsid()
        with said.open("wb") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        sys.stdout = sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)
        memory = _address_space() + limits.memory
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_FSIZE, (limits.file, limits.file))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        status = work()
    except BaseException as error:
        known = getattr(error, "exit_status", None)
        if known is None:
            traceback.print_exc()
        else:
            print(f"gapbeam: {harmless(error)}", file=sys.stderr)
            status = int(known)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def _address_space() -> int:
    """Return the address space of this process, bytes."""
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
    return int(pages) * resource.getpagesize()


PROJECT = Path(__file__).parents[2]
DEMO = PROJECT / "cases" / "demo.toml"
STABILITY = PROJECT / "cases" / "stability.toml"
COARSE = (
    "mesh.size=0.06", "load.shaker.ramp=0", "load.shaker.frequency=50", "time.end=0.4", "time.step=2e-4",
    "output.history_interval=2e-4", "output.fields_interval=0.1",
)  # fmt: skip
QUICK = (
    'model={type="beam",elements=24}', "time.end=0.1", "time.step=5e-4", "load.shaker.frequency=50",
    "load.shaker.amplitude=60", "damping.ratios=[0.05,0.05]",
)  # fmt: skip
IDENTIFICATION = """
case = "identified-case.toml"
[set]
model = {type = "beam", elements = 8}
mesh = {dimension = 2, size = 0.06, support_size = 12.5e-3, edge_size = 12.5e-3, cells_through_thickness = 1}
"time.end" = 0.6
"time.step" = 5e-4
"output.history_interval" = 5e-4
"contact.points" = [0.0, 0.05]
"contact.stiffness" = 2e6
"damping.frequencies" = [20.0, 300.0]
"damping.ratios" = [0.1, 0.1]
load.shaker.amplitude = 5.0
load.shaker.ramp = 0.05
[[figure]]
name = "motion"
type = "motion"
quantity = "displacement"
probe = "test"
[[unknown]]
key = "contact.stiffness"
lower = 5e5
upper = 1e7
[[unknown]]
key = "load.shaker.amplitude"
lower = 1.0
upper = 20.0
[[measurement]]
set = {"load.shaker.frequency" = 30.0}
figure = "motion"
value = 1e-3
[[measurement]]
set = {"load.shaker.frequency" = 40.0}
figure = "motion"
value = 4e-4
[[measurement]]
set = {"load.shaker.frequency" = 60.0}
figure = "motion"
value = 2e-4
[search]
starts = 1
budget = 12
profile = false
coexisting = 0
"""
MESH = """
import sys
import gmsh
gmsh.initialize(readConfigFiles=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.option.setNumber("Mesh.Binary", float(sys.argv[2]))
gmsh.option.setNumber("Mesh.MshFileVersion", float(sys.argv[3]))
p = [gmsh.model.geo.addPoint(x, y, 0.0, 0.01) for x, y in
     ((0, -.006), (.05, -.006), (.51, -.006), (.51, .006), (.05, .006), (0, .006))]
l = [gmsh.model.geo.addLine(p[i], p[(i + 1) % 6]) for i in range(6)]
s = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(l)])
gmsh.model.geo.synchronize()
for name, dim, tag in (("body", 2, s), ("base", 1, l[0]), ("gland", 1, l[4]), ("tip", 1, l[2])):
    gmsh.model.addPhysicalGroup(dim, [tag], name=name)
gmsh.model.mesh.generate(2)
gmsh.write(sys.argv[1])
"""


def make_seeds(folder: Path) -> Path:
    """Make the files to be mutated, as far as they do not exist.

    Args:
        folder: Folder for its file.

    Returns:
        The folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, binary, version in (("text", 0, 4.1), ("binary", 1, 4.1), ("old", 0, 2.2)):
        path = folder / f"{name}.msh"
        if not path.exists():
            subprocess.run([sys.executable, "-c", MESH, str(path), str(binary), str(version)], check=True)
    case = folder / "identified-case.toml"
    case.write_bytes((PROJECT / "cases" / "li2013-2d.toml").read_bytes())
    file = folder / "identify.toml"
    file.write_text(IDENTIFICATION, encoding="utf-8")
    grid = ["--stiffness", "1e10,1e14", "--step", "1e-4,1e-3", "--scheme", "discrete-gradient,newmark"]
    for name, words in {
        "run": ["run", DEMO, *_settings(COARSE)],
        "other": ["run", DEMO, *_settings((*COARSE, "support.clearance=0.2e-3"))],
        "compare": ["compare", folder / "run", folder / "other"],
        "sweep": ["sweep", STABILITY, "support.clearance=0.05e-3,0.1e-3", *_settings(QUICK), "--workers", "1"],
        "stability": ["stability", STABILITY, *_settings(("time.end=0.02",)), *grid, "--workers", "1"],
        "identify": ["identify", file, "--workers", "1"],
    }.items():
        if not (folder / name).exists():
            _call(folder / name, *words)
    make_stopped(folder)
    tradeoff = folder / "tradeoff"
    tradeoff.mkdir(exist_ok=True)
    (tradeoff / "tradeoff.json").write_text(json.dumps(TRADEOFF), encoding="utf-8")
    return folder


TRADEOFF = {
    "tolerance": 0.02, "chosen": "beam, 24 elements", "chaotic": False,
    "verdict": "the cheapest fidelity level within 2 %",
    "reference": "full 2D", "uncertainty": {"peak": 0.001}, "notes": ["a note"], "skipped": [],
    "rungs": [
        {"name": name, "verdict": "passed", "message": "", "errors": {"peak": error}, "seconds_of_the_case": seconds,
         "memory": 1e8, "dofs": 100, "settings": {}, "seconds": {"march": seconds}, "figures": {"peak": 1.0},
         "step": 1e-4, "overrides": {}}
        for name, error, seconds in (("beam, 24 elements", 0.01, 1.0), ("full 2D", 0.0, 30.0))
    ],
}  # fmt: skip


def _settings(overrides: tuple[str, ...]) -> list[str]:
    return [word for override in overrides for word in ("--set", override)]


def _call(output: Path, *words: object) -> None:
    """Make a results folder by a command."""
    command = [sys.executable, "-m", "gapbeam", *map(str, words), "--output", str(output)]
    done = subprocess.run(command, cwd=PROJECT, capture_output=True, text=True, check=False)
    if not output.is_dir():
        raise SystemExit(f"{' '.join(command)} made no folder:\n{done.stderr}")
    print(f"seed {output.name}: exit status {done.returncode}", flush=True)


Work = Callable[[], int]


def command(*words: object) -> Work:
    """Return the work of a whole command in this process."""

    def work() -> int:
        from gapbeam.command_line import _dispatch

        return _dispatch([str(word) for word in words], True)

    return work


RATTLE = (
    "mesh.size=0.06", "load.shaker.amplitude=500.0", "load.shaker.frequency=100.0", "load.shaker.ramp=0.0",
    "time.end=0.012", "output.fields_interval=2e-3",
)  # fmt: skip
STOP = """
import sys
import gapbeam
from tests.shared.interrupted import stopped_after

case, whole, folder, stops, *overrides = sys.argv[1:]
assert gapbeam.run(case, overrides, whole).exit_status == 0
for number, stop in enumerate(map(int, stops.split(","))):
    with stopped_after(stop):
        assert gapbeam.run(case, overrides, folder, resume=number > 0).exit_status == 143
"""


@dataclass(frozen=True)
class Stopped:
    """A run that was stopped twice.

    Attributes:
        name: Name of its folder; the uninterrupted run is in the one with "-whole" behind.
        keys: Overrides of the demo.
        stops: Steps, or fields where the march is compiled, after which it was stopped, separated by commas.
    """

    name: str
    keys: tuple[str, ...]
    stops: str


STOPPED = (
    Stopped("stopped-full", RATTLE, "40,40"),
    Stopped(
        "stopped-friction",
        (*RATTLE, "contact.friction.coefficient=0.3", "contact.friction.slip_velocity=1e-3", "time.adaptive=true"),
        "40,40",
    ),
    Stopped("stopped-beam", (*RATTLE, "model=beam", "time.end=0.05"), "3,3"),
    Stopped(
        "stopped-reduced",
        (*RATTLE, "model.type=reduced", "model.modes=8", "model.shapes=5", "time.end=0.05",
         "contact.law={type='hunt-crossley', restitution=0.6}"),
        "3,3",
    ),
)  # fmt: skip


def make_stopped(folder: Path) -> None:
    """Make the runs as far as they are not there.

    Args:
        folder: Folder for the runs.
    """
    for run in STOPPED:
        if not (folder / run.name).exists():
            words = [str(DEMO), str(folder / f"{run.name}-whole"), str(folder / run.name), run.stops, *run.keys]
            done = subprocess.run([sys.executable, "-c", STOP, *words], cwd=PROJECT, capture_output=True, text=True)
            if done.returncode:
                raise SystemExit(f"{run.name} could not be made:\n{done.stderr}")
            print(f"seed {run.name}: stopped twice", flush=True)
