"""Cases read back as they were written; random values and damaged files never surprise the reader."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from gapbeam.solver.case.case import Case, case_to_toml
from gapbeam.solver.case.checks.all_checks import contradictions_in
from gapbeam.solver.case.checks.case_warnings import warnings
from gapbeam.solver.case.reading.case_reader import read_case
from gapbeam.solver.case.reading.known_keys import tables
from gapbeam.solver.integrators.midpoint import DiscreteGradient
from gapbeam.solver.messages.errors import CaseError
from tests.shared.case_texts import GOOD, written

CASES = sorted((Path(__file__).parents[2] / "cases").glob("*.toml"))
LIGHT = settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cases")


def numbers(least: float, most: float) -> st.SearchStrategy[float]:
    return st.floats(least, most, allow_subnormal=False)


def positive(least: int, most: int) -> st.SearchStrategy[float]:
    """Return positive numbers of all magnitudes between two powers of ten."""
    return numbers(least, most).map(lambda exponent: 10.0**exponent)


def given_or_not(**values: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries({}, optional=values)


@st.composite
def valid_cases(draw: st.DrawFn) -> Case:
    """Draw a case without contradictions, with all kinds of loads, schemes and keys."""
    dimension = draw(st.sampled_from([2, 3]))
    thickness = draw(positive(-3, 0))
    length, width = thickness * draw(numbers(5, 100)), thickness * draw(numbers(0.5, 5))
    support = length * draw(numbers(0.05, 0.9))
    across = {2: [thickness], 3: [width, thickness]}[dimension]

    def point() -> Any:
        x = length * draw(st.integers(0, 32)) / 32
        inside = [size * draw(st.integers(-8, 8)) / 16 for size in across]
        return draw(st.sampled_from([x, [x, *inside]]))

    def placed(shares: list[Any]) -> list[Any]:
        return [[x[0] * support, *x[1:]] if isinstance(x, list) else x * support for x in shares]

    def shaking(kind: str, name: str) -> dict[str, Any]:
        load: dict[str, Any] = {"type": kind, "name": name, "amplitude": draw(numbers(-1e6, 1e6))}
        load["frequency"] = draw(numbers(0.1, 0.2)) / step
        load |= draw(given_or_not(phase=numbers(-720, 720), ramp=positive(-6, 6), direction=direction))
        if kind == "harmonic_force":
            return load | {"point": point()}
        return load | draw(given_or_not(quantity=st.sampled_from(["acceleration", "velocity", "displacement"])))

    step = draw(positive(-8, 2))
    direction = st.lists(numbers(-1, 1), min_size=dimension, max_size=dimension).filter(any)
    names = st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,39}", fullmatch=True)
    loads = [
        shaking(draw(st.sampled_from(["harmonic_force", "base_motion"])), draw(names))
        for _ in range(draw(st.integers(0, 3)))
    ]
    if draw(st.booleans()):
        loads.insert(0, {"type": "gravity"} | draw(given_or_not(acceleration=numbers(0, 100), direction=direction)))
    intervals = st.integers(1, 1000).map(lambda count: count * step)
    data = {
        "title": draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=200)),
        "beam": {"length": length, "thickness": thickness, "width": width},
        "material": {
            "young_modulus": draw(positive(3, 13)),
            "poisson_ratio": draw(numbers(-0.99, 0.49)),
            "density": draw(positive(0, 5)),
        },
        "damping": draw(
            st.sampled_from(
                [{}, {"mass": 0.1, "stiffness": 1e-5}, {"frequencies": [40.0, 300.0], "ratios": [0.01, 0.02]}]
            )
        ),
        "support": {"length": support, "clearance": thickness * draw(numbers(-0.4, 0.02))},
        "restraint": draw(given_or_not(axial=positive(-3, 9), lateral=positive(-3, 9))),
        "mesh": {
            "dimension": dimension,
            **draw(
                given_or_not(
                    cell=st.sampled_from(
                        {2: ["triangle", "quadrilateral"], 3: ["tetrahedron", "hexahedron"]}[dimension]
                    ),
                    degree=st.sampled_from([1, 2]),
                    size=numbers(0.01, 1).map(lambda part: part * length),
                    support_size=numbers(0.02, 1).map(lambda part: part * support),
                    cells_through_thickness=st.integers(1, 100).map(lambda half: 2 * half),
                )
            ),
        },
        "contact": draw(
            given_or_not(
                stiffness=positive(9, 20),
                damping=positive(-3, 9),
                tension=st.sampled_from(["clipped", "adhesive"]),
                friction=st.fixed_dictionaries(
                    {"coefficient": numbers(0, 100)}, optional={"slip_velocity": positive(-9, 2) | st.just("auto")}
                ),
                quadrature_degree=st.integers(1, 20),
            )
            | st.fixed_dictionaries(
                {
                    "law": st.fixed_dictionaries({"type": st.just("kelvin-voigt"), "restitution": numbers(0.01, 1)}),
                    "points": st.sampled_from([[0.0, 1.0], [0.25, 0.5, 0.75], [[0.5, 0.0], 1.0]][:dimension]).map(
                        placed
                    ),
                    "patch": numbers(0.01, 0.4).map(lambda part: part * support),
                }
            )
        ),
        "load": loads,
        "probe": [{"name": draw(names), "point": point()} for _ in range(draw(st.integers(0, 3)))],
        "time": {
            "step": step,
            "end": step * draw(st.integers(1000, 10**8)),
            "scheme": draw(
                st.sampled_from(["discrete-gradient", "implicit-midpoint", "newmark"])
                | st.fixed_dictionaries(
                    {"type": st.just("newmark"), "beta": numbers(0.01, 1), "gamma": numbers(0.5, 1)}
                )
                | st.fixed_dictionaries({"type": st.just("generalized-alpha"), "rho_inf": numbers(0, 1)})
            ),
        }
        | draw(given_or_not(max_halvings=st.integers(0, 20), max_iterations=st.integers(1, 1000))),
        "gates": draw(given_or_not(impact_loss=numbers(0, 0.04), accept_energy_growth=st.booleans())),
        "output": draw(given_or_not(history_interval=intervals, fields_interval=intervals)),
    }
    case = Case.model_validate(data)
    assume(contradictions_in(case) == [])
    return case


@pytest.mark.slow(minutes=0.1)
@LIGHT
@given(
    case=valid_cases(),
    heading=st.lists(st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=30), max_size=2),
)
def test_a_case_reads_back_as_it_was(folder: Path, case: Case, heading: list[str]) -> None:
    path = written(folder, case_to_toml(case, heading))
    assert read_case(path) == case
    assert all("\n" not in line for line in warnings(case))


def test_every_key_is_written_with_its_meaning() -> None:
    text = case_to_toml(read_case(CASES[0]), ["gapbeam 0.1.0", "DOLFINx 0.9.0"])
    assert text.startswith("# gapbeam 0.1.0\n# DOLFINx 0.9.0\ntitle = ")
    for table in tables():
        if f"{table.header}  #" in text and not table.kind:
            section = text.split(f"{table.header}  #")[1].split("\n[")[0]
            for key, field in table.model.model_fields.items():
                lines = [line for line in section.split("\n") if line.startswith((f"{key} = ", f"# {key}: not given"))]
                assert len(lines) == 1
                assert str(field.description) in lines[0]


def test_numbers_survive_to_the_last_digit(folder: Path) -> None:
    case = read_case(written(folder))
    for value in (0.1 + 0.2, math.pi, 1e22, 1.0000000000000002e-30, 9.999999999999999e29, 1 / 3):
        tuned = case.model_copy(update={"restraint": case.restraint.model_copy(update={"axial": value})})
        assert read_case(written(folder, case_to_toml(tuned))).restraint.axial == value


@LIGHT
@given(data=st.data())
def test_a_damaged_file_gives_a_case_or_a_case_error(folder: Path, data: st.DataObject) -> None:
    content = bytearray(data.draw(st.sampled_from([path.read_bytes() for path in CASES] + [GOOD.encode()])))
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = start + data.draw(st.integers(0, 20))
        pieces = [bytes(content[place : place + 9]) for place in range(0, len(content), 97)]
        symbols = st.sampled_from(
            [b"[", b"]", b'"', b"'", b"=", b"\n", b"{", b".", b"-", b"\xff", b"\0", b"#", b",", b"1e999"]
        )
        content[start:end] = data.draw(symbols | st.binary(max_size=6) | st.sampled_from(pieces or [b""]))
    path = folder / "damaged.toml"
    path.write_bytes(content)
    read_or_refused(path, {})


ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.dates()
    | st.text(max_size=20)
    | st.sampled_from(["gravity", "newmark", "auto", "0.1", "1 mm", "1e400 m", "-", "nan", "1,5", 10**400, 10**30]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)
KEYS = sorted(
    {
        f"{table.header.strip('[]')}{entry}.{key}"
        for table in tables()
        for key in table.model.model_fields
        for entry in ([".0", ".1"] if table.header[1] == "[" else [""])
    }
    | {table.header.strip("[]") for table in tables()}
)


@LIGHT
@given(overrides=st.dictionaries(st.sampled_from(KEYS), ANYTHING, min_size=1, max_size=4))
def test_any_value_gives_a_case_or_a_case_error(folder: Path, overrides: dict[str, object]) -> None:
    read_or_refused(written(folder), overrides)


def test_a_case_without_supports_is_refused(folder: Path) -> None:
    """An empty list of supports is refused as such, and breaks no other check."""
    with pytest.raises(CaseError) as refused:
        read_case(written(folder), {"support": []})
    assert refused.value.faults[0].key == ("support",)


@LIGHT
@given(
    overrides=st.lists(
        st.text(max_size=30) | st.builds("{}={}".format, st.sampled_from(KEYS), st.text(max_size=20)),
        max_size=3,
    )
)
def test_any_override_gives_a_case_or_a_case_error(folder: Path, overrides: list[str]) -> None:
    read_or_refused(written(folder), overrides)


@pytest.mark.parametrize("value", [0, "one", [1.0], [], True])
@pytest.mark.parametrize("table", sorted(Case.model_fields))
def test_a_value_in_place_of_a_table_is_refused(folder: Path, table: str, value: object) -> None:
    read_or_refused(written(folder), {table: value})


def read_or_refused(path: Path, overrides: Any) -> None:
    """Read a case, and check that what reads is consistent, and that what is refused is explained."""
    try:
        case = read_case(path, overrides)
    except CaseError as refused:
        error = refused
    else:
        assert contradictions_in(case) == []
        warnings(case)
        assert read_case(written(path.parent, case_to_toml(case))) == case
        return
    assert error.faults
    for fault in error.faults:
        assert str(path) in fault.where or "`overrides=`" in fault.where
        assert fault.found
        assert fault.expected
        assert "\n" not in fault.found + fault.expected + fault.hint
        assert len(str(fault)) < 2000


def test_the_scheme_by_default_conserves_energy() -> None:
    assert read_case(CASES[0]).time.scheme == DiscreteGradient()
