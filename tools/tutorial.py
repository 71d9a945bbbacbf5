"""Run the commands of docs/tutorial.md in an empty folder and put what they print into the page.

    python tools/tutorial.py            # some two minutes

A ``bash`` block that is followed by a ``text`` block is run and the text replaced; a ``yaml`` block shows the improved model.
The reports go to logs/tutorial, from where the site takes them.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "tutorial.md"
STEP = re.compile(r"```bash\n(?P<command>[^`]+)```\n\n```text\n(?P<output>[^`]*)```")
REPORTS = ROOT / "logs" / "tutorial"
MODEL = re.compile(r"```yaml\n[^`]*```")
COLUMNS = "80"


def run(command: str, folder: Path) -> str:
    """What a command prints, without its progress and times, which differ from run to run. Raises SystemExit where it fails."""
    words = [w.strip("'") for w in command.split()]
    settings = {**os.environ, "COLUMNS": COLUMNS, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, *words[1:]], cwd=folder, env=settings, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command.strip()}: {done.stderr.strip()}")
    return told(done.stdout)


def told(printed: str) -> str:
    """The part of an output that is the same in every run."""
    plain = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", printed)
    lines = [re.sub(r"^\d+ s\. (?=Digest)", "", line.rstrip()) for line in plain.splitlines()]
    return "\n".join(line for line in lines if not re.match(r" +\d+ s  ", line)).strip("\n")


def main() -> int:
    page = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for step in list(STEP.finditer(page)):
            print(step["command"].strip(), flush=True)
            shown = f"```bash\n{step['command']}```\n\n```text\n{run(step['command'], folder)}\n```"
            page = page.replace(step.group(0), shown)
        model = (folder / "logs" / "improve" / "model.yaml").read_text(encoding="utf-8").strip()
        page = MODEL.sub(lambda _: f"```yaml\n{model}\n```", page)
        REPORTS.mkdir(parents=True, exist_ok=True)
        for report in folder.glob("logs/*/report.html"):
            shutil.copy(report, REPORTS / f"{report.parent.name}.html")
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
