# SPDX-License-Identifier: Apache-2.0
"""A line as an OPC UA server: `OpcUaServer`, its nodes, its users, and what they may do."""
