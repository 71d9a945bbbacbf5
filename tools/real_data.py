"""Public data sets through the product: import, the ladder of missing effects, tables beside what was published.

    python tools/real_data.py emps  --data PATH/emps   [--out DIR]
    python tools/real_data.py ur10e --data logs/ur10e
    python tools/real_data.py pendulum --data logs/double_pendulum
    python tools/real_data.py xl330 --data PATH/xl330  [--out DIR] [--hold 100,400,800] [--quick]

emps: a linear stage (Janot, Gautier, Brunot 2019), 20 s of one core. xl330: a pendulum on a servo (Duclusaud et al.,
ICRA 2025), some minutes for each gain held out. ur10e: an arm without and with a payload, from what the commands of
docs/real_data.md wrote into one folder; seconds. pendulum: two links under
torque control, from its import; a minute or two. All print their tables and write them, with the models, into DIR.
The data are not part of this project; docs/real_data.md says where they come from and discusses the results.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from real_emps import run as run_emps
from real_pendulum import run as run_pendulum
from real_tables import Page
from real_ur10e import run as run_ur10e
from real_xl330 import run as run_xl330


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("which", choices=("emps", "pendulum", "ur10e", "xl330"))
    parser.add_argument("--data", required=True, type=Path, help="the file or folder of the data set")
    parser.add_argument("--out", type=Path, default=None, help="folder for tables and models (logs/real_data/<which>)")
    parser.add_argument("--hold", default="100,400,800", help="xl330: gains to hold out, one after the other")
    parser.add_argument("--quick", action="store_true", help="xl330: a tenth of the search, to see that all works")
    args = parser.parse_args()
    out = args.out or Path("logs") / "real_data" / args.which
    out.mkdir(parents=True, exist_ok=True)
    command = " ".join(
        ["python tools/real_data.py", args.which, "--data", "PATH", *(["--quick"] if args.quick else [])]
    )
    page = Page(out / "tables.md", f"made by: {command}")
    try:
        if args.which == "emps":
            run_emps(args.data, out, page)
        elif args.which == "pendulum":
            run_pendulum(args.data, page)
        elif args.which == "ur10e":
            run_ur10e(args.data, page)
        else:
            run_xl330(args.data, out, page, [int(k) for k in args.hold.split(",")], args.quick)
    except ValueError as error:
        print(f"real_data: {error}", file=sys.stderr)
        return 2
    page.write()
    return 0


if __name__ == "__main__":
    sys.exit(main())
