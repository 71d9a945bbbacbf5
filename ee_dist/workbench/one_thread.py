"""What changes something runs on one thread, one thing after the other, and whoever listens hears what changed."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from ee_dist.tasks.errors import defect

T = TypeVar("T")


class OneThread:
    """``folder`` is where it writes; errors of the types ``told`` are a user's to hear, in a line, and no defect. ``notice`` is
    the last thing to tell the user."""

    def __init__(self, folder: Path, told: tuple[type[Exception], ...]) -> None:
        self.folder, self.notice = folder, ""
        self._told = told
        self._listeners: list[Callable[[str], None]] = []
        self._one = ThreadPoolExecutor(1, "ee_dist bench")
        self._guard = threading.Lock()

    def do(self, act: Callable[..., T], *arguments: Any) -> Future[T]:
        """Run it on this thread, after what runs there."""
        return self._one.submit(act, *arguments)

    def attempt(self, act: Callable[..., T | None], *arguments: Any) -> Future[T | None]:
        """The same, where what goes wrong is told to the user, in a line, and gives None."""
        return self.do(self._attempted, act, *arguments)

    def _attempted(self, act: Callable[..., T | None], *arguments: Any) -> T | None:
        try:
            return act(*arguments)
        except self._told as error:
            self.say(" ".join(str(error).split()))
        except OSError as error:
            self.say(f"{error.filename or 'the folder of this session'}: {error.strerror or error}")
        except Exception as error:
            self.say(defect(error, self.folder))
        return None

    def listen(self, told: Callable[[str], None]) -> Callable[[], None]:
        """``told`` hears what changed, by a topic, from any thread. What is returned ends it."""
        with self._guard:
            self._listeners.append(told)

        def end() -> None:
            with self._guard:
                if told in self._listeners:
                    self._listeners.remove(told)

        return end

    def tell(self, topic: str) -> None:
        with self._guard:
            listeners = list(self._listeners)
        for told in listeners:
            told(topic)

    def say(self, text: str) -> None:
        self.notice = text
        self.tell("notice")

    def close(self) -> None:
        self._one.shutdown(wait=False, cancel_futures=True)
