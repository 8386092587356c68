"""Loads: a pattern on a structure times a function of time, a number, or a value that a program sets between steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gapbeam.solver.loads.time_function import Harmonic
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.argument_checks import answered, checked, finite
from gapbeam.solver.scene.printed_values import load_words
from gapbeam.solver.scene.structure import Structure, StructurePoint
from gapbeam.solver.scene.support_force import HELD, SupportForce
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.system.operators import Array

Value = float | Callable[..., Any] | tuple[Any, Any]


def sine(
    t: Any, amplitude: Any = 0.0, frequency: Any = 0.0, phase: Any = 0.0, ramp: float = 0.0, mean: Any = 0.0,
    scale: Any = 1.0,
) -> Any:  # fmt: skip
    """Return scale (mean + r(t) amplitude sin(2 pi frequency t + phase)), the value of a harmonic load.

    Its arguments are parameters of the load: `Force(a["tip"], sine, amplitude=3.0, frequency=20.0, name="shaker")` has
    the paths "shaker.amplitude" and "shaker.frequency".

    Args:
        t: s.
        amplitude: Amplitude in the unit of the load.
        frequency: Hz.
        phase: Degrees.
        ramp: Time in which the sine rises smoothly from 0, s, the same for all members of an ensemble.
        mean: Mean in the unit of the load.
        scale: Factor on all of it.

    Raises:
        UserError: Members have different ramps.
    """
    if np.ndim(ramp):
        raise UserError("sine: found several ramps, expected one for all members")
    return scale * (mean + Harmonic(amplitude, frequency, phase, ramp).value(t))


def sine_of(value: Callable[[Any], Any]) -> dict[str, Any] | None:
    """Return the parameters of `sine` that are the value of a harmonic load; None: it is another function of time.

    Args:
        value: Value of the load, as its `TimeFunction` has it.
    """
    wave, order = getattr(getattr(value, "func", None), "__self__", None), getattr(value, "keywords", {})
    if not isinstance(wave, Harmonic) or (wave.ramp and order["derivative"]):
        return None
    size = wave.amplitude * (2.0 * np.pi * wave.frequency) ** order["derivative"]
    turned = wave.phase + 90.0 * order["derivative"]
    return {"amplitude": size, "frequency": wave.frequency, "phase": turned, "ramp": wave.ramp}


class Load:
    """A pattern of forces on a structure times a value.

    Args:
        structure: The structure that the load acts on.
        pattern: Generalized forces of a value of 1, (DOFs,).
        value: A number; a function of time, of arrays if it can; or (times, values), straight between. A number may be
            set between steps: `load.value = 3.0`. A function with jumps may have `mean_over`, the mean from the starts
            to the ends of steps: see `over_steps`.
        name: Name in results and paths; unique in a scene.
        parameters: More arguments of the function by name; members of an ensemble may differ in them.

    Raises:
        UserError: The pattern has another number of DOFs, or the value is none of these.
    """

    unit = ""
    """Unit of the value; empty: unknown."""

    __repr__ = load_words

    @checked
    def __init__(
        self, structure: Structure, pattern: ArrayLike, value: Value, name: str = "", **parameters: Any
    ) -> None:
        self.structure, self.name, self.parameters = structure, name, dict(parameters)
        self.held: dict[str, Array] = {}
        self.pattern = finite(pattern, f"load {name or '?'}: pattern")
        if self.pattern.shape != (structure.size,):
            raise UserError(
                f"load {name or '?'}: found a pattern of shape {self.pattern.shape}, expected ({structure.size},): one "
                "number for each DOF of its structure"
            )
        self.value = value
        if not isinstance(value, tuple) and not callable(value):
            finite(value, f"load {name or '?'}: value")

    @property
    def value(self) -> Any:
        """The value; see `Load`."""
        return self._value

    @value.setter
    def value(self, value: Any) -> None:
        """Set the value.

        Raises:
            UserError: A table has other times than values, or times that do not grow.
        """
        self._value = value
        if isinstance(value, tuple):
            table = [finite(one, f"load {self.name or '?'}") for one in value]
            shapes = [one.shape for one in table]
            if len(shapes) != 2 or len(shapes[0]) != 1 or shapes[1] != shapes[0] or np.any(np.diff(table[0]) <= 0.0):
                raise UserError(f"load {self.name or '?'}: expected as many values as times, and times that grow")
            self._value = tuple(table)

    def pattern_on(self, structure: Structure) -> Array:
        """Return the pattern on the structure with the point masses of a scene, (DOFs,): the same except inertia."""
        del structure
        return self.pattern

    def on_support(self, name: str, force: SupportForce) -> Array:
        """Return the force of a value of 1 on the held motions of a support, (6,)."""
        del force
        return self.held.get(name, np.zeros(HELD))

    def table(self, times: Array, lanes: int = 1) -> Array:
        """Return the values at some times, (times, lanes).

        Raises:
            UserError: A table of times is left, or a function gives no finite numbers.
        """
        if isinstance(self.value, tuple):
            known, values = self.value
            slack = 1e-9 * float(known[-1] - known[0])
            if len(times) and not (known[0] - slack <= times[0] and times[-1] <= known[-1] + slack):
                raise UserError(
                    f"load {self.name or '?'}: asked at {times[0]:.6g} to {times[-1]:.6g} s, but its table covers "
                    f"{known[0]:.6g} to {known[-1]:.6g} s"
                )
            return np.repeat(np.interp(times, known, values)[:, None], lanes, axis=1)
        if not callable(self.value):
            given = finite(self.value, f"load {self.name or '?'}")
            if given.ndim > 1 or given.size not in (1, lanes):
                expected = f"{lanes} values, one for each member" if lanes > 1 else "one value, or (times, values)"
                raise UserError(f"load {self.name or '?'}: found {counted(given.size, 'value')}, expected {expected}")
            return np.broadcast_to(given, (len(times), lanes))
        ends = [(float(t), (1, lanes)) for t in times[[0, -1]]] if len(times) else []
        try:
            found = self._asked(times[:, None], (len(times), lanes))
            whole = np.ptp(found, axis=0).any() or all(np.all(self._asked(*end) == found[0]) for end in ends)
        except Exception:  # a function of one number, or whatever a program may raise
            whole = False
        if not whole:  # a number for all times, and another one by itself: noise, or looked at as a whole
            found = np.vstack([np.zeros((0, lanes)), *(self._asked(float(t), (1, lanes)) for t in times)])
        if not np.all(np.isfinite(found)):
            first = times[int(np.flatnonzero(~np.isfinite(found).all(axis=1))[0])]
            raise UserError(f"load {self.name or '?'}: its value at {first:.6g} s is not finite")
        return found

    def over_steps(self, times: Array, lanes: int = 1, level: float = 0.5) -> Array:
        """Return the values that steps take, (steps, lanes).

        The midpoint rule takes the mean over a step of a function with `mean_over`: a jump within the step then gives
        its exact impulse. Other functions and rules: the value at the level of the step.

        Args:
            times: Ends of the steps, after their start, s, (steps + 1,).
            lanes: See `table`.
            level: Level of the scheme.

        Raises:
            UserError: See `table`.
        """
        starts, ends = times[:-1], times[1:]
        inside = starts + level * (ends - starts)
        if level != 0.5 or not len(starts):
            return self.table(inside, lanes)
        mean = getattr(self.value, "mean_over", None) if callable(self.value) else None
        if mean is None:
            return self.table(inside, lanes)
        return np.broadcast_to(mean(starts[:, None], ends[:, None], **self.parameters), (len(starts), lanes))

    def _asked(self, t: Any, shape: tuple[int, int]) -> Array:
        """Return the values of the function at one or all times.

        Raises:
            UserError: The function fails, or returns something else than a real number for each time.
        """
        where = f"load {self.name or '?'}: its function at {np.ravel(t)[0]:.6g} s"
        return answered(partial(self.value, **self.parameters), t, shape, where)

    def replaced(self, name: str, value: Any) -> Load:
        """Return the load with another "value" or parameter.

        Raises:
            UserError: The load has no such parameter.
        """
        if name != "value" and name not in self.parameters:
            known = ", ".join(["value", *self.parameters])
            raise UserError(f"load {self.name or '?'} has no {name!r}; it has {known}")
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        if name == "value":
            other.value = value
        else:
            other.parameters = self.parameters | {name: value}
        return other


class Force(Load):
    """A force at a point, N.

    Args:
        point: Point that it acts on.
        value: See `Load`.
        direction: Direction in the motions of the point; default its first motion.
        name: See `Load`.
        parameters: See `Load`.
    """

    unit = "N"

    @checked
    def __init__(
        self, point: StructurePoint, value: Value, direction: ArrayLike | None = None, name: str = "", **parameters: Any
    ) -> None:
        if not isinstance(point, StructurePoint):
            raise UserError(f'force {name or "?"}: found {point!r}, expected a point, such as beam["tip"]')
        point.refuse_moving(f"force {name or '?'}", "gapbeam.moving_force")
        along = np.eye(len(point.rows))[0] if direction is None else np.atleast_1d(finite(direction, "direction"))
        if along.shape != (len(point.rows),):
            raise UserError(
                f"force {name or '?'}: found direction {direction!r}, expected {counted(len(point.rows), 'number')}"
            )
        super().__init__(point.structure, along @ point.rows, value, name, **parameters)
        self.unit = unit_where("N", point.turns)


class ClampMotion(Load):
    """The force of a clamp that moves, by its value, m: the pattern is that of `driven_rows` for K.

    Args:
        structure: See `Load`.
        pattern: See `Load`.
        value: Displacement of the clamp, m, a function of time.
        rate: Its velocity, m/s, likewise.
        name: See `Load`.
    """

    def __init__(
        self, structure: Structure, pattern: ArrayLike, value: Value, rate: Callable[..., Any], name: str = ""
    ) -> None:
        super().__init__(structure, pattern, value, name)
        self.rate = rate


class _InertiaLoad(Load):
    """A load on the inertia M r of the motion r with the frame, times a sign."""

    sign = 1.0
    kind = "weight"
    unit = "m/s2"

    @checked
    def __init__(
        self,
        structure: Structure,
        value: Value,
        direction: ArrayLike | None = None,
        name: str = "",
        **parameters: Any,
    ) -> None:
        self.direction, self._where = direction, f"{self.kind} {name or '?'}"
        if structure.is_spatial:
            self.direction = unit_direction(direction, self._where)
        pattern = self.sign * _inertia(structure, direction, self._where)
        super().__init__(structure, pattern, value, name, **parameters)

    def pattern_on(self, structure: Structure) -> Array:
        return self.sign * _inertia(structure, self.direction, self._where)

    def on_support(self, name: str, force: SupportForce) -> Array:
        del name
        return np.asarray(self.sign * force.inertia @ unit_direction(self.direction, self._where))

    def motion_of(self, point: StructurePoint) -> Array | None:
        """Return the motion of a point of the structure with a unit motion of the frame, (motions,), or None."""
        count = len(point.rows)
        if point.structure.is_spatial:
            known = point.structure.frame.get(point.name)
            return None if known is None else np.broadcast_to(known @ np.asarray(self.direction), (count,))
        if self.direction is not None:
            return np.asarray(point.rows @ np.asarray(self.direction, dtype=float))
        known = point.structure.frame.get(point.name)
        return None if known is None else np.broadcast_to(known, (count,))


class BaseMotion(_InertiaLoad):
    """A motion of the frame; displacements of the structure are then relative to the frame.

    Args:
        structure: The structure on the frame.
        acceleration: Acceleration of the frame, m/s^2; as the value of a `Load`.
        direction: Motion of all DOFs when the frame moves by 1, (DOFs,); default: the inertia of the structure says.
            A structure in space takes the direction (x, y, z), whose length does not count.
        name: See `Load`.
        parameters: See `Load`.
    """

    sign = -1.0
    kind = "base motion"

    @checked
    def __init__(
        self,
        structure: Structure,
        acceleration: Value,
        direction: ArrayLike | None = None,
        name: str = "",
        **parameters: Any,
    ) -> None:
        super().__init__(structure, acceleration, direction, name, **parameters)


@checked
def weight(structure: Structure, gravity: float, direction: ArrayLike | None = None, name: str = "") -> Load:
    """Return the weight of a structure: gravity, m/s^2, along its motion with the frame; negative: against it.

    Args:
        structure: The structure that weighs.
        gravity: m/s^2.
        direction: As of `BaseMotion`; (0, 0, 1) for a structure in space whose weight acts along z.
        name: See `Load`.

    Raises:
        UserError: Neither the structure nor the call has a direction.
    """
    return _InertiaLoad(structure, gravity, direction, name)


def _inertia(structure: Structure, direction: ArrayLike | None, where: str) -> Array:
    """Return M r."""
    if structure.is_spatial:
        assert structure.inertia is not None
        return structure.inertia @ unit_direction(direction, f"{where}: structure {structure.name or '?'}")
    if direction is None:
        if structure.inertia is None:
            raise UserError(
                f"{where}: structure {structure.name or '?'} has no inertia; give the direction, the DOFs of its "
                "motion with the frame"
            )
        return structure.inertia
    along = finite(direction, f"{where}: direction")
    if along.shape != (structure.size,):
        raise UserError(f"{where}: found a direction of shape {along.shape}, expected ({structure.size},)")
    found: Array = structure.M @ along
    return found


def unit_direction(direction: ArrayLike | None, where: str) -> Array:
    """Return a direction of space, (3,), of length 1.

    Raises:
        UserError: The vector is no direction.
    """
    given = np.zeros(0) if direction is None else finite(direction, f"{where}: direction")
    if given.shape != (3,) or not np.any(given):
        found = "no direction" if direction is None else f"direction {given.tolist()}"
        raise UserError(f"{where}: found {found}, expected (x, y, z), as its frame moves in space")
    along = given / np.max(np.abs(given))  # squares of very small or large numbers leave the range of floats
    return np.asarray(along / np.linalg.norm(along))
