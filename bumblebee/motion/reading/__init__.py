"""From a user's path to motions: which files are taken, how each is read, checked and told of."""
