"""Results folders written without the solver for the tests of postprocess, and a test that they open."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
import pytest

from gapbeam.postprocess.results.results import open_results
from gapbeam.solver.schema.record_table import (
    CASE_FILE,
    COMPONENTS,
    FIELDS_DATA_FILE,
    FIELDS_FILE,
    FORMAT_VERSION,
    HISTORY,
    HISTORY_FILE,
    SUMMARY_FILE,
    TANGENTS,
)

CASE = """
title = "synthetic"
[beam]
length = 0.51
thickness = 0.012
width = 0.02
[support]
length = 0.05
clearance = {clearance}
[time]
end = 1.0
step = 1e-4
[[load]]
type = "harmonic_force"
name = "force"
amplitude = 10.0
frequency = 20.0
direction = [0.0, 1.0]
"""


def write_results(
    folder: Path,
    time: np.ndarray,
    records: Mapping[str, np.ndarray] | None = None,
    *,
    dimension: int = 2,
    probes: tuple[str, ...] = ("tip",),
    frequency: float | None = 20.0,
    clearance: float = 1.07e-4,
    status: str = "completed",
) -> Path:
    """Write case, history and summary; records that are not given are zero.

    A record of shape (n,) fills the bending direction of every probe, or both faces.
    """
    folder.mkdir(parents=True, exist_ok=True)
    labels = {
        "probe": probes,
        "component": COMPONENTS[dimension],
        "face": ("base", "gland"),
        "tangent": TANGENTS[dimension],
        "load": () if frequency is None else ("force",),
        "gauge": probes,
        "across": ("y", "z"),
        "moving": (),
        "worn_face": (),
        "slip_mode": (),
        "moved_probe": (),
        "turned_probe": (),
        "support_body": (),
        "support_axis": (),
        "joint": (),
        "translation": (),
        "turn": (),
    }
    with h5py.File(folder / HISTORY_FILE, "w") as file:
        file.attrs["format"] = FORMAT_VERSION
        file["time"] = time
        file["time"].attrs["units"] = "s"
        file["time"].make_scale("time")
        for name, entries in labels.items():
            if entries:
                file.create_dataset(name, data=list(entries), dtype=h5py.string_dtype())
                file[name].make_scale(name)
        for record in HISTORY:
            shape = (time.size, *(len(labels[dimension]) for dimension in record.dims[1:]))
            if 0 in shape[1:]:
                continue
            values = np.zeros(shape)
            given = (records or {}).get(record.name)
            if given is not None:
                if "component" in record.dims and given.ndim == 1:
                    values[:, :, -1] = given[:, None]
                else:
                    values[...] = given.reshape(given.shape + (1,) * (len(shape) - given.ndim))
            file[record.name] = values
            file[record.name].attrs["units"] = record.unit
            file[record.name].attrs["long_name"] = record.meaning
            for axis, name in enumerate(record.dims):
                file[record.name].dims[axis].attach_scale(file[name])
    (folder / CASE_FILE).write_text(CASE.format(clearance=clearance))
    forcing = {"frequency": frequency, "period": None if frequency is None else 1 / frequency}
    summary = {"format": FORMAT_VERSION, "title": "synthetic", "status": status, "forcing": forcing}
    (folder / SUMMARY_FILE).write_text(json.dumps(summary))
    return folder


def write_fields(
    folder: Path,
    points: np.ndarray,
    cells: np.ndarray,
    topology: str,
    frames: list[tuple[float, np.ndarray, np.ndarray]],
) -> None:
    """Write fields.xdmf and fields.h5 as the solver does; a frame is time, displacement, pressure."""
    collection = ET.Element("Grid", Name="gapbeam", GridType="Collection", CollectionType="Temporal")
    with h5py.File(folder / FIELDS_DATA_FILE, "w") as data:
        data["points"], data["cells"] = points, cells
        for k, (time, displacement, pressure) in enumerate(frames):
            grid = ET.SubElement(collection, "Grid", Name=f"step {k}", GridType="Uniform")
            ET.SubElement(grid, "Time", Value=repr(float(time)))
            mesh = ET.SubElement(grid, "Topology", TopologyType=topology, NumberOfElements=str(len(cells)))
            _item(mesh, data, "cells", "Int")
            _item(ET.SubElement(grid, "Geometry", GeometryType="XYZ"), data, "points", "Float")
            for name, values in (
                ("displacement", displacement),
                ("velocity", 0 * displacement),
                ("contact_pressure", pressure),
            ):
                data[f"{name}/{k}"] = values
                kind = "Scalar" if values.ndim == 1 else "Vector"
                attribute = ET.SubElement(grid, "Attribute", Name=name, AttributeType=kind, Center="Node")
                _item(attribute, data, f"{name}/{k}", "Float")
    root = ET.Element("Xdmf", Version="3.0")
    ET.SubElement(root, "Domain").append(collection)
    ET.ElementTree(root).write(folder / FIELDS_FILE)


def _item(parent: ET.Element, data: h5py.File, place: str, kind: str) -> None:
    size = " ".join(str(n) for n in data[place].shape)
    item = ET.SubElement(parent, "DataItem", Dimensions=size, NumberType=kind, Precision="8", Format="HDF")
    item.text = f"{FIELDS_DATA_FILE}:/{place}"


def plane_beam(cells_along: int = 51, cells_through: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """A 510 x 12 mm beam of quadrilaterals about y = 0."""
    x, y = np.linspace(0, 0.51, cells_along + 1), np.linspace(-0.006, 0.006, cells_through + 1)
    points = np.array([(a, b, 0.0) for b in y for a in x])
    row = cells_along + 1
    cells = [
        (j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i)
        for j in range(cells_through)
        for i in range(cells_along)
    ]
    return points, np.array(cells)


def solid_beam(cells_along: int = 51, cells_across: int = 3, cells_through: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """A 510 x 20 x 12 mm beam of hexahedra about y = z = 0."""
    axes = (
        np.linspace(0, 0.51, cells_along + 1),
        np.linspace(-0.01, 0.01, cells_across + 1),
        np.linspace(-0.006, 0.006, cells_through + 1),
    )
    nx, ny = cells_along + 1, cells_across + 1
    points = np.array([(a, b, c) for c in axes[2] for b in axes[1] for a in axes[0]])
    cells = []
    for k in range(cells_through):
        for j in range(cells_across):
            for i in range(cells_along):
                low = [k * nx * ny + j * nx + i, k * nx * ny + j * nx + i + 1]
                low += [k * nx * ny + (j + 1) * nx + i + 1, k * nx * ny + (j + 1) * nx + i]
                cells.append([*low, *(n + nx * ny for n in low)])
    return points, np.array(cells)


@pytest.mark.parametrize("dimension", [2, 3])
def test_written_history_opens_with_names_and_units(tmp_path: Path, dimension: int) -> None:
    time = np.linspace(0.0, 0.1, 11)
    results = open_results(write_results(tmp_path / "run", time, {"displacement": time}, dimension=dimension))
    assert results.history["displacement"].dims == ("time", "probe", "component")
    assert [str(name) for name in results.history["component"].values] == list(COMPONENTS[dimension])
    assert results.history["contact_force"].attrs["units"] == "N"
    np.testing.assert_array_equal(results.history["displacement"][:, 0, -1], time)
