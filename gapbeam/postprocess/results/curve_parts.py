"""Parts of a response curve that are drawn alike: of one branch and one stability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby, pairwise
from typing import Any

Point = Mapping[str, Any]


def branch_parts(points: Sequence[Point]) -> Iterator[tuple[int, slice]]:
    """Yield the number and the points of every branch.

    Args:
        points: Those of curve.json.
    """
    start = 0
    for number, branch in groupby(points, lambda point: int(point.get("branch", 1))):
        stop = start + len(list(branch))
        yield number, slice(start, stop)
        start = stop


def stable_parts(points: Sequence[Point]) -> Iterator[tuple[bool | None, slice]]:
    """Yield the parts of a branch with whether their responses are stable; neighbors share a point.

    Between two points the stability is that of the first; where that is an event, at which stability changes, it is
    that of the second.

    Args:
        points: Those of one branch.
    """
    between = [(last if first["event"] else first)["stable"] for first, last in pairwise(points)]
    start = 0
    for stable, part in groupby(between):
        stop = start + len(list(part))
        yield stable, slice(start, stop + 1)
        start = stop
