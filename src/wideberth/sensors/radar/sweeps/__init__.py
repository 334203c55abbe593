"""An FMCW radar simulated down to the samples of its channels."""
