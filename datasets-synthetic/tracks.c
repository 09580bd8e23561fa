// tracks.c - points of a synthetic tree that photographs really share, seen as a matcher of features sees them
// SPDX-License-Identifier: BSD-3-Clause
//
// A matcher finds what is visible, and finds it again where it still looks alike. So a point is where the ray of a random pixel of a
// random photograph first meets the tree; of the other photographs those see it whose line of sight to it nothing crosses (a ray is
// cast), that look at it from no more than `widest_degrees` from the first, which is about what SIFT stands, and from the same side
// of the leaf. Points that fewer than least_views see are none. Where a photograph says that it saw the point is the projection,
// bent by the lens, with noise; a share of sights lies anywhere, as where two leaves were taken for one. Places are not told: what a
// calibration says of them agrees with its own cameras, which the caller may have damaged.

#include "base/rng.h"
#include "datasets-synthetic/damage_picture.h"
#include "datasets-synthetic/shade_traced.h"

#define OFF_SURFACE 2e-4f // share of a line of sight near its end that may be in the surface itself

vt_track_desc vt_default_track_desc(void) {
  return (vt_track_desc){.cookie = VT_COOKIE, .seed = 1, .count = 1500, .least_views = 3, .widest_degrees = 35, .noise = 0.5, .outlier_share = 0.02};
}

typedef struct track_job {
  const vt_track_desc *desc;
  const vt_mesh *mesh;
  const vt_tracer *tracer;
  const vt_camera *cameras;
  int view_count;
  vt_sight *sights; // [count][view_count]
  uint32_t *seen;   // [count]
} track_job;

static vt_trace_ray ray_to(vt_vec3 from, vt_vec3 to, float far) {
  vt_vec3 d = vt_sub(to, from);
  return (vt_trace_ray){{(float)from.x, (float)from.y, (float)from.z}, 0, {(float)d.x, (float)d.y, (float)d.z}, far};
}

// A place on the surface and its normal towards the eye; false where the random ray meets nothing.
static bool find_point(const track_job *job, vt_rng *rng, int view, vt_vec3 *place, vt_vec3 *normal) {
  const vt_camera *c = &job->cameras[view];
  vt_ray ray = vt_camera_ray(c, vt_random_between(rng, 0, c->width), vt_random_between(rng, 0, c->height));
  vt_trace_ray one = ray_to(ray.origin, vt_add(ray.origin, ray.direction), INFINITY);
  vt_trace_hit hit;
  vt_nearest_hits(job->tracer, &one, 1, &hit);
  if (hit.triangle == VT_NO_HIT) return false;
  vt_vec3 corner[3];
  for (int k = 0; k < 3; k++) {
    const float *p = job->mesh->vertices[job->mesh->triangles[hit.triangle][k]].position;
    corner[k] = vt_v3((double)p[0], (double)p[1], (double)p[2]);
  }
  vt_vec3 a = vt_sub(corner[1], corner[0]), b = vt_sub(corner[2], corner[0]);
  *place = vt_add(corner[0], vt_add(vt_scale(a, (double)hit.u), vt_scale(b, (double)hit.v)));
  *normal = vt_normalise(vt_cross(a, b));
  if (vt_dot(*normal, ray.direction) > 0) *normal = vt_scale(*normal, -1);
  return true;
}

static bool sees(const track_job *job, int view, vt_vec3 place, vt_vec3 normal, vt_vec3 first_line, double pixel[2]) {
  const vt_camera *c = &job->cameras[view];
  vt_vec3 eye = vt_camera_centre(c), line = vt_normalise(vt_sub(place, eye));
  double k1 = job->desc->distortion;
  if (vt_dot(line, first_line) < cos(job->desc->widest_degrees * VT_PI / 180) || vt_dot(line, normal) > -0.15) return false;
  if (!vt_project(c, place, pixel)) return false;
  double x = (pixel[0] - c->cx) / c->fx, y = (pixel[1] - c->cy) / c->fy, bend = 1 + k1 * (x * x + y * y);
  pixel[0] = c->cx + c->fx * x * bend, pixel[1] = c->cy + c->fy * y * bend;
  if (!(pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < c->width && pixel[1] < c->height)) return false;
  vt_trace_ray ray = ray_to(eye, place, 1 - OFF_SURFACE);
  bool stopped;
  vt_any_hits(job->tracer, &ray, 1, &stopped);
  return !stopped;
}

static void look_for_points(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  const track_job *job = user;
  const vt_track_desc *d = job->desc;
  for (size_t k = begin; k < end; k++) {
    vt_rng rng = vt_seed_rng(d->seed, 1000 + k);
    vt_vec3 place = {0, 0, 0}, normal = {0, 0, 0};
    int view = 0;
    bool there = false;
    for (int trial = 0; trial < 200 && !there; trial++) {
      view = (int)(vt_random_unit(&rng) * job->view_count);
      there = find_point(job, &rng, view, &place, &normal);
    }
    vt_vec3 line = vt_normalise(vt_sub(place, vt_camera_centre(&job->cameras[view])));
    for (int i = 0; i < job->view_count && there; i++) {
      double pixel[2], off[2] = {d->noise * vt_random_normal(&rng), d->noise * vt_random_normal(&rng)}, wrong = vt_random_unit(&rng);
      double lost[2] = {vt_random_between(&rng, 0, job->cameras[i].width), vt_random_between(&rng, 0, job->cameras[i].height)};
      if (!sees(job, i, place, normal, line, pixel)) continue;
      vt_sight *sight = &job->sights[k * (size_t)job->view_count + job->seen[k]++];
      *sight = (vt_sight){i, (float)fmax(d->noise, 1e-3), {(float)(pixel[0] + off[0]), (float)(pixel[1] + off[1])}};
      if (wrong < d->outlier_share) sight->pixel[0] = (float)lost[0], sight->pixel[1] = (float)lost[1];
    }
  }
}

// The points that enough photographs see, one behind the other.
static vt_status gather(vt_context *context, const track_job *job, vt_tracks *out) {
  size_t sights = 0, count = (size_t)job->desc->count;
  for (size_t k = 0; k < count; k++) sights += job->seen[k];
  out->items = VT_NEW(context, vt_track, count + 1);
  out->sights = VT_NEW(context, vt_sight, sights + 1);
  if (!out->items || !out->sights) return VT_OUT_OF_MEMORY;
  vt_vec3 unknown = {(double)NAN, (double)NAN, (double)NAN};
  for (size_t k = 0; k < count; k++) {
    if ((int)job->seen[k] < job->desc->least_views) continue;
    out->items[out->count++] = (vt_track){unknown, (uint32_t)out->sight_count, job->seen[k]};
    for (uint32_t i = 0; i < job->seen[k]; i++) out->sights[out->sight_count++] = job->sights[k * (size_t)job->view_count + i];
  }
  return VT_OK;
}

vt_status vt_make_synthetic_tracks(vt_context *context, const vt_synthetic_desc *scene, const vt_track_desc *desc,
                                   const vt_camera *cameras, int view_count, vt_tracks *out) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->count >= 0 && desc->least_views >= 2 && !vt_is_phantom(scene->kind));
  vt_mesh mesh = {0};
  vt_look look = {0};
  vt_tracer *tracer = NULL;
  size_t count = (size_t)desc->count, views = (size_t)view_count;
  *out = (vt_tracks){0};
  track_job job = {desc, &mesh, NULL, cameras, view_count, VT_NEW(context, vt_sight, count * views + 1), VT_NEW(context, uint32_t, count + 1)};
  vt_status status = job.sights && job.seen ? vt_make_synthetic_mesh(context, scene, &mesh) : VT_OUT_OF_MEMORY;
  if (!status) status = vt_make_look(context, &mesh, vt_v3(0, 0, 1), &look);
  if (!status) status = vt_trace_look(context, &look, mesh.vertices, &tracer);
  job.tracer = tracer;
  if (!status) status = vt_parallel(context, count, 16, look_for_points, &job);
  if (!status) status = gather(context, &job, out);
  vt_destroy_tracer(context, tracer);
  vt_free_mesh(context, &mesh);
  vt_free(context, job.sights);
  vt_free(context, job.seen);
  if (status) vt_free_tracks(context, out);
  return status;
}
