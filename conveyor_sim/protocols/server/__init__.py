# SPDX-License-Identifier: Apache-2.0
"""Parts common to all protocol servers: interface, users, quotas, budgets, certificates."""
