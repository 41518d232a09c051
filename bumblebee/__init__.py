"""BumbleBee: from motion capture to a humanoid's registered policy, and from its logs back to the simulator."""

__version__ = "0.1.0"
