"""Nonsense for every argument of the public nouns: refused in a sentence that names it, or taken; never a traceback."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from math import inf, nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gapbeam as gb

NONSENSE = [
    None, nan, inf, "a", -1, 0, -7.5, True, [], {}, [1, 2, 3], object(), np.ones((1, 2)), abs, {"x": 1},
    {"left.clearance": "a"}, {"left.clearance": [1e-4, nan]},
]  # fmt: skip
WRONG_KIND = object()


@cache
def calls() -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Return a sound call of each noun."""
    one = gb.mass(1.0, stiffness=1e4, damping=2.0)
    law, section, material = gb.KelvinVoigt(stiffness=1e6), gb.section("round", 0.02), gb.material(2e11, 7800.0)
    touch = gb.Contact(one["at"], gb.Slot(1e-4), law, name="left")
    shaker = gb.Force(one["at"], lambda t: 0.01 * np.sin(90.0 * t), name="shaker")
    scene = gb.Scene(one, contacts=[touch], loads=[shaker])
    still = gb.Scene(one, contacts=[touch])
    bracket = str(Path(__file__).parents[2] / "cases" / "scenes" / "bracket.inp")
    K = np.array([[2e4, -1e4], [-1e4, 1e4]])
    return {
        "Structure": (gb.Structure, {"M": np.eye(2), "K": K, "C": 0.1 * K, "points": {"tip": [0, 1.0]}, "name": "a"}),
        "from_modes": (
            gb.from_modes,
            {"frequencies": [10.0, 60.0], "ratio": 0.01, "points": {"tip": [1.0, -1.0]}, "name": "m"},
        ),
        "beam": (
            gb.beam,
            {
                "length": 1.0, "section": section, "material": material, "points": {"tip": 0.5}, "clamped": [0.0],
                "elements": 10, "name": "b",
            },
        ),
        "frame": (
            gb.frame,
            {
                "route": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
                "section": gb.space_section("round", 0.02),
                "material": material, "points": {"tip": (2.0, [0.0, 0.0, 1.0])}, "bends": 0.0, "flexibility": None,
                "clamped": [0.0], "pinned": [], "held": [], "up": [0.0, 0.0, 1.0], "elements": 10, "name": "f",
            },
        ),
        "state": (scene.state, {"displacement": {one: 1e-3}, "velocity": {one: [0.1]}, "t": 0.0}),
        "from_mesh": (
            gb.from_mesh,
            {
                "file": bracket, "materials": {"STEEL": material, "": material}, "units": "mm",
                "points": {"tip": {"set": "TIP", "direction": [0.0, 0.0, 1.0]}}, "clamped": ["ROOT"], "plane": None,
                "thickness": None, "frame": None, "place": None, "name": "m",
            },
        ),
        "orthotropic": (
            gb.orthotropic,
            {
                "young_moduli": [1e11, 1e10, 1e10], "poisson_ratios": [0.3, 0.3, 0.4],
                "shear_moduli": [4e9, 4e9, 3e9], "density": 1600.0, "axis": [1.0, 0.0, 0.0], "across": None,
            },
        ),
        "snubber": (
            gb.snubber,
            {
                "between": one["at"], "stiffness": 1e6, "release": 1e-3, "velocity": 1e-2, "acceleration": None,
                "damping": 0.0, "drag": 1.0, "name": "s",
            },
        ),
        "moving_force": (
            gb.moving_force,
            {"points": [one["at"], one["at"]], "places": [0.0, 1.0], "force": 10.0, "position": 2.0, "name": "w"},
        ),
        "moving_point": (
            gb.moving_point,
            {"points": [one["at"], one["at"]], "places": [0.0, 1.0], "position": 2.0, "name": "w"},
        ),
        "mass": (gb.mass, {"value": 1.0, "motions": 2, "stiffness": 1e4, "name": "m"}),
        "Contact": (
            gb.Contact,
            {
                "between": one["at"], "region": gb.Slot(1e-4), "law": law, "friction": 0.0, "offset": 0.0, "wall": None,
                "name": "left",
            },
        ),
        "Slot": (gb.Slot, {"clearance": 1e-4, "center": 0.0}),
        "Disc": (gb.Disc, {"clearance": 1e-4}),
        "HalfPlane": (gb.HalfPlane, {"clearance": 1e-4, "normal": 1.0}),
        "Polygon": (gb.Polygon, {"corners": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]}),
        "KelvinVoigt": (gb.KelvinVoigt, {"stiffness": 1e6, "damping": 1.0}),
        "HuntCrossley": (gb.HuntCrossley, {"stiffness": 1e6, "chi": 0.1, "exponent": 1.5}),
        "Force": (gb.Force, {"point": one["at"], "value": 3.0, "name": "s"}),
        "Scene": (lambda **some: gb.Scene(one, **some), {"contacts": [touch], "loads": [shaker], "masses": []}),
        "with_": (scene.with_, {"changes": {"left.clearance": 2e-4}}),
        "seat": (gb.seat, {"scene": scene, "t": 0.0}),
        "history": (gb.history, {"scene": scene, "step": 1e-4, "end": 1e-3}),
        "march": (lambda **some: list(gb.march(**some)), {"scene": scene, "step": 1e-4, "end": 1e-3, "every": 1}),
        "ensemble": (
            gb.ensemble,
            {"scene": scene, "values": {"left.clearance": [1e-4, 2e-4]}, "step": 1e-4, "end": 1e-3},
        ),
        "periodic": (gb.periodic, {"scene": scene, "period": pi / 45.0, "steps": 50}),
        "eigenvalues": (gb.eigenvalues, {"scene": still, "closed": ()}),
        "theta": (gb.theta, {"level": 0.6}),
        "Feedback": (
            gb.Feedback,
            {"sense": one["at"], "act": one["at"], "A": [[-1.0]], "B": [[1.0, 0.0]], "C": [[1.0]], "D": [[0.0, 0.0]]},
        ),
        "Joint": (gb.Joint, {"between": one["at"], "stiffness": 1.0, "damping": 0.0}),
    }  # fmt: skip


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", calls())
def test_no_argument_ends_in_a_traceback(name: str) -> None:
    """The sound call works; with one argument replaced it works, or says what it expected."""
    call, sound = calls()[name]
    call(**sound)
    for argument in sound:
        for value in NONSENSE:
            with suppress(gb.UserError, gb.NotConverged):
                call(**{**sound, argument: value})
        with pytest.raises(gb.UserError, match="expected"):
            call(**{**sound, argument: WRONG_KIND})


def test_a_keyword_that_does_not_exist_names_the_function() -> None:
    """As Python does for functions without checks."""
    with pytest.raises(TypeError, match=r"Slot\(\).*'play'"):
        gb.Slot(play=1e-4)


@pytest.mark.parametrize(
    ("law", "bad"),
    [
        (gb.KelvinVoigt, {"stiffness": -1.0}),
        (gb.KelvinVoigt, {"stiffness": 1.0, "damping": -1e-9}),
        (gb.ElastoGap, {"stiffness": 1.0, "damping": -1.0}),
        (gb.Cubic, {"stiffness": 1.0, "scale": 0.0}),
        (gb.HuntCrossley, {"stiffness": 1.0, "chi": -1.0}),
        (gb.Adhesive, {"stiffness": 1.0, "pull": 1.0, "reach": -1.0}),
    ],
)
def test_laws_that_would_create_energy_are_refused_also_in_one_member(law: Any, bad: dict[str, float]) -> None:
    name, value = list(bad.items())[-1]
    with pytest.raises(gb.UserError, match=f"{name}: found {value:g}, expected numbers"):
        law(**bad)
    with pytest.raises(gb.UserError, match=f"{name}: found {value:g}, expected numbers"):
        law(**{**bad, name: [1.0, value]})


def test_values_of_members_are_refused_where_one_scene_is_marched() -> None:
    one = gb.mass(1.0, stiffness=1e4)
    law = gb.KelvinVoigt(stiffness=1e6)
    for change in (
        {"region": gb.Slot([1e-4, 2e-4])},
        {"law": gb.KelvinVoigt(stiffness=[1e6, 2e6])},
        {"offset": [0, 1]},
    ):
        given = {"region": gb.Slot(1e-4), "law": law, "name": "stop", **change}
        scene = gb.Scene(one, contacts=[gb.Contact(one["at"], **given)], loads=[gb.Force(one["at"], 1.0, name="f")])
        for call in (gb.seat, lambda scene: gb.history(scene, 1e-4, 1e-3)):
            with pytest.raises(gb.UserError, match=r"contact stop: found 2 of .*gapbeam\.ensemble"):
                call(scene)
    many = scene.with_({"f.value": [1.0, 2.0], "stop.offset": 0.0})
    with pytest.raises(gb.UserError, match="load f: found 2 values, expected one value"):
        gb.history(many, 1e-4, 1e-3)


@pytest.mark.parametrize("turns", [1, 2, -1])
def test_a_star_is_no_convex_polygon(turns: int) -> None:
    """The corners of a pentagram turn left everywhere, too, but twice around."""
    angle = 2.0 * pi * turns * np.arange(5) / 5
    corners = np.column_stack([np.cos(angle), np.sin(angle)])
    if turns == 1:
        assert gb.Polygon(corners).kind.faces == 5
        return
    with pytest.raises(gb.UserError, match="once around"):
        gb.Polygon(corners)


@gb.region
def oval(x: Any, y: Any, a: Any, b: Any) -> Any:
    """Return about the distance to an ellipse."""
    return np.sqrt((x / a) ** 2 + (y / b) ** 2) - 1.0


@gb.law(potential=lambda x, pull: 0.5 * pull * x * x)
def bow(x: Any, pull: Any) -> Any:
    """Return the force of a linear spring."""
    return pull * x


@pytest.mark.parametrize(
    ("made", "values", "named"),
    [
        (gb.KelvinVoigt, (2.0, 1.0), {"stiffness": 2.0, "damping": 1.0}),
        (gb.HuntCrossley, (2.0, 0.1), {"stiffness": 2.0, "chi": 0.1}),
        (gb.Cubic, (1e6, 1e-3), {"stiffness": 1e6, "scale": 1e-3}),
        (gb.ElastoGap, (1e6, 10.0), {"stiffness": 1e6, "damping": 10.0}),
        (bow, (3.0,), {"pull": 3.0}),
        (oval, (1e-2, 2e-2), {"a": 1e-2, "b": 2e-2}),
    ],
    ids=lambda one: getattr(one, "__name__", getattr(one, "name", "")),
)
def test_laws_and_regions_take_values_in_the_order_of_their_names(made: Any, values: Any, named: Any) -> None:
    """The same with and without names; a value too many, and one that is given twice, are refused."""
    assert made(*values).values == made(**named).values
    first = next(iter(named))
    for wrong in ((*values, 1.0, 1.0), values):
        with pytest.raises((gb.UserError, TypeError), match=r"found|argument"):
            made(*wrong, **{first: 1.0})
    with pytest.raises((gb.UserError, TypeError), match=r"found 9 values|argument"):
        made(*([1.0] * 9))


@pytest.mark.parametrize("sliding", [None, 0.0, 1e-3])
@pytest.mark.parametrize("law", [gb.KelvinVoigt(1e5, 5.0), gb.Adhesive(1e5, 1.0, 1e-3)], ids=["spring", "glue"])
def test_a_polygon_has_as_many_corners_as_the_refusal_says(law: Any, sliding: float | None) -> None:
    """The number in the refusal is taken, one more is not; a table of radii may have more."""
    ball = gb.mass(1.0, 2, 100.0)
    rough = {} if sliding is None else {"friction": 0.1, "sliding": sliding}

    def contact(corners: int) -> gb.Contact:
        turns = 2.0 * np.pi * np.arange(corners) / corners
        return gb.Contact(ball["at"], gb.Polygon(1e-3 * np.array([np.cos(turns), np.sin(turns)]).T), law, **rough)

    with pytest.raises(gb.UserError, match="expected at most") as refused:
        contact(60)
    most = int(str(refused.value).split("at most ")[1].split(";")[0])
    found = gb.history(gb.Scene(ball, contacts=[contact(most)], loads=[gb.Force(ball["at"], 5.0)]), 1e-3, 0.1)
    assert np.abs(found.force[0]).max() > 1.0
    with pytest.raises(gb.UserError, match=f"at most {most}"):
        contact(most + 1)
    assert gb.Contact(ball["at"], gb.Polar(np.full(90, 1e-3)), law, **rough).motions == 2


WRONG = {
    "run": {"case": 3, "overwrite": "yes", "at_most": "1h"},
    "check": {"case": None},
    "view": {"case": 3.0},
    "modes": {"case": 3, "measured": 4},
    "sweep": {"case": 3, "values": "a"},
    "stability": {"case": 3},
    "life": {"case": 3},
    "plot": {"results": 3, "psd": "displacement", "zoom": "3"},
    "render": {"results": None, "frames": "12"},
    "export": {"results": 3, "records": "displacement", "every": 0.5},
    "report": {"results": 3, "pdf": "no"},
    "compare": {"a": 3, "tolerance": "1 %"},
    "open_results": {"results": 3},
    "fmu": {"case": 3, "inputs": "shaker"},
}


@pytest.mark.parametrize(("name", "argument"), [(name, argument) for name, some in WRONG.items() for argument in some])
def test_no_argument_of_a_command_ends_in_a_traceback(name: str, argument: str) -> None:
    """One of another kind is refused with what was expected, before anything is read."""
    sound = {"a": "here", "b": "there", "results": "here", "case": "none.toml", "values": {"time.end": [1.0]}}
    function = getattr(gb, name)
    given = {one: sound[one] for one in sound if one in inspect.signature(function).parameters}
    with pytest.raises(gb.UserError, match="expected"):
        function(**{**given, argument: WRONG[name][argument]})


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (lambda t: 0.0 * np.size(t) + np.zeros(3), r"at 0.001 s returned \[0. 0. 0.\] of shape \(3,\), expected a num"),
        (lambda t: np.exp(1j * t), "returned complex numbers"),
        (lambda t: {"t": t}, "expected a number"),
        (lambda t: f"{t}", "returned text"),
        (lambda t: t / undefined, r"failed \(NameError"),  # noqa: F821
        (lambda t, u: t + u, r"failed \(TypeError"),
        (lambda t: [1.0][8 + np.size(t)], r"failed \(IndexError"),
        (lambda t: np.nan * t, "is not finite"),
        ("3", "text"),
        ((np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[ns]"), [0.0, 1.0]), "dates, not s"),
        ((np.array([0, 1], dtype="timedelta64[s]"), [0.0, 1.0]), "spans of time, not s"),
    ],
)
def test_loads_that_are_no_numbers_are_refused(value: Any, words: str) -> None:
    """Functions that fail or return something else, and tables over dates, which are no seconds."""
    one = gb.mass(1.0, stiffness=1.0)
    with pytest.raises(gb.UserError, match=words):
        gb.history(gb.Scene(one, loads=[gb.Force(one["at"], value, name="f")]), 1e-3, 1e-2, scheme=gb.euler())


@pytest.mark.parametrize("path", ["left.clearance", "left.stiffness", "s.value"])
def test_members_have_one_value_each(path: str) -> None:
    """Tables of values are of offsets of two motions alone."""
    one = gb.mass(1.0, stiffness=1.0, name="a")
    stop = gb.Contact(one["at"], gb.Slot(1e-4), gb.KelvinVoigt(1e6), name="left")
    scene = gb.Scene(one, contacts=[stop], loads=[gb.Force(one["at"], 1.0, name="s")])
    with pytest.raises(gb.UserError, match=rf"{path}: found shape \(3, 2\), expected one value for each member"):
        gb.ensemble(scene, {path: np.ones((3, 2))}, step=1e-4, end=1e-3)


@pytest.mark.parametrize("kind", ["circle", "Tube", "pipe"])
def test_a_section_that_does_not_exist_is_refused_with_those_that_do(kind: str) -> None:
    """In the words of all refusals."""
    with pytest.raises(gb.UserError, match=rf"type: found '{kind}', expected one of 'rectangle', .*'tube'"):
        gb.section(kind, thickness=0.02)


@pytest.mark.parametrize("bad", ["times", "values"])
@pytest.mark.parametrize(
    "given", ["a", ["1"] * 9, 1j * np.arange(9.0), np.arange(9).astype("timedelta64[s]"), [object()] * 9]
)
def test_recordings_are_of_real_numbers(bad: str, given: Any) -> None:
    """Complex numbers lost a part, and spans of time became numbers of their unit."""
    sound: dict[str, Any] = {"times": np.arange(9.0), "values": np.arange(9.0) ** 2}
    with pytest.raises(gb.UserError, match=f"recording: {bad}: expected real numbers"):
        gb.Recording(**{**sound, bad: given}, quantity="displacement")


def test_an_argument_too_many_or_too_few_is_one_error() -> None:
    """Not one while another is handled."""
    with pytest.raises(TypeError, match=r"history\(\) missing 1 required") as raised:
        gb.history(gb.Scene(gb.mass(1.0)), 1e-3)  # type: ignore[call-arg]
    assert raised.value.__context__ is None


@pytest.mark.parametrize("bad", [-1.0, 0.0, nan, "1"])
@pytest.mark.parametrize("name", ["area", "second_moment", "shear_area", "torsion_constant", "lateral_shear_area"])
def test_no_beam_has_a_section_that_none_can_have(name: str, bad: Any) -> None:
    """A second moment of 0 made a mechanism, and a negative shear area softened the beam."""
    steel = gb.material(2e11, 7850.0)
    whole = gb.SpaceSection(1e-4, 1e-9, 1e-9, 2e-9)._replace(**{name: bad})
    with pytest.raises(gb.UserError, match=rf"section: {name}: .*expected"):
        gb.frame([[0, 0, 0], [1, 0, 0]], whole, steel, {}, clamped=[0.0], elements=4)
    if name in gb.CrossSection._fields:
        plane = gb.CrossSection(1e-4, 1e-9)._replace(**{name: bad})
        for model in ("beam", "rigid"):
            with pytest.raises(gb.UserError, match=rf"section: {name}: .*expected"):
                gb.beam(1.0, plane, steel, {}, model=model)  # type: ignore[arg-type]


@pytest.mark.parametrize("bad", [-1.0, nan, "1"])
@pytest.mark.parametrize("name", ["surface", "mean_radius", "wall", "diameter"])
def test_sizes_that_a_section_may_leave_out_are_from_zero_on(name: str, bad: Any) -> None:
    """A negative diameter turned the sign of stresses."""
    steel = gb.material(2e11, 7850.0)

    def made() -> gb.Structure:
        if name == "surface":
            return gb.beam(1.0, gb.CrossSection(1e-4, 1e-9, surface=bad), steel, {})
        whole = gb.SpaceSection(1e-4, 1e-9, 1e-9, 2e-9)._replace(**{name: bad})
        return gb.frame([[0, 0, 0], [1, 0, 0]], whole, steel, {}, clamped=[0.0], elements=4)

    with pytest.raises(gb.UserError, match=rf"section: {name}: .*expected"):
        made()


def functions(f: Any) -> dict[str, Callable[[], Any]]:
    """Return what asks a function of the user, by the place that it has in a scene."""
    block, law = gb.mass(1.0, stiffness=9.0, name="block"), gb.KelvinVoigt(stiffness=1e3)
    track = gb.from_modes([3.0, 9.0], 0.01, {"a": [1.0, 1.0], "b": [1.0, -1.0], "c": [0.5, 0.2]}, name="track")
    points, places = [track[name] for name in "abc"], [0.0, 1.0, 2.0]
    stop: dict[str, Any] = {"between": block["at"], "region": gb.Slot(0.1), "law": law, "name": "stop"}

    def march(*bodies: gb.Structure, **parts: Any) -> Any:
        return gb.history(gb.Scene(*bodies, **parts), step=0.01, end=1.0)

    def wheel() -> gb.Contact:
        return gb.Contact((block["at"], gb.moving_point(points, places, f, "wheel")), gb.HalfPlane(0.1), law)

    return {
        "load f": lambda: march(block, loads=[gb.Force(block["at"], f, name="f")]),
        "load base": lambda: march(block, loads=[gb.BaseMotion(block, f, name="base")]),
        "contact stop: its wall": lambda: march(block, contacts=[gb.Contact(**stop, wall=f)]),
        "contact stop: its opening": lambda: march(block, contacts=[gb.Contact(**stop, opening=f)]),
        "moving point wheel: its position": lambda: march(block, track, contacts=[wheel()]),
        "moving force push: its position": lambda: march(
            track, loads=gb.moving_force(points, places, 1.0, f, name="push")
        ),
        "span of track: velocity": lambda: gb.span(track, dict(zip("abc", places, strict=True)), velocity=f),
        "span of track: density": lambda: gb.span(track, dict(zip("abc", places, strict=True)), density=f),
    }


def _fails(_: Any) -> float:
    raise KeyError("own")


FAULTY: dict[str, tuple[Callable[..., Any], str]] = {
    "raises": (_fails, r"failed \(KeyError: 'own'\)"),
    "takes nothing": (lambda: 1.0, r"failed \(TypeError: "),
    "text": (lambda _: "one", "returned text, expected real numbers"),
    "complex": (lambda _: 1j, "expected real numbers"),
    "several": (lambda _: np.arange(1.0, 6.0), r"of shape \(5,\), expected a number"),
    "nothing": (lambda _: None, "finite"),
    "not a number": (lambda _: np.nan, "finite"),
    "without limit": (lambda _: np.inf, "finite"),
}


@pytest.mark.parametrize("fault", FAULTY)
@pytest.mark.parametrize("place", functions(None))
def test_functions_of_users_that_fail_are_named(place: str, fault: str) -> None:
    """Whatever a function raises or returns, words say whose it is, and what it gave."""
    function, words = FAULTY[fault]
    with pytest.raises(gb.UserError, match=f"^{place}.*{words}") as error:
        functions(function)[place]()
    assert "smaller step" not in str(error.value)


@pytest.mark.parametrize("place", functions(None))
def test_functions_of_users_may_return_any_kind_of_number(place: str) -> None:
    """Whole numbers, those of NumPy, and arrays of one number are numbers."""
    for number in (1, np.float32(1.0), np.array(1.0), np.array([1.0])):
        functions(lambda _, one=number: one)[place]()
