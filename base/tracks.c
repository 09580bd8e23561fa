// tracks.c - points that a calibration found, and where in which photograph it saw them
// SPDX-License-Identifier: BSD-3-Clause
//
// A track is a point of bark, leaf or ground and its pixels in two photographs or more. Whoever adjusts cameras by tracks wants few
// of them, long ones, evenly over the photographs, and none that is wrong: matching leaves some per cent that belong to two
// different leaves. The place X of a track by given cameras is the minimum of sum huber(|pi_i(X) - x_i| / s_i), by Gauss and Newton
// with weights [Holland & Welsch 1977], from where the rays pass each other nearest or from the place that came with it, whichever is
// the better start: one wrong sight spoils the former, wrong cameras the latter. What is then far out among all sights is dropped.
// Cameras may be several deviations off as long as nobody has adjusted them, so far is counted from the median of all sights.

#include "base/tracks.h"

#include <stdlib.h>

#define WIDTH 2.0          // deviations, of Huber's loss
#define FAR 4.0            // times the usual error: a sight that contradicts
#define USUAL 1.177        // median distance in the plane, in deviations along an axis
#define STEPS 8
#define LEAST_SLANT (1.5 * VT_PI / 180) // between two of a track's rays, below which its distance is anything
enum { MOST_SIGHTS = 200 };             // of a track that are looked at

void vt_free_tracks(vt_context *context, vt_tracks *tracks) {
  vt_free(context, tracks->items);
  vt_free(context, tracks->sights);
  *tracks = (vt_tracks){0};
}

static vt_status make_room(vt_context *context, size_t count, size_t sight_count, vt_tracks *out) {
  *out = (vt_tracks){0};
  out->items = VT_NEW(context, vt_track, count + 1);
  out->sights = VT_NEW(context, vt_sight, sight_count + 1);
  if (out->items && out->sights) return VT_OK;
  vt_free_tracks(context, out);
  return VT_OUT_OF_MEMORY;
}

vt_status vt_renumber_tracks(vt_context *context, const vt_tracks *tracks, int view_count, const int *new_number, vt_tracks *out) {
  vt_status status = make_room(context, tracks->count, tracks->sight_count, out);
  for (size_t k = 0; k < tracks->count && !status; k++) {
    const vt_track *track = &tracks->items[k];
    vt_track *copy = &out->items[out->count];
    *copy = (vt_track){track->place, (uint32_t)out->sight_count, 0};
    for (uint32_t i = 0; i < track->count; i++) {
      vt_sight sight = tracks->sights[track->first + i];
      if (sight.view < 0 || sight.view >= view_count || new_number[sight.view] < 0) continue;
      sight.view = new_number[sight.view];
      out->sights[out->sight_count++] = sight, copy->count++;
    }
    if (copy->count) out->count++;
  }
  return status;
}

// ---- one track

double vt_sight_distance(const vt_camera *camera, const vt_sight *sight, vt_vec3 place) {
  double pixel[2];
  if (!vt_project(camera, place, pixel)) return (double)INFINITY;
  return hypot(pixel[0] - (double)sight->pixel[0], pixel[1] - (double)sight->pixel[1]);
}

// a x = b with a symmetric; false where it is (nearly) singular.
static bool solve(const double a[6], const double b[3], double x[3]) { // a: xx xy xz yy yz zz
  double c0 = a[3] * a[5] - a[4] * a[4], c1 = a[2] * a[4] - a[1] * a[5], c2 = a[1] * a[4] - a[2] * a[3];
  double det = a[0] * c0 + a[1] * c1 + a[2] * c2, size = a[0] + a[3] + a[5];
  if (!(fabs(det) > 1e-12 * size * size * size)) return false;
  x[0] = (c0 * b[0] + c1 * b[1] + c2 * b[2]) / det;
  x[1] = (c1 * b[0] + (a[0] * a[5] - a[2] * a[2]) * b[1] + (a[1] * a[2] - a[0] * a[4]) * b[2]) / det;
  x[2] = (c2 * b[0] + (a[1] * a[2] - a[0] * a[4]) * b[1] + (a[0] * a[3] - a[1] * a[1]) * b[2]) / det;
  return isfinite(x[0] + x[1] + x[2]);
}

// Where the rays pass each other nearest.
static bool meet(const vt_camera *cameras, const vt_sight *sights, uint32_t count, vt_vec3 *out) {
  double a[6] = {0}, b[3] = {0}, x[3];
  vt_vec3 base = vt_camera_centre(&cameras[sights[0].view]);
  for (uint32_t i = 0; i < count; i++) {
    vt_ray ray = vt_camera_ray(&cameras[sights[i].view], (double)sights[i].pixel[0], (double)sights[i].pixel[1]);
    vt_vec3 d = ray.direction, o = vt_sub(ray.origin, base);
    double row[6] = {1 - d.x * d.x, -d.x * d.y, -d.x * d.z, 1 - d.y * d.y, -d.y * d.z, 1 - d.z * d.z};
    for (int k = 0; k < 6; k++) a[k] += row[k];
    b[0] += row[0] * o.x + row[1] * o.y + row[2] * o.z;
    b[1] += row[1] * o.x + row[3] * o.y + row[4] * o.z;
    b[2] += row[2] * o.x + row[4] * o.y + row[5] * o.z;
  }
  if (!solve(a, b, x)) return false;
  *out = vt_add(base, vt_v3(x[0], x[1], x[2]));
  return true;
}

// Sum of Huber's losses, in deviations; INFINITY where a camera has it behind itself.
static double cost_at(const vt_camera *cameras, const vt_sight *sights, uint32_t count, vt_vec3 place) {
  double sum = 0;
  for (uint32_t i = 0; i < count; i++) {
    double r = vt_sight_distance(&cameras[sights[i].view], &sights[i], place) / (double)sights[i].deviation;
    sum += r <= WIDTH ? r * r : WIDTH * (2 * r - WIDTH);
  }
  return isfinite(sum) ? sum : (double)INFINITY;
}

static bool step(const vt_camera *cameras, const vt_sight *sights, uint32_t count, vt_vec3 place, vt_vec3 *next) {
  double a[6] = {0}, b[3] = {0}, x[3];
  for (uint32_t i = 0; i < count; i++) {
    const vt_camera *c = &cameras[sights[i].view];
    const double *m = c->rotation.m, s = (double)sights[i].deviation;
    vt_vec3 p = vt_to_camera(c, place);
    double u = p.x / p.z, v = p.y / p.z, ax = c->fx / (p.z * s), ay = c->fy / (p.z * s);
    double ex = ((double)sights[i].pixel[0] - c->cx - c->fx * u) / s, ey = ((double)sights[i].pixel[1] - c->cy - c->fy * v) / s;
    double r = hypot(ex, ey), weight = r <= WIDTH ? 1 : WIDTH / r;
    double jx[3], jy[3];
    for (int k = 0; k < 3; k++) jx[k] = ax * (m[k] - u * m[6 + k]), jy[k] = ay * (m[3 + k] - v * m[6 + k]);
    for (int k = 0, at = 0; k < 3; k++) {
      for (int l = k; l < 3; l++) a[at++] += weight * (jx[k] * jx[l] + jy[k] * jy[l]);
      b[k] += weight * (jx[k] * ex + jy[k] * ey);
    }
  }
  if (!solve(a, b, x)) return false;
  *next = vt_add(place, vt_v3(x[0], x[1], x[2]));
  return true;
}

bool vt_settle_track(const vt_camera *cameras, const vt_sight *sights, uint32_t count, vt_vec3 *place, double *error) {
  vt_vec3 at, next;
  *error = (double)INFINITY;
  if (count < 2) return false;
  bool given = isfinite(place->x + place->y + place->z);
  double cost = given ? cost_at(cameras, sights, count, *place) : (double)INFINITY;
  at = *place;
  if (meet(cameras, sights, count, &next)) {
    double other = cost_at(cameras, sights, count, next);
    if (other < cost) at = next, cost = other;
  }
  if (!isfinite(cost)) return false;
  for (int k = 0; k < STEPS && step(cameras, sights, count, at, &next); k++) {
    double other = cost_at(cameras, sights, count, next);
    if (!(other < cost)) break;
    bool enough = cost - other < 1e-9 * cost;
    at = next, cost = other;
    if (enough) break;
  }
  *place = at, *error = sqrt(cost / count);
  return true;
}

static bool is_slanted(const vt_camera *cameras, const vt_sight *sights, uint32_t count, vt_vec3 place) {
  double least = cos(LEAST_SLANT);
  for (uint32_t i = 0; i < count; i++)
    for (uint32_t j = 0; j < i; j++) {
      vt_vec3 a = vt_normalise(vt_sub(place, vt_camera_centre(&cameras[sights[i].view])));
      vt_vec3 b = vt_normalise(vt_sub(place, vt_camera_centre(&cameras[sights[j].view])));
      if (vt_dot(a, b) < least) return true;
    }
  return false;
}

// ---- the choice

static bool is_sound(const vt_sight *s, int view_count) {
  return s->view >= 0 && s->view < view_count && isfinite(s->pixel[0]) && isfinite(s->pixel[1]) && isfinite(s->deviation) &&
         s->deviation > 0;
}

typedef struct candidate { uint32_t track, count; } candidate;

static int compare_candidates(const void *a, const void *b) {
  const candidate *p = a, *q = b;
  if (p->count != q->count) return p->count < q->count ? 1 : -1;
  return (p->track > q->track) - (p->track < q->track);
}

// Copies the sound sights of the longest tracks that some view still wants.
static vt_status pick_longest(vt_context *context, const vt_tracks *tracks, int view_count, int most, vt_tracks *out) {
  candidate *candidates = VT_NEW(context, candidate, tracks->count + 1);
  int *room = VT_NEW(context, int, (size_t)view_count + 1);
  vt_status status = candidates && room ? make_room(context, tracks->count, tracks->sight_count, out) : VT_OUT_OF_MEMORY;
  for (int i = 0; i < view_count && !status; i++) room[i] = most;
  for (size_t k = 0; k < tracks->count && !status; k++) {
    candidates[k] = (candidate){(uint32_t)k, 0};
    for (uint32_t i = 0; i < tracks->items[k].count; i++)
      candidates[k].count += is_sound(&tracks->sights[tracks->items[k].first + i], view_count);
  }
  if (!status) qsort(candidates, tracks->count, sizeof *candidates, compare_candidates);
  for (size_t n = 0; n < tracks->count && !status && candidates[n].count >= 2; n++) {
    const vt_track *from = &tracks->items[candidates[n].track];
    vt_track *to = &out->items[out->count];
    bool wanted = false;
    *to = (vt_track){from->place, (uint32_t)out->sight_count, 0};
    for (uint32_t i = 0; i < from->count && to->count < MOST_SIGHTS; i++) {
      const vt_sight *sight = &tracks->sights[from->first + i];
      if (!is_sound(sight, view_count)) continue;
      wanted = wanted || room[sight->view] > 0;
      out->sights[to->first + to->count++] = *sight;
    }
    if (!wanted) continue;
    for (uint32_t i = 0; i < to->count; i++) room[out->sights[to->first + i].view]--;
    out->count++, out->sight_count += to->count;
  }
  vt_free(context, candidates);
  vt_free(context, room);
  return status;
}

typedef struct settle_job {
  const vt_camera *cameras;
  vt_tracks *tracks;
  float *error; // [sights] deviations
  double cut;   // of them; 0: they are to be found
} settle_job;

// Places and errors; with a cut, sights beyond it are dropped first, and a track that is nothing then has no sights.
static void settle_some(void *user, size_t begin, size_t end, int worker) {
  (void)worker;
  const settle_job *job = user;
  for (size_t k = begin; k < end; k++) {
    vt_track *track = &job->tracks->items[k];
    vt_sight *sights = job->tracks->sights + track->first;
    float *error = job->error + track->first;
    uint32_t left = 0;
    double unused;
    for (uint32_t i = 0; i < track->count; i++)
      if (!(job->cut > 0) || (double)error[i] <= job->cut) sights[left++] = sights[i];
    bool changed = !(job->cut > 0) || left < track->count;
    track->count = left;
    bool there = !changed || vt_settle_track(job->cameras, sights, left, &track->place, &unused);
    for (uint32_t i = 0; i < left && changed; i++)
      error[i] = there ? (float)(vt_sight_distance(&job->cameras[sights[i].view], &sights[i], track->place) / (double)sights[i].deviation)
                       : INFINITY;
    if (job->cut > 0 && (!there || left < 2 || !is_slanted(job->cameras, sights, left, track->place))) track->count = 0;
  }
}

static int compare_floats(const void *a, const void *b) {
  float p = *(const float *)a, q = *(const float *)b;
  return (p > q) - (p < q);
}

static vt_status usual_error(vt_context *context, const float *error, size_t count, double *out) {
  float *sorted = VT_NEW(context, float, count + 1);
  if (!sorted) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < count; i++) sorted[i] = error[i];
  qsort(sorted, count, sizeof *sorted, compare_floats);
  *out = count ? (double)sorted[count / 2] : 0;
  vt_free(context, sorted);
  return VT_OK;
}

vt_status vt_choose_tracks(vt_context *context, const vt_tracks *tracks, const vt_camera *cameras, int view_count, int most_of_a_view,
                           vt_tracks *out, double *usual_or_null) {
  *out = (vt_tracks){0};
  vt_status status = pick_longest(context, tracks, view_count, most_of_a_view, out);
  if (status) return status;
  settle_job job = {cameras, out, VT_NEW(context, float, out->sight_count + 1), 0};
  double usual = 0;
  status = job.error ? vt_parallel(context, out->count, 64, settle_some, &job) : VT_OUT_OF_MEMORY;
  if (!status) status = usual_error(context, job.error, out->sight_count, &usual);
  usual = fmax(1, isfinite(usual) ? usual / USUAL : 1);
  if (usual_or_null) *usual_or_null = usual;
  job.cut = FAR * usual;
  if (!status) status = vt_parallel(context, out->count, 64, settle_some, &job);
  size_t kept = 0, sights = 0;
  for (size_t k = 0; k < out->count && !status; k++) {
    vt_track track = out->items[k];
    if (!track.count) continue;
    for (uint32_t i = 0; i < track.count; i++) out->sights[sights + i] = out->sights[track.first + i];
    track.first = (uint32_t)sights;
    sights += track.count, out->items[kept++] = track;
  }
  out->count = kept, out->sight_count = sights;
  vt_free(context, job.error);
  if (status) vt_free_tracks(context, out);
  return status;
}
