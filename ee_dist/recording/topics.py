"""What a recording looks like from outside: an MCAP file with zstd chunks and protobuf messages.

=============================  ========================  =============================================================
topic                          message                   one per
=============================  ========================  =============================================================
``/hardware/trial``            ee_dist.Trial             hardware trial: names, units, driver; ahead of its rows
``/hardware/rows``             ee_dist.Row               row of its sensor log
``/hardware/transforms``       foxglove.FrameTransforms  25 Hz picture of its parts, ``floor`` to ``hardware/<part>``
``/hardware/scene``            foxglove.SceneUpdate      trial: the solids of its parts, in their frames
``/prediction/...``            the same                  what the model said before the trial, ``believed`` says which
``/hindsight/...``             the same                  the trial on the model of the diagnosis that followed it
``/repair/generation``         ee_dist.Generation        generation of a repair pass
``/diagnosis/generation``      ee_dist.Generation        generation of a diagnosis pass
``/map/generation``         ee_dist.Generation        generation of the map of the intact system, where one is made
``/diagnosis/hypothesis``      ee_dist.Hypothesis        hypothesis, with its error
=============================  ========================  =============================================================

Topics do not carry the number of a trial: one plot of ``/hardware/rows`` then shows all trials one after another, and
``/prediction/rows`` lies over it. A row is one message rather than one for each of its parts, which keeps them together
and the file quick to write. Sensors and commands are lists; names and units of their places are in the trial message.

Log times are nanoseconds on the clock of the run (see ``clock.py``), never of the day. Besides messages a file holds
metadata records (``ee_dist``: version of the format; ``run``: the metadata of the run; ``status``: whether the run
reached its end) and attachments (``robot.json``, the robot; those of the run).
"""

from __future__ import annotations

from ee_dist.recording.records import DIAGNOSIS, HARDWARE, HINDSIGHT, MAP, PREDICTION, REPAIR

PROFILE = "ee_dist"
LIBRARY = "ee_dist recording 1"
"""Fixed, so that identical records give identical bytes under any version of the mcap library."""
FORMAT = "2"
FIRST_FORMAT = "1"
"""Of before: its final hypotheses were a last population, and most of its predictions were made after their trial."""

SOURCES = (HARDWARE, PREDICTION, HINDSIGHT)
PHASES = (REPAIR, DIAGNOSIS, MAP)

FORMAT_RECORD, RUN_RECORD, STATUS_RECORD = "ee_dist", "run", "status"
CHECKSUM = "crc32"
"""Entry of a metadata record: checksum of the others, since MCAP has one for attachments and chunks alone."""
ROBOT_FILE = "robot.json"
FLOOR_FRAME = "floor"
HYPOTHESIS_TOPIC = f"/{DIAGNOSIS}/hypothesis"


def trial_topic(source: str) -> str:
    return f"/{source}/trial"


def rows_topic(source: str) -> str:
    return f"/{source}/rows"


def transforms_topic(source: str) -> str:
    return f"/{source}/transforms"


def scene_topic(source: str) -> str:
    return f"/{source}/scene"


def generation_topic(phase: str) -> str:
    return f"/{phase}/generation"


def part_frame(source: str, part: str) -> str:
    """Name of a part's coordinate frame: hardware and prediction stand side by side in one tree."""
    return f"{source}/{part}"
