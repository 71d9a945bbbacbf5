"""YAML as people write it: ``1e-3`` is a number, and a key that stands twice is a mistake rather than a choice."""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import Any

import yaml

from ee_dist.basics.quoted import quoted


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            name = str(getattr(key, "value", key))
            if name in seen and name != "<<":
                line = key.start_mark.line + 1
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {quoted(name)} stands twice (line {line})"
                )
            seen.add(name)
        return super().construct_mapping(node, deep)


# YAML 1.1 takes 1e-3 for a text: it asks for a point in the mantissa and a sign in the exponent.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"), list("-+.0123456789")
)


def load_yaml(text: str) -> Any:
    """What the text says. Raises yaml.YAMLError."""
    try:
        return yaml.load(text, _Loader)
    except (RecursionError, ValueError) as error:
        raise yaml.YAMLError("nested too deeply" if isinstance(error, RecursionError) else str(error)) from None
