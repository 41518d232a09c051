"""mjlab's tracking task beside our learners: minutes until the same five motions are followed, on one card."""
