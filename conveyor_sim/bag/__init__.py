# SPDX-License-Identifier: Apache-2.0
"""Recording and reading: columns to messages, messages to MCAP, and back. None of it needs a ROS installation."""
