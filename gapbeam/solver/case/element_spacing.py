"""Graded beam elements: short in supports, and longer away from them, up to a share of the bending waves.

    h(x) = length of the support / 5 within a support, and at most ln(1.25) |x - x_end| more away from it, where two
    neighbors differ by a factor of 1.25; at most 1/8 of the bending wavelength of the highest frequency of interest

Supports and segments begin and end at nodes. Elements of a number that is given are shared out by 1 / h.
"""

from __future__ import annotations

from itertools import pairwise
from math import ceil

import numpy as np
from numpy.typing import NDArray

from gapbeam.meshes.sizing.mesh_size import CellLength
from gapbeam.solver.case.bending_waves import bending_wavelength
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import overhang_frequency
from gapbeam.solver.case.model_table import ELEMENTS_IN_SUPPORT, SPACING_OF_WAVE, BeamModel

SAMPLES = 64  # of h in each part of the beam between two ends of supports or segments
ALMOST = 1.0e-9  # of an element: round-off

Array = NDArray[np.float64]


def highest_frequency(case: Case) -> float:
    """Return the highest frequency of interest, Hz."""
    interest = [one[0] for one in (load.frequency_of_interest for load in case.load) if one is not None]
    return case.time.frequency or max([overhang_frequency(case, 2), *interest])


def graded_count(case: Case) -> int:
    """Return the number of graded elements of a case."""
    _, wanted = _parts(case)
    return sum(max(1, ceil(share - ALMOST)) for share in wanted)


def graded_places(case: Case, elements: int) -> Array:
    """Return the nodes of so many graded elements, (elements + 1,), m.

    Where there are fewer than parts of the beam between ends of supports and segments, those of supports are passed
    over, and each segment has one element at least.
    """
    breaks, wanted = _parts(case)
    if elements < len(wanted):
        kept = [0.0, *case.profile.steps, case.beam.length]
        wanted = np.array([wanted[(breaks[:-1] >= start) & (breaks[:-1] < end)].sum() for start, end in pairwise(kept)])
        breaks = np.array(kept)
    counts = _shared_out(wanted, max(elements, len(wanted)))
    length = _element_length(case)
    places = [np.array([breaks[0]])]
    for (start, end), count in zip(pairwise(breaks), counts, strict=True):
        x = np.linspace(start, end, SAMPLES * max(int(count), 1) + 1)
        passed = _passed(length, x)
        inner = np.interp(np.linspace(0.0, passed[-1], int(count) + 1)[1:-1], passed, x)
        places.append(np.concatenate([inner, [end]]))
    return np.concatenate(places)


def longest_element(case: Case, model: BeamModel) -> float:
    """Return the length of the longest element of a beam model, m."""
    if model.graded:
        return float(np.diff(graded_places(case, model.elements)).max())
    return case.beam.length / model.elements


def _parts(case: Case) -> tuple[Array, Array]:
    """Return the ends of supports and segments, (k + 1,), m, and the elements between, (k,)."""
    total = case.beam.length
    ends = [place for one in case.layout.supports for place in (one.start, one.end)]
    inside = {float(place) for place in (*ends, *case.profile.steps) if 0.0 < place < total}
    breaks = np.array([0.0, *sorted(inside), total])
    length = _element_length(case)
    wanted = [_passed(length, np.linspace(start, end, SAMPLES + 1))[-1] for start, end in pairwise(breaks)]
    return breaks, np.array(wanted)


def _element_length(case: Case) -> CellLength:
    """Return h."""
    profile, supports = case.profile, case.layout.supports
    highest = highest_frequency(case)
    places = {place for one in supports for place in (one.start, one.end)}
    breaks = sorted({place for place in (*places, *profile.steps) if 0.0 < place < case.beam.length})
    regions, sources = list[tuple[float, float]](), set[tuple[float, float]]()
    for start, end in pairwise([0.0, *breaks, case.beam.length]):
        middle = 0.5 * (start + end)
        within = [one.end - one.start for one in supports if one.start <= middle <= one.end]
        free = SPACING_OF_WAVE * bending_wavelength(profile.at(middle), highest)
        size = min([free, *(span / ELEMENTS_IN_SUPPORT for span in within)])
        regions.append((end, size))
        sources |= {(start, size), (end, size)} if within else set()
    return CellLength(tuple(regions), tuple(sorted(sources)))


def _passed(length: CellLength, x: Array) -> Array:
    """Return the number of elements from the first place to each, by the middles between, (k,)."""
    return np.concatenate([[0.0], np.cumsum(np.diff(x) / length(0.5 * (x[1:] + x[:-1])))])


def _shared_out(wanted: Array, count: int) -> NDArray[np.int64]:
    """Return whole shares of a count, one at least each, about as large as those wanted."""
    free = (count - len(wanted)) * wanted / wanted.sum()
    shares = np.floor(free).astype(np.int64)
    left = count - len(wanted) - int(shares.sum())
    shares[np.argsort(shares - free, kind="stable")[:left]] += 1
    return np.asarray(shares + 1)
