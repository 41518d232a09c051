"""The task: follow a reference motion. Observations, rewards, terminations, sampling, and the environment."""
