"""What is only unusual is warned of and runs; what is equal to a limit is within it; numbers in words differ."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from mpi4py import MPI

from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case_text
from gapbeam.solver.case.reading.overrides import UNITS, factor_of
from gapbeam.solver.messages.errors import CaseError, UserError
from gapbeam.solver.messages.wording import ROUND_OFF, apart, exceeds
from gapbeam.solver.models.model import build_model
from gapbeam.solver.seat.contact_modes import held_modes
from tests.shared.case_texts import BEAM

PLANE = '[[support]]\nname = "a"\nfrom = 0.0\nto = 0.1\nclearance = 1e-4\n'
ROUND = BEAM.replace("width = 0.02\n", 'width = 0.012\nsection = "round"\n') + "[mesh]\ndimension = 3\n"
GUIDE = '[[joint]]\ntype = "guided"\nname = "rail"\npoint = 0.3\n'
PINS = GUIDE.replace("guided", "pinned") + '[[joint]]\ntype = "pinned"\nname = "pin"\npoint = 0.6\n'
CLAMP = GUIDE.replace("guided", "clamped")


def said(text: str) -> str:
    """Return the warnings about a case, all of which is accepted."""
    return "\n".join(warnings(read_case_text(text)))


@pytest.mark.parametrize("clearance", [0.04, 0.12, 0.5, 3.0, 1e3])
@pytest.mark.parametrize("joint", ["", GUIDE, PINS, CLAMP])
def test_play_of_any_width_is_accepted(clearance: float, joint: str) -> None:
    """More than ten thicknesses and half the beam: warned of as tilt only where the beam can tilt as a rigid body."""
    lines = said(BEAM + PLANE.replace("1e-4", str(clearance)) + joint)
    assert "is it in mm" in lines
    assert ("lets the beam tilt" in lines) == (joint == "")


@pytest.mark.parametrize(
    ("region", "radial"),
    [
        ('{ type = "polygon", walls = [0.0] }', False),
        ('{ type = "polygon", walls = [0.0, 120.0, 240.0] }', False),
        ('{ type = "hole", contact = "circle" }', False),
        ('"hole"', True),
        ('{ type = "profile", angles = [-90.0, 0.0, 90.0], recesses = [0.0, 1e-5, 0.0] }', True),
    ],
)
@pytest.mark.parametrize("share", [0.05, 0.2, 2.0])
def test_play_around_a_pipe_is_accepted(region: str, radial: bool, share: float) -> None:
    """Flat walls and circles are met where they are, however far; walls met along radii are warned of."""
    support = PLANE.replace("1e-4", str(share * 0.006)) + f"region = {region}\n"
    model = '[model]\ntype = "rigid"\n'
    lines = said(ROUND + support + model)
    assert ("act along radii of the beam" in lines) == radial


@pytest.mark.parametrize("elements", [500, 2000, 8000])
def test_many_elements_are_taken(elements: int) -> None:
    """Nothing is said of thousands, which are marched in few DOFs; what round-off hides is refused."""
    text = BEAM + PLANE + f'[model]\ntype = "beam"\nelements = {elements}\n'
    assert "elements" not in said(text)
    with pytest.raises(CaseError, match="round-off"):
        read_case_text(text, {"model.elements": 20_000})


@pytest.mark.parametrize(
    ("keys", "warned"),
    [
        ("stiffness = 1e3\n", True),
        ("stiffness = 1e3\n" + GUIDE, False),
        ("stiffness = 1e3\n" + GUIDE.replace("guided", "pinned"), False),
        ("stiffness = 1e9\n[contact]\nstiffness = 1e3\n", False),
        ('stiffness = 1e15\nlaw = { type = "hunt-crossley", exponent = 1.5, restitution = 0.5 }\n', False),
    ],
)
def test_soft_contact_is_warned_of_where_it_carries_the_beam(keys: str, warned: bool) -> None:
    """By the stiffness and law that a support has, and where no joint carries the weight; it is no fault."""
    assert ("the weight pushes the beam" in said(BEAM + PLANE + keys)) == warned


@pytest.mark.parametrize(
    ("keys", "table", "warned"),
    [
        ("", "", True),
        ("damping = 1e5\n", "", False),
        ("damping = 0.0\n", "damping = 1e5\n", True),
        ('law = { type = "hunt-crossley", restitution = 0.5 }\n', "", False),
        ("", 'law = { type = "hunt-crossley", restitution = 0.5 }\n', False),
    ],
)
def test_adhesion_is_judged_by_the_damping_of_supports(keys: str, table: str, warned: bool) -> None:
    """The damping and the law of a support come before those of [contact]."""
    lines = said(BEAM + PLANE + "stiffness = 1e9\n" + keys + f'[contact]\ntension = "adhesive"\n{table}')
    assert ("adhesive" in lines) == warned


@pytest.mark.parametrize(
    "damped",
    [
        'body = { mass = 1.0, stiffness = 1e5, damping = 10.0 }\n[model]\ntype = "rigid"\n',
        '[[joint]]\ntype = "elastic"\nname = "j"\npoint = 0.3\ndamping = { vertical = 5.0 }\n',
        '[[fluid]]\nname = "w"\nfrom = 0.1\nto = 0.5\ndamping = 2.0\n',
        "[contact]\nfriction = { coefficient = 0.2 }\n",
    ],
)
def test_whatever_damps_lets_motion_fade(damped: str) -> None:
    """Bodies of supports, joints, fluids and friction take energy as well as [damping] and [contact]."""
    assert "motion never fades" in said(BEAM + PLANE)
    assert "motion never fades" not in said(BEAM + PLANE + damped)


@pytest.mark.parametrize(
    "keys",
    [
        PLANE.replace("0.0\n", "0.4\n", 1).replace("to = 0.1", "to = 0.42") + "[mesh]\nsupport_size = 0.02\n",
        PLANE.replace("0.0\n", "0.58\n", 1).replace("to = 0.1", "to = 0.6") + "[mesh]\nsupport_size = 0.02\n",
        PLANE + "[mesh]\nsupport_size = 0.05\nedge_size = 0.05000000000000001\n",
        PLANE.replace("to = 0.1", "to = 0.30000000000000004") + PLANE.replace('"a"', '"b"').replace("0.0\n", "0.3\n", 1)
        .replace("to = 0.1", "to = 0.4"),
        PLANE + "[gates]\ntotal_growth = 0.3\nimpact_growth = 0.30000000000000004\n",
        PLANE + "static_friction = 0.3\n[contact]\nfriction = { coefficient = 0.30000000000000004 }\n",
    ],
)  # fmt: skip
def test_equal_round_numbers_are_within_limits(keys: str) -> None:
    """0.42 - 0.4 is less than 0.02 by round-off only: a cell of 0.02 m fits."""
    read_case_text(BEAM + keys)


@given(st.floats(1e-12, 1e12), st.floats(1e-7, 1e-3))
def test_numbers_in_words_differ(value: float, more: float) -> None:
    """Whatever is above a limit is seen to be, and nothing that round-off alone has made different."""
    limit = value * (1.0 + more)
    assert exceeds(limit, value)
    first, second = apart(value, limit)
    assert first != second
    assert (float(first), float(second)) == pytest.approx((value, limit), rel=1e-5)
    near = value * (1.0 + 0.1 * ROUND_OFF)
    assert not exceeds(near, value)
    assert len(set(apart(value, near))) == 1


def test_a_cell_that_is_too_long_differs_from_its_support(tmp_path: Path) -> None:
    """Found and limit have the digits in which they differ, and the advice is accepted."""
    del tmp_path
    text = BEAM + PLANE + "[mesh]\nsupport_size = 0.1000001\n"
    with pytest.raises(CaseError) as refused:
        read_case_text(text)
    [fault] = refused.value.faults
    assert (fault.found, fault.hint) == ("0.1000001 m", "support_size = 0.1")
    read_case_text(text.replace("0.1000001", "0.1"))


@pytest.mark.parametrize("law", ["hunt-crossley", "lankarani-nikravesh", "elastic-plastic"])
def test_a_search_offers_laws_that_it_takes(law: str) -> None:
    """Every law that is offered for a periodic response is accepted by the next look at the case."""
    own = "yield_pressure = 1e6" if law == "elastic-plastic" else "restitution = 0.5"
    shaker = '[[load]]\ntype = "harmonic_force"\nname = "f"\npoint = 0.3\namplitude = 1.0\nfrequency = 20.0\n'
    text = BEAM + PLANE + f'stiffness = 1e9\nlaw = {{ type = "{law}", {own} }}\n' + shaker
    text += '[analysis]\ntype = "periodic"\n'
    with pytest.raises(CaseError) as refused:
        read_case_text(text)
    [fault] = refused.value.faults
    assert "elastic-plastic" not in fault.expected
    for offered in ("kelvin-voigt", "adams-impact", "piecewise-linear"):
        keys = {
            "kelvin-voigt": "",
            "adams-impact": ", exponent = 1.0, damping = 1e3, full_depth = 1e-6",
            "piecewise-linear": ", depths = [1e-4], factors = [2.0]",
        }[offered]
        if offered in fault.expected:
            read_case_text(text.replace(f'"{law}", {own}', f'"{offered}"{keys}'))


def test_modes_beyond_what_a_model_has_are_not_asked_for() -> None:
    """A short beam has two bending modes: found, though springs are fitted to three where there are."""
    text = BEAM.replace("length = 0.6", "length = 0.2").replace("thickness = 0.012", "thickness = 0.08")
    text = text.replace("point = 0.6", "point = 0.2") + PLANE + '[model]\ntype = "beam"\nelements = 20\n'
    model = build_model(read_case_text(text), MPI.COMM_SELF)
    found = held_modes(model, 2, 3)
    assert [len(state.bending()[0]) >= 2 for state in found] == [True] * 3
    with pytest.raises(UserError, match=r"^3 bending modes were asked for; expected 1 to 2"):
        held_modes(model, 3, 3)


BEYOND = {
    "support": (PLANE.replace("to = 0.1", "to = LONG"), 0.6),
    "support turned": (PLANE.replace("from = 0.0", "from = LONG"), 0.1),
    "segment": ('[[segment]]\nname = "a"\nfrom = 0.2\nto = LONG\nthickness = 0.01\n', 0.6),
    "segment turned": ('[[segment]]\nname = "a"\nfrom = LONG\nto = 0.2\nthickness = 0.01\n', 0.2),
    "fluid": ('[[fluid]]\nname = "a"\nfrom = 0.2\nto = LONG\nadded_mass = 1.0\n', 0.6),
    "fluid turned": ('[[fluid]]\nname = "a"\nfrom = LONG\nto = 0.2\nadded_mass = 1.0\n', 0.2),
    "probe": ('[[probe]]\nname = "a"\npoint = LONG\n', 0.6),
    "force": ('[[load]]\ntype = "constant_force"\nname = "a"\npoint = LONG\namplitude = 1.0\n', 0.6),
}
"""Tables with a place beyond a limit, and the limit."""


@given(kind=st.sampled_from(sorted(BEYOND)), share=st.floats(-8.5, -2.0))
def test_places_just_beyond_a_limit_are_distinguished_from_it(kind: str, share: float) -> None:
    """What was found and what was expected differ in words, however close they are."""
    text, limit = BEYOND[kind]
    place = limit * (1.0 + 10.0**share)
    with pytest.raises(CaseError) as refused:
        read_case_text(BEAM + text.replace("LONG", repr(place)))
    fault = next(one for one in refused.value.faults if re.search(r"\d", one.expected))
    numbers = [re.findall(r"[-+.\de]*\d", words.replace("name", "")) for words in (fault.found, fault.expected)]
    assert numbers[0][0] not in numbers[1], str(fault)


@pytest.mark.parametrize("limits", [(float("inf"), 1.0), (float("nan"), 1.0), (1.0, float("inf"))])
def test_what_is_no_number_is_distinguished_from_a_limit(limits: tuple[float, float]) -> None:
    """Infinity and NaN are not shown as the limit."""
    assert len(set(apart(*limits))) == 2


@pytest.mark.parametrize("section", ["round", '{ type = "tube", wall = 0.002 }', "rectangle"])
@pytest.mark.parametrize("region", ["slot", "stop"])
def test_stiffness_per_area_under_a_round_section_is_warned_of(section: str, region: str) -> None:
    """A plane touches a round section along a chord: the stiffness of the whole support has a key of its own."""
    text = ROUND.replace('"round"', section if section.startswith("{") else f'"{section}"')
    own = PLANE + f'region = "{region}"\n'
    lines = said(text + own + "stiffness = 3e8\n")
    assert ("along a chord" in lines) == (section != "rectangle")
    assert ("support_stiffness = 360000 N/m" in lines) == (section != "rectangle")
    assert "along a chord" not in said(text + own + "support_stiffness = 3.6e5\n")


@pytest.mark.parametrize("count", [1, 2, 20])
def test_many_supports_with_much_play_take_one_line(count: int) -> None:
    """A leaf spring on twenty far stops is asked about once."""
    stops = [PLANE.replace('"a"', f'"a{n}"').replace("from = 0.0", f"from = {0.02 * n}") for n in range(count)]
    far = [stop.replace("to = 0.1", f"to = {0.02 * n + 0.01}") for n, stop in enumerate(stops)]
    lines = said(BEAM + "".join(far).replace("1e-4", "0.05")).splitlines()
    asked = [line for line in lines if "is it in mm" in line]
    assert len(asked) == 1
    assert (f", and {count - 1} after it:" in asked[0]) == (count > 1)


@pytest.mark.parametrize("units", UNITS)
@given(data=st.data())
def test_a_case_that_names_its_units_is_not_asked_about_others(units: str, data: st.DataObject) -> None:
    """Reeds, sheets, keys and plates in the numbers of any system: no other unit is named than that of a number."""
    length = data.draw(st.floats(1e-3, 3.0))
    thickness = length * data.draw(st.floats(1e-3, 0.15))
    play, width = thickness * data.draw(st.floats(1e-3, 30.0)), length * data.draw(st.floats(0.01, 30.0))
    modulus = 10.0 ** data.draw(st.floats(3.0, 13.0))
    density = 10.0 ** data.draw(st.floats(0.0, 5.0))
    scale = {kind: factor_of(kind, units) or 1.0 for kind in ("m", "Pa", "kg/m^3")}
    text = (
        f'units = "{units}"\n[beam]\nlength = {length / scale["m"]!r}\nthickness = {thickness / scale["m"]!r}\n'
        f"width = {width / scale['m']!r}\n[material]\nyoung_modulus = {modulus / scale['Pa']!r}\npoisson_ratio = 0.3\n"
        f"density = {density / scale['kg/m^3']!r}\n[time]\nend = 0.1\n"
        f"[support]\nlength = {0.2 * length / scale['m']!r}\n"
        f"clearance = {play / scale['m']!r}\n"
    )
    lines = said(text)
    assert "is it in" not in lines
    assert "not mm" not in lines
    assert "not GPa" not in lines
    assert ("young_modulus" in lines) == (not 1e5 <= modulus <= 2e12)
    assert ("density" in lines) == (not 10.0 <= density <= 25e3)


@pytest.mark.parametrize(("gravity", "asked"), [(9.81, True), (1.62, True), (9810.0, False), (1e-3, False)])
def test_gravity_in_si_is_asked_about_where_the_file_is_in_mm(gravity: float, asked: bool) -> None:
    """9.81 mm/s^2 is no gravity; a case without units means 9.81 m/s^2."""
    load = f'[[load]]\ntype = "gravity"\nacceleration = {gravity}\n'
    tables = "[beam]\nlength = 600\nthickness = 12\nwidth = 20\n[material]\nyoung_modulus = 2.1e5\n"
    tables += "poisson_ratio = 0.3\ndensity = 7.9e-9\n[time]\nend = 0.1\n[support]\nlength = 50\nclearance = 0.1\n"
    assert ("in the units that the file names" in said(f'units = "mm-t-s"\n{tables}{load}')) == asked


@pytest.mark.parametrize("gap", [0.5, 1.0, 2.5])
def test_play_of_a_thickness_or_two_and_wide_strips_are_believed(gap: float) -> None:
    """A contact spring, a sheet at rubber stops, a strip of a plate that is wider than long."""
    text = BEAM.replace("width = 0.02", "width = 1.5") + PLANE.replace("1e-4", str(0.012 * gap))
    assert "is it in mm" not in said(text)


@example([0.000447])  # 7.45 %, less a round-off
@given(st.lists(st.floats(2.0e-4, 5.0e-4).map(lambda one: float(f"{one:.3g}")), min_size=1, max_size=8))
def test_many_wide_holes_take_one_line_about_the_worst(gaps: list[float]) -> None:
    """A tube in seven plates was warned of seven times, in the same words."""
    hole = PLANE + 'region = "hole"\n'
    holes = [
        hole.replace('"a"', f'"a{n}"').replace("from = 0.0", f"from = {0.07 * n}")
        .replace("to = 0.1", f"to = {0.07 * n + 0.02}").replace("1e-4", repr(gap))
        for n, gap in enumerate(gaps)
    ]  # fmt: skip
    (line,) = (one for one in said(ROUND + "".join(holes)).splitlines() if "of its radius" in one)
    worst = gaps.index(max(gaps))
    assert line.startswith(f'[[support]] number {worst + 1} (name "a{worst}")')
    share = float(line.partition("up to ")[2].partition(" %")[0])
    assert share == pytest.approx(100 * gaps[worst] / 0.006, abs=0.051)  # two digits
    assert (f", and {len(gaps) - 1} more:" in line) == (len(gaps) > 1)


@pytest.mark.parametrize("model", ["full", "reduced", "beam", "rigid"])
def test_memory_of_a_mesh_is_warned_of_where_it_is_solved(model: str) -> None:
    """A string of 0.6 m and 0.4 mm as beam elements takes the faces of its mesh alone."""
    thin = BEAM.replace("0.012", "4e-4").replace("width = 0.02", 'width = 4e-4\nsection = "round"')
    solid = f'[mesh]\ndimension = 3\n[model]\ntype = "{model}"\n'
    assert ("unknowns" in said(thin + PLANE + solid)) == (model in ("full", "reduced"))


@pytest.mark.parametrize(("clearance", "far"), [(1.0e-3, False), (3.0e-3, False), (0.011, False), (0.04, True)])
def test_a_tilt_that_is_small_is_not_warned_of(clearance: float, far: bool) -> None:
    """Play of a tenth of the thickness in supports half a metre apart tilts by 0.1 degrees: a small rotation."""
    ends = PLANE + PLANE.replace('"a"', '"b"').replace("from = 0.0", "from = 0.55").replace("to = 0.1", "to = 0.6")
    assert ("lets the beam tilt" in said(BEAM + ends.replace("1e-4", str(clearance)))) == far


@pytest.mark.parametrize("scale", [2.0**-17, 2.0**-14, 2.0**-7, 1.0])
def test_a_small_beam_of_a_usual_material_is_believed(scale: float) -> None:
    """No other unit makes a length too small: switches of 5 um were asked whether they are in mm. Large ones are."""
    text = BEAM
    for key, value in (("length", 0.6), ("thickness", 0.012), ("width", 0.02), ("point", 0.6)):
        text = text.replace(f"{key} = {value}\n", f"{key} = {scale * value!r}\n")
    small = PLANE.replace("0.1", repr(0.1 * scale)).replace("1e-4", repr(1.0e-4 * scale))
    assert "unusual" not in said(text + small)
    assert "[beam] length = 600 is unusual" in said(BEAM.replace("length = 0.6", "length = 600.0") + PLANE)


@pytest.mark.parametrize("supports", [2, 3, 60, 100])
def test_just_enough_elements_are_enough(supports: int) -> None:
    """Five elements to a support are five, however the length divides."""
    end = 0.6 / supports
    text = BEAM + PLANE.replace("to = 0.1", f"to = {end!r}")
    assert "too few" not in said(text + f'[model]\ntype = "beam"\nelements = {5 * supports}\n')
    assert "too few" in said(text + f'[model]\ntype = "beam"\nelements = {5 * supports - 1}\n')


PRESS = '[[load]]\ntype = "constant_force"\nname = "press"\npoint = 0.3\namplitude = -5.0\n'
PRELOAD = '[[load]]\ntype = "exciter"\nname = "e"\npoint = 0.3\namplitude = 1.0\nfrequency = 3.0\npreload = -5.0\n'


@pytest.mark.parametrize(
    ("more", "loose"),
    [
        ("", True),
        (PRESS, False),
        (PRESS.replace("-5.0", "0.0"), True),
        (PRELOAD, False),
        (PRELOAD.replace("-5.0", "0.0"), True),
        (CLAMP, False),
        (GUIDE, True),
        ('[analysis]\ntype = "transient"\nstart = "undeformed"\n', False),
    ],
)
def test_a_seat_without_gravity_is_warned_of_where_nothing_presses(more: str, loose: bool) -> None:
    """A static force seats the beam as its weight does, joints hold it, and other starts have no seat."""
    text = BEAM.replace('[[load]]\ntype = "gravity"\n', "") + PLANE
    assert ("no gravity" in said(text + more)) == loose


@pytest.mark.parametrize(
    ("key", "value"), [("from", "0.2000001"), ("point", "[0.1000001, 0.006]"), ("point", "0.1000001")]
)
def test_places_that_nearly_coincide_name_their_key(key: str, value: str) -> None:
    """The advice is a line of the case file: the key of the place, with all its coordinates; it is accepted."""
    near = PLANE.replace('"a"', '"b"').replace("0.1", "0.2").replace("0.0\n", "0.1\n")
    third = (
        PLANE.replace('"a"', '"c"').replace("0.1", "0.3").replace("0.0\n", f"{value}\n" if key == "from" else "0.2\n")
    )
    probe = f'[[probe]]\nname = "p"\npoint = {value}\n' if key == "point" else ""
    text = BEAM + PLANE + near + third + probe
    with pytest.raises(CaseError) as refused:
        read_case_text(text)
    hint = refused.value.faults[0].hint
    named = hint.split(" = ")[0]
    assert named == ("to" if key == "from" else "point")
    assert ("[" in hint) == ("[" in value)
    was = "to = 0.2\n" if key == "from" else f"point = {value}\n"
    read_case_text(text.replace(was, f"{hint}\n"))
