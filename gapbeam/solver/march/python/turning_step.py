"""One step with stations in round holes, whose directions are those of the step that they lead to.

    o = -(r0 + r1) / (|r0| + |r1|),    g1 = g0 + o . (r1 - r0)

Given o, the step is that of contact points that do not turn; its end gives the next o. A turn changes o by about what
the contact forces of a step move the section, relative to the clearance: where the step resolves the contact, by a
hundredth of the turn before, or less. Where turns converge slowly, o is extrapolated from them. A station is in contact
if it is under pressure, or lies in the wall at the start or the end of the step: along another o it may have been free.
Contact that is open leaves o without meaning, and takes one turn.

Source: LaBudde and Greenspan (1976), Numerische Mathematik 25, 323-346, for the discrete force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.contact.solve.matrix_free_condensation import Condensed
from gapbeam.solver.errors import NotConverged
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.jit import shared
from gapbeam.solver.system.accepted_step import Step
from gapbeam.solver.system.operators import Array, Indices
from gapbeam.solver.system.semi_discrete import VALUE, SemiDiscreteSystem, State

SETTLED = 1.0e-14  # of a direction, no unit
ENOUGH = 1.0e-11  # what may be left where turns no longer change it
MOST_TURNS = 30
FAST = 0.1  # of the turn before: turns that change directions by no more than that need no help
REMEMBERED = 6  # turns


@shared
def settled(left: float, before: float) -> bool:
    """Return whether directions have settled that a turn changed by `left`, and the one before by `before`."""
    return left <= SETTLED or (left <= ENOUGH and left >= 0.5 * before)


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
    circles, ends = system.contact.turning_at(old.time), system.contact.turning_at(old.time + dt)
    assert circles is not None
    assert ends is not None
    assert isinstance(condensed, CondensedOperator)  # stations are those of dense models
    interface = system.contact.interface

    def places(u: Array) -> Array:
        return ends.places(interface.trace(u, operators))

    before = circles.places(interface.trace(old.u[VALUE], operators))
    opening = circles.opening(before, places(old.u[VALUE] + dt * old.v[VALUE]))
    held = replace(old, pressure=_without(old.pressure, circles.points))
    begun_inside, left, iterations = circles.penetrations(before) > 0.0, [np.inf], 0
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
        if settled(left[-1], left[-2]):
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
