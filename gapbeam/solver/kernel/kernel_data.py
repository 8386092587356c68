"""A scene as one block of numbers for the C kernel `kernel.c`, which marches it where there is no Python.

The kernel knows modes, half planes (a slot is two), Kelvin-Voigt and Hunt-Crossley contact, and the midpoint rule. It
finds everything in the block: sizes, arrays, parameters, state; then work, for which the block only says how much.

Functional Mock-up Units of FMI 3.0 for co-simulation: a scene as data, the kernel as library and as source.

Source: Modelica Association, Functional Mock-up Interface Specification 3.0, sections 2.4 and 2.5.
"""

from __future__ import annotations

import base64
import hashlib
import re
import zipfile
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from itertools import accumulate
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.convex_region import HalfPlane, Slot
from gapbeam.solver.scene.feedback import Joint
from gapbeam.solver.scene.force_law import LawKind
from gapbeam.solver.scene.linear_scheme import MIDPOINT
from gapbeam.solver.scene.recorded_places import turning_places
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_load import Load, sine
from gapbeam.solver.scene.shipped_laws import HuntCrossley, KelvinVoigt
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.system.operators import Array

HEAD = 15  # sizes before the arrays, as in the first enumeration of kernel.c
MARK, OWN, NUMBERS, PER_LOAD = 1.0, 12, 7, 7
LINEAR = (0, 4)  # kinds of law, see `_exponent`


@dataclass(frozen=True)
class KernelVariable:
    """A number of the block that a user of the kernel sets or reads.

    Attributes:
        name: Such as "tip.displacement" or "left.clearance".
        place: Place in the block.
        role: Input, parameter or output.
        unit: SI.
        start: Its value at the start.
        meaning: Meaning, in a sentence.
    """

    name: str
    place: int
    role: Literal["input", "parameter", "output"]
    unit: str
    start: float
    meaning: str


@dataclass(frozen=True)
class KernelData:
    """A scene for the kernel.

    Attributes:
        block: Sizes, arrays, parameters and state.
        size: Size of the block with its work.
        step: s.
        begin: Time of the state, s.
        modes: Number of modes.
        variables: Variables that may be set and read.
    """

    block: Array
    size: int
    step: float
    begin: float
    modes: int
    variables: tuple[KernelVariable, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the data with the kernel for a browser, for a page."""
        kernel = files("gapbeam.solver.kernel").joinpath("binaries", "kernel.wasm").read_bytes()
        return {
            "block": base64.b64encode(self.block.astype("<f8").tobytes()).decode(),
            "kernel": base64.b64encode(kernel).decode(),
            "size": self.size, "step": self.step, "begin": self.begin, "modes": self.modes,
            "variables": [vars(one) for one in self.variables],
        }  # fmt: skip


def kernel_data(
    scene: Scene, step: float, start: SceneState | None = None, inputs: Sequence[str] = (), faces: Sequence[str] = ()
) -> KernelData:
    """Return a scene as data of the kernel.

    Args:
        scene: The scene.
        step: s.
        start: State at the start; default at rest, undeformed.
        inputs: Names of loads whose own function of time is left out, since an input takes its place.
        faces: Names of faces: contacts called "<face> 1", "<face> 2", ... share clearance, stiffness and force.

    Raises:
        UserError: The scene has what the kernel cannot march, all of it in the message; or the step is not above 0.
    """
    if not (np.isfinite(step) and step > 0.0):
        raise UserError(f"fmu: found step {step!r} s, expected a time above 0")
    refused = list(_refusals(scene, inputs))
    if refused:
        raise UserError("fmu: a unit cannot hold " + "; ".join(refused))
    state, linear = start or scene.state(), scene.condensed(step, MIDPOINT)
    contacts, groups, labels = _contacts(scene, faces)
    rows, place = _half_planes(scene, scene.places(state.q, state.t)[:, 0], state.F[:, 0])
    points = [
        (f"{name}{k or ''}", row)
        for name, point in scene.point_names.items()
        for k, row in enumerate(scene.rows_at(point))
    ]
    watch = np.array([row for _, row in points]).reshape(len(points), scene.size)
    own = np.zeros((len(scene.loads) + len(points), PER_LOAD))
    for numbers, load in zip(own, scene.loads, strict=False):
        numbers[:5] = 0.0 if load.name in inputs else _wave(load)
    patterns = np.vstack([scene.load_columns.T[: len(scene.loads)], watch])
    full = len(linear.damping) > 1
    parts: tuple[Any, ...] = (
        linear.weight, linear.squares, linear.inverse if full else [], rows, patterns, watch, contacts, own, groups,
        state.q, state.v, *place,
    )  # fmt: skip
    flat = [np.ravel(np.asarray(part, dtype=float)) for part in parts]
    at = list(accumulate((len(part) for part in flat), initial=HEAD))
    n, m, out, w, g = scene.size, len(rows), at[-1], len(points), len(groups)
    size = out + 2 * w + g + 2 * n + 2 * m * m + 10 * m
    head = [MARK, size, n, m, len(own), w, g, full, step, state.t, 0, out, at[7], at[9], out]
    turning = turning_places(scene)
    variables = (
        *_loads(scene, at[7], own, points, inputs),
        *_in_units((*_faces(at[8], groups, labels, contacts),
                    *_outputs(out, points, labels, watch, state, contacts, place[1])), turning),
    )  # fmt: skip
    return KernelData(np.concatenate([head, *flat]), size, step, state.t, n, variables)


def _refusals(scene: Scene, inputs: Sequence[str]) -> Iterator[str]:
    """Yield the parts of a scene that the kernel does not know."""
    if scene.is_large:
        yield "a structure marches with its matrices; reduce it: structure.reduced(modes)"
        return
    for feedback in scene.feedbacks:
        points = dict.fromkeys(f"{one.structure.name}.{one.name}" for one in feedback.points)
        kind = "joint" if isinstance(feedback, Joint) else "feedback"
        named = f"{kind} {feedback.name}" if feedback.name else f"{kind} at {' and '.join(points)}"
        yield f"{named}, whose force the other simulator may give to the inputs of {' and '.join(points)}"
    for one in scene.contacts:
        what = f"contact {one.name or '?'}: "
        if one.region.kind not in (HalfPlane(0.0).kind, Slot(0.0).kind):
            yield f"{what}region {one.region.kind.name}, expected HalfPlane or Slot"
        if _exponent(one.law.kind) is None:
            yield f"{what}law {one.law.kind.name}, expected KelvinVoigt, or HuntCrossley with exponent 1, 1.5, ... 6.5"
        if one.is_rough:
            yield f"{what}friction"
        if one.is_moved:
            yield f"{what}a wall that moves"
        if any(np.size(value) > 1 for value in (*one.region.values, *one.law.values, one.offset)) and one.motions == 1:
            yield f"{what}values of several members"
    for load in scene.loads:
        steady = load.value is sine or not (callable(load.value) or isinstance(load.value, tuple))
        if load.name not in inputs and not steady:
            yield f"load {load.name or '?'}: a function of time other than a sine; name the load as an input"
        elif any(np.size(value) > 1 for value in load.parameters.values()):
            yield f"load {load.name or '?'}: values of several members"
    names = [load.name for load in scene.loads if load.name]
    yield from (
        f"input {one!r}, expected the name of a load: {', '.join(names) or 'none'}"
        for one in inputs
        if one not in names
    )


@cache
def _exponent(kind: LawKind) -> int | None:
    """Return 0 for Kelvin-Voigt, 2 n + 2 for Hunt-Crossley with exponent n; None for laws that the kernel lacks."""
    if kind is KelvinVoigt:
        return 0
    if kind.name != "HuntCrossley":
        return None
    return next((m for m in range(4, 16) if HuntCrossley(1.0, 0.0, 0.5 * m - 1.0).kind is kind), None)


def _wave(load: Load) -> list[float]:
    """Return mean, amplitude, frequency, phase in turns, and ramp of a load."""
    if load.value is not sine:
        return [float(load.value), 0.0, 0.0, 0.0, 0.0]
    own = {name: float(value) for name, value in load.parameters.items()}
    scale, phase = own.get("scale", 1.0), own.get("phase", 0.0) / 360.0
    sizes = (scale * own.get(name, 0.0) for name in ("mean", "amplitude"))
    return [*sizes, own.get("frequency", 0.0), phase, own.get("ramp", 0.0)]


def _is_slot(one: Contact) -> bool:
    return one.region.kind is Slot(0.0).kind


def _contacts(scene: Scene, faces: Sequence[str]) -> tuple[Array, Array, list[str]]:
    """Return rows of the half planes, (m, NUMBERS), and of the groups, (g, 2), and names of these.

    Those have group, kind, wall at no clearance, its motion with the clearance, side, share of the stiffness, damping;
    these the smallest clearance and the whole stiffness.
    """
    names = [one.name or f"contact {i}" for i, one in enumerate(scene.contacts, 1)]
    of_face = [next((f for f in faces if re.fullmatch(re.escape(f) + r"( \d+)?", name)), name) for name in names]
    labels = list(dict.fromkeys(of_face))
    found, groups = [], np.zeros((len(labels), 2))
    for g, label in enumerate(labels):
        some = [one for one, face in zip(scene.contacts, of_face, strict=True) if face == label]
        groups[g] = min(_clearance(one) for one in some), sum(one.law.values[0] for one in some)
    for one, label in zip(scene.contacts, of_face, strict=True):
        g, kind, (stiffness, damping, *_) = labels.index(label), _exponent(one.law.kind), one.law.values
        assert kind is not None
        share = stiffness / groups[g, 1] if groups[g, 1] else 0.0
        if _is_slot(one):
            center = one.region.values[1]
            found += [(g, kind, side * center, 0.5, side, share, damping) for side in (1.0, -1.0)]
        else:
            found.append((g, kind, _clearance(one) - groups[g, 0], 1.0, 1.0, share, damping))
    return np.array(found, dtype=float).reshape(-1, NUMBERS), groups, labels


def _clearance(one: Contact) -> float:
    return float(one.region.values[0 if _is_slot(one) else 2])


def _half_planes(scene: Scene, places: Array, forces: Array) -> tuple[Array, tuple[Array, Array]]:
    """Return the rows of the half planes along their normals, (m, n), and places and forces there, (m,) each."""
    parts = [np.zeros((0, scene.motions))]
    for one, at in zip(scene.contacts, scene.first, strict=False):
        normals = np.array([[1.0], [-1.0]]) if _is_slot(one) else np.array([one.region.values[:2]])[:, : one.motions]
        new = np.zeros((len(normals), scene.motions))
        new[:, at : at + one.motions] = normals
        parts.append(new)
    turned: Array = np.vstack(parts)
    pressing = np.minimum(turned @ forces, 0.0)  # the force on the point opposes the normal of its wall
    return turned @ scene.contact_rows, (turned @ places, pressing)


def _loads(
    scene: Scene, at: int, own: Array, points: Sequence[tuple[str, Array]], inputs: Sequence[str]
) -> Iterator[KernelVariable]:
    """Yield parameters of the loads, and the inputs: of each load, added to its own value, and of each point."""
    names = [load.name or f"load {i}" for i, load in enumerate(scene.loads, 1)]
    for k, name in enumerate([*names, *(f"{name}.force" for name, _ in points)]):
        load = scene.loads[k] if k < len(names) else None
        turns = name.removesuffix(".force") in turning_places(scene)
        unit, place = unit_where("N", turns) if load is None else load.unit, at + k * PER_LOAD
        if load is not None and name not in inputs:
            shown = ("mean",) if load.value is not sine else tuple(
                one for one in ("mean", "amplitude", "frequency") if one in load.parameters
            )  # fmt: skip
            for one in shown:
                i = ("mean", "amplitude", "frequency").index(one)
                words = f"{one} of load {name}"
                yield KernelVariable(
                    f"{name}.{one}", place + i, "parameter", "Hz" if i == 2 else unit, own[k, i], words
                )
        value = f"{name}.value" if load is not None else name
        words = f"value of load {name}" if name in inputs else f"added to load {name}" if load else "force on the point"
        yield KernelVariable(value, place + 5, "input", unit, 0.0, f"{words}, at the communication point")
        slope = f"rate of {value} until the next communication point"
        yield KernelVariable(f"{value}.slope", place + 6, "input", f"{unit}/s" if unit else "", 0.0, slope)


def _in_units(found: Iterable[KernelVariable], turning: Collection[str]) -> Iterator[KernelVariable]:
    """Yield variables of faces and points in units of their places: rad and N m of rotations."""
    for one in found:
        yield replace(one, unit=unit_where(one.unit, one.name.rpartition(".")[0] in turning))


def _faces(at: int, groups: Array, labels: Sequence[str], contacts: Array) -> Iterator[KernelVariable]:
    for g, label in enumerate(labels):
        unit = "N/m" if np.isin(contacts[contacts[:, 0] == g, 1], LINEAR).all() else ""
        words = "clearance; of several points the smallest, and all walls move with it"
        yield KernelVariable(f"{label}.clearance", at + 2 * g, "parameter", "m", float(groups[g, 0]), words)
        words = "contact stiffness of all points together, N/m, or N/m^n with the exponent n"
        yield KernelVariable(f"{label}.stiffness", at + 2 * g + 1, "parameter", unit, float(groups[g, 1]), words)


def _outputs(
    at: int, points: Sequence[tuple[str, Array]], labels: Sequence[str], watch: Array, state: SceneState,
    contacts: Array, pressing: Array,
) -> Iterator[KernelVariable]:  # fmt: skip
    for k, (what, unit, x) in enumerate((("displacement", "m", state.q), ("velocity", "m/s", state.v))):
        for i, (name, _) in enumerate(points):
            place, value = at + k * len(points) + i, float((watch[i] @ x)[0])
            yield KernelVariable(f"{name}.{what}", place, "output", unit, value, f"{what} of the point")
    forces = np.bincount(contacts[:, 0].astype(int), -contacts[:, 4] * pressing, minlength=len(labels))
    for g, label in enumerate(labels):
        words = "force on the support along its outward normal (of a slot: of its upper side), mean of the last step"
        yield KernelVariable(f"{label}.force", at + 2 * len(points) + g, "output", "N", float(forces[g]), words)


LIBRARY, IDENTIFIER, DATA = "binaries/gapbeam.so", "gapbeam", "resources/scene.bin"
SOURCES = ("kernel.c", "fmi3.c")
DAY = (1980, 1, 1, 0, 0, 0)  # of all files, so that one scene makes one unit, to the byte
UNITS: dict[str, dict[str, str]] = {
    "m": {"m": "1"},
    "m/s": {"m": "1", "s": "-1"},
    "m/s2": {"m": "1", "s": "-2"},
    "m/s2/s": {"m": "1", "s": "-3"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "N/m": {"kg": "1", "s": "-2"},
    "N/m/s": {"kg": "1", "s": "-3"},
    "N/s": {"kg": "1", "m": "1", "s": "-3"},
    "rad": {"rad": "1"},
    "rad/s": {"rad": "1", "s": "-1"},
    "N m": {"kg": "1", "m": "2", "s": "-2"},
    "N m/rad": {"kg": "1", "m": "2", "s": "-2", "rad": "-1"},
    "N m/s": {"kg": "1", "m": "2", "s": "-3"},
    "Hz": {"s": "-1"},
    "s": {"s": "1"},
}
"""Units of variables by powers of the SI base units."""


def write_fmu(data: KernelData, path: Path, name: str, end: float | None = None) -> Path:
    """Write a scene as a unit; a file that is there is replaced.

    Args:
        data: The scene.
        path: File to write, *.fmu.
        name: Name of the model.
        end: Time until which importers simulate by default, s; None: they choose.

    Returns:
        The path.

    Raises:
        UserError: The file cannot be written.
    """
    block = data.block.astype("<f8").tobytes()
    room = files("gapbeam.solver.kernel")
    sources = {one: room.joinpath(one).read_bytes() for one in SOURCES}
    token = hashlib.sha256(block + b"".join(sources.values())).hexdigest()
    content = {
        "modelDescription.xml": model_description(data, name, token, end),
        DATA: block,
        f"binaries/x86_64-linux/{IDENTIFIER}.so": room.joinpath(LIBRARY).read_bytes(),
        "sources/buildDescription.xml": _build_description(),
        **{f"sources/{one}": text for one, text in sources.items()},
    }
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            for place, text in content.items():
                entry = zipfile.ZipInfo(place, DAY)
                entry.external_attr, entry.compress_type = 0o755 << 16, zipfile.ZIP_DEFLATED
                archive.writestr(entry, text)
        part.replace(path)
    except OSError as error:
        raise UserError(f"{path} cannot be written ({error.strerror}); choose another `output=`") from error
    return path


def model_description(data: KernelData, name: str, token: str, end: float | None = None) -> bytes:
    """Return modelDescription.xml of a unit.

    Args:
        data: The scene.
        name: Name of the model.
        token: Token that an importer hands to the library.
        end: Default stop time, s; None: there is none.
    """
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=name, instantiationToken=token, generationTool="gapbeam",
        description=f"beam with gaps in {data.modes} modes, steps of {data.step!r} s",
        variableNamingConvention="flat",
    )  # fmt: skip
    ElementTree.SubElement(
        root, "CoSimulation", modelIdentifier=IDENTIFIER, canHandleVariableCommunicationStepSize="true",
        fixedInternalStepSize=repr(data.step), canGetAndSetFMUState="true",
    )  # fmt: skip
    units = ElementTree.SubElement(root, "UnitDefinitions")
    used = {"s", *(one.unit for one in data.variables)}
    for unit in sorted(used & UNITS.keys()):
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", name=unit), "BaseUnit", UNITS[unit])
    categories = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(categories, "Category", name="logStatusError")
    times = {"startTime": repr(data.begin), "stepSize": repr(data.step)}
    if end is not None:
        times["stopTime"] = repr(float(end))
    ElementTree.SubElement(root, "DefaultExperiment", times)
    variables = ElementTree.SubElement(root, "ModelVariables")
    ElementTree.SubElement(
        variables, "Float64", name="time", valueReference="0", causality="independent", variability="continuous",
        unit="s",
    )  # fmt: skip
    structure = ElementTree.SubElement(root, "ModelStructure")
    for one in data.variables:
        ElementTree.SubElement(variables, "Float64", dict(_attributes(one)))
    for kind in ("Output", "InitialUnknown"):
        for one in data.variables:
            if one.role == "output":
                ElementTree.SubElement(structure, kind, valueReference=str(one.place))
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _attributes(one: KernelVariable) -> Iterator[tuple[str, str]]:
    """Yield the attributes of a variable: parameters may change between steps, inputs are kept or go on by slope."""
    variability = {"input": "continuous", "parameter": "tunable", "output": "continuous"}[one.role]
    held = one.role == "input" and one.name.endswith(".slope")
    pairs: dict[str, Any] = {
        "name": one.name,
        "valueReference": one.place,
        "description": one.meaning,
        "causality": one.role,
        "variability": "discrete" if held else variability,
        "unit": one.unit or None,
        "initial": "calculated" if one.role == "output" else None,
        "start": None if one.role == "output" else repr(float(one.start)),
    }
    yield from ((key, str(value)) for key, value in pairs.items() if value is not None)


def _build_description() -> bytes:
    """Return buildDescription.xml: sources of the library, for other platforms."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=IDENTIFIER)
    sources = ElementTree.SubElement(configuration, "SourceFileSet", language="C99")
    ElementTree.SubElement(sources, "SourceFile", name=SOURCES[-1])
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))
