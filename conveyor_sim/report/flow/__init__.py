# SPDX-License-Identifier: Apache-2.0
"""Flow of bottles through a scene: traces of lone bottles, transit times, capacities, and faults of the layout."""
