# SPDX-License-Identifier: Apache-2.0
"""Statistics of runs: confidence intervals, paired differences, warm-up, batch means, multiple comparisons."""
