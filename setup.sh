#!/usr/bin/env bash
# setup.sh - installs the Debian packages that voltree needs and this machine lacks
# SPDX-License-Identifier: BSD-3-Clause
#
#   ./setup.sh [GROUP...]     build    compiler, CMake, the libraries (the default)
#                             bare     a C compiler and CMake alone: the library, the CPU renderer, no photographs
#                             capture  COLMAP, for photographs without cameras
#                             video    ffmpeg, for turntables as video
#                             test     what ./test.sh needs: build, and clang, cmocka, ctags
#                             all      everything
#   ./setup.sh --list GROUP   names the packages and installs nothing
# With apt-get, through sudo unless root; nothing happens where nothing is missing.
# shellcheck disable=SC2086 # lists of packages are words
set -eu
exec </dev/null

bare='gcc libc6-dev cmake ninja-build'
build="$bare g++ pkg-config libopenimageio-dev openimageio-tools libopencv-dev libopencv-contrib-dev libjansson-dev
  libzstd-dev libepoxy-dev libegl-dev libgl-dev libgles-dev libgl1-mesa-dri libsdl2-dev libembree-dev libceres-dev
  libsqlite3-dev"
capture='colmap'
video='ffmpeg'
test="$build clang libclang-rt-14-dev libcmocka-dev universal-ctags binutils"

wanted='' list=no
[ $# -gt 0 ] || set -- build
for group in "$@"; do
  case $group in
  --list) list=yes ;;
  bare | build | capture | video | test) wanted="$wanted ${!group}" ;;
  all) wanted="$wanted $test $capture $video" ;;
  --help | -h) sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" && exit 0 ;;
  *) echo "setup.sh: $group: no such group; try ./setup.sh --help" >&2 && exit 2 ;;
  esac
done
wanted=$(printf '%s\n' $wanted | sort -u)
[ $list = no ] || { printf '%s\n' $wanted && exit 0; }

is_installed() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }
if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "setup.sh: this is no Debian; install what corresponds to these packages, then go on:" >&2
  printf '  %s\n' $wanted >&2
  exit 0
fi
missing=''
for package in $wanted; do is_installed "$package" || missing="$missing $package"; done
if [ -z "$missing" ]; then
  echo "setup.sh: all packages are here"
  exit 0
fi

as_root=''
if [ "$(id -u)" -ne 0 ]; then
  as_root=sudo
  command -v sudo >/dev/null || {
    echo "setup.sh: packages are missing and there is no sudo; as root: apt-get install --no-install-recommends$missing" >&2
    exit 5
  }
fi
echo "setup.sh: installing$missing"
install() {
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing >"$log" 2>&1
}
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# The lists of packages may be absent or out of date: then they are fetched and it is tried once more.
if ! install; then
  if ! $as_root apt-get update -q >"$log" 2>&1 || ! install; then
    tail -20 "$log" >&2
    echo "setup.sh: apt-get could not install$missing; see above" >&2
    exit 5
  fi
fi
echo "setup.sh: done"
