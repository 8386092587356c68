"""Axis of a study: the last key with more than one value, as numbers; the other keys become choices.

Equal warnings of several signals become one, with the names of the signals and the range of each number.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from gapbeam.postprocess.display_units import LENGTHS, shown
from gapbeam.postprocess.study_figures.sweep_columns import Values, columns_of, key_along, other_values


@dataclass(frozen=True)
class StudyAxis:
    """The last key of a study.

    Attributes:
        key: Its name.
        texts: Its values as typed, each once.
        numbers: The same as numbers; counted from 1 where one of them is none.
        counted: Whether they are counted.
        unit: In which the numbers are.
        choices: Values of the other keys, each combination once; empty without other keys.
    """

    key: str
    texts: tuple[str, ...]
    numbers: tuple[float, ...]
    counted: bool
    unit: str
    choices: tuple[str, ...]

    @property
    def title(self) -> str:
        """Name of the axis."""
        return f"{self.key}, counted" if self.counted else f"{self.key} ({self.unit})"

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
        return other_values(values, self.key) if self.choices else None


def axis_of(points: Sequence[Values]) -> StudyAxis:
    """Return the axis of a study from the values of its keys at its points."""
    key = key_along(points)
    texts = tuple(dict.fromkeys(values[key] for values in points))
    numbers = [_number(text) for text in texts]
    counted = None in numbers
    places = tuple(float(n) for n in range(1, len(texts) + 1)) if counted else tuple(float(n or 0.0) for n in numbers)
    choices = tuple(column for column in dict.fromkeys(columns_of(points)) if column)
    unit, factor = shown("m") if key.endswith(LENGTHS) and not counted else ("SI", 1.0)
    return StudyAxis(key, texts, tuple(factor * place for place in places), counted, unit, choices)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None


_SIGNAL = re.compile(r"((?:[^:]+: )?(?:smoothed acceleration|acceleration|velocity|displacement)): (.+)", re.DOTALL)
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def alike(texts: Sequence[str]) -> list[str]:
    """Return warnings in their order, those that differ by their signal and by numbers alone as one.

    Args:
        texts: "velocity: lines of 2 % ...", "tip: acceleration: lines of 50 % ...", or anything else.
    """
    found: dict[str, tuple[list[str], list[list[str]]]] = {}
    for text in texts:
        match = _SIGNAL.fullmatch(text)
        name, rest = (match[1], match[2]) if match else ("", text)
        key = _NUMBER.sub("\0", rest) if name else f"\n{text}"
        names, numbers = found.setdefault(key, ([], []))
        names.append(name.replace(": ", " "))
        numbers.append(_NUMBER.findall(rest))
    return [_joined(key, names, numbers) if names[0] else key[1:] for key, (names, numbers) in found.items()]


def _joined(key: str, names: Sequence[str], numbers: Sequence[Sequence[str]]) -> str:
    spans = iter([_span(list(column)) for column in zip(*numbers, strict=True)])
    return f"{', '.join(names)}: {re.sub(chr(0), lambda _: next(spans), key)}"


def _span(values: Sequence[str]) -> str:
    """Return a number, or the smallest and the largest of several."""
    low, high = min(values, key=float), max(values, key=float)
    return low if float(low) == float(high) else f"{low} to {high}"
