// silhouette.h - how a photograph's matte differs from a volume, and how that changes as its camera moves
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_SILHOUETTE_H
#define VT_RECONSTRUCT_SILHOUETTE_H

#include "reconstruct/pyramid.h"
#include "reconstruct/soft_volume.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_silhouette_pixel {
  uint16_t x, y;
  float alpha; // of the matte
} vt_silhouette_pixel;

// Pixels of a matte that say where its edges are, and a few of the others, row by row.
typedef struct vt_silhouette {
  vt_camera camera; // of the (reduced) picture, as it came
  int count;
  vt_silhouette_pixel *pixels; // owned
} vt_silhouette;

// At most so many pixels, chosen by the seed, none of them beside what is ignored (vt_view). A matte without edges has none.
// VT_OUT_OF_MEMORY.
vt_status vt_sample_silhouette(vt_context *, const vt_image *straight_rgba, const vt_image *ignored, const vt_camera *, int most,
                               uint64_t seed, vt_silhouette *out);
void vt_free_silhouette(vt_context *, vt_silhouette *);

// What a matte shows on average where the volume has some alpha: at alpha = k / VT_RESPONSE_STEPS, linear between.
#define VT_RESPONSE_STEPS 16
typedef struct vt_response {
  double weight[VT_RESPONSE_STEPS + 1], sum[VT_RESPONSE_STEPS + 1];
  float value[VT_RESPONSE_STEPS + 1];
} vt_response;
vt_response vt_no_response(void); // alpha itself
void vt_learn_response(vt_response *, const vt_silhouette *, const float *error); // adds what vt_compare_silhouette found without one
void vt_finish_response(vt_response *);

// ln of a factor of the volume's depths, smooth over the picture: a polynomial 1, x, y, x^2, xy, y^2 of the distance from the
// picture's middle, in halves of its longer side.
#define VT_SMOOTH_TERMS 6
// rotation, displacement (vt_adjust_camera), log of the focal length; the factor
#define VT_SILHOUETTE_COLUMNS (7 + VT_SMOOTH_TERMS)
// error[pixel] = response to the alpha of the volume from `camera` - the matte's; by_motion_or_null[pixel]: its derivatives, at
// a camera that is nearly the silhouette's own. distance: world, the unit of displacements.
vt_status vt_compare_silhouette(vt_context *, const vt_silhouette *, const vt_soft_volume *, const vt_response *,
                                const double smooth[VT_SMOOTH_TERMS], const vt_camera *camera, double distance, float *error,
                                float (*by_motion_or_null)[VT_SILHOUETTE_COLUMNS]);

#ifdef __cplusplus
}
#endif
#endif
