"""The truth of a trial, sealed: kept beside the log so that nobody reads it by accident, opened by ``task=reveal``.

The seal is an envelope, not a safe. The log carries its digest, so that an envelope can be known to be the right one
and not to have been changed since.
"""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ee_dist.effects.catalogue import Hypothesis, from_dict
from ee_dist.effects.effect import EffectError
from ee_dist.robots.untrusted import LARGEST, json_of, text_of
from ee_dist.tasks.config import ConfigError

FILE = "sealed.json"
_NOTE = "The hidden truth of the trial beside this file. Open it with: python -m ee_dist task=reveal log=<this folder>"


def sealed(truth: Mapping[str, Any]) -> tuple[str, str]:
    """(text of the file, digest for the log)."""
    plain = json.dumps(truth, sort_keys=True).encode()
    payload = base64.b64encode(zlib.compress(plain)[::-1]).decode()
    digest = hashlib.sha256(payload.encode()).hexdigest()
    return json.dumps({"format": 1, "note": _NOTE, "payload": payload, "digest": digest}, indent=1) + "\n", digest


def opened(path: Path, digest: str | None = None) -> tuple[Hypothesis, dict[str, Any]]:
    """(hidden hypothesis, all that was sealed). Raises ConfigError where the seal is broken or of another log."""
    try:
        data = json_of(text_of(path))
        payload = str(data["payload"])
        found = hashlib.sha256(payload.encode()).hexdigest()
        if found != data["digest"]:
            raise ConfigError(f"{path}: the seal is broken: its content was changed after the trial")
        if digest and digest != found:
            raise ConfigError(
                f"{path}: this envelope belongs to another log (seal {found[:12]}, the log says {digest[:12]})"
            )
        truth = json_of(zlib.decompressobj().decompress(base64.b64decode(payload)[::-1], LARGEST))
        hidden = tuple(from_dict(entry) for entry in truth["hidden"])
    except FileNotFoundError:
        raise ConfigError(f"{path}: no sealed truth there; task=trial writes it beside the log") from None
    except (ConfigError, EffectError):
        raise
    except (OSError, ValueError, KeyError, TypeError, zlib.error):
        raise ConfigError(f"{path}: not a sealed truth of task=trial") from None
    return hidden, truth
