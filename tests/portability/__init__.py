"""The numerical tests on other kinds of processor, engines, versions and Pythons."""
