"""The parts of the filter: limits, rules, what a person overrules, and the decision about each motion."""
