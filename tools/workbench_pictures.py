"""Pictures of the workbench, for looking at and for docs:

    python tools/workbench_pictures.py OUT measured=LOG [engine=mujoco ...]
    python tools/workbench_pictures.py OUT measured=LOG sheets=docs/figures
    python tools/workbench_pictures.py OUT measured=LOG tour=docs/figures

Explains, adds the best and fits it, and takes each view at 1280, 900 and 400 pixels, in light and in dark; with ``sheets`` all
views of a width side by side, too; with ``tour`` the six pictures of the README instead, in few colours so that they stay small.
Needs Chromium.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "workbench"))

from page_driver import Bench, Person

WIDTHS = (1280, 900, 400)
VIEWS = ("Compare", "Explain", "Add", "Watch", "Keep")
PATIENCE_S = 600.0
SETTLED_S = 3.0
NUMBER = "parseFloat(document.querySelector('.number').innerText)"
JUDGED = (
    "[...document.querySelectorAll('.entry')].some((e) => "
    "/fitted .*held out [^(]*[(](?!nothing)/.test(e.textContent) && !e.textContent.startsWith('by hand'))"
)
"""Whether the ladder has a step that was judged."""
COLOURS = 96
GAP, SHEET = 16, 1900
"""Pixels between the views of a sheet, and of a sheet from side to side at most."""
BY_HAND = 5
"""Strokes of a key by which the slider is moved for the picture of it."""


def main() -> None:
    out = Path(sys.argv[1]).absolute()
    out.mkdir(parents=True, exist_ok=True)
    words = [a for a in sys.argv[2:] if not a.startswith(("tour=", "sheets="))]
    tour, sheets = _folder("tour"), _folder("sheets")
    arguments = [a if "=" not in a else _absolute(a) for a in words]
    with Bench(out, *arguments, "hydra.run.dir=bench", "overwrite=true") as bench, Person() as person:
        person.go(bench.address)
        person.waits_for("The model is off")
        if tour is not None:
            _tour(person, tour)
        else:
            _all(bench, person, out)
            for width in WIDTHS if sheets else ():
                _sheet(out, width, sheets)
        print("complaints of the console:", person.complaints() or "none")


def _folder(key: str) -> Path | None:
    """That an argument of the command line names."""
    return next((Path(a.removeprefix(f"{key}=")).absolute() for a in sys.argv[2:] if a.startswith(f"{key}=")), None)


def _explained(person: Person) -> None:
    _searched(person, "What is missing?", "document.body.innerText.includes('Ranked, with 95 % intervals')")


def _fitted(person: Person) -> None:
    _searched(person, "Add and fit", JUDGED)


def _searched(person: Person, button: str, done: str) -> None:
    """A button of Explain, until what it began is done. On a busy machine a page may come up anew, and forget a click."""
    deadline = time.monotonic() + PATIENCE_S
    while not person.evaluate(done) and time.monotonic() < deadline:
        person.open("Explain")
        person.click(button, "button")
        time.sleep(SETTLED_S)
        person.wait("!document.body.innerText.includes('s so far')", PATIENCE_S)
        time.sleep(1.0)


def _all(bench: Bench, person: Person, out: Path) -> None:
    _explained(person)
    _fitted(person)
    person.open("Keep")
    person.click("Keep the model")
    person.wait("document.body.innerText.includes('task=compare says')", PATIENCE_S)
    for dark in (False, True):
        for width in WIDTHS:
            person.go(bench.address, width=width, dark=dark)
            for view in VIEWS:
                person.open(view)
                time.sleep(SETTLED_S)
                person.evaluate("scrollTo(0, 0)")
                over = person.evaluate("document.documentElement.scrollWidth - innerWidth")
                person.evaluate("scrollTo(0, 0)")
                name = f"{view.lower()}_{width}{'_dark' if dark else ''}.png"
                person.picture(out / name, whole=True)
                print(name, f"wider than the window by {over} px" if over > 0 else "")


def _sheet(out: Path, width: int, folder: Path) -> None:
    """All views of a width, half as large, as many side by side as have room."""
    pictures = []
    for view in VIEWS:
        with Image.open(out / f"{view.lower()}_{width}.png") as picture:
            pictures.append(picture.convert("RGB").reduce(2))
    step = width // 2 + GAP
    count = min(len(VIEWS), (SHEET + GAP) // step)
    lines = [pictures[k : k + count] for k in range(0, len(pictures), count)]
    tall = [max(p.height for p in line) + GAP for line in lines]
    sheet = Image.new("RGB", (step * count - GAP, sum(tall) - GAP), "#ffffff")
    for k, line in enumerate(lines):
        for j, picture in enumerate(line):
            sheet.paste(picture, (j * step, sum(tall[:k])))
    _saved(sheet.quantize(dither=Image.Dither.NONE), folder / f"workbench_at_{width}.png")


def _tour(person: Person, folder: Path) -> None:
    """What a person does in the first minute."""
    folder.mkdir(parents=True, exist_ok=True)
    _shot(person, folder, "1_compare")
    _explained(person)
    _shot(person, folder, "2_explain")
    person.click("Add", "main button")
    person.waits_for("Effects in the model")
    error = person.wait(NUMBER)
    person.evaluate("document.querySelector('.q-slider [tabindex]').focus()")
    for _ in range(BY_HAND):
        person.key("PageDown", 34)
    person.wait(f"{NUMBER} > 1.05 * {error}")
    _shot(person, folder, "3_slide")
    person.click("Undo", "button")
    person.wait(f"{NUMBER} < 1.01 * {error}")
    _fitted(person)
    person.open("Add")
    _shot(person, folder, "4_fitted")
    person.open("Watch")
    _shot(person, folder, "5_watch")
    person.open("Keep")
    person.click("Keep the model")
    person.wait("document.body.innerText.includes('task=compare says')", PATIENCE_S)
    _shot(person, folder, "6_keep")


def _shot(person: Person, folder: Path, name: str) -> None:
    time.sleep(SETTLED_S)
    path = folder / f"workbench_{name}.png"
    person.picture(path)
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    _saved(small, path)


def _saved(picture: Image.Image, path: Path) -> None:
    picture.save(path, optimize=True)
    print(path.name, f"{path.stat().st_size / 1e3:.0f} kB")


def _absolute(argument: str) -> str:
    key, _, value = argument.partition("=")
    return f"{key}={Path(value).absolute()}" if key in ("measured", "model", "log") else argument


if __name__ == "__main__":
    main()
