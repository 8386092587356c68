"""Reader of files of several structures: a file, its text or tables become a scene, or one error with all faults."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gapbeam.solver.case.reading.case_reader import SCENE, Places, SceneSource, checked_tables, plain_tables
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.case.reading.toml_text import key_lines, parse, read_text
from gapbeam.solver.scene.flow_force import FlowSpan
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_seat import seat
from gapbeam.solver.scene_file.scene_builder import built_scene, start_velocities
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.scene_checks import FILES, scene_faults

NAME = "case"


@dataclass(frozen=True)
class ReadScene:
    """A file of several structures, and its scene.

    Attributes:
        case: Contents of the file.
        scene: Its scene.
        spans: Lengths of tubes in a flow, by name of the [[feedback]].
        name: Of the file, without folder and suffix.
    """

    case: SceneCase
    scene: Scene
    spans: Mapping[str, FlowSpan]
    name: str

    def march(self) -> dict[str, Any]:
        """Return the arguments of the scene's run."""
        time, interval = self.case.time, self.case.output.history_interval
        return {
            "step": time.step,
            "end": time.end,
            "start": self.start(),
            "every": 1 if interval is None else max(1, round(interval / time.step)),
            "scheme": time.scheme.made(),
            "gates": self.case.gates.model_dump(exclude_unset=True),
            "period": self.period,
            "title": self.case.title,
            "figures": self.case.figure,
            "sources": {f"{name}: {what}": source for name, what, source in self.sources},
            "random_loads": [one.generated(time.end, self.case.load) for one in self.case.load if one.noise],
            "wear": None if self.case.wear is None else self.case.wear.model_dump(),
        }

    @property
    def sources(self) -> list[tuple[str, str, str]]:
        """Values given by hand with their source: the structure, the value in words, the source."""
        return [
            (one.name, f"two-phase damping {one.two_phase.ratio:g} beside {one.ratio:g}", one.two_phase.source)
            for one in self.case.structure
            if one.two_phase is not None
        ]

    @property
    def period(self) -> float | None:
        """Period of the forcing, s; None: there is none, or there are several."""
        found = {load.forcing_frequency for load in self.case.load if not load.static}
        return None if len(found) != 1 or None in found else 1.0 / found.pop()

    def start(self) -> SceneState:
        """Return the state at the start: at rest, moving as a whole, or seated.

        Raises:
            UserError: There is no seat.
            NotConverged: No seat was found.
        """
        if self.case.start.state == "seat":
            return seat(self.scene)
        return self.scene.state(velocity=start_velocities(self.case, self.scene))


def read_scene(source: SceneSource, overrides: Overrides = ()) -> ReadScene:
    """Read a file of several structures, and make its scene.

    Args:
        source: Its path, its text or its tables; paths in these are relative to the file or the current folder.
        overrides: Keys to replace, as in a case: {"pair.gap.friction": 0.1}, or texts.

    Raises:
        CaseError: The file has faults, or a structure cannot be read: all of it in the message.
    """
    text = ""
    if isinstance(source, Mapping):
        path, data = Path(NAME), {str(key): plain_tables(value) for key, value in source.items()}
    elif isinstance(source, str) and "\n" in source:
        path, text = Path(NAME), source
        data = parse(text, NAME)
    else:
        path = Path(source)
        text = read_text(path)
        data = parse(text, str(path))
    places = Places(path, data, key_lines(text), {}, SceneCase)
    case, places = checked_tables(data, places, scene_faults, overrides, _find_files)
    return ReadScene(case, *built_scene(case, str(path), places.put_in_order), path.stem)


def _find_files(data: dict[str, Any], path: Path) -> None:
    """Make the paths of matrices, nodes, modes and records absolute."""
    folder = path.absolute().parent

    def entries(key: str) -> list[Any]:
        found = data.get(key)
        return [one for one in found if isinstance(one, dict)] if isinstance(found, list) else []

    spectra = (one["spectrum"] for one in entries("load") if isinstance(one.get("spectrum"), dict))
    for table in (*(one.get("model") for one in entries(SCENE)), *entries("load"), *spectra, *entries("feedback")):
        for key in FILES if isinstance(table, dict) and table.get("type") != "mass" else ():
            if isinstance(table.get(key), str) and table[key]:
                table[key] = os.path.normpath(folder / table[key])
