// match_tiles.c - texels that add up to the photograph at the photograph's own camera
// SPDX-License-Identifier: BSD-3-Clause
//
// Tiles on the photograph's grid have a texel for each pixel that a cell covers, so a pixel's ray meets texels that no
// other ray meets, and what they should be can be decided ray by ray. With s_k the depth of cell k on the ray, l_k its chord and
// W = -ln(1 - a) what the matte asks for:
//
//   depth    d_k = min(R s_k, D), R such that sum_k l_k d_k = W        D: the depth that alpha 255 stands for
//            W counts to 1 here; what a denser pixel asks for beyond that goes where it is dense already, by d_k^2. In
//            proportion, all cells on its ray would grow, and the silhouette in other views be too fat: 0.5 dB on held-out
//            photographs of maple
//   code     front to back, the code beside d_k that brings the sum so far closest to what it should be: what rounding one
//            cell adds or takes, the next ones make good
//   colour   with w_k = T_k a_k what cell k adds to the pixel, and c_k what its texel has been given (the photograph's
//            colour where the view sees it, the cell's own where not):
//            c_k += w_k (C - sum w c / sum w) sum w / sum w^2
//            the smallest change, in squares, with which the ray shows the photograph's colour C [Kaczmarz 1937]. Cells that show
//            take it up, hidden ones keep what other views know of them.
//
// A cell whose projection is wider than its tile shows the texel at the rim beyond it. That texel belongs to another ray:
// here it counts as it was made, and the others on the ray make up for it. Where the matte is opaque it only says "at
// least this much", and denser cells stay as they are.

#include "reconstruct/match_tiles.h"

#include <math.h>

#define OPAQUE_LEFT (0.5f / 255) // transmittance of alpha 255, in mattes and in texels [octree.h]
#define SHARED_LEFT 0.35f        // transmittance down to which depth is shared out in proportion
#define LEAST_LEFT 0.005f        // and that at which a pixel is opaque
#define LEAST_DEPTH 1e-4f        // per edge, added so that a ray through all but empty cells has something to thicken
#define THICKENINGS 6            // more than one where cells come to be opaque
#define LEAST_MISSING 0.02f      // of an optical depth, that is taken for none
#define MOST_TAU 12.0f           // optical depth behind which nothing shows
#define COLOUR_STEPS 3           // more than one where colours run against black or white

typedef struct hit { // a cell on a ray
  uint8_t *texel;    // that the pixel sees; NULL: it belongs to another pixel
  float length, depth, wanted;
} hit;

enum { ALL, SEEN, LIMITED, CLAMPED, ROUNDING, CHORD, CLAMPED_CHORD, PRUNED, SUM_COUNT };

typedef struct match_job {
  const vt_rays *rays;
  const vt_agreement *agreement;
  const int32_t (*corner)[2];
  const vt_tree *tree;
  const vt_tiles *tiles;
  const float *s;
  float ratio_limit, most;
  float depth_of[256];
  hit *hits; // [VT_LANES][capacity]
  size_t capacity;
  double sums[VT_LANES][SUM_COUNT];
} match_job;

static int clamp_int(int i, int last) { return i < 0 ? 0 : i > last ? last : i; }

// The cells with a tile on the ray.
static size_t find_hits(const match_job *job, const vt_swept_ray *ray, hit *hits, double *sums) {
  const uint32_t *tile_of = job->tiles->tile_of + (size_t)ray->view * job->tiles->cell_count;
  const vt_fimage *ratio = &job->agreement->log_ratio[ray->view];
  int n = job->tree->texel_edge;
  size_t count = 0;
  for (size_t k = 0; k < ray->chord_count; k++) {
    uint32_t cell = ray->chords[k].cell, tile = tile_of[cell];
    if (tile == VT_NO_TILE) continue;
    int left = job->corner[tile][0], top = job->corner[tile][1];
    int column = clamp_int(ray->x - left, n - 1), row = clamp_int(ray->y - top, n - 1);
    hit *h = &hits[count++];
    *h = (hit){.length = ray->chords[k].length, .depth = job->s[cell] + LEAST_DEPTH};
    sums[CHORD] += (double)h->length;
    if (left + column == ray->x && top + row == ray->y) {
      h->texel = job->tiles->texels + 4 * ((size_t)tile * (size_t)(n * n) + (size_t)(row * n + column));
      continue;
    }
    sums[CLAMPED_CHORD] += (double)h->length;
    int x = clamp_int(left + column, ratio->width - 1), y = clamp_int(top + row, ratio->height - 1);
    h->depth = fminf(job->s[cell] * expf(ratio->pixels[(size_t)y * (size_t)ratio->width + (size_t)x]), job->most);
  }
  return count;
}

// Depths of the ray's own texels, sum l d = wanted; returns by how much that fails.
static float share_out(const match_job *job, hit *hits, size_t count, float wanted, bool at_least) {
  float fixed = 0, natural = 0, capped = 0, ratio = 1;
  for (size_t k = 0; k < count; k++) {
    if (hits[k].texel) natural += hits[k].length * fminf(hits[k].depth, job->most);
    else fixed += hits[k].length * hits[k].depth;
  }
  float rest = fmaxf(wanted - fixed, 0);
  if (!(at_least && natural >= rest))
    for (int i = 0; i < 4; i++) {
      float loose = 0;
      capped = 0;
      for (size_t k = 0; k < count; k++) {
        if (!hits[k].texel) continue;
        if (i && hits[k].depth * ratio >= job->most) capped += hits[k].length * job->most;
        else loose += hits[k].length * hits[k].depth;
      }
      if (!(loose > 0)) break;
      ratio = fminf(fmaxf(rest - capped, 0) / loose, job->ratio_limit);
    }
  float got = fixed;
  for (size_t k = 0; k < count; k++) {
    hits[k].wanted = hits[k].texel ? fminf(hits[k].depth * ratio, job->most) : hits[k].depth;
    if (hits[k].texel) got += hits[k].length * hits[k].wanted;
  }
  return at_least && got > wanted ? 0 : wanted - got;
}

// More depth where there is much; returns what is still missing.
static float thicken(const match_job *job, hit *hits, size_t count, float wanted) {
  float got = 0, squares = 0, left = wanted;
  for (size_t k = 0; k < count; k++) {
    got += hits[k].length * hits[k].wanted;
    if (hits[k].texel) squares += hits[k].length * hits[k].wanted * hits[k].wanted;
  }
  float rise = squares > 0 ? fmaxf(wanted - got, 0) / squares : 0;
  for (size_t k = 0; k < count; k++) {
    if (hits[k].texel) hits[k].wanted = fminf(hits[k].wanted * (1 + rise * hits[k].wanted), job->most);
    left -= hits[k].length * hits[k].wanted;
  }
  return fmaxf(left, 0);
}

static uint8_t code_of(float depth) {
  float code = 255 * (1 - expf(-depth)) + 0.5f;
  return code > 255 ? 255 : (uint8_t)code;
}

// Codes whose sum along the ray follows that of the depths.
static void write_codes(const match_job *job, hit *hits, size_t count) {
  float rest = 0;
  for (size_t k = 0; k < count; k++) {
    if (!hits[k].texel) continue;
    float aim = hits[k].wanted + rest / hits[k].length;
    int code = code_of(hits[k].wanted), best = code;
    for (int c = code - 1; c <= code + 1 && hits[k].wanted > 0; c++)
      if (c >= 0 && c <= 255 && fabsf(job->depth_of[c] - aim) < fabsf(job->depth_of[best] - aim)) best = c;
    rest += hits[k].length * (hits[k].wanted - job->depth_of[best]);
    hits[k].texel[3] = (uint8_t)best;
    hits[k].wanted = job->depth_of[best];
  }
}

// The smallest change of the texels' colours with which the ray shows the photograph's; hits[].depth becomes the weight.
static void match_colour(hit *hits, size_t count, const uint8_t *pixel) {
  float through = 1, total = 0, squares = 0;
  for (size_t k = 0; k < count; k++) {
    float behind = through * expf(-hits[k].wanted * hits[k].length);
    hits[k].depth = hits[k].texel ? through - behind : 0;
    total += hits[k].depth;
    squares += hits[k].depth * hits[k].depth;
    through = behind;
  }
  if (!(total > 1.0f / 255)) return;
  for (int c = 0; c < 3; c++)
    for (int i = 0; i < COLOUR_STEPS; i++) {
      float sum = 0;
      for (size_t k = 0; k < count; k++)
        if (hits[k].texel) sum += hits[k].depth * (float)hits[k].texel[c];
      float step = ((float)pixel[c] - sum / total) * total / squares;
      for (size_t k = 0; k < count; k++) {
        if (!hits[k].texel) continue;
        float colour = (float)hits[k].texel[c] + hits[k].depth * step + 0.5f;
        hits[k].texel[c] = (uint8_t)(colour < 0 ? 0 : colour > 255 ? 255 : colour);
      }
    }
}

// What cells without a tile would have shown on the ray, 0..1.
static float pruned_part(const match_job *job, const vt_swept_ray *ray) {
  const uint32_t *tile_of = job->tiles->tile_of + (size_t)ray->view * job->tiles->cell_count;
  float tau = 0, sum = 0;
  for (size_t k = 0; k < ray->chord_count && tau < MOST_TAU; k++) {
    uint32_t cell = ray->chords[k].cell;
    float behind = tau + job->s[cell] * ray->chords[k].length;
    if (tile_of[cell] == VT_NO_TILE) sum += expf(-tau) - expf(-behind);
    tau = behind;
  }
  return sum;
}

static void visit(void *user, const vt_swept_ray *ray) {
  match_job *job = user;
  hit *hits = job->hits + job->capacity * (size_t)ray->lane;
  double *sums = job->sums[ray->lane], alpha = ray->pixel[3] / 255.0;
  float pruned = pruned_part(job, ray);
  size_t count = find_hits(job, ray, hits, sums);
  sums[PRUNED] += (double)pruned * (double)pruned;
  if (!count) return;
  bool opaque = ray->pixel[3] == 255, clamped = false;
  float wanted = -logf(fmaxf(1 - (float)ray->pixel[3] / 255.0f, LEAST_LEFT)), shared = fminf(wanted, -logf(SHARED_LEFT)), depth = 0;
  float missing = share_out(job, hits, count, shared, opaque);
  for (int i = 0; i < THICKENINGS && wanted > shared && (i == 0 || missing > LEAST_MISSING); i++)
    missing = thicken(job, hits, count, wanted);
  write_codes(job, hits, count);
  match_colour(hits, count, ray->pixel);
  for (size_t k = 0; k < count; k++) {
    depth += hits[k].length * hits[k].wanted;
    clamped = clamped || !hits[k].texel;
  }
  double error = 1 - exp((double)-depth) - alpha, squared = opaque && depth > wanted ? 0 : error * error;
  sums[SEEN] += alpha * alpha;
  sums[fabsf(missing) < LEAST_MISSING ? ROUNDING : clamped ? CLAMPED : LIMITED] += squared;
}

static void report_errors(const match_job *job, vt_match_report *out) {
  const vt_reduced_views *views = job->rays->views;
  double sum[SUM_COUNT] = {0}, pixels = 0;
  for (int lane = 0; lane < VT_LANES; lane++)
    for (int i = 0; i < SUM_COUNT; i++) sum[i] += job->sums[lane][i];
  for (int v = 0; v < views->count; v++) {
    size_t count = (size_t)views->pictures[v].width * (size_t)views->pictures[v].height;
    pixels += (double)count;
    for (size_t i = 0; i < count; i++) {
      double alpha = views->pictures[v].pixels[4 * i + 3] / 255.0;
      sum[ALL] += alpha * alpha;
    }
  }
  *out = (vt_match_report){0};
  if (!(pixels > 0)) return;
  out->no_cells = fmax(sum[ALL] - sum[SEEN], 0) / pixels;
  out->limited = sum[LIMITED] / pixels;
  out->clamped = sum[CLAMPED] / pixels;
  out->rounding = sum[ROUNDING] / pixels;
  out->pruned_energy = sum[PRUNED] / pixels;
  out->rmse = sqrt(out->no_cells + out->limited + out->clamped + out->rounding);
  out->clamped_share = sum[CHORD] > 0 ? sum[CLAMPED_CHORD] / sum[CHORD] : 0;
}

vt_status vt_match_tiles(vt_context *context, const vt_rays *rays, const vt_agreement *agreement, const int32_t (*corner)[2],
                         float ratio_limit, vt_tree *tree, vt_match_report *report) {
  const vt_level *level = &tree->octree.levels[rays->level];
  VT_ASSERT(tree->tiles[rays->level].grid == rays->views->factor && ratio_limit >= 1);
  match_job job = {.rays = rays, .agreement = agreement, .corner = corner, .tree = tree, .tiles = &tree->tiles[rays->level],
                   .s = level->optical_depth, .ratio_limit = ratio_limit, .most = -logf(OPAQUE_LEFT)};
  for (int i = 0; i < 256; i++) job.depth_of[i] = -logf(fmaxf(1 - (float)i / 255, OPAQUE_LEFT));
  job.capacity = vt_max_segments(level);
  job.hits = VT_NEW(context, hit, job.capacity * VT_LANES);
  if (!job.hits) return VT_OUT_OF_MEMORY;
  vt_status status = vt_sweep_rays(context, rays, NULL, 0, visit, &job);
  if (!status) report_errors(&job, report);
  vt_free(context, job.hits);
  return status;
}
