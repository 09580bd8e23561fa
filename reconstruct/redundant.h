// redundant.h - photographs whose textures say nothing that the others' do not say
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_REDUNDANT_H
#define VT_RECONSTRUCT_REDUNDANT_H

#include "octree/octree.h"
#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_redundant_desc {
  uint32_t cookie;
  int neighbours;   // views that stand in for one, 1..VT_MAX_BLEND_VIEWS
  double tolerance; // a photograph is redundant where the others show it with at most so many times the error of its own
                    // texture, >= 1
} vt_redundant_desc;
vt_redundant_desc vt_default_redundant_desc(void);

// What was measured of a photograph: the error (loss of fit.h) of the picture that its own texture shows, and of the one that
// the textures of the others, those kept when it was judged, show.
typedef struct vt_redundancy {
  double own, others;
  int stand_in; // the view nearest to it that was kept; itself where it was kept
} vt_redundancy;

// Measures on the rays' level, which must have view textures of all photographs, and silences redundant ones on all levels that
// have some: vt_choose_views passes them over from then on. out: [photographs]. VT_OUT_OF_MEMORY, VT_CANCELLED.
vt_status vt_drop_redundant(vt_context *, const vt_redundant_desc *, const vt_rays *, vt_tree *, vt_redundancy *out);

// A view without anything kept.
void vt_silence_view(vt_context *, vt_view_textures *, int view);

#ifdef __cplusplus
}
#endif
#endif
