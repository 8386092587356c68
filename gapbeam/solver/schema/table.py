"""Values that keys of a case file may have, and the base of all its tables."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from types import UnionType
from typing import Annotated, Any, ClassVar, TypeVar, Union, get_args, get_origin

from pydantic import (
    AllowInfNan,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Strict,
    ValidationError,
    create_model,
)
from pydantic_core import CoreSchema, core_schema

Number = Annotated[float, Strict(), AllowInfNan(False)]
Positive = Annotated[Number, Field(gt=0)]
NonNegative = Annotated[Number, Field(ge=0)]
Whole = Annotated[int, Strict()]
Switch = Annotated[bool, Strict()]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=40)]
POINT_PATTERN = r"^[A-Za-z][^.\s]*(\.[^.\s]+)?$"
PointName = Annotated[str, Field(pattern=POINT_PATTERN, max_length=81)]
"""A point of a scene: "structure.point"."""
FORMS = ("table", "array")
"""The forms of a key that takes one table or an array of others, as the errors of pydantic name them."""
Vector = tuple[Number, Number] | tuple[Number, Number, Number]


class Table(BaseModel):
    """A table of the case file: immutable, unknown keys refused, no text or switch taken for a number.

    Descriptions read "what it is, unit; default where the default is derived": messages, the JSON schema, the
    case file that a run leaves behind and docs/reference/case-files.md are made from them.

    Attributes:
        elsewhere: Words that users try as keys of this table, each with a hint at what has that meaning.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)
    elsewhere: ClassVar[Mapping[str, str]] = {}


class MadeTable(Table):
    """A table whose keys, but `type`, are the arguments of what it stands for.

    Attributes:
        make: Function that makes it.
    """

    make: ClassVar[Callable[..., Any]]

    def made(self) -> Any:
        """Return the region, the law or the scheme; its function may refuse the keys."""
        return type(self).make(**{name: value for name, value in self if name != "type"})


class AlongBeam(Table):
    """A table of something along the beam, from one place to another; "from" is no name for an attribute in Python."""

    elsewhere: ClassVar[Mapping[str, str]] = {"length": "it ends at `to`: `from` plus the length"}

    @property
    def start(self) -> float:
        """Start along the beam, m."""
        return float(vars(self)["from"])

    @property
    def end(self) -> float:
        """End along the beam, m."""
        return float(vars(self)["to"])

    @property
    def length(self) -> float:
        """Length along the beam, m."""
        return self.end - self.start


Placed = TypeVar("Placed", bound=AlongBeam)


def placed_along(base: type[Placed], name: str, what: str, ends: tuple[float, float], meaning: str) -> type[Placed]:
    """Return a table with the keys `from` and `to` added, which cannot be written as attributes.

    Args:
        base: The other keys of the table.
        name: Name of the class and of the module's variable that holds it.
        what: Name of the part.
        ends: Examples of both, m.
        meaning: Its docstring.
    """
    keys: dict[str, Any] = {
        "from": (NonNegative, Field(description=f"start of {what} along the beam, m", examples=[ends[0]])),
        "to": (Positive, Field(description="its end along the beam, m", examples=[ends[1]])),
    }
    return create_model(name, __base__=base, __module__=base.__module__, __doc__=meaning, **keys)


def named(value: object) -> object:
    """Read a plain name, scheme = "newmark", as the table that holds only that type."""
    return {"type": value} if isinstance(value, str) else value


def faults_in(error: ValidationError, depth: int = 0) -> str:
    """Return the faults of values that no file holds: key, found, expected.

    Args:
        error: As raised by a table.
        depth: Leading parts of each key that are left out, such as the name of the type in a union.
    """
    words = []
    for one in error.errors(include_url=False):
        key = ".".join(map(str, one["loc"][depth:])) or "type"
        said = f"{one['msg'][:1].lower()}{one['msg'][1:]}".replace("input should be", "expected")
        found = "" if one["type"] == "missing" else f"found {one['input']!r}, "
        if one["type"] == "union_tag_invalid":
            found, said = f"found {one['ctx']['tag']!r}, ", f"expected one of {one['ctx']['expected_tags']}"
        words.append(f"{key}: {found}{said}")

    return "; ".join(words)


def models_in(annotation: object) -> list[type[BaseModel]]:
    """Return the models that an annotation may hold, through unions, tuples and Annotated."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in models_in(part)]


def array_models(annotation: object) -> list[type[BaseModel]]:
    """Return the models that the entries of an array of tables may have; empty where the annotation takes none."""
    if get_origin(annotation) is tuple:
        return models_in(annotation)
    if get_origin(annotation) in (Union, UnionType, Annotated):
        return [model for part in get_args(annotation) for model in array_models(part)]
    return []


def type_name(model: type[BaseModel]) -> str:
    """Return the value of `type` that selects this model, or "" where there is no such key."""
    return str(get_args(model.model_fields["type"].annotation)[0]) if "type" in model.model_fields else ""


class _OfType:
    """Choice of the table in a union by its `type`.

    Each table is compiled by pydantic when a file first has it: all of them would take twice as long as the demo's.
    """

    def __get_pydantic_core_schema__(self, union: Any, _usual: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.tagged_union_schema(
            {
                type_name(one): core_schema.no_info_plain_validator_function(one.model_validate)
                for one in models_in(union)
            },
            "type",
        )

    def __get_pydantic_json_schema__(self, chosen: Any, described: GetJsonSchemaHandler) -> dict[str, Any]:
        while "choices" not in chosen:  # within what reads a plain name
            chosen = chosen["schema"]
        found = dict[Hashable, CoreSchema]()
        for name, one in chosen["choices"].items():
            table = one["function"]["function"].__self__
            table.model_rebuild()
            found[name] = table.__pydantic_core_schema__
        return described(core_schema.tagged_union_schema(found, "type"))


OF_TYPE = _OfType()
