"""The supports of a run, as its results describe them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class RunFace(NamedTuple):
    """A face of a support.

    Attributes:
        face: Its name.
        below: Whether it is a plane below the beam.
        gap: Distance from the undeformed beam, or from the beam in the middle of a hole, m.
        around: Whether it is a hole around the beam.
        offset: How far a hole lies above the axis of the beam, m.
    """

    face: str
    below: bool
    gap: float
    around: bool = False
    offset: float = 0.0


class RunSupport(NamedTuple):
    """A support.

    Attributes:
        name: Name in the case.
        start: Where it begins along the beam, m.
        end: Where it ends, m.
        clearance: m.
        faces: What the beam touches.
    """

    name: str
    start: float
    end: float
    clearance: float
    faces: tuple[RunFace, ...]


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
        faces = (RunFace("base", True, 0.0), RunFace("gland", False, clearance))
        return (RunSupport("support", 0.0, float(table.get("length", 0.0)), clearance, faces),)
    return tuple(
        RunSupport(
            str(one["name"]),
            float(one["from"]),
            float(one["to"]),
            float(one["clearance"]),
            tuple(map(_face, one["faces"])),
        )
        for one in described
    )


def _face(described: Mapping[str, Any]) -> RunFace:
    side, offset = described["side"], float(described.get("offset", 0.0))
    return RunFace(str(described["name"]), side == "below", float(described["gap"]), side == "around", offset)
