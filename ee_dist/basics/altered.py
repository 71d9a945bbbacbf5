"""Copies of frozen records with some fields changed, without the price of setting each field by itself."""

from __future__ import annotations

from dataclasses import fields
from functools import cache
from typing import Any, TypeVar, cast

Record = TypeVar("Record")


def altered(record: Record, **changes: Any) -> Record:
    """What ``dataclasses.replace`` gives, for dataclasses without slots whose fields are all given to ``__init__``: a model of
    fifty terms copies records some two hundred times. What was cached on the record is not taken along. Raises TypeError for a
    name that is no field."""
    names, checked = _made_of(cast(Any, type(record)))
    if not changes.keys() <= names:
        unknown = ", ".join(sorted(changes.keys() - names))
        raise TypeError(f"{type(record).__name__} has no field {unknown}")
    old, new = record.__dict__, object.__new__(type(record))
    kept = old if len(old) == len(names) else {name: value for name, value in old.items() if name in names}
    new.__dict__.update(kept | changes)
    if checked:
        new.__post_init__()  # type: ignore[attr-defined]
    return new


@cache
def _made_of(kind: Any) -> tuple[frozenset[str], bool]:
    """Names of its fields, and whether it looks at them once they are set."""
    return frozenset(f.name for f in fields(kind)), hasattr(kind, "__post_init__")
