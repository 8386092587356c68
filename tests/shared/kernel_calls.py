"""The C kernel and its FMI functions, called by ctypes."""

from __future__ import annotations

import ctypes
import zipfile
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from gapbeam.solver.kernel.kernel_data import KernelData
from gapbeam.solver.system.operators import Array

REAL = ctypes.POINTER(ctypes.c_double)
LOGGER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)


class MarchedBlock:
    """A block that the kernel marches; `block["tip.displacement"]` is a variable."""

    def __init__(self, data: KernelData) -> None:
        self.numbers: Array = np.zeros(data.size)
        self.numbers[: len(data.block)] = data.block
        self.places = {one.name: one.place for one in data.variables}
        self.library = ctypes.CDLL(str(files("gapbeam.solver.kernel").joinpath("binaries", "gapbeam.so")))

    def __getitem__(self, name: str) -> float:
        return float(self.numbers[self.places[name]])

    def __setitem__(self, name: str, value: float) -> None:
        self.numbers[self.places[name]] = value

    def march(self, steps: int) -> None:
        """March so many steps."""
        assert self.library.march(self.numbers.ctypes.data_as(REAL), steps) == 0


class Unit:
    """A unit as an importer uses it: unpacked, described by its XML, called through FMI functions."""

    def __init__(self, path: Path, folder: Path) -> None:
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        self.description = ElementTree.parse(folder / "modelDescription.xml").getroot()
        variables = self.description.find("ModelVariables")
        assert variables is not None
        self.places = {one.get("name"): int(str(one.get("valueReference"))) for one in variables}
        self.library = ctypes.CDLL(str(folder / "binaries/x86_64-linux/gapbeam.so"))
        self.said: list[str] = []
        self._logger = LOGGER(lambda _environment, _status, _category, text: self.said.append(text.decode()))
        make = self.library.fmi3InstantiateCoSimulation
        make.restype = ctypes.c_void_p
        token, resources = str(self.description.get("instantiationToken")).encode(), f"{folder}/resources/".encode()
        no, nothing = ctypes.c_bool(False), ctypes.c_void_p(None)
        whole = (b"one", token, resources, no, no, no, no, nothing, ctypes.c_size_t(0), nothing, self._logger, nothing)
        self.instance = ctypes.c_void_p(make(*whole))
        assert self.instance.value, self.said

    def call(self, name: str, *arguments: Any) -> int:
        """Call an FMI function of the instance; return its status."""
        return int(getattr(self.library, f"fmi3{name}")(self.instance, *arguments))

    def begin(self, start: float = 0.0) -> None:
        """Pass through the initialization mode."""
        zero, no = ctypes.c_double(0.0), ctypes.c_bool(False)
        assert self.call("EnterInitializationMode", no, zero, ctypes.c_double(start), no, zero) == 0
        assert self.call("ExitInitializationMode") == 0

    def _numbers(self, function: str, name: str, value: float) -> tuple[int, float]:
        place, number, one = ctypes.c_uint32(self.places[name]), ctypes.c_double(value), ctypes.c_size_t(1)
        status = self.call(function, ctypes.byref(place), one, ctypes.byref(number), one)
        return status, number.value

    def __getitem__(self, name: str) -> float:
        status, value = self._numbers("GetFloat64", name, 0.0)
        assert status == 0
        return value

    def __setitem__(self, name: str, value: float) -> None:
        assert self._numbers("SetFloat64", name, value)[0] == 0

    def refuses(self, name: str, value: float) -> bool:
        """Return whether a variable may not be set."""
        return self._numbers("SetFloat64", name, value)[0] != 0

    def step(self, time: float, length: float) -> int:
        """Make a communication step; return its status."""
        flags, reached = [ctypes.byref(ctypes.c_bool()) for _ in range(3)], ctypes.byref(ctypes.c_double())
        whole = (ctypes.c_double(time), ctypes.c_double(length), ctypes.c_bool(True), *flags, reached)
        return self.call("DoStep", *whole)
