"""Lives of pairs of files of structures: against closed forms of a mass that wears the wall it is pressed on."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gapbeam as gb
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene_file.scene_reader import scene_file
from gapbeam.studies.life.case_rates import SceneRates
from gapbeam.studies.trials.scene_subject import SceneSubject

RUB = """
[[structure]]
name = "shoe"
model = { type = "mass", motions = 2, mass = 0.5, stiffness = 2000.0, damping = 40.0 }

[[pair]]
name = "wall"
between = ["shoe.at"]
region = { type = "half-plane", clearance = 0.0, normal = [1.0, 0.0] }
law = { type = "kelvin-voigt", stiffness = 1e5, damping = 10.0 }

[[load]]
type = "constant_force"
name = "press"
point = "shoe.at"
amplitude = 5.0
direction = [1.0, 0.0]

[[load]]
type = "harmonic_force"
name = "drive"
point = "shoe.at"
amplitude = 10.0
frequency = 20.0
direction = [0.0, 1.0]

[start]
state = "seat"

[wear]
coefficient = 1e-12
area = 1e-6
depth_limit = 1.5e-3

[time]
step = 2.5e-4
end = 6.0
"""


def test_a_life_follows_the_pressed_mass_into_the_wall(tmp_path: Path) -> None:
    """A mass slides along a wall that it wears, and its spring takes the force off it as it follows.

    The tangential amplitude is A = F / |K - m w^2 + i c w|, the normal force (P - K d) k / (k + K) at the depth d, and
    so t = ln(P / (P - K d)) / (K b) with b = 4 A f k_w / area * k / (k + K): to 0.5 %, and its interval holds it.
    """
    path = tmp_path / "rub.toml"
    path.write_text(RUB)
    result = gb.life(path, output=tmp_path / "life", tolerance=0.005)
    omega, K = 2.0 * np.pi * 20.0, 2000.0
    amplitude = 10.0 / abs(K - 0.5 * omega**2 + 40.0j * omega)
    speed = 4.0 * amplitude * 20.0 * 1e-12 / 1e-6 * 1e5 / (1e5 + K)
    expected = np.log(5.0 / (5.0 - K * 1.5e-3)) / (K * speed)
    assert result.exit_status == 0
    assert result.worn.life == pytest.approx(expected, rel=5e-3)
    assert result.worn.low is not None
    assert result.worn.high is not None
    assert result.worn.low < 1.001 * expected
    assert result.worn.high > 0.999 * expected
    stored = json.loads((tmp_path / "life" / "life.json").read_text())
    assert stored["verdict"] == "good"
    assert stored["states"][-1]["clearances"]["wall"] == pytest.approx(1.5e-3, rel=1e-6)
    again = gb.life(path, output=tmp_path / "life", tolerance=0.005)
    assert (again.kept, again.worn.life) == (result.worn.runs, result.worn.life)


def test_a_hard_pressed_mass_wears_at_a_constant_rate(tmp_path: Path) -> None:
    """Archard's volume is k times the work: without a spring across the wall the depth grows as k W' t / area."""
    path = tmp_path / "rub.toml"
    path.write_text(RUB)
    limit = {"wear.depth_limit": 1e-6, "time.end": 6.0}
    result = gb.life(path, limit, output=tmp_path / "life")
    work = gb.run(path, limit, output=tmp_path / "run").summary["wear"]["faces"]["wall"]["work_rate"]["value"]
    assert result.worn.life == pytest.approx(1e-6 * 1e-6 / (1e-12 * work), rel=2e-3)


def test_each_run_of_a_life_under_noise_has_noise_of_its_own(tmp_path: Path) -> None:
    """W' = N sigma sqrt(2 / pi) of a Gaussian speed, sigma^2 = S / (4 m c), beside a mean force N, in each interval."""
    path, start = tmp_path / "noise.toml", RUB.index('type = "harmonic_force"')
    noise = ""
    for name, along, density in (("along", [0, 1], 0.5), ("across", [1, 0], 1e-4)):
        noise += f'[[load]]\ntype = "random"\nname = "{name}"\npoint = "shoe.at"\ndirection = {along}\n'
        noise += f'spectrum = {{ type = "white", density = {density}, high = 200.0 }}\n\n'
    path.write_text(RUB[:start].removesuffix("[[load]]\n") + noise + RUB[RUB.index("[start]") :])
    light = {"structure.shoe.model.damping": 4.0, "time.step": 1e-3, "time.end": 60.0}
    rates = SceneRates(SceneSubject(scene_file(path, light)))
    depths = np.zeros(1)
    found = [rates(depths, number) for number in (0, 1, 1)]
    force, spread = 5.0 * 1e5 / (1e5 + 2000.0), np.sqrt(0.5 / (4.0 * 0.5 * 4.0))
    expected = 1e-12 / 1e-6 * force * spread * np.sqrt(2.0 / np.pi)
    for one in found:
        assert one.low[0] < expected < one.high[0]
        assert one.high[0] < 1.25 * one.low[0]
    assert found[0].values[0] != found[1].values[0] == found[2].values[0]
    other, times = rates.worn(depths, 1), np.linspace(0.0, 1.0, 9)
    assert other.scene.structures[0] is rates.scene.structures[0]
    anew = SceneSubject(other.file)  # which sets up its structures
    drawn = [np.hstack([load.table(times) for load in one.scene.loads]) for one in (rates.worn(depths), other, anew)]
    assert np.array_equal(drawn[1], drawn[2])
    assert not np.any(np.all(drawn[0] == drawn[1], axis=0)[1:])


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"wear": {"coefficient": 1e-12, "area": 1e-6}}, "found no depth_limit"),
        ({"wear": {}}, "found no coefficient and no area and no depth_limit"),
        ({"time.end": 0.1, "output.history_interval": 0.01}, "too few records"),
    ],
)
def test_a_life_without_its_values_is_refused(overrides: dict[str, object], words: str, tmp_path: Path) -> None:
    """By the key that lacks."""
    path = tmp_path / "rub.toml"
    path.write_text(RUB)
    with pytest.raises(UserError, match=words):
        gb.life(path, overrides, output=tmp_path / "life")


def test_pairs_of_one_motion_have_no_life(tmp_path: Path) -> None:
    """They do not slide: refused with what to do."""
    path, one = tmp_path / "rub.toml", RUB
    for words in ("motions = 2, ", ", normal = [1.0, 0.0]", "direction = [1.0, 0.0]", "direction = [0.0, 1.0]"):
        one = one.replace(words, "")
    path.write_text(one)
    with pytest.raises(UserError, match="no pair of two motions"):
        gb.life(path, output=tmp_path / "life")


def test_a_hole_that_opens_wears_as_one_of_that_clearance(tmp_path: Path) -> None:
    """Rates of a pin in a hole at two depths: a clearance that does not change, by a table, is the clearance."""
    hole = RUB.replace('"half-plane", clearance = 0.0, normal = [1.0, 0.0]', '"disc", clearance = 1e-4')
    closure = '[[load]]\ntype = "clearance_change"\nname = "heat"\nsupport = "wall"\n'
    closure += "times = [0.0, 1.0]\nchanges = [0.0, 0.0]\n"
    rates = []
    for name, text in (("plain", hole), ("opened", hole.replace("[start]", closure + "\n[start]"))):
        path = tmp_path / f"{name}.toml"
        path.write_text(text)
        found = SceneRates(SceneSubject(scene_file(path, {"time.end": 2.0})))
        assert found.names == ["wall"]
        rates.append([found(np.array([depth]), 0).values[0] for depth in (0.0, 5e-5)])
    assert rates[0][0] > 0.0
    assert rates[1] == pytest.approx(rates[0], rel=1e-6)
