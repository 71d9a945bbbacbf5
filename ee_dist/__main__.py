"""``python -m ee_dist``: compose the configuration, run one task; a user's mistake is one line and a status that is not 0."""

from __future__ import annotations

import sys

from ee_dist import beginning, leaving

if __name__ == "__main__":
    leaving.arm(unwinds=False)  # what is imported below takes a second or two, and Ctrl-C may come in it
    beginning.announce(sys.argv[1:], sys.stderr)
    beginning.load()

import errno
import multiprocessing
import os
from pathlib import Path
from typing import Any, NoReturn

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from ee_dist.tasks.compose import check_flags, check_sweep, check_used, config_folder, handling, plain, quoted, settings
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.errors import (
    UNREAD,
    USER_ERRORS,
    RayGoneError,
    RayLostError,
    abandon_evaluators,
    defect,
    hydra_message,
    remove_orphans,
    unasked_end,
    unforeseen,
    when_lost,
)
from ee_dist.tasks.folder import (
    NO_NAME,
    SETTINGS,
    Refused,
    can_go_on,
    claimed,
    forget_sweep,
    free_name,
    held,
    kept,
    remove_made,
    settings_of,
    shown,
)
from ee_dist.tasks.help import answer
from ee_dist.tasks.sweep import Jobs
from ee_dist.tasks.unfinished import finished, goes_on, so_far, unfinished

MISTAKE, DEFECT = 2, 1
_jobs = Jobs()
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def run(composed: DictConfig) -> None:
    """One job. A user's mistake ends it here: Hydra would add lines of its own."""
    hydra_settings: Any = HydraConfig.get()
    out = Path(hydra_settings.runtime.output_dir)
    when_lost(lambda why: _lost(why, out))
    remove_orphans()  # here, since a run that was finished already starts nothing that would
    try:
        out = _folder(hydra_settings)
        config, module, options = settings(composed)
        beginning.loaded()
        check_used(list(hydra_settings.overrides.task), str(composed.task.name))
        how = handling(composed)
        if how.resume is not None and resumed(out, config, options, how.overwrite):
            _jobs.well += 1
            return
        free = how.overwrite or how.resume is not None
        with (
            claimed(out, settings_of(composed, hydra_settings), free),
            unfinished(out, config, options, how.resume is not None),
        ):
            module.run(config, options, out)
        _jobs.well += 1
    except (RayLostError, RayGoneError) as error:
        remove_made()
        _lost(str(error), out)
    except USER_ERRORS as error:
        remove_made()
        onward = "" if isinstance(error, ConfigError) else _how_to_go_on(out)
        _broken(f"{error}{onward}", out)
    except OmegaConfBaseException as error:
        remove_made()
        _broken(plain(error), out)
    except OSError as error:
        remove_made()
        sys.exit(_complain(_unwritten(error) + _how_to_go_on(out)))
    except (SystemExit, MemoryError) as error:
        remove_made()
        sys.exit(_complain(unasked_end(error)))
    except Exception as error:
        if (left := leaving.asked()) is not None:
            _stopped(left, out)
        _broken(defect(error, out), out, DEFECT)
    except KeyboardInterrupt as stop:
        _stopped(stop, out)


def _broken(text: str, out: Path, status: int = MISTAKE) -> None:
    """One line of what was wrong with a run; the end of it, and of all, unless others of a sweep may do better."""
    _complain(text, status)
    alone = HydraConfig.get().mode != RunMode.MULTIRUN or multiprocessing.parent_process() is not None
    if alone or not _jobs.goes_on:
        sys.exit(status)
    _jobs.folder = _whole(out)
    _jobs.broken.append((out, status))


def _stopped(stop: KeyboardInterrupt, out: Path) -> NoReturn:
    remove_made()
    if multiprocessing.parent_process() is not None:
        os._exit(leaving.told(stop).status)  # one job of several side by side: the sweep says the line
    _leave(stop, out)


def _lost(why: str, out: Path) -> NoReturn:
    """Without Ray; from another thread, too, where the main one does not come back to hear of it."""
    abandon_evaluators()
    leaving.leave(f"{why}; {_what_is_kept(out)}", MISTAKE)


def _what_is_kept(out: Path) -> str:
    return kept(out) + (_how_to_go_on(out) or _how_to_begin_anew(out))


def _how_to_begin_anew(out: Path) -> str:
    """Of a run that left files, none of which it could go on from: the same command alone would be refused."""
    if set(held(out)) <= {SETTINGS}:
        return ""
    whole = _whole(out)
    where = "" if whole == out else f", resume={shown(whole)}"
    return f"; the same command{where} and overwrite=true begins it anew"


def _how_to_go_on(out: Path) -> str:
    if not can_go_on(out):
        return ""
    reached, where = so_far(out), f"resume={shown(_whole(out))}"
    model = f"; the model so far: {reached}" if reached else ""
    if not goes_on(out):
        return f"; the same command and {where} begins its search anew{model}"
    return f"; go on with the same command and {where}{model}"


def _whole(out: Path) -> Path:
    """What is to be resumed: the run, or the sweep that it is a job of."""
    settings: Any = HydraConfig.get() if HydraConfig.initialized() else None
    return Path(settings.sweep.dir) if settings is not None and settings.mode == RunMode.MULTIRUN else out


def _leave(stop: KeyboardInterrupt, out: Path | None = None) -> NoReturn:
    """One line, and the end: 130 after Ctrl-C, 143 where a run was asked to end."""
    abandon_evaluators()
    left = leaving.told(stop)
    text = _what_is_kept(out) if out else "nothing was begun"
    leaving.leave(f"stopped ({left.why}); {text}", left.status)


def resumed(out: Path, config: Any, options: Any, overwrite: bool) -> bool:
    """Whether there is nothing to do, since the run there is finished. Raises ConfigError where no run of ours was begun."""
    if finished(out, config, options):
        print(f"{shown(out)}: finished already", flush=True)
        return True
    inside = set(held(out)) - {SETTINGS}
    if "summary.json" in inside and not can_go_on(out) and not overwrite:
        texts = f", or other texts of {', '.join(config.plugins)}" if config.plugins else ""
        raise ConfigError(f"resume={shown(out)}: the run there is finished, and had other settings{texts}")
    if HydraConfig.get().mode != RunMode.MULTIRUN and not (out / SETTINGS).is_dir():
        raise ConfigError(f"resume={shown(out)}: no run was begun there; name the folder of a run that was stopped")
    if inside and not can_go_on(out) and not overwrite:
        raise ConfigError(f"resume={shown(out)}: holds nothing to go on from; overwrite=true starts the run there anew")
    return False


def _folder(hydra_settings: Any) -> Path:
    """Where this job writes. Raises ConfigError for a folder without a name."""
    out = Path(hydra_settings.runtime.output_dir)
    if hydra_settings.mode == RunMode.MULTIRUN:
        return out
    if not str(hydra_settings.run.dir).strip():
        raise ConfigError(NO_NAME.format(key="hydra.run.dir"))
    named = any(str(o).lstrip("+").startswith("hydra.run.dir=") for o in hydra_settings.overrides.hydra)
    return out if named else free_name(out)


def _unwritten(error: OSError) -> str:
    if isinstance(error, BrokenPipeError):
        _print_no_more()
        return UNREAD
    where = shown(Path(error.filename)) if error.filename else "the output folder"
    room = "make room on the disk, or " if error.errno in FULL else ""
    settings: Any = HydraConfig.get() if HydraConfig.initialized() else None
    key = "hydra.sweep.dir" if settings is not None and settings.mode == RunMode.MULTIRUN else "hydra.run.dir"
    return f"{where}: {error.strerror or error}; {room}choose a folder with {key}=FOLDER"


def main() -> int:
    # Hydra's own report of an error is several lines and a hint for programmers; ours is one.
    os.environ["HYDRA_FULL_ERROR"] = "1"
    # Rerun's own log would add lines to a complaint that is made in one.
    os.environ.setdefault("RUST_LOG", "off")
    leaving.arm()
    _jobs.well, _jobs.broken = 0, []
    sys.argv[1:] = quoted(sys.argv[1:])
    try:
        told = answer(sys.argv[1:])
        if told is not None:
            return _answered(told)
        check_flags(sys.argv[1:])
        check_sweep(sys.argv[1:])
        folder = config_folder()
        hydra.main(version_base="1.3", config_path=str(folder), config_name="config")(run)()
        if _jobs.broken:
            return _complain(_jobs.account(), _jobs.status)
    except (*USER_ERRORS, RayGoneError, Refused) as error:
        return _complain(str(error))
    except HydraException as error:
        return _complain(hydra_message(error))
    except OmegaConfBaseException as error:
        return _complain(plain(error))
    except RecursionError:
        return _complain("the settings are nested too deep")
    except OSError as error:
        return _complain(_unwritten(error))
    except KeyboardInterrupt as stop:
        _leave(stop)
    except Exception as error:  # of Hydra, or of what it was told to launch with
        return _complain(unforeseen(error), DEFECT)
    finally:
        leaving.disarm()
    return 0


def _answered(text: str) -> int:
    """Prints what was asked for; whoever reads only its beginning (``| head``) made no mistake."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        _print_no_more()
    return 0


def _print_no_more() -> None:
    """What is still to be printed goes nowhere: at the end of a process Python would try once more, and complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(text: str, status: int = MISTAKE) -> int:
    forget_sweep()
    print(leaving.line(text), file=sys.stderr)
    return status


def _end(status: int) -> None:
    """Ends the process; at once where rerun would wait for ever for a file that it could not write."""
    stream = sys.modules.get("ee_dist.viewing.stream")
    if stream is not None and stream.GIVEN_UP:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


if __name__ == "__main__":
    _end(main())
