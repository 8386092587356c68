"""Faults of single keys and of the text: where, what was found, what was expected, what to try."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from gapbeam.solver.case.case import Case
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.messages.errors import CaseError
from tests.shared.case_texts import GOOD, assert_says, faults_of, spoiled, written

BAD_KEYS = {
    "number in quotes": (
        "clearance = 0.107e-3",
        'clearance = "0.107e-3"',
        ["[support] clearance", "0.107e-3", "a number", ", m)", "remove the quotes: clearance = 0.000107"],
    ),
    "number with a unit": (
        "clearance = 0.107e-3",
        'clearance = "0.107 mm"',
        ["[support] clearance", "remove the quotes and the unit: clearance = 0.000107"],
    ),
    "modulus with a unit": (
        "young_modulus = 2.1e11",
        'young_modulus = "210 GPa"',
        ["[material] young_modulus", "Pa", "young_modulus = 210000000000.0"],
    ),
    "unknown unit": (
        "density = 7919.0",
        'density = "0.286 lb/in^3"',
        ["[material] density", "kg/m^3", "SI units"],
    ),
    "unit of several words": (
        "density = 7919.0",
        'density = "7919 kg per m^3"',
        ["[material] density", "kg/m^3", "write the number alone, without quotes and unit, in SI units"],
    ),
    "width whose moments overflow": (
        "width = 0.020",
        "width = 1e300",
        ["[beam] width", "found:    1e+300", "at most 1e+30", "SI units"],
    ),
    "decimal comma in quotes": (
        "density = 7919.0",
        'density = "7919,5"',
        ["[material] density", "write a decimal point: density = 7919.5"],
    ),
    "word for a number": (
        "density = 7919.0",
        'density = "steel"',
        ["[material] density", '"steel"', "a number greater than 0", "density = 7919.0"],
    ),
    "switch for a number": (
        "width = 0.020",
        "width = true",
        ["[beam] width", "true (a switch)", "a number greater than 0", "width = 0.02"],
    ),
    "list for a number": (
        "width = 0.020",
        "width = [0.020]",
        ["[beam] width", "[0.02]", "without brackets: width = 0.02"],
    ),
    "date for a number": (
        "width = 0.020",
        "width = 2013-01-01",
        ["[beam] width", "2013-01-01 (a date or time)", "a number"],
    ),
    "table for a number": (
        "width = 0.020",
        "width = { value = 0.020 }",
        ["[beam.width]", "a table with value", "a number"],
    ),
    "negative length": (
        "length = 0.510",
        "length = -0.510",
        ["[beam] length", "-0.51", "greater than 0", "length along x, m", "no minus sign"],
    ),
    "zero thickness": (
        "thickness = 0.012",
        "thickness = 0",
        ["[beam] thickness", "found:    0", "greater than 0", "thickness = 0.012"],
    ),
    "negative friction": (
        'stiffness = "auto"',
        "friction = { coefficient = -0.2 }",
        ["[contact.friction] coefficient", "-0.2", "a number from 0 to 100", "no minus sign"],
    ),
    "friction at no velocity": (
        'stiffness = "auto"',
        "friction = { coefficient = 0.2, slip_velocity = 0.0 }",
        ["[contact.friction] slip_velocity", "0.0", '"auto" or a number greater than 0', 'slip_velocity = "auto"'],
    ),
    "friction without a coefficient": (
        'stiffness = "auto"',
        "friction = { slip_velocity = 1e-4 }",
        ["[contact.friction] coefficient", "the key is missing", "coefficient = 0.2"],
    ),
    "friction as a number": (
        'stiffness = "auto"',
        "friction = 0.2",
        ["[contact] friction", "0.2", "a table friction", "friction = { coefficient = 0.2 }"],
    ),
    "infinite modulus": (
        "young_modulus = 2.1e11",
        "young_modulus = inf",
        ["[material] young_modulus", "inf", "a finite number"],
    ),
    "not a number": (
        "clearance = 0.107e-3",
        "clearance = nan",
        ["[support] clearance", "nan", "a finite number"],
    ),
    "incompressible": (
        "poisson_ratio = 0.3",
        "poisson_ratio = 0.5",
        ["[material] poisson_ratio", "0.5", "greater than -1 and less than 0.5", "poisson_ratio = 0.499"],
    ),
    "one frequency": (
        "frequencies = [40.0, 300.0]",
        "frequencies = 40.0",
        ["[damping] frequencies", "40.0", "a list of 2 numbers, each greater than 0", "[40.0, 300.0]"],
    ),
    "three ratios": (
        "ratios = [0.01, 0.01]",
        "ratios = [0.01, 0.01, 0.02]",
        ["[damping] ratios", "[0.01, 0.01, 0.02]", "a list of 2 numbers, each not less than 0"],
    ),
    "numbers in quotes in a list": (
        "ratios = [0.01, 0.01]",
        'ratios = ["0.01", "0.01"]',
        ["[damping] ratios", '["0.01", "0.01"]', "numbers without quotes"],
    ),
    "dimension 1": (
        "dimension = 2",
        "dimension = 1",
        ["[mesh] dimension", "found:    1", "2 or 3", "solid beam"],
    ),
    "degree in quotes": (
        "degree = 2",
        'degree = "2"',
        ["[mesh] degree", '"2" (text in quotes)', "1 or 2", "remove the quotes: degree = 2"],
    ),
    "half a cell": (
        "degree = 2",
        "cells_through_thickness = 2.5",
        ["[mesh] cells_through_thickness", "2.5", "a whole number from 1 to 200"],
    ),
    "whole number with a point": (
        "degree = 2",
        "cells_through_thickness = 4.0",
        ["[mesh] cells_through_thickness", "without decimal point", "cells_through_thickness = 4"],
    ),
    "too many cells": (
        "degree = 2",
        "cells_through_thickness = 100000",
        ["[mesh] cells_through_thickness", "100000", "from 1 to 200"],
    ),
    "misspelled choice": (
        "degree = 2",
        'cell = "quadrilatral"',
        ["[mesh] cell", '"quadrilatral"', '"triangle"', 'did you mean cell = "quadrilateral"?'],
    ),
    "abbreviated choice": (
        "degree = 2",
        'cell = "quad"',
        ["[mesh] cell", '"quad"', 'did you mean cell = "quadrilateral"?'],
    ),
    "choice in capitals": (
        "degree = 2",
        'plane = "Strain"',
        ["[mesh] plane", '"stress" or "strain"', 'did you mean plane = "strain"?'],
    ),
    "formulation to come": (
        'stiffness = "auto"',
        'formulation = "mortar"',
        ["[contact] formulation", '"mortar"', '"penalty"'],
    ),
    "misspelled auto": (
        'stiffness = "auto"',
        'stiffness = "automatic"',
        ["[contact] stiffness", '"auto" or a number greater than 0', 'did you mean stiffness = "auto"?'],
    ),
    "negative stiffness": (
        'stiffness = "auto"',
        "stiffness = -1e10",
        ["[contact] stiffness", "Pa/m", "no minus sign"],
    ),
    "number for a title": (
        'title = "good"',
        "title = 2013",
        ["title", "2013", "text in quotes", 'title = "2013"'],
    ),
    "long title": (
        'title = "good"',
        f'title = "{"good " * 100}"',
        ["title", "good good", "at most 200 characters"],
    ),
    "yes for true": (
        "[time]",
        '[gates]\naccept_energy_growth = "yes"\n[time]',
        ["[gates] accept_energy_growth", '"yes"', "true or false", "without quotes"],
    ),
    "number for a switch": (
        "[time]",
        "[gates]\naccept_energy_growth = 1\n[time]",
        ["[gates] accept_energy_growth", "found:    1", "true or false"],
    ),
    "name with a blank": (
        'name = "tip"',
        'name = "the tip"',
        ['[[probe]] number 1 (name "the tip") name', "a name", "letters, digits, - and _"],
    ),
    "point with four coordinates": (
        "point = 0.510",
        "point = [0.510, 0, 0, 0]",
        ['[[probe]] number 1 (name "tip") point', "[0.51, 0, 0, 0]", "a list of 3 numbers", "m)"],
    ),
    "point in quotes": (
        "point = 0.510",
        'point = "tip"',
        ['[[probe]] number 1 (name "tip") point', '"tip"', "a number, a list of 2 numbers"],
    ),
    "negative frequency": (
        "frequency = 20.0",
        "frequency = -20.0",
        ['[[load]] number 2 (name "shaker") frequency', "-20.0", "greater than 0", "Hz"],
    ),
    "halvings": (
        'scheme = "discrete-gradient"',
        "max_halvings = 99",
        ["[time] max_halvings", "99", "from 0 to 20"],
    ),
    "spectral radius": (
        'scheme = "discrete-gradient"',
        'scheme = { type = "generalized-alpha", rho_inf = 1.5 }',
        ["[time.scheme] rho_inf", "1.5", "from 0 to 1", "spectral radius"],
    ),
}

BAD_NAMES = {
    "misspelled key": (
        "clearance = 0.107e-3",
        "clearence = 0.107e-3",
        [
            "[support] clearence",
            "unknown key `clearence`",
            "one of length, clearance",
            "did you mean `clearance`?",
        ],
    ),
    "key of another table": (
        "width = 0.020",
        "width = 0.020\nclearance = 0.1e-3",
        ["[beam] clearance", "unknown key", "`clearance` belongs in [support]"],
    ),
    "preload of a beam": (
        "width = 0.020",
        "width = 0.020\naxial-force = 2e5",
        ["[beam] axial-force", "unknown key", "files of structures have an axial preload: `tension`"],
    ),
    "preload in the word of another table": (
        "width = 0.020",
        "width = 0.020\ntension = 2e5",
        ["[beam] tension", "unknown key", "files of structures have an axial preload: `tension`"],
    ),
    "misspelled key of another table": (
        "width = 0.020",
        "width = 0.020\npoison_ratio = 0.3",
        ["[beam] poison_ratio", "did you mean `poisson_ratio`, which belongs in [material] or [[segment]]?"],
    ),
    "key above all tables": (
        'title = "good"',
        'title = "good"\nclearance = 0.1e-3',
        ["toml:2: clearance", "`clearance` belongs in [support]"],
    ),
    "symbol of a paper": (
        "young_modulus = 2.1e11",
        "E = 2.1e11",
        ["[material] E", "did you mean `young_modulus`?"],
    ),
    "name of another program": (
        "step = 1.0e-4",
        "dt = 1.0e-4",
        ["[time] dt", "did you mean `step`?"],
    ),
    "hyphen for underscore": (
        "degree = 2",
        "cells-through-thickness = 4",
        ["[mesh] cells-through-thickness", "did you mean `cells_through_thickness`?"],
    ),
    "capital letter": (
        "density = 7919.0",
        "Density = 7919.0",
        ["[material] Density", "did you mean `density`?"],
    ),
    "nonsense key": (
        "width = 0.020",
        "width = 0.020\nflux_capacitor = 1.21e9",
        ["[beam] flux_capacitor", "unknown key `flux_capacitor`", "one of length, thickness, width"],
    ),
    "misspelled table": (
        "[material]",
        "[materials]",
        ["[materials]", "unknown table `materials`", "did you mean [material]?"],
    ),
    "nonsense table": (
        "[time]",
        "[weather]\nwind = 3\n[time]",
        ["[weather]", "unknown table `weather`", "[beam]", "[[load]]"],
    ),
    "plural array": (
        '[[probe]]\nname = "tip"',
        '[[probes]]\nname = "tip"',
        ["[[probes]]", "unknown key `probes`", "did you mean [[probe]]?"],
    ),
    "key of another load": (
        'type = "gravity"',
        'type = "gravity"\nfrequency = 20',
        ["[[load]] number 1 frequency", '`frequency` belongs in [[load]] of type "harmonic_force"'],
    ),
    "key of another scheme": (
        'scheme = "discrete-gradient"',
        'scheme = { type = "newmark", rho_inf = 0.5 }',
        ["[time.scheme] rho_inf", '`rho_inf` belongs in [time.scheme] of type "generalized-alpha"'],
    ),
    "missing key": (
        "clearance = 0.107e-3",
        "",
        ["[support] clearance", "missing", "a number (pad thickness minus beam thickness", "add clearance = "],
    ),
    "missing table": (
        "[support]\nlength = 0.050\nclearance = 0.107e-3\n",
        "",
        ["[support]", "no such table", "length, clearance", "add [support] with length = 0.05"],
    ),
    "missing frequency": (
        "frequency = 20.0",
        "",
        ['[[load]] number 2 (name "shaker") frequency', "missing", "Hz", "add frequency = 20.0"],
    ),
    "nameless probe": (
        'name = "tip"',
        "",
        ["[[probe]] number 1 name", "missing", 'add name = "tip"'],
    ),
    "misspelled load type": (
        'type = "gravity"',
        'type = "gravitation"',
        [
            "[[load]] number 1 type",
            '"gravitation"',
            '"gravity", "harmonic_force", "constant_force", "step_force", "exciter", "base_motion", "random", '
            '"random-line-load", "swept-sine", "recorded_force", "recorded_motion", "support_motion", '
            '"recorded_support_motion" or "clearance_change"',
            'mean "gravity"?',
        ],
    ),
    "load without type": (
        'type = "harmonic_force"\n',
        "",
        ['[[load]] number 2 (name "shaker") type', "missing", '"base_motion"', 'add type = "harmonic_force"'],
    ),
    "load with kind": (
        'type = "gravity"',
        'types = "gravity"',
        ["[[load]] number 1 types", "unknown key `types`", '"harmonic_force"', "did you mean `type`?"],
    ),
    "misspelled scheme": (
        'scheme = "discrete-gradient"',
        'scheme = "newmrk"',
        ["[time] scheme", '"newmrk"', '"generalized-alpha"', 'did you mean "newmark"?'],
    ),
    "misspelled scheme type": (
        'scheme = "discrete-gradient"',
        'scheme = { type = "Newmark" }',
        ["[time.scheme] type", '"Newmark"', 'did you mean "newmark"?'],
    ),
    "unknown scheme": (
        'scheme = "discrete-gradient"',
        'scheme = "rk4"',
        [
            "[time] scheme",
            '"rk4"',
            '"discrete-gradient", "implicit-midpoint", "newmark", "hht-alpha", "generalized-alpha", "moreau-jean" '
            'or "central-difference"',
        ],
    ),
    "scheme by number": (
        'scheme = "discrete-gradient"',
        "scheme = 3",
        ["[time] scheme", "found:    3", '"newmark"'],
    ),
    "single brackets": (
        "[[probe]]",
        "[probe]",
        ["[[probe]]", "a table with name, point", "[[probe]], with two brackets"],
    ),
    "double brackets": (
        "[time]",
        "[[time]]",
        ["[[time]]", "[time]", "with single brackets"],
    ),
    "value for a table": (
        'title = "good"',
        'title = "good"\ngates = 0.05',
        ["gates", "0.05", "a table [gates] of keys and values", "impact_loss = 0.008"],
    ),
}

BAD_TEXTS = {
    "decimal comma": (
        "length = 0.510",
        "length = 0,510",
        ["nothing behind the value", "a decimal point: 0.1"],
    ),
    "no digit before the point": ("length = 0.510", "length = .510", ["a value", "0.5 instead of .5"]),
    "no digit behind the point": ("width = 0.020", "width = 1.", ["2.0 instead of 2."]),
    "unit behind the number": ("width = 0.020", "width = 20 mm", ["the number alone", "SI units"]),
    "no quotes": ("degree = 2", "plane = stress", ["a value", 'text in quotes: "text"']),
    "Python's True": ("degree = 2", "plane = True", ["a value", "small letters"]),
    "colon": ("degree = 2", "degree: 2", ["key = value", "= instead of :"]),
    "no equals sign": ("degree = 2", "degree 2", ["key = value", "an = between key and value"]),
    "no value": ("degree = 2", "degree =", ["a value", "a value behind the ="]),
    "two equals signs": ("degree = 2", "degree == 2", ["a value", "a single ="]),
    "comment of C": (
        "degree = 2",
        "// degree = 2",
        ["a comment that starts with #", "# at the start of a comment"],
    ),
    "comment of C behind": (
        "degree = 2",
        "degree = 2 // two",
        ["a comment that starts with #", "# instead of //"],
    ),
    "semicolon": (
        "degree = 2",
        "degree = 2;",
        ["nothing behind the value", "nothing at the end of the line"],
    ),
    "open table": ("[mesh]", "[mesh", ["a table [name]", "a closing bracket: [name]"]),
    "open entry": ("[[probe]]", "[[probe]", ["closed by as many brackets", "two brackets at both ends"]),
    "open list": ("ratios = [0.01, 0.01]", "ratios = [0.01, 0.01", ["a ] at the end of the list"]),
    "open text": ('name = "tip"', 'name = "tip', ["a quote at the end of the text"]),
    "round brackets": ("ratios = [0.01, 0.01]", "ratios = (0.01, 0.01)", ["square brackets"]),
    "no commas": ("ratios = [0.01, 0.01]", "ratios = [0.01 0.01]", ["a comma between the items"]),
    "curly quotes": ('name = "tip"', "name = “tip”", ["a value", "straight quotes"]),
    "typographic minus": (
        "clearance = 0.107e-3",
        "clearance = \N{MINUS SIGN}0.006e-3",
        ["a plain minus sign: -"],
    ),
    "arithmetic": ("degree = 2", "degree = 1 + 1", ["nothing behind the value"]),
    "product": ("width = 0.020", "width = 2*0.010", ["a case file does not calculate"]),
    "path of Windows": ("degree = 2", r'file = "C:\meshes\beam.msh"', ["'single quotes'"]),
    "table twice": (
        "[time]",
        "[output]\n[mesh]",
        ["every table at most once", "keep one of lines 21 and 43"],
    ),
    "key twice": (
        "degree = 2",
        "degree = 2\ndegree = 1",
        ["every key at most once", "keep one of lines 23 and 24"],
    ),
    "blank in a key": (
        "young_modulus = 2.1e11",
        "young modulus = 2.1e11",
        ["key = value", "_ instead of blanks"],
    ),
}


@pytest.mark.parametrize(
    ("old", "new", "words"), [*BAD_KEYS.values(), *BAD_NAMES.values()], ids=[*BAD_KEYS, *BAD_NAMES]
)
def test_a_bad_key_is_explained(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    path = written(tmp_path, spoiled(old, new))
    faults = faults_of(path)
    assert len(faults) == 1, "one mistake, one fault:\n" + "\n".join(map(str, faults))
    message = str(faults[0])
    assert message.startswith(f"{path}:"), message
    assert "found:" in message
    assert "expected:" in message
    assert_says(message, words)


@pytest.mark.parametrize(("old", "new", "words"), BAD_TEXTS.values(), ids=BAD_TEXTS)
def test_bad_toml_is_explained(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    text = spoiled(old, new)
    path = written(tmp_path, text)
    (fault,) = faults_of(path)
    line = text[: text.index(new)].count("\n") + 1 + new.count("\n")
    assert f":{line}: line {line}" in fault.where
    assert_says(fault, words)


def test_no_message_speaks_of_pydantic(tmp_path: Path) -> None:
    for old, new, _ in [*BAD_KEYS.values(), *BAD_NAMES.values()]:
        (fault,) = faults_of(written(tmp_path, spoiled(old, new)))
        for jargon in (
            "Input should",
            "pydantic",
            "type=",
            "extra",
            "validat",
            "discriminator",
            "union",
            "None",
        ):
            assert jargon not in str(fault)


def test_the_line_of_every_key_is_found(tmp_path: Path) -> None:
    lines = GOOD.split("\n")
    for number, line in enumerate(lines, 1):
        key, equals, _ = line.partition(" = ")
        if equals:
            text = "\n".join([*lines[: number - 1], f"{key} = {{}}", *lines[number:]])
            (fault,) = faults_of(written(tmp_path, text))
            assert f"case.toml:{number}: " in fault.where, f"{line}: {fault.where}"


def test_lines_are_found_among_lists_and_texts_of_several_lines(tmp_path: Path) -> None:
    text = spoiled(
        "ratios = [0.01, 0.01]",
        'ratios = [\n  0.01, # [ one\n  0.01,\n]\r\n"mass" = """\nmass = 3\n[support]\n"""\nstiffness = true',
    )
    places = [fault.where.partition(": ")[0].rpartition(":")[2] for fault in faults_of(written(tmp_path, text))]
    lines = text.split("\n")
    assert places == [str(lines.index('"mass" = """') + 1), str(lines.index("stiffness = true") + 1)]


def test_all_faults_are_reported_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("width = 0.020", 'width = "0.020"').replace("density = 7919.0", "densty = 7919.0")
    text = text.replace("point = 0.15", "point = 0.15\namplitud = 3").replace("step = 1.0e-4", "step = -1.0e-4")
    text = text.replace("ratios = [0.01, 0.01]\n", "").replace('name = "tip"', "name = 3")
    faults = faults_of(written(tmp_path, text))
    assert [fault.where.split(": ")[1] for fault in faults] == [
        "[beam] width",
        "[material] densty",
        "[damping] frequencies",
        '[[load]] number 2 (name "shaker") amplitud',
        "[[probe]] number 1 name",
        "[time] step",
    ]
    message = str(CaseError("case.toml", faults))
    assert message.startswith("case.toml has 6 faults; nothing was run.")
    assert message.count("found:") == message.count("expected:") == 6


def test_a_faulty_entry_does_not_hide_the_contradictions_of_the_others(tmp_path: Path) -> None:
    text = spoiled("point = 0.510", "point = 510\n[[probe]]\nname = 3\npoint = 0.1")
    outside, name = faults_of(written(tmp_path, text))
    assert "number 1" in outside.where
    assert "is it in mm? In m it is 0.51" in outside.hint
    assert "number 2 name" in name.where


def test_whole_numbers_are_numbers(tmp_path: Path) -> None:
    case = read_case(written(tmp_path, spoiled("density = 7919.0", "density = 7919")))
    assert case.material.density == 7919.0
    assert isinstance(case.material.density, float)


def test_a_scheme_may_be_given_by_its_name_alone(tmp_path: Path) -> None:
    short = read_case(written(tmp_path, spoiled('"discrete-gradient"', '"newmark"')))
    long = read_case(
        written(tmp_path, spoiled('"discrete-gradient"', '{ type = "newmark", beta = 0.25, gamma = 0.5 }'))
    )
    assert short == long


@pytest.mark.parametrize("keys", ["", 'start = "undeformed"', "[analysis.motion]\nlift = 1e-4", 'start = "seat"'])
def test_an_analysis_without_a_type_is_transient(tmp_path: Path, keys: str) -> None:
    """All keys are those of that type; with others the type is asked for."""
    typed = read_case(written(tmp_path, f'{GOOD}\n[analysis]\ntype = "transient"\n{keys}\n'))
    assert read_case(written(tmp_path, f"{GOOD}\n[analysis]\n{keys}\n")) == typed
    (fault,) = faults_of(written(tmp_path, f'{GOOD}\n[analysis]\nmethod = "shooting"\n'))
    assert_says(fault, ["[analysis] type", "the key is missing", 'add type = "periodic"'])


def test_a_mesh_file_lies_beside_the_case_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir("/")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/beam.msh").touch()
    case = read_case(written(tmp_path, spoiled("degree = 2", 'file = "meshes/beam.msh"')))
    assert case.mesh.file == str(tmp_path / "meshes/beam.msh")


def test_missing_files_are_explained(tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / "arm.csv").touch()
    cases = {
        "nothere.toml": ["no such file", "one of its case files"],
        "arm.toml": ["no such file", "one of its case files"],
        "cas.csv": ["no such file", f"did you mean {tmp_path / 'case.toml'}?"],
        "casse.toml": ["no such file", f"did you mean {tmp_path / 'case.toml'}?"],
        "case": ["no such file", f"did you mean {tmp_path / 'case.toml'}?"],
        "zzz.toml": ["no such file", f"one of its case files: {tmp_path / 'case.toml'}"],
        "no/case.toml": ["no such file", f"no folder {tmp_path / 'no'} either"],
        "x\0.toml": ["the path of a case file"],
        "x" * 300: ["case file"],
    }
    for name, words in cases.items():
        (fault,) = faults_of(tmp_path / name)
        assert fault.where == str(tmp_path / name)
        for word in words:
            assert word in str(fault)


def test_what_is_no_case_file_is_refused(tmp_path: Path) -> None:
    (folder,) = faults_of(written(tmp_path).parent)
    assert folder.found == "a folder"
    assert "case.toml" in folder.hint
    contents = {
        "a text file in UTF-8": b"title = 'ok'\n# caf\xe9\n" + GOOD.encode()[8:],
        "is it a mesh": b"\x89HDF\r\n\x1a\n\0\0\0",
        "at most 1000000 bytes": b"#" * 1_000_001,
    }
    path = tmp_path / "other.toml"
    for words, content in contents.items():
        path.write_bytes(content)
        (fault,) = faults_of(path)
        assert words in str(fault)
    path.write_bytes(b"# caf\xe9\n")
    (fault,) = faults_of(path)
    assert fault.where == f"{path}:1"
    (device,) = faults_of(Path("/dev/null"))
    assert device.found == "a device or pipe"


def test_an_empty_file_lacks_the_tables_that_have_no_defaults(tmp_path: Path) -> None:
    assert [fault.key for fault in faults_of(written(tmp_path, ""))] == [
        ("beam",),
        ("material",),
        ("support",),
        ("time",),
    ]


def test_byte_order_mark_and_line_ends_of_windows_do_no_harm(tmp_path: Path) -> None:
    plain = read_case(written(tmp_path))
    assert read_case(written(tmp_path, "\ufeff" + GOOD.replace("\n", "\r\n"))) == plain


def test_nesting_and_digits_beyond_reason_are_refused(tmp_path: Path) -> None:
    for value in ("[" * 50_000, "{a=" * 20_000, "9" * 5000, "9" * 4000, ".".join("a" * 20_000) + " = 1"):
        with pytest.raises(CaseError):
            read_case(written(tmp_path, f"{GOOD}\nfields_interval = {value}"))


def test_thousands_of_faults_make_a_short_message(tmp_path: Path) -> None:
    text = GOOD + "".join(f"unknown_{number} = 1\n" for number in range(5000))
    assert len(str(CaseError("x", faults_of(written(tmp_path, text))))) < 50_000
    long = {"mesh.file": "[[probe]]\n" * 100_000, f"{'a' * 100_000}.b": 1}
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path), long)
    assert len(str(caught.value)) < 10_000


def test_a_case_error_travels_between_processes(tmp_path: Path) -> None:
    with pytest.raises(CaseError) as caught:
        read_case(written(tmp_path, ""))
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_cases_do_not_change(tmp_path: Path) -> None:
    case = read_case(written(tmp_path))
    assert isinstance(case, Case)
    with pytest.raises(ValueError, match="frozen"):
        case.beam.length = 3.0  # type: ignore[misc]


def test_files_of_the_kernel_are_bounded(tmp_path: Path) -> None:
    """Files without a size are read up to the limit of case files, however much they hold."""
    pages = tmp_path / "pages.toml"
    pages.symlink_to("/proc/self/pagemap")
    with pytest.raises(CaseError, match=r"1000001 bytes or more"):
        read_case(pages)
