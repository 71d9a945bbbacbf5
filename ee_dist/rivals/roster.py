"""All rivals by name, the project's own loop first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ee_dist.rivals.bayes import bayes, bayes_beside
from ee_dist.rivals.body_alone import body_alone
from ee_dist.rivals.loop import loop
from ee_dist.rivals.no_diagnosis import no_diagnosis
from ee_dist.rivals.random_hypotheses import random_hypotheses
from ee_dist.rivals.setting import Rival
from ee_dist.rivals.trial_and_error import trial_and_error


@dataclass(frozen=True)
class Entry:
    """``title``: a rival in the words of tables and figures."""

    title: str
    run: Rival


ROSTER: Mapping[str, Entry] = {
    "loop": Entry("the loop (evolved diagnosis)", loop),
    "bayes": Entry("Bayes, list with the true sizes", bayes),
    "bayes_beside": Entry("Bayes, list with other sizes", bayes_beside),
    "no_diagnosis": Entry("no diagnosis", no_diagnosis),
    "random_hypotheses": Entry("random hypotheses", random_hypotheses),
    "trial_and_error": Entry("map of gaits, trial and error", trial_and_error),
    "body_alone": Entry("evolution on the body alone", body_alone),
}
