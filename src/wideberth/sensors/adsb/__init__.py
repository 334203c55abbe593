"""ADS-B: recorded and live traffic to scans, and the error model of simulated traffic."""
