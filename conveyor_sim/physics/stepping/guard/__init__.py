# SPDX-License-Identifier: Apache-2.0
"""The guard: detects physically impossible states after every tick. The tick is then repeated or the run stopped."""
