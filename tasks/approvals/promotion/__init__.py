"""Whether a version becomes champion: the rule, the question and its answer."""
