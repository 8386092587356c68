"""Axes of a study: keys of the case and their values, as a grid or side by side."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import ceil, log10
from typing import Literal, NamedTuple

import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import counted, is_numeric

MOST_POINTS = 100_000

Spacing = Literal["log", "linear"]


class Axis(NamedTuple):
    """A key of the case and the values that it takes, as one would type them after `--set key=`."""

    key: str
    values: tuple[str, ...]


def read_axis(text: str, spacing: Spacing = "log", prefix: str = "`vary=` ") -> Axis:
    """Read KEY=a,b,c or KEY=first:last:count, with :log or :linear behind for another spacing than the usual.

    Commas inside brackets and braces belong to the value.

    Args:
        text: As typed.
        spacing: Spacing of a range that does not say.
        prefix: Option before it on the command line.

    Raises:
        UserError: Neither of the two.
    """
    key, _, given = text.partition("=")
    if not key or not given:
        raise UserError(f'{prefix}"{text}": found no values; expected KEY=a,b,c or KEY=first:last:count')
    parts = given.split(":")
    if len(parts) == 2 and all(map(is_numeric, parts)):
        raise UserError(f'{prefix}"{text}": found a range without a count; expected first:last:count, as in {given}:11')
    if len(parts) not in (3, 4) or "{" in given or '"' in given:
        return Axis(key, tuple(_split(given)))
    wanted = parts[3] if len(parts) == 4 else spacing
    if wanted not in ("log", "linear"):
        raise UserError(f'{prefix}"{text}": found {wanted}; expected first:last:count:log or first:last:count:linear')
    try:
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
    except ValueError:
        raise UserError(f'{prefix}"{text}": expected numbers in first:last:count, such as 1e8:1e18:11') from None
    if not np.isfinite([first, last]).all() or not 1 <= count <= MOST_POINTS:
        raise UserError(f'{prefix}"{text}": expected finite numbers and a count from 1 to {MOST_POINTS}')
    if wanted == "log" and (first <= 0.0 or last <= 0.0):
        raise UserError(f'{prefix}"{text}": expected first and last above 0 for even spacing in the logarithm')
    values = np.geomspace(first, last, count) if wanted == "log" else np.linspace(first, last, count)
    nearest = float(np.abs(np.diff(values)).min(initial=np.inf)) or np.inf
    digits = 6 + max(0, ceil(log10(float(np.abs(values).max()) / nearest or 1.0)) - 2)  # neighbors stay apart
    return Axis(key, tuple(f"{value:.{digits}g}" for value in values))


def points_of(axes: Sequence[Axis], zipped: bool = False) -> list[tuple[str, ...]]:
    """Return the values of every point in the order of the axes; the last axis varies fastest.

    Args:
        axes: Axes of the study.
        zipped: Take the first values together, the second ones, and so on; by default every value with every other.

    Raises:
        UserError: Too many points, a key twice, or lists of different lengths side by side.
    """
    keys = [axis.key for axis in axes]
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if twice:
        raise UserError(f"{', '.join(twice)} given twice; expected every key once, with all of its values")
    if zipped:
        lengths = {axis.key: len(axis.values) for axis in axes}
        if len(set(lengths.values())) > 1:
            prefix = ", ".join(f"{key} has {length}" for key, length in lengths.items())
            raise UserError(f"`zipped=True`: {prefix} values; expected as many for every key")
        return list(zip(*(axis.values for axis in axes), strict=True))
    count = int(np.prod([float(len(axis.values)) for axis in axes]))
    if count > MOST_POINTS:
        raise UserError(f"the grid has {counted(count, 'point')}; expected at most {MOST_POINTS}")
    return list(product(*(axis.values for axis in axes)))


def overrides_of(axes: Sequence[Axis], point: Sequence[str], fixed: Sequence[str] = ()) -> list[str]:
    """Return the overrides KEY=VALUE of a point."""
    return [*fixed, *(f"{axis.key}={value}" for axis, value in zip(axes, point, strict=True))]


def _split(text: str) -> list[str]:
    """Split at commas that are not inside brackets or braces."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip()]
