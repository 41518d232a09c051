"""Questions at a gate and their answers, from a page or a terminal."""
