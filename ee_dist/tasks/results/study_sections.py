"""The parts of the page of study: each a heading that says what was found, its figure, and its table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ee_dist.discrepancy.words import percent
from ee_dist.tasks.results.findings import Finding
from ee_dist.tasks.results.paired import LEVEL, Paired
from ee_dist.tasks.results.study_table import DISTANCE, ROLLING, Rows
from ee_dist.viewing.parting_figures import NEARLY, Parting, partings, summed
from ee_dist.viewing.report import Section, Table
from ee_dist.viewing.run_figures import Told, fitness, paths, spans, trials
from ee_dist.viewing.study_figures import METRICS, distances, dominants

TEST = (
    "p: the last trial against the trial after the change of the same run, Wilcoxon signed rank test, exact, two-sided, "
    "corrected for the number of cases by Holm."
)
CAPTION = f"Bars are means over runs, whiskers standard deviations, dots the runs. {TEST}"
EFFECT = (
    f"Gain: Hodges-Lehmann difference with the narrowest interval that covers {percent(LEVEL)}; with fewer than six runs the "
    "widest there is, and what it covers. Rank corr.: matched pairs, rank biserial. Least p: what so few runs can give, "
    "corrected."
)
EACH = ("case", "metric", "seed", "engine", "budget", "intact (m)", "after (m)", "best trial (m)", "last trial (m)",
        "restored", "diagnosis right", "doubt", "digest", "the same again")  # fmt: skip
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth")


def last_name(rows: Rows) -> str:
    """What the last trial is called: by its number where all runs have as many."""
    counts = {int(r["trials"]) for r in rows}
    number = counts.pop() if len(counts) == 1 else 0
    return f"{ORDINALS[number - 1]} trial" if 0 < number <= len(ORDINALS) else "last trial"


def head(rows: Rows) -> tuple[str, ...]:
    """Of the table of cases."""
    last = last_name(rows).removesuffix(" trial")
    return ("case", "runs", "intact (m)", "after (m)", "best (m)", f"{last} (m)", "restored", "right", "named", "doubt",
            "gain (m)", "rank corr.", "p", "least p")  # fmt: skip


def p_text(line: Mapping[str, Any]) -> str:
    """What the test says of a case, for a figure."""
    if not math.isfinite(line["p_corrected"]):
        return "one run: no test"
    return "p < 0.001" if line["p_corrected"] < 0.001 else f"p = {line['p_corrected']:.2g}"


def _number(value: float, form: str = ".2g") -> str:
    return "-" if math.isnan(value) else f"{value:{form}}"


def _of(count: int, of: int) -> str:
    return f"{count}/{of}" if of else "-"


def brief(line: Mapping[str, Any]) -> list[str]:
    """A case as a row of a terminal's table."""
    n = line["runs"]
    return [
        str(line["scenario"]), str(n), *(f"{line[k]:.2f}" for k in ("intact_m", "after_m", "last_m")),
        _of(line["restored"], n), _of(line["right"], line["scored"]), _of(line["named"], line["scored"]),
        _of(line["doubts"], line["doubts_told"]), _number(line["p_corrected"]),
    ]  # fmt: skip


def cells(line: Mapping[str, Any]) -> list[str]:
    """A case as a row of the page's table, and of a document's."""
    case, n, intact, after, last, *counts, p = brief(line)
    test: Paired = line["test"]
    return [case, n, intact, after, f"{line['best_m']:.2f}", last, *counts, gain(test), _number(test.biserial, "+.2f"), p,
            _number(test.least_corrected)]  # fmt: skip


def gain(test: Paired) -> str:
    """A difference with its interval, and what that covers where it is not LEVEL."""
    if test.n < 2:
        return _number(test.shift, "+.2f")
    covers = "" if test.level >= LEVEL else f" ({percent(test.level)})"
    return f"{test.shift:+.2f}, {test.low:+.2f} to {test.high:+.2f}{covers}"


def distance_section(metric: str, summaries: Rows, rows: Rows, lines: Rows) -> Section:
    """The paper's Fig. 7 of one metric; all metrics have one scale."""
    mine, last = [x for x in lines if x["metric"] == metric], last_name(rows)
    # Where nothing could be tested the heading says so, and nothing stands above the bars.
    tested = any(math.isfinite(x["p_corrected"]) for x in mine)
    tests = {(metric, x["scenario"]): p_text(x) for x in mine if tested}
    own = [s for s in summaries if s["metric"] == metric]
    figure = distances(own, metric, tests, summaries, last)
    return Section(_distance_heading(metric, mine, last), CAPTION, figure)


def _distance_heading(metric: str, mine: Rows, last: str) -> str:
    how = METRICS.get(metric, metric)
    clear = sum(x["test"].sure and x["test"].shift > 0 for x in mine)
    if any(x["test"].could_tell for x in mine):
        return f"In {clear} of {len(mine)} cases the {last} goes farther than the one after the change, {how}"
    more = float(np.mean([x["last_m"] - x["after_m"] for x in mine]))
    farther = "farther" if more >= 0 else "less far"
    return f"The {last} goes {abs(more):.2f} m {farther} than the one after the change, {how}; too few runs for a test"


def finding_sections(found: Sequence[Finding]) -> list[Section]:
    if not found:
        return []
    told = [[f.said, f.verdict, f.numbers] for f in found]
    lead = [k for k, f in enumerate(found) if f.verdict == "holds"]
    caption = (
        "Each verdict follows from the numbers beside it by a fixed rule: a difference has a corrected p below 0.05, most runs "
        "are more than half by the interval of the share. 'Cannot be told': the runs are too few to say it or its opposite."
    )
    table = Table(("the paper found", "in these runs it", "because"), told, (), lead, whole=True)
    return [Section("What the paper found, and what these runs say of it", caption, None, table)]


def case_sections(metrics: Sequence[str], summaries: Rows, lines: Rows) -> list[Section]:
    titles = {s["scenario"]: s.get("title") or "" for s in summaries}
    sections = []
    heads = head([{"trials": len(s["distance_m"]["trials"])} for s in summaries])
    for metric in metrics:
        mine = [x for x in lines if x["metric"] == metric]
        told = [[f"{c[0]}. {titles[x['scenario']]}".strip(), *c[1:]] for x, c in ((x, cells(x)) for x in mine)]
        table = Table(heads, told, tuple(range(1, len(heads))))
        sections.append(Section(f"By case, {METRICS.get(metric, metric)}", f"{TEST} {EFFECT}", None, table))
    return sections


def between_sections(between: Mapping[Any, Paired]) -> list[Section]:
    """Rolling means against distances."""
    if not between:
        return []
    ahead = sum(t.sure and t.shift > 0 for t in between.values())
    behind = sum(t.sure and t.shift < 0 for t in between.values())
    heading = f"Rolling means go farther than distances in {ahead} of {len(between)} cases, less far in {behind}"
    if not any(t.could_tell for t in between.values()):
        heading = "Whether rolling means go farther than distances: too few runs to tell"
    told = [[str(c), str(t.n), gain(t), _number(t.biserial, "+.2f"), _number(t.corrected), _number(t.least_corrected)]
            for c, t in between.items()]  # fmt: skip
    columns = ("case", "pairs", "rolling mean less distance (m)", "rank corr.", "p", "least p")
    caption = (
        "Last trials of runs with the same seed, engine and budget, Wilcoxon signed rank test, exact, two-sided, corrected for "
        f"the number of cases by Holm. {EFFECT}"
    )
    return [Section(heading, caption, None, Table(columns, told, tuple(range(1, len(columns)))))]


def doubt_sections(totals: Mapping[str, Any]) -> list[Section]:
    told = {m: t["doubt"] for m, t in totals.items() if t["doubt"]["right"] + t["doubt"]["wrong"]}
    if not told:
        return []
    caught = sum(d["wrong"] - d["missed"] for d in told.values())
    wrong, false = (sum(d[k] for d in told.values()) for k in ("wrong", "false"))
    rows = [
        [METRICS.get(m, m), f"{d['false']} of {d['right']}", f"{d['missed']} of {d['wrong']}",
         f"{d['missed_unsayable']} of {d['unsayable']}"]
        for m, d in told.items()
    ]  # fmt: skip
    columns = (
        "metric",
        "false doubts, of right diagnoses",
        "doubts missed, of wrong ones",
        "of these where no genome can say it",
    )
    caption = (
        "Doubt is said where the last hypothesis leaves more than noise and one step of its magnitudes would. It does not see "
        "the truth; this table does."
    )
    heading = f"The doubt caught {caught} of {wrong} wrong diagnoses and was false {false} times"
    return [Section(heading, caption, None, Table(columns, rows, (1, 2, 3)))]


def dominant_section(summaries: Rows) -> Section:
    """The paper's Fig. 8."""
    means = {m: float(np.mean([p[-1] for s in summaries if s["metric"] == m for p in s["dominants"]["diagnosis"] if p]))
             for m in sorted({s["metric"] for s in summaries}, key=lambda m: m != ROLLING)}  # fmt: skip
    told = ", ".join(f"{mean:.1f} {METRICS.get(m, m)}" for m, mean in means.items())
    caption = (
        "New best hypotheses found so far in a diagnosis pass: lines are means over runs, bands the middle half of them. A pass "
        "that has come to an error of zero can find no better one."
    )
    return Section(f"New best hypotheses in a diagnosis pass: {told}", caption, dominants(summaries))


def shown_sections(shown: Sequence[tuple[Mapping[str, Any], Told]]) -> list[Section]:
    """The paper's Fig. 6: a run of each metric side by side, on the same scales."""
    if not shown:
        return []
    high, far, along, across = spans([run for _, run in shown])
    sections = []
    for summary, run in shown:
        names = ["", *(f"after {name}" if "after" not in name else name for name in run.names[1:])]
        told = [
            [str(k + 1), names[k + 1], f"{error:.2g}{' m' if summary['metric'] == DISTANCE else ''}", words]
            for k, (error, words) in enumerate(run.believed)
        ]
        table = Table(("diagnosis", "made", "error left", "what the robot believed"), told, (0, 2))
        figures = [fitness(run, high), trials(run, far)] + ([paths(run, along, across)] if run.paths else [])
        how = METRICS.get(summary["metric"], summary["metric"])
        share = f", {percent(run.reached[-1] / run.reached[0])} of intact" if run.reached[0] > 0 else ""
        heading = f"One run, case {summary['scenario']}, seed {summary['seed']}, {how}: {run.reached[-1]:.2f} m in the end{share}"
        caption = "Each repair pass began after the diagnosis of its number; the table says what was believed then."
        sections.append(Section(heading, caption, None, table, figures))
    return sections


def parting_sections(found: Sequence[Parting]) -> list[Section]:
    """The paper's Fig. 5: of the first controller the courses, of all when they part."""
    if not found:
        return []
    near, far = (float(np.median([getattr(p, k) for p in found])) for k in ("near", "far"))
    heading = f"Logs of nearly equal damages part after {near:.0f} steps, of different ones after {far:.0f}"
    caption = (
        f"{found[0].names[0]}, {found[0].names[1]}, and {found[0].names[2]}, under the intact robot's controller. Apart: any "
        f"angle sensor differs by more than {percent(NEARLY)} of its range. Curves: the first controller; medians: all "
        f"{len(found)}."
    )
    table = Table(
        ("controller", "nearly equal apart after (steps)", "different apart after (steps)"), summed(found), (1, 2)
    )
    return [Section(heading, caption, partings(found[0]), table)]


def run_section(rows: Rows) -> Section:
    caption = "The command repeats the run; its digest must then be the same."
    return Section("All runs", caption, None, Table(EACH, [_run(r) for r in rows], (0, 2, 5, 6, 7, 8)), folded=True)


def _run(row: Mapping[str, Any]) -> list[str]:
    metres = [f"{row[k]:.3f}" for k in ("intact_m", "after_m", "best_m", "last_m")]
    about = [str(row["scenario"]), row["metric"].replace("_", " "), str(row["seed"]), row["engine"], row["budget"]]
    said = [_yes(row[k]) for k in ("restored", "right", "doubt")]
    return [*about, *metres, *said, row["digest"][:16], row["command"]]


def _yes(value: bool | None) -> str:
    return "not known" if value is None else "yes" if value else "no"
