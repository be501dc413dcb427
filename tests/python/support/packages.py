"""Packages of jointfrf, as the tests of its structure name them."""


def package_of(module: str) -> str:
    """Name of the package that a module lies in: "frf", or "workbench.cases"."""
    names = module.split(".")[1:]
    return ".".join(names[: 2 if names[0] == "workbench" else 1])
