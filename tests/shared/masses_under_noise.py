"""Masses side by side, each on a spring before a stop, under white noise: what a scheme and its step make of the law.

    m a + c v + k u = f + contact,    f: a new independent number of variance S / (2 h) in each step h, S = 4 c T

Noise of a step has the density S at all frequencies that the step resolves, so that nothing but the scheme is at fault.

Figures are means over masses and time. A normal number n of a step, which the scheme has not met before, is independent
of the place u and the velocity v at the start of that step: the means of n v, n u, n v^3 and n^2 - 1 are 0 for every
scheme and step, and what they are in a march is chance. Regression on them takes that chance out of the figures.

Source: Risken, The Fokker-Planck Equation (1989), chapter 10, for the law; Glasserman, Monte Carlo Methods in Financial
Engineering (2003), section 4.1, for the regression on control variates.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.sparse import csr_matrix

from gapbeam.solver.contact.laws.contact_law import ContactLaw
from gapbeam.solver.contact.laws.springs import Spring
from gapbeam.solver.diagnostics.march_diagnostics import HALVED, Accounts
from gapbeam.solver.diagnostics.statistics.statistic_figures import energy_bias
from gapbeam.solver.integrators.time_scheme import TimeScheme
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, instants_of, why_not_compiled
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, begun, march
from gapbeam.solver.supports.support import Face, Support
from gapbeam.solver.system.dense_operators import DenseOperators
from gapbeam.solver.system.operators import Array, Interface, Load
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, SemiDiscreteSystem, State, imaged
from tests.shared.rattlers import CONTACT_TIME, DAMPING, STIFFNESS, TEMPERATURE

SETTLING = 8.0 / DAMPING  # s; what the start has left of the energy is exp(-8)
PARTS = 16  # of the record of a mass: samples of the regression
ENDLESS = 1.0e9  # a mean that no march has which stays bounded
CONTROLS = 4  # what the regression knows to be 0 but for chance
FIGURES = ("mean square", "contact share", "mean force", "mean square force", "impact rate")


@dataclass(frozen=True)
class Biases:
    """Figures of a scheme and a step beside the exact ones.

    Attributes:
        relative: Difference over the exact figure, by figure.
        errors: Standard error of that, which chance leaves.
        halved: Steps that were halved because their contact solve did not converge.
    """

    relative: dict[str, float]
    errors: dict[str, float]
    halved: int


def exact_figures(rigid: bool = False) -> dict[str, float]:
    """Return the figures of the law; of a rigid stop those that are finite, and not 0.

    The mean force on a rigid stop is T times the density of places at the stop: the limit of a stiff spring.
    """

    def density(x: float) -> float:
        depth = max(x - 1.0, 0.0)
        return float(np.exp(-0.5 * (x * x + STIFFNESS * depth * depth) / TEMPERATURE))

    def integral(power: int, low: float, high: float, shift: float = 0.0) -> float:
        return float(quad(lambda x: (x - shift) ** power * density(x), low, high, epsabs=1.0e-13)[0])

    high = 1.0 if rigid else 4.0
    whole = sum(integral(0, *span) for span in ((-9.0, 1.0), (1.0, high)))
    square = sum(integral(2, *span) for span in ((-9.0, 1.0), (1.0, high))) / whole
    at_stop = density(1.0) / whole
    found = {"mean square": square, "impact rate": sqrt(TEMPERATURE / (2.0 * pi)) * at_stop}
    if rigid:
        return found | {"mean force": TEMPERATURE * at_stop}
    forces = {
        "mean force": STIFFNESS * integral(1, 1.0, 4.0, 1.0) / whole,
        "mean square force": STIFFNESS**2 * integral(2, 1.0, 4.0, 1.0) / whole,
    }
    return found | forces | {"contact share": integral(0, 1.0, 4.0) / whole}


def biases_of(scheme: TimeScheme, steps_of_contact: float, seconds: float, masses: int = 16, seed: int = 1) -> Biases:
    """Return how far the figures of a march are off.

    Args:
        scheme: The scheme; one of impulses meets a rigid stop.
        steps_of_contact: Steps in the duration of a contact with the stop that gives way.
        seconds: Span of the march of each mass behind its settling, s.
        masses: Number of masses.
        seed: Seed of the noise.

    Raises:
        NotConverged: A step did not converge at the smallest size.
    """
    step = CONTACT_TIME / steps_of_contact
    settling, length = round(SETTLING / step), round(seconds / step / PARTS)
    noise = np.random.default_rng(seed).standard_normal((settling + PARTS * length + 2, masses))
    plan = _plan(scheme, step, noise)
    lag = 1 if scheme.carries_acceleration else 0  # such schemes balance forces at the end of the step
    none = np.zeros((1, masses))
    begin = _Rows(none, none, none, none > 0.0, 0)
    sums, controls = np.zeros((PARTS, len(FIGURES), masses)), np.zeros((PARTS, CONTROLS, masses))
    number, halved = 0, 0
    for rows in _compiled(plan) if why_not_compiled(plan) is None else _step_by_step(plan):
        whole = begin.followed_by(rows)
        u, v = whole.u[:-1], whole.v[:-1]
        new = noise[number + lag : number + lag + len(u)]
        of_steps = np.stack([new * v, new * u, new * v**3, new**2 - 1.0])
        closings = rows.closed & ~whole.closed[:-1]
        of_ends = np.stack([rows.u**2, rows.closed, rows.force, rows.force**2, closings / step])
        parts = (number + np.arange(len(u)) - settling) // length
        for part in range(PARTS):
            here = parts == part
            controls[part] += of_steps[:, here].sum(axis=1) / length
            sums[part] += of_ends[:, here].sum(axis=1) / length
        number, halved, begin = number + len(u), halved + rows.halved, rows.last
    return _regressed(sums, controls, exact_figures(scheme.impulses), halved)


def energy_bias_of(
    scheme: TimeScheme, steps_of_contact: float, seconds: float, masses: int = 16
) -> tuple[float, float]:
    """Return how far the mean square of the velocity is off, and what the energy ledger says about it, relative.

    Args:
        scheme: One with a compiled march, whose ledger is exact for forces that are constant over a step.
        steps_of_contact: As in `biases_of`, like the rest.
        seconds: Span of the march, s.
        masses: Number of masses.
    """
    step = CONTACT_TIME / steps_of_contact
    noise = np.random.default_rng(3).standard_normal((round((SETTLING + seconds) / step) + 2, masses))
    plan = _plan(scheme, step, noise)
    start = _rest(plan)
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    square, count = 0.0, 0
    for block in CompiledLoop(plan).blocks(start, 1, accounts):
        square, count = square + float(np.sum(block.v**2)), count + block.v.size
    return square / count / TEMPERATURE - 1.0, energy_bias(accounts.ledger)


@dataclass(frozen=True)
class _Rows:
    """Places and velocities at the ends of some steps, the forces in them, and who is in contact then, (steps, masses).

    `halved` counts the parts of halved steps.
    """

    u: Array
    v: Array
    force: Array
    closed: Any
    halved: int

    @property
    def last(self) -> _Rows:
        """The last step."""
        return _Rows(self.u[-1:], self.v[-1:], self.force[-1:], self.closed[-1:], 0)

    def followed_by(self, other: _Rows) -> _Rows:
        """Return the rows of both."""
        return _Rows(
            np.concatenate([self.u, other.u]),
            np.concatenate([self.v, other.v]),
            np.concatenate([self.force, other.force]),
            np.concatenate([self.closed, other.closed]),
            self.halved + other.halved,
        )


def _compiled(plan: March) -> Iterator[_Rows]:
    start = _rest(plan)
    accounts = Accounts.opened(plan.system, plan.law, start, plan.dt)
    impulse, closed = np.zeros((1, start.depth.size)), np.zeros((1, start.depth.size))
    for block in CompiledLoop(plan).blocks(start, 1, accounts):
        now = instants_of(block, len(block.times))
        force = np.diff(now.impulse, axis=0, prepend=impulse) / plan.dt
        touched = np.diff(now.contact_time, axis=0, prepend=closed) > 0.5 * plan.dt
        yield _Rows(block.u, block.v, force, touched, accounts.tally.halved)
        impulse, closed, accounts.tally.halved = now.impulse[-1:], now.contact_time[-1:], 0


def _step_by_step(plan: March) -> Iterator[_Rows]:
    force: Array | float = 0.0
    halved = 0
    for step in march(plan, _rest(plan)):
        force = force + step.stage.pressure * step.size / plan.dt
        halved += step.size < HALVED * plan.dt
        if step.completes:
            closed = (step.new.pressure if plan.scheme.impulses else step.new.depth) > 0.0
            yield _Rows(step.new.u[VALUE][None], step.new.v[VALUE][None], force[None], closed[None], halved)
            force, halved = 0.0, 0


def _regressed(sums: Array, controls: Array, exact: dict[str, float], halved: int) -> Biases:
    """Return the biases from means over parts, (parts, figures, masses), and the means of what is 0 but for chance.

    A march that grew without end has biases that are no numbers.
    """
    if not max(np.max(np.abs(sums)), np.max(np.abs(controls))) < ENDLESS:
        nothing = dict.fromkeys(exact, float("nan"))
        return Biases(nothing, nothing, halved)
    columns = np.column_stack([np.ones(sums[:, 0].size), *(controls[:, place].ravel() for place in range(CONTROLS))])
    inverse = np.linalg.inv(columns.T @ columns)
    relative, errors = dict[str, float](), dict[str, float]()
    for place, name in enumerate(FIGURES):
        if name in exact:
            values = sums[:, place].ravel()
            fitted = inverse @ (columns.T @ values)
            left = values - columns @ fitted
            relative[name] = float(fitted[0]) / exact[name] - 1.0
            errors[name] = sqrt(float(left @ left) / (len(values) - len(fitted)) * inverse[0, 0]) / exact[name]
    return Biases(relative, errors, halved)


def _plan(scheme: TimeScheme, step: float, noise: Array) -> March:
    masses = noise.shape[1]
    contact = ContactOperator(
        interface=Interface(masses, np.arange(masses), np.arange(masses)),
        gap_matrix=csr_matrix(-np.eye(masses)),
        weights=np.ones(masses),
        initial_gap=np.ones(masses),
        faces=np.arange(masses),
        support=Support(tuple(Face(f"upper {mass}", -1.0) for mass in range(masses)), area=float(masses)),
        positions=np.zeros((masses, 3)),
    )
    strength = sqrt(2.0 * DAMPING * TEMPERATURE / step)

    def load(mass: int) -> Load:
        numbers = strength * noise[:, mass]
        return Load(f"noise {mass}", np.eye(masses)[mass], lambda t: _at(numbers, t / step + 0.25), of_arrays=True)

    operators = DenseOperators(np.eye(masses), np.eye(masses))
    system = SemiDiscreteSystem(operators, contact, tuple(map(load, range(masses))), mass_damping=DAMPING)
    law = ContactLaw(Spring(STIFFNESS))
    law = replace(law, stores_energy=False) if scheme.impulses else law
    return March(system, law, scheme, EffectiveOperators(system, scheme), step, len(noise) - 2)


def _at(numbers: Array, places: Any) -> Any:
    """Return numbers at the floor of places."""
    return numbers[np.asarray(places).astype(int)]


def _rest(plan: March) -> State:
    still = np.zeros(plan.system.operators.size)
    images = [imaged(plan.system.operators, still) for _ in range(2)]
    depth = plan.system.contact.depth(still)
    return begun(plan, State(0.0, *images, depth, np.zeros_like(depth)))
