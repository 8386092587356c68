"""Kinds of arguments, read from the annotations of public functions and refused in one sentence where they differ."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from functools import cache, partial, wraps
from numbers import Integral, Real
from os import PathLike
from typing import Any, ParamSpec, TypeVar

import numpy as np
import scipy

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG, counted, printable
from gapbeam.solver.system.operators import Array

FAR = 0.1  # of the size of a structure, from which on coordinates are asked about
P = ParamSpec("P")
R = TypeVar("R")
Kind = tuple[Callable[[Any], bool], str]


def _is_number(value: Any, kind: type = Real) -> bool:
    value = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    return isinstance(value, kind) and not isinstance(value, bool)


PLAIN: dict[str, Kind] = {
    "float": (_is_number, "a number"),
    "int": (lambda value: _is_number(value, Integral), "a whole number"),
    "str": (lambda value: isinstance(value, str), "a text"),
    "bool": (lambda value: isinstance(value, bool), "True or False"),
    "None": (lambda value: value is None, "None"),
    "Mapping": (lambda value: isinstance(value, Mapping), "a dict"),
    "Sequence": (lambda value: isinstance(value, Sequence | np.ndarray) and not isinstance(value, str), "a list"),
    "Callable": (callable, "a function"),
    "PathLike": (lambda value: isinstance(value, PathLike), "a path"),
    "Path": (lambda value: isinstance(value, PathLike), "a path"),
}
ARTICLES = {
    "Scene": "a scene",
    "SceneState": "a state, as of gapbeam.seat",
    "Structure": "a structure",
    "StructurePoint": 'a point of a structure, such as beam["tip"]',
    "Material": "a material, as of gapbeam.material",
    "Pose": "a place, as of gapbeam.Pose",
    "CrossSection": "a section, as of gapbeam.section",
    "SpaceSection": "a section, as of gapbeam.space_section",
    "LinearScheme": "a scheme, such as gapbeam.midpoint()",
    "FlowSpan": "a span, as of gapbeam.span",
    "Figure": "a figure, as of gapbeam.figure",
    "Atlas": "an atlas, as of gapbeam.atlas",
    "Library": "a library, as of gapbeam.library",
    "Recording": "a recording, as of gapbeam.read_recording",
    "EstimatedValues": "an estimate, as of gapbeam.estimate",
    "ConvexRegion": "a region, such as gapbeam.Slot(1e-4)",
    "ForceLaw": "a law with its parameters, such as gapbeam.KelvinVoigt(stiffness=1e8)",
}
"""Classes of this package that annotations name, and the words for them."""


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Refuse arguments of another kind than the annotation says, before the function sees them.

    Checked are numbers (True is none), texts, dicts, lists, functions and the nouns of scenes;
    annotations of other kinds, such as arrays, are left to the function.

    Raises:
        UserError: An argument is of another kind; the message has its name, what was found and what was expected.
    """
    signature = inspect.signature(function)
    called = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]
    named = {name: one for name, one in signature.parameters.items() if one.kind is not one.VAR_KEYWORD}
    wanted = {name: kinds for name, one in named.items() if (kinds := _kinds(str(one.annotation)))}
    several = {name for name, one in named.items() if one.kind is one.VAR_POSITIONAL}

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        bound = dict[str, Any]()
        with suppress(TypeError):  # the function raises it, with its name
            bound = signature.bind(*args, **kwargs).arguments
        for name, value in bound.items():
            for one in value if name in several else (value,):
                _refuse(called, name, one, wanted.get(name))
        return function(*args, **kwargs)

    return call


def check_fields(owner: Any, called: str) -> None:
    """Refuse fields of a dataclass of another kind than their annotation says, as `checked` does.

    Raises:
        UserError: A field is of another kind.
    """
    for one in fields(owner):
        _refuse(called, one.name, getattr(owner, one.name), _kinds(str(one.type)))


def _refuse(called: str, name: str, value: object, wanted: Sequence[Kind] | None) -> None:
    if wanted and not any(holds(value) for holds, _ in wanted):
        words = " or ".join(word for _, word in wanted)
        raise UserError(f"{called}: {name}: found {shown(value)}, expected {words}")


def shown(value: object) -> str:
    """Return a value as messages show it: one line, not longer than it can be read."""
    return printable(" ".join(repr(value).split()))


@cache
def _kinds(annotation: str) -> tuple[Kind, ...]:
    """Return the kinds that an annotation names; none where one of them is not known here."""
    found: list[Kind] = []
    for part in re.split(r" \| (?![^\[]*\])", annotation):  # those in brackets are of entries
        name, _, entries = part.rstrip("]").partition("[")
        if name == "Sequence" and entries in ARTICLES:
            found.append((partial(_is_list_of, entries), f"a list, each of it {ARTICLES[entries]}"))
        elif name in PLAIN:
            found.append(PLAIN[name])
        elif name in ARTICLES:
            found.append((partial(_is_a, name), ARTICLES[name]))
        else:
            return ()
    return tuple(found)


def _is_list_of(name: str, value: Any) -> bool:
    return PLAIN["Sequence"][0](value) and all(_is_a(name, one) for one in value)


def _is_a(name: str, value: object) -> bool:
    return any(one.__name__ == name for one in type(value).__mro__)


class ArgumentError(UserError):
    """A fault of one argument.

    Attributes:
        argument: Its name, such as "stiffness"; of an entry of a table "points.tip".
    """

    def __init__(self, message: str, argument: str) -> None:
        super().__init__(message)
        self.argument = argument


def coordinates(value: Any, where: str, argument: str) -> Array:
    """Return coordinates, (3,), m.

    Raises:
        ArgumentError: Their number is another one.
    """
    found = finite(value, where)
    if found.shape != (3,):
        raise ArgumentError(f"{where}: found {value!r}, expected coordinates (x, y, z)", argument)
    return found


def check_near(where: str, argument: str, apart: float, size: float) -> None:
    """Refuse coordinates farther from a structure than it is large, and warn from a tenth on: slips and other units.

    Args:
        where: Name of the point in the message.
        argument: See `ArgumentError`.
        apart: Distance of the coordinates from the nearest place of the structure, m.
        size: Size of the structure, m.

    Raises:
        ArgumentError: Coordinates are too far away.
    """
    if apart > size:
        raise ArgumentError(
            f"{where}: found coordinates {apart:.4g} m away from the structure, expected some within {size:.4g} m, its "
            "size; are they in m?",
            argument,
        )
    if apart > FAR * size:
        LOG.warning(
            "%s: its coordinates are %.4g m away from the structure of %.4g m: is its nearest place meant?",
            where, apart, size,
        )  # fmt: skip


NO_NUMBERS = {"c": "complex numbers", "U": "text", "S": "text", "m": "spans of time, not s", "M": "dates, not s"}
"""Kinds of arrays that NumPy would make real numbers of, by their letter."""


def reals(value: Any, where: str) -> Array:
    """Return numbers as an array of floats, which need not be finite.

    Raises:
        UserError: A value is no number, complex, text or a date.
    """
    try:
        found = np.asarray(value)
        if found.dtype.kind in NO_NUMBERS:
            raise TypeError(NO_NUMBERS[found.dtype.kind])
        return found.astype(float)
    except (TypeError, ValueError) as error:
        raise UserError(f"{where}: expected real numbers ({error})") from None


def finite(value: Any, where: str) -> Array:
    """Return numbers as an array of floats.

    Raises:
        UserError: A value is none of `reals`, or not finite.
    """
    found = reals(value, where)
    if not np.all(np.isfinite(found)):
        raise UserError(f"{where}: expected finite numbers, found {np.count_nonzero(~np.isfinite(found))} that are not")
    return found


def answered(function: Callable[..., Any], at: Any, shape: tuple[int, ...], where: str) -> Array:
    """Return the answer of a function of the user at a time or place, as floats of a shape; they may not be finite.

    Args:
        function: The function.
        at: Its first argument.
        shape: Shape of the answer, to which others that fit are spread.
        where: The function in messages.

    Raises:
        UserError: The function fails, or returns something else than real numbers of that shape.
    """
    try:
        found = np.asarray(function(at))
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"{where} failed ({type(error).__name__}: {error})") from error
    if found.dtype.kind in NO_NUMBERS:
        raise UserError(f"{where} returned {NO_NUMBERS[found.dtype.kind]}, expected real numbers")
    try:
        return np.broadcast_to(found.astype(float), shape)
    except (TypeError, ValueError):
        wanted = f"{counted(shape[0], 'number')}, one for each motion" if shape and shape[0] > 1 else "a number"
        raise UserError(f"{where} returned {printable(found)} of shape {found.shape}, expected {wanted}") from None


def period_at(period: Any, values: Mapping[str, float], where: str) -> float:
    """Return a period, s: a number, or the answer of a function of the values by path.

    Raises:
        UserError: The function fails, or returns no number.
    """
    return float(answered(period, values, (1,), f"{where}: period")[0]) if callable(period) else float(period)


def for_each(value: Any, count: int, where: str) -> Array:
    """Return a number for each of so many DOFs, given as one for all of them or as an array, (count,).

    Raises:
        UserError: A value is not finite, or their number is another.
    """
    found = finite(value, where)
    if found.shape not in ((), (count,)):
        raise UserError(f"{where}: found values of shape {found.shape}, expected a number or ({count},)")
    return np.broadcast_to(found, (count,))


def positive(value: Any, where: str, zero: bool = False) -> Array:
    """Return numbers above zero, or from zero on.

    Raises:
        UserError: A value is not.
    """
    found = finite(value, where)
    if not np.all(found >= 0.0 if zero else found > 0.0):
        raise UserError(f"{where}: found {found.min():.6g}, expected numbers {'from' if zero else 'above'} 0")
    return found


def check_section(section: Any, where: str) -> None:
    """Refuse figures of a cross-section that none can have.

    Args:
        section: Area and moments, which are finite, shear areas, which may be infinite, and figures whose default is 0.
        where: Owner of the section in the message.

    Raises:
        UserError: A figure is not above 0, or from 0 on where 0 is the default.
    """
    for name, value in section._asdict().items():
        number, zero = reals(value, f"{where}: section: {name}"), section._field_defaults.get(name) == 0.0
        if not np.all(number >= 0.0 if zero else number > 0.0):
            raise UserError(
                f"{where}: section: {name}: found {value}, expected a number {'from 0 on' if zero else 'above 0'}"
            )
        if "shear" not in name:
            finite(value, f"{where}: section: {name}")


def positives(where: str, zero: bool = False, **values: Any) -> list[float]:
    """Return numbers above zero, or from zero on, given by their names, and refuse others by these; see `positive`."""
    return [float(positive(value, f"{where}: {name}", zero)) for name, value in values.items()]


def matrix(value: Any, where: str) -> Any:
    """Return a square matrix of floats, dense or in compressed rows.

    Raises:
        UserError: The matrix is not square, or has entries that are not finite.
    """
    if scipy.sparse.issparse(value):
        found = scipy.sparse.csr_matrix(value)
        found.data = finite(found.data, where)
    else:
        found = np.atleast_2d(finite(value, where))
    if found.ndim != 2 or found.shape[0] != found.shape[1]:
        raise UserError(f"{where}: found shape {found.shape}, expected a square matrix")
    return found


def named_values(where: str, values: Sequence[Any], named: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return all values by name; those without one have the names in their order.

    Raises:
        UserError: There are more values than names, or one is given twice.
    """
    found = dict(zip(names, values, strict=False))
    twice = [one for one in named if one in found]
    if len(values) > len(names) or twice:
        what = f"{twice[0]} twice" if twice else f"{len(values)} values"
        raise UserError(f"{where}: found {what}, expected {', '.join(names) or 'none'}")
    return found | dict(named)
