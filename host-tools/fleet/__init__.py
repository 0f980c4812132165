# SPDX-License-Identifier: MIT
"""compbox fleet: registry, training and roll-out for many machines (docs/fleet.md)."""
