"""The measured loop in the world model: four arms on sealed robots."""
