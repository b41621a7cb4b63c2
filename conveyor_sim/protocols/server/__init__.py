"""Parts common to all protocol servers: interface, users, quotas, budgets, certificates."""
