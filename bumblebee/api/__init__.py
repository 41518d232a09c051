"""The Python API: the functions that `import bumblebee` offers; the command line calls them too."""
