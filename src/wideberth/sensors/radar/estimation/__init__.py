"""Range, direction and range rate of the echoes in a frame, with honest variances."""
