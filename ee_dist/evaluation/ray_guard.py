"""A process of its own that outlives the run by a moment: it ends what is left of the run's Ray and removes its folder.

Ray's own processes watch one another and some notice a killed run only after minutes. This one is started with the read
end of a pipe that the run holds open; when the run ends, in whatever way, the pipe closes. Everything that the run
started carries a mark in its environment, and is found by it.

    python ray_guard.py MARK FOLDER
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time

ROUNDS = 40
PAUSE_S = 0.05
TITLE = b"ray::"
"""How the names begin that Ray gives its processes."""


def ours(mark: str, folder: str) -> list[int]:
    """Ids of the processes that carry the mark. Ray writes over the environment of some when it gives them a title: of those, the
    ones that have a file of the folder open. A run that clears the folder away has that, too, and no such title."""
    if os.path.isdir("/proc/self"):
        return [int(name) for name in os.listdir("/proc") if name.isdigit() and _is_ours(f"/proc/{name}", mark, folder)]
    listed = subprocess.run(["ps", "-axwwE", "-o", "pid=,command="], capture_output=True, text=True, check=False).stdout
    return [int(line.split(None, 1)[0]) for line in listed.splitlines() if mark in line or folder in line]


def _is_ours(process: str, mark: str, folder: str) -> bool:
    with contextlib.suppress(OSError):
        with open(f"{process}/environ", "rb") as file:
            if mark.encode() in file.read():
                return True
        with open(f"{process}/cmdline", "rb") as file:
            if file.read(len(TITLE)) != TITLE:
                return False
        for handle in os.listdir(f"{process}/fd"):
            with contextlib.suppress(OSError):
                if os.readlink(f"{process}/fd/{handle}").startswith(folder + "/"):
                    return True
    return False


def end_all(mark: str, folder: str, spared: set[int]) -> None:
    """Kill what is ours until nothing is: the dying may have started others."""
    for _ in range(ROUNDS):
        found = [pid for pid in ours(mark, folder) if pid not in spared]
        if not found:
            return
        for pid in found:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(PAUSE_S)


def main() -> None:
    # A terminal's Ctrl-C and hang-up are for the run, and reach this process by the run's end.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    mark, folder = sys.argv[1:3]
    spared = {os.getpid(), os.getppid()}
    while sys.stdin.buffer.read(4096):
        pass
    end_all(mark, folder, spared)
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
