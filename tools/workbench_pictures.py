"""Pictures of the workbench at three widths, for looking at and for docs:

    python tools/workbench_pictures.py OUT measured=LOG [engine=mujoco ...]

Explains, adds the best, and takes each view at 1280, 900 and 400 pixels. Needs Chromium.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "workbench"))

from page_driver import Bench, Person

WIDTHS = (1280, 900, 400)
VIEWS = ("Compare", "Explain", "Add", "Watch", "Keep")


def main() -> None:
    out = Path(sys.argv[1]).absolute()
    out.mkdir(parents=True, exist_ok=True)
    arguments = [a if "=" not in a else _absolute(a) for a in sys.argv[2:]]
    with Bench(out, *arguments, "hydra.run.dir=bench", "overwrite=true") as bench, Person() as person:
        person.go(bench.address)
        person.waits_for("The model is off")
        person.open("Explain")
        person.click("What is missing?")
        person.wait("document.body.innerText.includes('Ranked, with 95 % intervals')", 600.0)
        person.click("Add and fit", "button")
        person.waits_for("s so far")
        person.wait("!document.body.innerText.includes('s so far')", 600.0)
        for width in WIDTHS:
            person.go(bench.address, width=width)
            for view in VIEWS:
                person.open(view)
                time.sleep(3.0)
                person.picture(out / f"workbench_{view.lower()}_{width}.png")
        print(*(sorted(p.name for p in out.glob("*.png"))), sep="\n")
        print("complaints of the console:", person.complaints() or "none")


def _absolute(argument: str) -> str:
    key, _, value = argument.partition("=")
    return f"{key}={Path(value).absolute()}" if key in ("measured", "model", "log") else argument


if __name__ == "__main__":
    main()
