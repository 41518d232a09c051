"""Tools of the operator: the console, its keys and screen, watchers, run sheets."""
