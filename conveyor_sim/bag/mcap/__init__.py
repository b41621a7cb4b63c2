# SPDX-License-Identifier: Apache-2.0
"""The MCAP file format: writing, indexes, and verification of damaged files. Independent of message types."""
