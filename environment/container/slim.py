"""Remove from the image what gapbeam never loads: tests, symbols, packages, and libraries of VTK unknown to pyvista.

The Dockerfile runs this once for the Python packages of Debian (`slim.py debian FOLDER`) and once for those of PyPI
(`slim.py venv FOLDER`), each time in the layer that installs them.
"""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

DEBIAN = ("sympy", "isympy.py", "mpmath", "nanobind", "pip")
"""What nothing here imports: needed by a corner of fontTools, by C++ programs, and there once more in the venv."""
VENV = ("plotly/labextension", "plotly/package_data/widgetbundle.js", "plotly/package_data/datasets")
"""What serves notebooks and examples."""
KEPT = ("numpy/_core/tests/_natype.py",)
"""What other parts of a package import from its tests."""


def remove_needless(packages: Path, names: tuple[str, ...]) -> None:
    """Remove these parts of a folder of Python packages, and all tests and type stubs in it."""
    for name in names:
        part = packages / name
        if part.is_dir():
            shutil.rmtree(part)
        else:
            part.unlink(missing_ok=True)
    for path in list(packages.rglob("*")):
        inside = path.relative_to(packages)
        test = "tests" in inside.parts[:-1] and inside.as_posix() not in KEPT
        if (test or path.suffix == ".pyi") and not path.is_dir():
            path.unlink()


def libraries(folder: Path) -> list[Path]:
    """Return the shared libraries in a folder and in those below, without links to them."""
    return [path for path in folder.rglob("*.so*") if path.is_file() and not path.is_symlink()]


def strip_symbols(packages: Path) -> None:
    """Strip the shared libraries of symbols that serve debuggers and linkers only."""
    subprocess.run(["strip", "--strip-unneeded", *map(str, libraries(packages))], check=True)


def vtk_modules(package: Path) -> set[str]:
    """Return the names of all modules of VTK that stand in the source files of pyvista."""
    sources = "\n".join(path.read_text(encoding="utf-8") for path in package.rglob("*.py"))
    return set(re.findall(r"vtkmodules\.([\w.]+)", sources)) | set(re.findall(r"^    '([\w.]+)': \(", sources, re.M))


def load(names: set[str]) -> set[str]:
    """Import modules of VTK, where there are such; return the paths of all shared libraries that are then loaded."""
    for name in sorted(names):
        try:
            importlib.import_module(f"vtkmodules.{name}")
        except ModuleNotFoundError:  # pyvista supports several releases of VTK; and not every word is a module
            continue
    lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    return {str(Path(line.split(maxsplit=5)[-1]).resolve()) for line in lines if ".so" in line}


def remove_unloaded(folder: Path, loaded: set[str]) -> int:
    """Remove the shared libraries of a folder that are not loaded; return how many bytes they had.

    Raises:
        RuntimeError: None of the libraries of the folder is loaded, so something else has been imported.
    """
    present = libraries(folder)
    spare = [path for path in present if str(path.resolve()) not in loaded]
    if len(spare) == len(present):
        raise RuntimeError(f"no library of {folder} is loaded")
    size = sum(path.stat().st_size for path in spare)
    for path in spare:
        path.unlink()
    return size


def main(kind: str, packages: Path) -> None:
    """Remove all this from a folder of Python packages: those of "debian" or those of the "venv"."""
    if kind == "debian":
        remove_needless(packages, DEBIAN)
        return
    remove_needless(packages, VENV)
    strip_symbols(packages)
    size = remove_unloaded(packages / "vtkmodules", load(vtk_modules(packages / "pyvista")))
    print(f"slim: {size / 1e6:.0f} MB of VTK removed")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
