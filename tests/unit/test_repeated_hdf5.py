"""Files that are copies of one that HDF5 wrote, with other numbers."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from gapbeam.solver.run.output.hdf5_files import RepeatedFile

SHAPES: dict[str, tuple[int, ...]] = {"displacement": (7, 3), "contact_pressure": (7,), "nothing": (0,)}


def test_every_file_holds_its_numbers_and_nothing_of_the_one_before(tmp_path: Path) -> None:
    """HDF5 reads from each file what was given for it, in whatever pieces it came."""
    form, random = RepeatedFile(SHAPES), np.random.default_rng(5)
    for number in range(3):
        wanted = {name: random.normal(size=shape) for name, shape in SHAPES.items()}
        path = tmp_path / f"{number}.h5"
        form.write(path, lambda name, wanted=wanted: iter((wanted[name][:2], wanted[name][2:])))  # type: ignore[misc]
        with h5py.File(path, "r") as file:
            assert set(file) == set(SHAPES)
            for name, values in wanted.items():
                assert np.array_equal(file[name][()], values)


def test_what_cannot_be_written_leaves_no_file(tmp_path: Path) -> None:
    """A folder that is not there is an error of the operating system; numbers that do not come leave nothing behind."""
    form = RepeatedFile({"u": (4,)})
    with pytest.raises(FileNotFoundError):
        form.write(tmp_path / "missing" / "u.h5", lambda _: iter((np.zeros(4),)))

    def broken(_: str) -> list[np.ndarray]:  # type: ignore[type-arg]
        raise OSError("the rank does not answer")

    with pytest.raises(OSError, match="does not answer"):
        form.write(tmp_path / "u.h5", broken)
    assert not list(tmp_path.iterdir())
