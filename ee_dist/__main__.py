"""``python -m ee_dist``: compose the configuration, run one task; a user's mistake is one line and a status that is not 0."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from ee_dist.tasks.compose import config_folder, plain, quoted, settings
from ee_dist.tasks.errors import USER_ERRORS, hydra_message
from ee_dist.tasks.help import answer

MISTAKE = 2


def run(composed: DictConfig) -> None:
    """One job. A user's mistake ends it here: Hydra would add lines of its own."""
    out = Path(HydraConfig.get().runtime.output_dir)
    try:
        config, module, options = settings(composed)
        module.run(config, options, out)
    except USER_ERRORS as error:
        _tidy(out)
        sys.exit(_complain(str(error)))


def _tidy(out: Path) -> None:
    """Remove a job's folder if nothing but the settings got into it."""
    if out.is_dir() and {p.name for p in out.iterdir()} <= {"config"}:
        shutil.rmtree(out)


def main() -> int:
    # Hydra's own report of an error is several lines and a hint for programmers; ours is one.
    os.environ["HYDRA_FULL_ERROR"] = "1"
    sys.argv[1:] = quoted(sys.argv[1:])
    try:
        told = answer(sys.argv[1:])
        if told is not None:
            print(told)
            return 0
        folder = config_folder()
        hydra.main(version_base="1.3", config_path=str(folder), config_name="config")(run)()
    except USER_ERRORS as error:
        return _complain(str(error))
    except HydraException as error:
        return _complain(hydra_message(error))
    except OmegaConfBaseException as error:
        return _complain(plain(error))
    except OSError as error:
        where = error.filename or "the output folder"
        return _complain(f"{where}: {error.strerror or error}; choose a folder with hydra.run.dir=FOLDER")
    except KeyboardInterrupt:
        return _complain("stopped; what was recorded so far is kept")
    return 0


def _complain(text: str) -> int:
    print(f"ee_dist: {' '.join(text.split())}", file=sys.stderr)
    return MISTAKE


if __name__ == "__main__":
    sys.exit(main())
