// mended_views.h - small captures for tests of what is mended before reconstruction
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_MENDED_VIEWS_H
#define VT_TESTS_MENDED_VIEWS_H

#include "datasets-synthetic/synthetic.h"
#include "reconstruct/reconstruct.h"
#include "reconstruct/refine_cameras.h"
#include "tests/unit.h"

static inline vt_context *open_mending(int threads) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads, desc.log_level = VT_LOG_QUIET;
  vt_context *context = vt_create_context(&desc);
  assert_non_null(context);
  return context;
}

static inline vt_views photograph_tree(vt_context *context, vt_synthetic_kind kind, uint32_t seed, int views, int test_views, int size) {
  vt_synthetic_desc desc = vt_default_synthetic_desc();
  desc.kind = kind, desc.seed = seed, desc.train_count = views, desc.test_count = test_views;
  desc.width = desc.height = size, desc.supersample = 3;
  desc.leaf_count = kind == VT_SYNTHETIC_TREE ? 1500 : -1;
  if (vt_is_phantom(kind)) desc.peak_extinction = 4;
  vt_views out;
  assert_int_equal(vt_make_synthetic_views(context, &desc, &out), VT_OK);
  return out;
}

static inline void fails_never(vt_context *context, vt_status status) {
  if (status) fail_msg("%s", vt_last_error(context));
}

// Cameras turned by a degree and moved by a per cent, and refined once.
static inline void damage_and_refine(vt_context *context, vt_views *views, vt_refine_report *report) {
  vt_damage_desc damage = vt_default_damage_desc();
  damage.pose_degrees = 1, damage.pose_share = 0.01;
  fails_never(context, vt_damage_views(context, &damage, views));
  vt_refine_desc desc = vt_default_refine_desc();
  desc.mode = VT_REFINE_ON, desc.fold_count = 2, desc.rounds[0] = 1, desc.rounds[1] = 0;
  desc.turn_deviation = 1, desc.shift_deviation = 0.01;
  fails_never(context, vt_refine_views(context, &desc, views, report));
}

#endif
