"""Joints as a file calls them, where the robot calls them otherwise."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.measurements.proposal.words import read_name, tokens


def other_names(addresses: Sequence[str], size: int) -> tuple[tuple[str, ...], list[list[str]]]:
    """Words by which columns differ that are called alike otherwise, ``size`` of them in the order of the columns, where one such
    row of words is had by most: joints, as the file calls them. And the columns of each quantity in that order."""
    alike: dict[tuple[int, tuple[str, ...]], list[tuple[str, str]]] = {}
    for address in addresses:
        words = tokens(address)
        for k, word in enumerate(words):
            if not word.isdigit() and read_name(word).kind is None and read_name(word).command is None:
                alike.setdefault((k, (*words[:k], *words[k + 1 :])), []).append((word, address))
    rows: dict[tuple[str, ...], list[list[str]]] = {}
    for members in alike.values():
        names = tuple(word for word, _ in members)
        if len(names) == size == len(set(names)):
            rows.setdefault(names, []).append([address for _, address in members])
    most = max(map(len, rows.values()), default=0)
    best = [names for names, columns in rows.items() if len(columns) == most]
    return (best[0], rows[best[0]]) if len(best) == 1 else ((), [])
