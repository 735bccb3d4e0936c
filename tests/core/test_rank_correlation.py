"""Spearman's correlation of ranks, against Pearson's of ranks counted one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.statistics.rank_correlation import rank_correlation
from pipeline.validation import InvalidInput

pairs = st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=3, max_size=30)


@given(pairs)
def test_it_is_the_correlation_of_mean_ranks(pairs: list[tuple[int, int]]) -> None:
    series = np.array(pairs, dtype=float).T
    ranks = [
        [(values < value).sum() + 0.5 * ((values == value).sum() + 1) for value in values]
        for values in series
    ]
    if np.ptp(series[0]) == 0 or np.ptp(series[1]) == 0:
        assert rank_correlation(*series) == 0.0
    else:
        assert rank_correlation(*series) == pytest.approx(np.corrcoef(ranks)[0, 1], abs=1e-12)


@given(pairs)
def test_only_the_order_counts(pairs: list[tuple[int, int]]) -> None:
    a, b = np.array(pairs, dtype=float).T
    assert rank_correlation(np.exp(a), b**3) == pytest.approx(rank_correlation(a, b), abs=1e-12)
    assert rank_correlation(-a, b) == pytest.approx(-rank_correlation(a, b), abs=1e-12)


@pytest.mark.parametrize(("a", "b"), [([1.0, 2.0], [1.0]), ([], []), ([1.0, np.nan], [1.0, 2.0])])
def test_what_cannot_be_ranked_is_refused(a: list[float], b: list[float]) -> None:
    with pytest.raises(InvalidInput, match="rank"):
        rank_correlation(a, b)
