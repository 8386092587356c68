"""Folders of studies: the same study resumes or replaces its results, another one is refused by what differs."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.study_folder import StudyPlan, study_folder
from tests.shared.command import PROJECT, called_in_turn

CASES = PROJECT / "cases"
QUICK = ("time.end=0.02", "load.shaker.amplitude=1000", "load.shaker.frequency=50")
STOP = (
    "model.type=beam", "model.elements=4", "contact.quadrature_degree=1", "damping.ratios=[0.05,0.05]",
    "time.step=4e-4",
)  # fmt: skip
LEAF = st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text("xy é.=", max_size=9)
PLAIN = st.recursive(
    LEAF | st.lists(LEAF, max_size=3),
    lambda inner: st.dictionaries(st.text("abc", min_size=1), inner, min_size=1, max_size=3),
    max_leaves=6,
)
INPUTS = st.dictionaries(st.text("abcd", min_size=1, max_size=3), PLAIN, min_size=1, max_size=4)


def _set(*texts: str) -> list[str]:
    return [part for text in texts for part in ("--set", text)]


COMMANDS = {
    "modes": (["modes", CASES / "demo.toml"], ["--count", "3"], "count: 4 there, 3 now", "modes.json"),
    "stability": (
        [
            "stability", CASES / "stability.toml", "--stiffness", "1e10,1e11", "--step", "1e-4", "--scheme", "newmark",
            "--workers", "1", *_set(*QUICK),
        ],
        ["--stiffness", "1e10,1e12"],
        "values of contact.stiffness: ['1e10', '1e11'] there, ['1e10', '1e12'] now",
        "stability.json",
    ),
    "atlas": (
        ["atlas", CASES / "cantilever-stop.toml", "--starts", "4", "--settle", "20", *_set(*STOP)],
        ["--seed", "1"],
        "seed: 0 there, 1 now",
        "atlas.json",
    ),
    "optimize": (
        ["optimize", CASES / "studies" / "optimize-stop.toml"],
        _set("damping.ratios=[0.06,0.06]"),
        "damping.ratios: [0.05, 0.05] there, [0.06, 0.06] now",
        "optimum.json",
    ),
    "sweep": (
        ["sweep", CASES / "recorded.toml", "support.clearance=1e-4,2e-4", "--workers", "1", *_set("time.end=0.01")],
        _set("contact.damping=1e7"),
        "contact.damping: 30000000.0 there, 10000000.0 now",
        "sweep.json",
    ),
}  # fmt: skip


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("name", COMMANDS)
def test_results_of_other_inputs_stay(name: str, tmp_path: Path) -> None:
    """A study of other inputs is refused, and leaves every byte; the same one and --overwrite pass."""
    study, change, words, file = COMMANDS[name]
    study = [*study, "--output", tmp_path / "out"]
    (first,) = called_in_turn(study)
    assert first.returncode in (0, 5), first.stderr
    kept = (tmp_path / "out" / file).read_bytes()
    (other,) = called_in_turn([*study, *change])
    assert other.returncode == 2
    assert words in other.stderr
    assert "--overwrite" in other.stderr
    assert (tmp_path / "out" / file).read_bytes() == kept
    again, anew = called_in_turn(study, [*study, *change, "--overwrite"])
    assert (again.returncode, anew.returncode) == (first.returncode, first.returncode), again.stderr + anew.stderr


@pytest.mark.slow(minutes=0.2)
def test_a_recording_that_changed_is_another_study(tmp_path: Path) -> None:
    """Its path is the same, its rows are not."""
    text = (CASES / "recorded.toml").read_text().replace("signals/transport.csv", "signal.csv")
    (tmp_path / "case.toml").write_text(text)
    rows = (CASES / "signals" / "transport.csv").read_text()
    (tmp_path / "signal.csv").write_text(rows)
    study = [
        "sweep", tmp_path / "case.toml", "support.clearance=1e-4,2e-4", "--workers", "1", "--set", "time.end=0.01",
        "--output", tmp_path / "out",
    ]  # fmt: skip
    (first,) = called_in_turn(study)
    assert first.returncode == 0, first.stderr
    (tmp_path / "signal.csv").write_text(rows.rstrip("\n") + "1\n")
    (other,) = called_in_turn(study)
    assert other.returncode == 2
    assert "load.base.checksum: " in other.stderr


@given(first=INPUTS, second=INPUTS)
def test_plans_differ_as_their_inputs_do(first: dict[str, object], second: dict[str, object]) -> None:
    """Drawn inputs: the same ones resume, others are refused and keep the records, or begin anew where asked."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as name:
        folder = Path(name)

        def records(plan: StudyPlan) -> list[str]:
            with study_folder(folder, plan=plan):
                return [path.name for path in (folder / "done", folder / "log") if path.exists()]

        assert records(StudyPlan(first, records=("done", "log"))) == []
        (folder / "done").mkdir()
        (folder / "log").write_text("one")
        assert records(StudyPlan(first, records=("done", "log"))) == ["done", "log"]
        if first != second:
            with pytest.raises(UserError, match="holds a study of other inputs"):
                records(StudyPlan(second, records=("done", "log")))
            assert (folder / "log").exists()
        assert records(StudyPlan(second, overwrite=True, records=("done", "log"))) == []


@pytest.mark.parametrize("begun", [False, True])
@pytest.mark.parametrize("before", [False, True])
def test_a_study_that_fails_before_its_first_record_stands_in_the_way_of_none(
    before: bool, begun: bool, tmp_path: Path
) -> None:
    """Its inputs stay where it left records, from which it resumes; else those of the study before are back."""
    folder = tmp_path / "out"

    def study(number: int, *, overwrite: bool = False, fails: bool = False) -> None:
        with study_folder(folder, plan=StudyPlan({"number": number}, overwrite, ("log",))):
            (folder / "log").write_text("one" if begun else "")
            if fails:
                raise KeyboardInterrupt

    if before:
        study(1)
    with pytest.raises(KeyboardInterrupt):
        study(2, overwrite=True, fails=True)
    assert folder.exists() is (before or begun)
    if begun or before:
        with pytest.raises(UserError, match=r"number: [12] there, 3 now"):
            study(3)
        study(2 if begun else 1)
    else:
        study(3)
