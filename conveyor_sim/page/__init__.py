# SPDX-License-Identifier: Apache-2.0
"""Web page of a recording, with a time line."""
