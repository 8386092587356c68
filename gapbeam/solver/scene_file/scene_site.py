"""The site of a scene: structures and points of a file that are built so far, with the faults found on the way."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.scene.flow_force import FlowSpan
from gapbeam.solver.scene.moving_point import MovingPoint
from gapbeam.solver.scene.structure import Structure, StructurePoint
from gapbeam.solver.scene.structure_files import ImportedModel, PlacedPoint
from gapbeam.solver.scene_file.placed_bodies import PlacedBody
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.structure_tables import BodyTable, MemberTable

STATION = re.compile(r"(feedback|load|pair|point) \d+: ")  # no name of a point in a file has a blank
SPREAD = re.compile(r"(feedback|load|point) \d+: ")  # these get no static responses
HINT = r"(?:; (?P<hint>.*))?$"
MESSAGES = (
    r"(?:.*?: )?found (?P<found>.*?),? expected (?P<expected>.*?)" + HINT,
    r"(?:.*?: )?expected (?P<expected>.*?)[,;] found (?P<found>.*?)" + HINT,
    r"(?P<found>.*?)(?:[,;:] expected (?P<expected>.*?)|; (?P<known>(?:it has|its) .*?))?" + HINT,
)


@dataclass
class Site:
    """Structures and points built so far, with their faults."""

    case: SceneCase
    bodies: dict[str, Structure] = field(default_factory=dict)
    models: dict[str, ImportedModel] = field(default_factory=dict)
    extents: dict[str, PlacedBody] = field(default_factory=dict)
    lengths: dict[str, float] = field(default_factory=dict)
    nearest: dict[str, dict[str, Any]] = field(default_factory=dict)
    places: dict[str, PlacedPoint] = field(default_factory=dict)
    moving: dict[str, MovingPoint] = field(default_factory=dict)
    spans: dict[str, FlowSpan] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)

    def members(self, table: BodyTable) -> list[MemberTable]:
        """Return the branches of a frame."""
        return [one for one in self.case.member if one.structure == table.name]

    def point(self, key: Key, place: str, may_move: bool = False) -> StructurePoint | None:
        """Return a point; None, with a fault, where its structure has none of that name, or it moves and may not."""
        if may_move and place in self.moving:
            return self.moving[place]
        if place in self.moving:
            self.faults.append(Fault(key, f'"{place}", which moves', "a point that stays: pairs and forces may move"))
            return None
        owner, _, name = place.partition(".")
        structure = self.bodies.get(owner)
        if structure is None:
            return None
        if name not in structure.points:
            known = ", ".join(f"{owner}.{one}" for one in structure.points if not STATION.match(one)) or "none"
            self.faults.append(Fault(key, f'"{place}", which is no point', f"one of {known}"))
            return None
        return structure[name]


def fault_of(key: Key, error: Exception) -> Fault:
    """Return an error as a fault: what it found, what it expected and what to try."""
    words = " ".join(str(error).split("\n"))
    parts = next(found.groupdict() for form in MESSAGES if (found := re.match(form, words)) is not None)
    expected = parts["expected"] or parts.get("known") or "values that go together"
    return Fault(key, parts["found"], expected, parts["hint"] or "")
