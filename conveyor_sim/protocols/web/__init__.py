# SPDX-License-Identifier: Apache-2.0
"""The page of a line that runs: by one websocket for each browser it is drawn there, and commanded."""
