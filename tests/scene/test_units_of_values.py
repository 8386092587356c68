"""Units of values of a scene by their paths: by dimensions, of every law, region and load that is shipped."""

from __future__ import annotations

import pytest

import gapbeam as gb
from gapbeam.solver.scene.recorded_places import units_of_values
from gapbeam.solver.scene.scene_load import sine
from tests.scene.test_rotation_units import hinged

LAWS = {
    "KelvinVoigt": gb.KelvinVoigt(1e5, 3.0), "ElastoGap": gb.ElastoGap(1e5, 3.0), "Cubic": gb.Cubic(1e5, 1e-3),
    "Hertz": gb.HuntCrossley(1e7, 0.2), "soft": gb.HuntCrossley(1e7, 0.2, exponent=2.2),
    "linear": gb.HuntCrossley(1e7, 0.2, exponent=1.0), "Adhesive": gb.Adhesive(1e5, 2.0, 1e-4),
}  # fmt: skip
BY_METERS = {"": 0.0, "m": 1.0, "N": 0.0, "N/m": -1.0, "s/m": -1.0, "N s/m": -1.0, "N/m^1.5": -1.5, "N/m^2.2": -2.2}


def _force(law: gb.ForceLaw, depth: float, rate: float, unit: float) -> float:
    """Return the force of a law, N, whose values, depth (m) and rate (m/s) are written in another unit of length."""
    kind = law.kind
    spoken = units_of_values(_scene(law), [f"stop.{name}" for name in kind.names])
    values = [
        one * unit ** -BY_METERS[spoken[f"stop.{name}"]] for name, one in zip(kind.names, law.values, strict=True)
    ]
    spring = kind.spring.py_func(depth / unit, *values)
    damper = 0.0 if kind.damper is None else kind.damper.py_func(spring, 1.0, rate / unit, *values)
    return float(spring + damper)


def _scene(law: gb.ForceLaw) -> gb.Scene:
    body = gb.mass(2.0, stiffness=5.0, name="body")
    stop = gb.Contact(body["at"], gb.HalfPlane(1e-3), law, name="stop")
    loads = [
        gb.Force(body["at"], sine, amplitude=3.0, frequency=20.0, phase=10.0, scale=1.0, name="push"),
        gb.BaseMotion(body, sine, amplitude=3.0, frequency=20.0, name="floor"),
    ]
    return gb.Scene(body, contacts=[stop], loads=loads)


@pytest.mark.parametrize("name", LAWS)
def test_a_force_is_the_same_in_any_unit_of_length(name: str) -> None:
    """A law whose values are converted by their units gives the same N at the same depth and speed."""
    law = LAWS[name]
    for unit in (1e-3, 0.0254):
        found, expected = _force(law, 2e-4, 0.03, unit), _force(law, 2e-4, 0.03, 1.0)
        assert expected > 0.0
        assert found == pytest.approx(expected, rel=1e-9)


def test_values_have_units_and_factors_have_none() -> None:
    """Lengths in m, loads in their own unit, all contacts of a star; none for factors, mixed and unknown owners."""
    asked = {
        "stop.clearance": "m", "st*.offset": "m", "stop.stiffness_factor": "", "body.damping_factor": "",
        "push.amplitude": "N", "push.frequency": "Hz", "push.phase": "degrees", "push.scale": "",
        "floor.amplitude": "m/s^2", "*.amplitude": "", "nobody.clearance": "",
    }  # fmt: skip
    assert units_of_values(_scene(LAWS["Cubic"]), asked) == asked


def test_rotations_have_angles_and_moments() -> None:
    """A contact between rotations has rad and N m/rad."""
    asked = {"play.clearance": "rad", "play.stiffness": "N m/rad", "play.damping": "N m s/rad", "push.frequency": "Hz"}
    assert units_of_values(gb.scene(hinged(about=[0.0, 1.0, 0.0])), asked) == asked
