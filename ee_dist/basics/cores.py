"""How many processors this process may use, which a container or ``taskset`` can make fewer than the machine has."""

from __future__ import annotations


def usable() -> int:
    """Processors that this process may use at once: those that its affinity and its container's quota leave it, or fewer if
    ``LOKY_MAX_CPU_COUNT`` says so. Threads that wait for one another in each step, and for a processor that is not there, take
    several times as long as one thread."""
    # A seventh of a second, which no command takes that simulates nothing, nor a worker that has one.
    import joblib

    return int(joblib.cpu_count())
