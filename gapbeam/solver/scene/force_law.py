"""Contact laws: a spring with its potential, and a damper, as scalar functions of the penetration.

A law sees neither arrays nor points nor time steps. `responder` makes the force of one step of it,

    N = share M(p0, p1),     M = (W(p1) - W(p0)) / (p1 - p0),     T = N + damper(N, share, rate),

with p = max(x, 0) and share = |p1 - p0| / |x1 - x0|, the part of the step's path in contact. Work of N over the step is
W(p1) - W(p0) exactly, whatever the law: the springs of all laws conserve energy at any step.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numba
import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import checked, finite, named_values, positive
from gapbeam.solver.scene.printed_values import called

TINY = 1e-300
SPEEDS = ("speed", "speed2", "speed3")
inlined: Any = numba.njit(error_model="numpy", forceinline=True)


@dataclass(frozen=True, eq=False)
class LawKind:
    """Functions and traits of a law; called with its parameters, it gives a `ForceLaw`.

    Attributes:
        name: Name in messages.
        names: Names of its parameters.
        spring: spring(x, *parameters): force at penetration x > 0, N.
        potential: potential(x, *parameters): integral of the spring from 0, J.
        damper: damper(N, share, rate, *parameters): force that the damper adds to the mean spring force N; or None.
        mean: mean(p0, p1, *parameters): M and dM/dp1 in closed form; None: by divided differences.
        adhesive: Whether the law acts at x < 0, too, and may pull.
        defaults: Parameters that may be left out.
        nonnegative: Names of parameters that may not be negative.
        positive: Names of parameters that may not be 0 either.
        settle: settle(x0, x1, h, *parameters): the last parameters, which the law remembers, after a step of h from x0
            to x1; or None.
        memory: Names of these parameters; those of SPEEDS are the velocities of the contact at the start.
        fractions: Names of parameters that may not be above 1.
        per_area: Names of the parameters that grow with the area of a face; None: the law acts at points alone.
        impact: Function of a law of impulses, impact(x0, step, h, force, stiffness, speed, *given): force T of a step
            and dT/dx1 from the force of the last pass, a stiffness beside which the bodies are soft, and the approach
            speed at its start; None: a spring with a damper.
    """

    name: str
    names: tuple[str, ...]
    spring: Any
    potential: Any
    damper: Any
    mean: Any = None
    adhesive: bool = False
    defaults: dict[str, float] = field(default_factory=dict)
    nonnegative: tuple[str, ...] = ()
    positive: tuple[str, ...] = ()
    settle: Any = None
    memory: tuple[str, ...] = ()
    fractions: tuple[str, ...] = ()
    per_area: tuple[str, ...] | None = None
    impact: Any = None

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the parameters that a user gives."""
        return tuple(one for one in self.names if one not in self.memory)

    def __call__(self, *values: Any, **named: Any) -> ForceLaw:
        """Return the law with its parameters.

        Raises:
            UserError: A parameter is unknown, missing, not finite or negative where it may not be.
        """
        parameters = named_values(f"law {self.name}", values, named, self.given)
        unknown = sorted(set(parameters) - set(self.given))
        missing = [one for one in self.names if one not in parameters and one not in self.defaults]
        if unknown or missing:
            raise UserError(
                f"law {self.name}: unknown {', '.join(unknown) or 'nothing'}, missing "
                f"{', '.join(missing) or 'nothing'}; its parameters: {', '.join(self.given)}"
            )
        return ForceLaw(self, tuple(self.value(one, parameters.get(one, self.defaults.get(one))) for one in self.names))

    def value(self, name: str, value: Any) -> Any:
        """Return the value of a parameter: a number, or an array over the members of an ensemble.

        Raises:
            UserError: The value is not finite, empty, or negative where it may not be.
        """
        where = f"law {self.name}: {name}"
        found = finite(value, where)
        if name in self.nonnegative or name in self.positive:
            found = positive(found, where, zero=name in self.nonnegative)
        if name in self.fractions and np.any(found > 1.0):
            raise UserError(f"{where}: found {value}, expected 0 to 1")
        if found.ndim > 1 or not found.size:
            raise UserError(f"{where}: found shape {found.shape}, expected a number, or one for each member")
        return float(found) if found.ndim == 0 else found


@dataclass(frozen=True, eq=False)
class ForceLaw:
    """A law with its parameters: numbers, or arrays over the members of an ensemble."""

    __repr__ = called

    kind: LawKind
    values: tuple[Any, ...]

    @property
    def is_damped(self) -> bool:
        """True where the damper acts at all with these parameters."""
        damper = self.kind.damper
        if damper is None or self.kind.memory:  # what it remembers may begin to damp
            return damper is not None
        try:
            return bool(np.any(damper.py_func(1.0, 1.0, 1.0, *(np.asarray(one) for one in self.values))))
        except (TypeError, ValueError):  # a function of numbers only
            return True

    def on_area(self, area: float) -> ForceLaw:
        """Return the law of a part of a face, m^2, of a law per area."""
        given = dict(zip(self.kind.names, self.values, strict=True))
        return self.replaced(**{name: area * given[name] for name in self.kind.per_area or ()})

    def replaced(self, **parameters: Any) -> ForceLaw:
        """Return the law with other parameters.

        Raises:
            UserError: The law has no such parameter, or it may not have that value.
        """
        unknown = sorted(set(parameters) - set(self.kind.given))
        if unknown:
            raise UserError(f"law {self.kind.name} has no {', '.join(unknown)}; it has {', '.join(self.kind.given)}")
        plain = {name: self.kind.value(name, value) for name, value in parameters.items()}
        pairs = zip(self.kind.names, self.values, strict=True)
        return replace(self, values=tuple(plain.get(name, value) for name, value in pairs))


@checked
def law(
    potential: Callable[..., Any],
    damper: Callable[..., Any] | None = None,
    mean: Callable[..., Any] | None = None,
    adhesive: bool = False,
    nonnegative: Sequence[str] = (),
    positive: Sequence[str] = (),
    settle: Callable[..., Any] | None = None,
    per_area: Sequence[str] | None = None,
) -> Callable[[Callable[..., Any]], LawKind]:
    """Make a law of a spring; a decorator of spring(x, *parameters), whose parameters are those of the law.

    All functions take and return numbers, and are compiled. The potential is compared with the spring when the law is
    made with its parameters and used: a potential that is no integral of the spring creates energy.

    Args:
        potential: potential(x, *parameters), J.
        damper: damper(N, share, rate, *parameters), N.
        mean: Closed form of M and dM/dp1; see `LawKind`.
        adhesive: Whether the law acts beyond touch, too, and may pull.
        nonnegative: Names of parameters that may not be negative.
        positive: Names of parameters that may not be 0 either.
        settle: Function that returns the memory of the law after a step; see `LawKind`. Parameters with defaults are
            this memory.
        per_area: Names of the parameters that grow with the area of a face; None: it acts at points alone.

    Raises:
        UserError: A name is that of no parameter, or there is no spring below.
    """

    def make(spring: Any = None, **others: Any) -> LawKind:
        if others or not callable(spring):
            raise UserError("law: found no spring, expected @gapbeam.law(potential=...) above spring(x, *parameters)")
        given = list(inspect.signature(spring).parameters.values())[1:]
        potential_, damper_, mean_, settle_ = (
            one if one is None or hasattr(one, "py_func") else inlined(one) for one in (potential, damper, mean, settle)
        )
        defaults = {one.name: one.default for one in given if one.default is not one.empty}
        names = tuple(one.name for one in given)
        if unknown := sorted({*nonnegative, *positive, *(per_area or ())} - set(names)):
            raise UserError(f"law {spring.__name__}: no parameter {', '.join(unknown)}; it has {', '.join(names)}")
        bounds = tuple(nonnegative), tuple(positive)
        memory = tuple(defaults) if settle is not None else ()
        return LawKind(
            spring.__name__, names, inlined(spring), potential_, damper_, mean_, adhesive, defaults, *bounds, settle_,
            memory, per_area=None if per_area is None else tuple(per_area),
        )  # fmt: skip

    return make


def _divided(kind: LawKind) -> Any:
    """Return compiled mean(p0, p1, *parameters) -> (M, dM/dp1) of a law without a closed form."""
    spring, potential = kind.spring, kind.potential

    @inlined
    def mean(a, b, *values):  # type: ignore[no-untyped-def]
        if abs(b - a) > 1e-3 * max(abs(a), abs(b)):
            M = (potential(b, *values) - potential(a, *values)) / (b - a)
            return M, (spring(b, *values) - M) / (b - a)
        middle, reach = 0.5 * (a + b), 0.3872983346207417 * (b - a)  # short steps at depth: three Gauss points
        sides = spring(middle - reach, *values) + spring(middle + reach, *values)
        e = 1e-4 * abs(middle) + TINY
        low = middle - e if abs(middle) > e else middle  # springs of no contact are not asked below 0
        return (
            (5.0 * sides + 8.0 * spring(middle, *values)) / 18.0,
            0.5 * (spring(middle + e, *values) - spring(low, *values)) / (middle + e - low),
        )

    return mean


@inlined
def _none(force, share, rate, *values):  # type: ignore[no-untyped-def]  # noqa: ARG001
    return 0.0


def responder(kind: LawKind, damped: bool = True) -> Any:
    """Return compiled respond(x0, x1, step, h, level, values) -> (T, dT/dx1, T - N, W(x1)) of a kind of law.

    `step` is the motion along the normal in h, `level` 0 for the mean over the step, else the level of the step whose
    place x0 = x1 is (1: its end, 1/2: its middle).
    """
    if kind.impact is not None:
        impact = kind.impact

        @inlined
        def strike(x0, x1, step, h, level, values):  # type: ignore[no-untyped-def]  # noqa: ARG001
            T, slope = impact(x0, step, h, *values)
            return T, slope, values[0] if slope > 0 else 0.0, 0.0

        return strike
    potential, adhesive = kind.potential, kind.adhesive
    damper = kind.damper if damped and kind.damper is not None else _none
    mean = kind.mean if kind.mean is not None else _divided(kind)

    @inlined
    def respond(x0, x1, step, h, level, values):  # type: ignore[no-untyped-def]
        a, b, pace = (x0, x1, 1.0 / h) if adhesive else (max(x0, 0.0), max(x1, 0.0), 1.0 / h)
        inside, inverse = 1.0 if adhesive or x1 > 0 else 0.0, 1 / (abs(step) + TINY)
        at_once = level > 0 or (x0 > 0 and x1 > 0) or adhesive
        share = inside if at_once else abs(b - a) * inverse  # exactly 0 in flight
        turn = 0.0 if level > 0 else (inside - share) * (inverse if step > 0 else -inverse)
        M, slope = mean(a, b, *values)
        force = share * M
        slope = turn * M + (2 * level if level > 0 else 1.0) * share * inside * slope
        e = 1e-4 * (abs(step) + TINY)
        total = force + damper(force, share, step * pace, *values)
        above = damper(force + e * slope, share + e * turn, (step + e) * pace, *values)
        below = damper(force - e * slope, share - e * turn, (step - e) * pace, *values)
        keep = 1.0 if adhesive or not damped or total > 0 else 0.0
        lost = keep * total - force if damped else 0.0
        return keep * total, keep * (slope + (above - below) * (5e3 * inverse)), lost, potential(b, *values)

    return respond
