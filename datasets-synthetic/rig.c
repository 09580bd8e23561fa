// rig.c - where the cameras stand: spirals, loops, an arc, a drone's flight and a walk around the object
// SPDX-License-Identifier: BSD-3-Clause
//
// Golden spiral (SPIRAL, HEMISPHERE): heights are spread evenly (equal areas of the sphere between two elevations) and
// each azimuth is the last one plus the golden angle, so that any number of views is well spread. Test views run on a
// second spiral of the same kind, turned to the phase at which the test view that is closest to a training view is
// farthest from it.
// Paths (RING, DRONE, HANDHELD): training views stand at the whole numbers of a path, test views share out the gaps
// between them, each in the middle of its gap if there are no more test views than gaps. The two rows of the ARC have
// the test views on a third row between them.
//
// All cameras of a rig stand equally far from the origin and look at it; in a walk by hand they stand up to 8 % farther
// and are turned a little about their centres. A point p stands before a turned camera at distance d at q = J (R p + d
// e_z): each side of the frame gives one linear inequality in d, so the nearest distance that keeps the object in the
// frame is a maximum over points and sides, for any turn.

#include "datasets-synthetic/rig.h"
#include "base/rng.h"

enum { PHASE_COUNT = 180, WALK_STREAM = 1000 };

static const double fill = 0.84, degree = VT_PI / 180;

typedef struct place {
  vt_vec3 direction;       // unit, from the origin to the camera
  double yaw, pitch, roll; // radians, turns of the camera about its centre after it looked at the origin
  double farther;          // its distance over the rig's, >= 1
} place;

static vt_vec3 direction_of(double azimuth, double elevation) {
  return vt_v3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));
}

// ---- spirals

typedef struct spiral {
  double lowest, highest; // elevations, radians
} spiral;

static vt_vec3 spiral_direction(const spiral *s, int i, int count, double phase) {
  double z = sin(s->lowest) + (sin(s->highest) - sin(s->lowest)) * (i + 0.5) / count;
  double azimuth = i * VT_PI * (3 - sqrt(5)) + phase, r = sqrt(1 - z * z);
  return vt_v3(r * cos(azimuth), r * sin(azimuth), z);
}

static double best_phase(const spiral *s, int train_count, int test_count) {
  double best = 0, least_cosine = 2;
  for (int p = 0; p < PHASE_COUNT; p++) {
    double phase = 2 * VT_PI * p / PHASE_COUNT, cosine = -1; // of the closest pair
    for (int j = 0; j < test_count && cosine < least_cosine; j++) {
      vt_vec3 test = spiral_direction(s, j, test_count, phase);
      for (int i = 0; i < train_count; i++) cosine = fmax(cosine, vt_dot(test, spiral_direction(s, i, train_count, 0)));
    }
    if (cosine < least_cosine) least_cosine = cosine, best = phase;
  }
  return best;
}

// ---- paths

// Where test view j of `count` stands on a path whose training views stand at 0, 1, ..., gaps (the last gap of a loop
// ends at the first one again).
static double position_between(int j, int count, int gaps) {
  int gap = (int)((long long)j * gaps / count);
  int first = (int)(((long long)gap * count + gaps - 1) / gaps),
      next = (int)(((long long)(gap + 1) * count + gaps - 1) / gaps);
  return gap + (double)(j - first + 1) / (next - first + 1);
}

static place on_arc(const vt_synthetic_desc *desc, bool train, int i) {
  int count = train ? (desc->train_count + 1 - i % 2) / 2 : desc->test_count, index = train ? i / 2 : i;
  double share = train ? (count > 1 ? (double)index / (count - 1) : 0.5) : (index + 0.5) / count;
  double elevation = !train ? 15 : i % 2 ? 25 : 5;
  return (place){.direction = direction_of((share - 0.5) * 100 * degree, elevation * degree), .farther = 1};
}

static place on_drone(const vt_synthetic_desc *desc, bool train, int i) {
  bool alone = desc->train_count == 1; // in the middle of two gaps
  int gaps = alone ? 2 : desc->train_count - 1;
  double position = !train ? position_between(i, desc->test_count, gaps) : alone ? 1 : i, share = position / gaps;
  return (place){.direction = direction_of(share * 6 * VT_PI, (15 + 50 * share) * degree), .farther = 1};
}

static place on_ring(const vt_synthetic_desc *desc, bool train, int i) {
  double position = train ? i : position_between(i, desc->test_count, desc->train_count);
  return (place){.direction = direction_of(2 * VT_PI * position / desc->train_count, 10 * degree), .farther = 1};
}

// An eye at 1.6 m before a tree of 9 m: below the middle. Jitter leaves test views between their neighbours.
static place on_walk(const vt_synthetic_desc *desc, bool train, int i) {
  int per_gap = train ? 0 : (desc->test_count + desc->train_count - 1) / desc->train_count;
  double position = train ? i : position_between(i, desc->test_count, desc->train_count);
  vt_rng rng = vt_seed_rng(desc->seed, WALK_STREAM + 2 * (uint64_t)i + train);
  position += vt_random_between(&rng, -0.3, 0.3) / (per_gap + 2);
  double elevation = vt_random_between(&rng, -9, -4) * degree;
  place p = {.direction = direction_of(2 * VT_PI * position / desc->train_count, elevation)};
  p.yaw = vt_random_between(&rng, -1, 1) * 0.05 * desc->fov_y,
  p.pitch = vt_random_between(&rng, -1, 1) * 0.05 * desc->fov_y;
  p.roll = vt_random_between(&rng, -5, 5) * degree, p.farther = vt_random_between(&rng, 1, 1.08);
  return p;
}

static void place_cameras(const vt_synthetic_desc *desc, place *places) {
  static const spiral part = {-5 * VT_PI / 180, 60 * VT_PI / 180}, half = {0, VT_PI / 2};
  const spiral *s = desc->rig == VT_RIG_SPIRAL ? &part : desc->rig == VT_RIG_HEMISPHERE ? &half : NULL;
  double phase = s ? best_phase(s, desc->train_count, desc->test_count) : 0;
  for (int k = 0; k < desc->train_count + desc->test_count; k++) {
    bool train = k < desc->train_count;
    int i = train ? k : k - desc->train_count;
    if (s)
      places[k] =
          (place){.direction = spiral_direction(s, i, train ? desc->train_count : desc->test_count, train ? 0 : phase),
                  .farther = 1};
    else
      places[k] = desc->rig == VT_RIG_RING    ? on_ring(desc, train, i)
                  : desc->rig == VT_RIG_ARC   ? on_arc(desc, train, i)
                  : desc->rig == VT_RIG_DRONE ? on_drone(desc, train, i)
                                              : on_walk(desc, train, i);
  }
}

// ---- cameras

static bool is_turned(const place *p) {
  return p->yaw != 0 || p->pitch != 0 || p->roll != 0;
}

static vt_mat3 turn_of(const place *p) { // about y, then x, then z of the camera
  double cy = cos(p->yaw), sy = sin(p->yaw), cx = cos(p->pitch), sx = sin(p->pitch), cz = cos(p->roll),
         sz = sin(p->roll);
  vt_mat3 yaw = {{cy, 0, sy, 0, 1, 0, -sy, 0, cy}}, pitch = {{1, 0, 0, 0, cx, -sx, 0, sx, cx}};
  vt_mat3 roll = {{cz, -sz, 0, sz, cz, 0, 0, 0, 1}}, both = vt_mul_mat3(&pitch, &yaw);
  return vt_mul_mat3(&roll, &both);
}

static vt_camera camera_at(const vt_synthetic_desc *desc, const place *p, double distance) {
  vt_camera camera = vt_look_at(vt_scale(p->direction, distance * p->farther), vt_v3(0, 0, 0), vt_v3(0, 0, 1),
                                desc->fov_y, desc->width, desc->height);
  if (!is_turned(p)) return camera;
  vt_mat3 turn = turn_of(p);
  camera.translation = vt_mul(&turn, camera.translation);
  camera.rotation = vt_mul_mat3(&turn, &camera.rotation);
  return camera;
}

// A point stands at (x, y, z + d) before a camera at distance d: inside the frame if |x| <= tan_x (z + d), and so for
// y.
static double distance_for_mesh(const vt_synthetic_desc *desc, const vt_mesh *mesh, const place *p, double tan_x,
                                double tan_y) {
  vt_camera camera = camera_at(desc, p, 1 / p->farther);
  double distance = 0;
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const float *at = mesh->vertices[v].position;
    vt_vec3 q = vt_mul(&camera.rotation, vt_v3(at[0], at[1], at[2]));
    distance = fmax(distance, fmax(fabs(q.x) / tan_x, fabs(q.y) / tan_y) - q.z);
    distance = fmax(distance, 0.1 - q.z); // in front of it, however wide the view
  }
  return distance;
}

// The same for a camera that is turned, and for a ball of `radius` where there is no mesh: side k of the frame asks for
// n.(q + d e) <= -room, e where the turned camera sees its own way back to the origin.
static double distance_for_turned(const vt_synthetic_desc *desc, const vt_mesh *mesh, double radius, const place *p,
                                  double tan_x, double tan_y) {
  vt_camera camera = camera_at(desc, p, 1 / p->farther);
  vt_vec3 e = vt_normalise(camera.translation);
  vt_vec3 sides[4] = {{1, 0, -tan_x}, {-1, 0, -tan_x}, {0, 1, -tan_y}, {0, -1, -tan_y}};
  double distance = 0;
  for (int k = 0; k < 4; k++) {
    vt_vec3 n = vt_normalise(sides[k]);
    double approach = fmax(-vt_dot(n, e), 1e-3);
    if (!mesh) distance = fmax(distance, radius / approach);
    for (size_t v = 0; mesh && v < mesh->vertex_count; v++) {
      const float *at = mesh->vertices[v].position;
      vt_vec3 q = vt_mul(&camera.rotation, vt_v3(at[0], at[1], at[2]));
      distance = fmax(distance, fmax(vt_dot(n, q) / approach, (0.1 - q.z) / e.z));
    }
  }
  return distance;
}

static vt_status name_view(vt_context *ctx, vt_view *view, const char *folder, int i) {
  char name[32];
  snprintf(name, sizeof name, "%s/r_%d.png", folder, i);
  view->name = vt_strdup(ctx, name);
  return view->name ? VT_OK : VT_OUT_OF_MEMORY;
}

vt_status vt_make_rig(vt_context *ctx, const vt_synthetic_desc *desc, const vt_mesh *mesh, double radius,
                      vt_views *out) {
  int train_count = desc->train_count, count = train_count + desc->test_count;
  double tan_y = fill * tan(0.5 * desc->fov_y), tan_x = tan_y * desc->width / desc->height;
  double distance = radius / sin(atan(fmin(tan_x, tan_y)));
  *out = (vt_views){0};
  place *places = VT_NEW(ctx, place, (size_t)count);
  out->items = VT_NEW(ctx, vt_view, (size_t)count);
  vt_status status = places && out->items ? VT_OK : VT_OUT_OF_MEMORY;
  if (!status) place_cameras(desc, places);
  for (int i = 0; i < count && !status; i++) {
    bool train = i < train_count;
    if (is_turned(&places[i]))
      distance = fmax(i ? distance : 0, distance_for_turned(desc, mesh, radius, &places[i], tan_x, tan_y));
    else if (mesh)
      distance = fmax(i ? distance : 0, distance_for_mesh(desc, mesh, &places[i], tan_x, tan_y));
    out->items[i].role = train ? VT_TRAIN : VT_TEST;
    out->count = i + 1;
    status = name_view(ctx, &out->items[i], train ? "train" : "test", train ? i : i - train_count);
  }
  for (int i = 0; i < count && !status; i++) out->items[i].camera = camera_at(desc, &places[i], distance);
  vt_free(ctx, places);
  if (status) vt_free_views(ctx, out);
  return status;
}
