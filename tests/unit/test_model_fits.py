"""What a model cannot do is refused with a reason, and what it can is not."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import gapbeam
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from tests.shared.case_texts import assert_says, faults_of, written
from tests.shared.command import DEMO

REFUSED = {
    "stress at the points": (
        ["model.type=reduced", "contact.formulation=nitsche", "time.scheme=implicit-midpoint"],
        ["model.type", "full: the formulation nitsche", 'formulation = "penalty"'],
    ),
    "constraints on few motions": (
        ["model.type=reduced", "contact.formulation=unilateral"],
        ["model.type", "reduced, with the formulation unilateral", 'contact = "all"'],
    ),
    "constraints on a beam": (
        ["model.type=beam", "contact.formulation=augmented-lagrangian", "time.scheme=implicit-midpoint"],
        ["model.type", "beam, with the formulation augmented-lagrangian"],
    ),
    "massless nodes": (
        ["model.type=beam", "contact.mass=redistributed"],
        ["contact.mass", "consistent", "leave mass out"],
    ),
    "friction": (
        ["model.type=reduced", "contact.friction.coefficient=0.2"],
        ["contact.friction", "a coefficient of 0.2, with the model reduced", 'contact = "all" in [model]'],
    ),
    "explicit": (
        ["model.type=reduced", "time.scheme=central-difference"],
        ["time.scheme", "central-difference, with the model reduced", "discrete-gradient"],
    ),
    "explicit on a rigid body": (
        ["model.type=rigid", "time.scheme=central-difference"],
        ["time.scheme", "central-difference, with the model rigid", "lumped masses"],
    ),
    "constraints on a rigid body": (
        ["model.type=rigid", "contact.formulation=unilateral"],
        ["model.type", "rigid, with the formulation unilateral"],
    ),
    "along a beam that has no axial motion": (
        ["model.type=beam", "load.shaker.direction=[1.0, 1.0]", 'model.motions=["bending"]'],
        ["model.motions", '"axial" among them: the load shaker acts along the beam', '"bending", "axial"', "or auto"],
    ),
    "friction on a beam that has no axial motion": (
        ["model.type=beam", "contact.friction.coefficient=0.2", 'model.motions=["bending"]'],
        ["model.motions", "friction acts along the beam"],
    ),
    "a slice that twists": (
        ["model.type=beam", 'model.motions=["bending", "torsion"]'],
        ["model.motions", '"torsion", of a slice', "dimension = 3"],
    ),
    "a beam that does not bend": (
        ["model.type=beam", 'model.motions=["axial"]'],
        ["model.motions", "every beam bends"],
    ),
    "friction on a rigid body": (
        ["model.type=rigid", "contact.friction.coefficient=0.2"],
        ["contact.friction", "a coefficient of 0.2, with the model rigid", "full, beam, or reduced"],
    ),
}


@pytest.mark.parametrize(("overrides", "words"), REFUSED.values(), ids=REFUSED)
def test_what_a_model_cannot_do_is_refused(tmp_path: Path, overrides: list[str], words: list[str]) -> None:
    faults = faults_of(written(tmp_path), overrides)
    assert len(faults) == 1, "\n".join(map(str, faults))
    assert_says(faults[0], words)


def test_a_mesh_file_has_no_section(tmp_path: Path) -> None:
    (tmp_path / "beam.msh").write_text("$MeshFormat\n")
    faults = faults_of(written(tmp_path), ["model.type=beam", 'mesh.file="beam.msh"', "mesh.degree=1"])
    assert any("beam, with a mesh file" in str(fault) and 'type = "reduced"' in str(fault) for fault in faults)


@pytest.mark.parametrize(
    "overrides",
    [
        ["model=reduced"],
        ["model=beam", "load.shaker.direction=[0.0, -1.0]"],
        ["model=beam", "load.shaker.direction=[1.0, 1.0]"],
        ["model.type=beam", 'model.motions=["bending", "axial"]'],
        ["model.type=beam", "contact.friction.coefficient=0.2"],
        ["model=rigid", "load.shaker.direction=[1.0, 1.0]"],
        ["model.type=reduced", "model.contact=all", "contact.formulation=unilateral"],
        ["model.type=reduced", "model.contact=all", "contact.friction.coefficient=0.2"],
        ["model.type=beam", "contact.points=[0.0, 0.025, 0.05]", "contact.stiffness=1e6"],
    ],
    ids=" ".join,
)
def test_what_it_can_is_not(tmp_path: Path, overrides: list[str]) -> None:
    assert read_case(written(tmp_path), overrides).model.type != "full"


def test_a_support_with_few_beam_elements_is_reported(tmp_path: Path) -> None:
    path = written(tmp_path)
    (line,) = (
        text for text in warnings(read_case(path, ["model.type=beam", "model.elements=20"])) if "[model]" in text
    )
    assert "leaves 2 of them to the support" in line
    assert "elements = 51" in line
    assert not any("[model]" in text for text in warnings(read_case(path, ["model.type=beam", "model.elements=51"])))


SLOTS: list[dict[str, object]] = [
    {"name": name, "from": x, "to": x + 0.02, "clearance": 1e-4} for name, x in (("a", 0.0), ("b", 0.2), ("c", 0.4))
]
NO_FRICTION = {
    "a reduced model": {"model": "reduced"},
    "a rigid body": {"model": "rigid"},
    "an explicit scheme": {"time.scheme": "central-difference", "contact.mass": "redistributed"},
    "the stress of the body": {"contact.formulation": "nitsche"},
    "a periodic response": {"analysis": {"type": "periodic"}},
    "an iterative solver": {"solver.effective": "iterative"},
}


@pytest.mark.parametrize("changes", NO_FRICTION.values(), ids=NO_FRICTION)
@given(number=st.integers(0, 2), coefficient=st.floats(0.01, 2.0).map(lambda one: round(one, 3)))
def test_friction_is_refused_where_it_is_given(changes: dict[str, object], number: int, coefficient: float) -> None:
    """That of a support was blamed on [contact.friction], a table that the case does not have, "a coefficient of 0"."""
    supports = [slot | ({"friction": coefficient} if i == number else {}) for i, slot in enumerate(SLOTS)]
    gapbeam.read_case(DEMO, {"support": SLOTS, **changes})
    with pytest.raises(gapbeam.CaseError) as refused:
        gapbeam.read_case(DEMO, {"support": supports, **changes})
    (fault,) = (one for one in refused.value.faults if "friction" in str(one))
    assert ("support", number, "friction") in (fault.key, *fault.related)
    assert "a coefficient of" not in fault.found or f"a coefficient of {coefficient:g}" in fault.found
