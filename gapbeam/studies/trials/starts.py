"""Starts of responses: the seat, the seat with a random kick, or the end of another response.

A settled response may be one of several; which one depends on the start. Kicks are velocities of the seated beam, and
phases of the forcing, drawn from a seeded generator; carried starts follow a response from point to point. The body of
the last case is kept for the next one, where only clearance, law or loads differ.

Where faces have come closer, a rigid motion takes the beam out of them. With the motions V, x the penetrations at a
pose u and a the amplitudes,

    least sum |a_i| + 1000 t,    x(u + V a) <= allowed + t

At points x is linear in a. At stations in round holes it is convex, |r| - c: it is replaced by its tangents, of which
every pose that is found adds some (the cutting planes of Kelley, 1960), until no point is deeper than allowed.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, pi
from typing import Any

import numpy as np
import scipy

from gapbeam.meshes.rank_zero import ONE_RANK
from gapbeam.solver.case.case import Case
from gapbeam.solver.loads.load_choice import Load, forcing_frequencies
from gapbeam.solver.loads.scene_load_choice import AnyLoad
from gapbeam.solver.march.simulation import Simulation
from gapbeam.solver.models.body import Body, body_key
from gapbeam.solver.models.model import Model, build_body, model_of
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, State, imaged

SOFT = 0.02  # of the first bending frequency: springs on the mass that leave a free body its rigid motions
SLACK, ROUND_OFF = 1.0e-9, 1.0e-10  # of the depth that is allowed, of the thickness
STOPPED = 1.0e-6  # of the largest motion at the faces: less is none
LEFT_OVER = 1000.0  # cost of depth that is left, of that of motion
MOST_CUTS = 30
CLEARED = 1.0e-7  # of the largest excess: the tolerance of linear programs


def slack(model: Model, allowed: Array) -> float:
    """Return the allowed difference of depths, m: a share of the allowed ones, and round-off of places."""
    return SLACK * float(np.max(allowed)) + ROUND_OFF * model.profile.thinnest


def rigid_motions(model: Model) -> Array:
    """Return rigid motions of the body that its supports stop, (n, k).

    Heave and pitch and, where a support is around the beam, sway and yaw: what soft springs on the mass of the body let
    forces at the faces do. Motions that the model does not have are left out.
    """
    contact, operators = model.system.contact, model.system.operators
    soft = operators.factor((2.0 * pi * SOFT * model.bending_frequency) ** 2, 1.0)
    lever = contact.positions[:, 0] - float(np.mean(contact.positions[:, 0]))
    motions = list[Array]()
    for pushed, along in _pushed(model):
        upward = contact.weights * along
        for forces in (upward, upward * lever):
            right_side = np.zeros(operators.size)
            contact.interface.add(right_side, pushed.resultant(forces))
            motions.append(soft.solve(right_side))
    moved = np.array([_largest(model, motion) for motion in motions])
    return np.stack([motion for motion, far in zip(motions, moved, strict=True) if far > STOPPED * moved.max()], axis=1)


def moved_clear(model: Model, u: Array, time: float, allowed: Array) -> tuple[Array, float, float]:
    """Return u with the least rigid motion that clears the faces, its size at the faces, and the remaining depth, m.

    Args:
        model: The model.
        u: Its marched DOFs, deeper in a face than allowed.
        time: Time of this motion, s.
        allowed: Depths that stay, (m,), m.

    Collective.
    """
    contact, operators = model.system.contact, model.system.operators
    motions, values = rigid_motions(model), contact.interface.trace(u, operators)
    motions = motions / np.array([_largest(model, motion) for motion in motions.T])
    traces = np.stack([contact.interface.trace(motion, operators) for motion in motions.T], axis=1)
    depth = contact.depth(values, time)
    unit = float(np.max(depth - allowed))
    shift, tangents, rooms = np.zeros(motions.shape[1]), list[Array](), list[Array]()
    for _ in range(MOST_CUTS):
        deeper = np.asarray(-(contact.at(values + traces @ shift, time).gap_matrix @ traces))
        tangents.append(deeper)
        rooms.append((allowed - depth + deeper @ shift) / unit)
        found = _least(np.concatenate(tangents), np.concatenate(rooms))
        if found is None:
            break
        shift = unit * found
        depth = contact.depth(values + traces @ shift, time)
        if not contact.circles or np.max(depth - allowed) <= CLEARED * unit:
            break
    left = float(np.max(depth - allowed))
    return u + motions @ shift, float(np.abs(deeper @ shift).max()), left if left > CLEARED * unit else 0.0


def _least(deeper: Array, room: Array) -> Array | None:
    """Return a of the least sum |a_i| + 1000 t with deeper a <= room + t, a = a+ - a-; None: not found."""
    count = deeper.shape[1]
    cost = np.concatenate([np.ones(2 * count), [LEFT_OVER]])
    found = scipy.optimize.linprog(cost, np.hstack([deeper, -deeper, -np.ones((len(room), 1))]), room, method="highs")
    return None if found.x is None else np.asarray(found.x[:count] - found.x[count : 2 * count])


def _pushed(model: Model) -> list[tuple[ContactOperator, Array]]:
    """Return the contact with stations that face up, and the parts of its normals upward, (m,), and aside."""
    contact, found = model.system.contact, list[tuple[ContactOperator, Array]]()
    for axis in (1, 0) if contact.support.around else (1,):
        turned = contact.turned(np.tile(np.eye(2)[axis], (len(contact.circles), 1)))
        found.append((turned, turned.across[:, axis]))
    return found


def _largest(model: Model, motion: Array) -> float:
    """Return by how much a motion changes gaps at most, along y and z at stations, no unit or m. Collective."""
    values = model.system.contact.interface.trace(motion, model.system.operators)
    return max(float(np.abs(contact.gap_matrix @ values).max()) for contact, _ in _pushed(model))


LOOKS = 1000  # at the speeds of supports over a run
KICK = 2.0  # times the energy of the forced motion that a kick has at most
_WHOLE = 1.0e-6


@dataclass(frozen=True)
class Start:
    """A start state and its remarks.

    Attributes:
        state: State of a model or of a scene.
        word: "seat", "undeformed", "centered", "kick 3" or "carried".
        notes: Changes to carry it, and parts that do not fit.
    """

    state: Any
    word: str
    notes: tuple[str, ...] = ()


def seated(model: Model) -> Start:
    """Return the static seat at t = 0; the undeformed or centered pose where the case asks for it.

    Raises:
        NotConverged: Nothing holds the beam.

    Collective.
    """
    simulation = Simulation(model)
    begin = simulation.start(simulation.seat_or_failure())
    return Start(begin, "seat" if simulation.case.analysis.needs_seat else simulation.case.analysis.start)


def kicked(model: Model, loads: Sequence[Load], number: int, seed: int) -> Start:
    """Return the seat with a random velocity, after the ramp, at a random phase of the forcing.

    A load that never repeats, such as a record, acts from its start.

    The velocity is a random combination of the rigid motions that supports stop and of the shapes in which the
    loads bend the beam, (K + omega^2 M)^-1 f; its kinetic energy is uniform up to twice f^T (K + omega^2 M)^-1 f / 2
    of the loads that drive, and of the beam at the largest speeds of supports that move.

    Args:
        model: The model.
        loads: Loads of its case.
        number: Number of the kick; the same number, seed and model give the same start.
        seed: Seed of the generator.

    Collective.
    """
    generator = np.random.default_rng([seed, number])
    seat, operators = seated(model).state, model.system.operators
    omega = 2.0 * pi * max(forcing_frequencies(loads), default=1.0)
    amplitudes = {load.name: load.peak for load in loads if not load.static}
    moving = {motion.load for motion in model.system.contact.walls.motions}
    driving = [load for number, load in enumerate(model.system.loads) if not load.static and number not in moving]
    forces = [amplitudes.get(load.name, 0.0) * load.pattern for load in driving]
    stiff = operators.factor(omega**2, 1.0)
    shapes = [stiff.solve(force) for force in forces]
    energy = 0.5 * sum(float(x) for x in model.system.dots([(x, f) for x, f in zip(shapes, forces, strict=True)]))
    mass = model.profile.mass
    speeds = model.system.contact.walls.speeds(np.linspace(0.0, model.end, LOOKS, dtype=np.float64))
    energy += 0.5 * mass * float(np.sum(np.max(speeds**2, axis=0)))
    shapes += list(rigid_motions(model).T)
    velocity = np.zeros(operators.size)
    for shape in shapes:
        size = float(model.system.dots([(shape, operators.apply_mass(shape))])[0])
        velocity += generator.standard_normal() * shape / np.sqrt(size)
    kinetic = 0.5 * float(model.system.dots([(velocity, operators.apply_mass(velocity))])[0])
    velocity *= np.sqrt(generator.uniform(0.0, KICK) * energy / kinetic)
    steps = drawn_phase(loads, model.step, generator)
    if not all(load.repeats for load in loads) or moving:
        steps = 0  # the walls of the seat are where they are at t = 0
    state = replace(seat, time=steps * model.step, v=imaged(operators, velocity))
    return Start(state, f"kick {number}")


def carried(model: Model, loads: Sequence[Load], end: State, before: Sequence[Load]) -> Start:
    """Return the end of a response of a variant of the model as a start.

    Displacement and velocity are those of the end. The time is the first, after the ramp, at which the forcing has
    the phase that it had there, to the nearest step; a load that never repeats acts from its start. Where the faces
    have come closer, as with a smaller clearance, the beam is moved as a rigid body, by the least that leaves no point
    deeper in its face than it was, in the bending plane and, in supports around it, across that plane, too: the base
    stays where it is, the gland has come down, and no energy is put into the contact.

    Args:
        model: The model to start; its DOFs mean what they meant.
        loads: Loads of its case.
        end: The end of the response.
        before: Loads of the response.

    Collective.
    """
    contact, operators = model.system.contact, model.system.operators
    time, notes = phase_kept(loads, model.step, end.time, before)
    u = end.u[VALUE]
    depth = contact.depth(contact.interface.trace(u, operators), time)
    allowed = np.maximum(end.depth, 0.0) if len(end.depth) == len(depth) else np.zeros(len(depth))
    if np.any(depth > allowed + slack(model, allowed)):
        u, moved, left = moved_clear(model, u, time, allowed)
        depth = contact.depth(contact.interface.trace(u, operators), time)
        notes.append(f"moved by up to {moved:.3g} m as a rigid body, as the faces are closer")
        if left > slack(model, allowed):
            notes.append(f"in spite of that {left:.3g} m deeper in its faces than before")
    pressure = end.pressure if len(end.pressure) == contact.size else np.zeros(contact.size)
    state = State(time, imaged(operators, u), imaged(operators, end.v[VALUE]), depth, pressure)
    return Start(state, "carried", tuple(notes))


def phase_kept(loads: Sequence[AnyLoad], step: float, end: float, before: Sequence[AnyLoad]) -> tuple[float, list[str]]:
    """Return the first time after the smooth starts at which loads have the phase that others had at a time, s; notes.

    Args:
        loads: Loads that act from then on.
        step: s, of which the time is a whole number.
        end: Time, s, of the others.
        before: The others.
    """
    if not all(load.repeats for load in loads):
        return 0.0, []
    old, new = forcing_frequencies(before), forcing_frequencies(loads)
    if len(old) != 1 or len(new) != 1:
        return round(end / step) * step, []
    phase, rise = end * old[0], max((load.rise_time for load in loads), default=0.0)
    phase += ceil(rise * new[0] - phase - _WHOLE) if phase < rise * new[0] else 0
    number = round(phase / (new[0] * step))
    jump = abs(number * step * new[0] - phase)
    words = [f"the phase of the forcing jumps by {jump:.2g} of a period, to a whole step"] if jump > 1e-4 else []
    return number * step, words


def drawn_phase(loads: Sequence[AnyLoad], step: float, draw: np.random.Generator) -> int:
    """Return the steps from t = 0 to a random phase of loads that repeat, after their smooth starts."""
    frequencies = forcing_frequencies(loads)
    period = 1.0 / frequencies[0] if frequencies else 0.0
    rise = max((load.rise_time for load in loads), default=0.0)
    return ceil(rise / step - _WHOLE) + floor(draw.uniform() * period / step)


def whole_steps(frequencies: Sequence[float], end: float, step: float) -> tuple[int, float | None]:
    """Return the number of steps of a response, whole forcing periods up to an end, and the forcing frequency, Hz.

    Args:
        frequencies: Frequencies at which the loads repeat, Hz.
        end: s.
        step: s.
    """
    if len(frequencies) != 1:
        return round(end / step), None
    periods = floor(end * frequencies[0] + 1e-9)
    return max(1, round(max(periods, 1) / (frequencies[0] * step))), frequencies[0]


def span(model: Model) -> tuple[int, float | None]:
    """Return the steps of a response of a model, and the forcing frequency, as `whole_steps`."""
    return whole_steps(model.forcing, model.end, model.step)


class KeptBody:
    """Sets up models one after the other, each body once.

    The body is that of `body_key(case)`, so that a model has the same bits whatever case came before it.

    Attributes:
        seconds: Cost of the kept body, s.
    """

    def __init__(self, body: Body | None = None) -> None:
        """Start with the body of a model that is there already, or with none."""
        self._kept: tuple[Case, Body] | None = None if body is None else (body_key(body.case), body)
        self.seconds = 0.0

    def model(self, case: Case) -> Model:
        """Return the model of a case on this process alone; errors as in `gapbeam.solver.models.model.build_model`."""
        key = body_key(case)
        if self._kept is None or self._kept[0] != key:
            self._kept = None  # frees the memory of the old body before the new one takes its own
            clock = time.perf_counter()
            self._kept = key, build_body(key, ONE_RANK)
            self.seconds = time.perf_counter() - clock
        return model_of(case, self._kept[1])
