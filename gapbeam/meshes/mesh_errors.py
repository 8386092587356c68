"""Errors of a mesh: of its file, or of the requested dimensions."""

from __future__ import annotations


class MeshError(ValueError):
    """A mesh that cannot be built, read or used.

    Attributes:
        where: the file, key or group that is at fault.
        found: content found there.
        expected: content expected there.
        hint: advice on what to try; may be empty.
    """

    exit_status = 2

    def __init__(self, where: str, *, found: str, expected: str, hint: str = "") -> None:
        self.where = where
        self.found = found
        self.expected = expected
        self.hint = hint
        sentences = f"{where}: found {found}; expected {expected}."
        super().__init__(f"{sentences} {hint}" if hint else sentences)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle by fields, so that all ranks can raise the error of rank 0."""
        return (_restored, (self.where, self.found, self.expected, self.hint))


def _restored(where: str, found: str, expected: str, hint: str) -> MeshError:
    return MeshError(where, found=found, expected=expected, hint=hint)
