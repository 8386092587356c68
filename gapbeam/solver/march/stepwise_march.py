"""March in time: a generator of accepted steps.

A step is halved where the contact solve does not converge and, in adaptive marches, where it resolves neither an impact
nor the energy of the scheme.

Stations in round holes take the directions of the step that they lead to,

    o = -(r0 + r1) / (|r0| + |r1|),    g1 = g0 + o . (r1 - r0)

Given o, the step is that of contact points that do not turn; its end gives the next o. A turn changes o by about what
the contact forces of a step move the section, relative to the clearance: where the step resolves the contact, by a
hundredth of the turn before, or less. Where turns converge slowly, o is extrapolated from them. A station is in contact
if it is under pressure, or lies in the wall at the start or the end of the step: along another o it may have been free.
Contact that is open leaves o without meaning, and takes one turn.

Source: LaBudde and Greenspan (1976), Numerische Mathematik 25, 323-346, for the discrete force.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf, log2

import numpy as np
from numpy.typing import NDArray

from gapbeam.solver.compilation.jit import shared
from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.condensation import Condensed, CondensedOperator, condensed_operator
from gapbeam.solver.diagnostics.energy_ledger import created_in_step, round_off
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.messages.errors import NotConverged
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import (
    STIFFNESS,
    VALUE,
    ContactOperator,
    Imaged,
    SemiDiscreteSystem,
    State,
    Step,
    imaged,
)

SETTLED = 1.0e-14  # of a direction, no unit
ENOUGH = 1.0e-11  # what may be left where turns no longer change it
IDLE = 3  # turns in a row that do not halve what is left: round-off is all that is left
MOST_TURNS = 30
FAST = 0.1  # of the turn before: turns that change directions by no more than that need no help
REMEMBERED = 6  # turns


@shared
def idle_turns(left: float, least: float, idle: int) -> int:
    """Return the number of turns in a row that did not halve the least change of directions, `least`, so far."""
    return idle + 1 if left >= 0.5 * least else 0


@shared
def settled(left: float, idle: int) -> bool:
    """Return whether directions have settled that a turn changed by `left`, after so many idle turns.

    A stiff law makes forces of small changes: one turn that changes them by no less than the one before is no proof.
    """
    return left <= SETTLED or (left <= ENOUGH and idle >= IDLE)


def turning_step(
    scheme: TimeScheme,
    system: SemiDiscreteSystem,
    condensed: Condensed,
    law: ContactLaw,
    old: State,
    dt: float,
    max_iterations: int,
) -> Step:
    """Advance by one step, as `TimeScheme.advance` does.

    Args:
        scheme: The scheme, one whose law takes the penetrations at both ends of a step.
        system: The system, with stations that turn.
        condensed: Its effective operator for this step size.
        law: The contact law.
        old: State at the start.
        dt: Step, s.
        max_iterations: Limit of each contact solve.

    Raises:
        NotConverged: A contact solve failed, or the directions did not settle.
    """
    operators = system.operators
    circles, ends = system.contact.circles_at(old.time), system.contact.circles_at(old.time + dt)
    assert isinstance(condensed, CondensedOperator)  # stations are those of dense models
    interface = system.contact.interface

    def places(u: Array) -> Array:
        return ends.places(interface.trace(u, operators))

    before = circles.places(interface.trace(old.u[VALUE], operators))
    opening = circles.opening(before, places(old.u[VALUE] + dt * old.v[VALUE]))
    held = replace(old, pressure=_without(old.pressure, circles.points))
    begun_inside, left, iterations, idle = circles.penetrations(before) > 0.0, [np.inf], 0, 0
    tried = list[tuple[Array, Array]]()
    for _ in range(MOST_TURNS):
        contact = system.contact.turned(opening)
        turned = replace(system, contact=contact)
        step = scheme.advance(turned, condensed.again(turned), law, held, dt, max_iterations)
        iterations += step.iterations
        end = places(step.new.u[VALUE])
        after = circles.opening(before, end)
        # stations in the wall count as well: along the direction before they may have been free
        touching = (step.new.pressure[circles.points] != 0.0) | begun_inside | (ends.penetrations(end) > 0.0)
        left.append(float(np.max(np.abs(after - opening)[touching], initial=0.0)))
        idle = idle_turns(left[-1], min(left[:-1]), idle)
        if settled(left[-1], idle):
            depth = system.contact.depth(interface.trace(step.new.u[VALUE], operators), step.new.time)
            stage = replace(step.stage, opening=opening)
            return replace(step, old=old, new=replace(step.new, depth=depth), stage=stage, iterations=iterations)
        tried.append((opening, after))
        opening = after if left[-1] <= FAST * left[-2] else _extrapolated(tried[-REMEMBERED:])
    raise NotConverged(
        f"the directions of contact in round holes did not settle in {MOST_TURNS} turns: the last one changed them by "
        f"{left[-1]:.3e}",
        tuple(left[1:]),
    )


def _extrapolated(tried: Sequence[tuple[Array, Array]]) -> Array:
    """Return the directions that turns, x -> G(x), lead to if they are linear (Anderson's acceleration).

    Args:
        tried: x and G(x) of the last turns, (k, 2) each.

    Source: Walker and Ni (2011), SIAM J. Numer. Anal. 49, 1715-1735, equation 2.2.
    """
    starts, ends = (np.array([one.reshape(-1) for one in some]) for some in zip(*tried, strict=True))
    missed = ends - starts
    shares = np.linalg.lstsq(np.diff(missed, axis=0).T, missed[-1])[0]
    return np.asarray(ends[-1] - shares @ np.diff(ends, axis=0)).reshape(tried[-1][0].shape)


def _without(pressure: Array, points: Indices) -> Array:
    """Return pressures without those of some points: these act in other directions in the next step."""
    found = pressure.copy()
    found[points] = 0.0
    return found


RESOLVING_SHARE = 0.1  # of the duration of an impact: the longest step during one


@dataclass(frozen=True)
class Resolution:
    """The limits of a step in contact.

    Attributes:
        contact_duration: Duration of an impact T_c, s.
        growth: Largest energy that the scheme may create in a step, relative to the energy T + V + Psi at its start.
        loss: Largest energy that it may take, likewise. Both are infinite for a scheme that conserves energy, which
            spares looking.
    """

    contact_duration: float
    growth: float = inf
    loss: float = inf

    @property
    def longest(self) -> float:
        """Longest step during an impact, s."""
        return RESOLVING_SHARE * self.contact_duration

    def watched(self, system: SemiDiscreteSystem, law: ContactLaw, new: State, old: State | None = None) -> State:
        """Return an accepted state with the times since when its faces are closed; at the start long since."""
        closed = _closed_faces(system.contact, law, new)
        since: Array = np.full(len(closed), -np.inf)
        if old is not None and old.closed_since is not None:
            since = np.where(old.closed_since < np.inf, old.closed_since, old.time)
        return replace(new, closed_since=np.where(closed, since, np.inf))

    def asks_for_half(self, system: SemiDiscreteSystem, law: ContactLaw, step: Step) -> bool:
        """Return whether a step is to be taken again in two halves.

        It is where it is longer than a tenth of an impact while a face opens, closes, or has closed less than the
        duration of an impact before; and where the scheme creates or takes more energy than the gates of an impact
        allow. Free flight and a beam at rest ask for neither.

        Args:
            system: The system.
            law: The contact law.
            step: The step as it would be accepted, from a state that was `watched`.

        Returns:
            The same on all ranks: depths are replicated, energies are summed alike.

        Collective.
        """
        since = step.old.closed_since
        assert since is not None
        before, after = since < np.inf, _closed_faces(system.contact, law, step.new)
        if not (np.any(before) or np.any(after)):
            return False
        if step.size > self.longest:
            young = before & (step.old.time - since < self.contact_duration)
            if np.any((before != after) | young):
                return True
        if self.growth == self.loss == inf:
            return False
        created, stored = created_in_step(system, law, step)
        if -self.loss * stored <= created <= self.growth * stored:
            return False
        return abs(created) > round_off(system, law, step.old)


def _closed_faces(contact: ContactOperator, law: ContactLaw, state: State) -> NDArray[np.bool_]:
    """Return True for closed faces, (faces,); multipliers press where hardly anything penetrates."""
    closed = (state.depth if law.augmented is None else state.pressure) > 0.0
    return np.bincount(contact.faces, weights=closed, minlength=len(contact.face_names)) > 0.0


REMEDY = "Try a smaller time.step, more time.max_iterations, a softer contact or less damping of the contact"
REMEDY_OF_MULTIPLIERS = (
    "Try a smaller time.step, a stiffer contact, or a larger penetration in contact.formulation, which "
    "multipliers may leave"
)
REFRESH_INTERVAL = 50  # steps; keeps the round-off in the images K u and K v from adding up


class EffectiveOperators:
    """The condensed operators of a step size and its halves, each made when first asked for and then kept."""

    def __init__(self, system: SemiDiscreteSystem, scheme: TimeScheme) -> None:
        self._system, self._scheme = system, scheme
        self._kept: dict[float, Condensed] = {}

    def at(self, dt: float) -> Condensed:
        """Return the condensed operator of a step size. Collective."""
        if dt not in self._kept:
            self._kept[dt] = condensed_operator(self._system, *self._scheme.coefficients(self._system, dt))
        return self._kept[dt]


@dataclass(frozen=True)
class March:
    """Everything that a march needs but its start.

    Attributes:
        system: The system.
        law: The contact law.
        scheme: The time scheme.
        operators: Its effective operators.
        dt: Whole step, s.
        steps: Number of whole steps.
        max_halvings: Most halvings of a step that does not converge, or does not resolve.
        max_iterations: Limit of one contact solve.
        resolution: Resolution that steps need, or None.
    """

    system: SemiDiscreteSystem
    law: ContactLaw
    scheme: TimeScheme
    operators: EffectiveOperators
    dt: float
    steps: int
    max_halvings: int = 6
    max_iterations: int = 60
    resolution: Resolution | None = None


def march(plan: March, start: State | Paused) -> Iterator[Step]:
    """Yield the accepted steps from a start, or the rest of them from where a march was left.

    A step whose contact solve does not converge is halved, up to `max_halvings` times; so is, as often, one that does
    not resolve what `resolution` asks for, which then goes on with the smallest step and is marked. The halves are
    yielded as they are accepted, and `Step.completes` is true where a whole step ends. What was tried and halved
    leaves nothing behind but its count.

    Raises:
        NotConverged: A step did not converge at the smallest size; says when, where and what to try.

    Collective.
    """
    paused = start if isinstance(start, Paused) else Paused(begun(plan, start), 0)
    state, since = paused.state, paused.since
    first = round(state.time / plan.dt) - paused.done
    for number in range(first + paused.done, first + plan.steps):
        for step in whole_step(plan, state, plan.dt):
            since += 1
            if step.completes:
                new = replace(step.new, time=(number + 1) * plan.dt)
                ends = number + 1 == first + plan.steps
                due = (number + 1) % REFRESH_INTERVAL == 0 or since >= REFRESH_INTERVAL or ends
                step = replace(step, new=new, refreshed=refreshed(plan.system, new) if due else None)
                since = 0 if due else since
            yield step
            state = step.refreshed or step.new


def begun(plan: March, start: State) -> State:
    """Return a start with the accelerations and the contact memory that a march carries along. Collective."""
    start = start if start.slides is not None else with_sliding(plan, start, start.v)
    return _accepted(plan, with_acceleration(plan, start) if plan.scheme.carries_acceleration else start)


def whole_step(plan: March, state: State, dt: float, failures: int = 0, refinements: int = 0) -> Iterator[Step]:
    """Yield a step, or its parts where it is halved.

    Args:
        plan: The march.
        state: Its start, as a march carries it along.
        dt: Its size, s.
        failures: Halvings so far because it did not converge.
        refinements: And because it did not resolve the contact.

    Raises:
        NotConverged: A part did not converge at the smallest size.

    Collective.
    """
    failed = False
    try:
        advance = partial(turning_step, plan.scheme) if plan.system.contact.circles else plan.scheme.advance
        step = advance(plan.system, plan.operators.at(dt), plan.law, state, dt, plan.max_iterations)
    except NotConverged as failure:
        if failures >= plan.max_halvings:
            raise _final(plan, failure, state.time, dt) from failure
        failed = True
    else:
        asked = plan.resolution is not None and plan.resolution.asks_for_half(plan.system, plan.law, step)
        if not asked or refinements >= plan.max_halvings:
            new = with_sliding(plan, step.new, step.stage.velocity, state)
            yield replace(step, new=_accepted(plan, new, state), unresolved=asked)
            return
    counts = (failures + failed, refinements + (not failed))
    first = True
    for half in (0, 1):
        for step in whole_step(plan, state, 0.5 * dt, *counts):
            if first:
                step = replace(step, failures=step.failures + failed, refinements=step.refinements + (not failed))
            first = False
            yield replace(step, completes=step.completes and half == 1)
            state = step.new


def _accepted(plan: March, state: State, before: State | None = None) -> State:
    """Return a state with the memory of contact from accepted steps only. Collective."""
    state = with_plastic_set(plan, with_touch_speed(plan, state, before), before)
    return state if plan.resolution is None else plan.resolution.watched(plan.system, plan.law, state, before)


def _final(plan: March, failure: NotConverged, time: float, dt: float) -> NotConverged:
    contact = plan.system.contact
    where = ""
    if failure.worst_point is not None:
        face = contact.face_names[contact.faces[failure.worst_point]]
        place = ", ".join(f"{x:.4g}" for x in contact.positions[failure.worst_point])
        where = f" at the {face}, point ({place}) m"
    return NotConverged(
        f"at t = {time:.6g} s with a step of {dt:.3g} s (halved {round(log2(plan.dt / dt))} times){where}: {failure}. "
        f"{REMEDY if plan.law.augmented is None else REMEDY_OF_MULTIPLIERS}",
        failure.residuals,
        failure.worst_point,
    )


def with_touch_speed(plan: March, state: State, before: State | None = None) -> State:
    """Return the state with the approach speeds of open contact points; closed ones keep theirs. Collective."""
    if plan.law.touch_product is None:
        return state
    contact = plan.system.contact
    contact = contact.at(contact.interface.trace(state.u[VALUE], plan.system.operators), state.time)
    speed = contact.closing_speed(contact.interface.trace(state.v[VALUE], plan.system.operators), state.time)
    if before is not None and before.touch_speed is not None:
        speed = np.where(state.depth > 0.0, before.touch_speed, speed)
    return replace(state, touch_speed=speed)


def with_plastic_set(plan: March, state: State, before: State | None = None) -> State:
    """Return the state with the plastic sets that its penetrations leave, and those of the state before."""
    if not plan.law.keeps_set:
        return state
    known = state.plastic_set if before is None else before.plastic_set
    return replace(state, plastic_set=plan.law.yielded_by(known).set_after(state.depth))


def with_sliding(plan: March, state: State, velocity: Imaged, before: State | None = None) -> State:
    """Return the state with sliding points at a velocity, (3, n), m/s, for static friction. Collective."""
    friction, contact = plan.law.friction, plan.system.contact
    if friction is None or friction.static_coefficient is None:
        return state
    slip = contact.slip(contact.interface.trace(velocity[VALUE], plan.system.operators))
    return replace(state, slip=slip, slides=friction.sliding_after(slip, None if before is None else before.slip))


def with_acceleration(plan: March, state: State) -> State:
    """Return the state with the acceleration that its balance demands, M a = f - C v - K u + H^T (w p) + T^T (w t)."""
    system, contact = plan.system, plan.system.contact
    if plan.law.friction is not None:
        slip = contact.slip(contact.interface.trace(state.v[VALUE], system.operators))
        state = replace(state, traction=plan.law.friction.of_points(state.slides).traction(state.pressure, slip))
    friction = None if state.traction is None else contact.weights[:, None] * state.traction
    force = system.combine_loads(system.load_factors(state.time))
    force -= system.damping_force(state.v)
    static = force - state.u[STIFFNESS]
    contact.interface.add(static, contact.resultant(contact.weights * state.pressure, friction))
    unbalanced, applied = (float(x) for x in system.dots([(static, static), (force, force)]))
    if unbalanced <= ROUND_OFF_BALANCE**2 * applied:
        return replace(state, a=np.zeros_like(state.u))
    return replace(state, a=imaged(system.operators, system.operators.factor(1.0, 0.0).solve(static)))


ROUND_OFF_BALANCE = 1.0e-6  # what is left of the balance of a seat by round-off in K u


def refreshed(system: SemiDiscreteSystem, state: State) -> State:
    """Return the state with images and penetrations formed anew. Collective."""

    def again(x: Imaged) -> Imaged:
        return imaged(system.operators, x[VALUE])

    u = again(state.u)
    return replace(
        state,
        u=u,
        v=again(state.v),
        a=again(state.a) if state.a is not None else None,
        depth=system.contact.depth(system.contact.interface.trace(u[VALUE], system.operators), state.time),
    )


@dataclass(frozen=True)
class Paused:
    """State of a march that its next step depends on, so that it continues to the same bits.

    Attributes:
        state: The state, as a march carries it along.
        done: Whole steps since the start.
        since: Steps, parts of halved ones included, since the images of the state were formed anew.
        modal: State of a compiled loop, see `compiled.compiled_march`; None: not compiled.
    """

    state: State
    done: int
    since: int = 0
    modal: tuple[Array, ...] | None = None
