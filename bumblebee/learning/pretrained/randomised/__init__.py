"""The policy that learnt on robots that differ, with delays; README.md is its card."""
