# SPDX-License-Identifier: Apache-2.0
"""Message types of ROS 2 without ROS: topics, qualities of service, and serialization of columns as CDR."""
