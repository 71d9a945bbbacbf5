"""Pictures of the reports and rerun scenes of four robots, narrow and wide, light and dark: python tools/figures.py OUT

Each robot is measured with something hidden, compared, explained and improved. Runs that are there already in OUT are
looked at as they are. ``--docs`` puts the best pictures into docs/figures, with those of the loop and of the workbench, which
it runs too: all pictures of reports, scenes and pages that the documentation shows. Ends with status 1 if a page or a view
complains, a page asks for anything outside or is wider than its window, or a scene cannot be shown. Some ten minutes on two
cores, and with ``--docs`` as many more.
"""

from __future__ import annotations

import argparse
import io
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

from PIL import Image

from ee_dist.viewing.browser import BrowserError, HeadlessBrowser
from ee_dist.viewing.headless import ViewerError
from ee_dist.viewing.screenshot import take_pictures

Shot = tuple[str, bytes, Sequence[str]]
"""Name of a picture, the PNG, and what was wrong with what it shows."""

ROOT = Path(__file__).resolve().parent.parent
TWO = "task.excitations=['multisine:seconds=2,amplitude=0.3,seed=1','steps:seconds=2,amplitude=0.3,seed=2']"
STORIES = {
    "quadruped": ("+hidden=random", "seed=5"),
    "arm": (
        "robot=urdf",
        f"robot.drives={ROOT / 'docs' / 'examples' / 'arm.yaml'}",
        "+hidden=[{effect: coulomb_friction, target: turn, torque_nm: 0.3}]",
        TWO,
    ),
    "stage": ("robot=linear_stage", "+hidden=[{effect: coulomb_friction, target: carriage, torque_nm: 20}]", TWO),
    "pendulum": ("robot=servo_pendulum", "+hidden=[{effect: load_friction, target: servo, share: 0.3}]", TWO),
}
VERBS = {"compare": (), "explain": (), "improve": ("effect=auto",)}
WIDTHS = (1280, 400)
TALL = 840
IN_DOCS = {
    "quadruped_explain_1280_light.png": "report_explain.png",
    "quadruped_improve_1280_dark.png": "report_dark.png",
}
DOCS = ROOT / "docs" / "figures"
COLOURS = 128
"""Of a picture in docs: few, so that it stays small."""
LOOP, LOOP_AT_S, LOOP_SIZE = "+scenario=8", 13.0, (1600, 1000)
"""The run whose scene is shown, a moment at which robot and prediction have parted, and the window."""
BENCH = ("task.excitations=['multisine:seconds=4,amplitude=0.5,seed=1']", "task.noise=0.002")
"""The pendulum of the minute on the workbench: one calm record."""
MARKS = (
    "[...document.querySelectorAll('section')].find((s) => s.querySelector('h2')?.textContent === "
    "'Residual against what the joint did')"
)
FIRST = "document.querySelector('.js-plotly-plot')"
"""Parts of pages, as their scripts find them: the section of the marks, and the first chart."""


def told(folder: Path, *words: str, usual: Sequence[str] = ("engine=mujoco",)) -> None:
    """Run a command of ours in a folder, whose paths so are short in what is shown. Raises SystemExit where it fails."""
    settings = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "ee_dist", *words, *usual]
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(command, cwd=folder, env=settings, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(words)}: {done.stderr.strip()}")


def story(name: str, out: Path) -> list[Path]:
    """The folders of one robot's runs, the trial first; those that are there already stay."""
    own = out / name
    folders = {verb: own / "logs" / verb for verb in ("trial", *VERBS)}
    if not (folders["trial"] / "trial.mcap").is_file():
        told(own, "task=trial", *STORIES[name], "hydra.run.dir=logs/trial")
    for verb, more in VERBS.items():
        if not (folders[verb] / "report.html").is_file():
            told(own, f"task={verb}", "measured=logs/trial", *more, f"hydra.run.dir=logs/{verb}")
    return list(folders.values())


def pages(window: HeadlessBrowser, folder: Path) -> Iterator[Shot]:
    """A report narrow and wide, light and dark."""
    for width, dark in product(WIDTHS, (False, True)):
        name = f"{folder.parents[1].name}_{folder.name}_{width}_{'dark' if dark else 'light'}.png"
        seen = window.look(folder / "report.html", width, dark=dark, height=TALL)
        wider = [f"{seen.overflow} pixels wider than the window"] if seen.overflow else []
        yield name, seen.png, [*seen.complaints, *(f"asks for {a}" for a in seen.asked), *wider]


def scene(folder: Path) -> Iterator[Shot]:
    """A rerun recording narrow and wide, as its own viewer shows it: that is dark."""
    (recording,) = folder.glob("*.rrd")
    for width in WIDTHS:
        name = f"{folder.parents[1].name}_{folder.name}_{width}_scene.png"
        try:
            (seen,) = take_pictures(recording, [0.0], size=(width, TALL))
        except ViewerError as error:
            yield name, b"", [str(error)]
        else:
            yield name, seen.png, seen.reports


def into_docs(name: str, png: bytes) -> None:
    """A picture in few colours."""
    with Image.open(io.BytesIO(png)) as picture:
        picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(DOCS / name, optimize=True)
    print(f"docs/figures/{name}", f"{(DOCS / name).stat().st_size / 1e3:.0f} kB", flush=True)


def part(window: HeadlessBrowser, page: Path, element: str) -> bytes:
    """The part of a page that an expression of its script finds."""
    seen = window.look(page, WIDTHS[0], height=TALL, whole=True)
    left, top, width, height = window.evaluate(
        f"(() => {{ const box = ({element}).getBoundingClientRect(); "
        "return [box.x, box.y + scrollY, box.width, box.height]; })()"
    )
    with Image.open(io.BytesIO(seen.png)) as whole:
        out = io.BytesIO()
        whole.crop((int(left), int(top), int(left + width), int(top + height))).save(out, "png")
    return out.getvalue()


def study(window: HeadlessBrowser, out: Path) -> None:
    """The distances of the study that is kept in docs."""
    runs, folder = ROOT / "docs" / "study_runs.json", out / "study"
    if not (folder / "logs" / "study" / "report.html").is_file():
        told(folder, "task=study", f"task.earlier=[{runs}]", "hydra.run.dir=logs/study", usual=())
    into_docs("study.png", part(window, folder / "logs" / "study" / "report.html", FIRST))


def shown_in_docs(window: HeadlessBrowser, out: Path) -> int:
    """The pictures in docs that are no first screens: the mark of an effect, a study, the scene of the loop, a minute on the
    workbench."""
    study(window, out)
    into_docs("report_mark.png", part(window, story("quadruped", out)[-1] / "report.html", MARKS))
    loop = out / "loop" / "logs" / "run"
    if not (loop / "recovery.rrd").is_file():
        told(out / "loop", LOOP, "hydra.run.dir=logs/run", usual=())
    (seen,) = take_pictures(loop / "recovery.rrd", [LOOP_AT_S], size=LOOP_SIZE)
    into_docs("run.png", seen.png)
    trial = out / "workbench" / "logs" / "trial"
    if not (trial / "trial.mcap").is_file():
        hidden = next(w for w in STORIES["pendulum"] if w.startswith("+hidden"))
        told(out / "workbench", "task=trial", "robot=servo_pendulum", hidden, *BENCH, "hydra.run.dir=logs/trial")
    tour = [sys.executable, str(ROOT / "tools" / "workbench_pictures.py"), str(out / "workbench")]
    log, settings = f"measured={trial}", {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run([*tour, log, "engine=mujoco", f"tour={DOCS}"], env=settings, check=False).returncode


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
                for folder in story(name, options.out.resolve()):
                    report = pages(window, folder) if (folder / "report.html").is_file() else ()
                    for label, png, wrong in (*report, *scene(folder)):
                        if png:
                            (options.out / label).write_bytes(png)
                        print(label, *wrong, sep="\n  ", flush=True)
                        faults += len(wrong)
                        if options.docs and label in IN_DOCS:
                            into_docs(IN_DOCS[label], png)
            faults += shown_in_docs(window, options.out.resolve()) if options.docs else 0
    except (BrowserError, ViewerError) as error:
        print(f"no pictures: {error}", file=sys.stderr)
        return 1
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
