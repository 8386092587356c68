"""Memory: how much a model needs and there is, refusing what does not fit, and what is reported when it is used up."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from mpi4py import MPI

import gapbeam
from gapbeam.meshes.mesh_size import expected_cells
from gapbeam.solver.assembly.case_mesh import geometry_of, sizing_of
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.memory import memory_check as memory_limit
from gapbeam.solver.memory import memory_estimate as free_memory
from gapbeam.solver.memory.memory_check import (
    expected_dofs,
    is_out_of_memory,
    memory_of,
    out_of_memory_reported,
    refuse_too_large,
)
from gapbeam.solver.messages.errors import OutOfMemory, UserError
from gapbeam.solver.models.body import mesh_beam, mesh_dofs
from gapbeam.solver.models.model import build_body
from tests.shared.command import DEMO, alone, on_ranks, settings


@pytest.mark.parametrize(
    ("keys", "exact"),
    [
        ((), True),
        (("mesh.degree=1", "mesh.cells_through_thickness=4"), True),
        (("mesh.cell=triangle",), False),
        (("mesh.dimension=3", "mesh.cell=hexahedron", "mesh.size=0.05"), True),
        (("mesh.dimension=3", "mesh.cell=tetrahedron", "mesh.size=0.05"), False),
    ],
    ids=["quadrilaterals", "degree 1", "triangles", "hexahedra", "tetrahedra"],
)
def test_size_is_known_before_meshing(keys: tuple[str, ...], exact: bool) -> None:
    """Cells and DOFs are those of the mesh: to the last one in layers, within a half where gmsh decides."""
    case = read_case(DEMO, keys)
    expected, meshed = expected_dofs(case), mesh_beam(case, MPI.COMM_WORLD)
    assert expected is not None
    near = {"rel": 0.0} if exact else {"rel": 0.5}
    assert expected == pytest.approx(mesh_dofs(meshed), **near)
    assert expected_cells(geometry_of(case), sizing_of(case)) == pytest.approx(meshed.tagged.cell_count, **near)


def test_models_that_do_not_fit_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """2e7 DOFs: refused before anything is meshed, with what it needs, what there is, and what to try."""
    monkeypatch.setattr(memory_limit, "free_memory", lambda _: 8.0e9)
    sizes = ("mesh.size=1e-3", "mesh.support_size=1e-3", "mesh.cells_through_thickness=40")
    keys = ("mesh.dimension=3", "mesh.cell=hexahedron", *sizes)
    started = time.process_time()
    with pytest.raises(UserError) as refused:
        gapbeam.run(DEMO, keys, tmp_path / "out")
    assert time.process_time() - started < 60.0  # meshed, it would take minutes
    for message in (
        "would need about",
        "8 GB are free",
        "mesh.size",
        "mesh.degree = 1",
        "gates.accept_lack_of_memory = true",
    ):
        assert message in str(refused.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("keys", "iterations"),
    [
        ((), ""),
        (("solver.effective=iterative",), ""),
        (("solver.effective=factor",), 'solver.effective = "iterative"'),
        (("contact.formulation=nitsche",), "a case without the formulation nitsche"),
        (("model.type=reduced",), ""),
        (("model.type=beam",), ""),
    ],
)
def test_only_what_helps_is_suggested(keys: tuple[str, ...], iterations: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Iterations where they are not assumed already, and nothing that the case has done."""
    monkeypatch.setattr(memory_limit, "free_memory", lambda _: 1.0e9)
    case = read_case(DEMO, ("mesh.dimension=3", "mesh.cell=hexahedron", "mesh.degree=1", *keys))
    with pytest.raises(UserError) as refused:
        refuse_too_large(case, 2.0e7, MPI.COMM_SELF)
    message = str(refused.value)
    assert ("iterative" in message or "without" in message) == bool(iterations)
    assert iterations in message
    assert "mesh.degree" not in message
    assert "mesh.dimension = 2" in message
    assert ('model.type = "beam"' in message) == ("model.type=beam" not in keys)


def test_lack_of_memory_can_be_accepted(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """A model that is expected not to fit is made when the case says so, and reported."""
    monkeypatch.setattr(memory_limit, "free_memory", lambda _: 1.0e5)
    monkeypatch.setattr(memory_limit, "SMALL", 0.0)
    with pytest.raises(UserError, match="of memory"):
        build_body(read_case(DEMO), MPI.COMM_WORLD)
    with caplog.at_level("WARNING", logger="gapbeam"):
        body = build_body(read_case(DEMO, ["gates.accept_lack_of_memory=true"]), MPI.COMM_WORLD)
    assert body.operators.size > 0
    assert MPI.COMM_WORLD.rank > 0 or "accepted by gates.accept_lack_of_memory = true" in caplog.text


def test_kinds_of_models_need_what_they_are_made_of() -> None:
    """Beam elements take a mesh, rigid bodies their matrices, too; what solves is the least that can."""
    kinds = ("full", "solver.effective=factor"), ("full", "contact.formulation=unilateral"), ("full", ""), ("rigid", "")
    factored, exact, full, rigid, reduced, beam = (
        memory_of(read_case(DEMO, [f"model={kind}", *filter(None, [more])]), 1.0e6)
        for kind, more in (*kinds, ("reduced", ""), ("beam", ""))
    )
    assert set(factored) == set(exact) == {"mesh", "matrices", "factor"}
    assert full == reduced
    assert sum(beam.values()) < sum(rigid.values()) < sum(full.values()) <= sum(factored.values())
    refuse_too_large(read_case(DEMO), 1000.0, MPI.COMM_WORLD)


@pytest.mark.parametrize("version", [1, 2])
def test_limits_of_control_groups_count(version: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The least of the machine and of every group around the process is free, and what can be given back."""
    (tmp_path / "meminfo").write_text("MemTotal: 64000000 kB\nMemAvailable: 32000000 kB\n", encoding="ascii")
    root = tmp_path / "groups" / ("" if version == 2 else "memory")
    limit, used, cache = ("memory.max", "memory.current", "inactive_file")
    if version == 1:
        limit, used, cache = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
    for group, most, now in (("job", 4e9, 3e9), ("job/step", 1e20 if version == 1 else "max", 2e9)):
        (root / group).mkdir(parents=True)
        (root / group / limit).write_text(f"{most if isinstance(most, str) else int(most)}\n", encoding="ascii")
        (root / group / used).write_text(f"{int(now)}\n", encoding="ascii")
        (root / group / "memory.stat").write_text(f"anon 5\n{cache} 500000000\n", encoding="ascii")
    message = "0::/job/step\n" if version == 2 else "4:memory:/job/step\n2:cpu:/job\n"
    (tmp_path / "cgroup").write_text(message, encoding="ascii")
    monkeypatch.setattr(free_memory, "MEMINFO", tmp_path / "meminfo")
    monkeypatch.setattr(free_memory, "GROUP_OF_PROCESS", tmp_path / "cgroup")
    monkeypatch.setattr(free_memory, "GROUPS", tmp_path / "groups")
    assert free_memory.free_here() == pytest.approx(1.5e9)
    (tmp_path / "cgroup").unlink()
    assert free_memory.free_here() == pytest.approx(32.768e9)
    (tmp_path / "meminfo").unlink()
    assert free_memory.free_here() == float("inf")


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        OSError(12, "Cannot allocate memory"),
        RuntimeError("std::bad_alloc"),
        RuntimeError("error code 76\n[0] MUMPS error in solve: INFOG(1)=-13 (see users manual)"),
        ImportError("x.so: failed to map segment from shared object"),
    ],
)
def test_used_up_memory_is_known_by_what_notices_it(error: Exception) -> None:
    """Python, the operating system, DOLFINx, MUMPS and the loader: status 7, and what to try; also at a remove."""
    with (
        pytest.raises(OutOfMemory, match="out of memory while it was tried") as message,
        out_of_memory_reported("it was tried"),
    ):
        raise error
    assert message.value.exit_status == 7
    behind = ValueError("elsewhere")
    behind.__cause__ = error
    assert is_out_of_memory(behind)
    assert not is_out_of_memory(RuntimeError("INFOG(1)=-10: the matrix is singular"))


@alone
@pytest.mark.slow
def test_rank_without_memory_ends_all(tmp_path: Path) -> None:
    """Rank 1 gets no more memory in the factorization: all ranks end within seconds with its message and status 7."""
    fine = ("mesh.size=5e-4", "mesh.support_size=5e-4")  # a factor that does not fit into what was freed before
    words = ("run", DEMO, *settings("time.end=0.002", "load.shaker.ramp=0", *fine), "--output", tmp_path / "out")
    done = on_ranks(2, *words, program="tests.programs.cramped_rank")
    assert done.returncode == OutOfMemory.exit_status, done.stderr
    assert "out of memory while the model was m" in done.stderr
    assert "Traceback" not in done.stderr
