// gla.c - codebooks by the generalised Lloyd algorithm
// SPDX-License-Identifier: BSD-3-Clause
//
// Linde, Buzo & Gray 1980: minimise D = sum_i w_i |x_i - c(i)|^2 / sum_i w_i by turns of the nearest codeword for every
// vector and the weighted mean of every cell. Neither turn raises D; stop when one lowers it by less than stop_gain.
// The nearest codeword is found by brute force, but at the speed of a matrix product (nearest.c): bounds by the
// triangle inequality save little in 48 dimensions unless they keep n k / 10 of them, and every tile has to be encoded
// once by that kernel anyway.
//  * A cell left empty takes the farthest member of the cell with the highest distortion, ties to the lower index.
//  * Modified GLA [LRMDM06 4.1]: at the end each centroid becomes the member of its cell closest to it, which is the
//    cell's L2 medoid, as sum |x - m|^2 = sum |x - mu|^2 + n |m - mu|^2. That costs up to 3 dB and keeps real texels.
// Sums over blocks are added in block order, means are summed over members in their order: the same bits for any
// number of threads.

#include "compress/gla.h"
#include "compress/nearest.h"
#include <math.h>
#include <string.h>

enum { BLOCK = 1024, CELL_BLOCK = 16 };

typedef struct lloyd {
  const vt_training_set *set;
  int codeword_count;
  float *codewords; // the caller's
  vt_nearest nearest;
  uint16_t *code;          // [set->count]
  double *distance;        // [set->count] squared
  double *block_sum;       // [blocks] of w d
  uint32_t *member;        // [set->count] by cell, rising within one
  uint32_t *start;         // [codeword_count + 1] where a cell's members begin
  double *cell_distortion; // [codeword_count] sum of w d
} lloyd;

static const float *vector_of(const vt_training_set *set, uint32_t i) {
  return set->vectors + (size_t)set->row[i] * (size_t)set->dimension;
}

static void assign_block(void *user, size_t begin, size_t end, int worker) {
  lloyd *g = user;
  (void)worker;
  vt_find_nearest(&g->nearest, g->set->vectors, g->set->row + begin, end - begin, g->code + begin, g->distance + begin);
  double sum = 0;
  for (size_t i = begin; i < end; i++) sum += g->set->weight[i] * g->distance[i];
  g->block_sum[begin / BLOCK] = sum;
}

static vt_status assign_vectors(vt_context *ctx, lloyd *g, double *distortion) {
  vt_pack_nearest(&g->nearest, g->codewords);
  vt_status status = vt_parallel(ctx, g->set->count, BLOCK, assign_block, g);
  if (status) return status;
  double sum = 0, weight = 0;
  for (size_t b = 0; b * BLOCK < g->set->count; b++) sum += g->block_sum[b];
  for (size_t i = 0; i < g->set->count; i++) weight += g->set->weight[i];
  *distortion = sum / weight;
  return VT_OK;
}

// Counting sort of the vectors by their cell.
static void gather_members(lloyd *g) {
  size_t k = (size_t)g->codeword_count;
  memset(g->start, 0, (k + 1) * sizeof *g->start);
  memset(g->cell_distortion, 0, k * sizeof *g->cell_distortion);
  for (uint32_t i = 0; i < g->set->count; i++) {
    g->start[g->code[i]]++;
    g->cell_distortion[g->code[i]] += g->set->weight[i] * g->distance[i];
  }
  uint32_t sum = 0;
  for (size_t j = 0; j <= k; j++) {
    uint32_t n = g->start[j];
    g->start[j] = sum;
    sum += n;
  }
  for (uint32_t i = 0; i < g->set->count; i++) g->member[g->start[g->code[i]]++] = i;
  memmove(g->start + 1, g->start, k * sizeof *g->start); // each start has run on to the next one's
  g->start[0] = 0;
}

static uint32_t member_count(const lloyd *g, int cell) {
  return g->start[cell + 1] - g->start[cell];
}

// Gives every empty cell a vector and its codeword; returns how many there were.
static int fill_empty_cells(lloyd *g) {
  int filled = 0;
  gather_members(g);
  for (int e = 0; e < g->codeword_count; e++) {
    if (member_count(g, e)) continue;
    int worst = 0;
    for (int j = 1; j < g->codeword_count; j++)
      if (g->cell_distortion[j] > g->cell_distortion[worst]) worst = j;
    uint32_t farthest = UINT32_MAX;
    for (uint32_t m = g->start[worst]; m < g->start[worst + 1]; m++)
      if (farthest == UINT32_MAX || g->distance[g->member[m]] > g->distance[farthest]) farthest = g->member[m];
    if (farthest == UINT32_MAX || !(g->distance[farthest] > 0)) break; // every vector is met
    g->cell_distortion[worst] -= g->set->weight[farthest] * g->distance[farthest];
    g->code[farthest] = (uint16_t)e;
    g->distance[farthest] = 0;
    memcpy(g->codewords + (size_t)e * (size_t)g->set->dimension, vector_of(g->set, farthest),
           (size_t)g->set->dimension * sizeof(float));
    filled++;
  }
  if (filled) gather_members(g);
  return filled;
}

static void average_cells(void *user, size_t begin, size_t end, int worker) {
  lloyd *g = user;
  int dimension = g->set->dimension;
  (void)worker;
  for (size_t j = begin; j < end; j++) {
    double sum[256] = {0}, weight = 0;
    for (uint32_t m = g->start[j]; m < g->start[j + 1]; m++) {
      const float *x = vector_of(g->set, g->member[m]);
      double w = g->set->weight[g->member[m]];
      for (int d = 0; d < dimension; d++) sum[d] += w * (double)x[d];
      weight += w;
    }
    for (int d = 0; d < dimension && weight > 0; d++)
      g->codewords[j * (size_t)dimension + (size_t)d] = (float)(sum[d] / weight);
  }
}

static void snap_cells(void *user, size_t begin, size_t end, int worker) {
  lloyd *g = user;
  (void)worker;
  for (size_t j = begin; j < end; j++) {
    uint32_t closest = UINT32_MAX;
    for (uint32_t m = g->start[j]; m < g->start[j + 1]; m++)
      if (closest == UINT32_MAX || g->distance[g->member[m]] < g->distance[closest]) closest = g->member[m];
    if (closest != UINT32_MAX)
      memcpy(g->codewords + j * (size_t)g->set->dimension, vector_of(g->set, closest),
             (size_t)g->set->dimension * sizeof(float));
  }
}

static vt_status make_lloyd(vt_context *ctx, const vt_training_set *set, int codeword_count, float *codewords,
                            lloyd *g) {
  size_t n = set->count, k = (size_t)codeword_count;
  *g = (lloyd){.set = set, .codeword_count = codeword_count, .codewords = codewords};
  g->code = VT_NEW(ctx, uint16_t, n);
  g->distance = VT_NEW(ctx, double, n);
  g->block_sum = VT_NEW(ctx, double, (n + BLOCK - 1) / BLOCK);
  g->member = VT_NEW(ctx, uint32_t, n);
  g->start = VT_NEW(ctx, uint32_t, k + 1);
  g->cell_distortion = VT_NEW(ctx, double, k);
  if (!g->code || !g->distance || !g->block_sum || !g->member || !g->start || !g->cell_distortion)
    return VT_OUT_OF_MEMORY;
  return vt_make_nearest(ctx, set->dimension, codeword_count, &g->nearest);
}

static void free_lloyd(vt_context *ctx, lloyd *g) {
  vt_free(ctx, g->code);
  vt_free(ctx, g->distance);
  vt_free(ctx, g->block_sum);
  vt_free(ctx, g->member);
  vt_free(ctx, g->start);
  vt_free(ctx, g->cell_distortion);
  vt_free_nearest(ctx, &g->nearest);
}

// Seeds, iterates, snaps. codeword_count < set->count.
static vt_status train(vt_context *ctx, const vt_gla_desc *desc, const vt_training_set *set, float *codewords,
                       vt_gla_report *report) {
  lloyd g;
  size_t k = (size_t)desc->codeword_count;
  vt_status status = make_lloyd(ctx, set, desc->codeword_count, codewords, &g);
  if (!status) status = vt_seed_codewords(ctx, set, desc->codeword_count, desc->seed, codewords);
  if (!status) status = assign_vectors(ctx, &g, &report->distortion);
  while (!status && report->iterations < desc->max_iterations) {
    double before = report->distortion;
    int filled = fill_empty_cells(&g);
    status = vt_parallel(ctx, k, CELL_BLOCK, average_cells, &g);
    if (!status) status = assign_vectors(ctx, &g, &report->distortion);
    report->iterations++;
    vt_log(ctx, VT_LOG_VERBOSE, "codebook: iteration %d, mean squared error %g", report->iterations,
           report->distortion);
    if (!filled && !(before - report->distortion > desc->stop_gain * before)) break;
  }
  if (!status && desc->snap) {
    fill_empty_cells(&g);
    status = vt_parallel(ctx, k, CELL_BLOCK, snap_cells, &g);
    if (!status) status = assign_vectors(ctx, &g, &report->distortion);
  }
  free_lloyd(ctx, &g);
  return status;
}

vt_gla_desc vt_default_gla_desc(void) {
  return (vt_gla_desc){
      .cookie = VT_COOKIE, .dimension = 16, .codeword_count = 1024, .max_iterations = 60, .stop_gain = 1e-3, .seed = 1};
}

vt_status vt_train_codebook(vt_context *ctx, const vt_gla_desc *desc, const float *vectors, const float *weight,
                            size_t count, float *codewords, uint16_t *code, vt_gla_report *or_null) {
  VT_ASSERT(desc->cookie == VT_COOKIE && desc->dimension >= 1 && desc->dimension <= 256);
  VT_ASSERT(desc->codeword_count >= 1 && desc->codeword_count <= 65536);
  VT_ASSERT(desc->max_iterations >= 1 && desc->max_iterations <= 1000 && desc->stop_gain >= 0);
  vt_gla_report report = {0};
  vt_training_set set;
  size_t dimension = (size_t)desc->dimension;
  vt_status status = vt_make_training_set(ctx, desc->dimension, vectors, weight, count, &set);
  if (status) return status;
  if (set.count <= (uint32_t)desc->codeword_count) { // every distinct vector is a codeword
    for (uint32_t i = 0; i < set.count; i++)
      memcpy(codewords + i * dimension, vector_of(&set, i), dimension * sizeof(float));
    report.codeword_count = (int)set.count;
  } else {
    status = train(ctx, desc, &set, codewords, &report);
    report.codeword_count = desc->codeword_count;
  }
  vt_free_training_set(ctx, &set);
  if (!status && code && count)
    status = vt_encode_vectors(ctx, desc->dimension, codewords, report.codeword_count, vectors, count, code);
  if (!status && or_null) *or_null = report;
  return status;
}

typedef struct encoding {
  const vt_nearest *nearest;
  const float *vectors;
  uint16_t *code;
} encoding;

static void encode_block(void *user, size_t begin, size_t end, int worker) {
  encoding *e = user;
  (void)worker;
  vt_find_nearest(e->nearest, e->vectors + begin * (size_t)e->nearest->dimension, NULL, end - begin, e->code + begin,
                  NULL);
}

vt_status vt_encode_vectors(vt_context *ctx, int dimension, const float *codewords, int codeword_count,
                            const float *vectors, size_t count, uint16_t *code) {
  vt_nearest nearest;
  vt_status status = vt_make_nearest(ctx, dimension, codeword_count, &nearest);
  if (status) return status;
  vt_pack_nearest(&nearest, codewords);
  encoding e = {&nearest, vectors, code};
  status = vt_parallel(ctx, count, BLOCK, encode_block, &e);
  vt_free_nearest(ctx, &nearest);
  return status;
}
