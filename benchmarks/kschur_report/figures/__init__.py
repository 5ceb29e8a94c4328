"""One module a figure: each function takes a Campaign and returns a list of Pictures, empty where it has no data."""
