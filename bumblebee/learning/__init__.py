"""Networks and how they learn: PPO experts, the delta action, the generalist."""
