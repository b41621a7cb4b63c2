# SPDX-License-Identifier: Apache-2.0
"""Force in one contact, and contacts of two bottles."""
