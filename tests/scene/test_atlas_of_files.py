"""The command `gapbeam atlas` of files of structures: killed, it resumes after its last point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gapbeam.commands.study_choice import atlas
from gapbeam.interface.case_atlas import repeating_scene
from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.atlas import run_atlas
from tests.shared.command import PROJECT

FLUTTER = PROJECT / "cases" / "scenes" / "freeplay-flutter.toml"


def test_random_loads_have_no_atlas(tmp_path: Path) -> None:
    """Refused by their names, with what to do."""
    noise = '[[load]]\ntype = "random"\nname = "eddies"\npoint = "wing.plunge"\n'
    noise += 'spectrum = { type = "white", density = 1e-6, high = 5.0 }\n'
    path = tmp_path / "noise.toml"
    path.write_text(FLUTTER.read_text().replace('"flutter-', f'"{FLUTTER.parent}/flutter-') + noise)
    with pytest.raises(UserError, match=r"random load eddies, under which no motion repeats[^$]*`gapbeam run`"):
        repeating_scene(path, [])


def test_limit_cycles_are_not_followed(tmp_path: Path) -> None:
    """Refused before anything is searched: the option did nothing, without a word."""
    options = {"settle": 10, "rounds": 1, "orders": 1, "reach": 2.0, "seed": 0, "follow": True}
    with pytest.raises(UserError, match="leave out --follow"):
        atlas(FLUTTER, ["feedback.air.velocity=3.6,4.0"], None, 1, output=tmp_path / "found", **options)


@pytest.mark.slow(minutes=0.4)
def test_a_killed_atlas_of_a_flow_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed as its picture is drawn: called again it searches no more, and comes to the same table to the bit."""
    search, draw, searched, dead = run_atlas.cycle_atlas, run_atlas.draw_cycles, list[Any](), True

    def counted(scene: Any, *others: Any) -> Any:
        searched.append(scene)
        return search(scene, *others)

    def killed(*parts: Any) -> Any:
        if dead:
            raise KeyboardInterrupt
        return draw(*parts)

    monkeypatch.setattr(run_atlas, "cycle_atlas", counted)
    monkeypatch.setattr(run_atlas, "draw_cycles", killed)

    def found() -> str:
        options = {"settle": 10, "rounds": 1, "orders": 1, "reach": 2.0, "seed": 0}
        atlas(FLUTTER, ["feedback.air.velocity=3.6"], None, 1, output=tmp_path / "found", **options)
        return (tmp_path / "found" / "atlas.json").read_text()

    with pytest.raises(KeyboardInterrupt):
        found()
    before, dead = (tmp_path / "found" / "atlas.json").read_text(), False
    assert "period" in before
    assert found() == before
    assert len(searched) == 1
    assert not (tmp_path / "found" / "points.jsonl").exists()
