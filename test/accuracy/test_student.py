"""Quantiles of Student's t."""

import pytest
from scipy import stats

from conveyor_sim.accuracy.student import t_quantile


@pytest.mark.parametrize("freedom", [0.7, 1.0, 1.3, 2.0, 3.0, 7.9, 14.0, 29.3, 254.0, 510.0, 1e5])
@pytest.mark.parametrize("probability", [0.501, 0.6, 0.9, 0.975, 1.0 - 0.05 / 6.0, 0.9999])
def test_quantiles_are_those_of_scipy(probability: float, freedom: float) -> None:
    assert t_quantile(probability, freedom) == pytest.approx(stats.t.ppf(probability, freedom), rel=1e-9)


@pytest.mark.parametrize(("probability", "freedom"), [(0.5, 3.0), (1.0, 3.0), (0.3, 3.0), (0.9, 0.0)])
def test_what_has_no_quantile_is_refused(probability: float, freedom: float) -> None:
    with pytest.raises(ValueError, match="expected"):
        t_quantile(probability, freedom)
