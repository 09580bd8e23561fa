// rig.c - cameras on a golden spiral around the object
// SPDX-License-Identifier: BSD-3-Clause
//
// Heights are spread evenly (equal areas of the sphere between elevations of -5 and 60 degrees) and each azimuth is the
// last one plus the golden angle, so that any number of views is well spread. Test views run on a second spiral of the
// same kind, turned to the phase at which the test view that is closest to a training view is farthest from it.

#include "datasets-synthetic/rig.h"

enum { PHASE_COUNT = 180 };

static const double fill = 0.84, lowest = -5 * VT_PI / 180, highest = 60 * VT_PI / 180;

static vt_vec3 spiral_direction(int i, int count, double phase) {
  double z = sin(lowest) + (sin(highest) - sin(lowest)) * (i + 0.5) / count;
  double azimuth = i * VT_PI * (3 - sqrt(5)) + phase, r = sqrt(1 - z * z);
  return vt_v3(r * cos(azimuth), r * sin(azimuth), z);
}

static double best_phase(int train_count, int test_count) {
  double best = 0, least_cosine = 2;
  for (int p = 0; p < PHASE_COUNT; p++) {
    double phase = 2 * VT_PI * p / PHASE_COUNT, cosine = -1; // of the closest pair
    for (int j = 0; j < test_count && cosine < least_cosine; j++) {
      vt_vec3 test = spiral_direction(j, test_count, phase);
      for (int i = 0; i < train_count; i++) cosine = fmax(cosine, vt_dot(test, spiral_direction(i, train_count, 0)));
    }
    if (cosine < least_cosine) least_cosine = cosine, best = phase;
  }
  return best;
}

static vt_camera camera_from(const vt_synthetic_desc *desc, vt_vec3 direction, double distance) {
  return vt_look_at(vt_scale(direction, distance), vt_v3(0, 0, 0), vt_v3(0, 0, 1), desc->fov_y, desc->width,
                    desc->height);
}

// A point stands at (x, y, z + d) before a camera at distance d: inside the frame if |x| <= tan_x (z + d), and so for
// y.
static double distance_for_mesh(const vt_synthetic_desc *desc, const vt_mesh *mesh, vt_vec3 direction, double tan_x,
                                double tan_y) {
  vt_camera camera = camera_from(desc, direction, 1);
  double distance = 0;
  for (size_t v = 0; v < mesh->vertex_count; v++) {
    const float *p = mesh->vertices[v].position;
    vt_vec3 q = vt_mul(&camera.rotation, vt_v3(p[0], p[1], p[2]));
    distance = fmax(distance, fmax(fabs(q.x) / tan_x, fabs(q.y) / tan_y) - q.z);
    distance = fmax(distance, 0.1 - q.z); // in front of it, however wide the view
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
  double distance = radius / sin(atan(fmin(tan_x, tan_y))), phase = best_phase(train_count, desc->test_count);
  *out = (vt_views){0};
  vt_vec3 *directions = VT_NEW(ctx, vt_vec3, (size_t)count);
  out->items = VT_NEW(ctx, vt_view, (size_t)count);
  vt_status status = directions && out->items ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < count && !status; i++) {
    bool train = i < train_count;
    int index = train ? i : i - train_count;
    directions[i] = spiral_direction(index, train ? train_count : desc->test_count, train ? 0 : phase);
    if (mesh) distance = fmax(i ? distance : 0, distance_for_mesh(desc, mesh, directions[i], tan_x, tan_y));
    out->items[i].role = train ? VT_TRAIN : VT_TEST;
    out->count = i + 1;
    status = name_view(ctx, &out->items[i], train ? "train" : "test", index);
  }
  for (int i = 0; i < count && !status; i++) out->items[i].camera = camera_from(desc, directions[i], distance);
  vt_free(ctx, directions);
  if (status) vt_free_views(ctx, out);
  return status;
}
