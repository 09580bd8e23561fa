// seed.c - first codewords by greedy k-means++ on a sample
// SPDX-License-Identifier: BSD-3-Clause
//
// Arthur & Vassilvitskii 2007, "k-means++: the advantages of careful seeding": each next codeword is a vector drawn
// with probability in proportion to w D^2, D its distance to the nearest codeword so far; of two such draws the one
// that leaves the smaller sum of w D^2 is taken (their section 5; on 10^5 leaf tiles two instead of one gain 0.04 dB
// after training, eight no more). The sample has 16 vectors per codeword: seeding costs about as much as one iteration.
// Distances are float, summed in sixteen lanes: nothing here needs more.

#include "base/rng.h"
#include "compress/gla.h"
#include <math.h>
#include <string.h>

enum { TRIALS = 2, LANES = 16, BLOCK = 512, SAMPLES_PER_CODEWORD = 16, MAX_SAMPLES = 65536 };

typedef struct seeding {
  size_t count, stride;       // samples; floats per sample, a multiple of LANES
  float *samples;             // [count][stride], zero-padded
  double *weight;             // [count]
  float *nearest[TRIALS + 1]; // [count] squared distance to the nearest codeword; row 0 now, others after each trial
  size_t trial[TRIALS];       // the samples tried
  int trial_count;
  double *block_sum; // [blocks][TRIALS] of w D^2
} seeding;

static float squared_distance(size_t stride, const float *a, const float *b) {
  float lane[LANES] = {0};
  for (size_t d = 0; d < stride; d += LANES)
    for (size_t l = 0; l < LANES; l++) lane[l] += (a[d + l] - b[d + l]) * (a[d + l] - b[d + l]);
  for (size_t half = LANES / 2; half; half /= 2)
    for (size_t l = 0; l < half; l++) lane[l] += lane[l + half];
  return lane[0];
}

static void try_block(void *user, size_t begin, size_t end, int worker) {
  seeding *s = user;
  (void)worker;
  for (int t = 0; t < s->trial_count; t++) {
    const float *centre = s->samples + s->trial[t] * s->stride;
    double sum = 0;
    for (size_t i = begin; i < end; i++) {
      float d = squared_distance(s->stride, s->samples + i * s->stride, centre);
      s->nearest[t + 1][i] = d < s->nearest[0][i] ? d : s->nearest[0][i];
      sum += s->weight[i] * (double)s->nearest[t + 1][i];
    }
    s->block_sum[begin / BLOCK * TRIALS + (size_t)t] = sum;
  }
}

// A sample drawn in proportion to w D^2, whose sum is `total`. `fallback` if the sum tells nothing (overflow, or
// distances whose squares vanish); a codeword chosen twice by that is given away later, as an empty cell.
static size_t draw_sample(const seeding *s, vt_rng *rng, double total, int column, size_t fallback) {
  double target = vt_random_unit(rng) * total;
  if (!(total > 0) || !isfinite(total)) return fallback;
  size_t block = 0, blocks = (s->count + BLOCK - 1) / BLOCK;
  for (; block + 1 < blocks && target >= s->block_sum[block * TRIALS + (size_t)column]; block++)
    target -= s->block_sum[block * TRIALS + (size_t)column];
  size_t end = (block + 1) * BLOCK < s->count ? (block + 1) * BLOCK : s->count, last = fallback;
  for (size_t i = block * BLOCK; i < end; i++) {
    double share = s->weight[i] * (double)s->nearest[0][i];
    if (!(share > 0)) continue;
    last = i;
    if (target < share) break;
    target -= share;
  }
  return last;
}

static vt_status take_samples(vt_context *ctx, const vt_training_set *set, int codeword_count, vt_rng *rng,
                              seeding *s) {
  size_t wanted = (size_t)codeword_count * SAMPLES_PER_CODEWORD, dimension = (size_t)set->dimension;
  if (wanted > MAX_SAMPLES)
    wanted = 2 * (size_t)codeword_count > MAX_SAMPLES ? 2 * (size_t)codeword_count : MAX_SAMPLES;
  s->count = set->count < wanted ? set->count : wanted;
  s->stride = (dimension + LANES - 1) / LANES * LANES;
  s->samples = VT_NEW(ctx, float, s->count * s->stride);
  s->weight = VT_NEW(ctx, double, s->count);
  s->block_sum = VT_NEW(ctx, double, (s->count + BLOCK - 1) / BLOCK * TRIALS);
  if (!s->samples || !s->weight || !s->block_sum) return VT_OUT_OF_MEMORY;
  for (int t = 0; t <= TRIALS; t++)
    if (!(s->nearest[t] = VT_NEW(ctx, float, s->count))) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < s->count; i++) { // one from each of `count` equal stretches
    uint64_t low = i * (uint64_t)set->count / s->count, high = (i + 1) * (uint64_t)set->count / s->count;
    uint64_t at = low + (uint64_t)(vt_random_unit(rng) * (double)(high - low));
    memcpy(s->samples + i * s->stride, set->vectors + set->row[at] * dimension, dimension * sizeof(float));
    s->weight[i] = set->weight[at];
    s->nearest[0][i] = 1; // the first draw is in proportion to w alone
  }
  return VT_OK;
}

// Sums of the trials over all blocks, in block order. The column of the least.
static int best_trial(const seeding *s, double *total) {
  double sums[TRIALS] = {0};
  for (size_t block = 0; block * BLOCK < s->count; block++)
    for (int t = 0; t < s->trial_count; t++) sums[t] += s->block_sum[block * TRIALS + (size_t)t];
  int best = 0;
  for (int t = 1; t < s->trial_count; t++)
    if (sums[t] < sums[best]) best = t;
  *total = sums[best];
  return best;
}

vt_status vt_seed_codewords(vt_context *ctx, const vt_training_set *set, int codeword_count, uint64_t seed,
                            float *codewords) {
  VT_ASSERT(codeword_count >= 1 && (uint32_t)codeword_count < set->count);
  vt_rng rng = vt_seed_rng(seed, 0x6b2b2b);
  seeding s = {0};
  vt_status status = take_samples(ctx, set, codeword_count, &rng, &s);
  double total = 0;
  for (size_t i = 0; !status && i < s.count; i++) {
    s.block_sum[i / BLOCK * TRIALS] += s.weight[i];
    total += s.weight[i];
  }
  int column = 0;
  for (size_t j = 0; !status && j < (size_t)codeword_count; j++) {
    s.trial_count = j ? TRIALS : 1;
    for (int t = 0; t < s.trial_count; t++) s.trial[t] = draw_sample(&s, &rng, total, column, j);
    if (!j)
      for (size_t i = 0; i < s.count; i++) s.nearest[0][i] = INFINITY;
    status = vt_parallel(ctx, s.count, BLOCK, try_block, &s);
    if (status) break;
    column = best_trial(&s, &total);
    float *now = s.nearest[column + 1];
    s.nearest[column + 1] = s.nearest[0];
    s.nearest[0] = now;
    memcpy(codewords + j * (size_t)set->dimension, s.samples + s.trial[column] * s.stride,
           (size_t)set->dimension * sizeof(float));
  }
  for (int t = 0; t <= TRIALS; t++) vt_free(ctx, s.nearest[t]);
  vt_free(ctx, s.samples);
  vt_free(ctx, s.weight);
  vt_free(ctx, s.block_sum);
  return status;
}
