"""[[feedback]] as forces of a scene: spans along beams and points, and faults of the key that is wrong."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from math import pi
from typing import Any

import numpy as np

from gapbeam.solver.messages.errors import Key, UserError
from gapbeam.solver.scene.beam_structure import ELEMENTS
from gapbeam.solver.scene.feedback import Feedback
from gapbeam.solver.scene.flow_force import MOTIONS, FlowSpan, quasi_steady, span
from gapbeam.solver.scene.lagged_force import aerodynamic_lag, measured, unsteady
from gapbeam.solver.scene.structure import Structure, StructurePoint
from gapbeam.solver.scene_file.feedback_tables import AnyFeedback, Controller, MeasuredFlow
from gapbeam.solver.scene_file.structure_tables import BodyTable, ElementBeam, RigidBar
from gapbeam.solver.system.operators import Array

FEWEST = 11
"""Stations of a span at least."""
KINDS: dict[str, Callable[..., Feedback]] = {
    "quasi-steady": quasi_steady, "unsteady": unsteady, "measured": measured, "aerodynamic-lag": aerodynamic_lag,
    "controller": Feedback,
}  # fmt: skip
LAW_OF = {"quasi-steady": "slope", "unsteady": "stiffness", "measured": "file", "aerodynamic-lag": "steady"}
"""The key that says of how many motions a law is, by kind of force."""
CALLED = re.compile(r"(?:flow|feedback) [^:]*: (?:found )?(\w+)")


def stations(number: int, table: AnyFeedback, body: BodyTable) -> dict[str, float]:
    """Return the stations of a span along a beam, places by a name that no point of the file has; none for others."""
    along, model = getattr(table, "span", None), body.model
    if along is None or along.structure != body.name or not isinstance(model, ElementBeam | RigidBar):
        return {}
    low, high = vars(along)["from"] or 0.0, vars(along)["to"] or model.length
    elements = (model.elements if isinstance(model, ElementBeam) else None) or ELEMENTS
    count = max(FEWEST, round(elements * (high - low) / model.length) + 1)
    return {f"feedback {number}: {i}": float(x) for i, x in enumerate(np.linspace(low, high, count))}


def flow_span(number: int, table: AnyFeedback, structure: Structure, body: BodyTable) -> FlowSpan:
    """Return the span of a table that has one.

    Raises:
        UserError: Its points do not fit.
    """
    along: Any = getattr(table, "span")  # noqa: B009 - of most tables
    places = stations(number, table, body) or dict(zip(along.points, along.at, strict=True))
    return span(structure, places, _profile(along.velocity), _profile(along.density))


def _profile(rows: Sequence[tuple[float, float]] | None) -> float | Callable[[Array], Array]:
    if rows is None:
        return 1.0
    places, shares = np.array(rows).T
    return lambda x: np.interp(x, places, shares)


def made_feedback(
    table: AnyFeedback, where: FlowSpan | None, points: Mapping[str, Sequence[StructurePoint]]
) -> Feedback | None:
    """Return the force of a table, whose keys are the arguments of its kind in Python; None: it makes none.

    Args:
        table: The table; its frequencies are in Hz.
        where: Its span.
        points: Its points by key.

    Raises:
        UserError: A value does not fit.
    """
    if table.type not in KINDS:
        return None
    given: dict[str, Any] = {key: value for key, value in table if key not in ("type", "span")}
    given |= {key: list(places) for key, places in points.items() if places}
    given |= {key: 2.0 * pi * np.array(given[key]) for key in ("frequency", "frequencies") if key in given}
    place = given.pop("point", None), given.pop("points", None)
    if isinstance(table, Controller):
        return Feedback(**given | {"D": table.D or None})
    if isinstance(table, MeasuredFlow):
        given["table"] = given.pop("file")
    return KINDS[table.type](where or place[1] or place[0][0], **given)


def faulty_key(number: int, table: AnyFeedback, error: UserError) -> Key:
    """Return the key that an error is about."""
    argument, key = getattr(error, "argument", ""), ("feedback", number)
    called = CALLED.match(str(error))
    for name in ({MOTIONS: LAW_OF.get(table.type, ""), "table": "file"}.get(argument, argument), called and called[1]):
        if name in type(table).model_fields:
            return (*key, str(name))
    return (*key, "span") if getattr(table, "span", None) is not None else key
