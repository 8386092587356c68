"""New case files: every template and several sets of answers give a case that reads, and nothing is overwritten."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from gapbeam.commands.new import meters
from gapbeam.new_case.answers import CASES, MATERIALS, SECTIONS, CaseAnswers, copy_of, template_named, templates
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case, read_case_text
from gapbeam.solver.messages.errors import UserError
from tests.shared.command import GAPBEAM, PROJECT, called_anew, process_environment
from tests.shared.processes import LONGEST

NAMES = [one.name for one in templates()]
TUBE = CaseAnswers(1.0, "tube", 0.025, 0.025, {"wall": 0.003}, supports=3, region="hole", clearance=1e-4)
ANSWERS = {
    "usual": CaseAnswers(),
    "tube in holes": TUBE,
    "tube in slots": CaseAnswers(1.0, "tube", 0.025, 0.025, {"wall": 0.003}, supports=2),
    "box": CaseAnswers(2.0, "box", 0.05, 0.03, {"wall": 0.004}, "aluminum", MATERIALS["aluminum"], 1),
    "i": CaseAnswers(3.0, "i", 0.1, 0.06, {"web": 0.006, "flange": 0.008}, supports=4, load="force", frequency=12.0),
    "round, many": CaseAnswers(2.0, "round", 0.02, 0.02, supports=8, region="hole", clearance=5e-5, load="force"),
    "one, force": CaseAnswers(0.51, supports=1, clearance=0.107e-3, load="force", amplitude=20.0),
}


def test_every_shipped_case_is_a_template() -> None:
    assert sorted(NAMES) == sorted(path.stem for path in CASES.glob("*.toml"))


@pytest.mark.parametrize("name", NAMES)
def test_a_copy_is_the_shipped_case(name: str, tmp_path: Path) -> None:
    """The same case but for where its files lie, which are copied too; its first lines name the copy."""
    path = tmp_path / "sub" / "my own.toml"
    written = copy_of(template_named(name), path)
    case, shipped = read_case(path), read_case(CASES / f"{name}.toml")
    assert case.model_dump_json().replace(str(path.parent), str(CASES)) == shipped.model_dump_json()
    assert warnings(case) == warnings(shipped)
    opening = path.read_text(encoding="utf-8").partition("\n\n")[0]
    assert f"cases/{name}.toml" not in opening
    assert f"'{path}'" in opening
    assert written[0] == path
    assert all(one.exists() for one in written)
    assert len(written) == 1 + (name == "recorded")


@pytest.mark.parametrize("answers", ANSWERS.values(), ids=ANSWERS.keys())
def test_answers_make_a_case(answers: CaseAnswers) -> None:
    """It reads without faults and warnings, has what was answered, and a comment behind every value."""
    text = answers.case_text(Path("my.toml"))
    case = read_case_text(text)
    assert warnings(case) == []
    assert case.beam.length == answers.length
    assert case.beam.section.type == answers.section
    assert case.material.young_modulus == answers.figures.young_modulus
    assert len(case.layout.supports) == answers.supports
    assert {one.clearance for one in case.layout.supports} == {answers.clearance}
    assert case.load[1].peak == answers.amplitude
    assert case.load[1].forcing_frequency == answers.frequency
    for line in text.splitlines():
        assert " = " not in line or "#" in line or line.startswith("title")


def test_every_section_is_offered() -> None:
    """Those of a case file, but the polygon, whose corners no question asks for; with their keys."""
    from gapbeam.solver.schema.table import models_in, type_name
    from gapbeam.solver.sections.section_choice import SectionChoice

    known = {type_name(one): set(one.model_fields) - {"type"} for one in models_in(SectionChoice)}
    assert {name: set(keys) for name, keys in SECTIONS.items()} == {
        name: keys for name, keys in known.items() if name != "polygon"
    }


def test_lengths_have_units() -> None:
    found = [meters(text) for text in ("0.5", "12 mm", "12mm", "80 um", "2.5 cm", "0.5 in", "1e-3 m")]
    assert found == pytest.approx([0.5, 0.012, 0.012, 80e-6, 0.025, 0.0127, 1e-3])


def test_an_unknown_template_is_refused() -> None:
    with pytest.raises(UserError, match='no template "tube-bafles"; did you mean "tube-baffles"'):
        template_named("tube-bafles")
    with pytest.raises(UserError, match="gapbeam new --list"):
        template_named("zzz")


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    """Neither a case file nor a record with another content; then nothing is written at all."""
    record = tmp_path / "signals" / "transport.csv"
    record.parent.mkdir()
    record.write_text("mine")
    with pytest.raises(UserError, match=r"transport\.csv is there already, with another content"):
        copy_of(template_named("recorded"), tmp_path / "my.toml")
    assert record.read_text() == "mine"
    assert not (tmp_path / "my.toml").exists()
    record.unlink()
    (tmp_path / "my.toml").write_text("mine too")
    with pytest.raises(UserError, match="is there already; choose another name"):
        copy_of(template_named("recorded"), tmp_path / "my.toml")
    assert (tmp_path / "my.toml").read_text() == "mine too"
    assert not record.exists()
    copy_of(template_named("recorded"), tmp_path / "first.toml")
    assert copy_of(template_named("recorded"), tmp_path / "second.toml") == [tmp_path / "second.toml"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("my",), "expected a name that ends with .toml, such as my.toml"),
        ((), "the name of the case file is missing"),
        (("my.toml", "--template", "demmo"), 'did you mean "demo"'),
        (("my.toml", "--template", "demo", "--yes"), "leave out --yes"),
        (("pyproject.toml", "--yes"), "pyproject.toml is there already"),
        (("README.md/my.toml", "--yes"), "is a file, not a folder; choose another place for the case file"),
    ],
)
def test_bad_calls_are_explained(words: tuple[str, ...], said: str) -> None:
    done = called_anew("new", *words)
    assert done.returncode == 2
    assert said in " ".join(done.stderr.split())
    assert done.stdout == ""


def answered(path: Path, *answers: str) -> subprocess.CompletedProcess[str]:
    """Call `gapbeam new` and type answers."""
    return subprocess.run(
        [*GAPBEAM, "new", path], input="".join(f"{one}\n" for one in answers), cwd=PROJECT, env=process_environment(),
        capture_output=True, text=True, timeout=LONGEST, check=False,
    )  # fmt: skip


def test_questions_are_asked_again(tmp_path: Path) -> None:
    """A mistyped answer is asked for again with a suggestion; the file has what was answered."""
    typed = ("tbe", "tube", "1 m", "25 mm", "-3", "3 mm", "steel", "3", "hole", "0.1 mm", "force", "12", "40")
    done = answered(tmp_path / "my.toml", *typed)
    assert done.returncode == 0, done.stderr
    assert "did you mean tube?" in done.stdout
    assert '"-3": expected more than 0' in done.stdout
    case = read_case(tmp_path / "my.toml")
    assert (case.beam.thickness, case.beam.section.type, case.load[1].peak) == (0.025, "tube", 12.0)
    assert {one.region.type for one in case.layout.supports} == {"hole"}


def test_answers_that_end_early_write_nothing(tmp_path: Path) -> None:
    done = answered(tmp_path / "my.toml", "tube")
    assert done.returncode == 2
    assert "the answers ended before the questions did; --yes takes all defaults" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_answers_that_contradict_write_nothing(tmp_path: Path) -> None:
    """A wall thicker than the tube: the fault of the case file that they would make."""
    done = answered(tmp_path / "my.toml", "tube", "1", "0.025", "0.02", "steel", "2", "hole", "1e-4", "force", "1", "9")
    assert done.returncode == 2
    assert "wall" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["usual", "one, force"])
def test_a_new_case_passes_the_check(name: str, tmp_path: Path) -> None:
    """As a user calls it: the mesh, the seat and the prediction."""
    from tests.shared.command import called

    path = tmp_path / "my.toml"
    path.write_text(ANSWERS[name].case_text(path), encoding="utf-8")
    assert called("check", path).returncode == 0


@pytest.mark.slow(minutes=3)
@pytest.mark.parametrize("name", NAMES)
def test_a_copied_template_passes_the_check(name: str, tmp_path: Path) -> None:
    from tests.shared.command import called

    copy_of(template_named(name), tmp_path / "my.toml")
    done = called("check", tmp_path / "my.toml")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow(minutes=5)
@pytest.mark.parametrize("name", [name for name in ANSWERS if name not in ("usual", "one, force")])
def test_a_new_solid_passes_the_check(name: str, tmp_path: Path) -> None:
    from tests.shared.command import called

    path = tmp_path / "my.toml"
    path.write_text(ANSWERS[name].case_text(path), encoding="utf-8")
    done = called("check", path)
    assert done.returncode == 0, done.stderr
