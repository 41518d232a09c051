"""PPO of rsl_rl as a learner, and its update without waiting for the device."""
