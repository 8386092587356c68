"""The supports of a run, as its results describe them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class RunPlane(NamedTuple):
    """A plane of a support: the name of its face, whether it stands below the beam, and its distance from it, m."""

    face: str
    below: bool
    gap: float


class RunSupport(NamedTuple):
    """A support.

    Attributes:
        name: Name in the case.
        start: Where it begins along the beam, m.
        end: Where it ends, m.
        clearance: m.
        planes: What the beam touches.
    """

    name: str
    start: float
    end: float
    clearance: float
    planes: tuple[RunPlane, ...]


def supports_of(summary: Mapping[str, Any], case: Mapping[str, Any]) -> tuple[RunSupport, ...]:
    """Return the supports of a run in their order along the beam.

    Args:
        summary: The summary of the run; runs of earlier versions do not describe their supports there.
        case: The case as run, whose table [support] stands in for it.
    """
    described = (summary.get("model") or {}).get("supports")
    if described is None:
        table = case.get("support") or {}
        clearance = float(table.get("clearance", 0.0))
        planes = (RunPlane("base", True, 0.0), RunPlane("gland", False, clearance))
        return (RunSupport("support", 0.0, float(table.get("length", 0.0)), clearance, planes),)
    return tuple(
        RunSupport(
            str(one["name"]),
            float(one["from"]),
            float(one["to"]),
            float(one["clearance"]),
            tuple(RunPlane(str(face["name"]), face["side"] == "below", float(face["gap"])) for face in one["faces"]),
        )
        for one in described
    )
