"""Functional Mock-up Units of FMI 3.0 for co-simulation: a scene as data, the kernel as library and as source.

Source: Modelica Association, Functional Mock-up Interface Specification 3.0, sections 2.4 and 2.5.
"""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from gapbeam.solver.kernel.kernel_data import KernelData, KernelVariable
from gapbeam.solver.messages.errors import UserError

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
        token: That an importer hands to the library.
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
