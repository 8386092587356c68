"""Keys that other keys of a case imply: the width of a round section, a mesh of the solid, a model with modes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gapbeam.solver.case.reading.known_keys import candidates
from gapbeam.solver.messages.errors import Key
from gapbeam.solver.sections.section_table import RectangularSection, SectionTable

PROPER = 1.0  # m: a width that has no fault, where the thickness has one or is missing


def imply(data: dict[str, Any]) -> None:
    """Add to the tables of a case what its sections and its damping imply, where it is not given.

    A round section is as wide as it is thick. A slice in the bending plane is rectangular and equally wide everywhere:
    other sections have meshes of the solid. A damping ratio of modes asks for a model that has modes.

    Args:
        data: The case as read.
    """
    damping = data.get("damping")
    if isinstance(damping, Mapping) and damping.get("ratio"):
        data.setdefault("model", {"type": "reduced"})
    beam, mesh = data.get("beam"), data.get("mesh", {})
    if not isinstance(beam, Mapping) or not isinstance(mesh, Mapping):
        return
    section = _section(("beam",), data)
    if section and section.round and "width" not in beam:
        size = beam.get("thickness")
        sound = isinstance(size, int | float) and not isinstance(size, bool) and size > 0.0
        data["beam"] = {**beam, "width": size if sound else PROPER}
    segments = data.get("segment")
    count = len(segments) if isinstance(segments, list | tuple) else 0
    sections = {section, *(_section(("segment", number), data) for number in range(count))}
    if not {"dimension", "file"} & set(mesh) and sections - {None, RectangularSection}:
        data["mesh"] = {**mesh, "dimension": 3}


def _section(key: Key, data: Mapping[str, Any]) -> type[SectionTable] | None:
    """Return the section of a table; None: it has none, or one that is not known."""
    found = [one for one in candidates((*key, "section"), data) if issubclass(one, SectionTable)]
    return found[0] if len(found) == 1 else None
