"""Statistics of runs: confidence intervals, paired differences, warm-up, batch means, multiple comparisons."""
