"""A job of the program without a process and without composing its settings anew: cheap enough for hundreds of mistakes.

The settings that a choice of groups gives (``task=``, ``engine=``, ...) are composed by Hydra once; the rest of a command line is
put into them by Hydra's own code, and from there on it is the program as it is.
"""

from __future__ import annotations

import contextlib
import copy
import functools
import io
import sys
from collections.abc import Iterator
from pathlib import Path

from hydra import compose, initialize_config_dir
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf, open_dict

from ee_dist import __main__ as program
from ee_dist.tasks.compose import check_flags, config_folder, quoted
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.errors import hydra_message

GROUPS = {p.name for p in config_folder().iterdir() if p.is_dir()}


@functools.cache
def composed(groups: tuple[str, ...]) -> DictConfig:
    with initialize_config_dir(str(config_folder()), version_base="1.3"):
        return compose("config", overrides=[*groups, "hydra.mode=RUN"], return_hydra_config=True)


def run(*arguments: str) -> tuple[int, str]:
    """Status, and what it said on the error stream."""
    with listening() as said:
        try:
            status = _run(quoted(list(arguments)))
        except SystemExit as stop:
            status = int(stop.code or 0)
        finally:
            forget()
    return status, said.getvalue()


def prepared(arguments: list[str]) -> DictConfig:
    """What Hydra composes of a command line. Raises ConfigError and HydraException."""
    check_flags(arguments)
    overrides = OverridesParser.create().parse_overrides(arguments)
    ConfigLoaderImpl.validate_sweep_overrides_legal(overrides, RunMode.RUN, from_shell=True)
    chosen = [o.input_line for o in overrides if o.key_or_group in GROUPS and not isinstance(o.value(), dict)]
    settings = copy.deepcopy(composed(tuple(chosen)))
    rest = [o for o in overrides if o.input_line not in chosen]
    with open_dict(settings):
        settings.hydra.overrides.task = [o.input_line for o in overrides if not o.key_or_group.startswith("hydra")]
        settings.hydra.overrides.hydra = [o.input_line for o in overrides if o.key_or_group.startswith("hydra")]
    OmegaConf.set_struct(settings, True)
    ConfigLoaderImpl._apply_overrides_to_config(rest, settings)
    with open_dict(settings):
        settings.hydra.mode = RunMode.RUN
        settings.hydra.runtime.output_dir = str(Path(str(settings.hydra.run.dir)).absolute())
    return settings


def without_hydra(settings: DictConfig) -> DictConfig:
    """The settings as a job gets them."""
    HydraConfig.instance().set_config(settings)
    with open_dict(settings):
        del settings["hydra"]
    return settings


def forget() -> None:
    HydraConfig.instance().cfg = None


def _run(arguments: list[str]) -> int:
    try:
        settings = prepared(arguments)
    except ConfigError as error:
        return program._complain(str(error))
    except HydraException as error:
        return program._complain(hydra_message(error))
    program.run(without_hydra(settings))
    return 0


@contextlib.contextmanager
def listening() -> Iterator[io.StringIO]:
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        yield said
    sys.stderr.flush()
