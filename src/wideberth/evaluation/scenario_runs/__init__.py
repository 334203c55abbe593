"""One scenario flown many times, with what its table `montecarlo` draws."""
