"""Layers of a structured mesh: positions that hit given points and whose lengths grow smoothly."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.sizing.cell_length import CellLength

Positions = npt.NDArray[np.floating]

LARGEST_RATIO = 1.4
"""Largest ratio of neighboring layers that `structured_partition` accepts where two segments meet."""

MOST_LAYERS = 20_000
"""More layers than this in one direction are a mistake in a size."""

_SLACK = 0.1
_ROUNDS = 40
_SAMPLES = 16


def structured_partition(breakpoints: npt.ArrayLike, cell_length: CellLength) -> Positions:
    """Divide an interval into layers.

    Each segment between two breakpoints gets the number of layers N = integral of dx/h(x), rounded up (but a
    tenth of a layer is rounded down), with equal parts of that integral in each. A segment shorter than h
    makes its neighborhood finer, and where the lengths on both sides of a breakpoint differ by more than
    LARGEST_RATIO the longer side is refined.

    Args:
        breakpoints: Positions that become layer boundaries, at least two, increasing, in m.
        cell_length: Wanted length h(x), in m.

    Returns:
        Layer boundaries in m, increasing, all breakpoints exactly among them.

    Raises:
        MeshError: more than MOST_LAYERS layers.
    """
    breaks = np.asarray(breakpoints, dtype=np.float64)
    return _partition(tuple(float(x) for x in breaks), cell_length).copy()


@lru_cache(maxsize=64)
def _partition(breakpoints: tuple[float, ...], cell_length: CellLength) -> Positions:
    """Divide an interval as `structured_partition` does: the size of a model is asked for several times."""
    breaks = np.array(breakpoints)
    roughly = np.mean(1 / cell_length(np.linspace(breaks[0], breaks[-1], 1001))) * (breaks[-1] - breaks[0])
    if roughly > MOST_LAYERS:
        raise _too_many(cell_length.smallest, breaks, f"about {roughly:.2g}")
    wanted = cell_length.ending_at(breaks)
    layers = breaks
    for _ in range(_ROUNDS):
        segments = [_segment(float(a), float(b), wanted) for a, b in pairwise(breaks)]
        layers = np.concatenate([breaks[:1], *(segment[1:] for segment in segments)])
        jumps = _jumps(segments)
        if not jumps:
            break
        wanted = wanted.with_sources(jumps)
    return layers


def even_partition(breakpoints: npt.ArrayLike, count: int) -> Positions:
    """Divide an interval into equal layers, or nearly so when breakpoints are in the way.

    Args:
        breakpoints: Positions that become layer boundaries, at least two, increasing, in m.
        count: Wanted number of layers.

    Returns:
        `count` equal layers when every breakpoint is on one of their boundaries, otherwise the layers of
        `structured_partition` for the same length.
    """
    breaks = np.asarray(breakpoints, dtype=np.float64)
    low, high = breaks[0], breaks[-1]
    even = np.linspace(low, high, count + 1)
    distance = np.abs(even[:, None] - breaks[None, :]).min(axis=0)
    if np.all(distance <= 1e-12 * (high - low)):
        return even
    return structured_partition(breaks, CellLength(((float(high), float(high - low) / count),)))


def _segment(low: float, high: float, wanted: CellLength) -> Positions:
    """Layer boundaries from low to high."""
    wanted = wanted.between(low, high)
    position = low
    samples = [low]
    while position < high:
        position = min(high, position + float(wanted(position)) / _SAMPLES)
        samples.append(position)
        if len(samples) > _SAMPLES * MOST_LAYERS:
            raise _too_many(wanted.smallest, samples, "more")
    x = np.array(samples)
    density = 1 / wanted(x)
    layers = np.concatenate([[0.0], np.cumsum(np.diff(x) * (density[1:] + density[:-1]) / 2)])
    count = max(1, int(np.ceil(layers[-1] - _SLACK)))
    boundaries = np.interp(np.linspace(0, layers[-1], count + 1), layers, x)
    boundaries[[0, -1]] = low, high
    return np.asarray(boundaries, dtype=np.float64)


def _jumps(segments: list[Positions]) -> list[tuple[float, float]]:
    """Breakpoints whose two sides differ too much, with the smaller length."""
    jumps = []
    for left, right in pairwise(segments):
        lengths = (left[-1] - left[-2], right[1] - right[0])
        if max(lengths) > LARGEST_RATIO * min(lengths):
            jumps.append((float(right[0]), float(min(lengths))))
    return jumps


def _too_many(smallest: float, interval: npt.ArrayLike, layers: str) -> MeshError:
    ends = np.asarray(interval)
    return MeshError(
        "mesh sizes",
        found=f"a cell length of {smallest:.3g} m on {ends[-1] - ends[0]:.3g} m, which makes {layers} layers",
        expected=f"at most {MOST_LAYERS}",
        hint="Sizes are in m.",
    )
