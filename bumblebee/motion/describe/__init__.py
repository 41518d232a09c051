"""What a motion is, in words: captions of HumanML3D, of the user, and of file names, kept apart."""
