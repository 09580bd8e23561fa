#!/bin/sh
# demo.sh - from nothing to a volumetric tree in a few minutes: ./demo.sh, or ./demo.sh FOLDER with your own photographs
# SPDX-License-Identifier: BSD-3-Clause
#
# Installs what is missing (setup.sh), builds, photographs a synthetic tree (or takes yours), reconstructs it, judges it on
# photographs that were left out, and draws it. Everything lands in demo/.
set -eu

photos=""
if [ $# -gt 0 ]; then
  case $1 in
  -h | --help)
    echo "Usage: ./demo.sh [FOLDER]"
    echo "Builds voltree and makes demo/: a tree from a synthetic capture, or from the photographs in FOLDER."
    exit 0
    ;;
  esac
  if [ ! -e "$1" ]; then
    echo "demo.sh: $1: there is no such folder; give the folder of your photographs" >&2
    exit 3
  fi
  photos=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
fi
cd "$(dirname "$0")"

# shellcheck disable=SC2046 # COLMAP only where cameras must be found
./setup.sh build video $([ -z "$photos" ] || echo capture)
echo "== build"
mkdir -p demo
tests=ON # cmocka is for the tests alone, and no part of the group build
pkg-config --exists cmocka || tests=OFF
if ! { cmake --preset release -DVT_WITH_CMOCKA=$tests && cmake --build --preset release --target voltree; } >demo/build.log 2>&1; then
  tail -30 demo/build.log >&2
  echo "demo.sh: the build failed; demo/build.log holds all that was said" >&2
  exit 1
fi
voltree=$PWD/build/release/programs/voltree

rm -rf demo/capture demo/judged demo/turntable demo/reconstruct demo/tree.vtree
if [ -z "$photos" ]; then
  echo "== a synthetic tree and its photographs"
  "$voltree" synth demo/capture --views 48 --test-views 8 --size 400
  source=demo/capture holdout="" split=test
else
  source=$photos holdout="--holdout 8" split=holdout
fi
echo "== reconstruct"
# shellcheck disable=SC2086 # $holdout is two words or none
"$voltree" reconstruct "$source" -o demo/tree.vtree $holdout --max-image-size 1024 --json demo/report.json
echo "== judge, on photographs that it has not seen"
"$voltree" evaluate demo/tree.vtree "$source" --split $split --max-image-size 1024 --json demo/scores.json --report demo/judged
echo "== draw"
"$voltree" render demo/tree.vtree -o demo/levels.png --levels-sheet --size 400x400
"$voltree" render demo/tree.vtree -o demo/turntable --turntable 36 --size 400x400

cat <<END

demo/tree.vtree              the tree; look at it with $voltree play demo/tree.vtree
demo/judged/index.html       truth and result side by side, contact_sheet.png shows all
demo/levels.png              the levels of the tree
demo/turntable/              frames once around, and turntable.mp4
demo/report.json             seconds, memory and bytes of every stage
demo/scores.json             PSNR, SSIM and alpha RMSE of every photograph
END
