#!/usr/bin/env bash
# opensplat.sh - OpenSplat, 3D Gaussian splatting on the CPU, as a peer of voltree bench: CAPTURE SECONDS OUT
# SPDX-License-Identifier: BSD-3-Clause
#
#   OPENSPLAT=/path/to/opensplat voltree bench frontier --peer opensplat=bench/peers/opensplat.sh
#
# OpenSplat draws one withheld view while it trains (--val-image, --val-render), so one run gives the first test view and no other;
# the bench judges what is there and says how many. It knows no alpha: it composites over one constant background, and so are the
# photographs that it gets. Its learning rates fall over the number of steps, which therefore must fit the time: a short run
# measures the time of a step, and since steps become slower as splats multiply, six tenths of what then would fit are asked for.
# It starts from points: those of a draft tree, if the program voltree is on PATH or named by VOLTREE, else random ones where the
# cameras look.  Needs python3, and oiiotool or ImageMagick's convert.  OPENSPLAT_OPTIONS is passed on.
set -u -o pipefail
[ $# -eq 3 ] || { echo "usage: opensplat.sh CAPTURE SECONDS OUT"; exit 2; }
capture=$1 seconds=$2 out=$3
start=$SECONDS
splat=${OPENSPLAT:-opensplat}
command -v "$splat" >/dev/null || { echo "$splat: no such program; set OPENSPLAT to OpenSplat's executable"; exit 5; }
command -v python3 >/dev/null || { echo "python3: is missing; install it"; exit 5; }
background=(0.6130 0.0101 0.3984)
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/images" "$work/drawn" "$work/trial"

# ---- photographs over the background
flatten() { # RGBA picture, RGB picture
  if command -v oiiotool >/dev/null; then
    oiiotool "$1" --pattern "constant:color=${background[0]},${background[1]},${background[2]},1" '{TOP.width}x{TOP.height}' 4 \
      --over --ch R,G,B -d uint8 -o "$2" >/dev/null
  elif command -v convert >/dev/null; then
    convert "$1" -background 'rgb(156,3,102)' -alpha remove -alpha off "$2"
  else
    echo "oiiotool or convert: is missing; install openimageio-tools or imagemagick"
    return 5
  fi
}
names=$(python3 - "$capture" <<'END'
import json, os, sys
train = json.load(open(os.path.join(sys.argv[1], "transforms_train.json")))["frames"]
test = json.load(open(os.path.join(sys.argv[1], "transforms_test.json")))["frames"]
print("\n".join(frame["file_path"] for frame in train + test[:1]))
END
) || exit 3
for name in $names; do
  flatten "$capture/$name.png" "$work/images/${name##*/}.png" || exit $?
done
test_name=${names##*/}

# ---- points to start from
voltree=${VOLTREE:-voltree}
if command -v "$voltree" >/dev/null; then
  "$voltree" reconstruct "$capture" -o "$work/draft.vtree" --preset draft --quiet --no-cache &&
    "$voltree" export "$work/draft.vtree" -o "$work/draft.ply" --quiet
fi

# ---- its project: transforms.json and an ASCII PLY of at most 10000 points
python3 - "$capture" "$work" <<'END' || exit 3
import json, os, random, struct, sys
capture, work = sys.argv[1:]
read = lambda name: json.load(open(os.path.join(capture, name)))
train, test = read("transforms_train.json"), read("transforms_test.json")
frames = train["frames"] + test["frames"][:1]
for frame in frames:
    frame["file_path"] = "images/" + os.path.basename(frame["file_path"]) + ".png"
json.dump({"camera_model": "OPENCV", "ply_file_path": "points.ply", "frames": frames}, open(os.path.join(work, "transforms.json"), "w"))
random.seed(1)
points, path = [], os.path.join(work, "draft.ply")
if os.path.exists(path):  # voltree export: 3 floats, red green blue alpha, extinction
    body = open(path, "rb").read().split(b"end_header\n", 1)[1]
    points = [p[:6] for p in struct.iter_unpack("<3f4Bf", body) if p[6] > 12]
    points = random.sample(points, min(len(points), 10000))
if not points:  # a ball around the point nearest to all optical axes, as wide as the nearest camera sees there
    rows = [(f["transform_matrix"], f) for f in frames]
    a, b, centres = [[0.0] * 3 for _ in range(3)], [0.0] * 3, []
    for m, f in rows:
        axis, eye = [-m[i][2] for i in range(3)], [m[i][3] for i in range(3)]
        for i in range(3):
            for j in range(3):
                p = (i == j) - axis[i] * axis[j]
                a[i][j] += p
                b[i] += p * eye[j]
    for i in range(3):  # Gauss
        for j in range(3):
            if i != j:
                r = a[j][i] / a[i][i]
                a[j] = [x - r * y for x, y in zip(a[j], a[i])]
                b[j] -= r * b[i]
    centre = [b[i] / a[i][i] for i in range(3)]
    radius = min(sum((m[i][3] - centre[i]) ** 2 for i in range(3)) ** 0.5 * f["h"] / (2 * f["fl_y"]) for m, f in rows)
    while len(points) < 5000:
        p = [random.uniform(-1, 1) for _ in range(3)]
        if sum(x * x for x in p) <= 1:
            points.append([c + radius * x for c, x in zip(centre, p)] + [110, 110, 90])
with open(os.path.join(work, "points.ply"), "w") as ply:
    ply.write("ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
              "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n" % len(points))
    for p in points:
        ply.write("%g %g %g %d %d %d\n" % tuple(p))
END

# ---- how long is a step?
left() { python3 -c "print(max(2.0, $seconds - ($SECONDS - $start)))"; }
run() { # folder for pictures, steps, seconds
  # shellcheck disable=SC2086
  timeout -k 5 "$3" "$splat" "$work" -o "$work/splat.ply" --cpu --num-downscales 0 -n "$2" --val --val-image "$test_name.png" \
    --val-render "$1" ${OPENSPLAT_OPTIONS:-}
}
trial=$(python3 -c "print(max(2.0, 0.15 * $(left)))")
rate=$(run "$work/trial" 1000000 "$trial" 2>&1 | python3 -c '
import sys, time
first, steps = None, 0
for line in sys.stdin:
    if line.startswith("Step "):
        first = first or time.time()
        last, steps = time.time(), steps + 1
print((steps - 1) / max(last - first, 1e-3) if steps > 2 else 0)')
steps=$(python3 -c "print(max(10, int(0.6 * ${rate:-0} * $(left)) // 10 * 10))")
echo "steps $steps, $rate a second in the trial"

# ---- the run that counts; its last picture is the result
run "$work/drawn" "$steps" "$(left)" >"$work/log" 2>&1
code=$?
last=$(find "$work/drawn" -name '*.png' | sed 's/.*\///; s/\.png//' | sort -n | tail -1)
if [ -z "$last" ]; then
  tail -1 "$work/log"
  echo "opensplat drew nothing within $seconds s (exit code $code)"
  exit 1
fi
mkdir -p "$out" && cp "$work/drawn/$last.png" "$out/$test_name.png" || exit 1
echo "step $last of $steps"
echo "background ${background[*]}"
