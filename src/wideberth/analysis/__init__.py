"""Questions about the parts that need no run: what a sensor's range is worth."""
