"""The state at t = 0: seated, undeformed or centered, with a rigid motion and a vibration mode added on request.

A vibration mode of the beam without contact, w^2 its eigenvalue:

    u = a cos(phase) x,    v = a w sin(phase) x,    K x = w^2 M x,    x = 1 at the probe along the bending direction

Of modes that share a frequency, as those of a round beam in two planes do, the combination is meant that moves the
probe most along the bending direction: sum_j x_j(probe) x_j of modes with x_j^T M x_i = delta_ij.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, radians, sin
from typing import assert_never

import numpy as np

from gapbeam.solver.case.analysis_table import Periodic, StartMode, Transient, centered_pose
from gapbeam.solver.case.case import Case
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.models.body import rigid_parts
from gapbeam.solver.models.model import Model
from gapbeam.solver.seat.contact_modes import free_bending_modes
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, SemiDiscreteSystem, State, imaged

INSIDE = 1.0e-7  # of the thickness: round-off of a start that touches


def start_of_case(case: Case, model: Model, seat: State | None, left: State | None = None) -> State:
    """Return the state at t = 0 that a case asks for.

    Args:
        case: The case.
        model: Its model.
        seat: The static seat; None: there is none, and the case needs none.
        left: The state that another run left, at t = 0, where the case starts from one.

    Raises:
        UserError: The start reaches into a face, the model has not the mode that it shall start in, or the state of
            another run is asked for where it is not read.
        RunError: The modes could not be found.

    Collective.
    """
    begin, analysis = seat, case.analysis
    match analysis:
        case Transient(state=str(folder)):
            if left is None:
                raise UserError(
                    f"[analysis] state = {folder!r} is read by `gapbeam run` alone; expected a start that studies and "
                    'single marches find themselves; try start = "seat" or [analysis.motion]'
                )
            begin = left
        case Transient(start="undeformed" | "centered"):
            begin = undeformed(model.system)
        case Transient() | Periodic():
            pass
        case _:
            assert_never(analysis)
    assert begin is not None
    if isinstance(analysis, Periodic):
        return begin
    state, length = _with_bodies(model, begin), model.length
    places, speeds = list[Array](), list[Array]()
    asked = list[str]()
    if analysis.start == "centered":
        places += rigid_parts(model.body, centered_pose(case.support))
        asked.append('start = "centered"')
    if analysis.motion is not None:
        places += rigid_parts(model.body, analysis.motion.pose(length))
        speeds += rigid_parts(model.body, analysis.motion.rate(length))
        asked.append("[analysis.motion]")
    if analysis.mode is not None:
        mode = mode_motion(model, analysis.mode)
        places.append(mode.displacement)
        speeds.append(mode.velocity)
        asked.append("[analysis.mode]")
    round_off = INSIDE * model.profile.thinnest
    return _moved(state, places, speeds, model.system, round_off, " with ".join(asked))


def _with_bodies(model: Model, state: State) -> State:
    """Return a state with the displacements and velocities of support bodies that a case asks for.

    At its own rest a body has k q = f, with f the static loads on the body alone.

    Raises:
        UserError: A support is moved into the beam.
    """
    system, bodies = model.system, model.bodies
    if not any(one.body.moved for one in bodies):
        return state
    static = system.combine_loads(np.array([load.factor(0.0) if load.static else 0.0 for load in system.loads]))
    u, v, first = state.u[VALUE].copy(), state.v[VALUE].copy(), len(state.u[VALUE]) - len(bodies)
    for number, one in enumerate(bodies, first):
        if one.body.displacement == "rest":
            u[number] = static[number] / one.body.stiffness
        elif one.bends:
            u[number] += one.body.displacement
        if one.bends:
            v[number] += one.body.velocity
    contact, operators = system.contact, system.operators
    depth = contact.depth(contact.interface.trace(u, operators))
    if pressed := _pressed(contact, depth, state, INSIDE):
        face, how_deep, place = pressed
        raise UserError(
            f"[[support]] body.displacement moves {face} {how_deep} into the beam {place}; expected a start at which "
            "the support does not press; try a smaller displacement, or a larger clearance"
        )
    moved = not np.array_equal(u, state.u[VALUE])
    state = replace(state, v=imaged(operators, v), a=None)
    if not moved:
        return state
    return replace(state, u=imaged(operators, u), depth=depth, pressure=np.zeros(contact.size))


def _pressed(contact: ContactOperator, depth: Array, before: State, most: float) -> tuple[str, str, str] | None:
    """Return face, depth and place, in words, of the point that is pushed in farthest; None: by at most `most`, m."""
    deeper = depth - np.maximum(before.depth, 0.0)
    worst = int(np.argmax(deeper))
    if not deeper[worst] > most:
        return None
    face = contact.face_names[contact.faces[worst]]
    return face, f"{depth[worst]:.3g} m", f"at x = {contact.positions[worst, 0]:.4g} m"


def undeformed(system: SemiDiscreteSystem) -> State:
    """Return the undeformed body at rest at t = 0, without contact pressure. Collective."""
    still = imaged(system.operators, np.zeros(system.operators.size))
    contact = system.contact
    return State(0.0, still, still.copy(), contact.depth(np.zeros(contact.interface.size)), np.zeros(contact.size))


def _moved(
    state: State,
    places: list[Array],
    speeds: list[Array],
    system: SemiDiscreteSystem,
    round_off: float,
    asked: str,
) -> State:
    """Return a state with displacements and velocities added. Collective."""
    contact, operators = system.contact, system.operators

    def moved(parts: list[Array], values: Array) -> Array:
        """Add motions of the beam, which stand before those of supports with a mass."""
        added = values.copy()
        for part in parts:
            added[: len(part)] += part
        return added

    if speeds:
        state = replace(state, v=imaged(operators, moved(speeds, state.v[VALUE])), a=None)
    if not places:
        return state
    u = imaged(operators, moved(places, state.u[VALUE]))
    depth = contact.depth(contact.interface.trace(u[VALUE], operators))
    if pressed := _pressed(contact, depth, state, round_off):
        face, how_deep, place = pressed
        raise UserError(
            f"[analysis] {asked} moves the beam {how_deep} into {face} {place}; expected a start between the faces; "
            "try a smaller displacement, or less rotation"
        )
    return replace(state, u=u, a=None, depth=depth, pressure=np.zeros(contact.size))


SAME = 1.0e-6  # of a frequency: modes of one frequency
NODE = 1.0e-4  # of the largest deflection: less is a node of the mode
RIGID = 1.0e-3  # of the frequency of the overhang: below it a motion is rigid, on the weak restraint


@dataclass(frozen=True)
class ModeMotion:
    """Displacement and velocity of a mode at t = 0.

    Attributes:
        frequency: Hz.
        displacement: Displacement on the DOFs of the model that this rank owns, (n,), m.
        velocity: Velocity on the same DOFs, (n,), m/s.
    """

    frequency: float
    displacement: Array
    velocity: Array


def mode_motion(model: Model, wanted: StartMode) -> ModeMotion:
    """Return the motion of a mode at t = 0.

    Args:
        model: The model.
        wanted: Mode that is wanted, its amplitude and its phase.

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
    if frequency < RIGID * model.bending_frequency:
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
