"""Questions to people and their answers: the gate after an intake, and the promotion of a version."""
