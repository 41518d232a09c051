"""BumbleBee: from motion capture to a humanoid's registered policy, and from its logs back to the simulator."""

__version__ = "0.1.0"
DISTRIBUTION = "bumblebee-humanoid"
"""Name of the installed distribution; `bumblebee` is another project's on the package index."""
