"""Other methods on the same rollouts, one module each: `run(robot, problem, rng) -> Answer`."""
