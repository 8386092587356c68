"""The shipped cases as templates of new ones: which there are, what they show, and a copy under another name."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import gapbeam
from gapbeam.postprocess.shell_command import shell_command
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import near, printable

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
        UserError: There is none.
    """
    known = {one.name: one for one in templates()}
    wanted = name.removesuffix(SUFFIX).removeprefix("cases/")
    if wanted not in known:
        close = near(wanted, known)
        hint = f'did you mean "{close}"?' if close else "`gapbeam new --list` lists them"
        raise UserError(f'no template "{printable(name)}"; {hint}')
    return known[wanted]


def write_new(path: Path, text: str, beside: dict[str, bytes] | None = None) -> list[Path]:
    """Write a new case file and the files that it reads, and never over what is there.

    Args:
        path: The case file.
        text: Its text.
        beside: Contents of other files, by their names relative to it; those that are there already with the same
            content stay.

    Returns:
        What was written, the case file first.

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
        UserError: It is there, has another suffix, or cannot lie there.
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
