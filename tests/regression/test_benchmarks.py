"""The benchmarks on tiny meshes: the textbook's Newton finds what gapbeam finds, and tables are written."""

from __future__ import annotations

import importlib
import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from benchmarks import calculix_peer, costs, getfem_peer, section_modes, section_shear, textbook, two_structures
from benchmarks.table import Table, exponent, seconds
from benchmarks.textbook import TextbookBeam
from docs.tables.narrow_tables import narrow
from gapbeam.solver.case.case import Case
from gapbeam.solver.march.simulation import march_of_model
from gapbeam.solver.march.stepwise_march import march
from gapbeam.solver.models.model import build_model
from gapbeam.solver.system.semi_discrete import VALUE
from tests.shared.forms import needs_gcc
from tests.shared.models import SOLID, beam_case, thrown

alone = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="the textbook knows one rank")

model_levels = importlib.import_module("benchmarks.fidelity_levels")
SHAKER = {"type": "harmonic_force", "name": "shaker", "point": 0.15, "amplitude": 500.0, "frequency": 100.0}
DAMPING = {"frequencies": [40.0, 300.0], "ratios": [0.01, 0.01]}


def shaken(dimension: int = 3, steps: int = 40) -> Case:
    """Return a beam that is shaken hard, by the scheme that the textbook's residual is written for."""
    changes = {"time": {"scheme": "implicit-midpoint", "end": steps * 1.0e-4}, "damping": DAMPING}
    if dimension == 3:
        changes["mesh"] = SOLID
    return beam_case(changes, ({"type": "gravity"}, SHAKER), {"tip": 0.51})


@alone
@needs_gcc
@pytest.mark.parametrize("factorization", [pytest.param("lu", marks=pytest.mark.slow(minutes=0.1)), "cholesky"])
def test_textbook_agrees(factorization: str) -> None:
    """A solid beam that rattles: the same displacements to 1e-8 of the largest, and a table that says so."""
    table = textbook.compare(shaken(), {factorization: textbook.STEPS}, 20)
    assert table.figures["difference"] <= 1e-8
    assert table.figures["difference"] > 0.0
    assert "is below 1e-08" in table.markdown()


@alone
@needs_gcc
def test_textbook_agrees_on_a_slice_that_strikes_both_faces() -> None:
    """The slice in plane stress thrown through its gap: points of both faces close and open; the motions agree."""
    model = build_model(shaken(2, 60), MPI.COMM_SELF)
    start = thrown(model)
    beam = TextbookBeam(model.case, model, start)
    contact, counts = model.system.contact, []
    for step in march(march_of_model(model, model.case.time.scheme), start):
        beam.advance()
        mine = (step.refreshed or step.new).u[VALUE]
        assert np.max(np.abs(beam.displacement - mine)) <= 1e-8 * np.max(np.abs(mine))
        pressed = step.new.pressure > 0.0
        counts.append([np.count_nonzero(pressed[contact.faces == face]) for face in (0, 1)])
    for face in np.array(counts).T:
        assert face.max() > 0
        assert face.min() == 0


def test_table_is_written(tmp_path: Path) -> None:
    """Markdown for people, JSON with the machine for programs."""
    Table("one", "A title", ("a", "b"), (("x", 1.23456), (None, 7)), ("a note",), {"found": 2.0}).write(tmp_path)
    text = (tmp_path / "one.md").read_text()
    assert "| x | 1.23 |" in text
    assert "| - | 7 |" in text
    assert "* a note" in text
    words = json.loads((tmp_path / "one.json").read_text())
    assert words["figures"] == {"found": 2.0}
    assert words["machine"]["dolfinx"]


@alone
@pytest.mark.slow
def test_sizes_are_measured_in_processes_of_their_own() -> None:
    """Two coarse meshes: unknowns and interface DOFs grow, and every cost has an exponent."""
    found = costs.size_table((1, 2))
    assert [row[0] for row in found.rows] == [3075, 5025]
    assert found.rows[0][2] < found.rows[1][2]
    assert set(found.figures) == {f"exponent_{name}" for name in costs.COSTS}


@alone
def test_contact_points_grow_with_the_quadrature(monkeypatch: pytest.MonkeyPatch) -> None:
    """One and four points in a facet."""
    monkeypatch.setattr(costs, "measured", lambda _, keys: POINTS[keys[0].rpartition("=")[2]])
    found = costs.points_table((1, 3))
    assert [row[0] for row in found.rows] == [100, 400]
    assert found.figures["exponent"] == pytest.approx(0.5)


POINTS = {
    degree: {
        "dofs": 1000.0,
        "points": points,
        "delassus": 1.0,
        "step": 1.0 + rest,
        "back_substitution": 1.0,
        "iterations": 2.0,
        "memory": 1e9,
    }
    for degree, points, rest in (("1", 100.0, 0.1), ("3", 400.0, 0.2))
}


@alone
@pytest.mark.slow
def test_levels_are_compared_with_the_full_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """A coarse slice in a basis with all contact DOFs: within 1e-5 in displacement; the table has every figure."""
    monkeypatch.setattr(model_levels, "TEXTBOOK_STEPS", 1)
    coarse = ("mesh.size=0.03", "mesh.support_size=0.0125", "mesh.cells_through_thickness=2")
    basis = (*coarse, *model_levels.REDUCED, "model.contact=all", "model.points_across=all", "model.modes=30")
    found = model_levels.table(
        {"full": (model_levels.SLICE, coarse), "basis": (model_levels.SLICE, basis)}, "time.end=0.3"
    )
    assert [row[0] for row in found.rows] == ["full", "basis"]
    assert 0.0 < found.figures["basis: at the same times"] <= 1e-5
    assert None not in found.rows[1]
    assert found.rows[1][1] < found.rows[0][1]


def test_getfem_is_optional(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it the table has no rows and says how to get it."""
    monkeypatch.setattr(getfem_peer.importlib.util, "find_spec", lambda _: None)
    found = getfem_peer.table()
    assert found.rows == ()
    assert "no python3-getfem here" in found.markdown()


@alone
@pytest.mark.skipif(importlib.util.find_spec("getfem") is None, reason="python3-getfem is optional")
def test_getfem_agrees() -> None:
    """The slice of cases/demo.toml: the same seat and the same steps."""
    (row,) = getfem_peer.table(("demo.toml",), 40).rows
    assert max(row[2:5]) <= 1e-5


def test_calculix_is_optional(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it the table has no rows and says so."""
    monkeypatch.setattr(calculix_peer, "program", lambda: None)
    assert calculix_peer.table().rows == ()
    assert "no ccx here" in calculix_peer.table().markdown()


@alone
@pytest.mark.slow(minutes=1)
@pytest.mark.skipif(calculix_peer.program() is None, reason="calculix-ccx is optional")
def test_calculix_agrees() -> None:
    """Frequencies to its seven digits and the mass that it integrates, and a motion until after its first impact."""
    found = calculix_peer.table((6e-3, 2), 100).rows
    differences = {str(row[0]).split(",")[-1].strip(): float(row[2] or 0.0) for row in found}
    assert differences["as read"] <= 1e-13
    assert differences["and read again"] <= 1e-13
    assert differences["matrices of CalculiX"] <= 1e-6
    assert differences[f"{calculix_peer.PIPE_MODES} frequencies of a pipe"] <= 0.02
    assert differences["gaps open"] <= 0.02
    assert differences["gaps closed"] <= 0.02
    assert max(float(row[2] or 0.0) for row in found if "motion" in str(row[0])) <= 1e-4
    assert not any(" 0 impacts" in str(row[0]) for row in found)


@pytest.mark.slow(minutes=0.2)
def test_two_structures_have_as_many_unknowns_as_one() -> None:
    """Both are measured: each block is clamped at one end, so that their DOFs add up."""
    (_, one, *_), (_, two, *_) = two_structures.table((6, 4, 4)).rows
    assert one == two


def test_wide_tables_are_split() -> None:
    """Every part begins with the key columns, and no cell is lost; a narrow table stays as it is."""
    wide = "| n | m | a | b | c |\n|---|---|---|---|---|\n| 1 | 2 | 3 | 4 | 5 |\n"
    first = "| n | m | a | b |\n| --- | --- | --- | --- |\n| 1 | 2 | 3 | 4 |\n"
    second = "| n | m | c |\n| --- | --- | --- |\n| 1 | 2 | 5 |\n"
    assert narrow(f"before\n\n{wide}after\n", keys=2, most=4) == f"before\n\n{first}\n{second}after\n"
    assert narrow(wide, keys=2) == wide


def test_exponents_and_durations() -> None:
    """A power law gives its power back; durations have the unit that suits them."""
    sizes = [10.0, 100.0, 1000.0]
    assert exponent(sizes, [3.0 * n**1.5 for n in sizes]) == pytest.approx(1.5)
    assert [seconds(t) for t in (12.345, 0.0123, 4.5e-6)] == ["12.3 s", "12.3 ms", "4.5 us"]


@alone
def test_frequencies_of_sections_are_those_of_beam_theory() -> None:
    """A box on a coarse mesh: Euler and Bernoulli's first frequency, and four of the solid without its axial mode."""
    coarse = {"size": 0.08, "support_size": 0.025, "cells_through_thickness": 2, "cells_across_width": 2}
    ((name, beam, solid),) = section_modes.rows({"box": (section_modes.BOX, 0.03)}, coarse)
    elements, mesh = (np.array([float(value) for value in str(cell).split(", ")]) for cell in (beam, solid))
    area, second = 0.04 * 0.03 - 0.032 * 0.022, (0.03 * 0.04**3 - 0.022 * 0.032**3) / 12.0
    first = 1.8751040687**2 / (2.0 * np.pi * 0.6**2) * np.sqrt(2.1e11 * second / (7919.0 * area))
    assert name == "box"
    assert elements[0] == pytest.approx(first, rel=0.015)
    assert elements[0] < first, "shear and rotary inertia slow it"
    assert len(elements) == 4
    assert mesh == pytest.approx(elements, rel=0.015)


def test_thick_walls_carry_more_shear_than_the_formulas_for_thin_ones_say() -> None:
    """One row of the table: a box and an I section with walls of 6 mm."""
    ((name, *both),) = section_shear.rows((0.006,))
    assert name == "6 mm"
    for cell in both:
        polygon, formula = map(float, str(cell).split(", "))
        assert 1.1 < polygon / formula < 1.25


@alone
@pytest.mark.slow(minutes=2)
def test_ways_to_solve_are_measured() -> None:
    """The two coarsest meshes, with a factor and by iterations: every figure is there and costs something."""
    found = costs.ways_table({"factor": (1, 2), "iterations": (1,)})
    assert [row[:2] for row in found.rows] == [("factor", 3075), ("factor", 5025), ("iterations", 3075)]
    small, large = (("factor", 3075), ("factor", 5025))
    for way, dofs in (small, large, ("iterations", 3075)):
        assert found.figures[f"{way}, {dofs}: step"] > 0.0
        assert found.figures[f"{way}, {dofs}: memory"] > 0.0
    memory = [found.figures[f"{way}, {dofs}: memory"] for way, dofs in (small, large)]
    # its sign is not known: meshes as coarse as these take less than their processes differ by
    exponent = np.log(memory[1] / memory[0]) / np.log(5025 / 3075)
    assert found.figures["factor: exponent of memory"] == pytest.approx(exponent)
