"""Sweeps of random responses: figures with intervals, and responses that coexist only where intervals are disjoint."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

from gapbeam.postprocess.report.blocks import TableBlock
from gapbeam.postprocess.report.sections.sweep_section import sweep_sections
from gapbeam.postprocess.study_figures.sweep_branches import census, census_words
from gapbeam.studies.sweep.sweep_plan import Chain, Sweep, chains_of, point_file
from gapbeam.studies.sweep.sweep_point import run_chain
from gapbeam.studies.sweep.sweep_tables import ensembles_of, write_tables
from gapbeam.studies.trials.axes import Axis

CASE = Path("cases/random-vibration.toml")
QUICK = ("model.elements=12", "model.type=beam", "load.shaker.spectrum.frequencies=[20.0, 40.0, 100.0, 200.0]")


def random_record(rms: tuple[float, float, float] | None, word: str = "random", peak: float = 1.0) -> dict[str, Any]:
    """Return a response with its rms, value and interval, and a largest value that chance has made."""
    figures: dict[str, Any] = {"tip displacement": {"unit": "m", "mean": peak, "scatter": 0.0, "unsettled": 0.0}}
    if rms is not None:
        value, low, high = rms
        figures["probe.tip.rms"] = {
            "unit": "m", "mean": value, "low": low, "high": high, "scatter": 0.5 * (high - low), "unsettled": 0.0,
        }  # fmt: skip
    return {
        "values": {"load.noise.seed": "1"}, "direction": "", "start": "seat", "verdict": "passed", "exit_status": 0,
        "message": "", "notes": [], "response": word, "windows": 1, "figures": figures,
    }  # fmt: skip


def test_random_responses_coexist_where_intervals_are_disjoint() -> None:
    """Largest values differ from record to record and say nothing; intervals that overlap are one response."""
    alike = [random_record((1.0, 0.9, 1.1), peak=3.0), random_record((1.15, 1.05, 1.25), peak=4.0)]
    (point,) = census(alike, 0.02)
    assert (point.coexisting, point.branches[0].count) == (1, 2)
    apart = [random_record((1.0, 0.9, 1.1)), random_record((1.3, 1.2, 1.4))]
    assert census(apart, 0.02)[0].coexisting == 2
    unsettled = [random_record((1.0, 0.9, 1.1)), random_record(None, "not settled", peak=9.0)]
    (point,) = census(unsettled, 0.02)
    assert (point.coexisting, point.unsettled) == (1, 1)
    assert "no steady state yet in 1 response:" in census_words([point])[1]
    other_face = [random_record((1.0, 0.9, 1.1)), random_record((1.0, 0.9, 1.1))]
    for one, share in zip(other_face, (0.1, 0.3), strict=True):
        one["figures"]["face.base.contact_share"] = {
            "unit": "1", "mean": share, "low": 0.9 * share, "high": 1.1 * share, "scatter": 0.1 * share,
        }  # fmt: skip
    assert census(other_face, 0.02)[0].coexisting == 2


def test_chaotic_responses_are_compared_by_their_intervals() -> None:
    """Chaos with intervals is judged by them; a periodic response beside it is another one, whatever its rms."""
    chaos = [random_record((1.0, 0.9, 1.1), "no cycle", 2.0), random_record((1.05, 0.95, 1.15), "no cycle", 3.0)]
    for one in chaos:
        one["windows"] = 4
    assert census(chaos, 0.02)[0].coexisting == 1
    periodic = random_record(None, "period 1", 2.0)
    assert census([*chaos, periodic], 0.02)[0].coexisting == 2


def test_intervals_stand_in_the_tables(tmp_path: Path) -> None:
    """sweep.csv has low and high beside the value, sweep.json the same; the picture shows the rms."""
    records = [random_record((1.0, 0.9, 1.1)), random_record((1.3, 1.2, 1.4))]
    paths = write_tables(tmp_path, records, census(records, 0.02))
    with paths[0].open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    ends = [[float(row[f"probe.tip.rms {end}(m)"]) for end in ("", "low ", "high ")] for row in rows]
    assert ends == [[1.0, 0.9, 1.1], [1.3, 1.2, 1.4]]
    assert paths[-1].name == "sweep.png"


def test_a_short_random_sweep_is_not_settled(tmp_path: Path) -> None:
    """Two seeds of 0.3 s each: no interval holds, so that the sweep cannot tell, and says so."""
    changes = (*QUICK, "time.end=0.3", "time.step=2e-4", "output.history_interval=4e-4")
    sweep = Sweep(CASE, changes, (Axis("load.shaker.seed", ("1", "2")),))
    (tmp_path / "points").mkdir()
    tasks = [task for chain in chains_of(sweep, tmp_path) for task in chain.tasks]
    assert run_chain(Chain(sweep, tmp_path, tuple(tasks))) == 2
    records = [json.loads(point_file(tmp_path, task).read_text(encoding="utf-8")) for task in tasks]
    assert {one["response"] for one in records} == {"not settled"}, [one["message"] for one in records]
    for one in records:
        assert one["statistics"]["verdict"] in ("too short", "not settled")
        assert any(note.startswith("not settled: ") for note in one["notes"])
    assert "no steady state yet in" in census_words(census(records, sweep.tolerance))[1]
    (ensemble,) = ensembles_of(records)
    work = {one["name"]: one for one in ensemble.figures}["probe.tip.rms"]
    assert (ensemble.members, work["verdict"]) == (2, "too short")
    members = [
        next(one for one in found["statistics"]["figures"] if one["name"] == "probe.tip.rms") for found in records
    ]
    assert work["relative"] < max(one["relative"] for one in members)
    paths = write_tables(tmp_path, records, census(records, sweep.tolerance))
    assert json.loads((tmp_path / "ensembles.json").read_text())[0]["figures"] == ensemble.figures
    assert paths[-1].name == "ensembles.json"
    (section,) = [one for one in sweep_sections(tmp_path, "") if one.title == "Members together"]
    (table,) = section.blocks
    assert isinstance(table, TableBlock)
    assert "probe.tip.rms" in [row[0] for row in table.rows]
    write_tables(tmp_path, records[:1], census(records[:1], sweep.tolerance))
    assert not (tmp_path / "ensembles.json").exists()
