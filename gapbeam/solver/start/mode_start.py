"""A start in a vibration mode of the beam without contact.

    u = a cos(phase) x,    v = a w sin(phase) x,    K x = w^2 M x,    x = 1 at the probe along the bending direction

Of modes that share a frequency, as those of a round beam in two planes do, the combination is meant that moves the
probe most along the bending direction: sum_j x_j(probe) x_j of modes with x_j^T M x_i = delta_ij.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from math import cos, pi, radians, sin

import numpy as np

from gapbeam.solver.case.analysis_table import StartMode
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.solver.modes.contact_modes import free_bending_modes
from gapbeam.solver.system.operators import Array

LOG = logging.getLogger("gapbeam")
SAME = 1.0e-6  # of a frequency: modes of one frequency
NODE = 1.0e-4  # of the largest deflection: less is a node of the mode
RIGID = 1.0e-3  # of the frequency of the overhang: below it a motion is rigid, on the weak restraint


@dataclass(frozen=True)
class ModeMotion:
    """Displacement and velocity of a mode at t = 0.

    Attributes:
        frequency: Hz.
        displacement: On the DOFs of the model that this rank owns, (n,), m.
        velocity: Likewise, (n,), m/s.
    """

    frequency: float
    displacement: Array
    velocity: Array


def mode_motion(model: Model, wanted: StartMode) -> ModeMotion:
    """Return the motion of a mode at t = 0.

    Args:
        model: The model.
        wanted: Which mode, how large, and its phase.

    Raises:
        UserError: The model has no such mode, the mode is a rigid motion, or it does not move the probe.
        RunError: The modes could not be found.

    Collective.
    """
    operators, probe = model.system.operators, model.probes[wanted.probe]
    found = free_bending_modes(model, wanted.number)
    bending = [number for number, motion in enumerate(found.motions) if motion.kind == "bending"]
    chosen = bending[wanted.number - 1]
    frequency = float(found.frequencies[chosen])
    if frequency < RIGID * overhang_frequency(model.case):
        raise UserError(
            f"[analysis.mode] number = {wanted.number} is a rigid motion ({frequency:.3g} Hz) of a beam that only its "
            "play holds; expected a mode that bends the beam, or a joint; try number = 3, the first such mode of a "
            "free beam, or [analysis.motion]"
        )
    same = np.abs(found.frequencies - frequency) <= SAME * frequency
    shapes = [np.ascontiguousarray(shape) for shape in found.shapes[:, same].T]
    masses = [float(value) for value in model.system.dots([(shape, operators.apply_mass(shape)) for shape in shapes])]
    moved = [float(probe.evaluate(shape, operators)[-1]) for shape in shapes]
    largest = float(np.max(np.abs(found.motions[chosen].bending)))
    shape = sum((a / m * x for a, m, x in zip(moved, masses, shapes, strict=True)), np.zeros(operators.size))
    there = sum(a * a / m for a, m in zip(moved, masses, strict=True))
    if there <= NODE * largest * np.sqrt(there / min(masses)):
        raise UserError(
            f"[analysis.mode] probe = {wanted.probe}: mode {wanted.number} ({frequency:.4g} Hz) has a node there; "
            "expected a probe that the mode moves along the bending direction; try a probe at a free end"
        )
    LOG.info(
        "starts in bending mode %d, %.6g Hz, with %g m at %s", wanted.number, frequency, wanted.amplitude, wanted.probe
    )
    angle, scaled = radians(wanted.phase), wanted.amplitude / there * shape
    return ModeMotion(frequency, cos(angle) * scaled, 2.0 * pi * frequency * sin(angle) * scaled)
