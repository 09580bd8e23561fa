// suite_tools.h - what the suites of the bench share: scenes, trees, judging, differences of pictures, fitted exponents
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_SUITE_TOOLS_H
#define VT_PROGRAMS_SUITE_TOOLS_H

#include "base/views.h"
#include "compress/compress.h"
#include "datasets-synthetic/synthetic.h"
#include "programs/bench.h"
#include "reconstruct/reconstruct.h"
#include "render/render.h"

// ---- photographs
typedef struct vt_captured {
  vt_views views;  // owned
  vt_views judged; // those to judge against: items owned, names and pictures borrowed from views
} vt_captured;
vt_status vt_take_photographs(vt_context *, const vt_synthetic_desc *, vt_captured *out);
void vt_free_captured(vt_context *, vt_captured *);
vt_status vt_copy_views(vt_context *, const vt_views *, vt_views *out);

// ---- how good a tree is
typedef struct vt_judgement {
  double psnr;           // dB, over white, textured
  double alpha_textured; // RMSE 0..1
  double alpha_flat;     // RMSE 0..1, of the cells' own opacity
} vt_judgement;
// Means over the photographs, drawn at the finest level by the CPU.
vt_status vt_judge_tree(vt_context *, const vt_tree *, const vt_views *judged, vt_judgement *out);
uint64_t vt_hash_tree(const vt_tree *); // of cells, corners, textures and codebooks: equal bits, equal number

// ---- how far two series of pictures are apart, over white
typedef struct vt_difference {
  double whole_sum, tree_sum; // squared
  uint64_t whole_count, tree_count;
  double largest; // of any premultiplied channel, 0..1
} vt_difference;
void vt_add_difference(vt_difference *, const vt_fimage *a, const vt_fimage *b); // of one size
double vt_whole_rms(const vt_difference *); // 0..255, mean over channels and pixels
double vt_tree_rms(const vt_difference *);  // the same over pixels where either shows something (alpha above 0.02); NAN: none
double vt_whole_psnr(const vt_difference *); // dB; 99 where equal

// Draws both trees with their descs from `count` cameras and adds up how they differ.
typedef struct vt_drawing {
  const vt_tree *tree;
  vt_render_desc desc;
} vt_drawing;
vt_status vt_compare_drawings(vt_context *, const vt_drawing *a, const vt_drawing *b, const vt_camera *, int count,
                              vt_difference *out);
// Cameras on a circle around the tree, at the photographs' mean elevation; distance in tree sizes, 0: the tree fits.
void vt_circle_cameras(const vt_tree *, double distance, int size, int count, vt_camera *out);

// ---- growth
typedef struct vt_power_fit {
  double exponent, error; // y ~ x^exponent; its standard error, NAN with fewer than 3 points
  int count;              // points used: those with x, y > 0
} vt_power_fit;
vt_power_fit vt_fit_power(const double *x, const double *y, int count); // least squares of the logarithms

// A table of which each row is a struct of doubles in the order of the columns.
void vt_put_values(vt_bench_table *, const char *label, const double *values, int count);
// "0.05", "1e+06", "16"
const char *vt_show_amount(double value, char text[32]);

// A folder for photographs that must lie on the disk, in TMPDIR or /tmp; removed with all that is in it.
vt_status vt_make_scratch(vt_context *, char path[256]);
void vt_remove_scratch(vt_context *, const char *path);

#endif
