"""Columns of a sweep: the key along the axis, and the values of the other keys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Values = Mapping[str, str]


def key_along(points: Sequence[Values]) -> str:
    """Return the key along the axis: the last one that has more than one value.

    Args:
        points: Values of the keys at every point, as typed.
    """
    keys = list(points[0])
    varied = [key for key in keys if len({values[key] for values in points}) > 1]
    return varied[-1] if varied else keys[-1]


def other_values(values: Values, along: str) -> str:
    """Return the values of the other keys of a point, in words."""
    return ", ".join(f"{key} = {value}" for key, value in values.items() if key != along)


def columns_of(points: Sequence[Values]) -> list[str]:
    """Return the column of every point: the values of its other keys, or "" for all where the keys vary side by side.

    Keys vary side by side, as with `--zip`, where no values of the other keys come back at another point: a column for
    each of them would hold one point.
    """
    along = key_along(points)
    columns = [other_values(values, along) for values in points]
    return columns if len(set(columns)) < len(columns) else [""] * len(columns)
