"""The block of A^-1 at the interface that MUMPS computes from its factor is that of solves by columns."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix, identity

from gapbeam.solver.contact.solve.condensation import CondensedOperator
from gapbeam.solver.linear_algebra import mumps_factor as inverse_entries
from gapbeam.solver.linear_algebra.mumps_factor import PetscFactor
from gapbeam.solver.linear_algebra.substructured_factor import SubstructuredFactor
from gapbeam.solver.messages.errors import RunError
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.operators import RankOnes
from gapbeam.solver.system.rank_one_update import UpdatedFactor
from tests.shared.command import alone, on_ranks
from tests.shared.models import SOLID, beam_case, beam_model, seat_of

pytestmark = [alone, pytest.mark.versions]

LOADS = (
    {"type": "gravity"},
    {"type": "harmonic_force", "name": "shaker", "point": 0.15, "amplitude": 1.0, "frequency": 100.0},
)
MESHES: dict[str, dict[str, dict[str, object]]] = {
    "2D": {},
    "3D": {"mesh": SOLID},
    "2D, columns dropped": {"solver": {"columns": "drop"}},
}


def compared(changes: dict[str, dict[str, object]], comm: MPI.Comm) -> dict[str, float]:
    """Return how far the block is from that by columns, with springs on the faces and without and with a dashpot."""
    model = build_model(beam_case(changes, LOADS), comm)
    system, words = model.system, {}
    operators, interface = system.operators, system.contact.interface
    dashpot = RankOnes(model.body.patterns[1:2], np.array([300.0]))
    for name, added in (("springs", None), ("dashpot", dashpot)):
        factor = operators.factor(2.0e4, 5.0e-5, system.contact.springs(1.0e9), added)
        bare = PetscFactor if comm.size == 1 else SubstructuredFactor
        assert isinstance(factor, bare if added is None else UpdatedFactor)
        before = factor.solve(model.body.patterns[1])
        block = factor.interface_block(interface)
        assert block is not None
        assert np.array_equal(block, block.T)
        assert all(np.array_equal(block, other) for other in comm.allgather(block))
        assert np.array_equal(factor.solve(model.body.patterns[1]), before)  # MUMPS's settings are as they were
        mine = np.zeros_like(block)
        mine[interface.slots] = factor.solve_columns(interface, csr_matrix(identity(interface.size)))[interface.owned]
        words[name] = float(np.max(np.abs(operators.sum(mine) - block)) / np.max(np.abs(block)))
        words[f"{name}, diagonal"] = float(np.min(np.diagonal(block)))
    words["change"] = words["springs, diagonal"] - words["dashpot, diagonal"]
    return words


@pytest.mark.slow(minutes=0.3)
def test_block_is_that_by_columns_on_one_rank_and_two() -> None:
    done = on_ranks(2, program="tests.programs.inverse_entries_on_ranks")
    assert done.returncode == 0, done.stderr
    two = json.loads(done.stdout)
    for name, changes in MESHES.items():
        one = compared(changes, MPI.COMM_SELF)
        for words in (one, two[name]):
            assert words["springs"] < 1e-12, (name, words)
            assert words["dashpot"] < 1e-12, (name, words)
            assert words["change"] > 1e-9 * words["springs, diagonal"]  # the dashpot is felt at the faces
        assert two[name]["springs, diagonal"] == pytest.approx(one["springs, diagonal"], rel=1e-9)


@pytest.mark.parametrize("friction", [False, True], ids=["smooth", "friction"])
def test_dropped_columns_change_nothing(friction: bool) -> None:
    """The Delassus operator and what contact forces do, with columns kept and without: friction, too."""
    rubbed = {"contact": {"friction": {"coefficient": 0.3}}} if friction else {}
    found = []
    for columns in ("keep", "drop"):
        system = beam_model({**rubbed, "solver": {"columns": columns}}, LOADS).system
        condensed = CondensedOperator(system, 2.0e4, 1.0)
        forces = np.random.default_rng(0).standard_normal(system.contact.size)
        along = None if system.contact.tangents is None else 0.1 * forces[:, None]
        found.append((condensed.compliance, condensed.correct(np.zeros(system.operators.size), forces, along)))
    for kept, dropped in zip(*found, strict=True):
        assert np.max(np.abs(kept - dropped)) < 1e-12 * np.max(np.abs(kept))


def test_seat_takes_no_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is found as with columns, at the same place, in as many iterations but for where round-off ends them."""
    model = beam_model()
    quick = seat_of(model)
    with monkeypatch.context() as without:
        without.setattr(inverse_entries, "gives_inverse", lambda: False)  # a PETSc that hides the function: by columns
        slow = seat_of(model)
    monkeypatch.setattr(PetscFactor, "solve_columns", None)
    assert np.array_equal(seat_of(model).state.u, quick.state.u)
    assert abs(quick.iterations - slow.iterations) <= 2
    assert np.max(np.abs(quick.state.u[0] - slow.state.u[0])) < 1e-9 * np.max(np.abs(slow.state.u[0]))


def test_errors_of_mumps_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """PETSc refuses what is asked for: an error with its words, and the factor solves as before."""
    model = beam_model({}, LOADS)
    factor = model.system.operators.factor(2.0e4, 5.0e-5)
    before = factor.solve(model.body.patterns[1])
    asked = inverse_entries._wanted

    def not_transposed(*arguments: object) -> tuple[PETSc.Mat, PETSc.Mat]:
        wanted, _ = asked(*arguments)
        return wanted, wanted

    monkeypatch.setattr(inverse_entries, "_wanted", not_transposed)
    with pytest.raises(RunError, match=r"(?s)responses of the contact faces were not found.*spRHS"):
        factor.interface_block(model.system.contact.interface)
    assert np.array_equal(factor.solve(model.body.patterns[1]), before)
