// field.c - a raw tree's field and view textures rounded to what a packed tree holds
// SPDX-License-Identifier: BSD-3-Clause
//
// There is no redundancy between cells left to look for (METHODS 10), so every value is rounded for itself, to as few
// different ones as cannot be told from it, and the file's zstd does the rest:
//  * optical depths to rungs of the file's logarithmic ladder; what is too thin to be seen becomes empty.
//  * colours to a codebook of sRGB colours for the whole tree (GLA in CIELab), trained on what shows: a value counts by the
//    opacity of the densest cell it belongs to. A corner whose cells are all empty takes the colour of the one before it,
//    which is nothing new to zstd; one that is empty itself but not all its cells still tints them, and counts.
//  * codes of view textures to equal steps of ln R, one of them at R = 1, where half of all pixels are: on 48 views of a maple
//    16 such levels have an error of 0.10 in 289 kB, 32 levels from end to end 0.10 in 365 kB, and the 8 levels of
//    least squared error 0.13 in 270 kB. A step stands for its middle; the mean of the codes that occur in it has less of
//    an error, but draws everything closer to R = 1, and pictures lose by it.
// Codewords rise as numbers RGB, as the file wants them.

#include "compress/field.h"
#include "base/lab.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// The values of one level: its corners', or its cells' where it has none.
typedef struct values {
  float *depth, *colour; // of the first one
  size_t depth_stride, colour_stride, count;
} values;

static values values_of(const vt_level *l) {
  if (l->corner_count) return (values){l->corner_values, l->corner_values + 1, 4, 4, l->corner_count};
  return (values){l->optical_depth, l->colour, 1, 3, l->cell_count};
}

bool vt_has_field(const vt_tree *tree) {
  for (int l = 0; l < tree->octree.level_count; l++)
    if (tree->octree.levels[l].corner_count || tree->view_textures[l].view_count) return true;
  return false;
}

static double alpha_of(float depth) { return -expm1(-(double)depth); }

// ---- depths

static void snap_depths(const vt_compress_desc *desc, const vt_tree *raw, vt_tree *out, vt_compress_report *report) {
  double sum = 0, count = 0;
  for (int l = 0; l < out->octree.level_count; l++) {
    values before = values_of(&raw->octree.levels[l]), after = values_of(&out->octree.levels[l]);
    vt_snap_depths(after.depth, after.depth_stride, after.count, desc->least_depth, desc->depth_steps);
    for (size_t i = 0; i < after.count; i++) {
      double d = alpha_of(after.depth[i * after.depth_stride]) - alpha_of(before.depth[i * before.depth_stride]);
      sum += d * d;
    }
    count += (double)after.count;
    report->corner_count += out->octree.levels[l].corner_count;
    if (out->octree.levels[l].corner_count) vt_cells_from_corners(&out->octree.levels[l]);
  }
  report->field_alpha_rmse = count > 0 ? sqrt(sum / count) : 0;
}

// ---- colours

typedef struct colour_job {
  const vt_compress_desc *desc;
  vt_tree *out;
  bool in_lab;
  float *weight[VT_MAX_LEVEL + 1]; // [values of the level] opacity that the value's colour has to do with
  size_t visible;                  // values with weight > 0
  float *training, *training_weight;
  size_t training_count;
} colour_job;

static void vector_of(bool in_lab, const float colour[3], float out[3]) {
  if (in_lab) vt_lab_from_srgb(colour, out);
  else for (int k = 0; k < 3; k++) out[k] = 255 * colour[k];
}

static vt_status weigh(vt_context *ctx, colour_job *job, int number) {
  const vt_level *level = &job->out->octree.levels[number];
  values v = values_of(level);
  float *weight = VT_NEW(ctx, float, v.count);
  job->weight[number] = weight;
  if (!weight) return VT_OUT_OF_MEMORY;
  for (size_t i = 0; i < level->cell_count; i++) {
    float alpha = (float)alpha_of(level->optical_depth[i]);
    if (!level->corner_count) weight[i] = alpha;
    for (size_t c = 0; level->corner_count && c < 8; c++) {
      float *w = weight + level->corner_of[8 * i + c];
      if (alpha > *w) *w = alpha;
    }
  }
  for (size_t i = 0; i < v.count; i++) {
    job->visible += weight[i] > 0;
    for (size_t k = 0; k < 3; k++) { // NaN: 0
      float *c = v.colour + i * v.colour_stride + k;
      *c = *c > 0 ? *c < 1 ? *c : 1 : 0;
    }
  }
  return VT_OK;
}

// Every so-manieth of the colours that show.
static vt_status gather_colours(vt_context *ctx, colour_job *job) {
  size_t most = job->desc->training_tiles ? job->desc->training_tiles : job->visible, seen = 0;
  size_t stride = most < job->visible ? (job->visible + most - 1) / most : 1;
  size_t room = (job->visible + stride - 1) / stride;
  job->training = VT_NEW(ctx, float, 3 * room);
  job->training_weight = VT_NEW(ctx, float, room);
  if (!job->training || !job->training_weight) return VT_OUT_OF_MEMORY;
  for (int l = 0; l < job->out->octree.level_count; l++) {
    values v = values_of(&job->out->octree.levels[l]);
    for (size_t i = 0; i < v.count; i++) {
      if (!(job->weight[l][i] > 0) || seen++ % stride) continue;
      vector_of(job->in_lab, v.colour + i * v.colour_stride, job->training + 3 * job->training_count);
      job->training_weight[job->training_count++] = job->weight[l][i];
    }
  }
  return VT_OK;
}

static int compare_codewords(const void *a, const void *b) { return memcmp(a, b, 3); }

// Codewords as bytes, each once, rising; returns their number, at least one.
static int round_codewords(bool in_lab, const float *vectors, int count, uint8_t *rgb) {
  for (int j = 0; j < count; j++) {
    float colour[3];
    if (in_lab) vt_srgb_from_lab(vectors + 3 * j, colour);
    else for (int k = 0; k < 3; k++) colour[k] = vectors[3 * j + k] / 255;
    for (int k = 0; k < 3; k++) rgb[3 * j + k] = (uint8_t)(colour[k] > 0 ? (colour[k] < 1 ? colour[k] * 255 + 0.5f : 255) : 0);
  }
  if (count == 0) return 1; // nothing shows: black, as allocated
  qsort(rgb, (size_t)count, 3, compare_codewords);
  int kept = 1;
  for (int j = 1; j < count; j++)
    if (memcmp(rgb + 3 * j, rgb + 3 * (kept - 1), 3) != 0) memmove(rgb + 3 * kept++, rgb + 3 * j, 3);
  return kept;
}

static vt_status train_colours(vt_context *ctx, colour_job *job) {
  const vt_compress_desc *desc = job->desc;
  vt_codebook *book = &job->out->field_codebook;
  vt_gla_desc gla = vt_default_gla_desc();
  vt_gla_report trained = {0};
  gla.dimension = 3;
  gla.codeword_count = desc->field_colours;
  gla.snap = desc->quantiser == VT_LAB_MODIFIED_GLA;
  gla.max_iterations = desc->max_iterations, gla.stop_gain = desc->stop_gain, gla.seed = desc->seed;
  float *vectors = VT_NEW(ctx, float, 3 * (size_t)desc->field_colours);
  book->codewords = VT_NEW(ctx, uint8_t, 3 * (size_t)desc->field_colours);
  book->channels = 3;
  vt_status status = vectors && book->codewords ? gather_colours(ctx, job) : VT_OUT_OF_MEMORY;
  if (!status && job->training_count)
    status = vt_train_codebook(ctx, &gla, job->training, job->training_weight, job->training_count, vectors, NULL, &trained);
  if (!status) book->codeword_count = round_codewords(job->in_lab, vectors, trained.codeword_count, book->codewords);
  vt_free(ctx, vectors);
  return status;
}

// Gives the colours of a level their codewords; adds up CIE76 of those that show.
static vt_status encode_colours(vt_context *ctx, const colour_job *job, int number, double *delta_e) {
  const vt_codebook *book = &job->out->field_codebook;
  values v = values_of(&job->out->octree.levels[number]);
  size_t words = (size_t)book->codeword_count, shown = 0;
  float *word = VT_NEW(ctx, float, 3 * words), *vectors = VT_NEW(ctx, float, 3 * v.count);
  uint16_t *code = VT_NEW(ctx, uint16_t, v.count);
  vt_status status = word && vectors && code ? VT_OK : VT_OUT_OF_MEMORY;
  for (size_t j = 0; !status && j < words; j++) {
    const uint8_t *rgb = book->codewords + 3 * j;
    vector_of(job->in_lab, (float[3]){(float)rgb[0] / 255, (float)rgb[1] / 255, (float)rgb[2] / 255}, word + 3 * j);
  }
  for (size_t i = 0; !status && i < v.count; i++)
    if (job->weight[number][i] > 0) vector_of(job->in_lab, v.colour + i * v.colour_stride, vectors + 3 * shown++);
  if (!status && shown) status = vt_encode_vectors(ctx, 3, word, (int)words, vectors, shown, code);
  size_t at = 0, last = 0;
  for (size_t i = 0; !status && i < v.count; i++) {
    float *colour = v.colour + i * v.colour_stride, before[3], after[3];
    bool shows = job->weight[number][i] > 0;
    if (shows) last = code[at++];
    if (shows) vt_lab_from_srgb(colour, before);
    for (size_t k = 0; k < 3; k++) colour[k] = (float)book->codewords[3 * last + k] / 255;
    if (!shows) continue;
    vt_lab_from_srgb(colour, after);
    double d[3] = {(double)(after[0] - before[0]), (double)(after[1] - before[1]), (double)(after[2] - before[2])};
    *delta_e += sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  }
  vt_free(ctx, word);
  vt_free(ctx, vectors);
  vt_free(ctx, code);
  return status;
}

static vt_status pack_colours(vt_context *ctx, const vt_compress_desc *desc, vt_tree *out, vt_compress_report *report) {
  colour_job job = {.desc = desc, .out = out, .in_lab = desc->quantiser != VT_RGB_GLA};
  vt_status status = VT_OK;
  double delta_e = 0;
  int levels = out->octree.level_count;
  for (int l = 0; !status && l < levels; l++) status = weigh(ctx, &job, l);
  if (!status) status = train_colours(ctx, &job);
  for (int l = 0; !status && l < levels; l++) status = encode_colours(ctx, &job, l, &delta_e);
  for (int l = 0; !status && l < levels; l++)
    if (out->octree.levels[l].corner_count) vt_cells_from_corners(&out->octree.levels[l]);
  for (int l = 0; l < levels; l++) vt_free(ctx, job.weight[l]);
  vt_free(ctx, job.training);
  vt_free(ctx, job.training_weight);
  report->field_codewords = out->field_codebook.codeword_count;
  report->field_delta_e = job.visible ? delta_e / (double)job.visible : 0;
  return status;
}

// ---- view textures

// To which code each code goes.
static void fill_levels(int level_count, uint8_t snapped[256]) {
  double step = 255.0 / level_count;
  for (int c = 0; c < 256; c++) {
    double nearest = floor((c - 127.5) / step + 0.5), least = -(double)(level_count / 2), most = least + level_count - 1;
    nearest = nearest < least ? least : nearest > most ? most : nearest;
    double code = floor(127.5 + nearest * step + 0.5);
    snapped[c] = (uint8_t)(level_count == 256 ? c : code < 0 ? 0 : code > 255 ? 255 : code);
  }
}

static void snap_view_textures(const vt_compress_desc *desc, vt_tree *out, vt_compress_report *report) {
  uint8_t snapped[256];
  double sum = 0;
  fill_levels(desc->ratio_levels, snapped);
  for (int l = 0; l < out->octree.level_count; l++)
    for (int v = 0; v < out->view_textures[l].view_count; v++) {
      vt_view_texture *t = &out->view_textures[l].views[v];
      size_t count = (size_t)t->columns * (size_t)t->rows;
      for (size_t i = 0; i < count; i++) {
        int d = snapped[t->codes[i]] - t->codes[i];
        sum += d * d;
        t->codes[i] = snapped[t->codes[i]];
      }
      report->view_pixels += count;
    }
  report->ratio_levels = desc->ratio_levels;
  report->log_ratio_rmse =
      report->view_pixels ? (double)VT_LOG_RATIO_STEP * sqrt(sum / (double)report->view_pixels) : 0;
}

vt_status vt_compress_field(vt_context *ctx, const vt_compress_desc *desc, const vt_tree *raw, vt_tree *out,
                            vt_compress_report *report) {
  double start = vt_seconds();
  snap_depths(desc, raw, out, report);
  vt_status status = pack_colours(ctx, desc, out, report);
  if (!status) snap_view_textures(desc, out, report);
  report->seconds_field = vt_seconds() - start;
  return status;
}
