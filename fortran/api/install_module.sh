#!/bin/sh
# install_module.sh BUILT FOLDER: puts the compiled module of the flat API, found under BUILT, below the installation
# prefix. Module files hold for one compiler and version, so the folder names both.
set -eu
module=$(find "$1" -name jointfrf.mod | head -n 1)
mkdir -p "$MESON_INSTALL_DESTDIR_PREFIX/$2"
cp "$module" "$MESON_INSTALL_DESTDIR_PREFIX/$2/"
