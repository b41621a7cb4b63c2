# SPDX-License-Identifier: Apache-2.0
"""Values of parameters that are best by an objective, found by trying."""
