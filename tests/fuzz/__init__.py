"""Attacks on the package: programs with seeds and bounded time, short in the test suite, long by `tests/fuzz/run`."""
