"""Questions about values of a file of several structures that look like another unit, and about loads, as of cases."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np

from gapbeam.solver.case.checks.usual_ranges import (
    MUCH_PLAY,
    USUAL,
    asked,
    damping_questions,
    load_warnings,
    material_questions,
    play_question,
    shape_questions,
    step_warnings,
)
from gapbeam.solver.messages.wording import exceeds
from gapbeam.solver.scene_file.scene_case import SceneCase


def unit_questions(case: SceneCase) -> Iterator[str]:
    """Yield values that look like another unit, one line each."""
    thickness = dict[str, float]()
    for number, body in enumerate(case.structure, 1):
        place = f'[[structure]] number {number} (name "{body.name}")'
        yield from _of_profile(f"{place} model", body.model)
        yield from damping_questions(f"{place} ratio", body.ratio)
        thickness[body.name] = getattr(body.model, "thickness", None) or 0.0
    for number, member in enumerate(case.member, 1):
        yield from _of_profile(f"[[member]] number {number}", member)
    turning = {f"{one.structure}.{one.name}" for one in case.point if one.rotation or one.about is not None}
    for number, pair in enumerate(case.pair, 1):
        size = max((thickness.get(one.partition(".")[0], 0.0) for one in pair.between), default=0.0)
        play = getattr(pair.region, "clearance", None)
        if play is None or size == 0.0 or turning & set(pair.between):
            continue
        if exceeds(abs(play), MUCH_PLAY * size):
            yield play_question(f'[[pair]] number {number} (name "{pair.name}") region', play, size)


def load_questions(case: SceneCase) -> Iterator[str]:
    """Yield loads that do nothing, do not suit the run, or that a given step is too long for, one line each."""
    end, step = case.time.end, case.time.step
    yield from load_warnings(case.load, lambda load: chain(load.unusual_values(), load.unusual_in_run(end)))
    if step != "auto":
        yield from step_warnings(case.load, step, crossings(case))


def crossings(case: SceneCase) -> dict[str, float]:
    """Return the times in which points move along beams and frames, s, by what they are called."""
    models, found = {one.name: one.model for one in case.structure}, dict[str, float]()
    for point in case.point:
        model = models.get(point.structure)
        route = getattr(model, "route", None)
        length = _legs(route).sum() if route is not None else getattr(model, "length", None)
        if point.speed and length:
            found[f"crossing of {point.structure} by {point.name}"] = float(length / abs(point.speed))
    return found


def _legs(route: Any) -> np.ndarray:
    """Return the lengths of the legs of a route, m."""
    return np.asarray(np.linalg.norm(np.diff(np.asarray(route), axis=0), axis=1))


def _of_profile(place: str, one: Any) -> Iterator[str]:
    """Ask about lengths and materials of a model or a branch; those that it has."""
    length, route = getattr(one, "length", None), getattr(one, "route", None)
    if route is not None:
        length = float(_legs(route).max())
    sizes = {"length": length, "thickness": getattr(one, "thickness", None), "width": getattr(one, "width", None)}
    material = getattr(one, "material", None)
    materials = [("material", material)] if material is not None else []
    materials += [(f"materials number {k}", each) for k, each in enumerate(getattr(one, "materials", ()), 1)]
    for usual in USUAL:
        if usual.table == "beam" and (size := sizes[usual.key]) is not None:
            words = f"{place} longest leg of route, as" if usual.key == "length" and route is not None else place
            yield from asked(words, usual, size)
        for name, each in materials if usual.table == "material" else ():
            if (value := getattr(each, usual.key)) is not None:
                yield from asked(f"{place} {name}", usual, value)
    for name, each in materials:
        if each.young_modulus is not None:
            yield from material_questions(f"{place} {name}", each.young_modulus, each.density)
    if sizes["thickness"] is not None and length is not None and route is None:
        yield from shape_questions(place, length, sizes["thickness"], sizes["width"] or sizes["thickness"])
