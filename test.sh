#!/usr/bin/env bash
# test.sh - installs what is missing, builds every preset, runs its tests, and counts
# SPDX-License-Identifier: BSD-3-Clause
#
#   ./test.sh [PRESET...]     release    gcc, optimised: all tests, and the rules of the house, which no other preset repeats
#                             dev        gcc with address and undefined-behaviour sanitizers and heavy checks: all tests but
#                                        those that measure whole runs for minutes
#                             dev-clang  the same with clang: the nouns, the core, and what reads foreign bytes
#                             bare       a C compiler alone: every test that needs nothing else, but the slowest
#                             tsan       gcc with the thread sanitizer: the tests that choose their number of threads, but the slow ones
#   ./test.sh --no-setup ...  installs nothing
# Without a name all five. The last line is "N passed, N failed, N skipped", in test cases; exit code 0 if none failed.
# VT_JOBS is the number of parallel jobs (as many as there are processors).
set -u
exec </dev/null
cd "$(dirname "$0")" || exit 1

setup=yes presets=''
for argument in "$@"; do
  case $argument in
  --no-setup) setup=no ;;
  --help | -h) sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" && exit 0 ;;
  release | dev | dev-clang | bare | tsan) presets="$presets $argument" ;;
  *) echo "test.sh: $argument: no such preset; try ./test.sh --help" >&2 && exit 2 ;;
  esac
done
presets=${presets:-release dev dev-clang bare tsan}
[ $setup = no ] || ./setup.sh test || exit 1

jobs=${VT_JOBS:-$(getconf _NPROCESSORS_ONLN)}
if command -v ninja >/dev/null; then export CMAKE_GENERATOR=Ninja; fi
export LC_ALL=C.UTF-8
passed=0 failed=0 skipped=0

# Test cases in the log of ctest: those of cmocka or tests/unit.h by their names, and a program that has none, or ended
# badly although no case of its own failed, as one.
count_cases() {
  awk '
    /^[0-9]+\/[0-9]+ Testing: / { program = $3; cases = bad = done = 0; next }
    /^\[ *(OK|FAILED|SKIPPED|ERROR) *\] / {
      status = $0; sub(/^\[ */, "", status); sub(/ *\].*/, "", status)
      name = $0; sub(/^[^]]*\] */, "", name)
      if (name !~ /^[A-Za-z_][A-Za-z0-9_]*$/ || (program, name) in seen) next
      seen[program, name] = 1; cases++
      if (status == "OK") passed++; else if (status == "SKIPPED") skipped++; else { failed++; bad++ }
    }
    /^Test Passed\./ { if (!cases) passed++ }
    /^Test Failed\./ { if (!bad) failed++ }
    /^Test Skipped|^Test Not Run|Skip return code/ { if (!cases) skipped++ }
    END { print passed + 0, failed + 0, skipped + 0 }' "$1"
}

run_preset() { # adds to the sums; complains and counts a failure where the preset does not build
  local preset=$1 start=$SECONDS configure=() choose=()
  case $preset in
  # The thread sanitizer knows nothing of how foreign libraries wait for each other, so they stay out.
  tsan) configure=(-DVT_WITH_OPENIMAGEIO=OFF -DVT_WITH_OPENCV=OFF -DVT_WITH_OPENGL=OFF -DVT_WITH_SDL=OFF -DVT_WITH_EMBREE=OFF)
    choose=(-L threads -LE 'slow|bench|rules') ;;
  dev) choose=(-LE 'bench|rules') ;;
  bare) choose=(-LE 'bench|rules' -E 'test_(opacity_hazards|synthetic_trees|truth)$') ;;
  dev-clang) choose=(-LE 'slow|bench|rules' -R 'test_(base|octree|ray|tree_file|composite|compress|fit|reconstruct|synthetic_mesh|capture_(bad|import|models|reading))') ;;
  esac
  local log=build/$preset/build.log
  mkdir -p "build/$preset"
  if ! cmake --preset "$preset" "${configure[@]}" >"$log" 2>&1 || ! cmake --build "build/$preset" -j "$jobs" >>"$log" 2>&1; then
    grep -E 'error|Error|FAILED' "$log" | head -20
    tail -20 "$log"
    failed=$((failed + 1))
    echo "test.sh: $preset: does not build ($((SECONDS - start)) s); all of it is in $log"
    return
  fi
  local warnings built=$((SECONDS - start)) counts p f s
  warnings=$(grep -c 'warning:' "$log")
  grep 'warning:' "$log" | head -10
  log=build/$preset/test.log
  local last=build/$preset/Testing/Temporary/LastTest.log
  rm -f "$last"
  (cd "build/$preset" && ctest -j "$jobs" --output-on-failure "${choose[@]}") >"$log" 2>&1
  local code=$?
  counts=$(count_cases "$last" 2>/dev/null) || counts='0 0 0'
  read -r p f s <<<"$counts"
  [ $code -eq 0 ] || [ "$f" -gt 0 ] || f=1
  [ $((p + f)) -gt 0 ] || f=1 # nothing was run
  [ "$f" -eq 0 ] || cat "$log"
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
  echo "test.sh: $preset: $p passed, $f failed, $s skipped; $warnings warnings; built in $built s, all in $((SECONDS - start)) s"
}

for preset in $presets; do run_preset "$preset"; done
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
