# SPDX-License-Identifier: Apache-2.0
"""One tick: steps on a pool of threads, with the guard before and after."""
