"""Evaluations that take longer than a test: `python -m experiments.<name>` from the project's root."""
