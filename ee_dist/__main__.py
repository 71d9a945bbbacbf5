"""``python -m ee_dist``: compose the configuration, run one task; a user's mistake is one line and a status that is not 0."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from ee_dist.tasks.compose import config_folder, handling, plain, quoted, settings
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.errors import USER_ERRORS, hydra_message
from ee_dist.tasks.folder import NO_NAME, Refused, claimed, free_name, remove_made, settings_of

MISTAKE = 2


def run(composed: DictConfig) -> None:
    """One job. A user's mistake ends it here: Hydra would add lines of its own."""
    hydra_settings: Any = HydraConfig.get()
    try:
        out = _folder(hydra_settings)
        config, module, options = settings(composed)
        with claimed(out, settings_of(composed, hydra_settings), handling(composed).overwrite):
            module.run(config, options, out)
    except USER_ERRORS as error:
        remove_made()
        sys.exit(_complain(str(error)))
    except OSError as error:
        remove_made()
        sys.exit(_complain(_unwritten(error)))


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
    where = error.filename or "the output folder"
    return f"{where}: {error.strerror or error}; choose a folder with hydra.run.dir=FOLDER"


def main() -> int:
    # Hydra's own report of an error is several lines and a hint for programmers; ours is one.
    os.environ["HYDRA_FULL_ERROR"] = "1"
    # Rerun's own log would add lines to a complaint that is made in one.
    os.environ.setdefault("RUST_LOG", "off")
    sys.argv[1:] = quoted(sys.argv[1:])
    try:
        folder = config_folder()
        hydra.main(version_base="1.3", config_path=str(folder), config_name="config")(run)()
    except (*USER_ERRORS, Refused) as error:
        return _complain(str(error))
    except HydraException as error:
        return _complain(hydra_message(error))
    except OmegaConfBaseException as error:
        return _complain(plain(error))
    except OSError as error:
        return _complain(_unwritten(error))
    except KeyboardInterrupt:
        return _complain("stopped; what was recorded so far is kept")
    return 0


def _complain(text: str) -> int:
    print(f"ee_dist: {' '.join(text.split())}", file=sys.stderr)
    return MISTAKE


if __name__ == "__main__":
    sys.exit(main())
