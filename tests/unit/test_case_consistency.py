"""Contradictions between tables, and warnings about what is allowed but probably not meant."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.checks import all_checks
from gapbeam.solver.case.checks.all_checks import CHECKS, contradictions_in
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from tests.shared.case_texts import GOOD, assert_says, faults_of, spoiled, written

CONTRADICTIONS = {
    "support longer than the beam": (
        "length = 0.050",
        "length = 0.6",
        ["[support] length", "0.6 m", "at most the length of the beam, 0.51 m"],
    ),
    "interference in mm": (
        "clearance = 0.107e-3",
        "clearance = -0.008",
        ["[support] clearance", "more than half the thickness", "at least -0.006 m", "In m it is -8e-06"],
    ),
    "damping in two ways": (
        "ratios = [0.01, 0.01]",
        "ratios = [0.01, 0.01]\nmass = 1.0\nstiffness = 1e-5",
        ["[damping] stiffness", "in two ways", "frequencies and ratios, or mass and stiffness", "remove"],
    ),
    "ratios alone": (
        "frequencies = [40.0, 300.0]\n",
        "",
        ["[damping] ratios", "ratios without frequencies", "both", "add frequencies"],
    ),
    "frequencies alone": ("ratios = [0.01, 0.01]\n", "", ["[damping] frequencies", "add ratios"]),
    "mass alone": (
        "frequencies = [40.0, 300.0]\nratios = [0.01, 0.01]",
        "mass = 4.0",
        ["[damping] mass", "mass without stiffness", "add stiffness; stiffness = 0.0 if there is none"],
    ),
    "equal frequencies": (
        "frequencies = [40.0, 300.0]",
        "frequencies = [40.0, 40.0]",
        ["[damping] frequencies", "40 Hz twice", "two different frequencies"],
    ),
    "negative mass coefficient": (
        "ratios = [0.01, 0.01]",
        "ratios = [0.01, 0.1]",
        ["[damping] ratios", "mass becomes negative", "a ratio from 0.001333 to 0.075 at 300 Hz"],
    ),
    "negative stiffness coefficient": (
        "ratios = [0.01, 0.01]",
        "ratios = [0.01, 0.001]",
        ["[damping] ratios", "stiffness becomes negative", "closer together"],
    ),
    "solid cells in 2D": (
        "degree = 2",
        'cell = "hexahedron"',
        [
            "[mesh] cell",
            '"hexahedron" with dimension = 2',
            '"triangle" or "quadrilateral"',
            'cell = "quadrilateral"',
        ],
    ),
    "flat cells in 3D": (
        "dimension = 2",
        'dimension = 3\ncell = "triangle"',
        ["[mesh] cell", '"tetrahedron" or "hexahedron" in 3D', 'cell = "tetrahedron", or dimension = 2'],
    ),
    "width in 2D": (
        "degree = 2",
        "cells_across_width = 4",
        ["[mesh] cells_across_width", "no such key in 2D", "remove it, or dimension = 3"],
    ),
    "plane strain in 3D": (
        "dimension = 2",
        'dimension = 3\nplane = "strain"',
        ["[mesh] plane", "no such key in 3D", "remove it, or dimension = 2"],
    ),
    "cells longer than the beam": ("degree = 2", "size = 20", ["[mesh] size", "20 m", "at most", "0.51 m"]),
    "cells longer than the support": (
        "degree = 2",
        "support_size = 0.06",
        ["[mesh] support_size", "at most the length of the support, 0.05 m"],
    ),
    "coarse edge": (
        "degree = 2",
        "edge_size = 0.01",
        ["[mesh] edge_size", "at most support_size, 0.004 m (default thickness/3)"],
    ),
    "no mesh file": (
        "degree = 2",
        'file = "beam.msh"',
        ["[mesh] file", "/beam.msh', where there is no file", "relative to the case file"],
    ),
    "mesh file of 5000 letters": (
        "degree = 2",
        f'file = "{"x" * 5000}.msh"',
        ["[mesh] file", "where there is no file", "relative to the case file"],
    ),
    "mesh of another program": ("degree = 2", 'file = "beam.inp"', ["[mesh] file", ".msh"]),
    "force beyond the tip": (
        "point = 0.15",
        "point = 0.52",
        ['[[load]] number 2 (name "shaker") point', "x = 0.52 m, outside the beam", "x from 0 to 0.51 m"],
    ),
    "force in mm": ("point = 0.15", "point = 150", ['(name "shaker") point', "in mm? In m it is 0.15"]),
    "probe before the support": (
        "point = 0.510",
        "point = -0.01",
        ['[[probe]] number 1 (name "tip") point', "x = -0.01 m, outside", "x from 0 to 0.51 m"],
    ),
    "probe above the beam": (
        "point = 0.510",
        "point = [0.510, 0.012]",
        ['(name "tip") point', "y = 0.012 m, outside", "y from -0.006 to 0.006 m", "y = 0 is the axis"],
    ),
    "probe beside the beam": (
        "dimension = 2\ndegree = 2",
        'dimension = 3\n[[probe]]\nname = "side"\npoint = [0.1, 0.02, 0.0]',
        ['[[probe]] number 1 (name "side") point', "y = 0.02 m, outside", "y from -0.01 to 0.01 m"],
    ),
    "three coordinates in 2D": (
        "point = 0.510",
        "point = [0.510, 0, 0]",
        ['(name "tip") point', "3 coordinates", "x alone, or [x, y] in 2D", "point = 0.51"],
    ),
    "points a hair apart": (
        "point = 0.15",
        "point = 0.5099999",
        ['(name "shaker") point', "[[load]] number 2", "apart along x", "the same x, or at least 1.2e-06 m"],
    ),
    "no node on the axis": (
        "degree = 2",
        "degree = 1\ncells_through_thickness = 3",
        ["[mesh] cells_through_thickness", "no node", "an even number of cells, or degree = 2", "= 4"],
    ),
    "direction in 3D": (
        "amplitude = 20.0",
        "amplitude = 20.0\ndirection = [0, 0, 1]",
        ['(name "shaker") direction', "3 components with dimension = 2", "direction = [0.0, 1.0]"],
    ),
    "slanted direction in 3D": (
        "amplitude = 20.0",
        "amplitude = 20.0\ndirection = [-1, 0, 0.5]",
        ['(name "shaker") direction', "3 components with dimension = 2", "direction = [-1.0, 0.5]"],
    ),
    "sideways direction": (
        "amplitude = 20.0",
        "amplitude = 20.0\ndirection = [0, 1, 0]",
        ['(name "shaker") direction', "3 components with dimension = 2", "[0.0, 1.0] is upward"],
    ),
    "no direction": (
        "amplitude = 20.0",
        "amplitude = 20.0\ndirection = [0, 0]",
        ['(name "shaker") direction', "length 0", "any other length"],
    ),
    "gravity twice": (
        'type = "gravity"',
        'type = "gravity"\n[[load]]\ntype = "gravity"\nname = "more"',
        ['[[load]] number 2 (name "more") type', "gravity, twice", "remove one"],
    ),
    "loads of one name": (
        'type = "gravity"',
        'type = "harmonic_force"\nname = "shaker"\npoint = 0.3\namplitude = 1.0\nfrequency = 20.0',
        ['[[load]] number 2 (name "shaker") name', "also the name of number 1", 'name = "shaker_2"'],
    ),
    "probes of one name": (
        'name = "tip"',
        'name = "tip"\npoint = 0.3\n[[probe]]\nname = "tip"',
        ['[[probe]] number 2 (name "tip") name', "also the name of number 1", "a different name"],
    ),
    "end before the first step": (
        "end = 0.6",
        "end = 0.5e-4",
        ["[time] step", "0.0001 s, longer than the whole run", "swapped"],
    ),
    "a billion steps": (
        "step = 1.0e-4\n",
        "step = 1.0e-13\n",
        ["[time] step", "6e+12 steps", "at most 1e+09 steps", "6e-06 s makes 100000"],
    ),
    "step of half a period": (
        "step = 1.0e-4\n",
        "step = 0.025\n",
        ["[time] step", "a load of 20 Hz", "far less than 0.025 s, half its period", "step = 0.001"],
    ),
    "interest below the forcing": (
        "step = 1.0e-4\n",
        'step = "auto"\nfrequency = 10.0\n',
        ["[time] frequency", "10 Hz, with a load of 20 Hz", "at least the frequency", "frequency = 100"],
    ),
    "records between steps": (
        "[output]",
        "[output]\nhistory_interval = 2.5e-4",
        [
            "[output] history_interval",
            "2.5 steps of 0.0001 s",
            "a whole number of steps",
            "history_interval = 0.0002",
        ],
    ),
    "records within steps": (
        "[output]",
        "[output]\nhistory_interval = 1.0e-5",
        ["[output] history_interval", "0.1 steps", "at least 1", "history_interval = 0.0001"],
    ),
    "law without its formulation": (
        'stiffness = "auto"',
        'formulation = "nitsche"\nlaw = { type = "hunt-crossley", restitution = 0.8 }',
        ["[contact.law]", "hunt-crossley", "kelvin-voigt", 'formulation = "penalty"'],
    ),
    "damping of another law": (
        'stiffness = "auto"',
        'damping = 1e4\nlaw = { type = "hunt-crossley", restitution = 0.8 }',
        ["[contact] damping", "10000 Pa s/m", "the law hunt-crossley brings its own damping"],
    ),
    "damping without a law": (
        'stiffness = "auto"',
        'damping = 1e4\nformulation = "unilateral"',
        ["[contact] damping", "the formulation unilateral has no damping"],
    ),
    "stiffness of exact contact": (
        'stiffness = "auto"',
        'stiffness = 1e12\nformulation = "unilateral"',
        ["[contact] stiffness", "1e+12 Pa/m", "has no stiffness to choose", "leave stiffness out"],
    ),
    "stiffness with an exponent": (
        'stiffness = "auto"',
        'law = { type = "hunt-crossley", restitution = 0.8, exponent = 1.5 }',
        ["[contact] stiffness", '"auto"', "a number in Pa/m^1.5", "stiffness = 1e15"],
    ),
    "no potential": (
        'stiffness = "auto"',
        'formulation = { type = "nitsche", theta = -1 }',
        ["[time] scheme", "nitsche, theta = -1", 'scheme = "implicit-midpoint"'],
    ),
    "friction by the stress of the body": (
        'stiffness = "auto"',
        'formulation = "nitsche"\nfriction = { coefficient = 0.2 }',
        ["[contact.friction]", "0.2 with the formulation nitsche", "penalty, unilateral or", "leave friction out"],
    ),
    "static friction below sliding friction": (
        'stiffness = "auto"',
        "friction = { coefficient = 0.2, static_coefficient = 0.1 }",
        ["friction] static_coefficient", "0.1, less than the 0.2 of points that slide", "static_coefficient = 0.3"],
    ),
    "static friction alone": (
        'stiffness = "auto"',
        "friction = { coefficient = 0.0, static_coefficient = 0.1 }",
        ["friction] static_coefficient", "0.1, with a coefficient of 0", "leave static_coefficient out"],
    ),
    "deep touch": (
        'stiffness = "auto"',
        "touch_depth = 1e-3",
        ["[contact] touch_depth", "far less than the clearance, 0.000107 m", "touch_depth = 1.07e-08"],
    ),
    "gates": (
        "[output]",
        "[gates]\ntotal_growth = 0.001\n[output]",
        ["[gates] total_growth", "less than impact_growth, 0.0025", "total_growth = 0.05"],
    ),
}

WARNINGS = {
    "clearance in mm": ("clearance = 0.107e-3", "clearance = 0.107", "is it in mm, 0.000107 m?"),
    "stiffness of a feather": (
        'stiffness = "auto"',
        "stiffness = 1e5",
        "stiffness = 100000 Pa/m: the weight pushes the beam 0.095 m in, more than its thickness: is it N/m?",
    ),
    "modulus in GPa": (
        "young_modulus = 2.1e11",
        "young_modulus = 210",
        "[material] young_modulus = 210 is unusual",
    ),
    "density in g/cm^3": (
        "density = 7919.0",
        "density = 7.9",
        "[material] density = 7.9 is unusual; the unit is kg/m^3",
    ),
    "modulus in MPa": (
        "young_modulus = 2.1e11",
        "young_modulus = 2.1e5",
        "less than any material of the density 7919 kg/m^3 has: is it in MPa, 2.1e+11 Pa?",
    ),
    "modulus in GPa, asked": ("young_modulus = 2.1e11", "young_modulus = 210", "is it in GPa, 2.1e+11 Pa?"),
    "density in g/cm^3, asked": ("density = 7919.0", "density = 7.85", "is it in g/cm^3, 7850 kg/m^3?"),
    "density in t/mm^3": ("density = 7919.0", "density = 7.85e-9", "is it in t/mm^3, 7850 kg/m^3?"),
    "length in mm, asked": ("length = 0.510", "length = 450.0", "is it in mm, 0.45 m?"),
    "thickness in mm": (
        "thickness = 0.012",
        "thickness = 12.0",
        "[beam] thickness = 12 is unusual; the unit is m, not mm; is it in mm, 0.012 m?",
    ),
    "thin thickness in mm": (
        "thickness = 0.012",
        "thickness = 6.0",
        "[beam] thickness = 6 is more than the length, 0.51 m: is it in mm, 0.006 m?",
    ),
    "width in mm": (
        "width = 0.020",
        "width = 8.0",
        "[beam] width = 8 is more than the length, 0.51 m: is it in mm, 0.008 m?",
    ),
    "yield stress in MPa": (
        "density = 7919.0",
        "density = 7919.0\nyield_stress = 355",
        "[material] yield_stress = 355 is unusual; the unit is Pa: is it in MPa, 3.55e+08 Pa?",
    ),
    "damping in percent": (
        "ratios = [0.01, 0.01]",
        "ratios = [1.0, 1.0]",
        "1 of critical damping is unusual: is it in %, 0.01?",
    ),
    "frequency in kHz": (
        "frequency = 20.0",
        "frequency = 0.02",
        "its period, 50 s, is longer than the run, 0.6 s: is it in kHz, 20 Hz",
    ),
    "length in mm": ("length = 0.510", "length = 510.0", "[beam] length = 510 is unusual; the unit is m"),
    "loose support": ("clearance = 0.107e-3", "clearance = 5e-3", "lets the beam tilt by 5.7 degrees"),
    "tight support": ("clearance = 0.107e-3", "clearance = -0.5e-3", "squeezes the beam by 4.2 %"),
    "block": ("thickness = 0.012", "thickness = 0.2", "this is hardly a beam"),
    "gravity in mm/s^2": ('type = "gravity"', 'type = "gravity"\nacceleration = 9810', "the unit is m/s^2"),
    "no weight": ('type = "gravity"', 'type = "gravity"\nacceleration = 0', "nothing seats the beam"),
    "no force": ("amplitude = 20.0", "amplitude = 0", "amplitude = 0: it does nothing"),
    "long ramp": ("amplitude = 20.0", "amplitude = 20.0\nramp = 1.0", "ramp = 1 is longer than the run"),
    "jump": ("amplitude = 20.0", "amplitude = 20.0\nphase = 90", "starts with a jump"),
    "few steps in a period": (
        "step = 1.0e-4\n",
        "step = 4.0e-3\n",
        "12.5 steps in a period of the load shaker",
    ),
    "end between steps": ("end = 0.6", "end = 0.60003", "not a whole number of steps"),
    "newmark": ('"discrete-gradient"', '"newmark"', "creates energy at impacts"),
    "unstable newmark": (
        '"discrete-gradient"',
        '{ type = "newmark", beta = 0.2, gamma = 0.6 }',
        "unstable unless the step is tiny",
    ),
    "generalized-alpha": (
        '"discrete-gradient"',
        '{ type = "generalized-alpha", rho_inf = 0.9 }',
        "rho_inf = 0.9",
    ),
    "soft contact": ('stiffness = "auto"', "stiffness = 1e8", "more than a tenth of the clearance"),
    "adhesive without damping": ('stiffness = "auto"', 'tension = "adhesive"', "no effect without damping"),
    "coarse quadrature": (
        'stiffness = "auto"',
        "quadrature_degree = 1",
        "quadrature_degree = 1 is low: 4 or more",
    ),
    "few records": ("[output]", "[output]\nhistory_interval = 1.0e-2", "5 records in a period"),
    "many fields": ("[output]", "[output]\nfields_interval = 1.0e-5\n", "6e+04 fields"),
    "odd cells": ("degree = 2", "cells_through_thickness = 3", "cells_through_thickness is odd"),
    "large mesh": (
        "dimension = 2\ndegree = 2",
        "dimension = 3\nsize = 1e-4\nsupport_size = 1e-4",
        "GB of memory",
    ),
    "no probe": ('[[probe]]\nname = "tip"\npoint = 0.510\n', "", "no [[probe]]"),
    "no damping": ("frequencies = [40.0, 300.0]\nratios = [0.01, 0.01]", "", "motion never fades"),
    "lateral springs in 2D": (
        "[time]",
        "[restraint]\nlateral = 5\n[time]",
        "[restraint] lateral has no effect in 2D",
    ),
}


@pytest.mark.parametrize(("old", "new", "words"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_a_contradiction_is_explained(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    path = written(tmp_path, spoiled(old, new))
    faults = faults_of(path)
    assert len(faults) == 1, "one mistake, one fault:\n" + "\n".join(map(str, faults))
    assert faults[0].where.startswith(f"{path}:")
    assert_says(faults[0], words)


def test_no_question_about_usual_cases(tmp_path: Path) -> None:
    """Light, soft, dense, thin and slow cases that mean what they say are not asked about."""
    for old, new in (
        ("density = 7919.0", "density = 1100.0\nyield_stress = 2e7"),
        ("young_modulus = 2.1e11", "young_modulus = 3.0e9"),
        ("frequency = 20.0", "frequency = 2.0"),
        ("end = 0.6", "end = 0.02"),
        ("width = 0.020", "width = 0.3"),
    ):
        case = read_case(written(tmp_path, spoiled(old, new)))
        assert [line for line in warnings(case) if "is it in" in line] == []
    rubber = spoiled("young_modulus = 2.1e11", "young_modulus = 5e6").replace("density = 7919.0", "density = 1200.0")
    assert [line for line in warnings(read_case(written(tmp_path, rubber))) if "is it in" in line] == []


SCHEMES_AND_CONTACT = {
    "explicit without a law": (
        "central-difference",
        'formulation = "nitsche"',
        ["[contact] formulation", "nitsche", "the scheme central-difference is explicit", 'formulation = "penalty"'],
    ),
    "explicit and exact": (
        "central-difference",
        'formulation = "unilateral"',
        ["[contact] mass", "consistent", "only massless nodes", 'mass = "redistributed"'],
    ),
    "explicit friction": (
        "central-difference",
        "friction = { coefficient = 0.2 }",
        ["[contact.friction]", "a coefficient of 0.2", "an implicit scheme", 'scheme = "discrete-gradient"'],
    ),
    "impulses on nothing": (
        "moreau-jean",
        'formulation = "unilateral"\nmass = "redistributed"',
        ["[contact] mass", "redistributed", "the impulses of the scheme moreau-jean", "leave mass out"],
    ),
}


@pytest.mark.parametrize(("scheme", "contact", "words"), SCHEMES_AND_CONTACT.values(), ids=SCHEMES_AND_CONTACT)
def test_a_scheme_that_the_contact_does_not_suit(tmp_path: Path, scheme: str, contact: str, words: list[str]) -> None:
    text = spoiled('scheme = "discrete-gradient"', f'scheme = "{scheme}"').replace('stiffness = "auto"', contact)
    (fault,) = faults_of(written(tmp_path, text))
    assert_says(fault, words)


@pytest.mark.parametrize(("old", "new", "words"), WARNINGS.values(), ids=WARNINGS)
def test_a_warning_is_given(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = spoiled(old, new)
    if "fields_interval" in new:
        text = text.replace("step = 1.0e-4", "step = 1.0e-5")
    lines = warnings(read_case(written(tmp_path, text)))
    assert any(words in line for line in lines), lines


def test_a_good_case_warns_of_nothing(tmp_path: Path) -> None:
    assert warnings(read_case(written(tmp_path))) == []


def test_checks_take_tables_of_a_case() -> None:
    """A check whose parameter is no table would never be made."""
    assert frozenset().union(*CHECKS.values()) <= set(Case.model_fields)
    files = {check.__module__.rpartition(".")[2] for check in CHECKS if inspect.isfunction(check)}
    assert files == {path.stem for path in Path(all_checks.__file__).parent.glob("*_checks.py")} - {"all_checks"}


def test_a_mesh_file_leaves_nothing_for_other_keys_to_say(tmp_path: Path) -> None:
    (tmp_path / "beam.msh").touch()
    text = spoiled("degree = 2", 'file = "beam.msh"\nsize = 0.01\ncell = "triangle"\ncells_through_thickness = 4')
    faults = faults_of(written(tmp_path, text))
    assert [fault.key[1] for fault in faults] == ["size", "cell", "cells_through_thickness"]
    assert all("the file already holds its cells" in fault.expected for fault in faults)


def test_a_mesh_file_in_the_current_folder_is_pointed_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = tmp_path / "here"
    here.mkdir()
    (here / "beam.msh").touch()
    monkeypatch.chdir(here)
    (fault,) = faults_of(written(tmp_path, spoiled("degree = 2", 'file = "beam.msh"')))
    assert f"{here / 'beam.msh'} is a file" in fault.hint


def test_contradictions_are_reported_together_with_faults_of_other_tables(tmp_path: Path) -> None:
    text = GOOD.replace("length = 0.050", "length = 0.6").replace("density = 7919.0", "density = true")
    text = text.replace("ratios = [0.01, 0.01]\n", "").replace("[output]", "[output]\nhistory_interval = 1.5e-4")
    assert [fault.key for fault in faults_of(written(tmp_path, text))] == [
        ("material", "density"),
        ("damping", "frequencies"),
        ("support", "length"),
        ("output", "history_interval"),
    ]


@pytest.mark.parametrize("formulation", ["unilateral", "augmented-lagrangian"])
def test_exact_contact_does_not_start_within_the_faces(tmp_path: Path, formulation: str) -> None:
    """A discrete gradient threw the beam out by 0.2 m in a step, and impulses left it where it was, with status 0."""
    path, exact = written(tmp_path), f"contact.formulation={formulation}"
    within = ["time.scheme=implicit-midpoint", "support.clearance=-4e-6", "analysis.start=undeformed"]
    (fault,) = faults_of(path, [*within, exact])
    words = [
        "analysis.start with",
        "undeformed, 4e-06 m within the faces",
        formulation,
        'start = "seat", or',
        "penalty",
    ]
    assert_says(fault, words)
    for fine in (within, [*within[:2], exact], [within[0], "support.clearance=0.0", within[2], exact]):
        read_case(path, fine)


def test_a_case_made_in_python_is_checked_too(tmp_path: Path) -> None:
    case = read_case(written(tmp_path))
    assert contradictions_in(case) == []
    longer = case.model_copy(update={"support": case.support.model_copy(update={"length": 1.0})})
    assert [fault.key for fault in contradictions_in(longer)] == [("support", "length")]


def test_rayleigh_ratios_in_falling_order_of_frequency_are_understood(tmp_path: Path) -> None:
    swapped = "frequencies = [300.0, 40.0]\nratios = [0.02, 0.01]"
    read_case(written(tmp_path, spoiled("frequencies = [40.0, 300.0]\nratios = [0.01, 0.01]", swapped)))
