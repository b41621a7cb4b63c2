# SPDX-License-Identifier: Apache-2.0
"""Running a scene: the stepping thread, wall time, controllers, lockstep and playback."""
