// agreement.h - how a photograph and the cells agree: matte ratio and visibility
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_RECONSTRUCT_AGREEMENT_H
#define VT_RECONSTRUCT_AGREEMENT_H

#include "reconstruct/sweep.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_agreement {
  int view_count;
  uint32_t cell_count;
  vt_fimage *log_ratio;  // [view_count], one channel, the reduced picture's size: ln of the photograph's optical depth over
                         // the cells' along that pixel, within [ln 0.02, ln ratio_limit]; owned
  uint8_t *visibility;   // [view_count][cell_count]: 0 outside the photograph, else 1 + 254 * mean transmittance before
                         // the cell; owned
} vt_agreement;

vt_status vt_find_agreement(vt_context *, const vt_rays *, float ratio_limit, vt_agreement *out);
void vt_free_agreement(vt_context *, vt_agreement *);

#ifdef __cplusplus
}
#endif
#endif
