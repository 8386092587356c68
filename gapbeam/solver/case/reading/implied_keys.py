"""Keys of a case that its cross-sections imply: the width of a round one, and a mesh of the solid."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gapbeam.solver.schema.table import models_in, named, type_name
from gapbeam.solver.sections.section_choice import RECTANGLE, SectionChoice
from gapbeam.solver.sections.section_table import SectionTable

PROPER = 1.0  # m: a width that has no fault, where the thickness has one or is missing


def imply(data: dict[str, Any]) -> None:
    """Add to the tables of a case what its sections imply, where it is not given.

    A round section is as wide as it is thick. A slice in the bending plane is rectangular and equally wide everywhere:
    other sections have meshes of the solid.

    Args:
        data: The case as read.
    """
    beam, mesh = data.get("beam"), data.get("mesh", {})
    if not isinstance(beam, Mapping) or not isinstance(mesh, Mapping):
        return
    section = _chosen(beam)
    if section and section.round and "width" not in beam:
        size = beam.get("thickness")
        sound = isinstance(size, int | float) and not isinstance(size, bool) and size > 0.0
        data["beam"] = {**beam, "width": size if sound else PROPER}
    kinds = {type_name(one) for one in (section, *_others(data.get("segment"))) if one}
    if not {"dimension", "file"} & set(mesh) and kinds - {RECTANGLE.type}:
        data["mesh"] = {**mesh, "dimension": 3}


def _others(segments: object) -> Iterator[type[SectionTable] | None]:
    """Yield the sections of segments."""
    for one in segments if isinstance(segments, list | tuple) else ():
        yield _chosen(one) if isinstance(one, Mapping) else None


def _chosen(table: Mapping[str, Any]) -> type[SectionTable] | None:
    """Return the section of a table; None: it has none, or one that is not known."""
    section = named(table.get("section"))
    kind = section.get("type") if isinstance(section, Mapping) else None
    known = (one for one in models_in(SectionChoice) if issubclass(one, SectionTable))
    return next((one for one in known if type_name(one) == kind), None)
