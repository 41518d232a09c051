"""Between policy and wire: the guard, its rules and limits, and what is refused before a run."""
