"""Pictures of the reports of four robots, narrow and wide, light and dark: python tools/figures.py OUT

Each robot is measured with something hidden, compared, explained and improved. Reports that are there already in OUT are
looked at as they are; ``--docs`` puts the best pictures into docs/figures. Ends with status 1 if a page complains, asks for
anything outside, or is wider than its window. Some ten minutes on two cores.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

from ee_dist.viewing.browser import BrowserError, HeadlessBrowser

ROOT = Path(__file__).resolve().parent.parent
STORIES = {
    "quadruped": ("+hidden=random", "seed=5"),
    "arm": ("robot=urdf", f"robot.drives={ROOT / 'docs' / 'examples' / 'arm.yaml'}", "+hidden=random", "seed=3"),
    "stage": ("robot=linear_stage", "+hidden=random", "seed=1"),
    "pendulum": ("robot=servo_pendulum", "+hidden=[{effect: load_friction, target: servo, share: 0.3}]"),
}
VERBS = {"compare": (), "explain": (), "improve": ("effect=auto",)}
WIDTHS = (1280, 400)
IN_DOCS = {
    ("quadruped", "explain", 1280, False): "report_explain.png",
    ("quadruped", "improve", 1280, True): "report_dark.png",
}
MOST_BYTES = 200_000


def told(*words: str) -> None:
    """Run a command of ours. Raises SystemExit where it fails."""
    settings = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "ee_dist", *words, "engine=mujoco", "evaluator=serial"]
    done = subprocess.run(command, env=settings, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(words)}: {done.stderr.strip()}")


def story(name: str, out: Path) -> list[Path]:
    """The reports of one robot; those that are there already stay."""
    trial = out / name / "trial"
    if not (trial / "trial.mcap").is_file():
        told("task=trial", *STORIES[name], f"hydra.run.dir={trial}")
    reports = []
    for verb, more in VERBS.items():
        folder = out / name / verb
        if not (folder / "report.html").is_file():
            told(f"task={verb}", f"measured={trial}", "task.rerun=false", *more, f"hydra.run.dir={folder}")
        reports.append(folder / "report.html")
    return reports


def main(arguments: list[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path, help="where runs and pictures go")
    parser.add_argument(
        "--only", nargs="+", choices=STORIES, default=list(STORIES), metavar="ROBOT", help="of %(choices)s"
    )
    parser.add_argument("--docs", action="store_true", help="put the best into docs/figures")
    options = parser.parse_args(arguments)
    faults = 0
    try:
        with HeadlessBrowser() as window:
            for name in options.only:
                for report in story(name, options.out.resolve()):
                    verb = report.parent.name
                    for width, dark in ((w, d) for w in WIDTHS for d in (False, True)):
                        label = f"{name}_{verb}_{width}_{'dark' if dark else 'light'}.png"
                        seen = window.look(report, width, dark=dark, height=840)
                        (options.out / label).write_bytes(seen.png)
                        wider = [f"{seen.overflow} pixels wider than the window"] if seen.overflow else []
                        wrong = [*seen.complaints, *(f"asks for {a}" for a in seen.asked), *wider]
                        print(label, *wrong, sep="\n  ", flush=True)
                        faults += len(wrong)
                        shown = IN_DOCS.get((name, verb, width, dark))
                        if options.docs and shown and len(seen.png) < MOST_BYTES:
                            (ROOT / "docs" / "figures" / shown).write_bytes(seen.png)
    except BrowserError as error:
        print(f"no pictures: {error}", file=sys.stderr)
        return 1
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
