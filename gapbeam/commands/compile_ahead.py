"""Command `gapbeam compile`: machine code for first runs, compiled ahead."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import gapbeam

if TYPE_CHECKING:
    from gapbeam.solver.march.simulation import Simulation

CASES = Path(gapbeam.__file__).parent / "cases"
BRIEF = ["time.step=1.0e-4", "time.end=3.0e-4"]


class Work(NamedTuple):
    """Something to compile.

    Attributes:
        words: Its name.
        case: Shipped case that needs it.
        overrides: Changes of that case.
        use: Uses it.
    """

    words: str
    case: str
    overrides: tuple[str, ...]
    use: Callable[[Simulation], None]


def compile_() -> int:
    """Compile the time loops of small models now, so that first runs do not wait.

    The machine code is kept in ~/.cache for this processor, until gapbeam itself changes.

    Exit status: 0 done, 6 the machine code cannot be kept.
    """
    from gapbeam.solver.compilation.jit import cache_folder
    from gapbeam.solver.messages.errors import NotWritten
    from gapbeam.studies.engine.study_engine import Engine

    if cache_folder() is None:
        raise NotWritten(
            "machine code cannot be kept: set NUMBA_CACHE_DIR or XDG_CACHE_HOME to a folder that can be written"
        )
    with Engine(points=len(WORK)) as engine:
        for place, seconds in engine.done(seconds_of, range(len(WORK))):
            print(f"{WORK[place].words}: {seconds:.0f} s", flush=True)
    return 0


def seconds_of(place: int) -> float:
    """Compile one piece of `WORK` and return its wall time, s."""
    logging.getLogger("gapbeam").setLevel(logging.ERROR)
    started, work = time.perf_counter(), WORK[place]
    work.use(gapbeam.model(CASES / f"{work.case}.toml", [*BRIEF, *work.overrides]))
    return time.perf_counter() - started


def _march(simulation: Simulation) -> None:
    """March a model by its compiled loop."""
    from gapbeam.solver.march.compiled.compiled_march import CompiledLoop

    list(CompiledLoop(simulation.plan).blocks(simulation.start(simulation.seat()), steps=1))


def _differentiate(simulation: Simulation) -> None:
    """Differentiate a step by where it starts."""
    import numpy as np

    from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
    from gapbeam.solver.march.compiled.tangent_kernel import monodromy

    plan = simulation.plan
    monodromy(CompiledLoop(plan).modal, plan.law, False, plan.dt, np.zeros((2, plan.system.contact.size)))


def _march_both_ways(simulation: Simulation) -> None:
    """March a model by its compiled loop, and a step without it."""
    from gapbeam.solver.march.stepwise_march import march

    _march(simulation)
    next(march(simulation.plan, simulation.start(simulation.seat())))


BEAM = ("model.type=beam",)
RUBBING = (*BEAM, "contact.friction={coefficient=0.3}")
WORK = (
    Work("time loop of beams between flat faces", "demo", BEAM, _march),
    Work("time loop of beams in holes", "tube-holes", BEAM, _march),
    Work("time loop of beams that rub on flat faces", "demo", RUBBING, _march_both_ways),
    Work("time loop of beams that rub in holes", "tube-holes", RUBBING, _march),
    Work("derivatives for shooting", "demo", BEAM, _differentiate),
)
