# SPDX-License-Identifier: Apache-2.0
"""The other way round: a line as the client of a PLC that is the server, by a map of its tags to ours."""
