// least_squares_none.c - non-linear least squares in builds without Ceres: there are none
// SPDX-License-Identifier: BSD-3-Clause
#include "base/least_squares.h"

vt_least_squares_desc vt_default_least_squares_desc(void) {
  return (vt_least_squares_desc){.cookie = VT_COOKIE, .thread_count = 1, .loss_width = 1};
}

bool vt_can_solve_least_squares(void) {
  return false;
}

vt_status vt_solve_least_squares(vt_context *context, const vt_least_squares_desc *desc, const char *name, int group_count,
                                 const vt_parameter_group *groups, int block_count, const vt_residual_block *blocks,
                                 vt_least_squares_report *or_null) {
  (void)group_count;
  (void)groups;
  (void)block_count;
  (void)blocks;
  VT_ASSERT(desc->cookie == VT_COOKIE);
  if (or_null) *or_null = (vt_least_squares_report){0};
  return vt_fail(context, VT_MISSING_PROGRAM, "%s: this build cannot solve least squares; build voltree with Ceres", name);
}
