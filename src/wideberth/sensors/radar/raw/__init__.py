"""Raw samples of a radar in NumPy files."""
