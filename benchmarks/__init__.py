"""What the project costs in CPU time: `python -m benchmarks.run`."""
