"""Reader of files of several structures: a file, its text or tables become a scene, or one error with all faults.

Time step of a file of structures that gives none, by `step_rule`: from its loads, its modes and its contacts.

The highest frequency of interest f is one of the loads, five times a forcing frequency, or the second one of an elastic
structure, or of structures on their elastic joints, which are rigid beyond 10 f of the others. T_c = pi / sqrt(k b^2)
is half a period of a contact of stiffness k on the modes below 10 f, with the sum b^2 of the squares of their motions
there.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial
from itertools import chain
from math import ceil, inf, pi, sqrt
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components

from gapbeam.solver.case.case import case_to_toml
from gapbeam.solver.case.figure_table import figure_faults
from gapbeam.solver.case.reading.case_reader import SCENE, Places, SceneSource, checked_tables, plain_tables
from gapbeam.solver.case.reading.known_keys import candidates
from gapbeam.solver.case.reading.overrides import Overrides, pairs, unit_of_key
from gapbeam.solver.case.reading.toml_text import key_lines, parse, read_text
from gapbeam.solver.integrators.time_scheme import (
    RIGID_RATIO,
    STEPS_PER_CONTACT,
    STEPS_PER_PERIOD,
    is_rigid,
    step_of_period,
)
from gapbeam.solver.messages.errors import CaseError, Fault, UserError
from gapbeam.solver.messages.wording import LOG, near
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.feedback import Joint
from gapbeam.solver.scene.flow_force import FlowSpan
from gapbeam.solver.scene.recorded_places import as_recorded, places_of_figures
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_seat import seat
from gapbeam.solver.scene_file.scene_builder import built_scene, start_velocities
from gapbeam.solver.scene_file.scene_case import SceneCase
from gapbeam.solver.scene_file.scene_checks import FILES, scene_faults
from gapbeam.solver.scene_file.structure_tables import ElementBeam, ElementFrame
from gapbeam.solver.scene_file.unit_questions import crossings, load_questions, unit_questions
from gapbeam.solver.system.operators import Array

STEPS_OF_FLIGHT = 1000  # of a run without any frequency
APART = 1.0e-6  # of a frequency: bending in two planes has each twice
FREE = 1.0e-6  # of the highest frequency of a structure: a rigid motion
DEPTH = 0.01  # of the clearance: penetration at which a law is taken as linear


def with_step(
    case: SceneCase, scene: Scene, source: str, put: Callable[[list[Fault]], list[Fault]]
) -> tuple[SceneCase, str]:
    """Return a file with its step as a number, and its reason; "" where the file gives the step.

    Args:
        case: Contents of the file.
        scene: Its scene.
        source: Name of the file in messages.
        put: Returns faults with their places in the file.

    Raises:
        CaseError: A structure is too large for its modes.
    """
    if case.time.step != "auto":
        return case, ""
    if scene.is_large:
        found = f"a computed step, with {scene.size} DOFs"
        fault = Fault(
            ("time", "step"), found, "a structure whose modes are known", "reduce = { modes = 40 }, or a step"
        )
        raise CaseError(source, put([fault]))
    longest, reason = _longest(case, scene)
    frequencies = {load.forcing_frequency for load in case.load if not load.static and load.forcing_frequency}
    interval, end = case.output.history_interval, case.time.end
    span = interval or (1.0 / frequencies.pop() if len(frequencies) == 1 else end)
    step = min(span, end) / ceil(min(span, end) / longest)
    return case.model_copy(update={"time": case.time.model_copy(update={"step": step})}), reason


def _longest(case: SceneCase, scene: Scene) -> tuple[float, str]:
    """Return the longest step that will do, s, and its reason."""
    candidates = [found for load in case.load if (found := load.frequency_of_interest) is not None]
    candidates += [(1.0 / time, f"the {name}") for name, time in crossings(case).items()]
    for one in scene.structures:
        candidates += _second(one.modes[0], one.name or "a structure")
    frequency, origin = max(candidates, default=(0.0, ""))
    joined = [found for squares, words in _joined(scene) for found in _second(squares, words)]
    soft = [one for one in joined if not is_rigid(0.5 / one[0], frequency)]
    frequency, origin = max([(frequency, origin), *soft])
    longest = step_of_period(frequency)
    reason = f"{STEPS_PER_PERIOD} steps in a period of {frequency:.4g} Hz, {origin}"
    falls = case.start.state == "rest"  # what a seat carries acts all at once
    jumps = any((falls or not load.static) and load.frequency_of_interest is None for load in case.load)
    jumps = jumps or any(np.any(one.velocity) for one in case.structure)
    for number, contact in enumerate(scene.contacts):
        duration = _duration(scene, number, contact, frequency)
        if duration / STEPS_PER_CONTACT < longest and (jumps or not is_rigid(duration, frequency)):
            longest = duration / STEPS_PER_CONTACT
            reason = f"{STEPS_PER_CONTACT} steps in a contact of {duration:.3g} s at {contact.name}"
    if longest == inf:
        return case.time.end / STEPS_OF_FLIGHT, f"nothing vibrates: {STEPS_OF_FLIGHT} steps in the run"
    return longest, reason


def _second(squares: Array, words: str) -> list[tuple[float, str]]:
    """Return the second frequency, Hz, or the only one, that is not of a rigid motion, and what it is."""
    frequencies = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * pi)
    elastic = frequencies[frequencies > FREE * frequencies.max(initial=0.0)]
    distinct = elastic[np.diff(elastic, prepend=0.0) > APART * elastic][:2]
    number = ("the frequency", "the second frequency")[min(distinct.size, 2) - 1]
    return [(float(one), f"{number} of {words}") for one in distinct[-1:]]


def _joined(scene: Scene) -> Iterator[tuple[Array, str]]:
    """Yield the squares of the angular frequencies of structures that elastic joints hold or join, and their names."""
    springs = [(scene.rows([one.sense]), -one.D[0, 0]) for one in scene.feedbacks if isinstance(one, Joint)]
    if not springs:
        return
    owner = np.repeat(np.arange(len(scene.structures)), np.diff(scene.start))
    links = [np.unique(owner[np.any(rows != 0.0, axis=0)]) for rows, _ in springs]
    meets = np.array([np.isin(np.arange(len(scene.structures)), link) for link in links])
    _, groups = connected_components(meets.T.astype(int) @ meets.astype(int))
    K = np.diag(scene.squares) + sum(stiffness * rows.T @ rows for rows, stiffness in springs)
    for group in np.unique([groups[link[0]] for link in links if link.size]).astype(int):
        mine = groups[owner] == group
        names = [one.name or "a structure" for one, of in zip(scene.structures, groups, strict=True) if of == group]
        yield np.linalg.eigvalsh(K[np.ix_(mine, mine)]), f"{' and '.join(names)} on elastic joints"


def _duration(scene: Scene, number: int, contact: Contact, frequency: float) -> float:
    """Return T_c of a contact, s; infinite where its law has no stiffness at a depth that is known."""
    rows = scene.contact_rows[scene.first[number] : scene.first[number + 1]]
    slow = np.sqrt(np.maximum(scene.squares, 0.0)) <= (2.0 * pi * RIGID_RATIO * frequency or inf)
    mobility = float(np.linalg.norm(rows[:, slow], 2)) ** 2
    given = zip(contact.region.kind.names, contact.region.values, strict=True)
    depth = DEPTH * max((abs(float(value)) for name, value in given if name.startswith("clearance")), default=0.0)
    compared = depth or 1.0
    values = [float(np.ravel(one)[0]) for one in contact.law.values]
    forces = [float(contact.law.kind.spring.py_func(np.float64(x), *values)) for x in (compared, 2.0 * compared)]
    stiffness = (forces[1] - forces[0]) / compared
    if depth == 0.0 and not np.isclose(forces[1], 2.0 * forces[0]):  # no depth at which to take its slope
        return inf
    return pi / sqrt(stiffness * mobility) if stiffness * mobility > 0.0 else inf


NAME = "case"


@dataclass(frozen=True)
class ReadScene:
    """A file of several structures, and its scene.

    Attributes:
        case: Contents of the file.
        scene: Its scene.
        spans: Lengths of tubes in a flow, by name of the [[feedback]].
        name: Name of the file, without folder and suffix.
        reason: Reason for its step, where that is computed; empty: the file gives it.
        changes: Values of its scene that are none of its keys, by paths.
        finer: Function that reads the file with twice the modes and elements and finer meshes; None: it has no reduced
            structure, and no beam or frame that is marched in its modes.
    """

    case: SceneCase
    scene: Scene
    spans: Mapping[str, FlowSpan]
    name: str
    reason: str = ""
    changes: Mapping[str, Any] = MappingProxyType({})
    finer: Callable[[], ReadScene] | None = None

    @property
    def step(self) -> float:
        """The time step, given or computed, s."""
        assert self.case.time.step != "auto"
        return self.case.time.step

    def march(self) -> dict[str, Any]:
        """Return the arguments of the scene's run."""
        time, interval, shown = self.case.time, self.case.output.history_interval, self.case.output.fields_interval
        return {
            "step": self.step,
            "end": time.end,
            "start": self.start(),
            "every": 1 if interval is None else max(1, round(interval / self.step)),
            "shapes": None if shown is None else max(1, round(shown / self.step)),
            "scheme": time.scheme.made(),
            "gates": self.case.gates.model_dump(exclude_unset=True),
            "period": self.period,
            "title": self.case.title,
            "figures": self.case.figure,
            "sources": {f"{name}: {what}": source for name, what, source in self.sources},
            "random_loads": [one.generated(time.end, self.case.load) for one in self.case.load if one.noise],
            "wall_time": self.case.output.wall_time,
            "errors": self.case.output.errors != "none",
            "wear": None if self.case.wear is None else self.case.wear.model_dump(exclude={"depth_limit"}),
            "finer": None if self.finer is None else self._refined,
            "text": case_to_toml(self.case),
            "overrides": self.changes,
        }

    def _refined(self) -> tuple[Scene, SceneState]:
        """Return the scene with more modes and elements, and its start."""
        assert self.finer is not None
        other = self.finer()
        return other.scene, other.start()

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
            return self.seat()
        return self.scene.state(velocity=start_velocities(self.case, self.scene))

    def seat(self) -> SceneState:
        """Return the static equilibrium under the loads at t = 0, without steps, which may jump there.

        Raises:
            UserError: There is no seat.
            NotConverged: No seat was found.
        """
        steps = {f"{one.name}.value": 0.0 for one in self.case.load if one.settles}
        return seat(self.scene.with_(steps))


@dataclass(frozen=True)
class SceneFile:
    """The checked tables of a file of several structures, none of which is set up yet.

    Attributes:
        case: Contents of the file.
        changes: Values of its scene, by paths as in `Scene.with_`: {"gap.clearance": 1e-4}.
        places: Places of its keys.
    """

    case: SceneCase
    changes: Mapping[str, Any]
    places: Places

    def unit_of(self, key: str) -> str:
        """Return the SI unit of a key, or of a path of the scene such as "gap.clearance"; "" where none is known."""
        tables = self.case.model_dump(mode="json")
        named, is_path = _named(key, tables)
        if not is_path:
            return unit_of_key(named, tables, SceneCase)
        owner, _, value = key.partition(".")
        names = [one["name"] for one in tables["pair"] if fnmatchcase(one["name"], owner)]
        places = [f"pair.{name}.{part}.{value}" for name in names for part in ("region", "law")]
        return next(
            (unit for one in (*places, f"contact.law.{value}") if (unit := unit_of_key(one, tables, SceneCase))), ""
        )

    def read(self, finer: int = 1) -> ReadScene:
        """Return the file with its scene.

        Args:
            finer: As of `built_scene`.

        Raises:
            CaseError: A structure cannot be read, parts do not fit, or a path is of no value of the scene.
        """
        path = self.places.path
        for question in chain(unit_questions(self.case), load_questions(self.case)) if finer == 1 else ():
            LOG.warning("%s", question)
        scene, spans = built_scene(self.case, str(path), self.places.put_in_order, finer)
        faults = list[Fault]()
        for key, value in self.changes.items():
            try:
                scene = scene.with_({key: value})
            except UserError as error:
                words = " ".join(str(error).replace("; it has ", ", expected one of ").split())
                found, _, expected = words.removeprefix(f"{key!r}: ").partition("expected ")
                found = found.rstrip(",;: ") or f"nothing that is called {key.partition('.')[0]}"
                faults.append(Fault((), found, expected, where=f"`overrides=` {key}"))
        if faults:
            raise CaseError(str(path), faults)
        figures = as_recorded(scene, self.case.figure)
        faults = list(figure_faults(dict(enumerate(figures)), places_of_figures(scene), self.case.time.end))
        if faults:
            raise CaseError(str(path), self.places.put_in_order(faults))
        case = self.case.model_copy(update={"figure": type(self.case.figure)(figures)})
        case, reason = with_step(case, scene, str(path), self.places.put_in_order)
        meshed = () if scene.is_large else (ElementBeam, ElementFrame)
        is_coarse = any(one.reduce is not None or isinstance(one.model, meshed) for one in case.structure)
        again = partial(self.read, 2) if is_coarse else None
        return ReadScene(case, scene, spans, path.stem, reason, self.changes, again)


def read_scene(source: SceneSource, overrides: Overrides = ()) -> ReadScene:
    """Read a file of several structures, and make its scene.

    Args:
        source: Its path, its text or its tables; paths in these are relative to the file or the current folder.
        overrides: Keys to replace, as in a case: {"pair.gap.friction": 0.1}, or texts; also by the name of an
            entry alone, "shaker.amplitude", and paths of the scene as in `Scene.with_`, "gap.clearance".

    Raises:
        CaseError: The file has faults, or a structure cannot be read: all of it in the message.
    """
    return scene_file(source, overrides).read()


def scene_file(source: SceneSource, overrides: Overrides = ()) -> SceneFile:
    """Read and check the tables of a file of several structures; arguments as in `read_scene`.

    Raises:
        CaseError: The file has faults: all of them.
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
    faults, tables, changes = list[Fault](), dict[str, Any](), dict[str, Any]()
    for one in pairs(overrides):
        if isinstance(one, Fault):
            faults.append(one)
            continue
        key, value = one
        named, is_path = _named(key, data)
        (changes if is_path else tables)[named] = value
        if not is_path and "." in key and named.partition(".")[0] not in SceneCase.model_fields:
            faults.append(_of_no_entry(key, data))
    if faults:
        raise CaseError(str(path), faults)
    places = Places(path, data, key_lines(text), {}, SceneCase)
    case, places = checked_tables(data, places, scene_faults, tables, _find_files)
    return SceneFile(case, changes, places)


def _named(key: str, data: Mapping[str, Any]) -> tuple[str, bool]:
    """Return the key of a table that an override names, or its path of `Scene.with_`, and whether it is one.

    "shaker.amplitude" is a key of the load of that name, "gap.clearance" a path; other keys begin with a table.
    """
    owner, _, value = key.partition(".")
    if not value or owner in SceneCase.model_fields:
        return key, False
    found = False
    for array, entries in data.items():
        for number, entry in enumerate(entries if isinstance(entries, list) else ()):
            name = str(entry.get("name", "")) if isinstance(entry, dict) else ""
            known = candidates((array, number), data, SceneCase) if name == owner else ()
            if any(value.partition(".")[0] in model.model_fields for model in known):
                return f"{array}.{key}", False
            found = found or bool(name and fnmatchcase(name, owner))
    return key, found


def _of_no_entry(key: str, data: Mapping[str, Any]) -> Fault:
    """Return the fault of a key that begins neither with a table nor with the name of an entry."""
    owner, _, value = key.partition(".")
    tables = (one for one in data.values() if isinstance(one, list))
    entries = (one for table in tables for one in table if isinstance(one, dict))
    names = list(dict.fromkeys(str(one["name"]) for one in entries if one.get("name")))
    close = near(owner, [*names, *SceneCase.model_fields])
    return Fault(
        (),
        f"nothing that is called {owner}",
        f"a table, or the name of an entry{': ' if names else ''}{', '.join(names)}",
        f"did you mean `{close}.{value}`?" if close else "",
        where=f"`overrides=` {key}",
    )


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
