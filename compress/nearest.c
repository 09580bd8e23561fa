// nearest.c - the nearest codeword of many vectors, exactly
// SPDX-License-Identifier: BSD-3-Clause
//
// |x - c|^2 / 2 = |x|^2 / 2 + (|c|^2 / 2 - x.c), so the smallest score s = |c|^2 / 2 - x.c decides, at one product and
// one sum per dimension. Codebook and vectors are taken relative to the codebook's mean, which makes both terms small.
// In float s is still wrong by cancellation, by at most (Higham 2002, section 3.1; u = 2^-24, N = |x| + max |c|)
//     E = u N^2 (d / 2 + 4),
// where d / 2 + 1 comes from the d + 2 roundings of the sum (each relative to |c|^2 / 2 + |x||c| <= N^2 / 2), 1 from
// the subtraction of the mean, the rest is slack. The true minimum is among the codewords with s <= min s + 2E: those,
// about one per vector, are compared by their squared differences in double. The answer is thus the exact one, whatever
// the inner loop. Beyond 1e15, where float squares may overflow, all are compared so.

#include "compress/nearest.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { ROWS = VT_NEAREST_ROWS, LANES = VT_NEAREST_LANES, CHUNK = VT_NEAREST_CHUNK, MAX_DIMENSION = 256 };

static size_t group_count(int codeword_count) {
  return ((size_t)codeword_count + LANES - 1) / LANES;
}

vt_status vt_make_nearest(vt_context *ctx, int dimension, int codeword_count, vt_nearest *out) {
  VT_ASSERT(dimension >= 1 && dimension <= MAX_DIMENSION && codeword_count >= 1 && codeword_count <= 65536);
  size_t groups = group_count(codeword_count);
  *out = (vt_nearest){.path = vt_best_nearest_path(), .dimension = dimension, .codeword_count = codeword_count};
  out->mean = VT_NEW(ctx, float, (size_t)dimension);
  out->packed = VT_NEW(ctx, float, groups *LANES *(size_t)dimension);
  out->half_norm = VT_NEW(ctx, float, groups *LANES);
  if (out->mean && out->packed && out->half_norm) return VT_OK;
  vt_free_nearest(ctx, out);
  return VT_OUT_OF_MEMORY;
}

void vt_free_nearest(vt_context *ctx, vt_nearest *n) {
  vt_free(ctx, n->mean);
  vt_free(ctx, n->packed);
  vt_free(ctx, n->half_norm);
  *n = (vt_nearest){0};
}

void vt_pack_nearest(vt_nearest *n, const float *codewords) {
  size_t dimension = (size_t)n->dimension, count = (size_t)n->codeword_count;
  n->codewords = codewords;
  for (size_t d = 0; d < dimension; d++) {
    double sum = 0;
    for (size_t j = 0; j < count; j++) sum += (double)codewords[j * dimension + d];
    n->mean[d] = (float)(sum / (double)count);
  }
  n->longest = 0;
  for (size_t j = 0; j < group_count(n->codeword_count) * LANES; j++) {
    float *packed = n->packed + j / LANES * dimension * LANES + j % LANES;
    double norm = 0;
    for (size_t d = 0; d < dimension; d++) {
      float c = j < count ? codewords[j * dimension + d] - n->mean[d] : 0;
      packed[d * LANES] = c;
      norm += (double)c * (double)c;
    }
    n->half_norm[j] = j < count ? (float)(norm / 2) : INFINITY;
    if (sqrt(norm) > n->longest) n->longest = sqrt(norm);
  }
}

double vt_squared_distance(int dimension, const float *a, const float *b) {
  double sum[4] = {0}; // four chains of additions instead of one to wait for
  int d = 0;
  for (; d + 4 <= dimension; d += 4)
    for (int i = 0; i < 4; i++) {
      double difference = (double)a[d + i] - (double)b[d + i];
      sum[i] += difference * difference;
    }
  for (int i = 0; d < dimension; d++, i++) {
    double difference = (double)a[d] - (double)b[d];
    sum[i] += difference * difference;
  }
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

typedef struct candidate {
  double distance;
  int code;
} candidate;

// Compares codeword j by its true distance. Candidates come in rising order: a tie stays with the earlier.
static void try_codeword(const vt_nearest *n, const float *x, int j, candidate *best) {
  double distance = vt_squared_distance(n->dimension, x, n->codewords + (size_t)j * (size_t)n->dimension);
  if (distance < best->distance) *best = (candidate){distance, j};
}

static void try_chunk(const vt_nearest *n, const float *x, const float *score, int first, int count, float limit,
                      candidate *best) {
  for (int g = 0; g < count; g += LANES) {
    int hit = 0;
    for (int l = 0; l < LANES; l++) hit |= score[g + l] <= limit;
    for (int l = 0; hit && l < LANES; l++)
      if (score[g + l] <= limit) try_codeword(n, x, first + g + l, best);
  }
}

// The vectors x[ROWS] (of which the first `rows` count) against the whole codebook.
static void find_panel(const vt_nearest *n, const float *const x[ROWS], int rows, candidate best[ROWS]) {
  _Alignas(64) float centred[MAX_DIMENSION * VT_NEAREST_ROWS];
  _Alignas(64) vt_nearest_scores scores;
  float lowest[ROWS], lowest_so_far[ROWS];
  double slack[ROWS];
  bool direct[ROWS];
  for (int r = 0; r < ROWS; r++) {
    double norm = 0;
    for (int d = 0; d < n->dimension; d++) {
      float v = x[r][d] - n->mean[d];
      centred[d * ROWS + r] = v;
      norm += (double)v * (double)v;
    }
    double reach = sqrt(norm) + n->longest;
    slack[r] = 2 * (reach * reach * (n->dimension / 2.0 + 4) * 0x1p-24 + (double)FLT_MIN);
    lowest_so_far[r] = INFINITY;
    best[r] = (candidate){INFINITY, 0};
    direct[r] = !(reach < 1e15);
    for (int j = 0; direct[r] && r < rows && j < n->codeword_count; j++) try_codeword(n, x[r], j, &best[r]);
  }
  int padded = (int)group_count(n->codeword_count) * LANES;
  for (int first = 0; first < padded; first += CHUNK) {
    int count = padded - first < CHUNK ? padded - first : CHUNK;
    vt_score_codewords(n->path, n->dimension, count / LANES, centred, n->packed + (size_t)first * (size_t)n->dimension,
                       n->half_norm + first, scores, lowest);
    for (int r = 0; r < rows; r++) {
      if (direct[r]) continue;
      if (lowest[r] < lowest_so_far[r]) lowest_so_far[r] = lowest[r];
      float limit = nextafterf((float)((double)lowest_so_far[r] + slack[r]), INFINITY);
      try_chunk(n, x[r], scores[r], first, count, limit, &best[r]);
    }
  }
}

void vt_find_nearest(const vt_nearest *n, const float *vectors, const uint32_t *row, size_t count, uint16_t *code,
                     double *distance) {
  for (size_t i = 0; i < count; i += ROWS) {
    int rows = count - i < ROWS ? (int)(count - i) : ROWS;
    const float *x[ROWS];
    candidate best[ROWS];
    for (int r = 0; r < ROWS; r++) {
      size_t at = r < rows ? i + (size_t)r : i;
      x[r] = vectors + (row ? row[at] : at) * (size_t)n->dimension;
    }
    find_panel(n, x, rows, best);
    for (int r = 0; r < rows; r++) {
      code[i + (size_t)r] = (uint16_t)best[r].code;
      if (distance) distance[i + (size_t)r] = best[r].distance;
    }
  }
}
