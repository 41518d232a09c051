"""Under which licence a motion's file stands, and what that asks of whatever is made from it."""
