// compress.h - billboard textures to codebooks and indices, fields and view textures to few values
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_COMPRESS_COMPRESS_H
#define VT_COMPRESS_COMPRESS_H

#include "octree/octree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum vt_quantiser {
  VT_RGB_GLA,         // generalised Lloyd algorithm on sRGB values
  VT_LAB_GLA,         // the same in CIELab (D65)
  VT_LAB_MODIFIED_GLA // CIELab, each centroid replaced by the closest input vector [LRMDM06 4.1]
} vt_quantiser;

typedef struct vt_compress_desc {
  uint32_t cookie;
  vt_quantiser quantiser;
  int alpha_codewords;   // 1..65536
  int colour_codewords;  // 1..65536
  int max_iterations;    // of the GLA, 1..1000
  double stop_gain;      // stop when an iteration lowers the distortion by less than this share
  uint32_t training_tiles; // at most so many tiles train the codebooks (all are encoded); 0: all
  uint64_t seed;
  bool set_flat_aside; // wholly transparent and wholly opaque tiles have codewords of their own, and are neither trained on
                       // nor searched for; false (for `voltree bench skips`): they are vectors like all others
  int field_colours;   // codewords of the colours of corners (of cells, where there are none), 1..65536
  int depth_steps;     // to which their optical depths are rounded, an octave: 1, 2, 3, 6, 9 or 18
  float least_depth;   // thinner corners and cells become empty; > 0
  int ratio_levels;    // to which the codes of view textures are rounded, 2..256; 256: none is changed
} vt_compress_desc;
vt_compress_desc vt_default_compress_desc(void);

typedef struct vt_compress_report {
  uint64_t tile_count;
  uint64_t raw_bytes, packed_bytes; // of textures in memory (what corners and view textures save, only a file shows)
  int alpha_codewords, colour_codewords, alpha_iterations, colour_iterations;
  double alpha_rmse;       // of texels, 0..1
  double colour_psnr;      // dB, RGB of visible texels
  double colour_delta_e;   // mean CIE76 of visible texels
  double seconds_training, seconds_encoding; // of tiles
  // Of trees with corners or view textures; else 0.
  uint64_t corner_count, view_pixels;
  int field_codewords, ratio_levels;
  double field_alpha_rmse; // of the opacities 1 - exp(-depth) of corners and cells
  double field_delta_e;    // mean CIE76 of the colours that show
  double log_ratio_rmse;   // of ln R
  double seconds_field;
} vt_compress_report;

// A raw tree to a packed one; a packed one is VT_BAD_INPUT. Transparent texels pull no colour and no visible texel turns
// black. Corners, cells and view textures of a tree that has corners or view textures are rounded to what a packed file
// holds exactly; a tree with neither keeps its cells as they are. Caller frees `out`. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_compress_tree(vt_context *, const vt_compress_desc *, const vt_tree *raw, vt_tree *out,
                           vt_compress_report *or_null);

// ---- the quantiser itself, on any vectors
typedef struct vt_gla_desc {
  uint32_t cookie;
  int dimension;         // 1..256
  int codeword_count;    // 1..65536
  bool snap;             // replace each centroid by the closest input vector at the end (modified GLA)
  int max_iterations;
  double stop_gain;
  uint64_t seed;
} vt_gla_desc;
vt_gla_desc vt_default_gla_desc(void);
typedef struct vt_gla_report { int codeword_count, iterations; double distortion; } vt_gla_report; // mean squared, per vector
// Trains on count vectors [count][dimension], weight [count] or NULL (all 1). codewords [codeword_count][dimension] and
// code [count] (or NULL) are written. Fewer distinct vectors than codewords: fewer codewords (report), zero distortion.
// NaN or infinity in a vector: VT_BAD_INPUT. Same bits for any number of threads.
vt_status vt_train_codebook(vt_context *, const vt_gla_desc *, const float *vectors, const float *weight, size_t count,
                            float *codewords, uint16_t *code, vt_gla_report *or_null);
// The nearest codeword of each vector, ties to the lower index.
vt_status vt_encode_vectors(vt_context *, int dimension, const float *codewords, int codeword_count,
                            const float *vectors, size_t count, uint16_t *code);

#ifdef __cplusplus
}
#endif
#endif
