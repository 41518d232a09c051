"""Commands of `bumblebee`: a file each, and the table of all of them."""
