# SPDX-License-Identifier: Apache-2.0
"""Operations on a line: inputs, control authority, checks, forced signals, read-back."""
