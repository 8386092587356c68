"""Overrides, --set KEY=VALUE: they replace values, are checked like the file, and are named in faults."""

from __future__ import annotations

from pathlib import Path

import pytest

from gapbeam.solver.case.case import Damping
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.overrides import parse_value
from gapbeam.solver.integrators.scheme_choice import scheme_of
from gapbeam.solver.loads.point_load import HarmonicForce
from tests.shared.case_texts import assert_says, faults_of, spoiled, written


def test_values_of_tables_are_replaced(tmp_path: Path) -> None:
    case = read_case(
        written(tmp_path),
        [
            "support.clearance=0.243e-3",
            "title=Another title",
            "mesh.plane=strain",
            "time.end = 1",
            "damping.ratios=[0.02,0.02]",
        ],
    )
    assert case.support.clearance == 0.243e-3
    assert case.title == "Another title"
    assert case.mesh.plane == "strain"
    assert case.time.end == 1.0
    assert case.damping.ratios == (0.02, 0.02)


def test_a_mapping_does_the_same(tmp_path: Path) -> None:
    path = written(tmp_path)
    values = {"support.clearance": 0.243e-3, "load.shaker.amplitude": 5, "damping.ratios": (0.02, 0.02)}
    assert read_case(path, values) == read_case(
        path, [f"{key}={value}".replace("(", "[").replace(")", "]") for key, value in values.items()]
    )


def test_none_in_a_mapping_takes_a_key_away(tmp_path: Path) -> None:
    case = read_case(written(tmp_path), {"damping.frequencies": None, "damping.ratios": None, "mesh.size": None})
    assert case.damping == Damping()


def test_tables_that_the_file_lacks_are_made(tmp_path: Path) -> None:
    assert read_case(written(tmp_path), ["gates.accept_energy_growth=true"]).gates.accept_energy_growth


@pytest.mark.parametrize("key", ["load.1.amplitude", "load.shaker.amplitude"])
def test_loads_are_named_by_number_or_name(tmp_path: Path, key: str) -> None:
    load = read_case(written(tmp_path), [f"{key}=5"]).load[1]
    assert isinstance(load, HarmonicForce)
    assert load.amplitude == 5.0


def test_loads_without_a_name_have_that_of_their_type(tmp_path: Path) -> None:
    assert read_case(written(tmp_path), ["load.gravity.acceleration=1.62"]).load[0].acceleration == 1.62  # type: ignore[union-attr]


def test_probes_are_named_too(tmp_path: Path) -> None:
    assert read_case(written(tmp_path), ["probe.tip.point=[0.5, 0.001]"]).probe[0].point == (0.5, 0.001)


def test_the_scheme_is_replaced_by_name_or_key_by_key(tmp_path: Path) -> None:
    path = written(tmp_path)
    assert read_case(path, ["time.scheme=newmark"]).time.scheme == scheme_of("newmark")
    assert read_case(path, ["time.scheme.type=newmark"]).time.scheme == scheme_of("newmark")
    keys = ["time.scheme.type=generalized-alpha", "time.scheme.rho_inf=0.2"]
    assert read_case(path, keys).time.scheme == scheme_of("generalized-alpha", rho_inf=0.2)


def test_the_last_of_two_wins(tmp_path: Path) -> None:
    assert read_case(written(tmp_path), ["time.end=1", "time.end=2"]).time.end == 2.0


def test_an_override_heals_a_fault_of_the_file(tmp_path: Path) -> None:
    path = written(tmp_path, spoiled("density = 7919.0", 'density = "steel"'))
    assert read_case(path, ["material.density=7850"]).material.density == 7850.0


def test_a_mesh_file_is_looked_for_beside_the_case_file(tmp_path: Path) -> None:
    (tmp_path / "beam.msh").touch()
    assert read_case(written(tmp_path), ["mesh.file=beam.msh"]).mesh.file == str(tmp_path / "beam.msh")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("support.clearance", ["`overrides=`", "KEY=VALUE", "support.clearance=0.2e-3"]),
        ("=3", ["`overrides=`", "KEY=VALUE"]),
        ("time.end=", ["`overrides=`", "KEY=VALUE"]),
        ("support..clearance=1", ["`overrides=` support..clearance", "empty part"]),
        ("support.clearance=0,1", ["`overrides=` support.clearance", '"0,1"', "decimal point: clearance = 0.1"]),
        ("support.clearance=0.1mm", ["`overrides=` support.clearance", '"0.1mm"', "clearance = 0.0001"]),
        ("support.clearance=-0.107", ["`overrides=` support.clearance", "In m it is -0.000107"]),
        ("support.clearence=1", ["`overrides=` support.clearence", "unknown key", "did you mean `clearance`?"]),
        ("clearance=1e-4", ["`overrides=` clearance", "`clearance` belongs in [support]"]),
        ("suport.clearance=1e-4", ["`overrides=` suport.clearance", "unknown table", "did you mean [support]?"]),
        ("beam.length.x=1", ["`overrides=` beam.length.x", "beam.length = 0.51", "a table before the last dot"]),
        ("load.shakr.amplitude=1", ["`overrides=` load.shakr.amplitude", "did you mean load.shaker.amplitude?"]),
        ("load.7.amplitude=1", ["`overrides=` load.7.amplitude", "a number from 0 to 1, gravity or shaker"]),
        ("load.00000000001.amplitude=1", ["a number from 0 to 1, gravity or shaker"]),
        ("load.shaker=1", ["`overrides=` load.shaker", "no key behind the entry", "load.shaker.key"]),
        ("load.shaker.amplitud=1", ["`overrides=` load.shaker.amplitud", "did you mean `amplitude`?"]),
        ("load.gravity.frequency=1", ["`overrides=` load.gravity.frequency", "belongs in [[load]]"]),
        ("time.scheme.type=newmrk", ["`overrides=` time.scheme.type", 'did you mean "newmark"?']),
        ("time.scheme.rho_inf=0.3", ["`overrides=` time.scheme.rho_inf", "generalized-alpha"]),
        ("mesh.dimension=4", ["`overrides=` mesh.dimension", "2 or 3"]),
        ("gates.accept_energy_growth=yes", ["`overrides=` gates.accept_energy_growth", "true or false"]),
        ("time.step=nan", ["`overrides=` time.step", "a finite number"]),
        ("beam=3", ["`overrides=` beam", "a table [beam]"]),
        ("load=[]\nx=1", ["`overrides=` load", "[[load]]"]),
        ("support.length=0.7", ["`overrides=` support.length", "at most the length of the beam"]),
    ],
)
def test_a_bad_override_is_explained(tmp_path: Path, text: str, words: list[str]) -> None:
    (fault,) = faults_of(written(tmp_path), [text])
    assert_says(fault, words)


def test_a_contradiction_with_the_file_names_both(tmp_path: Path) -> None:
    path = written(tmp_path)
    (fault,) = faults_of(path, ["beam.length=0.04", "load.shaker.point=0.01", "probe.tip.point=0.04", "mesh.size=0.01"])
    assert fault.where == f"{path}:18: [support] length with `overrides=` beam.length"


def test_a_key_of_the_scheme_that_an_override_replaced_names_the_override(tmp_path: Path) -> None:
    text = spoiled('"discrete-gradient"', '{ type = "generalized-alpha", rho_inf = 0.5 }')
    (fault,) = faults_of(written(tmp_path, text), ["time.scheme.type=newmark"])
    assert fault.where.endswith("[time.scheme] rho_inf with `overrides=` time.scheme.type")
    assert read_case(written(tmp_path, text), ["time.scheme=newmark"]).time.scheme == scheme_of("newmark")


def test_arrays_that_the_file_lacks_cannot_be_entered(tmp_path: Path) -> None:
    path = written(tmp_path, spoiled('[[probe]]\nname = "tip"\npoint = 0.510\n', ""))
    (fault,) = faults_of(path, ["probe.tip.point=0.1"])
    assert "no [[probe]] in the case file" in fault.found


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("1e-4", 1e-4),
        ("true", True),
        ("[1, 2.5]", [1, 2.5]),
        ('"1"', "1"),
        ("newmark", "newmark"),
        ("a.msh", "a.msh"),
        ("1\nend = 2", "1\nend = 2"),
        ("{ type = 'newmark' }", {"type": "newmark"}),
        ("", ""),
        ("0,1", "0,1"),
    ],
)
def test_values_are_toml_or_else_text(text: str, value: object) -> None:
    parsed = parse_value(text)
    assert parsed == value
    assert type(parsed) is type(value)


def test_the_spectral_radius_of_papers_is_a_key_of_ours(tmp_path: Path) -> None:
    """What papers call rho_inf is found, with the scheme that has it, and no word that is spelled a little alike."""
    [fault] = faults_of(written(tmp_path), ["time.scheme.spectral_radius=0.5"])
    assert fault.hint == 'did you mean `rho_inf`, which belongs in [time.scheme] of type "generalized-alpha"?'


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("analysis.start=undeformed", "transient"),
        ("contact.law.restitution=0.5", "kelvin-voigt"),
    ],
)
def test_a_table_that_an_override_makes_has_its_default_type(tmp_path: Path, text: str, kind: str) -> None:
    """One key of it is enough: it is the case without the file's table, and that one key."""
    path, (table, _, key) = written(tmp_path), text.partition("=")[0].rpartition(".")
    assert read_case(path, [text]) == read_case(path, [f"{table}.type={kind}", text])
    assert read_case(path, {f"{table}.{key}": None}) == read_case(path)


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("model.modes=10", "model.type=reduced"),
        ("contact.formulation.theta=1", "contact.formulation.type=nitsche"),
        ("analysis.continuation.low=3", "analysis.type=periodic"),
        ("time.scheme.quartz=0.5", ""),
    ],
)
def test_a_key_of_another_type_reports_which_override_to_add(tmp_path: Path, text: str, kind: str) -> None:
    [fault] = faults_of(written(tmp_path), [text])
    name = text.partition("=")[0]
    assert fault.where.startswith(f"`overrides=` {name}")
    assert fault.hint == (f"add `overrides=` {kind}" if kind else "")
