"""How a log comes onto the bench: a recording, a file of another program by task=import, or the story by task=trial.

What reads other programs' files is loaded when there is one: a page that is opened with a recording does not wait for it.
"""

from __future__ import annotations

import contextlib
import io
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ee_dist.basics.files import fresh
from ee_dist.robots.describe import robot_of
from ee_dist.tasks.config import Config, ConfigError, EngineConfig, RobotConfig
from ee_dist.tasks.results.commands import command, setting
from ee_dist.workbench.session import Session

if TYPE_CHECKING:
    from ee_dist.tasks.import_ import Options

DROPPED, TAKEN_IN, STORY = "dropped", "import", "trial"
PLANS = {
    "servo_pendulum": ["multisine:seconds=4,amplitude=0.5,seed=1", "slow_sines:seconds=4,amplitude=0.4,seed=2"],
    "quadruped_lab": [
        "multisine:seconds=4.2,amplitude=0.8,seed=1,fixture=stand",
        "steps:seconds=3.6,amplitude=0.9,seed=2,fixture=stand",
        "sway:seconds=4.2,amplitude=0.1,seed=1",
    ],
}
HIDDEN = {"servo_pendulum": "coulomb_friction@servo", "quadruped_lab": "random"}
NOISE = 0.005


@dataclass(frozen=True)
class Answers:
    """What a person said because no file can, as typed."""

    joints: str = ""
    gains: str = ""
    unit: str = ""
    rate_hz: float | None = None


@dataclass(frozen=True)
class Proposed:
    """A mapping as it was guessed: rows of a table, what is open, and its text."""

    rows: tuple[tuple[str, str, str, str, str], ...]
    questions: tuple[str, ...]
    notes: tuple[str, ...]
    text: str


class Intake:
    """Of one page; what it takes in goes to the session, and its files into the session's folder."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.path: Path | None = None

    def place_for(self, name: str) -> Path:
        """Where a dropped file goes: its own name, without what a path could do with it."""
        bare = re.sub(r"[^\w.\- ]+", "_", Path(name.replace("\\", "/")).name).lstrip(".") or "file"
        folder = self.session.folder / DROPPED
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / bare
        return self.path

    def open_recording(self, path: Path) -> None:
        self._open(path, [])

    def propose(self, path: Path, robot: str, answers: Answers) -> Proposed:
        """What task=import would take the columns for. Raises MeasurementError, RobotError, ConfigError."""
        from ee_dist.measurements.proposal.files import proposal_for
        from ee_dist.measurements.proposal.write import as_yaml, rows
        from ee_dist.tasks import import_

        self.path = path
        config = self._config(robot)
        chosen = config.robot
        hints = replace(import_.hints_of(options_of(answers)), written=import_.written_orders(config))
        found = proposal_for([path], robot_of(chosen.name, chosen.urdf, chosen.drives)[0], hints)
        text = as_yaml(found, import_.robot_source(config), path.name)
        return Proposed(tuple(rows(found)), tuple(found.questions), tuple(found.notes), text)

    def take_in(self, robot: str, answers: Answers, mapping: str | None) -> None:
        """Import what was dropped, by the answers or by a mapping's text, and open it. Raises as task=import does."""
        from ee_dist.tasks import import_

        if self.path is None:
            raise ConfigError("drop a file first")
        folder = fresh(self.session.folder / TAKEN_IN)
        folder.mkdir(parents=True)
        options = options_of(answers)
        config = replace(self._config(robot), measured=str(self.path))
        words = ["task=import", setting("measured", self.path), *_named(config.robot)]
        if mapping is not None:
            file = folder / "mapping_used.yaml"
            file.write_text(mapping, encoding="utf-8")
            options = import_.Options(mapping=str(file))
            words.append(setting("task.mapping", file))
        else:
            words += [f"task.{k}={v}" for k, v in _said(answers).items()]
        with contextlib.redirect_stdout(io.StringIO()):
            import_.run(config, options, folder)
        self._open(folder / options.output, [command(words)])

    def story(self, robot: str) -> None:
        """Trials of a simulated robot whose hidden effect is sealed, as task=trial makes them."""
        from ee_dist.tasks import trial

        folder = fresh(self.session.folder / STORY)
        folder.mkdir(parents=True)
        config = replace(
            self._config(robot), hidden=HIDDEN[robot], engine=EngineConfig(self.session.config.engine.name)
        )
        options = trial.Options(excitations=PLANS[robot], repeats=1, noise=NOISE)
        plan = ",".join(f"'{p}'" for p in PLANS[robot])
        words = ["task=trial", f"robot={robot}", f"+hidden={HIDDEN[robot]}", f"task.excitations=[{plan}]",
                 f"task.noise={NOISE}", f"engine={config.engine.name}"]  # fmt: skip
        with contextlib.redirect_stdout(io.StringIO()):
            trial.run(config, options, folder)
        self.session.load(str(folder / "trial.mcap"), None)
        self.session.commands = (command(words),)
        self.session.begin()

    def _open(self, recording: Path, before: list[str]) -> None:
        self.session.load(str(recording), self.session.config.model)
        self.session.commands = tuple(before)
        self.session.begin()

    def _config(self, robot: str) -> Config:
        """With a robot by name; that of the command line has its files with it."""
        own = self.session.config.robot
        return replace(self.session.config, robot=own if robot == own.name else RobotConfig(name=robot), model=None)


def _named(robot: RobotConfig) -> list[str]:
    """The words of a command line that name it."""
    source = "robot.file" if robot.name == "mjcf" else "robot.urdf"
    files = {source: robot.urdf, "robot.drives": robot.drives}
    return [f"robot={robot.name}", *(setting(k, f) for k, f in files.items() if f is not None)]


def _said(answers: Answers) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key in ("joints", "gains"):
        text = getattr(answers, key).strip().strip("[]")
        if text:
            found[key] = f"[{','.join(w.strip() for w in text.split(','))}]"
    if answers.unit:
        found["unit"] = answers.unit
    if answers.rate_hz is not None:
        found["rate_hz"] = answers.rate_hz
    return found


def options_of(answers: Answers) -> Options:
    """Raises ConfigError where a gain is no number."""
    from ee_dist.tasks.import_ import Options

    said = _said(answers)
    gains = None
    if "gains" in said:
        try:
            gains = [float(w) for w in said["gains"].strip("[]").split(",")]
        except ValueError:
            raise ConfigError(f"motor gains: expected numbers, not {answers.gains!r}") from None
    joints = said["joints"].strip("[]").split(",") if "joints" in said else None
    return Options(joints=joints, gains=gains, unit=said.get("unit"), rate_hz=said.get("rate_hz"))
