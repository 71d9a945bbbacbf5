"""Joints as a file calls them, where the robot calls them otherwise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ee_dist.measurements.proposal.words import read_name, tokens

LETTERS = frozenset(["th", "theta", "phi", "psi", "alpha", "beta", "gamma"])
"""What angles are called, and joints beside a word that says the quantity (a thigh, too)."""
_Around = tuple[tuple[str, ...], tuple[str, ...]]


def other_names(addresses: Sequence[str], size: int) -> tuple[tuple[str, ...], list[list[str]]]:
    """Names by which columns differ that are called alike otherwise, ``size`` of them in the order of the columns, where one such
    row of names is had by most: joints, as the file calls them. And the columns of each quantity in that order."""
    alike: dict[_Around, list[tuple[str, str]]] = {}
    for address in addresses:
        for around, name in _parted(tokens(address)):
            alike.setdefault(around, []).append((name, address))
    rows: dict[tuple[str, ...], list[list[str]]] = {}
    for members in alike.values():
        names = tuple(name for name, _ in members)
        if len(names) == size == len(set(names)):
            rows.setdefault(names, []).append([address for _, address in members])

    def rank(names: tuple[str, ...]) -> tuple[int, int]:
        """What most quantities have, and of that the shortest: a word that all names share is none of theirs."""
        return len(rows[names]), -sum(len(name) for name in names)

    best = sorted(rows, key=rank, reverse=True)[:2]
    if not best or (len(best) == 2 and rank(best[0]) == rank(best[1])):
        return (), []
    return best[0], rows[best[0]]


def _parted(words: Sequence[str]) -> Iterator[tuple[_Around, str]]:
    """What stands around each name that may be one of a joint, and the name: words that say nothing of a quantity, and not a
    number alone."""
    silent = [w in LETTERS or (read_name(w).kind is None and read_name(w).command is None) for w in words]
    for first in range(len(words)):
        for last in range(first + 1, len(words) + 1):
            if not silent[last - 1]:
                break
            name, around = words[first:last], [*words[:first], *words[last:]]
            if LETTERS & {*name} and read_name(" ".join(around)).kind is None:
                continue
            if not all(w.isdigit() for w in name):
                yield (tuple(words[:first]), tuple(words[last:])), "_".join(name)
