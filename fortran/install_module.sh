#!/bin/sh
# install_module.sh FOLDER: puts the compiled module of the flat face under the installation prefix. Module files hold for
# one compiler and version, so the folder names both.
set -eu
module=$(find "$MESON_BUILD_ROOT/fortran" -name jointfrf.mod | head -n 1)
mkdir -p "$MESON_INSTALL_DESTDIR_PREFIX/$1"
cp "$module" "$MESON_INSTALL_DESTDIR_PREFIX/$1/"
