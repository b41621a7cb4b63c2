# SPDX-License-Identifier: Apache-2.0
"""Reports of an accuracy study: forecasts, answers, tables and files."""
