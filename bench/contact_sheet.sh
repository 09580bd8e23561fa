#!/usr/bin/env bash
# contact_sheet.sh - truth, the three methods and what is wrong with the last, side by side for one held-out photograph
# SPDX-License-Identifier: BSD-3-Clause
#
#   bench/contact_sheet.sh CAPTURE|SCENE OUT.jpg [NAME] [PRESET]
#
# CAPTURE has cameras and mattes (a scene is first written with `voltree synth`). NAME: the picture of the sheet, default the first.
# Left to right over white: photograph | 2004 | 2006 | best | twice the difference of best. Prints bench_reconstruct's figures.
# Needs build/bench (cmake --preset bench) and oiiotool.
set -eu
[ $# -ge 2 ] || { sed -n '5,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
capture=$1 out=$2 name=${3:-} preset=${4:-normal}
here=$(cd "$(dirname "$0")/.." && pwd)
bench=$here/build/bench/bench/bench_reconstruct
[ -x "$bench" ] || { echo "$bench: not built; cmake --preset bench && cmake --build --preset bench" >&2; exit 5; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for method in 2004 2006 best; do
  mkdir "$work/$method"
  views=2 level=normal
  [ $method = best ] && views=4 level=$preset
  echo "$method:"
  "$bench" "$capture" --method $method --preset "$level" --views $views --pictures "$work/$method"
done
[ -n "$name" ] || name=$(ls "$work/best" | head -n 1)
truth=$(find "$capture" -name "${name%.png}*" -path '*test*' | head -n 1)
[ -n "$truth" ] || truth=$(find "$capture" -name "${name%.png}*" | head -n 1)
size=$(oiiotool --info "$work/best/$name" | sed 's/.*: *\([0-9]*\) x *\([0-9]*\),.*/\1x\2/')
oiiotool --pattern constant:color=1,1,1,1 "$size" 4 -d uint8 -o "$work/white.png"
oiiotool "$truth" --ch R,G,B,A --premult "$work/white.png" --over --ch R,G,B -d uint8 -o "$work/truth.png"
oiiotool "$work/truth.png" "$work/best/$name" --absdiff --mulc 2 -d uint8 -o "$work/wrong.png"
oiiotool "$work/truth.png" "$work/2004/$name" "$work/2006/$name" "$work/best/$name" "$work/wrong.png" --mosaic 5x1 -d uint8 \
  --nosoftwareattrib --eraseattrib 'Exif:ImageHistory|Software' --compression jpeg:80 -o "$out"
