"""What the container image leaves out: nothing that gapbeam loads, and enough that the image stays small."""

import fnmatch
import functools
import importlib.util
import platform
import re
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import dolfinx
import pytest
import pyvista

from tests.shared.command import alone
from tests.shared.processes import LONGEST

project = Path(__file__).resolve().parents[2]
environment = project / "environment"
LISTS = (environment / "dpkg.cfg", environment / "container" / "dpkg.cfg")
"""In the order in which dpkg reads them in the image."""
PLUGINS = re.compile(r"levelzero|libze_|rocm|libhsa")
"""Libraries of MPI for GPUs, which are loaded where there are such libraries."""


@functools.cache
def rules(path: Path) -> list[tuple[str, str]]:
    """The lines of a list that are no comments: what is done, and with which files."""
    lines = [line.strip() for line in path.read_text().splitlines()]
    found = [re.fullmatch(r"path-(exclude|include)=(/\S+)", line) for line in lines if line and line[0] != "#"]
    assert None not in found
    return [(rule[1], rule[2]) for rule in found if rule]


def left_out(path: str) -> bool:
    """Whether dpkg leaves out a file in the image: the last rule that matches holds."""
    matching = [what for file in LISTS for what, files in rules(file) if fnmatch.fnmatchcase(path, files)]
    return bool(matching) and matching[-1] == "exclude"


def slim() -> ModuleType:
    """The script that the image runs over folders of Python packages."""
    spec = importlib.util.spec_from_file_location("slim", environment / "container" / "slim.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def said_by(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=LONGEST).stdout


def test_rules_are_given_once_and_inclusions_undo_something() -> None:
    given = [rule for file in LISTS for rule in rules(file)]
    assert len(given) == len(set(given))
    for file in LISTS:
        excluded = [files for what, files in rules(file) if what == "exclude"]
        for what, files in rules(file):
            assert what == "exclude" or any(fnmatch.fnmatchcase(files, pattern) for pattern in excluded)


@pytest.mark.parametrize(
    "path",
    [
        "/usr/libexec/gcc/x86_64-linux-gnu/14/cc1",
        "/usr/lib/x86_64-linux-gnu/libc_nonshared.a",
        "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1",
        "/usr/lib/x86_64-linux-gnu/libdmumps-5.7.1.so",
        "/usr/lib/x86_64-linux-gnu/libTKDESTEP.so.7.8.1",
        "/usr/lib/x86_64-linux-gnu/perl-base/strict.pm",
        "/usr/lib/chromium/libvk_swiftshader.so",
        "/usr/share/doc/libboost1.83-dev/copyright",
        "/usr/share/doc/libopenmpi40/copyright",
        "/usr/bin/g++",  # for the alternative c++ of its package
    ],
)
def test_what_is_needed_stays(path: str) -> None:
    assert not left_out(path)


@pytest.mark.parametrize(
    "path",
    [
        "/usr/libexec/gcc/x86_64-linux-gnu/14/cc1plus",
        "/usr/include/c++/14/vector",
        "/usr/lib/x86_64-linux-gnu/libicudata.so.76.1",
        "/usr/lib/x86_64-linux-gnu/libTKXSDRAWSTEP.so.7.8.1",
        "/usr/share/doc/libboost-timer1.83.0/copyright",
        "/usr/share/opencascade/data/stl/bearing.stl",
        "/usr/bin/cmake",
    ],
)
def test_what_is_large_and_not_needed_goes(path: str) -> None:
    assert left_out(path)


def test_dpkg_leaves_no_python_file_out() -> None:
    """Debian compiles every Python file of a package while installing it, and fails where one is missing."""
    for path in ("dist-packages/numpy/tests/test_lazyloading.py", "dist-packages/pip/__init__.py"):
        assert not left_out(f"/usr/lib/python3/{path}")
    assert not left_out("/usr/lib/python3.13/tkinter/__init__.py")
    assert not left_out("/usr/lib/python3.13/test/__init__.py")


LOADED = """
import dolfinx.fem.petsc, gmsh, h5py, lxml.etree, mpi4py.MPI, petsc4py.PETSc, scipy.linalg, slepc4py.SLEPc
gmsh.initialize()
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
print(*sorted({line.split(maxsplit=5)[-1].strip() for line in open("/proc/self/maps") if ".so" in line}), sep="\\n")
"""


def of_the_image() -> bool:
    """Whether this is the Debian of the image, and DOLFINx its package: others load other libraries."""
    base = re.search(r"^ARG BASE=\S*debian:(\w+)", (project / "Dockerfile").read_text(), re.MULTILINE)
    assert base
    of_debian = Path(dolfinx.__file__).is_relative_to("/usr")
    return of_debian and platform.freedesktop_os_release().get("VERSION_CODENAME") == base[1]


@alone
@pytest.mark.skipif(not of_the_image(), reason="the image is of another release")
def test_no_library_that_is_loaded_is_left_out() -> None:
    loaded = [path for path in said_by(sys.executable, "-c", LOADED).splitlines() if path.startswith("/")]
    assert len(loaded) > 100
    assert [path for path in loaded if left_out(path) and not PLUGINS.search(path)] == []


@pytest.mark.parametrize("program", ["ffmpeg", "mpirun", "gcc"])
def test_no_library_of_a_program_is_left_out(program: str) -> None:
    path = shutil.which(program)
    if path is None:
        pytest.skip(f"there is no {program} here")
    linked = re.findall(r"=> (/\S+)", said_by("ldd", path))
    assert linked
    assert [library for library in linked if left_out(str(Path(library).resolve()))] == []


def test_no_header_of_a_kernel_is_left_out(tmp_path: Path) -> None:
    """The headers that C of FFCx and of cffi includes."""
    if not shutil.which("gcc"):
        pytest.skip("there is no gcc here")
    include = said_by(sys.executable, "-c", "import sysconfig; print(sysconfig.get_path('include'))").strip()
    source = tmp_path / "kernel.c"
    source.write_text("#include <Python.h>\n#include <complex.h>\n#include <math.h>\n#include <stdalign.h>\n")
    headers = re.findall(r"/usr/include/\S+", said_by("gcc", "-M", f"-I{include}", str(source)))
    assert [header for header in headers if left_out(header)] == []


def test_the_build_finds_its_files() -> None:
    """.dockerignore lets through what the Dockerfile copies; dpkg reads the lists in the order of their names."""
    let_through = {line[1:] for line in (project / ".dockerignore").read_text().splitlines() if line[:1] == "!"}
    copied = [line.split()[1:] for line in (project / "Dockerfile").read_text().splitlines() if line[:4] == "COPY"]
    sources = [source for *several, _ in copied for source in several if source != "."]
    assert {str(file.relative_to(project)) for file in LISTS} < set(sources) <= let_through
    targets = {source: target for *several, target in copied for source in several}
    order = [targets[str(file.relative_to(project))] for file in LISTS]
    assert order == sorted(order)
    assert {Path(target).parent for target in order} == {Path("/etc/dpkg/dpkg.cfg.d")}


def test_the_browser_is_the_layer_for_pdfs() -> None:
    packages = re.findall(r"^[a-z].*$", (environment / "packages.txt").read_text(), re.M)
    assert [name for name in packages if name.startswith("chromium")] == ["chromium-headless-shell"]
    assert "/^chromium/d" in (project / "Dockerfile").read_text()
    assert "/^chromium/p" in (environment / "container" / "Dockerfile.pdf").read_text()


def test_tests_stubs_and_parts_are_removed(tmp_path: Path) -> None:
    kept = ("numpy/__init__.py", "numpy/_core/tests/_natype.py", "numpy/testing/__init__.py", "tests.py")
    removed = ("numpy/tests/test_a.py", "numpy/_core/tests/data/a.bin", "numpy/a.pyi", "sympy/core/add.py", "isympy.py")
    for name in (*kept, *removed):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    module = slim()
    module.remove_needless(tmp_path, module.DEBIAN)
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left == set(kept)


def test_only_loaded_libraries_stay(tmp_path: Path) -> None:
    for name in ("libvtkA.so", "libvtkB-9.6.so.1", "vtkA.cpython-313.so", "notes.txt"):
        (tmp_path / name).write_bytes(b"12345")
    (tmp_path / "link.so").symlink_to(tmp_path / "libvtkA.so")
    assert slim().remove_unloaded(tmp_path, {str((tmp_path / "libvtkA.so").resolve())}) == 10
    assert sorted(path.name for path in tmp_path.iterdir()) == ["libvtkA.so", "link.so", "notes.txt"]
    with pytest.raises(RuntimeError, match="is loaded"):
        slim().remove_unloaded(tmp_path, set())


def test_modules_of_vtk_are_those_that_pyvista_names() -> None:
    if f"pyvista=={version('pyvista')}" not in (environment / "requirements.txt").read_text().splitlines():
        pytest.skip("the image takes another release of pyvista")
    names = slim().vtk_modules(Path(pyvista.__file__).parent)
    assert {"vtkCommonCore", "vtkRenderingOpenGL2", "vtkIOXML"} <= names  # in a table
    assert "vtkRenderingMatplotlib" in names  # in an import statement only
    used = [path.read_text() for path in (project / "postprocess").rglob("*.py")]
    assert set(re.findall(r"vtkmodules\.(\w+)", "\n".join(used))) <= names


@pytest.mark.parametrize(
    ("size", "status"),
    [("1.93 GB", 0), ("2 GB", 0), ("812 MB", 0), ("2.01 GB", 1), ("1.2 TB", 1), ("", 2), ("much", 2)],
)
def test_budget(size: str, status: int) -> None:
    script = 'source "$1"; within "$2" "$budget"'
    command = ["bash", "-c", script, "bash", str(environment / "container" / "budget.sh"), size]
    assert subprocess.run(command, check=False, timeout=LONGEST).returncode == status


def test_environments_do_not_follow_from_the_image(tmp_path: Path) -> None:
    """Whoever has an environment does not have to make it again when the image changes."""
    copy = tmp_path / "environment"
    shutil.copytree(environment, copy)
    shutil.copy(project / "pyproject.toml", tmp_path)
    script = 'here=$1 project=$2 wish=auto suite=trixie; source "$1/steps/common.sh"; fingerprint'
    command = ("bash", "-c", script, "bash", str(copy), str(tmp_path))
    before = said_by(*command)
    for file in (copy / "container").iterdir():
        file.write_text("# nothing\n")
    assert said_by(*command) == before
    (copy / "dpkg.cfg").write_text("# nothing\n")
    assert said_by(*command) != before
