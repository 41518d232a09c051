"""The robots as they are. Imports nothing of `bumblebee.diagnosis` or `bumblebee.sim`; a test holds it to that."""
