"""From samples to detections and scans: the signal processing of the FMCW radar."""
