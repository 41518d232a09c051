"""Links: their mass, and forces on them."""
