"""Pages for a browser, each one file that needs no net: modes, sweeps, responses."""
