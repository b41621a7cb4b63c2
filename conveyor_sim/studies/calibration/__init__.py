# SPDX-License-Identifier: Apache-2.0
"""Parameters of materials from measurements on a plant, as entries of a scene."""
