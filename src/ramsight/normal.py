"""Quantiles of the normal distribution, in standard deviations."""

TWO_SIDED_95 = 1.959964
"""Half the width of the interval that holds 95 % of the distribution."""
ONE_SIDED_95 = 1.644854
"""Below it lie 95 % of the distribution."""
