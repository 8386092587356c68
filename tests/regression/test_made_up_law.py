"""A contact law is added by one file and the list of laws, and is there for both marches, the checks and the gates."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gapbeam.solver.contact.laws import law_choice
from tests.regression.test_made_up_schemes import CASE
from tests.shared.command import PROJECT, alone, process_environment

CHANGES = (
    (
        "from gapbeam.solver.contact.laws.springs import",
        "from gapbeam.solver.contact.laws.made_up_law import GrowingLaw, growing_damping\n"
        "from gapbeam.solver.contact.laws.springs import",
    ),
    ("PiecewiseLinear | ElasticPlastic,", "PiecewiseLinear | ElasticPlastic | GrowingLaw,"),
    ("HUNT_CROSSLEY, ADAMS_IMPACT = range(4)", "HUNT_CROSSLEY, ADAMS_IMPACT, GROWING = range(5)"),
    ('"adams-impact": ADAMS_IMPACT}', '"adams-impact": ADAMS_IMPACT, "growing": GROWING}'),
    (
        "stepped_damping(at, depth)\n",
        "stepped_damping(at, depth)\n    if formula == GROWING:\n        return growing_damping(at, depth)\n",
    ),
)


def listed() -> str:
    """Return the list of laws with the made-up one: five lines."""
    text = Path(law_choice.__file__).read_text(encoding="utf-8")
    for old, new in CHANGES:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@pytest.mark.slow(minutes=0.3)
@alone
def test_a_made_up_law_is_checked_marched_and_judged(tmp_path: Path) -> None:
    """Two files are enough. Machine code is not taken from the cache of the package, which does not know the law."""
    room = tmp_path / "overlay" / "gapbeam" / "solver" / "contact" / "laws"
    room.mkdir(parents=True)
    shutil.copy(PROJECT / "tests" / "programs" / "made_up_law.py", room)
    (room / "law_choice.py").write_text(listed(), encoding="utf-8")
    assert len([path for path in (tmp_path / "overlay").rglob("*") if path.is_file()]) == 2
    case = tmp_path / "case.toml"
    contact = 'contact = { stiffness = 1.0e11, law = { type = "growing", growth = 1.0e12 } }'
    text = CASE.replace("contact = { stiffness = 1.0e11 }", contact)
    assert contact in text
    case.write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "tests.programs.use_made_up_law", tmp_path / "overlay", case, tmp_path],
        cwd=PROJECT,
        env={**process_environment(), "NUMBA_CACHE_DIR": str(tmp_path / "machine_code")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    message = json.loads(done.stdout.splitlines()[-1])
    assert message["laws"] == [*law_choice.LAWS, "growing"]
    assert max(message["alike"]) < 1.0e-12
    status, words = message["check"]
    assert status == 0, words
    status, words = message["schema"]
    assert (status, "growth b of the damping" in words) == (0, True)
    status, words = message["damped twice"]
    assert (status, "the law growing brings its own damping" in words) == (2, True), words
    status, words = message["exact"]
    assert (status, "kelvin-voigt, the law that the formulation unilateral knows" in words) == (2, True), words
    compiled, steps, elastic = message["compiled"], message["steps"], message["elastic"]
    assert [run["status"] for run in (compiled, steps, elastic)] == [0, 0, 0]
    assert compiled["loop"] == "compiled"
    tip, same, other = (np.array(run["tip"]) for run in (compiled, steps, elastic))
    scale = np.abs(tip).max()
    assert np.abs(tip - same).max() < 1.0e-9 * scale
    assert np.abs(tip - other).max() > 1.0e-3 * scale, "the law does nothing"
    assert compiled["lost"] > 0.0
    assert abs(compiled["lost"] - steps["lost"]) < 1.0e-9 * compiled["lost"]
    assert message["gated"]["status"] == 0, "what the law takes is booked as dissipation, not as an error of the steps"
