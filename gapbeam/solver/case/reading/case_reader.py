"""Reader of case files: a file and its overrides become a `Case`, or one error with all faults."""

from __future__ import annotations

import copy
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

import numpy as np
from pydantic import BaseModel

from gapbeam.solver.case.case import Case, with_checksums
from gapbeam.solver.case.checks.all_checks import contradictions
from gapbeam.solver.case.model_choice import chosen_case
from gapbeam.solver.case.reading.known_keys import MOST_FAULTS, candidates, check_types, incomplete, label
from gapbeam.solver.case.reading.overrides import (
    Overrides,
    convert,
    in_file_units,
    looks_like_millimeters,
    override,
    slips,
    take_default_type,
)
from gapbeam.solver.case.reading.toml_text import beyond_bounds, key_lines, line_of, parse, read_text
from gapbeam.solver.messages.errors import CaseError, Fault, Key
from gapbeam.solver.messages.wording import LOG, printable
from gapbeam.solver.sections.section_table import RectangularSection, SectionTable

PROPER = 1.0  # m: a width that has no fault, where the thickness has one or is missing


def imply(data: dict[str, Any]) -> None:
    """Add keys to the tables of a case that its sections and its damping imply, where they are left out.

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


Root = TypeVar("Root", bound=BaseModel)
SCENE = "structure"
"""The table that files of several structures have, and no others."""
SceneSource = str | os.PathLike[str] | Mapping[str, object]


def is_scene(source: object) -> TypeGuard[SceneSource]:
    """Return whether a case as Python users have them, a path, text or tables, is of several structures."""
    if isinstance(source, Mapping):
        return SCENE in source
    if not isinstance(source, str | os.PathLike):
        return False
    text = str(source)
    if "\n" not in text:
        path = Path(source)
        if not path.is_file():
            return False
        text = path.read_text(encoding="utf-8", errors="replace")
    return any(line.replace(" ", "").startswith(f"[[{SCENE}") for line in text.splitlines()) or _inline(text)


def _inline(text: str) -> bool:
    return any(line.partition("=")[0].strip() == SCENE for line in text.split("[", 1)[0].splitlines() if "=" in line)


def read_case(path: Path | str, overrides: Overrides = ()) -> Case:
    """Read a case file.

    Args:
        path: The case file.
        overrides: Values that replace those of the file: {"support.clearance": 0.2e-3}, or texts
            "support.clearance=0.2e-3"; loads and probes by name or number, "load.shaker.amplitude=5".

    Returns:
        The case; the paths of mesh files and records, relative to the case file, are absolute in it.

    Raises:
        CaseError: The file cannot be read, or the case has faults: all of them.
    """
    text = read_text(Path(path))
    return _case(parse(text, str(path)), text, Path(path), overrides)


def read_case_text(text: str, overrides: Overrides = (), name: str = "case") -> Case:
    """Read the text of a case file; paths in it are relative to the current folder.

    Args:
        text: TOML.
        overrides: As in `read_case`.
        name: Name of the case in messages.

    Raises:
        CaseError: As in `read_case`.
    """
    return _case(parse(text, name), text, Path(name), overrides)


def read_case_tables(tables: Mapping[str, object], overrides: Overrides = (), name: str = "case") -> Case:
    """Read a case from its tables; paths in them are relative to the current folder.

    Args:
        tables: {"title": ..., "beam": {...}, "load": [{...}]}; numbers of NumPy, tuples and paths may stand in them.
        overrides: As in `read_case`.
        name: Name of the case in messages.

    Raises:
        CaseError: As in `read_case`.
    """
    return _case({str(key): plain_tables(value) for key, value in tables.items()}, "", Path(name), overrides)


def plain_tables(value: Any) -> Any:
    """Return a value as TOML would give it; other kinds stay for the checks of types."""
    if isinstance(value, Mapping):
        return {str(key): plain_tables(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [plain_tables(inner) for inner in value]
    if isinstance(value, Path):
        return str(value)
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def _case(data: dict[str, Any], text: str, path: Path, overrides: Overrides) -> Case:
    """Return the case of the tables of a file, or raise all of their faults."""
    refuse_scene(data, path)
    _refuse_endless(data, path)
    units, unclear = data.get("units"), convert(data)
    before = copy.deepcopy(data) if units else data
    typed, faults = override(data, overrides)
    for words in slips(before, data, typed, units):
        _say_once(words)
    _refuse_endless(data, path)
    _find_files(data, path)
    for name in data:
        take_default_type(data, (name,), Case)
    imply(data)
    tables, wrong = check_types(data)
    wrong += unclear or looks_like_millimeters(data, tables)
    places = Places(path, data, key_lines(text), typed)
    case = None
    if any(fault.key == ("units",) for fault in wrong):
        pass  # all other numbers are wrong with it
    elif "model" not in tables or tables["model"].decided:
        wrong += contradictions(tables, incomplete(wrong, data))
    elif not (wrong or faults):
        case, wrong = _chosen(data)
    if wrong:
        faults += places.put_in_order(in_file_units(wrong, units, data, typed))
    if faults:
        raise CaseError(str(path), faults[:MOST_FAULTS])
    return with_checksums(case or chosen_case(Case.model_validate(data)))


@cache
def _say_once(words: str) -> None:
    """Warn: a command reads its case more than once."""
    LOG.warning(words)


STUDIES = {"recorded": "library", "unknown": "identify", "free": "optimize", "variable": "uncertain"}
"""Commands that take a study of a case, by a table that their files have."""


def refuse_study(data: Mapping[str, Any], path: Path, root: type[BaseModel], needed: str) -> None:
    """Refuse a study of a case where another kind of file is needed.

    Args:
        data: Its tables as read.
        path: The file.
        root: Model of the needed file.
        needed: Such a file in words.

    Raises:
        CaseError: The file is such a study.
    """
    mark = next((name for name in STUDIES if name in data), "")
    if "case" in data and mark and mark not in root.model_fields:
        hint = f"gapbeam {STUDIES[mark]} {path.name}"
        fault = Fault(
            (mark,), f"a study for gapbeam {STUDIES[mark]}, with `{mark}`", needed, hint, where=f"{path}: {mark}"
        )
        raise CaseError(str(path), [fault])


def refuse_scene(data: Mapping[str, Any], path: Path) -> None:
    """Refuse a file with [[structure]], which makes a scene, or a study, where a case with one beam is needed.

    Raises:
        CaseError: The file makes a scene, or is a study of a case.
    """
    refuse_study(data, path, Case, "a case with [beam]")
    if SCENE in data:
        fault = Fault(
            (SCENE,),
            f"a file with [[{SCENE}]], which is a scene of several structures",
            "a case with [beam]",
            "of such files there are gapbeam check, with frequencies, run, sweep, atlas, uncertain, library, "
            "optimize, life and fmu",
            where=f"{path}: [[{SCENE}]]",
        )
        raise CaseError(str(path), [fault])


def _chosen(data: Mapping[str, Any]) -> tuple[Case | None, list[Fault]]:
    """Return the case with the model that "auto" stands for, or the faults of a case that none fits."""
    try:
        return chosen_case(Case.model_validate(data)), []
    except CaseError as error:
        return None, list(error.faults)


def read_tables(
    path: Path | str, root: type[Root], check: Callable[[Mapping[str, Any]], Sequence[Fault]] = lambda _: ()
) -> Root:
    """Read another file of tables, with faults reported as those of case files are.

    Args:
        path: The file.
        root: Model of the whole file.
        check: Returns the contradictions in its tables as far as they are intact, arrays of tables as
            {number: entry}.

    Raises:
        CaseError: The file cannot be read or has faults: all of them.
    """
    path = Path(path)
    text = read_text(path)
    data, places = parse(text, str(path)), Places(path, {}, key_lines(text), {}, root)
    itself = [name for name in ("beam", SCENE) if name in data]
    needed = [name for name, one in root.model_fields.items() if one.is_required() and name != "case"]
    expected = f"a study of a case: a file with `case`{''.join(f', `{name}`' for name in needed)}"
    if "case" in root.model_fields and "case" not in data and itself:
        hint = f'write another file, with case = "{path.name}"'
        fault = Fault(("case",), f"a case itself, with `{itself[0]}`", expected, hint)
        raise CaseError(str(path), places.put_in_order([fault]))
    refuse_study(data, path, root, expected)
    tables: Root = checked_tables(data, places, check)[0]
    return tables


def checked_tables(
    data: dict[str, Any],
    places: Places,
    check: Callable[[Mapping[str, Any]], Sequence[Fault]],
    overrides: Overrides = (),
    prepare: Callable[[dict[str, Any], Path], None] = lambda _data, _path: None,
) -> tuple[Any, Places]:
    """Return the model of a file's tables, and the places of its keys.

    Args:
        data: Its tables as read.
        places: File, lines and model of the whole file.
        check: As in `read_tables`.
        overrides: As in `read_case`.
        prepare: Makes paths of files absolute.

    Raises:
        CaseError: There are faults: all of them.
    """
    typed, faults = override(data, overrides, places.root)
    _refuse_endless(data, places.path)
    prepare(data, places.path)
    tables, wrong = check_types(data, places.root)
    missing = incomplete(wrong, data, places.root)
    wrong += [fault for fault in check(tables) if not missing & set(fault.lacks)]
    placed = replace(places, data=data, typed=typed)
    faults += placed.put_in_order(wrong)
    if faults:
        raise CaseError(str(places.path), faults[:MOST_FAULTS])
    return places.root.model_validate(data), placed


def _refuse_endless(data: Mapping[str, Any], path: Path) -> None:
    """Refuse a file that would take long to check."""
    faults = beyond_bounds(data, str(path))
    if faults:
        raise CaseError(str(path), faults[:MOST_FAULTS])


def _find_files(data: dict[str, Any], path: Path) -> None:
    """Make the paths of mesh files, records, spectra and the state at the start absolute."""
    loads = data.get("load")
    loads = [load for load in loads if isinstance(load, dict)] if isinstance(loads, list) else []
    for table in (data.get("mesh"), *loads, *(load.get("spectrum") for load in loads)):
        if isinstance(table, dict) and isinstance(table.get("file"), str) and table["file"]:
            table["file"] = os.path.normpath(path.absolute().parent / table["file"])
    analysis = data.get("analysis")
    if isinstance(analysis, dict) and isinstance(analysis.get("state"), str) and analysis["state"]:
        analysis["state"] = os.path.normpath(path.absolute().parent / analysis["state"])


@dataclass(frozen=True)
class Places:
    """Places of the keys of a case: lines of the file, or the command line."""

    path: Path
    data: dict[str, Any]
    lines: dict[Key, int]
    typed: dict[Key, str]
    root: type[BaseModel] = Case

    def put_in_order(self, faults: Sequence[Fault]) -> list[Fault]:
        """Return faults with their places, those from the command line first."""
        return sorted((self.put(fault) for fault in faults), key=self.order)

    def order(self, fault: Fault) -> int:
        """Return the line of a fault, 0 for one from the command line."""
        return 0 if self._typed(fault.key) else line_of(fault.key, self.lines) or 0

    def put(self, fault: Fault) -> Fault:
        """Return the fault with its place in words, and with every override that takes part in it."""
        own = self._typed(fault.key)
        line = line_of(fault.key, self.lines)
        beside = "" if own else self._needs_type(fault.key)
        if beside:
            named = ".".join(map(str, fault.key))
            fault = replace(fault, hint=re.sub(r'^add type = "(.*)"$', rf"add `overrides=` {named}=\1", fault.hint))
        if own:
            place = f"`overrides=` {printable(own)}{self._within(fault.key, own)}"
        elif beside:
            place = f"`overrides=` {printable(beside)}: {label(fault.key, self.data, self.root)}"
        else:
            place = f"{self.path}{f':{line}' if line else ''}: {label(fault.key, self.data, self.root)}"
        others = dict.fromkeys(self._typed(key) for key in fault.related)
        places = [place, *(f"`overrides=` {printable(name)}" for name in others if name and name != own)]
        return replace(fault, where=" with ".join(places))

    def _within(self, key: Key, own: str) -> str:
        """Return the rest of a key behind an override of a table around it, in words, or ""."""
        whole = next(other for other, name in self.typed.items() if name == own)
        rest = key[len(whole) :] if key[: len(whole)] == whole else ()
        return f": {'.'.join(printable(part) for part in rest)}" if rest else ""

    def _needs_type(self, key: Key) -> str:
        """Return the override that made a table whose type is missing."""
        made = key[-1:] == ("type",) and key[:-1] not in self.lines
        return next((name for other, name in self.typed.items() if made and other[: len(key) - 1] == key[:-1]), "")

    def _typed(self, key: Key) -> str:
        """Return the override of a key, of a table around it, or of a key in it where the file lacks it."""
        around = [self.typed[key[:size]] for size in range(len(key), 0, -1) if key[:size] in self.typed]
        below = [name for other, name in self.typed.items() if key not in self.lines and other[: len(key)] == key]
        return next(iter([*around, *below]), "")
