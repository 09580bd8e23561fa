// clutter_region.c - where the tree stands, and what all photographs together allow to be tree
// SPDX-License-Identifier: BSD-3-Clause
//
// People aim at what they photograph: the tree stands at the point nearest to the optical axes, sum |(I - d d^T)(x -
// c)|^2 -> min, and it fits into the frames: it reaches no farther than half the longer side of a picture at its
// distance. From a narrow arc the axes are nearly parallel and meet anywhere; the distance is then the median of the
// landmarks' depths in the middle of each picture, where the tree is.
//
// The vote. A cell of a coarse grid over the sphere is tree as far as the photographs that have it in their frame
// agree: the geometric mean of how much tree each shows around the cell's projection (space carving [Kutulakos, Seitz
// 2000] with soft silhouettes, and with room for some photographs to err or to have something before the tree). Seen
// from a photograph, what is the largest vote along each line of sight? Where it is small, no place within the region
// could be tree and agree with the others; so a patch that only this photograph takes for tree is rest. Where users
// drew, their word counts fourfold, and so it is carried to the other photographs: a stroke "not tree" empties all
// cells behind it. What goes wrong: cells are as big as 1/40 of the radius, gaps between leaves are smaller, and the
// vote says nothing about them; from a narrow arc it says little about depth.

#include "capture/clutter.h"
#include "capture/scribbles.h"

#include <stdlib.h>
#include <string.h>

enum { GRID = 80, BLOCK = 8 };        // cells a side; pixels of a coarse cell
enum { VOTERS = 48, WITNESSES = 64 }; // photographs that vote, that say how far away the tree is
#define PARALLEL_SPREAD 0.05          // mean sin^2 of the axes' angles to their mean, below which they are parallel
#define LEAST_SHARE 0.02f

bool vt_clutter_project(const vt_clutter_photo *photo, vt_vec3 world, double pixel[2]) {
  vt_vec3 p = vt_add(vt_mul(&photo->rotation, world), photo->translation);
  if (!(p.z > 1e-9)) return false;
  double x = p.x / p.z, y = p.y / p.z;
  const vt_lens *lens = &photo->lens;
  // far outside a lens' polynomial may turn back into the picture
  if (fabs(x) * lens->fx > 2.0 * lens->width || fabs(y) * lens->fy > 2.0 * lens->height) return false;
  vt_lens_project(lens, x, y, pixel);
  return pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < lens->width && pixel[1] < lens->height;
}

static vt_vec3 centre_of(const vt_clutter_photo *photo) {
  return vt_scale(vt_mul_transposed(&photo->rotation, photo->translation), -1);
}

static vt_vec3 axis_of(const vt_clutter_photo *photo) {
  return vt_v3(photo->rotation.m[6], photo->rotation.m[7], photo->rotation.m[8]);
}

// ---- focus and radius

static int compare_doubles(const void *a, const void *b) {
  double p = *(const double *)a, q = *(const double *)b;
  return (p > q) - (p < q);
}

static double median(double *values, size_t count) {
  qsort(values, count, sizeof *values, compare_doubles);
  return values[count / 2];
}

// Point nearest to the axes; false where they are parallel, or meet behind some of the cameras.
static bool meet_axes(const vt_clutter *clutter, vt_vec3 *out) {
  double a[6] = {0}; // xx xy xz yy yz zz
  vt_vec3 b = {0, 0, 0}, mean = {0, 0, 0};
  for (int i = 0; i < clutter->count; i++) mean = vt_add(mean, axis_of(&clutter->photos[i]));
  mean = vt_normalise(mean);
  double spread = 0;
  for (int i = 0; i < clutter->count; i++) {
    vt_vec3 d = axis_of(&clutter->photos[i]), c = centre_of(&clutter->photos[i]);
    double along = vt_dot(d, c), cosine = vt_dot(d, mean);
    a[0] += 1 - d.x * d.x, a[1] -= d.x * d.y, a[2] -= d.x * d.z, a[3] += 1 - d.y * d.y, a[4] -= d.y * d.z,
        a[5] += 1 - d.z * d.z;
    b = vt_add(b, vt_sub(c, vt_scale(d, along)));
    spread += (1 - cosine * cosine) / clutter->count;
  }
  double c00 = a[3] * a[5] - a[4] * a[4], c01 = a[2] * a[4] - a[1] * a[5], c02 = a[1] * a[4] - a[2] * a[3];
  double determinant = a[0] * c00 + a[1] * c01 + a[2] * c02;
  if (spread < PARALLEL_SPREAD || !(fabs(determinant) > 1e-12)) return false;
  double c11 = a[0] * a[5] - a[2] * a[2], c12 = a[1] * a[2] - a[0] * a[4], c22 = a[0] * a[3] - a[1] * a[1];
  *out = vt_scale(
      vt_v3(c00 * b.x + c01 * b.y + c02 * b.z, c01 * b.x + c11 * b.y + c12 * b.z, c02 * b.x + c12 * b.y + c22 * b.z),
      1 / determinant);
  for (int i = 0; i < clutter->count; i++)
    if (vt_dot(vt_sub(*out, centre_of(&clutter->photos[i])), axis_of(&clutter->photos[i])) <= 0) return false;
  return true;
}

// Median depth of the landmarks in the middle half of the picture; 0 if there are too few.
static double middle_depth(const vt_clutter_photo *photo, int place, const vt_landmarks *landmarks, double *depths) {
  size_t count = 0;
  for (size_t k = 0; k < landmarks->count; k++) {
    const vt_landmark *point = &landmarks->items[k];
    double pixel[2];
    bool seen = false;
    for (uint32_t s = 0; s < point->count && !seen; s++) seen = landmarks->seen_by[point->first + s] == place;
    if (!seen || !vt_clutter_project(photo, point->position, pixel)) continue;
    if (fabs(pixel[0] / photo->lens.width - 0.5) > 0.25 || fabs(pixel[1] / photo->lens.height - 0.5) > 0.25) continue;
    depths[count++] = vt_dot(vt_sub(point->position, centre_of(photo)), axis_of(photo));
  }
  return count < 5 ? 0 : median(depths, count);
}

static vt_status focus_by_landmarks(vt_context *context, const vt_landmarks *landmarks, vt_clutter *clutter) {
  double *depths = VT_NEW(context, double, landmarks->count + 1);
  if (!depths) return VT_OUT_OF_MEMORY;
  vt_vec3 sum = {0, 0, 0};
  int count = 0;
  for (int i = 0; i < clutter->count; i += clutter->count / WITNESSES + 1) {
    double depth = middle_depth(&clutter->photos[i], i, landmarks, depths);
    if (depth <= 0) continue;
    sum = vt_add(sum, vt_add(centre_of(&clutter->photos[i]), vt_scale(axis_of(&clutter->photos[i]), depth)));
    count++;
  }
  vt_free(context, depths);
  if (!count)
    return vt_fail(
        context, VT_BAD_INPUT,
        "clutter: the cameras look in nearly one direction, and there are no points of a calibration that say how far "
        "away the tree is; give the photographs or a COLMAP model instead of transforms.json, or masks of all "
        "photographs (--masks)");
  clutter->focus = vt_scale(sum, 1.0 / count);
  return VT_OK;
}

vt_status vt_find_clutter_region(vt_context *context, const vt_landmarks *landmarks, vt_clutter *clutter) {
  vt_status status = meet_axes(clutter, &clutter->focus) ? VT_OK : focus_by_landmarks(context, landmarks, clutter);
  double *reach = VT_NEW(context, double, (size_t)clutter->count);
  if (!reach) status = VT_OUT_OF_MEMORY;
  for (int i = 0; i < clutter->count && !status; i++) {
    const vt_lens *lens = &clutter->photos[i].lens;
    double half = fmax(lens->width / (2 * lens->fx), lens->height / (2 * lens->fy));
    reach[i] = vt_length(vt_sub(clutter->focus, centre_of(&clutter->photos[i]))) * fmin(half, 0.9);
  }
  if (!status) clutter->radius = median(reach, (size_t)clutter->count);
  vt_free(context, reach);
  return status;
}

// ---- the vote

typedef struct shares {
  int width, height;
  float *tree;   // [height][width] how much of the block is tree, times three, at most 1
  float *weight; // [height][width] 1, more where the user spoke
} shares;

typedef struct vote_job {
  vt_clutter *clutter;
  shares *shares; // [count]
  int *voters, voter_count;
  uint8_t *votes; // [GRID][GRID][GRID]
  double cell;
} vote_job;

static vt_vec3 cell_centre(const vote_job *job, int x, int y, int z) {
  double half = GRID / 2.0 - 0.5;
  return vt_add(job->clutter->focus, vt_v3((x - half) * job->cell, (y - half) * job->cell, (z - half) * job->cell));
}

static bool in_sphere(int x, int y, int z) {
  double half = GRID / 2.0 - 0.5, dx = x - half, dy = y - half, dz = z - half;
  return dx * dx + dy * dy + dz * dz <= half * half;
}

static void sum_shares(void *user, size_t begin, size_t end, int worker) {
  vote_job *job = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    const vt_clutter_photo *photo = &job->clutter->photos[i];
    shares *s = &job->shares[i];
    int width = photo->picture.width, height = photo->picture.height;
    for (int y = 0; y < s->height; y++)
      for (int x = 0; x < s->width; x++) {
        int count = 0, tree = 0, said = 0, ignored = 0;
        for (int v = y * BLOCK; v < (y + 1) * BLOCK && v < height; v++)
          for (int u = x * BLOCK; u < (x + 1) * BLOCK && u < width; u++, count++) {
            size_t p = (size_t)v * (size_t)width + (size_t)u;
            tree += photo->tree[p];
            ignored += photo->ignored.pixels && photo->ignored.pixels[p];
            said += photo->said && photo->said[p] != VT_SAID_NOTHING;
          }
        size_t at = (size_t)y * (size_t)s->width + (size_t)x;
        s->tree[at] = fminf(1, 3 * (float)tree / (255 * (float)count));
        s->weight[at] = 2 * ignored > count ? 0 : 1 + 3 * (float)said / (float)count;
      }
  }
}

static void vote_slices(void *user, size_t begin, size_t end, int worker) {
  vote_job *job = user;
  (void)worker;
  for (int z = (int)begin; z < (int)end; z++)
    for (int y = 0; y < GRID; y++)
      for (int x = 0; x < GRID; x++) {
        if (!in_sphere(x, y, z)) continue;
        vt_vec3 at = cell_centre(job, x, y, z);
        double sum = 0, weights = 0, pixel[2];
        for (int v = 0; v < job->voter_count; v++) {
          int i = job->voters[v];
          if (!vt_clutter_project(&job->clutter->photos[i], at, pixel)) continue;
          const shares *s = &job->shares[i];
          size_t cell = (size_t)(pixel[1] / BLOCK) * (size_t)s->width + (size_t)(pixel[0] / BLOCK);
          sum += (double)(s->weight[cell] * logf(fmaxf(s->tree[cell], LEAST_SHARE)));
          weights += (double)s->weight[cell];
        }
        // what most photographs do not have in their frame is not what they were taken of
        bool framed = weights > 0 && weights * 2 >= job->voter_count;
        job->votes[((size_t)z * GRID + (size_t)y) * GRID + (size_t)x] =
            framed ? (uint8_t)(255 * exp(sum / weights) + 0.5) : 0;
      }
}

// The largest vote on each line of sight.
static void look_at_votes(void *user, size_t begin, size_t end, int worker) {
  vote_job *job = user;
  (void)worker;
  for (size_t i = begin; i < end; i++) {
    vt_clutter_photo *photo = &job->clutter->photos[i];
    vt_image *out = &photo->possible;
    memset(out->pixels, 0, (size_t)out->width * (size_t)out->height);
    for (int z = 0; z < GRID; z++)
      for (int y = 0; y < GRID; y++)
        for (int x = 0; x < GRID; x++) {
          uint8_t vote = job->votes[((size_t)z * GRID + (size_t)y) * GRID + (size_t)x];
          double pixel[2];
          vt_vec3 at = cell_centre(job, x, y, z);
          if (!vote || !vt_clutter_project(photo, at, pixel)) continue;
          double depth = vt_dot(vt_sub(at, centre_of(photo)), axis_of(photo));
          double half = 0.6 * job->cell * photo->lens.fx / depth / BLOCK, u = pixel[0] / BLOCK, v = pixel[1] / BLOCK;
          for (int n = (int)fmax(0, v - half); n <= v + half && n < out->height; n++)
            for (int m = (int)fmax(0, u - half); m <= u + half && m < out->width; m++) {
              uint8_t *most = &out->pixels[(size_t)n * (size_t)out->width + (size_t)m];
              if (vote > *most) *most = vote;
            }
        }
  }
}

static vt_status make_vote_job(vt_context *context, vt_clutter *clutter, vote_job *job) {
  size_t count = (size_t)clutter->count;
  *job = (vote_job){.clutter = clutter, .cell = 2 * clutter->radius / GRID};
  job->shares = VT_NEW(context, shares, count);
  job->voters = VT_NEW(context, int, count);
  job->votes = VT_NEW(context, uint8_t, (size_t)GRID * GRID * GRID);
  if (!job->shares || !job->voters || !job->votes) return VT_OUT_OF_MEMORY;
  for (int i = 0; i < clutter->count; i++) {
    vt_clutter_photo *photo = &clutter->photos[i];
    shares *s = &job->shares[i];
    s->width = (photo->picture.width + BLOCK - 1) / BLOCK;
    s->height = (photo->picture.height + BLOCK - 1) / BLOCK;
    s->tree = VT_NEW(context, float, (size_t)s->width *(size_t)s->height);
    s->weight = VT_NEW(context, float, (size_t)s->width *(size_t)s->height);
    if (!s->tree || !s->weight) return VT_OUT_OF_MEMORY;
    vt_status status =
        photo->possible.pixels ? VT_OK : vt_make_image(context, s->width, s->height, 1, &photo->possible);
    if (status) return status;
  }
  // all where there are few, and always those the user drew on
  for (int i = 0; i < clutter->count; i++)
    if (clutter->count <= VOTERS || clutter->photos[i].said ||
        (int64_t)i * VOTERS / clutter->count != (int64_t)(i + 1) * VOTERS / clutter->count)
      job->voters[job->voter_count++] = i;
  return VT_OK;
}

vt_status vt_vote_clutter(vt_context *context, vt_clutter *clutter) {
  vote_job job;
  size_t count = (size_t)clutter->count;
  vt_status status = make_vote_job(context, clutter, &job);
  if (!status) status = vt_parallel(context, count, 1, sum_shares, &job);
  if (!status) status = vt_parallel(context, GRID, 2, vote_slices, &job);
  if (!status) status = vt_parallel(context, count, 1, look_at_votes, &job);
  for (size_t i = 0; i < count && job.shares; i++) {
    vt_free(context, job.shares[i].tree);
    vt_free(context, job.shares[i].weight);
  }
  vt_free(context, job.shares);
  vt_free(context, job.voters);
  vt_free(context, job.votes);
  return status;
}
