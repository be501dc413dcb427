#!/bin/sh
# Sets up a fresh clone: Python, compilers and headers from the system's package manager where they are missing, then
# .venv with the package installed editable. Does nothing when all is up to date.
#
#   sh python/bootstrap.sh run     what the cases need
#   sh python/bootstrap.sh docs    also what the documentation site needs
#   sh python/bootstrap.sh test    also what the tests need; CalculiX where there is one to install
#   sh python/bootstrap.sh all     also what the long tests need: the kernel for all processors; a browser, and readers
#                                  of files of Nastran and Ansys where there are such to install
#
# Tests of what could not be installed are skipped.
#
# PYTHON names the interpreter for a new .venv, FC and CC the compilers.
# Exit status: 3 when system packages are missing and may not be installed from here, 1 for any other failure.
set -eu

case ${1-} in
  # Kernels for other processors than this one are compiled where they are tested.
  run) extras=all instruction_sets=own stamps=run ;;
  docs) extras=all,docs instruction_sets=own stamps='run docs' ;;
  test) extras=all,test,docs instruction_sets=own stamps='run docs test' ;;
  all) extras=all,test,docs instruction_sets=all stamps='run docs test all' ;;
  *) echo "usage: $0 run|docs|test|all" >&2; exit 2 ;;
esac
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd -P)
cd "$root"
venv=$root/.venv
log=$root/build/set-up.log
lock=$root/build/set-up.lock
stamp=$venv/set-up
readers=build/installed-readers.json
# Packages that cases, commands and tests import, much of each.
imported='_pytest h5py hypothesis jinja2 matplotlib numpy PIL pyparsing scipy'

say() { echo "jointfrf: $*" >&2; }

# meson-python writes the path of the interpreter between apostrophes as it is, pip between quotation marks.
case $root in
  *[\'\"\\]*) say "a path with a quotation mark or a backslash cannot be built in, move the checkout: $root"; exit 1 ;;
esac

# ---------------------------------------------------------------- what is there

is_new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; }

# A folder that was moved keeps scripts that point to its old place.
venv_works() {
  is_new_enough "$venv/bin/python" && grep -qF "$venv/bin/python" "$venv/bin/pip" 2>/dev/null &&
    "$venv/bin/python" -c 'import pip' 2>/dev/null
}

find_python() {
  if venv_works; then
    set -- "$venv/bin/python"
  elif [ "${PYTHON-}" ]; then
    set -- "$PYTHON"
  else
    set -- python3 python3.14 python3.13 python3.12 python3.11
  fi
  for python; do
    is_new_enough "$python" && return
  done
  return 1
}

has_headers() {
  "$python" -c 'import pathlib, sys, sysconfig
sys.exit(not pathlib.Path(sysconfig.get_path("include"), "Python.h").exists())' >/dev/null 2>&1
}

# A compiler may be there and yet be unable to link, for want of the C library's headers and start-up files.
# links COMPILER SUFFIX SOURCE
links() {
  scratch=$(mktemp -d)
  echo "$3" >"$scratch/a.$2"
  status=0
  # shellcheck disable=SC2086  # "ccache gcc" is two words
  $1 "$scratch/a.$2" -o "$scratch/a.out" >>"$log" 2>&1 || status=1
  rm -rf "$scratch"
  return $status
}

# -> missing: words out of fortran c python headers venv
find_missing() {
  missing=
  links "${FC:-gfortran}" f90 'end' || missing="$missing fortran"
  links "${CC:-cc}" c '#include <math.h>
int main(void) { return 0; }' || missing="$missing c"
  if find_python; then
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    has_headers || missing="$missing headers"
    "$python" -c 'import ensurepip' 2>/dev/null || venv_works || missing="$missing venv"
  else
    version=3
    missing="$missing python headers venv"
  fi
}

# ---------------------------------------------------------------- the system's packages

find_manager() {
  for manager in apt-get dnf zypper pacman brew; do
    command -v $manager >/dev/null 2>&1 && return
  done
  manager=
  return 1
}

# What is missing -> the packages that bring it.
package() {
  case $manager/$1 in
    apt-get/fortran) echo gfortran libc6-dev ;;
    apt-get/c) echo gcc libc6-dev ;;
    apt-get/python) echo python3 ;;
    apt-get/headers) echo "python$version-dev" ;;
    apt-get/venv) echo "python$version-venv" ;;
    apt-get/calculix) echo calculix-ccx ;;
    apt-get/browser | dnf/browser | zypper/browser | pacman/browser) echo chromium ;;
    dnf/fortran | zypper/fortran | pacman/fortran) [ $manager = dnf ] && echo gcc-gfortran || echo gcc-fortran ;;
    dnf/c | zypper/c | pacman/c | brew/fortran | brew/c) echo gcc ;;
    dnf/headers) echo "python$version-devel" ;;
    dnf/python | dnf/venv) echo python3 python3-pip ;;
    zypper/headers) echo "python$version-devel" | tr -d . ;;
    zypper/python | zypper/venv) echo python3 python3-pip ;;
    pacman/python | pacman/headers | pacman/venv) echo python ;;
    brew/python | brew/headers | brew/venv) echo python ;;
  esac
}

# -> packages, install, refresh, command: how to install what is missing
plan_installation() {
  refresh=
  packages=$(for item in $missing; do package "$item"; done | tr ' ' '\n' | sort -u | tr '\n' ' ')
  packages=${packages% }
  case $manager in
    apt-get)
      refresh='apt-get update -q'
      install="env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends $packages"
      command="sudo apt-get update && sudo apt-get install $packages" ;;
    dnf)
      install="dnf install -y $packages"
      command="sudo dnf install $packages" ;;
    zypper)
      install="zypper --non-interactive install $packages"
      command="sudo zypper install $packages" ;;
    pacman)
      install="pacman -Sy --noconfirm --needed $packages"
      command="sudo pacman -S $packages" ;;
    brew)
      install="brew install $packages"
      command=$install ;;
  esac
}

# -> sudo: what precedes the command
may_install() {
  sudo=
  [ "$manager" = brew ] || [ "$(id -u)" = 0 ] && return
  sudo='sudo -n'
  sudo -n true >/dev/null 2>&1
}

run_installation() {
  say "installing $packages"
  # shellcheck disable=SC2086  # the commands are lists of words
  $sudo $install >>"$log" 2>&1 </dev/null ||
    { [ "$refresh" ] && $sudo $refresh >>"$log" 2>&1 </dev/null && $sudo $install >>"$log" 2>&1 </dev/null; } || return 1
  hash -r
}

install_missing() {
  if ! find_manager; then
    say "missing:$missing. Install them with the system's package manager and start again."
    exit 3
  fi
  plan_installation
  if ! may_install; then
    command -v sudo >/dev/null 2>&1 || command="su -c '$(echo "$command" | sed 's/sudo //g')'"
    say "missing:$missing. Type this, then start again:"
    echo "  $command" >&2
    exit 3
  fi
  run_installation || fail "could not install the system packages"
}

# Tests of pages are skipped without a browser, those of FE programs without CalculiX: both are installed where possible.
# offer WHAT TESTS PROGRAM...
offer() {
  what=$1 tests=$2
  shift 2
  for name; do
    command -v "$name" >/dev/null 2>&1 && return
  done
  missing=" $what"
  if find_manager && [ "$manager" != brew ]; then
    plan_installation
    [ "$packages" ] && may_install && run_installation && return
  fi
  say "no $what ($1): tests of $tests will be skipped"
}

# ---------------------------------------------------------------- one at a time

fail() {
  tail -n 40 "$log" >&2
  say "$1; the whole log is $log"
  exit 1
}

# A process of another user cannot be sent a signal, and is alive.
is_alive() {
  said=$(LC_ALL=C kill -0 "$1" 2>&1) && return
  case $said in *ermitted*) return 0 ;; esac
  ps -p "$1" >/dev/null 2>&1
}

# Takes away the lock of a dead holder, which of several waiters may be done by one only: by who holds the lock of that
# name, which may have been left by a dead waiter itself.
# break_lock LOCK HOLDER
break_lock() {
  if ln -s $$ "$1.$2" 2>/dev/null; then
    [ "$(readlink "$1" 2>/dev/null)" != "$2" ] || rm -f "$1"
    rm -f "$1.$2"
  else
    set -- "$1.$2" "$(readlink "$1.$2" 2>/dev/null)"
    if [ "$2" ] && ! is_alive "$2"; then break_lock "$@"; fi
  fi
}

# The lock is a link to the number of the process that holds it: made in one step, and a dead holder is seen.
take_lock() {
  holder=
  until ln -s $$ "$lock" 2>/dev/null; do
    [ "$holder" ] || say "another set-up is running, waiting for it"
    holder=$(readlink "$lock" 2>/dev/null) || continue
    if is_alive "$holder"; then sleep 1; else break_lock "$lock" "$holder"; fi
  done
  beside=
  trap '[ -z "$beside" ] || kill "$beside" 2>/dev/null; rm -f "$lock"' EXIT
  trap 'exit 1' HUP INT TERM
}

# ---------------------------------------------------------------- .venv

state() { { echo "$root"; cat pyproject.toml python/constraints.txt meson.build meson.options fortran/meson.build fortran/api/meson.build fortran/api/*/meson.build python/meson.build; } | cksum; }

up_to_date() {
  [ "$(cat "$stamp.$1" 2>/dev/null)" = "$(state)" ] && is_new_enough "$venv/bin/python" &&
    ls build/cp*/build.ninja >/dev/null 2>&1
}

# The versions of the checked-in list, so that a new release of a dependency breaks no fresh clone. What pip compiles,
# most of it never imported, would take as long as all else that it does. To be called in a subshell.
# exec_pip_install REPORT ARGUMENT...
exec_pip_install() {
  report=$1
  shift
  exec "$venv/bin/python" -m pip --disable-pip-version-check --no-input install --no-compile -c python/constraints.txt \
    --report "$report" "$@"
}

# No files but those whose hashes the list has: they are compared before anything that was installed can run.
# check_installed REPORT
check_installed() {
  "$venv/bin/python" -I -S python/check_hashes.py "$1" >>"$log" 2>&1 && return
  rm -rf "$venv"
  fail "a package is not the one whose hash is in python/constraints.txt; .venv was removed"
}

# What pyproject.toml asks for, to build the package or to use it -> a file of requirements.
requirements() {
  "$venv/bin/python" -c 'import sys, tomllib
content = tomllib.load(open("pyproject.toml", "rb"))
project, extras = content["project"], sys.argv[1].split(",")
asked = content["build-system"]["requires"] if extras == ["build"] else project["dependencies"]
asked += [each for extra in extras if extra != "build" for each in project["optional-dependencies"][extra]]
print(*asked, sep="\n")' "$1" >"build/requirements-$1.txt"
}

# What the package needs when it runs; for a subshell beside the compiler.
install_packages() {
  (exec_pip_install build/installed-run.json -r "build/requirements-$extras.txt") &
  trap 'kill $! 2>/dev/null; exit 1' TERM
  wait $! || return 1
  check_installed build/installed-run.json
  # A file that cannot be compiled is not for this version of Python, and is not imported; not all are there to cases.
  for package in $imported; do echo "$venv"/lib/python*/site-packages/"$package"; done |
    "$venv/bin/python" -m compileall -qq -j 2 -x '/tests/' -i - || :
  [ "$1" != all ] || install_readers
}

# Wheels of pyYeti and ansys-mapdl-reader, for a few tests: large, and not there for every system. Not compiled ahead.
install_readers() {
  rm -f "$readers"
  requirements nastran,ansys
  (exec_pip_install "$readers" --only-binary :all: -r build/requirements-nastran,ansys.txt) &
  trap 'kill $! 2>/dev/null; exit 1' TERM
  if wait $!; then check_installed "$readers"; else rm -f "$readers"; fi
}

# An editable installation keeps no compiled modules by itself: each start of a command would compile some two hundred.
compile_modules() { "$venv/bin/python" -m compileall -qq python/jointfrf || :; }

make_venv() {
  if ! venv_works; then
    # Build folders remember the environment they were made with.
    rm -rf build/cp*
    "$python" -m venv --clear "$venv" >>"$log" 2>&1 || fail "could not make .venv"
  fi
  rm -f "$stamp".*
  # The build runs meson and ninja by name.
  PATH=$venv/bin:$PATH
  export PATH
  requirements build
  requirements "$extras"
  (exec_pip_install build/installed.json -r build/requirements-build.txt) >>"$log" 2>&1 ||
    fail "could not install what the build needs"
  check_installed build/installed.json
  # What the package only needs when it runs comes while the kernel is compiled.
  install_packages "$1" >build/packages.log 2>&1 &
  beside=$!
  (exec_pip_install build/installed-own.json --no-build-isolation --no-deps "--config-settings=setup-args=-Dinstruction_sets=$instruction_sets" -e .) \
    >>"$log" 2>&1 || fail "could not build the package"
  compile_modules
  status=0
  wait "$beside" || status=1
  beside=
  cat build/packages.log >>"$log"
  [ $status = 0 ] || fail "could not install what the package needs"
  for each in $stamps; do state >"$stamp.$each"; done
  [ "$1" != all ] || [ -f "$readers" ] ||
    say "no wheels of pyYeti and ansys-mapdl-reader: tests of files of Nastran and Ansys will be skipped"
}

up_to_date "$1" && compile_modules && exit
if ! mkdir -p build 2>/dev/null || [ ! -w build ] || [ ! -w . ]; then
  say "$root cannot be written: copy or clone the project to a folder of your own"
  exit 1
fi
take_lock
up_to_date "$1" && exit
date >"$log"
say "setting up (log: build/set-up.log)"
[ -z "${PYTHON-}" ] || is_new_enough "$PYTHON" || fail "PYTHON=$PYTHON is not Python 3.11 or newer"
find_missing
if [ "$missing" ]; then
  install_missing
  find_missing
  [ -z "$missing" ] || fail "still missing after installation:$missing"
fi
case $1 in test | all) offer calculix 'FE programs' ccx ;; esac
[ "$1" != all ] || offer browser pages chromium chromium-browser google-chrome google-chrome-stable
make_venv "$1"
