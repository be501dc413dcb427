"""Notes and warnings of a fit of springs."""
