"""Axis of a study: the last of its keys with its values, and the values of the other keys beside them.

Values that are spread evenly in the logarithm, rather than evenly, have a logarithmic axis.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from gapbeam.postprocess.display_units import shown, shown_by

Values = Mapping[str, str]
Units = Mapping[str, str]
"""SI unit by key; "" or no entry: no unit, or none that is known."""
DECADE = 10.0
NONE = "no unit"


def key_along(points: Sequence[Values]) -> str:
    """Return the key along the axis: the last one that has more than one value.

    Args:
        points: Values of the keys at every point, as typed.
    """
    keys = list(points[0])
    varied = [key for key in keys if len({values[key] for values in points}) > 1]
    return varied[-1] if varied else keys[-1]


def value_words(text: str, unit: str) -> str:
    """Return a value, typed in SI, in the unit shown."""
    value = number_in(text)
    label, factor = shown(unit, value or 0.0)
    return text if value is None or not has_unit(unit) else f"{factor * value:.6g} {label}"


def other_values(values: Values, along: str, units: Units | None = None) -> str:
    """Return the values of the other keys of a point, in words."""
    units = units or {}
    return ", ".join(
        f"{key} = {value_words(value, units.get(key, ''))}" for key, value in values.items() if key != along
    )


def columns_of(points: Sequence[Values], units: Units | None = None) -> list[str]:
    """Return the column of every point: the values of its other keys, or "" for all where the keys vary side by side.

    Keys vary side by side, as with `--zip`, where no values of the other keys come back at another point: a column for
    each of them would hold one point.
    """
    along = key_along(points)
    columns = [other_values(values, along, units) for values in points]
    return columns if len(set(columns)) < len(columns) else [""] * len(columns)


def named_key(key: str, units: Units, values: Iterable[float | None]) -> tuple[str, float]:
    """Return a key with the unit that is shown for its values, and the factor from SI."""
    unit = units.get(key, "")
    label, factor = shown_by(unit, values)
    return (f"{key} ({label})", factor) if has_unit(unit) else (key, 1.0)


def si_key(key: str, units: Units) -> str:
    """Return a key with its SI unit, as heads of values as typed have it."""
    unit = units.get(key, "")
    return f"{key} ({unit})" if has_unit(unit) else key


def has_unit(unit: str) -> bool:
    """Return whether a unit is one that can be shown behind a number."""
    return bool(unit) and unit != NONE


def is_logarithmic(values: Sequence[float] | np.ndarray) -> bool:
    """Return whether values over a decade or more are spread more evenly in the logarithm."""
    found = np.unique(np.asarray(values, dtype=float))
    if len(found) < 3 or found[0] <= 0.0 or found[-1] < DECADE * found[0]:
        return False
    evenness = [float(gaps.max() / gaps.min()) for gaps in (np.diff(np.log(found)), np.diff(found))]
    return evenness[0] < evenness[1]


def cell_edges(values: np.ndarray) -> np.ndarray:
    """Return the ends of cells around ascending values, (n + 1,), halfway between them on their axis."""
    logarithmic = is_logarithmic(values)
    places = np.log(values) if logarithmic else values
    middle = 0.5 * (places[1:] + places[:-1])
    edges: np.ndarray = np.concatenate([2.0 * places[:1] - middle[:1], middle, 2.0 * places[-1:] - middle[-1:]])
    return np.asarray(np.exp(edges) if logarithmic else edges)


@dataclass(frozen=True)
class StudyAxis:
    """The last key of a study.

    Attributes:
        key: Its name.
        texts: Its values as typed, each once.
        numbers: The same as numbers in the unit shown; counted from 1 where one of them is none.
        counted: Whether they are counted.
        name: The key with its unit.
        units: SI units of all keys.
        choices: Values of the other keys, each combination once; empty without other keys.
    """

    key: str
    texts: tuple[str, ...]
    numbers: tuple[float, ...]
    counted: bool
    name: str
    units: Units
    choices: tuple[str, ...]

    @property
    def title(self) -> str:
        """Name of the axis."""
        return f"{self.key}, counted" if self.counted else self.name

    @property
    def is_logarithmic(self) -> bool:
        """True where the axis is logarithmic."""
        return not self.counted and is_logarithmic(self.numbers)

    @property
    def legend(self) -> str:
        """Explanation of the numbers of a counted axis; empty for a plain one."""
        if not self.counted:
            return ""
        words = ", ".join(f"{number:g} is {text}" for number, text in zip(self.numbers, self.texts, strict=True))
        return f" On the axis {words}."

    def place(self, values: Values) -> float:
        """Return the place of a point on the axis."""
        return self.numbers[self.texts.index(values[self.key])]

    def others(self, values: Values) -> str | None:
        """Return the choice of a point; None where no other key varies."""
        return other_values(values, self.key, self.units) if self.choices else None


def axis_of(points: Sequence[Values], units: Units | None = None) -> StudyAxis:
    """Return the axis of a study from the values of its keys at its points, and their units."""
    units, key = units or {}, key_along(points)
    texts = tuple(dict.fromkeys(values[key] for values in points))
    numbers = [number_in(text) for text in texts]
    counted = None in numbers
    name, factor = (key, 1.0) if counted else named_key(key, units, numbers)
    places = [place if counted else factor * float(n or 0.0) for place, n in enumerate(numbers, start=1)]
    choices = tuple(column for column in dict.fromkeys(columns_of(points, units)) if column)
    return StudyAxis(key, texts, tuple(map(float, places)), counted, name, units, choices)


def number_in(text: str) -> float | None:
    """Return the finite number that a text is; None: it is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None
