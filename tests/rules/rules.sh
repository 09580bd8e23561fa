#!/usr/bin/env bash
# rules.sh - the house rules (docs/architecture.md) as checks over the source and the built libraries
# SPDX-License-Identifier: BSD-3-Clause
#
# rules.sh RULE [ARGUMENTS], RULE one of
#   layers                    who includes whom; nothing of a folder but its face is included from outside (tests and
#                             benchmarks of a folder's inner parts may look inside)
#   foreign                   each foreign library is included in exactly one file (tests and benchmarks may have a bridge
#                             of their own beside it), and a bridge has its _none twin
#   captions                  line 1 is the caption, line 2 the licence
#   sizes                     files at most 600 lines, functions at most 100 and nine in ten at most 50 (universal-ctags)
#   headers CC [CXX]          every header compiles alone as C17 and as C++17
#   symbols LIBRARY...        global symbols of the static libraries begin with vt_
#   selftest CC               the rules find what they are there to find
# Every breach is a line "file:line: why". Exit code 0, 1, or 77 (cannot be checked here).
set -u -o pipefail
root=${VT_RULES_ROOT:-$(cd "$(dirname "$0")/../.." && pwd)}
cd "$root" || exit 1
folders='base capture octree datasets-synthetic reconstruct compress render programs tests bench'
breaches=0
breach() {
  echo "$*"
  breaches=$((breaches + 1))
}
sources() { # files of ours with one of the given endings
  local folder ending
  for folder in $folders; do
    [ -d "$folder" ] || continue
    for ending in "$@"; do find "$folder" -type f -name "*.$ending"; done
  done | sort
}

face_of() {
  case $1 in
  datasets-synthetic) echo datasets-synthetic/synthetic.h ;;
  *) echo "$1/$1.h" ;;
  esac
}

may_include() { # folder of the includer, folder of the included
  case $1 in
  base) [ "$2" = base ] ;;
  capture | octree | datasets-synthetic) [ "$2" = base ] || [ "$2" = "$1" ] ;;
  reconstruct | compress | render) [ "$2" = base ] || [ "$2" = octree ] || [ "$2" = "$1" ] ;;
  programs) [ "$2" != tests ] && [ "$2" != bench ] ;;
  bench) [ "$2" != programs ] ;;
  tests) [ "$2" != programs ] ;;
  *) false ;;
  esac
}

rule_layers() {
  local file line included from to
  while IFS=: read -r file line included; do
    from=${file%%/*} to=${included%%/*}
    if [ ! -f "$included" ] || [ "$to" = "$included" ]; then
      breach "$file:$line: \"$included\" is no path from the root of the repository"
    elif ! may_include "$from" "$to"; then
      breach "$file:$line: $from must not know $to"
    elif [ "$from" != "$to" ] && [ "$to" != base ] && [ "$from" != tests ] && [ "$from" != bench ] &&
      [ "$included" != "$(face_of "$to")" ]; then
      breach "$file:$line: $included is private to $to; its face is $(face_of "$to")"
    fi
  done < <(sources c cc h | xargs grep -nE '^[[:space:]]*#[[:space:]]*include[[:space:]]*"' /dev/null |
    sed -E 's/^([^:]*:[0-9]+):[^"]*"([^"]*)".*/\1:\2/')
}

# Headers of the C and C++ standards, of POSIX, and of the compilers: at home everywhere.
known_headers=' assert.h complex.h ctype.h errno.h fenv.h float.h inttypes.h iso646.h limits.h locale.h math.h setjmp.h
 signal.h stdalign.h stdarg.h stdatomic.h stdbool.h stddef.h stdint.h stdio.h stdlib.h stdnoreturn.h string.h tgmath.h
 threads.h time.h uchar.h wchar.h wctype.h
 dirent.h dlfcn.h fcntl.h fnmatch.h ftw.h getopt.h glob.h libgen.h poll.h pthread.h pwd.h regex.h sched.h semaphore.h
 spawn.h strings.h termios.h unistd.h sys/file.h sys/ioctl.h sys/mman.h sys/resource.h sys/select.h sys/stat.h sys/statvfs.h
 sys/time.h sys/types.h sys/utsname.h sys/wait.h
 immintrin.h x86intrin.h arm_neon.h cpuid.h sanitizer/asan_interface.h '
known_headers=$(echo "$known_headers" | tr '\n' ' ')

rule_foreign() {
  local file line included library twin seen first place
  declare -A seen=()
  while IFS=: read -r file line included; do
    case $known_headers in *" $included "*) continue ;; esac
    case $included in
    *.*) ;; # a header with an ending: of a library
    *) # C++'s own
      case $file in *.cc) ;; *) breach "$file:$line: <$included> in a file that is no bridge" ;; esac
      continue
      ;;
    esac
    library=${included%%/*}
    library=${library%.h}
    case $file in tests/*) place=tests ;; bench/*) place=bench ;; *) place=house ;; esac
    first=${seen[$place:$library]:-$file}
    seen[$place:$library]=$first
    [ "$first" = "$file" ] || breach "$file:$line: $library is already included by $first, its only bridge"
    [ "$file" = tests/unit.h ] && continue
    twin=${file%_*}_none.c
    case $file in *_*.c | *_*.cc) ;; *) breach "$file:$line: $library in a file that is no bridge" && continue ;; esac
    [ -f "$twin" ] || breach "$file:$line: the bridge to $library has no twin $twin"
  done < <(sources c cc h | xargs grep -nE '^[[:space:]]*#[[:space:]]*include[[:space:]]*<' /dev/null |
    sed -E 's/^([^:]*:[0-9]+):[^<]*<([^>]*)>.*/\1:\2/')
}

rule_captions() {
  local file first second
  for file in $(sources c cc h); do
    { read -r first && read -r second; } <"$file"
    case $first in
    "// ${file##*/} - "?*) ;;
    *) breach "$file:1: is not the caption '// ${file##*/} - what it is'" ;;
    esac
    [ "$second" = '// SPDX-License-Identifier: BSD-3-Clause' ] || breach "$file:2: is not the licence line"
    case $first in *' - to come') breach "$file:1: is still to come" ;; esac
  done
}

rule_sizes() {
  local file lines
  for file in $(sources c cc h); do
    lines=$(wc -l <"$file")
    [ "$lines" -le 600 ] || breach "$file:$lines: more than 600 lines"
  done
  if ! ctags --version 2>/dev/null | grep -q 'Universal Ctags'; then
    echo 'functions are not measured: universal-ctags is not installed'
    return
  fi
  local lengths
  lengths=$(sources c cc h | xargs ctags -f - --fields=+ne --kinds-C=f --kinds-C++=f --languages=C,C++ --langmap=C:+.h |
    awk -F'\t' '{
      start = end = 0
      for (i = 4; i <= NF; i++) {
        if ($i ~ /^line:/) start = substr($i, 6)
        if ($i ~ /^end:/) end = substr($i, 5)
      }
      if (end) print end - start + 1, $2 ":" start, $1
    }' | sort -n)
  while read -r lines file name; do
    [ -z "$lines" ] || [ "$lines" -le 100 ] || breach "$file: $name has $lines lines, more than 100"
  done <<<"$lengths"
  local tenth
  tenth=$(awk '{ n[NR] = $1 } END { print n[int((NR * 9 + 9) / 10)] + 0 }' <<<"$lengths")
  [ "$tenth" -le 50 ] || breach ".:0: one function in ten has more than 50 lines ($tenth)"
}

rule_headers() {
  local cc=$1 cxx=${2:-} header
  local flags=(-fsyntax-only -I. -D_POSIX_C_SOURCE=200809L '-DVT_VERSION=""' '-DVT_PROGRAM=""' '-DVT_SOURCE_DIR=""'
    '-DVT_DATASETS_DIR=""' -Wall -Wextra -Werror -Wno-unused-function -Wno-unused-variable -Wno-missing-field-initializers)
  # All in one go, each a translation unit of its own; only where that fails is each asked alone.
  local c_headers cxx_headers
  c_headers=$(sources h)
  cxx_headers=$(sources h | grep -v '^tests/') # tests are written in C
  # shellcheck disable=SC2086 # words
  "$cc" -std=c17 "${flags[@]}" -x c $c_headers 2>/dev/null || for header in $c_headers; do
    "$cc" -std=c17 "${flags[@]}" -x c "$header" || breach "$header:1: does not compile alone as C17"
  done
  # shellcheck disable=SC2086
  [ -z "$cxx" ] || "$cxx" -std=c++17 "${flags[@]}" -x c++ $cxx_headers 2>/dev/null || for header in $cxx_headers; do
    "$cxx" -std=c++17 "${flags[@]}" -x c++ "$header" || breach "$header:1: does not compile alone as C++17"
  done
  [ -n "$cxx" ] || echo 'no C++ compiler in this build: headers are checked as C17 only'
}

rule_symbols() {
  local library type name
  for library in "$@"; do
    [ -f "$library" ] || { breach "$library:0: was not built" && continue; }
    # Weak symbols are inline functions of C++'s library. The sanitizers' own begin with two underscores.
    while read -r _ type name; do
      case $type in
      [WVuvw]) ;;
      *) case $name in vt_* | __*san*) ;; *) breach "$library:0: global symbol $name ($type) lacks the prefix vt_" ;; esac ;;
      esac
      case $type in B | C | D) case $name in __*) ;; *) breach "$library:0: $name is a global variable" ;; esac ;; esac
    done < <(nm -g --defined-only "$library" 2>/dev/null | awk 'NF == 3')
  done
}

# A little house in which every rule is broken once; each rule must see its breach and nothing must be seen after repair.
rule_selftest() {
  local cc=$1 house
  house=$(mktemp -d) || exit 1
  # shellcheck disable=SC2064
  trap "rm -rf '$house'" EXIT
  local spdx='// SPDX-License-Identifier: BSD-3-Clause'
  mkdir -p "$house"/{base,octree,render}
  see() { # expected exit code, what must be said, rule...
    local code=$1 said=$2 text
    shift 2
    text=$(VT_RULES_ROOT=$house bash "$root/tests/rules/rules.sh" "$@" 2>&1)
    [ $? -eq "$code" ] || breach "rules.sh:0: $1 did not end with $code: $text"
    case $text in *"$said"*) ;; *) breach "rules.sh:0: $1 did not say '$said': $text" ;; esac
  }
  printf '// base.h - a\n%s\nint vt_a(void);\n' "$spdx" >"$house/base/base.h"
  printf '// octree.h - a\n%s\n#include "base/base.h"\n#include <stdio.h>\n' "$spdx" >"$house/octree/octree.h"
  printf '// private.h - a\n%s\n' "$spdx" >"$house/octree/private.h"
  for rule in layers foreign captions sizes; do see 0 '' $rule; done
  see 0 '' headers "$cc"
  echo '#include "octree/octree.h"' >>"$house/base/base.h" && see 1 'base must not know octree' layers
  printf '// draw.c - a\n%s\n#include "octree/private.h"\n' "$spdx" >"$house/render/draw.c"
  see 1 'is private to octree' layers
  echo '#include "draw.h"' >"$house/render/draw.c" && see 1 'is no path' layers
  see 1 'is not the caption' captions
  echo '#include <zstd.h>' >"$house/render/draw.c" && see 1 'that is no bridge' foreign
  rm "$house/render/draw.c"
  printf '#include <zstd.h>\n' | tee "$house/base/a_zstd.c" "$house/base/b_zstd.c" >/dev/null
  see 1 'already included by base/a_zstd.c' foreign
  see 1 'has no twin base/a_none.c' foreign
  rm "$house/base/b_zstd.c" && touch "$house/base/a_none.c" && mkdir "$house/tests"
  see 0 '' foreign
  echo '#include <zstd.h>' >"$house/tests/c_zstd.c" && see 1 'has no twin tests/c_none.c' foreign
  touch "$house/tests/c_none.c" && see 0 '' foreign
  cp "$house/tests/c_zstd.c" "$house/tests/d_zstd.c" && touch "$house/tests/d_none.c"
  see 1 'already included by tests/c_zstd.c' foreign
  rm -r "$house/tests"
  printf 'size_t vt_b(void);\n' >>"$house/octree/private.h" && see 1 'does not compile alone' headers "$cc"
  printf '//%.0s\n' {1..601} >"$house/base/long.c" && see 1 'more than 600 lines' sizes
  { echo 'int vt_long(void) {' && printf '  (void)0;%.0s\n' {1..99} && printf '  return 0;\n}\n'; } >"$house/base/long.c"
  ctags --version 2>/dev/null | grep -q 'Universal Ctags' && see 1 'more than 100' sizes
  printf 'int vt_fine(void);\nint vt_fine(void) { return 1; }\nint stray(void);\nint stray(void) { return 2; }\nint vt_global = 3;\n' >"$house/s.c"
  $cc -c "$house/s.c" -o "$house/s.o" && ar rc "$house/libs.a" "$house/s.o"
  see 1 'symbol stray' symbols "$house/libs.a"
  see 1 'vt_global is a global variable' symbols "$house/libs.a"
}

rule=${1:?name a rule}
shift
case $rule in
layers | foreign | captions | sizes | headers | symbols | selftest) "rule_$rule" "$@" ;;
*) echo "rules.sh: no rule '$rule'" && exit 2 ;;
esac
[ "$breaches" -eq 0 ] || {
  echo "$breaches breaches of the rule '$rule'"
  exit 1
}
