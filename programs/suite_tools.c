// suite_tools.c - what the suites of the bench share
// SPDX-License-Identifier: BSD-3-Clause
//
// Growth is fitted as ln y = a + e ln x by least squares; the standard error of e is sqrt(sum of squared residuals /
// (n - 2) / sum (ln x - mean)^2). It says how straight the line is, not how well e would come out on another scene.
#include "programs/suite_tools.h"

#include "base/file.h"
#include "base/hash.h"
#include "base/image_metrics.h"
#include "programs/orbit.h"
#include "programs/stage_options.h"

#include <string.h>
#include <unistd.h>

static const float white[3] = {1, 1, 1};

// ---- photographs

vt_status vt_take_photographs(vt_context *context, const vt_synthetic_desc *desc, vt_captured *out) {
  *out = (vt_captured){0};
  vt_status status = vt_make_synthetic_views(context, desc, &out->views);
  if (!status) status = vt_select_views(context, &out->views, VT_TEST, &out->judged);
  if (status) vt_free_captured(context, out);
  return status;
}

void vt_free_captured(vt_context *context, vt_captured *captured) {
  vt_free(context, captured->judged.items);
  vt_free_views(context, &captured->views);
  *captured = (vt_captured){0};
}

vt_status vt_copy_views(vt_context *context, const vt_views *views, vt_views *out) {
  *out = (vt_views){.items = VT_NEW(context, vt_view, (size_t)views->count)};
  vt_status status = out->items ? VT_OK : VT_OUT_OF_MEMORY;
  for (int i = 0; i < views->count && !status; i++) {
    const vt_view *from = &views->items[i];
    vt_view *to = &out->items[out->count++];
    *to = (vt_view){.name = vt_strdup(context, from->name), .role = from->role, .camera = from->camera};
    status = to->name
                 ? vt_make_image(context, from->picture.width, from->picture.height, from->picture.channels, &to->picture)
                 : VT_OUT_OF_MEMORY;
    if (!status)
      memcpy(to->picture.pixels, from->picture.pixels,
             (size_t)from->picture.width * (size_t)from->picture.height * (size_t)from->picture.channels);
  }
  if (status) vt_free_views(context, out);
  return status;
}

// ---- judging

static vt_status judge_view(vt_context *context, vt_renderer *renderer, int level, const vt_view *view, int count,
                            vt_judgement *out) {
  vt_status status = VT_OK;
  for (int flat = 0; flat < 2 && !status; flat++) {
    vt_render_desc desc = vt_default_render_desc();
    vt_fimage picture = {0};
    vt_metrics metrics;
    desc.level = level, desc.flat = flat;
    status = vt_render(context, renderer, &desc, &view->camera, &picture, NULL);
    if (!status) status = vt_measure(context, &picture, &view->picture, white, &metrics);
    vt_free_fimage(context, &picture);
    if (status) continue;
    *(flat ? &out->alpha_flat : &out->alpha_textured) += metrics.alpha_rmse / count;
    if (!flat) out->psnr += metrics.psnr / count;
  }
  return status;
}

vt_status vt_judge_tree(vt_context *context, const vt_tree *tree, const vt_views *judged, vt_judgement *out) {
  vt_renderer *renderer = NULL;
  *out = (vt_judgement){0};
  vt_status status = vt_create_renderer(context, tree, VT_BACKEND_CPU, &renderer);
  for (int i = 0; i < judged->count && !status; i++)
    status = judge_view(context, renderer, vt_finest_level(tree), &judged->items[i], judged->count, out);
  vt_destroy_renderer(context, renderer);
  return status;
}

uint64_t vt_hash_tree(const vt_tree *tree) {
  uint64_t hash = vt_hash(&tree->octree.origin, sizeof tree->octree.origin, (uint64_t)tree->octree.level_count);
  size_t texels = (size_t)(tree->texel_edge * tree->texel_edge);
  for (int l = 0; l < tree->octree.level_count; l++) {
    const vt_level *level = &tree->octree.levels[l];
    const vt_tiles *tiles = &tree->tiles[l];
    size_t cells = level->cell_count, entries = (size_t)tiles->view_count * tiles->cell_count;
    hash = vt_hash(level->x, cells * sizeof *level->x, hash);
    hash = vt_hash(level->y, cells * sizeof *level->y, hash);
    hash = vt_hash(level->z, cells * sizeof *level->z, hash);
    hash = vt_hash(level->optical_depth, cells * sizeof *level->optical_depth, hash);
    hash = vt_hash(level->colour, 3 * cells * sizeof *level->colour, hash);
    hash = vt_hash(level->corner_values, 4 * (size_t)level->corner_count * sizeof *level->corner_values, hash);
    for (int v = 0; v < tree->view_textures[l].view_count; v++) {
      const vt_view_texture *t = &tree->view_textures[l].views[v];
      const int frame[] = {tree->view_textures[l].factor, t->width, t->height, t->left, t->top, t->columns, t->rows};
      hash = vt_hash(frame, sizeof frame, hash);
      hash = vt_hash(t->codes, (size_t)t->columns * (size_t)t->rows, hash);
    }
    if (tiles->tile_of) hash = vt_hash(tiles->tile_of, entries * sizeof *tiles->tile_of, hash);
    if (tiles->texels) hash = vt_hash(tiles->texels, tiles->tile_count * texels * 4, hash);
    if (tiles->alpha_code) hash = vt_hash(tiles->alpha_code, tiles->tile_count * sizeof *tiles->alpha_code, hash);
    if (tiles->colour_code) hash = vt_hash(tiles->colour_code, tiles->tile_count * sizeof *tiles->colour_code, hash);
  }
  const vt_codebook *books[] = {&tree->alpha_codebook, &tree->colour_codebook};
  for (int b = 0; b < 2; b++)
    if (books[b]->codewords)
      hash = vt_hash(books[b]->codewords, (size_t)(books[b]->codeword_count * books[b]->channels) * texels, hash);
  if (tree->field_codebook.codewords)
    hash = vt_hash(tree->field_codebook.codewords, 3 * (size_t)tree->field_codebook.codeword_count, hash);
  return hash;
}

// ---- differences

void vt_add_difference(vt_difference *sum, const vt_fimage *a, const vt_fimage *b) {
  VT_ASSERT(a->width == b->width && a->height == b->height && a->channels == 4 && b->channels == 4);
  size_t count = (size_t)a->width * (size_t)a->height;
  for (size_t i = 0; i < count; i++) {
    const float *p = a->pixels + 4 * i, *q = b->pixels + 4 * i;
    double squared = 0;
    for (int c = 0; c < 4; c++) sum->largest = fmax(sum->largest, fabs((double)p[c] - (double)q[c]));
    for (int c = 0; c < 3; c++) { // over white: colour + 1 - alpha
      double d = ((double)p[c] - (double)p[3]) - ((double)q[c] - (double)q[3]);
      squared += d * d / 3;
    }
    bool shows = p[3] > 0.02f || q[3] > 0.02f;
    sum->whole_sum += squared, sum->whole_count++;
    if (shows) sum->tree_sum += squared, sum->tree_count++;
  }
}

double vt_whole_rms(const vt_difference *d) {
  return d->whole_count ? 255 * sqrt(d->whole_sum / (double)d->whole_count) : NAN;
}

double vt_tree_rms(const vt_difference *d) { return d->tree_count ? 255 * sqrt(d->tree_sum / (double)d->tree_count) : NAN; }

double vt_whole_psnr(const vt_difference *d) {
  return d->whole_sum > 0 ? -10 * log10(d->whole_sum / (double)d->whole_count) : 99;
}

vt_status vt_compare_drawings(vt_context *context, const vt_drawing *a, const vt_drawing *b, const vt_camera *cameras,
                              int count, vt_difference *out) {
  const vt_drawing *drawings[2] = {a, b};
  vt_renderer *renderers[2] = {NULL, NULL};
  vt_fimage pictures[2] = {{0}};
  *out = (vt_difference){0};
  vt_status status = VT_OK;
  for (int i = 0; i < 2 && !status; i++)
    status = vt_create_renderer(context, drawings[i]->tree, VT_BACKEND_CPU, &renderers[i]);
  for (int k = 0; k < count && !status; k++) {
    for (int i = 0; i < 2 && !status; i++)
      status = vt_render(context, renderers[i], &drawings[i]->desc, &cameras[k], &pictures[i], NULL);
    if (!status) vt_add_difference(out, &pictures[0], &pictures[1]);
    for (int i = 0; i < 2; i++) vt_free_fimage(context, &pictures[i]);
  }
  for (int i = 0; i < 2; i++) vt_destroy_renderer(context, renderers[i]);
  return status;
}

void vt_circle_cameras(const vt_tree *tree, double distance, int size, int count, vt_camera *out) {
  vt_orbit orbit = vt_find_orbit(tree);
  for (int i = 0; i < count; i++) // not one of them at a photograph's own place
    out[i] = vt_orbit_camera(&orbit, 360.0 * (i + 0.37) / count, orbit.elevation, distance, 40, size, size);
}

// ---- growth

vt_power_fit vt_fit_power(const double *x, const double *y, int count) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, squared = 0;
  int n = 0;
  for (int i = 0; i < count; i++)
    if (x[i] > 0 && y[i] > 0) n++, sx += log(x[i]), sy += log(y[i]);
  if (n < 2) return (vt_power_fit){NAN, NAN, n};
  for (int i = 0; i < count; i++)
    if (x[i] > 0 && y[i] > 0) {
      double dx = log(x[i]) - sx / n;
      sxx += dx * dx, sxy += dx * (log(y[i]) - sy / n);
    }
  vt_power_fit fit = {sxx > 0 ? sxy / sxx : NAN, NAN, n};
  for (int i = 0; i < count; i++)
    if (x[i] > 0 && y[i] > 0) {
      double r = log(y[i]) - sy / n - fit.exponent * (log(x[i]) - sx / n);
      squared += r * r;
    }
  if (n > 2 && sxx > 0) fit.error = sqrt(squared / (n - 2) / sxx);
  return fit;
}

// ---- tables

void vt_put_values(vt_bench_table *table, const char *label, const double *values, int count) {
  vt_add_row(table, label);
  for (int i = 0; i < count; i++) vt_put_value(table, values[i]);
}

const char *vt_show_amount(double value, char text[32]) {
  snprintf(text, 32, "%.4g", value);
  return text;
}

// ---- scratch

vt_status vt_make_scratch(vt_context *context, char path[256]) {
  const char *parent = getenv("TMPDIR");
  snprintf(path, 256, "%s/voltree-bench-XXXXXX", parent && *parent && strlen(parent) < 200 ? parent : "/tmp");
  if (mkdtemp(path)) return VT_OK;
  return vt_fail(context, VT_FAILED, "%s: no folder could be made there; make room, or set TMPDIR", path);
}

void vt_remove_scratch(vt_context *context, const char *path) {
  vt_names names = {0};
  if (!vt_list_folder(context, path, true, &names))
    for (int i = 0; i < names.count; i++) {
      char *file = vt_join(context, path, names.items[i]);
      size_t length = strlen(path);
      if (file) unlink(file);
      for (char *slash; file && (slash = strrchr(file, '/')) && slash > file + length;) { // folders that are now empty
        *slash = 0;
        rmdir(file);
      }
      vt_free(context, file);
    }
  vt_free_names(context, &names);
  rmdir(path);
}
