"""From a case file and its overrides to a `Case`, or to one error with every fault in it."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from solver.case import Case
from solver.case_consistency import contradictions
from solver.case_faults import CaseError, Fault, Key
from solver.case_keys import label
from solver.case_lines import key_lines, line_of
from solver.case_overrides import Overrides, override
from solver.case_syntax import parse, read_text
from solver.case_types import check_types
from solver.case_warnings import warnings
from solver.case_writer import case_to_toml, schema

__all__ = ["CaseError", "Fault", "case_to_toml", "read_case", "schema", "warnings"]


def read_case(path: Path | str, overrides: Overrides = ()) -> Case:
    """Read a case file.

    Args:
        path: The case file.
        overrides: Values that replace those of the file: {"support.clearance": 0.2e-3}, or texts
            "support.clearance=0.2e-3"; loads and probes by name or number, "load.shaker.amplitude=5".

    Returns:
        The case; the path of a mesh file, relative to the case file, is absolute in it.

    Raises:
        CaseError: The file cannot be read, or holds faults: all of them.
    """
    path = Path(path)
    text = read_text(path)
    data = parse(text, str(path))
    typed, faults = override(data, overrides)
    _find_mesh_file(data, path)
    tables, wrong = check_types(data)
    faults += [_placed(fault, data, path, text, typed) for fault in [*wrong, *contradictions(tables)]]
    if faults:
        raise CaseError(str(path), sorted(faults, key=_order))
    return Case.model_validate(data)


def _find_mesh_file(data: dict[str, Any], path: Path) -> None:
    """Make the path of a mesh file absolute."""
    mesh = data.get("mesh")
    if isinstance(mesh, dict) and isinstance(mesh.get("file"), str) and mesh["file"]:
        mesh["file"] = os.path.normpath(path.absolute().parent / mesh["file"])
