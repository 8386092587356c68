"""The scenes of a case under loads that repeat after one period: for an atlas, and for uncertain values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import nan
from pathlib import Path

from gapbeam.interface.case_scene import scene_of_model
from gapbeam.interface.single_case import model
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import is_scene, read_case
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.scene_reader import read_scene
from gapbeam.studies.atlas.run_atlas import PeriodicScene

WHOLE = 1e-9  # of a multiple of the lowest frequency


def scenes_of(case: Path, fixed: Sequence[str]) -> Callable[[tuple[str, ...]], PeriodicScene]:
    """Return a function of overrides that makes the scene of a case.

    The function raises UserError where the case has what a scene has no noun for, or where its loads do not repeat.

    Args:
        case: Path of the case file.
        fixed: Overrides of every point, KEY=VALUE.
    """
    return lambda changes: repeating_scene(case, [*fixed, *changes])


def repeating_scene(case: Path, overrides: Overrides) -> PeriodicScene:
    """Return the scene of a case whose loads repeat.

    Of a file of several structures without a load that has a frequency, loads are those after the end of its run.

    Raises:
        UserError: The case has what a scene has no noun for, or its loads do not repeat.
    """
    if is_scene(case):
        found = read_scene(case, overrides)
        time, noisy = found.case.time, [load.name or str(load.type) for load in found.case.load if load.noise]
        if noisy:
            raise UserError(
                f"atlas: found the random load{'s' * (len(noisy) > 1)} {', '.join(noisy)}, under which no motion "
                "repeats; expected none: leave out random loads here, or ask `gapbeam run` for statistics beside them"
            )
        varying = any(load.forcing_frequency is not None for load in found.case.load)
        period, rise = _repetition(found.case) if varying else (nan, time.end)
        return PeriodicScene(found.scene, period, found.step, rise, found.case.figure)
    read = read_case(case, overrides)
    period, rise = _repetition(read)
    made = model(read).model
    return PeriodicScene(scene_of_model(read, made), period, made.step, rise, read.figure)


def _repetition(case: Case | SceneCase) -> tuple[float, float]:
    """Return the period of all loads of a case, and the time after which they have their full amplitude, s."""
    never = [load.name or str(load.type) for load in case.load if not load.repeats]
    if never:
        raise UserError(f"{', '.join(never)}: expected loads that repeat; random and recorded ones never do")
    found = sorted({load.forcing_frequency for load in case.load if load.forcing_frequency is not None})
    if not found:
        raise UserError("no load has a frequency; expected a harmonic load")
    lowest = found[0]
    others = [f for f in found if abs(f / lowest - round(f / lowest)) > WHOLE]
    if others:
        raise UserError(
            f"found frequencies of {', '.join(f'{f:g}' for f in found)} Hz; expected multiples of the lowest one"
        )
    return 1.0 / lowest, max(load.rise_time for load in case.load)
