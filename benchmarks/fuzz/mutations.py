"""Corruption of files: of bytes, numbers, words and tables, or by another kind of file under the name."""

from __future__ import annotations

import json
import os
import random
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

NUMBERS = (
    "0", "-0.0", "-1", "1e-300", "1e300", "1e400", "-1e400", "nan", "inf", "-inf", "1e-9", "1e9", "1e12", "1e15",
    "1e18", "9223372036854775808", "1" * 30, "0x7fffffff", "true", '"1"', "[]", "{}", "null", "1_000",
    "1979-05-27T07:32:00Z", "9" * 5000,
)  # fmt: skip
WORDS = (
    "../../precious/secret", "/etc/passwd", "/dev/zero", "..", ".", "", " ", "x" * 5000, "\\u0000",
    "\x1b[2J\x1b]0;owned\x07",
    "\u202eevil", "ünïcödé", "%s%n", "$(touch precious/owned)", "<script>alert(1)</script>", "[red]bold[/red]", "[/]",
    "a/b", "a\\\\b", "con", "auto", "full", "NaN", "$x^{2$", "$\\\\frac$",
)  # fmt: skip
SNIPPETS = (
    b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\r\n", b"\r", b"\x1b[31m", b"[[[[", b"{{{{", b"[a]\n" * 50, b'"""', b"'''",
    b"<!ENTITY a 'b'>", b"\xf0\x9f\x92\xa9", b"$End", b"=", b"{", b"}", b"#", b"../", b"e999",
)  # fmt: skip
_NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_QUOTED = re.compile(rb'"[^"\n]*"')


def spoil_bytes(content: bytes, chance: random.Random) -> bytes:
    """Return other bytes: cut, flipped, inserted, repeated, taken out, swapped."""
    for _ in range(chance.choice((1, 1, 1, 2, 4, 16))):
        content = chance.choice(_BYTES)(content, chance)
    return content


def spoil_text(content: bytes, chance: random.Random) -> bytes:
    """Return a text with other numbers, words or lines, or with other bytes."""
    for _ in range(chance.choice((1, 1, 2, 3))):
        content = chance.choice(_TEXTS)(content, chance)
    return content


def _cut(content: bytes, chance: random.Random) -> bytes:
    return content[: chance.randrange(len(content) + 1)]


def _flip(content: bytes, chance: random.Random) -> bytes:
    if not content:
        return content
    place = chance.randrange(len(content))
    return content[:place] + bytes([content[place] ^ (1 << chance.randrange(8))]) + content[place + 1 :]


def _overwrite(content: bytes, chance: random.Random) -> bytes:
    place = chance.randrange(len(content) + 1)
    size = chance.choice((1, 2, 4, 8, 64))
    value = chance.choice((b"\0", b"\xff", b"\x7f", b"\x80", bytes([chance.randrange(256)])))
    return content[:place] + value * size + content[place + size :]


def _insert(content: bytes, chance: random.Random) -> bytes:
    place = chance.randrange(len(content) + 1)
    return content[:place] + chance.choice(SNIPPETS) + content[place:]


def _take_out(content: bytes, chance: random.Random) -> bytes:
    place = chance.randrange(len(content) + 1)
    return content[:place] + content[place + chance.choice((1, 7, 50, 500)) :]


def _repeat(content: bytes, chance: random.Random) -> bytes:
    place = chance.randrange(len(content) + 1)
    return content[:place] + content[place : place + 100] * chance.choice((1, 2, 50)) + content[place:]


def _number(content: bytes, chance: random.Random) -> bytes:
    return _replaced(content, _NUMBER, chance.choice(NUMBERS).encode(), chance)


def _word(content: bytes, chance: random.Random) -> bytes:
    return _replaced(content, _QUOTED, b'"' + chance.choice(WORDS).encode() + b'"', chance)


def _swap_lines(content: bytes, chance: random.Random) -> bytes:
    lines = content.split(b"\n")
    one, other = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _drop_line(content: bytes, chance: random.Random) -> bytes:
    lines = content.split(b"\n")
    del lines[chance.randrange(len(lines))]
    return b"\n".join(lines)


def _endless(content: bytes, chance: random.Random) -> bytes:
    """Add some thousand entries, keys or levels."""
    count = chance.choice((300, 3000, 30_000))
    more = chance.choice(
        (
            b'[[probe]]\nname = "a"\npoint = 0.1\n' * count,
            b'[[load]]\ntype = "gravity"\n' * count,
            b"".join(b"[a%d]\n" % number for number in range(count)),
            b"[x]\n" + b".".join([b"a"] * count) + b" = 1\n",
            b"[x]\na = [" + b"0.1, " * count + b"]\n",
        )
    )
    return content + b"\n" + more


def _double_line(content: bytes, chance: random.Random) -> bytes:
    lines = content.split(b"\n")
    lines.insert(chance.randrange(len(lines)), chance.choice(lines))
    return b"\n".join(lines)


def _other_coding(content: bytes, chance: random.Random) -> bytes:
    coding = chance.choice(("utf-16", "utf-16-be", "utf-32", "utf-8-sig", "latin-1", "cp1252", "utf-7"))
    return content.decode("utf-8", errors="replace").encode(coding, errors="replace")


def _line_ends(content: bytes, chance: random.Random) -> bytes:
    return content.replace(b"\n", chance.choice((b"\r\n", b"\r", b"\n\n", b"\0\n")))


def _replaced(content: bytes, pattern: re.Pattern[bytes], new: bytes, chance: random.Random) -> bytes:
    places = list(pattern.finditer(content))
    if not places:
        return content
    place = chance.choice(places)
    return content[: place.start()] + new + content[place.end() :]


_Spoil = Callable[[bytes, random.Random], bytes]
_BYTES: tuple[_Spoil, ...] = (_cut, _flip, _flip, _overwrite, _overwrite, _insert, _take_out, _repeat)
_TEXTS: tuple[_Spoil, ...] = (
    _number, _number, _number, _word, _word, _swap_lines, _drop_line, _double_line, _other_coding, _line_ends,
    spoil_bytes, _endless,
)  # fmt: skip

VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1.5, 1e300, -1e300, float("nan"), float("inf"), 10**30, "", "x", "x" * 5000, "../../precious",
    "\x1b[2J", "<b>", "[red]", "$\\frac$", [], {}, [1, 2], {"a": 1}, [[]], [None], "1e400", 1e-300,
)  # fmt: skip


def spoil_json(content: bytes, chance: random.Random) -> bytes:
    """Return JSON with some values replaced, dropped, doubled or wrapped; now and then other text, or a bomb."""
    draw = chance.random()
    if draw < 0.25:
        return spoil_text(content, chance)
    if draw < 0.28:
        return chance.choice((b"[" * 200_000, b'{"a":' * 100_000, b"9" * 100_000, b"[" + b"0," * 500_000 + b"0]"))
    try:
        data = json.loads(content)
    except ValueError:
        return spoil_text(content, chance)
    for _ in range(chance.choice((1, 1, 2, 4))):
        data = _spoiled(data, chance)
    return json.dumps(data).encode()


def _spoiled(data: Any, chance: random.Random) -> Any:
    """Return data with one change, at a place that is drawn by walking down."""
    if chance.random() < 0.15 or not isinstance(data, dict | list) or not data:
        return chance.choice(VALUES)
    keys = list(data) if isinstance(data, dict) else list(range(len(data)))
    key = chance.choice(keys)
    changed = dict(data) if isinstance(data, dict) else list(data)
    draw = chance.random()
    if draw < 0.15:
        del changed[key]
    elif draw < 0.2 and isinstance(changed, list):
        changed = changed * chance.choice((0, 2, 20))
    elif draw < 0.25 and isinstance(changed, dict):
        changed["x" if chance.random() < 0.5 else chance.choice(WORDS)] = chance.choice(VALUES)
    else:
        changed[key] = _spoiled(data[key], chance)
    return changed


def spoil_hdf5(path: Path, chance: random.Random) -> None:
    """Change an HDF5 file in place by way of its own library: other shapes, types, units, values, links."""
    with h5py.File(path, "r+") as file:
        names = [name for name in file if isinstance(file.get(name), h5py.Dataset)]
        if not names:
            return
        for _ in range(chance.choice((1, 1, 2))):
            with suppress(OSError, RuntimeError, ValueError, TypeError, KeyError):  # a second change to a broken first
                chance.choice(_HDF5)(file, chance.choice(names), chance)


def _h5_value(file: h5py.File, name: str, chance: random.Random) -> None:
    data = file.get(name)
    if isinstance(data, h5py.Dataset) and data.dtype.kind == "f" and data.size:
        place = tuple(chance.randrange(size) for size in data.shape)
        data[place] = chance.choice((np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0))


def _h5_all(file: h5py.File, name: str, chance: random.Random) -> None:
    data = file.get(name)
    if isinstance(data, h5py.Dataset) and data.dtype.kind == "f" and 0 < data.size < 10**7:  # not one of _h5_huge
        data[...] = chance.choice((np.nan, 0.0, 1e308, -1.0))


def _h5_drop(file: h5py.File, name: str, chance: random.Random) -> None:  # noqa: ARG001
    if name in file:
        del file[name]


def _h5_other(file: h5py.File, name: str, chance: random.Random) -> None:
    if name in file:
        del file[name]
    shapes: tuple[Any, ...] = ((), (0,), (3,), (2, 2, 2, 2), (1501, 1), (1501, 2, 2), (1, 1))
    kind = chance.choice(("f8", "i4", "S5", "c16", "f2", h5py.string_dtype(), "u1"))
    try:
        file.create_dataset(name, shape=chance.choice(shapes), dtype=kind)
    except (ValueError, TypeError):
        file.create_group(name)


def _h5_huge(file: h5py.File, name: str, chance: random.Random) -> None:
    if name in file:
        del file[name]
    size = chance.choice((10**7, 10**9, 10**11, 10**15))
    shape = chance.choice(((size,), (1501, size), (size, 2), (1, 1, size)))
    file.create_dataset(name, shape=shape, dtype="f8", chunks=True)


def _h5_link(file: h5py.File, name: str, chance: random.Random) -> None:
    if name in file:
        del file[name]
    target = chance.choice(("/etc/passwd", "../../precious/secret.h5", "fields.h5", "history.h5", "/dev/zero"))
    file[name] = h5py.SoftLink(chance.choice((f"/{name}", "/nowhere"))) if chance.random() < 0.3 else (
        h5py.ExternalLink(target, chance.choice(("/", "/time", "/points")))
    )  # fmt: skip


def _h5_external(file: h5py.File, name: str, chance: random.Random) -> None:
    if name in file:
        del file[name]
    file.create_dataset(name, shape=(10,), dtype="f8", external=[(chance.choice(("/etc/passwd", "secret")), 0, 80)])


def _h5_attribute(file: h5py.File, name: str, chance: random.Random) -> None:
    owner = file if chance.random() < 0.5 or name not in file else file[name]
    key = chance.choice(
        ("format", "units", "long_name", "_FillValue", "scale_factor", "CLASS", "NAME", "DIMENSION_LIST")
    )
    value = chance.choice((7, -1, 1e400, "x", b"\xff\xfe", "\x1b[2J", np.array([1, 2, 3]), np.nan, h5py.Empty("f")))
    owner.attrs[key] = value


_HDF5 = (_h5_value, _h5_value, _h5_all, _h5_drop, _h5_other, _h5_other, _h5_huge, _h5_link, _h5_external, _h5_attribute)


def put_in_place(path: Path, precious: Path, chance: random.Random) -> None:
    """Put something else instead of a file: a folder, a pipe, a device, a link to nowhere, itself or outside."""
    if path.is_symlink() or path.is_file():
        path.unlink()
    draw = chance.randrange(8)
    if draw == 0:
        path.mkdir()
    elif draw == 1:
        os.mkfifo(path)
    elif draw == 2:
        path.symlink_to("/dev/zero")
    elif draw == 3:
        path.symlink_to(path)
    elif draw == 4:
        path.symlink_to(precious / "secret")
    elif draw == 5:
        path.symlink_to(precious / "not-there")
    elif draw == 6:
        path.write_bytes(b"")
