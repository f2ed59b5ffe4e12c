"""A comparison as sentences: which algorithm is better at which budget, and how surely."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._validation import counted, instance
from pymoo_psi.comparison._comparison import Comparison
from pymoo_psi.comparison._reference import REFERENCE_POINT, Reference
from pymoo_psi.comparison._statistics import INDICATORS
from pymoo_psi.pareto import listed

if TYPE_CHECKING:
    import pandas as pd

SIGNIFICANCE = 0.05
"""A difference is claimed where the corrected p value is below this, the customary level."""

_NAMES = {
    "hypervolume": "the largest hypervolume",
    "igd_plus": "the smallest IGD+",
    "epsilon": "the smallest additive epsilon",
    "optimum_distance": "the Salukvadze optimum nearest to the best known",
}
_NOTHING = {"hypervolume": 0.0}  # what a run has that finds nothing; of distances infinity


def conclusions(comparison: Comparison, indicator: str = "hypervolume") -> tuple[str, ...]:
    """Return one sentence or two for every budget.

    They name the algorithm with the best median, the algorithms that it is better than, with the
    effect size and the corrected p value, and those from which no difference can be claimed.

    Further sentences say so if runs ended before their budgets, or if there are too few to claim
    any difference.

    Args:
        comparison: The comparison.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.

    Raises:
        ArgumentValueError: The indicator is unknown.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> result = compare(
        ...     get_problem("osy"), n_evaluations=512, seeds=6, algorithms=["psi", "nsga3"],
        ...     polish=False,
        ... )
        >>> print(conclusions(result)[0])
        512 evaluations: nsga3 has the largest hypervolume (median 0...). It is better than psi
        (effect 1.00, p = 0.031).
    """
    instance("comparison", comparison, Comparison, "compare(...) gives one")
    tests = comparison.tests(indicator)
    summary = comparison.summary()
    sentences = tuple(
        _conclusion(
            indicator,
            summary[summary["evaluations"] == budget].set_index("algorithm")[indicator],
            tests[tests["evaluations"] == budget],
            budget,
        )
        for budget in comparison.evaluations
    )
    measures = comparison.measures
    short = measures[measures["evaluated"] < measures["evaluations"]]["algorithm"].unique().tolist()
    if short:
        whole = f"Not every run of {listed(short)} used its whole budget: see the column evaluated."
        sentences += (whole,)
    # Holm multiplies the least p value by the number of tests: it cannot come below this product.
    tested = tests["p"].notna().sum()
    if tested and tests["least_p"].min() * tested >= SIGNIFICANCE:
        few = (
            "So few runs cannot tell any two algorithms apart, however different: take more seeds."
        )
        sentences += (few,)
    return sentences


def _conclusion(indicator: str, medians: pd.Series, tests: pd.DataFrame, budget: int) -> str:
    ordered = medians.sort_values(ascending=INDICATORS[indicator] < 0, kind="stable")
    best, value = ordered.index[0], ordered.iloc[0]
    at = counted(budget, "evaluation")
    if len(ordered) == 1:
        return f"{at}: {best} has a median of {value:.4g}, with no other beside it."
    if value == _NOTHING.get(indicator, np.inf):
        return f"{at}: {_all_nothing(indicator, tests)}"
    equal = [name for name in ordered.index[1:] if ordered[name] == value]
    surely: list[str] = []
    reverse: list[str] = []
    perhaps: list[str] = []
    for name in ordered.index[1:]:
        pair = tests[tests["better"].isin([best, name]) & tests["worse"].isin([best, name])].iloc[0]
        # The best median may lose more often than not: then the test names the other one.
        effect = pair["effect"] if pair["better"] == best else 1 - pair["effect"]
        shown = f"{name} (effect {effect:.2f}, {_p(pair['p_holm'])})"
        if not pair["p_holm"] < SIGNIFICANCE:
            perhaps.append(shown)
        else:
            (surely if effect > 0.5 else reverse).append(shown)
    shared = f", as {'has' if len(equal) == 1 else 'have'} {listed(equal)}" if equal else ""
    text = f"{at}: {best} has {_NAMES[indicator]} (median {value:.4g}){shared}."
    if surely:
        text += f" It is better than {listed(surely)}."
    if reverse:
        text += f" But more often than not a run is beaten by one of {listed(reverse, 'or')}."
    if perhaps:
        text += f" No difference can be claimed from {listed(perhaps, 'or')}."
    return text


def _all_nothing(indicator: str, tests: pd.DataFrame) -> str:
    """Say that the median run of none has anything, and who is surely better all the same."""
    what = "hypervolume above 0" if indicator == "hypervolume" else "feasible design"
    surely = [
        f"{row['better']} is better than {row['worse']} "
        f"(effect {row['effect']:.2f}, {_p(row['p_holm'])})"
        for _, row in tests[tests["p_holm"] < SIGNIFICANCE].iterrows()
    ]
    claimed = f"but {listed(surely)}." if surely else "and no difference can be claimed."
    return f"no algorithm has a {what} in the median, {claimed}"


def _p(value: float) -> str:
    if value != value:  # NaN: two deterministic algorithms cannot be tested
        return "one value each"
    return f"p = {value:.3f}" if value >= 0.001 else f"p = {value:.1g}"


def report(comparison: Comparison) -> str:
    """Return a short report in Markdown: the medians, the conclusions, and how it was measured.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> result = compare(get_problem("bnh"), n_evaluations=64, seeds=2, algorithms=["nsga3"])
        >>> print(report(result).splitlines()[0])
        # BNH: nsga3
    """
    instance("comparison", comparison, Comparison, "compare(...) gives one")
    lines = [f"# {comparison.problem}: {', '.join(comparison.algorithms)}", "", *_table(comparison)]
    for indicator in INDICATORS:
        lines += ["", f"## {indicator}", ""]
        lines += [f"- {sentence}" for sentence in conclusions(comparison, indicator)]
    return "\n".join([*lines, "", "## How it was measured", "", *_method(comparison), ""])


def _table(comparison: Comparison) -> list[str]:
    frame = comparison._for_readers()
    rows = [list(frame.columns), *frame.to_numpy().tolist()]
    # A bar in a name of the user's would be one more column.
    texts = [[str(cell).replace("|", r"\|") for cell in row] for row in rows]
    lines = [f"| {' | '.join(row)} |" for row in texts]
    lines.insert(1, f"|{'---|' * len(frame.columns)}")
    return [*lines, "", "Medians, with quartiles in brackets."]


def _reference(reference: Reference, optimum: str) -> list[str]:
    """Say what was measured against; a reference that was kept knows no more of its origin."""
    if not reference.n_union:
        return ["- No run found a feasible design: there is nothing to measure against."]
    size, spent = len(reference.points), reference.optimum_evaluations
    chosen = "all of these" if size == reference.n_union else f"{size} of these, farthest first"
    known = "continuous one" if spent else "best of these"
    polished = f", which took {spent} evaluations more" if spent else ""
    return [
        "- Objectives are scaled by the ideal and the nadir of the non-dominated union of the "
        "runs and of the front, if one was given, that the reference was made of, "
        f"{counted(reference.n_union, 'point')}; the reference set is {chosen}; the reference "
        f"point is {REFERENCE_POINT} in every scaled objective.",
        "- Hypervolume is the share of the box up to the reference point. `optimum_distance` is "
        f"the scaled distance of the Salukvadze optimum of a run to the {known}, "
        f"{optimum}{polished}.",
    ]


def _method(comparison: Comparison) -> list[str]:
    layout, best = comparison.layout, comparison.reference.optimum
    optimum = zip(layout.objectives, best * layout.sign + 0.0, strict=True)
    assessed = {
        "evaluated": "the non-dominated feasible designs among all that a run evaluated",
        "returned": "the non-dominated feasible designs that the algorithm returned",
    }[comparison.assess]
    return [
        f"- Measured are {assessed}.",
        *_reference(comparison.reference, ", ".join(f"{n} = {v:.6g}" for n, v in optimum)),
        "- Differences are tested by Mann-Whitney's U with exact p values, by the exact sign test "
        "where one algorithm is deterministic; p values are corrected by Holm's method "
        "over all pairs and budgets of an indicator; the effect is the probability that a run of "
        f"the first is the better one. A difference is claimed at p < {SIGNIFICANCE}.",
    ]
