"""Comparison reports: the same problems by each method, speed against accuracy, on one page."""
