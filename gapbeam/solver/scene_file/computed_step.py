"""Time step of a file of structures that gives none, by `step_rule`: from its loads, its modes and its contacts.

The highest frequency of interest f is one of the loads, five times a forcing frequency, or the second one of an elastic
structure. T_c = pi / sqrt(k b^2) is half a period of a contact of stiffness k on the modes below 10 f, with the sum b^2
of the squares of their motions there.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, inf, pi, sqrt

import numpy as np

from gapbeam.solver.integrators.step_rule import (
    RIGID_RATIO,
    STEPS_PER_CONTACT,
    STEPS_PER_PERIOD,
    is_rigid,
    step_of_period,
)
from gapbeam.solver.messages.errors import CaseError, Fault
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene_file.scene_case import SceneCase

STEPS_OF_FLIGHT = 1000  # of a run without any frequency
APART = 1.0e-6  # of a frequency: bending in two planes has each twice
FREE = 1.0e-6  # of the highest frequency of a structure: a rigid motion
DEPTH = 0.01  # of the clearance: penetration at which a law is taken as linear


def with_step(
    case: SceneCase, scene: Scene, source: str, put: Callable[[list[Fault]], list[Fault]]
) -> tuple[SceneCase, str]:
    """Return a file with its step as a number, and its reason; "" where the file gives the step.

    Args:
        case: Contents of the file.
        scene: Its scene.
        source: Name of the file in messages.
        put: Returns faults with their places in the file.

    Raises:
        CaseError: A structure is too large for its modes.
    """
    if case.time.step != "auto":
        return case, ""
    if scene.is_large:
        found = f"a computed step, with {scene.size} DOFs"
        fault = Fault(
            ("time", "step"), found, "a structure whose modes are known", "reduce = { modes = 40 }, or a step"
        )
        raise CaseError(source, put([fault]))
    longest, reason = _longest(case, scene)
    frequencies = {load.forcing_frequency for load in case.load if not load.static and load.forcing_frequency}
    interval, end = case.output.history_interval, case.time.end
    span = interval or (1.0 / frequencies.pop() if len(frequencies) == 1 else end)
    step = min(span, end) / ceil(min(span, end) / longest)
    return case.model_copy(update={"time": case.time.model_copy(update={"step": step})}), reason


def _longest(case: SceneCase, scene: Scene) -> tuple[float, str]:
    """Return the longest step that will do, s, and its reason."""
    candidates = [found for load in case.load if (found := load.frequency_of_interest) is not None]
    for one in scene.structures:
        squares = one.modes[0]
        frequencies = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * pi)
        elastic = frequencies[frequencies > FREE * frequencies.max(initial=0.0)]
        distinct = elastic[np.diff(elastic, prepend=0.0) > APART * elastic][:2]
        if distinct.size:
            words = ("the frequency", "the second frequency")[distinct.size - 1]
            candidates.append((float(distinct[-1]), f"{words} of {one.name or 'a structure'}"))
    frequency, origin = max(candidates, default=(0.0, ""))
    longest = step_of_period(frequency)
    reason = f"{STEPS_PER_PERIOD} steps in a period of {frequency:.4g} Hz, {origin}"
    for number, contact in enumerate(scene.contacts):
        duration = _duration(scene, number, contact, frequency)
        if duration / STEPS_PER_CONTACT < longest and not is_rigid(duration, frequency):
            longest = duration / STEPS_PER_CONTACT
            reason = f"{STEPS_PER_CONTACT} steps in a contact of {duration:.3g} s at {contact.name}"
    if longest == inf:
        return case.time.end / STEPS_OF_FLIGHT, f"nothing vibrates: {STEPS_OF_FLIGHT} steps in the run"
    return longest, reason


def _duration(scene: Scene, number: int, contact: Contact, frequency: float) -> float:
    """Return T_c of a contact, s; infinite where its law has no stiffness at a depth that is known."""
    rows = scene.contact_rows[scene.first[number] : scene.first[number + 1]]
    slow = np.sqrt(np.maximum(scene.squares, 0.0)) <= (2.0 * pi * RIGID_RATIO * frequency or inf)
    mobility = float(np.linalg.norm(rows[:, slow], 2)) ** 2
    given = zip(contact.region.kind.names, contact.region.values, strict=True)
    depth = DEPTH * max((abs(float(value)) for name, value in given if name.startswith("clearance")), default=0.0)
    compared = depth or 1.0
    values = [float(np.ravel(one)[0]) for one in contact.law.values]
    forces = [float(contact.law.kind.spring.py_func(np.float64(x), *values)) for x in (compared, 2.0 * compared)]
    stiffness = (forces[1] - forces[0]) / compared
    if depth == 0.0 and not np.isclose(forces[1], 2.0 * forces[0]):  # no depth at which to take its slope
        return inf
    return pi / sqrt(stiffness * mobility) if stiffness * mobility > 0.0 else inf
