"""Cases: published ones and one's own, from `case.toml` to a report."""
