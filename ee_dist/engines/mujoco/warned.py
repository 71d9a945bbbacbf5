"""MuJoCo's warnings, which it would else write to a file in the working folder."""

from __future__ import annotations

import logging

import mujoco

_log = logging.getLogger(__name__)


def no_file_of_warnings() -> None:
    """Into our log with them, unless somebody listens already. What they tell of, a robot's log or an error says too."""
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(_log.debug)
