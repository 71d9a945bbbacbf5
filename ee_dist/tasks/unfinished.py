"""What a run leaves for its resumption, in a folder ``unfinished`` of its own that goes when the run reaches its end.

Three things: the settings it was started with, what was simulated so far, and every trial that was made on hardware. A
resumed run goes through all its steps again, finds there what is known, and so ends with the digest of an undisturbed one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import yaml

from ee_dist.basics.files import write_whole
from ee_dist.basics.quoted import one_line, quoted, short
from ee_dist.basics.uncut import keeping, trial_on_hardware
from ee_dist.effects.plugins import text_of_plugin
from ee_dist.evaluation.installed import installed
from ee_dist.evaluation.jobs import Evaluator
from ee_dist.evaluation.journal import Journal, JournaledEvaluator
from ee_dist.recording.reader import read_logs
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.system import System
from ee_dist.robots.untrusted import UntrustedError, json_of, plain_of, text_of
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.folder import BEGUN, SETTINGS, UNFINISHED, held, shown
from ee_dist.tasks.summary import config_digest, config_yaml
from ee_dist.trials.hardware import Hardware
from ee_dist.trials.log import SensorLog

FOLDER, _RUN, _SIMULATED = UNFINISHED, BEGUN, "simulated.bin"
SO_FAR = "model.yaml"
"""The model that a search had reached when it was stopped, for those who cannot wait."""
_PACKAGES = ("ee_dist", "pybullet", "mujoco", "numpy", "numba")


class Unfinished:
    """The folder of one run. Nothing is in it until the run asks for an evaluator or tries hardware."""

    def __init__(self, out: Path, config: Config, options: Any) -> None:
        self.folder = out / FOLDER
        self.settings = config_yaml(config, options)
        self.digest = config_digest(config, options)
        self.plugins = {str(path): text_of_plugin(path) for path in config.plugins}
        self._journal: Journal | None = None

    def journal(self) -> Journal:
        """What was simulated so far, open for more."""
        if self._journal is None:
            self.begin()
            self._journal = Journal(self.folder / _SIMULATED)
        return self._journal

    def hardware(self, name: str, inner: Hardware, robot: System) -> Hardware:
        """``inner``, of which no trial is asked twice. ``robot`` as its recordings know it."""
        return _Remembered(self, name, inner, robot)

    def check(self) -> None:
        """Raises ConfigError where the run in the folder was started with other settings or versions."""
        try:
            found = json_of(text_of(self.folder / _RUN))
            digest, text, versions = str(found["digest"]), str(found["settings"]), dict(found["versions"])
            settings = plain_of(text)
            if not isinstance(settings, dict):
                raise TypeError("its settings are none")
            texts = dict(found.get("plugins", {}))
        except FileNotFoundError:
            return  # killed before it began
        except (OSError, UntrustedError, KeyError, TypeError, ValueError) as error:
            raise ConfigError(f"resume={shown(self.folder.parent)}: its {FOLDER}/{_RUN} is damaged ({error})") from None
        for name, theirs in versions.items():
            if name in _PACKAGES and installed().get(name) != theirs:
                raise ConfigError(
                    f"resume={shown(self.folder.parent)}: it was begun with {name} {one_line(str(theirs), 40)}, here is "
                    f"{installed().get(name)}: its results would be of two kinds; install that version to go on"
                )
        other = [path for path, text in self.plugins.items() if text not in texts.values()]
        if digest != self.digest and other and settings.get("plugins"):
            raise ConfigError(
                f"resume={shown(self.folder.parent)}: {short(other[0], 200)} is not as it was when that run began, and its "
                "results would be of two kinds; put the file back as it was, or leave out resume= and begin anew"
            )
        if digest != self.digest:
            changed = _changed(settings, yaml.safe_load(self.settings))
            raise ConfigError(
                f"resume={shown(self.folder.parent)}: the run there has other settings ({', '.join(changed[:4])}); "
                "give the same command as before, and resume="
            )

    def begin(self) -> None:
        self.folder.mkdir(exist_ok=True)
        if not (self.folder / _RUN).exists():
            content = {"digest": self.digest, "settings": self.settings, "versions": installed()}
            if self.plugins:
                content["plugins"] = self.plugins
            write_whole(self.folder / _RUN, json.dumps(content, indent=1))

    def forget(self) -> None:
        """Remove what was kept: only files of ours, by name."""
        self.close()
        for path in (*self.folder.glob("*.mcap"), *self.folder.glob("*.part"),
                     self.folder / _SIMULATED, self.folder / _RUN, self.folder / SO_FAR):  # fmt: skip
            path.unlink(missing_ok=True)
        with suppress(OSError):
            self.folder.rmdir()

    @property
    def empty(self) -> bool:
        """Whether there is nothing worth going on from."""
        known = self._journal is not None and bool(self._journal)
        return not known and self._journal is not None and not any(self.folder.glob("*.mcap"))

    def older_than(self, path: Path) -> bool:
        """Whether the run was begun before that file was written."""
        begun = self.folder / _RUN
        return begun.exists() and begun.stat().st_mtime_ns <= path.stat().st_mtime_ns

    def close(self) -> None:
        if self._journal is not None:
            self._journal.close()
            self._journal = None


class _Remembered:
    """Hardware whose trials are on the disk as soon as they are made; those that are there are not made again."""

    def __init__(self, run: Unfinished, name: str, inner: Hardware, robot: System) -> None:
        self.run, self.folder, self.name, self.inner, self.robot = run, run.folder, name, inner, robot
        self.count = 0
        knock = getattr(inner, "knock", None)
        # A run that is resumed may have made all its trials: then nobody needs to be there any more.
        if knock is not None and not any(self.folder.glob("*.mcap")):
            knock()

    def trial(self, driver: Any, steps: int) -> SensorLog:
        path = self.folder / f"{self.name}_{self.count:04d}.mcap"
        self.count += 1
        if path.exists():
            (record,) = read_logs(path)
            if record.driver.key != driver.key or len(record.log) > steps:
                raise ConfigError(f"{shown(path)}: the trial made there is another than the one that is due now")
            skip = getattr(self.inner, "skip", None)
            if skip is not None:
                skip()
            return record.log
        with trial_on_hardware:
            try:
                log = self.inner.trial(driver, steps)
                with keeping:
                    self._keep(path, driver, log)
                return log
            except BaseException:
                with keeping:
                    made = getattr(self.inner, "made", None)
                    if made is None:
                        self._keep_aborted(driver)
                    elif not path.exists():  # interrupted between its end and here
                        self._keep(path, driver, made)
                raise

    def _keep(self, path: Path, driver: Any, log: SensorLog) -> None:
        self.run.begin()
        with RunWriter(path, self.robot, {"task": "unfinished"}) as writer:
            writer.trial(TrialRecord(self.count - 1, self.name, HARDWARE, driver, log))

    def _keep_aborted(self, driver: Any) -> None:
        """What was measured in a trial that did not reach its end, beside the recording of the run: no resume removes it."""
        log = getattr(self.inner, "aborted", None)
        if log is None:
            return
        stem, number = f"aborted_{self.name}_{self.count - 1:04d}", 1
        while (path := self.folder.parent / f"{stem}_{number}.mcap").exists():
            number += 1
        with RunWriter(path, self.robot, {"task": "aborted"}) as writer:
            writer.trial(TrialRecord(self.count - 1, f"{self.name}, aborted", HARDWARE, driver, log))


_current: Unfinished | None = None
_off: dict[Path, str] = {}
"""By folder, how far the model that was reached there is from trials that took no part: of runs of this process alone."""


@contextmanager
def unfinished(out: Path, config: Config, options: Any, resume: bool) -> Iterator[None]:
    """The run in ``out`` may be resumed if it does not reach the end of this block. Raises ConfigError (see ``check``)."""
    global _current
    found = Unfinished(out, config, options)
    if resume:
        found.check()
    elif found.folder.is_dir():
        found.forget()  # of a run that is to be overwritten
    _current = found
    try:
        yield
        found.forget()
    except ConfigError:
        # A picture may fail after the summary was written: nothing is left to go on with.
        if finished(out, config, options) and found.older_than(out / "summary.json"):
            found.forget()
        raise
    finally:
        # What else lies there may be of this run (generations that the job before had in memory): then resume= starts it anew.
        if found.empty and set(held(out)) <= {SETTINGS, FOLDER}:
            found.forget()
        found.close()
        _current = None


def note_nothing() -> None:
    """From here on the run under way keeps nothing to go on from: it has no end to reach, or goes on after its results."""
    global _current
    _current = None


def remembered(name: str, inner: Hardware, robot: System) -> Hardware:
    """Hardware of the run under way, of which no trial is asked twice."""
    return inner if _current is None else _current.hardware(name, inner, robot)


def note_in(evaluator: Evaluator) -> None:
    """Let the evaluator of the run under way note what it finds, and know what was found before."""
    inner: Any = evaluator
    while inner is not None:
        if isinstance(inner, JournaledEvaluator):
            inner.journal = None if _current is None else _current.journal()
        inner = getattr(inner, "inner", None)


def keep_so_far(write: Callable[[Path], None], off: str = "") -> None:
    """Have ``write`` put the model that the search under way has reached where its run would go on from; ``off``: how far it is
    from trials that took no part, in words. A search that simulates nothing keeps nothing else; what has no end to reach keeps
    nothing at all."""
    if _current is not None:
        _current.begin()
        write(_current.folder / SO_FAR)
        _off[_current.folder.resolve()] = off


def so_far(out: Path) -> str:
    """The model that the search in a folder had reached when it was stopped, and how far off that is where this process knows;
    empty: none was kept."""
    path = out / FOLDER / SO_FAR
    if not path.exists():
        return ""
    off = _off.get(path.parent.resolve(), "")
    return f"{shown(path)}{off and f' ({off})'}"


def finished(out: Path, config: Config, options: Any) -> bool:
    """Whether a run of these very settings has reached its end in that folder."""
    try:
        summary = json_of(text_of(out / "summary.json", 2**28))
        return bool(summary["config_digest"] == config_digest(config, options))
    except (OSError, UntrustedError, KeyError, TypeError):
        return False


def goes_on(out: Path) -> bool:
    """Whether such a run would find there what was simulated or tried, rather than begin anew."""
    return (out / FOLDER / _SIMULATED).exists() or any((out / FOLDER).glob("*.mcap"))


def _changed(old: Any, new: Any, prefix: str = "") -> list[str]:
    """Which settings differ, as ``name=old``."""
    if isinstance(old, dict) and isinstance(new, dict):
        return [d for k in {**old, **new} for d in _changed(old.get(k), new.get(k), f"{prefix}{k}.")]
    return [] if old == new else [f"{short(prefix.rstrip('.'))}={quoted(old)}"]
