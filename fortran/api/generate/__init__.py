"""What follows from the declarations and comments of api.F90, written by the build.

`python -m generate WHAT --output PATH api.F90 SOURCE...` with `fortran/api` on the path; WHAT is `header`, `include`,
`work`, `signatures`, `symbols`, `reference` or `names`. Every SOURCE declares values that constants of api.F90 take.

`source.py` knows lines and statements, `comments.py` and `reader.py` the conventions of api.F90, `routines.py` what is
read; beside them stands one writer for each output. Standard library only, Python 3.9 or newer: what runs meson builds
the plain library.
"""
