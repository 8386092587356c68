"""A new case file: made of a few answers, or a copy of a shipped case under another name."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import gapbeam
from gapbeam.postprocess.shell_command import shell_command
from gapbeam.solver.case.reading.value_words import toml_value
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import near, printable

SECTIONS: dict[str, dict[str, tuple[str, float]]] = {
    "rectangle": {},
    "box": {"wall": ("thickness of its walls", 0.15)},
    "i": {"web": ("thickness of the web", 0.15), "flange": ("thickness of a flange", 0.15)},
    "round": {},
    "tube": {"wall": ("thickness of its wall", 0.12)},
}
"""Sections by name, with their keys: what these are, and a default as a share of the thickness of the beam."""
ROUND = ("round", "tube")
LOADS = {
    "shake": ("base_motion", "m/s^2", 30.0, "of the frame with all supports, up and down"),
    "force": ("harmonic_force", "N", 20.0, "up and down, at the free end or the middle of the longest span"),
}
"""Loads by name: type, unit and default of the amplitude, meaning."""
PERIODS = 20  # of the load in a run
RAMP = 2  # periods over which the load rises
SUPPORTED = 0.04  # length of each of several supports over the length of the beam
BASE = 0.1  # length of a single support, likewise
MOST_SUPPORTS = 50


@dataclass(frozen=True)
class MaterialFigures:
    """Figures of a material: Young's modulus, Pa, Poisson's ratio and density, kg/m^3."""

    young_modulus: float
    poisson_ratio: float
    density: float


MATERIALS = {
    "steel": MaterialFigures(2.1e11, 0.3, 7850.0),
    "stainless-steel": MaterialFigures(1.93e11, 0.29, 8000.0),
    "aluminum": MaterialFigures(6.9e10, 0.33, 2700.0),
    "titanium": MaterialFigures(1.14e11, 0.34, 4430.0),
    "copper": MaterialFigures(1.17e11, 0.34, 8960.0),
    "brass": MaterialFigures(9.7e10, 0.31, 8490.0),
}
"""Typical figures at room temperature, as handbooks have them to two or three digits."""


@dataclass(frozen=True)
class CaseAnswers:
    """Answers that make a new case; lengths in m.

    Attributes:
        length: Length of the beam.
        section: One of `SECTIONS`.
        thickness: Outer size in the bending direction.
        width: Outer size across it; that of round sections is the thickness.
        walls: Keys of the section.
        material: One of `MATERIALS`, or another name with the figures beside.
        figures: Figures of the material.
        supports: 1: base and gland at x = 0; more: spread evenly along the beam.
        region: Kind of the regions of several supports: flat faces or round holes.
        clearance: Play in each support.
        load: One of `LOADS`.
        amplitude: Amplitude in the unit of the load.
        frequency: Frequency of the load, Hz.
    """

    length: float = 0.5
    section: str = "rectangle"
    thickness: float = 0.012
    width: float = 0.02
    walls: dict[str, float] = field(default_factory=dict)
    material: str = "steel"
    figures: MaterialFigures = MATERIALS["steel"]
    supports: int = 2
    region: Literal["slot", "hole"] = "slot"
    clearance: float = 0.2e-3
    load: str = "shake"
    amplitude: float = 30.0
    frequency: float = 20.0

    def case_text(self, path: Path) -> str:
        """Return the text of the case file, with a comment behind every value.

        Args:
            path: Path that will be written.
        """
        return "\n".join([*self._opening(path), *self._beam(), *self._supports(), *self._model(), *self._rest()]) + "\n"

    def places(self) -> list[tuple[float, float]]:
        """Return the starts and ends of supports; one at either end of the beam and the others evenly between."""
        if self.supports == 1:
            return [(0.0, _rounded(BASE * self.length))]
        long = _rounded(min(SUPPORTED, 0.25 / (self.supports - 1)) * self.length)
        apart = (0.9 * self.length - long) / (self.supports - 1)
        starts = [0.05 * self.length + number * apart for number in range(self.supports)]
        return [(_rounded(start), float(f"{_rounded(start) + long:.12g}")) for start in starts]

    @property
    def loaded(self) -> float:
        """Place of the force: the free end of a beam in one support, or the middle of the first span."""
        if self.supports == 1:
            return self.length
        (_, before), (after, _) = self.places()[:2]
        return _rounded(0.5 * (before + after))

    def _opening(self, path: Path) -> Iterator[str]:
        run = shell_command("gapbeam", "run", path)
        plot = shell_command("gapbeam", "plot", Path("results") / path.stem)
        yield f"# Written by `gapbeam new`. Check   {shell_command('gapbeam', 'check', path)}"
        yield f"#                              Look    {shell_command('gapbeam', 'view', path)}"
        yield f"#                              Run     {run}"
        yield f"#                              Plot    {plot}"
        yield "# All keys: docs/reference/case-files.md. SI units throughout, frequencies in Hz."
        yield ""
        count = "a support" if self.supports == 1 else f"{self.supports} supports"
        title = f"A beam of {self.material} with play in {count}"
        yield f"title = {toml_value(title)}"

    def _beam(self) -> Iterator[str]:
        round_ = self.section in ROUND
        yield from _table(
            "beam",
            ("length", self.length, "m, along x"),
            ("thickness", self.thickness, "m, the outer diameter" if round_ else "m, the bending direction"),
            ("width", self.thickness if round_ else self.width, "m, the same" if round_ else "m, across it"),
        )
        if self.section != "rectangle":
            keys = "".join(f", {key} = {toml_value(value)}" for key, value in self.walls.items())
            unit = "   # m" if keys else "   # the cross-section"
            yield f'section = {{ type = "{self.section}"{keys} }}{unit}'
        source = f"{self.material}: typical, put in your own" if self.material in MATERIALS else self.material
        yield from _table(
            "material",
            ("young_modulus", self.figures.young_modulus, f"Pa, of {source}"),
            ("poisson_ratio", self.figures.poisson_ratio, "no unit"),
            ("density", self.figures.density, "kg/m^3"),
        )
        yield from _table("damping", ("ratio", 0.01, "fraction of critical damping of every mode, no unit"))

    def _supports(self) -> Iterator[str]:
        if self.supports == 1:
            length = self.places()[0][1]
            yield from _table(
                "support",
                ("length", length, "m, from x = 0"),
                ("clearance", self.clearance, "m, pad thickness minus beam thickness"),
            )
            return
        play = "m, radius of the hole less radius of the beam" if self.region == "hole" else "m, between its two faces"
        for number, (start, end) in enumerate(self.places(), 1):
            yield from _table(
                "support",
                ("name", f"support{number}", "name in results"),
                ("from", start, "m, where it begins along the beam"),
                ("to", end, "m, where it ends"),
                ("clearance", self.clearance, play),
                ("region", self.region, "flat faces below and above" if self.region == "slot" else "round"),
                array=True,
            )

    def _model(self) -> Iterator[str]:
        yield from _table("model", ("type", "reduced", "a basis of modes of the mesh: quick, and close to it"))
        if self.section == "rectangle" and self.region == "slot":
            yield from _table("mesh", ("dimension", 2, "a slice in the bending plane; 3: the solid"))
        else:
            yield from _table("mesh", ("dimension", 3, "a solid"))

    def _rest(self) -> Iterator[str]:
        yield from _table("load", ("type", "gravity", "9.81 m/s^2, downward"), array=True)
        kind, unit, _, meaning = LOADS[self.load]
        place = [("point", self.loaded, "m, x on the beam axis")] if kind == "harmonic_force" else []
        yield from _table(
            "load",
            ("type", kind, meaning),
            ("name", "shaker", "name in results"),
            *place,
            ("amplitude", self.amplitude, unit),
            ("frequency", self.frequency, "Hz"),
            ("ramp", _rounded(RAMP / self.frequency), "s, over which the amplitude rises smoothly from 0"),
            array=True,
        )
        yield from _table("probe", ("name", "tip", "name in results"), ("point", self.length, "m, x"), array=True)
        if self.supports > 1:
            yield from _table("probe", ("name", "span", "name in results"), ("point", self.loaded, "m, x"), array=True)
        yield from _table(
            "time",
            ("end", _rounded(PERIODS / self.frequency), f"s, {PERIODS} periods of the load"),
            ("step", "auto", "s, from the bending frequencies and the load; gapbeam check says how long it is"),
        )


def _table(name: str, *rows: tuple[str, object, str], array: bool = False) -> Iterator[str]:
    """Yield the lines of a table, comments under each other."""
    yield ""
    yield f"[[{name}]]" if array else f"[{name}]"
    lines = [f"{key} = {toml_value(value)}" for key, value, _ in rows]
    longest = max(map(len, lines))
    for line, (_, _, comment) in zip(lines, rows, strict=True):
        yield f"{line:<{longest}}   # {comment}"


def _rounded(value: float) -> float:
    """Return a number to four digits."""
    return float(f"{value:.4g}")


CASES = Path(gapbeam.__file__).parent / "cases"
SUFFIX = ".toml"


@dataclass(frozen=True)
class Template:
    """A shipped case.

    Attributes:
        name: Its file without the suffix.
        title: Title in one line.
        text: Its file.
    """

    name: str
    title: str
    text: str

    def files(self) -> Iterator[str]:
        """Yield the files that the case reads, as it names them: relative to it."""
        tables = tomllib.loads(self.text)
        loads = tables.get("load", [])
        for table in (tables.get("mesh", {}), *loads, *(load.get("spectrum", {}) for load in loads)):
            if isinstance(table, dict) and "file" in table:
                yield table["file"]

    def text_for(self, path: Path) -> str:
        """Return the file with the commands of its first lines made those of its copy."""
        ending = "\n\n"
        opening, gap, rest = self.text.partition(ending)
        opening = opening.replace(f"cases/{self.name}{SUFFIX}", shell_command(path))
        return opening.replace(f"results/{self.name}", shell_command(Path("results") / path.stem)) + gap + rest


def templates() -> list[Template]:
    """Return the shipped cases by name."""
    found = []
    for path in sorted(CASES.glob(f"*{SUFFIX}")):
        text = path.read_text(encoding="utf-8")
        found.append(Template(path.stem, str(tomllib.loads(text)["title"]), text))
    return found


def template_named(name: str) -> Template:
    """Return the shipped case of a name.

    Raises:
        UserError: No shipped case has this name.
    """
    known = {one.name: one for one in templates()}
    wanted = name.removesuffix(SUFFIX).removeprefix("cases/")
    if wanted not in known:
        close = near(wanted, known)
        hint = f'did you mean "{close}"?' if close else "`gapbeam new --list` lists them"
        raise UserError(f'no template "{printable(name)}"; {hint}')
    return known[wanted]


def write_new(path: Path, text: str, beside: dict[str, bytes] | None = None) -> list[Path]:
    """Write a new case file and the files that it reads; never overwrite one.

    Args:
        path: The case file.
        text: Its text.
        beside: Contents of other files, by their names relative to it; those that are there already with the same
            content stay.

    Returns:
        Files that were written, the case file first.

    Raises:
        UserError: A file is there, or cannot be written.
    """
    others = {path.parent / name: content for name, content in (beside or {}).items()}
    for one, content in others.items():
        if os.path.lexists(one) and not _holds(one, content):
            raise UserError(f"{one} is there already, with another content; choose another folder for {path.name}")
    missing = {one: content for one, content in others.items() if not os.path.lexists(one)}
    written = list[Path]()
    try:
        for one, content in {path: text.encode("utf-8"), **missing}.items():
            one.parent.mkdir(parents=True, exist_ok=True)
            with one.open("xb") as file:
                written.append(one)
                file.write(content)
    except OSError as error:
        for one in written:
            with suppress(OSError):
                one.unlink()
        if isinstance(error, FileExistsError):
            raise UserError(f"{path} is there already; choose another name") from error
        raise UserError(f"{path} cannot be written ({error.strerror}); choose another place") from error
    return written


def copy_of(template: Template, path: Path) -> list[Path]:
    """Write a copy of a shipped case and of the files that it reads; as `write_new`."""
    contents = {name: (CASES / name).read_bytes() for name in template.files()}
    return write_new(path, template.text_for(path), contents)


def check_new(path: Path) -> None:
    """Refuse the name of a new case file before anything is asked.

    Raises:
        UserError: The file exists, has another suffix, or cannot be created there.
    """
    from gapbeam.solver.run.output.results_folder import REMEDY, check_name, check_place

    try:
        check_name(path)
        check_place(path.parent)
    except UserError as fault:
        raise UserError(str(fault).replace(REMEDY, "choose another place for the case file")) from fault
    if path.suffix != SUFFIX or path.stem.startswith("."):
        raise UserError(f"{path}: expected a name that ends with {SUFFIX}, such as {path.with_suffix(SUFFIX).name}")
    if os.path.lexists(path):
        raise UserError(f"{path} is there already; choose another name")


def _holds(path: Path, content: bytes) -> bool:
    try:
        return path.is_file() and path.read_bytes() == content
    except OSError:
        return False
