"""Marks where joints hold the beam, masses sit on it and fluids surround it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

_JOINTS = {"clamped": "s", "pinned": "^", "guided": "D", "elastic": "P"}
_MASS = "o"


@dataclass(frozen=True)
class Mark:
    """A joint, a mass or a fluid in a picture.

    Attributes:
        name: Name in the case.
        x: Place on the beam axis, or where a fluid begins, m.
        symbol: Marker of matplotlib; empty for a fluid.
        end: Where a fluid ends, m; None for the others.
    """

    name: str
    x: float
    symbol: str
    end: float | None = None


def marks_of(case: Mapping[str, Any], start: float) -> Iterator[Mark]:
    """Yield the joints, masses and fluids of a case, with the x of the mesh.

    Args:
        case: The case as run.
        start: x of the mesh at the end of the beam where x is 0 in the case, m.
    """
    for joint in case.get("joint", []):
        yield Mark(str(joint["name"]), start + float(joint["point"]), _JOINTS.get(joint["type"], "s"))
    for mass in case.get("mass", []):
        yield Mark(str(mass["name"]), start + float(mass["point"]), _MASS)
    for fluid in case.get("fluid", []):
        yield Mark(str(fluid["name"]), start + float(fluid["from"]), "", start + float(fluid["to"]))
