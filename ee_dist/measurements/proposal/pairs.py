"""Columns that differ by one letter alone: posd is what was desired and posa what actually was, where both are there."""

from __future__ import annotations

from collections.abc import Iterable

from ee_dist.measurements.proposal.words import quantity_of, tokens

ROLES = {"d": "desired", "a": "actual"}
_OTHER = {"d": "a", "a": "d"}


def spelled_out(names: Iterable[str]) -> dict[str, str]:
    """What the names of such pairs mean, in words that say it; names without a partner are not in it."""
    by_words = {tuple(tokens(n)): n for n in names}
    found = {}
    for words, name in by_words.items():
        for k, word in enumerate(words):
            stem, letter = word[:-1], word[-1:]
            if letter not in ROLES or not _says_a_quantity(words[:k], stem):
                continue
            swapped = {c: (*words[:k], stem + c, *words[k + 1 :]) in by_words for c in (_OTHER[letter], "b", "dd")}
            # Of a, b, c, d each is a joint or a phase; of q, qd, qdd each is the change of the one before.
            if swapped[_OTHER[letter]] and not (swapped["b"] or swapped["dd"]):
                found[name] = " ".join([*words[:k], stem, ROLES[letter], *words[k + 1 :]])
    return found


def _says_a_quantity(before: tuple[str, ...], stem: str) -> bool:
    """Whether a letter stands behind a quantity, glued to it (posd) or as a word of its own (pos_d)."""
    return quantity_of(stem) is not None if stem else any(quantity_of(w) is not None for w in before)
