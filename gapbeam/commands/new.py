"""The command `gapbeam new`: a case file after a few questions, or from a shipped case."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from gapbeam.process.terminal_text import harmless
from gapbeam.process.usage_errors import UsageError

if TYPE_CHECKING:
    from gapbeam.new_case.answers import CaseAnswers, MaterialFigures
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "": 1.0}
"""Units of a length that an answer may have, m."""
OTHER = "other"

Ask = Callable[[str, str, Callable[[str], object]], object]


def template_names() -> list[str]:
    """Return the names of templates, for the completion of shells."""
    from gapbeam.new_case.answers import templates

    return [one.name for one in templates()]


def new(
    case: Annotated[Path | None, typer.Argument(metavar="CASE", help="case file to write, *.toml")] = None,
    template: Annotated[
        str | None, typer.Option(help="copy this shipped case; no questions", autocompletion=template_names)
    ] = None,
    list_: Annotated[bool, typer.Option("--list", help="list the templates")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="take the default of every question")] = False,
) -> int:
    """Write a new case file: after a few questions, or from a template. Nothing is overwritten."""
    from gapbeam.new_case.answers import check_new, copy_of, template_named, templates

    if list_:
        known = templates()
        width = max(len(one.name) for one in known)
        print(*(f"{one.name:<{width}}  {one.title}" for one in known), sep="\n")
        return 0
    if case is None:
        raise UsageError("the name of the case file is missing, such as: gapbeam new my.toml")
    if template is not None and yes:
        raise UsageError("--template asks no questions: leave out --yes")
    chosen = None if template is None else template_named(template)
    check_new(case)
    written = _written(case, yes) if chosen is None else copy_of(chosen, case)
    _report(case, written)
    return 0


def _written(case: Path, yes: bool) -> list[Path]:
    from gapbeam.new_case.answers import write_new
    from gapbeam.solver.case.reading.case_reader import read_case_text

    try:
        answers = asked((lambda _question, default, read: read(default)) if yes else _prompt)
    except typer.Abort as ended:
        if sys.stdin.isatty():
            raise
        raise UsageError("the answers ended before the questions did; --yes takes all defaults") from ended
    text = answers.case_text(case)
    read_case_text(text, name=str(case))  # faults are reported, and nothing is written
    return write_new(case, text)


def _report(case: Path, written: list[Path]) -> None:
    from gapbeam.postprocess.shell_command import shell_command
    from gapbeam.solver.case.checks.case_warnings import warnings
    from gapbeam.solver.case.reading.case_reader import read_case

    for path in written:
        print(f"written: {harmless(path)}")
    for line in warnings(read_case(case)):
        print(f"note: {harmless(line)}")
    print("next:", *(harmless(shell_command("gapbeam", word, case)) for word in ("check", "view", "run")), sep="\n  ")


def asked(ask: Ask) -> CaseAnswers:
    """Return the answers to the questions about a new case.

    Args:
        ask: Puts a question, with a default, and reads the answer; asks again where it cannot be read.
    """
    from gapbeam.new_case.answers import LOADS, MATERIALS, MOST_SUPPORTS, ROUND, SECTIONS, CaseAnswers

    usual = CaseAnswers()
    section = str(ask(f"cross-section ({', '.join(SECTIONS)})", usual.section, one_of(SECTIONS)))
    is_round = section in ROUND
    length = float(str(ask("length of the beam, m", "0.5", meters)))
    size = "outer diameter, m" if is_round else "thickness in the bending direction, m"
    thickness = float(str(ask(size, "0.025" if is_round else "0.012", meters)))
    width = thickness if is_round else float(str(ask("width across it, m", f"{thickness / 0.6:.3g}", meters)))
    walls = {
        key: float(str(ask(f"{words}, m", f"{share * thickness:.3g}", meters)))
        for key, (words, share) in SECTIONS[section].items()
    }
    material = str(ask(f"material ({', '.join([*MATERIALS, OTHER])})", usual.material, one_of([*MATERIALS, OTHER])))
    figures = MATERIALS[material] if material != OTHER else _figures(ask)
    material = "a material of its own" if material == OTHER else material
    count = int(str(ask("number of supports", "2", whole_up_to(MOST_SUPPORTS))))
    region: Literal["slot", "hole"] = "slot"
    if is_round and count > 1 and ask("supports are holes or slots", "hole", one_of(["hole", "slot"])) == "hole":
        region = "hole"
    play = "radial play in each hole, m" if region == "hole" else "play in each support, m"
    clearance = float(str(ask(play, "0.1 mm" if region == "hole" else "0.2 mm", meters)))
    load = str(ask(f"load ({', '.join(LOADS)})", usual.load, one_of(LOADS)))
    _, unit, strength, _ = LOADS[load]
    amplitude = float(str(ask(f"its amplitude, {unit}", f"{strength:g}", positive)))
    frequency = float(str(ask("its frequency, Hz", f"{usual.frequency:g}", positive)))
    return CaseAnswers(
        length, section, thickness, width, walls, material, figures, count, region, clearance, load, amplitude,
        frequency,
    )  # fmt: skip


def _figures(ask: Ask) -> MaterialFigures:
    from gapbeam.new_case.answers import MaterialFigures

    modulus = float(str(ask("Young's modulus, Pa", "2.1e11", positive)))
    ratio = float(str(ask("Poisson's ratio", "0.3", number)))
    return MaterialFigures(modulus, ratio, float(str(ask("density, kg/m^3", "7850", positive))))


def _prompt(question: str, default: str, read: Callable[[str], object]) -> object:
    return typer.prompt(question, default=default, value_proc=read)


def one_of(known: object) -> Callable[[str], str]:
    """Return a reader of one of some names, which suggests one for another word; its text lists them."""
    names = [str(name) for name in known]  # type: ignore[attr-defined]

    def read(text: str) -> str:
        from gapbeam.solver.messages.wording import near

        if text.strip() in names:
            return text.strip()
        close = near(text, names)
        hint = f"; did you mean {close}?" if close else ""
        raise UsageError(f'"{harmless(text)}" is none of {", ".join(names)}{hint}')

    return read


def meters(text: str) -> float:
    """Read a positive length such as 0.5, 12 mm or 0.5 in, and return it in m.

    Raises:
        UsageError: Not such a length.
    """
    parts = re.fullmatch(r"\s*([\d.eE+-]+?)\s*(m|cm|mm|um|in|)\s*", text)
    return float(f"{positive(parts[1], text) * UNITS[parts[2]]:.12g}") if parts else positive(text)


def number(text: str, shown: str | None = None) -> float:
    """Read a finite number.

    Raises:
        UsageError: Not a number.
    """
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) < float("inf"):
        raise UsageError(f'"{harmless(shown or text)}": expected a number')
    return value


def positive(text: str, shown: str | None = None) -> float:
    """Read a positive number.

    Raises:
        UsageError: Not such a number.
    """
    value = number(text, shown)
    if not value > 0.0:
        raise UsageError(f'"{harmless(shown or text)}": expected more than 0')
    return value


def whole_up_to(most: int) -> Callable[[str], int]:
    """Return a reader of whole numbers from 1 to a largest one."""

    def read(text: str) -> int:
        if not re.fullmatch(r"\s*\d{1,9}\s*", text) or not 1 <= int(text) <= most:
            raise UsageError(f'"{harmless(text)}": expected a whole number from 1 to {most}')
        return int(text)

    return read
