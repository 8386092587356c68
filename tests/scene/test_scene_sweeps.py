"""Sweeps of files of structures, against single runs, closed forms and exact scaling."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gapbeam as gb
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.studies.sweep.sweep_plan import Chain, Sweep, chains_of, point_file
from gapbeam.studies.sweep.sweep_point import run_chain
from gapbeam.studies.trials.axes import read_axis
from tests.shared.command import PROJECT

RATTLE = """
[[structure]]
name = "ball"
model = { type = "mass", mass = 1.0, stiffness = 400.0, damping = 4.0 }

[[pair]]
name = "stop"
between = ["ball.at"]
region = { type = "half-plane", clearance = 1e-3 }
law = { type = "kelvin-voigt", stiffness = 1e4, damping = 5.0 }

[[load]]
type = "harmonic_force"
name = "shaker"
point = "ball.at"
amplitude = 1.0
frequency = 2.0
ramp = 0.5

[[figure]]
name = "knock"
quantity = "contact_force"
place = "stop"

[time]
step = 1e-3
end = 12.0
"""
FLUTTER = PROJECT / "cases" / "scenes" / "freeplay-flutter.toml"


@pytest.fixture
def rattle(tmp_path: Path) -> Path:
    """Return the file of a mass on a spring beside a stop."""
    path = tmp_path / "rattle.toml"
    path.write_text(RATTLE)
    return path


def test_a_point_has_the_figures_of_its_run(rattle: Path, tmp_path: Path) -> None:
    """Own figure, created energy, steps and largest force are those of `run` with the same overrides, to round-off."""
    keys = {"stop.clearance": [1e-3, 2e-3], "pair.stop.law.stiffness": [1e4, 2e4], "shaker.amplitude": [1.0]}
    result = gb.sweep(rattle, keys, {"time.end": 8.0}, output=tmp_path / "sweep", workers=1)
    assert result.exit_status == 0
    assert len(result.records) == 4
    for number, record in enumerate(result.records):
        texts = [f"{key}={value}" for key, value in record["values"].items()]
        outcome = gb.run(rattle, [*texts, "time.end=8"], output=tmp_path / f"run{number}")
        knock = outcome.summary["figures"]["knock"]["value"]
        assert record["figures"]["knock"]["mean"] == pytest.approx(knock, rel=1e-9)
        assert record["peak_force"] == pytest.approx(outcome.summary["peak_contact_force"]["stop"], rel=1e-12)
        assert record["response"] == "period 1"
    assert len({record["peak_force"] for record in result.records}) == 4


@pytest.mark.slow(minutes=0.4)
def test_workers_come_to_the_same_sweep(tmp_path: Path) -> None:
    """A wing in a flow over three velocities, by one process and by two workers: the same to the bit."""
    keys = {"air.velocity": [3.4, 3.6, 3.8]}
    one, two = (gb.sweep(FLUTTER, keys, {"time.end": 30.0}, output=tmp_path / f"{n}", workers=n) for n in (1, 2))
    assert (one.exit_status, two.exit_status) == (0, 0)
    kept = [[{k: v for k, v in r.items() if "seconds" not in k} for r in found.records] for found in (one, two)]
    assert kept[0] == kept[1]


def test_an_open_gap_gives_the_linear_response(rattle: Path, tmp_path: Path) -> None:
    """Peak to peak 2 F / |k - m w^2 + i c w| of a mass that never touches, at three frequencies, to 1e-3."""
    keys = {"stop.clearance": [1.0], "load.shaker.frequency": [1.0, 2.0, 5.0]}
    result = gb.sweep(rattle, keys, {"time.end": 20.0}, output=tmp_path / "sweep", workers=1)
    for record, frequency in zip(result.records, keys["load.shaker.frequency"], strict=True):
        omega = 2.0 * np.pi * frequency
        expected = 2.0 / abs(400.0 - omega**2 + 4.0j * omega)
        assert record["figures"]["at peak-to-peak displacement"]["mean"] == pytest.approx(expected, rel=1e-3)
        assert (record["figures"]["knock"]["mean"], record["response"]) == (0.0, "period 1")


def test_flutter_with_play_scales_with_the_play(tmp_path: Path) -> None:
    """A piecewise linear wing with twice the play under twice the gust moves twice as far, at two velocities."""
    keys = {
        "freeplay.clearance": [0.01, 0.02] * 2,
        "gust.amplitude": [0.3, 0.6] * 2,
        "air.velocity": [3.4, 3.4, 3.8, 3.8],
    }
    result = gb.sweep(FLUTTER, keys, {"time.end": 250.0}, zipped=True, output=tmp_path / "sweep", workers=1)
    for once, twice in (result.records[:2], result.records[2:]):
        known = {one["name"]: one for one in once["statistics"]["figures"]}
        for figure in twice["statistics"]["figures"]:
            if figure["unit"] in ("m", "N"):
                assert figure["value"] == pytest.approx(2.0 * known[figure["name"]]["value"], rel=1e-6, abs=1e-12)
                assert figure["verdict"] == known[figure["name"]]["verdict"]
    slow, fast = (result.records[place]["figures"]["probe.pitch.rms"]["mean"] for place in (0, 2))
    assert fast > 1.2 * slow
    assert "peaks over the record after" in result.records[0]["notes"][0]


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize(
    ("quantity", "place"), [("displacement", "ball.at"), ("velocity", "ball.at"), ("velocity", "at")]
)
def test_a_point_has_the_figures_of_places_that_its_run_takes(
    rattle: Path, tmp_path: Path, quantity: str, place: str, noise: bool
) -> None:
    """Names "structure.point" are those of records in sweeps as in runs."""
    text = rattle.read_text().replace(
        'quantity = "contact_force"\nplace = "stop"', f'quantity = "{quantity}"\nplace = "{place}"'
    )
    if noise:
        text = text.replace('"harmonic_force"', '"random"').replace("amplitude = 1.0\nfrequency = 2.0\n", "")
        text = text.replace("ramp = 0.5", 'spectrum = { type = "white", density = 0.5, high = 100.0 }')
    rattle.write_text(text)
    record = gb.sweep(rattle, {"stop.clearance": [1e-3]}, output=tmp_path / "sweep", workers=1).records[0]
    expected = gb.run(rattle, output=tmp_path / "run").summary["figures"]["knock"]["value"]
    assert record["figures"]["knock"]["mean"] == pytest.approx(expected, rel=1e-9)


def test_a_carried_sweep_resumes_to_the_same_figures(rattle: Path, tmp_path: Path) -> None:
    """Points along an amplitude, upward and downward: killed after three, the sweep goes on to the same records."""
    axes = (read_axis("shaker.amplitude=0.5,1,2", "linear", ""),)
    wanted = Sweep(rattle, ("time.end=4",), axes, carry=True, both=True)
    for name in ("whole", "killed"):
        (tmp_path / name / "points").mkdir(parents=True)
        for chain in chains_of(wanted, tmp_path / name):
            run_chain(chain)
    chain: Chain = chains_of(wanted, tmp_path / "killed")[1]
    point_file(chain.folder, chain.tasks[-1]).unlink()
    assert run_chain(chain) == 1

    def figures(name: str) -> list[dict[str, object]]:
        found = [json.loads(path.read_text()) for path in sorted((tmp_path / name / "points").glob("*.json"))]
        return [{key: one[key] for key in ("figures", "start", "direction", "notes")} for one in found]

    assert figures("whole") == figures("killed")
    assert [one["start"] for one in figures("whole")] == ["rest", "carried", "carried"] * 2


def test_kicks_are_starts_with_the_energy_of_the_loads(rattle: Path, tmp_path: Path) -> None:
    """Kicks differ by number, not from call to call, and a linear mass forgets them: one response at each point."""
    keys = {"stop.clearance": [1.0]}
    found = [gb.sweep(rattle, keys, starts=3, seed=4, output=tmp_path / name, workers=1) for name in ("first", "again")]
    texts = [json.dumps([record["figures"] for record in one.records]) for one in found]
    assert texts[0] == texts[1]
    assert [record["start"] for record in found[0].records] == ["rest", "kick 1", "kick 2"]
    assert len(found[0].points[0].branches) == 1
    assert len({record["residual"] for record in found[0].records}) == 3


def test_responses_under_noise_have_the_statistics_of_their_runs(rattle: Path, tmp_path: Path) -> None:
    """Two seeds: words, intervals and verdicts are those of `run`; the statistics of both are pooled."""
    noise = 'type = "random"\nname = "shaker"\npoint = "ball.at"\n'
    noise += 'spectrum = { type = "white", density = 0.5, high = 100.0 }\n\n'
    rattle.write_text(RATTLE[: RATTLE.index('type = "harmonic')] + noise + RATTLE[RATTLE.index("[[figure]]") :])
    fixed = ["time.end=60", "output.history_interval=4e-3"]
    result = gb.sweep(rattle, {"load.shaker.seed": [0, 1]}, fixed, output=tmp_path / "sweep", workers=1)
    assert [record["response"] for record in result.records] == ["random", "random"]
    for record in result.records:
        seed = f"load.shaker.seed={record['values']['load.shaker.seed']}"
        outcome = gb.run(rattle, [*fixed, seed], output=tmp_path / seed)
        assert record["statistics"] == outcome.summary["statistics"]
        rms = next(one for one in record["statistics"]["figures"] if one["name"] == "probe.at.rms")
        assert record["figures"]["probe.at.rms"]["low"] == rms["low"] < rms["high"]
    assert (tmp_path / "sweep" / "ensembles.json").exists()


def test_two_keys_make_a_map(rattle: Path, tmp_path: Path) -> None:
    """Nine points of two keys: table and map; the folder is of this sweep only."""
    folder, keys = tmp_path / "sweep", {"stop.clearance": "0.5e-3:2e-3:3", "load.shaker.amplitude": "1:2:3"}
    result = gb.sweep(rattle, keys, {"time.end": 4.0}, output=folder, workers=1)
    assert "9 of 9 responses passed" in result.headline()
    assert len((folder / "sweep.csv").read_text().splitlines()) == 10
    with Image.open(folder / "sweep-map.png") as picture:
        assert picture.size[0] > 500
    with pytest.raises(UserError, match=r"time\.end: 4.0 there, 5.0 now"):
        gb.sweep(rattle, keys, {"time.end": 5.0}, output=folder, workers=1)


@pytest.mark.parametrize(
    ("keys", "options", "words"),
    [
        ({"structure.ball.model.mass": [1.0, 2.0]}, {"carry": True}, "structure.ball.model.mass changes along"),
        ({"stopp.clearance": [1.0]}, {}, "did you mean `stop.clearance`"),
    ],
)
def test_what_cannot_be_swept_is_refused(
    keys: dict[str, list[float]], options: dict[str, bool], words: str, rattle: Path, tmp_path: Path
) -> None:
    """Before anything runs, by name."""
    with pytest.raises((UserError, CaseError), match=re.escape(words)):
        gb.sweep(rattle, keys, output=tmp_path / "sweep", workers=1, **options)
    assert not (tmp_path / "sweep" / "sweep.json").exists()


def test_points_that_fail_stay_in_the_table(rattle: Path, tmp_path: Path) -> None:
    """An unknown value of a pair, a clearance that is a text, kicks without forcing, energy that a scheme creates."""
    fixed = {"time.end": 1.0}
    sweep = gb.sweep(rattle, {"stop.clearnce": [1.0]}, fixed, output=tmp_path / "a", workers=1)
    assert sweep.exit_status == 2
    assert "it has" not in sweep.records[0]["message"]
    assert "expected: one of friction" in sweep.records[0]["message"]
    sweep = gb.sweep(rattle, {"shaker.amplitude": [0.0, 1.0]}, fixed, starts=2, output=tmp_path / "b", workers=1)
    assert [record["verdict"] for record in sweep.records] == ["passed", "refused", "passed", "passed"]
    assert "no load varies" in sweep.records[1]["message"]
    stiff = {"time.end": 1.0, "time.scheme": "newmark", "pair.stop.law.stiffness": 1e7}
    sweep = gb.sweep(rattle, {"shaker.amplitude": [1.0]}, stiff, output=tmp_path / "c", workers=1)
    assert (sweep.exit_status, sweep.records[0]["verdict"]) == (3, "energy created")
    assert sweep.records[0]["figures"]["stop largest recorded force"]["mean"] > 0.0


def test_the_text_of_structures_is_no_file_of_a_study(tmp_path: Path) -> None:
    """Workers read the file again: a text is refused, with what to do."""
    with pytest.raises(UserError, match="expected the path of their file"):
        gb.sweep(RATTLE, {"stop.clearance": [1e-3]}, output=tmp_path / "sweep", workers=1)
