"""Picture of a rerun recording without a screen: python tools/screenshot.py RUN.rrd OUT.png --time 12.5

Several times give several files (OUT_12.5.png, ...). Prints what the views report, and ends with status 1 if any does.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ee_dist.viewing.headless import ViewerError
from ee_dist.viewing.screenshot import SIZE, take_pictures


def main(arguments: list[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rrd", type=Path, help="the recording")
    parser.add_argument("png", type=Path, help="where the picture goes")
    parser.add_argument("--time", type=float, nargs="+", default=[0.0], metavar="S", help="seconds on the timeline")
    parser.add_argument("--view", help="name of one view; without it the whole window")
    parser.add_argument("--size", default="{}x{}".format(*SIZE), metavar="WxH", help="of the window (%(default)s)")
    options = parser.parse_args(arguments)
    try:
        width, height = (int(n) for n in options.size.split("x"))
        pictures = take_pictures(options.rrd, options.time, size=(width, height), view=options.view)
    except ValueError:
        parser.error(f"--size is WIDTHxHEIGHT, such as 1600x1000, not {options.size}")
    except ViewerError as error:
        print(f"no picture: {error}", file=sys.stderr)
        return 1
    for picture in pictures:
        name = options.png.stem if len(pictures) == 1 else f"{options.png.stem}_{picture.time_s:g}"
        target = options.png.with_name(f"{name}.png")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(picture.png)
        print(target)
        for report in picture.reports:
            print(report, file=sys.stderr)
    return 1 if any(p.reports for p in pictures) else 0


if __name__ == "__main__":
    sys.exit(main())
